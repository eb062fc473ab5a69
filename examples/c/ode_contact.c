#include "ode_contact.h"

#include "host_rotation.h"

int ode_world_create(OdeWorld *ode, const double gravity[3])
{
    ode->pairs_handed_over = ode->joints = 0;
    ode->world = dWorldCreate();
    ode->space = dSimpleSpaceCreate(0);
    ode->contacts = dJointGroupCreate(0);
    if (!ode->world || !ode->space || !ode->contacts)
        return 0;
    dWorldSetGravity(ode->world, gravity[0], gravity[1], gravity[2]);
    dWorldSetAutoDisableFlag(ode->world, 0); /* a sleeping body would ignore what the cloth does to it */
    return 1;
}

void ode_world_destroy(OdeWorld *ode)
{
    dJointGroupDestroy(ode->contacts);
    dSpaceDestroy(ode->space);
    dWorldDestroy(ode->world);
}

/* ODE calls this for every pair whose boxes overlap. Making no joint is all it takes to take a pair over. */
static void near_pair(void *data, dGeomID a, dGeomID b)
{
    OdeWorld *ode = data;
    dContact contacts[8];
    int i, count;

    if ((dGeomGetCategoryBits(a) | dGeomGetCategoryBits(b)) & ODE_DEFORMABLE) {
        ode->pairs_handed_over++;
        return;
    }
    count = dCollide(a, b, 8, &contacts[0].geom, sizeof contacts[0]);
    for (i = 0; i < count; i++) {
        contacts[i].surface.mode = dContactApprox1;
        contacts[i].surface.mu = 0.5;
        dJointAttach(dJointCreateContact(ode->world, ode->contacts, &contacts[i]), dGeomGetBody(a), dGeomGetBody(b));
        ode->joints++;
    }
}

void ode_world_tick(OdeWorld *ode, double dt)
{
    dSpaceCollide(ode->space, ode, near_pair);
    dWorldStep(ode->world, dt);
    dJointGroupEmpty(ode->contacts);
}

dGeomID ode_cloth_proxy(OdeWorld *ode, const HostCloth *cloth)
{
    dGeomID proxy = dCreateBox(ode->space, 1.0, 1.0, 1.0);
    dGeomSetCategoryBits(proxy, ODE_DEFORMABLE);
    ode_cloth_proxy_update(proxy, cloth);
    return proxy;
}

void ode_cloth_proxy_update(dGeomID proxy, const HostCloth *cloth)
{
    double low[3], high[3], margin = 0.0;
    uint32_t i, k;

    for (k = 0; k < 3; k++)
        low[k] = high[k] = cloth->positions[k];
    for (i = 3; i < 3 * cloth->vertex_count; i++) {
        low[i % 3] = fmin(low[i % 3], cloth->positions[i]);
        high[i % 3] = fmax(high[i % 3], cloth->positions[i]);
    }
    for (k = 0; k < 3; k++)
        margin = fmax(margin, 0.01 * (high[k] - low[k])); /* a flat cloth has a box all the same */
    dGeomBoxSetLengths(proxy, high[0] - low[0] + margin, high[1] - low[1] + margin, high[2] - low[2] + margin);
    dGeomSetPosition(proxy, 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2]));
}

/* ODE keeps quaternions as w x y z; Signorini takes x y z w. */
static void read_pose(dBodyID body, double pose[7])
{
    const dReal *x = dBodyGetPosition(body), *q = dBodyGetQuaternion(body);
    int i;

    for (i = 0; i < 3; i++) {
        pose[i] = x[i];
        pose[3 + i] = q[1 + i];
    }
    pose[6] = q[0];
}

void ode_contact_create(OdeContact *contact, SignoriniHost *host, dBodyID body, SgnRigidDesc *desc)
{
    dMass mass;
    int i, j;

    contact->host = host;
    contact->body = body;
    read_pose(body, contact->start);
    dBodyGetMass(body, &mass); /* about the centre of mass, in the body frame, rows of four */
    desc->mass = mass.mass;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            desc->inertia[3 * i + j] = mass.I[4 * i + j];
    for (i = 0; i < 3; i++)
        desc->position[i] = contact->start[i];
    for (i = 0; i < 4; i++)
        desc->orientation[i] = contact->start[3 + i];
    contact->id = signorini_host_add_rigid(host, desc);
}

void ode_contact_push(OdeContact *contact, double dt)
{
    double end[7], angular[3];
    int i;

    read_pose(contact->body, end);
    for (i = 0; i < 3; i++)
        contact->displacement_velocity[i] = (end[i] - contact->start[i]) / dt;
    host_angular_velocity(contact->start + 3, end + 3, dt, angular);
    signorini_host_push_velocity(contact->host, contact->id, contact->displacement_velocity, angular);
}

void ode_contact_pull(OdeContact *contact)
{
    double linear[3], angular[3];
    const double *p = contact->start;
    dQuaternion q;

    signorini_host_pull_pose(contact->host, contact->id, contact->start);
    signorini_host_pull_end_velocity(contact->host, contact->id, linear, angular);
    q[0] = p[6], q[1] = p[3], q[2] = p[4], q[3] = p[5];
    dBodySetPosition(contact->body, p[0], p[1], p[2]);
    dBodySetQuaternion(contact->body, q);
    dBodySetLinearVel(contact->body, linear[0], linear[1], linear[2]);
    dBodySetAngularVel(contact->body, angular[0], angular[1], angular[2]);
}
