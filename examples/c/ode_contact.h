/* ODE and Signorini: ODE integrates its bodies and makes joints for its own contacts; every pair that involves the cloth
 * is handed over. */
#ifndef ODE_CONTACT_H
#define ODE_CONTACT_H

#include "host_cloth.h"
#include "signorini_host.h"

#include <ode/ode.h>

/* Category bit of geoms that stand for deformables. */
#define ODE_DEFORMABLE 2ul

typedef struct OdeWorld {
    dWorldID world;
    dSpaceID space;
    dJointGroupID contacts;
    unsigned pairs_handed_over; /* that ODE's collision detection found and made no joint for */
    unsigned joints;            /* contact joints that ODE made */
} OdeWorld;

int ode_world_create(OdeWorld *ode, const double gravity[3]);
void ode_world_destroy(OdeWorld *ode);
/* Collides, makes contact joints for pairs of rigid bodies alone, and ticks once. */
void ode_world_tick(OdeWorld *ode, double dt);

/* The cloth as ODE sees it: a box around it, so that its collision detection tells who is near. */
dGeomID ode_cloth_proxy(OdeWorld *ode, const HostCloth *cloth);
void ode_cloth_proxy_update(dGeomID proxy, const HostCloth *cloth);

/* A body of ODE's in Signorini. */
typedef struct OdeContact {
    SignoriniHost *host;
    dBodyID body;
    SgnBodyId id;
    double start[7]; /* x y z, quaternion x y z w: where our last step left it */
    double displacement_velocity[3]; /* last pushed */
} OdeContact;

/* Mass, inertia and pose of the body go into `desc`, which brings the shape. */
void ode_contact_create(OdeContact *contact, SignoriniHost *host, dBodyID body, SgnRigidDesc *desc);
/* After ODE's tick: where the tick wants to take the body, as a displacement velocity. */
void ode_contact_push(OdeContact *contact, double dt);
/* After our step: pose and end velocity, for ODE's next tick. */
void ode_contact_pull(OdeContact *contact);

#endif
