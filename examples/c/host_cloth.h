/* A small implicit mass-spring cloth: the kind of solver a host already has.
 *
 * It knows nothing of contact. Each step it linearises its springs once (backward Euler, one Newton step) and solves
 *
 *     A v* = b,    A = M - dt dF/dv - dt^2 dF/dx,    b = M v0 + dt F
 *
 * (F at x0 without the damping forces: those act through A alone) for the velocity v* that it would move with if nothing stood in the way. A contact solver takes x0, v*, the masses
 * and, if the host wishes, A; what comes back is the end state. `cloth_contact.h` is that connection.
 *
 * Units: metres, kilograms, seconds. Arrays are x y z interleaved, one triple per vertex. */
#ifndef HOST_CLOTH_H
#define HOST_CLOTH_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct HostClothSettings {
    uint32_t columns, rows;   /* vertices along and across, at least 2 each */
    double origin[3];         /* position of vertex 0 [m] */
    double along[3];          /* from the first to the last column [m] */
    double across[3];         /* from the first to the last row [m] */
    double mass;              /* of the whole cloth [kg] */
    double stretch_stiffness; /* springs between grid neighbours [N/m] */
    double shear_stiffness;   /* springs along both diagonals of a cell [N/m] */
    double bend_stiffness;    /* springs between second neighbours [N/m] */
    double damping_time;      /* spring damping = stiffness times this [s] */
    double drag;              /* velocity lost to the air per second [1/s] */
    double gravity[3];        /* [m/s^2] */
    double linear_tolerance;  /* of the linear solver, relative to |b| */
} HostClothSettings;

typedef struct HostSpring {
    uint32_t a, b;
    double rest_length, stiffness, damping;
    size_t block_ab, block_ba; /* where its two off-diagonal blocks stand in `blocks` */
} HostSpring;

typedef struct HostCloth {
    HostClothSettings settings;
    uint32_t vertex_count, triangle_count, spring_count;

    double *positions;     /* start of the step, 3 per vertex */
    double *velocities;    /* 3 per vertex */
    double *free_velocity; /* v*, written by host_cloth_predict, 3 per vertex */
    double *masses;        /* 1 per vertex */
    uint8_t *pinned;       /* 1: the vertex keeps its velocity, whatever acts on it */
    uint32_t *triangles;   /* 3 per triangle */
    HostSpring *springs;

    /* A as 3x3 blocks in compressed rows: columns ascending, diagonal present, rows of pinned vertices eliminated. */
    size_t block_count;
    uint64_t *row_offsets; /* vertex_count + 1 */
    uint32_t *columns;     /* block_count */
    double *blocks;        /* 9 per block, row major */
    size_t *diagonal;      /* index of each row's diagonal block */

    double *work; /* right side and vectors of the solver */
} HostCloth;

/* A flat rectangular cloth at rest; NULL when memory is short or the settings make no cloth. */
HostCloth *host_cloth_create(const HostClothSettings *settings);
void host_cloth_destroy(HostCloth *cloth);

uint32_t host_cloth_vertex(const HostCloth *cloth, uint32_t column, uint32_t row);
void host_cloth_pin(HostCloth *cloth, uint32_t vertex);
void host_cloth_release(HostCloth *cloth, uint32_t vertex);

/* Assembles A and solves for v*. Returns the iterations of the linear solver, or -1 if it did not converge. */
int host_cloth_predict(HostCloth *cloth, double dt);

/* Sum of mass times velocity [kg m/s]. */
void host_cloth_momentum(const HostCloth *cloth, double momentum[3]);
double host_cloth_kinetic_energy(const HostCloth *cloth);
double host_cloth_fastest(const HostCloth *cloth);

/* How often the half-line from `point` along `direction` crosses the cloth. Over a cloth that is pinned all round it is
 * odd from the one side and even from the other: a test for tunnelling that needs no collision library. */
int host_cloth_crossings(const HostCloth *cloth, const double point[3], const double direction[3]);

/* Random number in [-1, 1], the same sequence for the same start on every machine. */
double host_random(uint64_t *state);

#ifdef __cplusplus
}
#endif

#endif
