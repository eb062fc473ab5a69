/* The engine that an example scene runs in: one rigid body, integrated by ODE (ode_engine.c) or by Bullet
 * (../cpp/bullet_engine.cpp). A program links one of the two; the scene does not know which. */
#ifndef EXAMPLE_ENGINE_H
#define EXAMPLE_ENGINE_H

#include "host_cloth.h"
#include "signorini_host.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct EngineBody {
    SgnShape shape; /* SGN_SHAPE_BOX or SGN_SHAPE_SPHERE */
    double half_extents[3], radius;
    double mass, position[3];
    double orientation[4]; /* x y z w, of any length but zero */
    double velocity[3];
} EngineBody;

/* How things stand after a step. */
typedef struct EngineState {
    SgnBodyId id;                       /* of the body in Signorini */
    double position[3], velocity[3], angular_velocity[3];
    double displacement_velocity[3];    /* that the tick wanted and that was pushed */
    unsigned own_contacts;              /* that the engine made */
    unsigned pairs_handed_over;         /* that it found and left to Signorini */
} EngineState;

typedef struct Engine Engine;

/* "ode" or "bullet" */
const char *engine_name(void);
/* A world with the body and, for the engine's own queries, the cloth. `desc` brings the shape and the thickness, and gets
 * the mass and the pose of the engine's body. NULL on failure. */
Engine *engine_create(const double gravity[3], const EngineBody *body, SgnRigidDesc *desc, SignoriniHost *host,
                      HostCloth *cloth);
void engine_destroy(Engine *engine);
void engine_tick(Engine *engine, double dt);
/* After the tick: where it wants to take the body. */
void engine_push(Engine *engine, double dt);
/* After our step, the cloth's included: where the body may go. */
void engine_pull(Engine *engine);
void engine_state(const Engine *engine, EngineState *state);

#ifdef __cplusplus
}
#endif

#endif
