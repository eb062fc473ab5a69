/* ODE as the engine of an example scene. */
#include "example_engine.h"
#include "ode_contact.h"

#include <stdlib.h>

struct Engine {
    OdeWorld ode;
    OdeContact contact;
    dGeomID proxy;
    const HostCloth *cloth;
};

const char *engine_name(void)
{
    return "ode";
}

static dBodyID make_body(OdeWorld *ode, const EngineBody *settings)
{
    const double *h = settings->half_extents, *x = settings->position, *v = settings->velocity, *q = settings->orientation;
    const int is_box = settings->shape == SGN_SHAPE_BOX;
    dBodyID body = dBodyCreate(ode->world);
    dGeomID geom = is_box ? dCreateBox(ode->space, 2 * h[0], 2 * h[1], 2 * h[2]) : dCreateSphere(ode->space, settings->radius);
    dQuaternion turn;
    dMass mass;

    if (is_box)
        dMassSetBoxTotal(&mass, settings->mass, 2 * h[0], 2 * h[1], 2 * h[2]);
    else
        dMassSetSphereTotal(&mass, settings->mass, settings->radius);
    turn[0] = q[3], turn[1] = q[0], turn[2] = q[1], turn[3] = q[2];
    dBodySetMass(body, &mass);
    dGeomSetBody(geom, body);
    dBodySetPosition(body, x[0], x[1], x[2]);
    dBodySetQuaternion(body, turn);
    dBodySetLinearVel(body, v[0], v[1], v[2]);
    return body;
}

Engine *engine_create(const double gravity[3], const EngineBody *body, SgnRigidDesc *desc, SignoriniHost *host,
                      HostCloth *cloth)
{
    Engine *engine = calloc(1, sizeof *engine);

    if (!engine)
        return NULL;
    dInitODE2(0);
    if (!ode_world_create(&engine->ode, gravity)) {
        dCloseODE();
        free(engine);
        return NULL;
    }
    engine->cloth = cloth;
    engine->proxy = ode_cloth_proxy(&engine->ode, cloth);
    ode_contact_create(&engine->contact, host, make_body(&engine->ode, body), desc);
    return engine;
}

void engine_destroy(Engine *engine)
{
    ode_world_destroy(&engine->ode);
    dCloseODE();
    free(engine);
}

void engine_tick(Engine *engine, double dt)
{
    ode_world_tick(&engine->ode, dt);
}

void engine_push(Engine *engine, double dt)
{
    ode_contact_push(&engine->contact, dt);
}

void engine_pull(Engine *engine)
{
    ode_contact_pull(&engine->contact);
    ode_cloth_proxy_update(engine->proxy, engine->cloth);
}

void engine_state(const Engine *engine, EngineState *state)
{
    const dReal *velocity = dBodyGetLinearVel(engine->contact.body), *turning = dBodyGetAngularVel(engine->contact.body);
    int k;

    state->id = engine->contact.id;
    for (k = 0; k < 3; k++) {
        state->position[k] = engine->contact.start[k];
        state->velocity[k] = velocity[k];
        state->angular_velocity[k] = turning[k];
        state->displacement_velocity[k] = engine->contact.displacement_velocity[k];
    }
    state->own_contacts = engine->ode.joints;
    state->pairs_handed_over = engine->ode.pairs_handed_over;
}
