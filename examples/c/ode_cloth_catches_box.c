/* A cloth held at its corners catches a box of ODE's: bullet_cloth_catches_box in C99, with ODE.
 *
 * The cloth is the host's own (host_cloth.h), the box is ODE's: ODE integrates it, makes no joint with what catches it,
 * and takes its end state from Signorini. Asserted for every run: all frames certified, the box above the cloth, at rest
 * at the end, and the impulses that the contacts gave it adding up to its weight times the time.
 *
 *   ode_cloth_catches_box [RUNS [SEED]] [--frames FOLDER] */
#include "cloth_contact.h"
#include "example_run.h"
#include "ode_contact.h"

#include <math.h>
#include <stdio.h>

#define DT 0.01
#define GRAVITY 9.81
#define BOX_MASS 1.5
#define STEPS 380
#define LAST 100 /* the last second is measured */

static const double HALF_EXTENTS[3] = {0.14, 0.1, 0.12};

static HostCloth *make_cloth(uint64_t *random)
{
    HostClothSettings s = {0};
    HostCloth *cloth;
    uint32_t i;

    s.columns = s.rows = 17;
    s.origin[0] = s.origin[2] = -0.6;
    s.along[0] = s.across[2] = 1.2;
    s.mass = 0.25;
    s.stretch_stiffness = 1200.0;
    s.shear_stiffness = 400.0;
    s.bend_stiffness = 0.5;
    s.damping_time = 0.03;
    s.drag = 2.0;
    s.gravity[1] = -GRAVITY;
    s.linear_tolerance = 1e-9;
    cloth = host_cloth_create(&s);
    if (!cloth)
        return NULL;
    for (i = 0; i < 3 * cloth->vertex_count; i++)
        cloth->positions[i] += 1e-3 * host_random(random);
    for (i = 0; i < 4; i++)
        host_cloth_pin(cloth, host_cloth_vertex(cloth, i % 2 ? s.columns - 1 : 0, i / 2 ? s.rows - 1 : 0));
    return cloth;
}

/* A box at a jittered place and tilt. */
static dBodyID make_box(OdeWorld *ode, uint64_t *random)
{
    dBodyID body = dBodyCreate(ode->world);
    dGeomID geom = dCreateBox(ode->space, 2 * HALF_EXTENTS[0], 2 * HALF_EXTENTS[1], 2 * HALF_EXTENTS[2]);
    dMass mass;
    dQuaternion turn;

    dMassSetBoxTotal(&mass, BOX_MASS, 2 * HALF_EXTENTS[0], 2 * HALF_EXTENTS[1], 2 * HALF_EXTENTS[2]);
    dBodySetMass(body, &mass);
    dGeomSetBody(geom, body);
    dBodySetPosition(body, 0.05 * host_random(random), 0.35, 0.05 * host_random(random));
    dQFromAxisAndAngle(turn, host_random(random), 2.0, host_random(random), host_random(random));
    dBodySetQuaternion(body, turn);
    return body;
}

static double length(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static int run(ExampleRun *example)
{
    const double gravity[3] = {0.0, -GRAVITY, 0.0}, down[3] = {0.0, -1.0, 0.0}, weight = BOX_MASS * GRAVITY * DT * LAST;
    double lifted[3] = {0.0, 0.0, 0.0}, pressed[3] = {0.0, 0.0, 0.0}, sum[3], sideways;
    SignoriniHost host;
    HostCloth *cloth = make_cloth(&example->random);
    ClothContact cloth_contact;
    OdeWorld ode;
    OdeContact box;
    dGeomID proxy;
    SgnShapeDesc shape;
    SgnRigidDesc desc;
    int good = 1, step, k;

    if (!cloth || !ode_world_create(&ode, gravity))
        return example_fail(example, "no cloth or no world");
    signorini_host_create(&host, 0.5, 0);
    cloth_contact_create(&cloth_contact, &host, cloth, CLOTH_MATRIX, 0.004);
    proxy = ode_cloth_proxy(&ode, cloth);

    sgn_shape_desc_init(&shape, sizeof shape);
    sgn_rigid_desc_init(&desc, sizeof desc);
    shape.kind = SGN_SHAPE_BOX;
    for (k = 0; k < 3; k++)
        shape.half_extents[k] = HALF_EXTENTS[k];
    desc.shape = &shape;
    desc.half_thickness = 0.004;
    ode_contact_create(&box, &host, make_box(&ode, &example->random), &desc);

    for (step = 0; step < STEPS && good; step++) {
        /* The host loop: the engines tick, push what they want, our step, write back what they get. */
        ode_cloth_proxy_update(proxy, cloth);
        ode_world_tick(&ode, DT);
        if (host_cloth_predict(cloth, DT) < 0)
            good = example_fail(example, "the cloth's linear solver did not converge");
        ode_contact_push(&box, DT);
        cloth_contact_push(&cloth_contact);
        signorini_host_step(&host, DT);
        ode_contact_pull(&box);
        cloth_contact_pull(&cloth_contact);

        if (host_cloth_crossings(cloth, box.start, down) % 2 != 1)
            good = example_fail(example, "the box is not above the cloth");
        if (step >= STEPS - LAST) {
            double on_box[3], on_cloth[3];
            signorini_host_pull_vector(&host, box.id, SGN_SLOT_IMPULSE, on_box);
            cloth_contact_impulse(&cloth_contact, on_cloth);
            for (k = 0; k < 3; k++) {
                lifted[k] += on_box[k];
                pressed[k] += on_cloth[k];
            }
        }
        if (!example_write_frame(example, step, cloth, &host, box.id, "box"))
            good = example_fail(example, "no frame");
    }

    for (k = 0; k < 3; k++)
        sum[k] = lifted[k] + pressed[k];
    sideways = sqrt(lifted[0] * lifted[0] + lifted[2] * lifted[2]);
    printf("run %d: speed %.2e m/s, turning %.2e rad/s, impulse/weight %.5f, sideways %.1e, pairs handed over %u\n",
           example->index, length(dBodyGetLinearVel(box.body)), length(dBodyGetAngularVel(box.body)), lifted[1] / weight,
           sideways / weight, ode.pairs_handed_over);
    example_expect(example, &good, length(dBodyGetLinearVel(box.body)) < 0.02, "the box is at rest");
    example_expect(example, &good, length(dBodyGetAngularVel(box.body)) < 0.1, "the box does not turn");
    example_expect(example, &good, fabs(lifted[1] / weight - 1.0) < 0.01, "the impulses carry the weight within 1 %");
    example_expect(example, &good, sideways / weight < 0.01, "the impulses point up within 1 %");
    example_expect(example, &good, length(sum) < 1e-9 * weight, "what the box gets the cloth gives");
    example_expect(example, &good, ode.joints == 0 && ode.pairs_handed_over > 0, "ODE handed the pair over");
    example_expect(example, &good, host.intersections == 0 && host.uncertified_steps == 0, "every frame is certified");

    signorini_host_add_totals(&example->totals, &host);
    cloth_contact_destroy(&cloth_contact);
    host_cloth_destroy(cloth);
    ode_world_destroy(&ode);
    signorini_host_destroy(&host);
    return good;
}

int main(int argc, char **argv)
{
    ExampleRun example;

    if (!example_begin(&example, "ode_cloth_catches_box", argc, argv))
        return 2;
    dInitODE2(0);
    while (example_next(&example))
        run(&example);
    dCloseODE();
    return example_end(&example);
}
