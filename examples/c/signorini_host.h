/* What every host of Signorini writes once: a context and a world, views of its arrays, the step with its certificate,
 * and the sums of the reports. Any failure is printed with the library's own words and ends the program: these are
 * examples; a product would go on without contacts. */
#ifndef SIGNORINI_HOST_H
#define SIGNORINI_HOST_H

#include "host_mesh.h"
#include "signorini.h"

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct SignoriniHost {
    SgnContext *context;
    SgnWorld *world;
    SgnMaterialId material;
    /* Over all steps so far. */
    uint64_t steps, contacts, most_contacts, rounds, most_rounds, iterations, divided_steps, fail_safe_steps, unconverged_steps;
    uint64_t uncertified_steps;
    uint64_t intersections; /* of the certificate and of sgn_world_check, which must both be 0 */
    double worst_complementarity, worst_friction, worst_dynamics; /* residuals, relative */
    double momentum_taken[3];                                     /* by pins and half-spaces, and by held zones [N s] */
    double microseconds, worst_microseconds;
    double stage_microseconds[5]; /* search, rows, solve, detection and fail-safes, certificate */
    SgnStepReport last; /* of the last step */
} SignoriniHost;

/* A world with one material; `workers` 0 stays on the calling thread. */
void signorini_host_create(SignoriniHost *host, double friction, uint32_t workers);
void signorini_host_destroy(SignoriniHost *host);

/* Prints the failure of `result`, if it is one, and ends the program. Notes pass. */
void signorini_host_expect(const SignoriniHost *host, SgnResult result, const char *what);

SgnView signorini_view(SgnFormat format, const void *array, uint64_t count);
SgnViewMut signorini_view_mut(SgnFormat format, void *array, uint64_t count);

/* A rigid body from the description, material filled in. */
SgnBodyId signorini_host_add_rigid(SignoriniHost *host, SgnRigidDesc *desc);
void signorini_host_push_velocity(SignoriniHost *host, SgnBodyId body, const double linear[3], const double angular[3]);
void signorini_host_pull_pose(const SignoriniHost *host, SgnBodyId body, double pose[7]);
void signorini_host_pull_end_velocity(const SignoriniHost *host, SgnBodyId body, double linear[3], double angular[3]);
/* One vector of a rigid body: an SGN_SLOT_ of velocities or impulses. */
void signorini_host_pull_vector(const SignoriniHost *host, SgnBodyId body, SgnSlot slot, double vector[3]);

/* One step, certified by the step itself and by a check of the state that it leaves. Returns the step's result. */
SgnResult signorini_host_step(SignoriniHost *host, double dt);

/* The surface of a body as it stands; the mesh (its name apart) points into two arrays that the caller frees. */
void signorini_host_surface(const SignoriniHost *host, SgnBodyId body, HostMesh *mesh, double **positions,
                            uint32_t **triangles);

/* Adds the sums of `other` to those of `host`. */
void signorini_host_add_totals(SignoriniHost *host, const SignoriniHost *other);
void signorini_host_print_totals(const SignoriniHost *host);

#ifdef __cplusplus
}
#endif

#endif
