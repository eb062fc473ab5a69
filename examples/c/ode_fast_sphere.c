/* A sphere of ODE's at 100 m/s strikes a thin cloth that is pinned all round, at a time step of 10 ms: it flies a metre,
 * five times its own diameter, in one step.
 *
 * Asserted for every step of every run: the sphere stays on its side of the cloth (counted by a half-line, without any
 * collision library), nothing moves faster than twice the speed of the impact, and the frame is certified. In the end
 * the cloth has turned the sphere back.
 *
 *   ode_fast_sphere [RUNS [SEED]] [--frames FOLDER] */
#include "cloth_contact.h"
#include "example_run.h"
#include "ode_contact.h"

#include <math.h>
#include <stdio.h>

#define DT 0.01
#define SPEED 100.0
#define RADIUS 0.1
#define SPHERE_MASS 0.05
#define STEPS 30

static HostCloth *make_cloth(uint64_t *random)
{
    HostClothSettings s = {0};
    HostCloth *cloth;
    uint32_t i, row, column;

    s.columns = s.rows = 31;
    s.origin[0] = s.origin[2] = -1.0;
    s.along[0] = s.across[2] = 2.0;
    s.mass = 0.4;
    s.stretch_stiffness = 20000.0;
    s.shear_stiffness = 6000.0;
    s.bend_stiffness = 1.0;
    s.damping_time = 0.001;
    s.linear_tolerance = 1e-9;
    cloth = host_cloth_create(&s);
    if (!cloth)
        return NULL;
    for (i = 0; i < 3 * cloth->vertex_count; i++)
        cloth->positions[i] += 1e-3 * host_random(random);
    for (row = 0; row < s.rows; row++)
        for (column = 0; column < s.columns; column++)
            if (row == 0 || column == 0 || row == s.rows - 1 || column == s.columns - 1)
                host_cloth_pin(cloth, host_cloth_vertex(cloth, column, row));
    return cloth;
}

static dBodyID make_sphere(OdeWorld *ode, uint64_t *random)
{
    dBodyID body = dBodyCreate(ode->world);
    dGeomID geom = dCreateSphere(ode->space, RADIUS);
    dMass mass;

    dMassSetSphereTotal(&mass, SPHERE_MASS, RADIUS);
    dBodySetMass(body, &mass);
    dGeomSetBody(geom, body);
    /* Any height over one metre: where within its step the sphere strikes differs from run to run. */
    dBodySetPosition(body, 0.3 * host_random(random), 1.7 + 0.5 * host_random(random), 0.3 * host_random(random));
    dBodySetLinearVel(body, 0.0, -SPEED, 0.0);
    return body;
}

static double length(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static int run(ExampleRun *example)
{
    const double gravity[3] = {0.0, 0.0, 0.0}, down[3] = {0.0, -1.0, 0.0};
    double fastest = 0.0, lowest = 1e9;
    SignoriniHost host;
    HostCloth *cloth = make_cloth(&example->random);
    ClothContact cloth_contact;
    OdeWorld ode;
    OdeContact sphere;
    dGeomID proxy;
    SgnShapeDesc shape;
    SgnRigidDesc desc;
    int good = 1, step;

    if (!cloth || !ode_world_create(&ode, gravity))
        return example_fail(example, "no cloth or no world");
    signorini_host_create(&host, 0.3, 0);
    cloth_contact_create(&cloth_contact, &host, cloth, CLOTH_MATRIX, 0.001);
    proxy = ode_cloth_proxy(&ode, cloth);

    sgn_shape_desc_init(&shape, sizeof shape);
    sgn_rigid_desc_init(&desc, sizeof desc);
    shape.kind = SGN_SHAPE_SPHERE;
    shape.radius = RADIUS;
    desc.shape = &shape;
    desc.half_thickness = 0.001;
    ode_contact_create(&sphere, &host, make_sphere(&ode, &example->random), &desc);

    for (step = 0; step < STEPS && good; step++) {
        ode_cloth_proxy_update(proxy, cloth);
        ode_world_tick(&ode, DT);
        if (host_cloth_predict(cloth, DT) < 0)
            good = example_fail(example, "the cloth's linear solver did not converge");
        ode_contact_push(&sphere, DT);
        cloth_contact_push(&cloth_contact);
        signorini_host_step(&host, DT);
        ode_contact_pull(&sphere);
        cloth_contact_pull(&cloth_contact);

        if (host_cloth_crossings(cloth, sphere.start, down) % 2 != 1)
            good = example_fail(example, "the sphere went through the cloth");
        fastest = fmax(fastest, fmax(host_cloth_fastest(cloth), length(dBodyGetLinearVel(sphere.body))));
        lowest = fmin(lowest, sphere.start[1]);
        if (!example_write_frame(example, step, cloth, &host, sphere.id, "sphere"))
            good = example_fail(example, "no frame");
    }

    printf("run %d: fastest %.1f m/s, sphere down to %.3f m, leaves at %.1f m/s\n", example->index, fastest, lowest,
           dBodyGetLinearVel(sphere.body)[1]);
    example_expect(example, &good, fastest <= 2.0 * SPEED, "nothing is faster than twice the impact");
    example_expect(example, &good, lowest < 0.0, "the cloth was struck");
    example_expect(example, &good, dBodyGetLinearVel(sphere.body)[1] > -0.2 * SPEED, "the cloth stopped the sphere");
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

    if (!example_begin(&example, "ode_fast_sphere", argc, argv))
        return 2;
    dInitODE2(0);
    while (example_next(&example))
        run(&example);
    dCloseODE();
    return example_end(&example);
}
