/* A free cloth strikes a free sphere and wraps around it: no gravity, no damping in the host, lumped masses.
 *
 * Nothing outside acts on the two, so what the cloth loses the sphere must gain. Asserted for every step of every run:
 * the impulses on cloth and sphere are equal and opposite to 1e-9, the sphere's momentum changes by the impulse that was
 * pulled, the total momentum is kept to 1e-9, and the frame is certified. At the end the cloth reaches around the sphere.
 *
 *   ode_sphere_wrapped, bullet_sphere_wrapped [RUNS [SEED]] [--frames FOLDER] */
#include "example_run.h"

#include <math.h>
#include <stdio.h>

#define DT 0.005
#define RADIUS 0.2
#define SPHERE_MASS 0.6
#define SPEED 4.0
#define HALF_THICKNESS 0.004
#define FRICTION 0.3
#define STEPS 120
#define EXACT 1e-9

/* A cloth that flies along z towards the sphere at the origin. */
static HostCloth *make_cloth(ExampleRun *run)
{
    HostClothSettings s = {0};
    HostCloth *cloth;
    uint32_t v;

    s.columns = s.rows = 25;
    s.origin[0] = -0.6 + 0.05 * example_random(run);
    s.origin[1] = -0.6 + 0.05 * example_random(run);
    s.origin[2] = -0.33;
    s.along[0] = s.across[1] = 1.2;
    s.along[2] = 0.1 * example_random(run); /* it does not strike quite flat */
    s.across[2] = 0.1 * example_random(run);
    s.mass = 0.3;
    s.stretch_stiffness = 800.0;
    s.shear_stiffness = 200.0;
    s.bend_stiffness = 0.2;
    s.linear_tolerance = 1e-13;
    cloth = example_cloth(run, &s);
    for (v = 0; cloth && v < cloth->vertex_count; v++)
        cloth->velocities[3 * v + 2] = SPEED;
    return cloth;
}

static void total_momentum(const ExampleScene *scene, double total[3])
{
    int k;

    host_cloth_momentum(scene->cloth, total);
    for (k = 0; k < 3; k++)
        total[k] += SPHERE_MASS * scene->body.velocity[k];
}

/* Momentum exchanged so far, and the largest errors of all steps, relative to what the cloth brought. */
typedef struct Ledger {
    double before[3], exchanged[3];
    double action_reaction, change, total;
} Ledger;

static void book(Ledger *ledger, const ExampleScene *scene)
{
    double on_sphere[3], on_cloth[3], velocity[3], total[3], pair[3], change[3], drift[3];
    const double brought = example_length(ledger->before);
    int k;

    signorini_host_pull_vector(&scene->host, scene->body.id, SGN_SLOT_IMPULSE, on_sphere);
    signorini_host_pull_vector(&scene->host, scene->body.id, SGN_SLOT_VELOCITY, velocity);
    cloth_contact_impulse(&scene->cloth_contact, on_cloth);
    total_momentum(scene, total);
    for (k = 0; k < 3; k++) {
        ledger->exchanged[k] += on_sphere[k];
        pair[k] = on_sphere[k] + on_cloth[k];
        change[k] = SPHERE_MASS * (velocity[k] - scene->body.displacement_velocity[k]) - on_sphere[k];
        drift[k] = total[k] - ledger->before[k];
    }
    ledger->action_reaction = fmax(ledger->action_reaction, example_length(pair) / brought);
    ledger->change = fmax(ledger->change, example_length(change) / brought);
    ledger->total = fmax(ledger->total, example_length(drift) / brought);
}

/* Cloth vertices near the surface, beyond the sphere's middle plane, all around. */
static int is_wrapped(const ExampleScene *scene)
{
    int sides[4] = {0, 0, 0, 0};
    uint32_t v;
    int k;

    for (v = 0; v < scene->cloth->vertex_count; v++) {
        double d[3];
        for (k = 0; k < 3; k++)
            d[k] = scene->cloth->positions[3 * v + k] - scene->body.position[k];
        if (d[2] > 0.0 && example_length(d) < 2.0 * RADIUS)
            sides[fabs(d[0]) > fabs(d[1]) ? (d[0] > 0.0 ? 0 : 1) : (d[1] > 0.0 ? 2 : 3)] = 1;
    }
    return sides[0] && sides[1] && sides[2] && sides[3];
}

static int one_run(ExampleRun *run)
{
    ExampleScene scene;
    Ledger ledger = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 0.0, 0.0, 0.0};
    EngineBody sphere = {0};

    sphere.shape = SGN_SHAPE_SPHERE;
    sphere.radius = RADIUS;
    sphere.mass = SPHERE_MASS;
    sphere.orientation[3] = 1.0;
    if (!example_open(&scene, run, make_cloth(run), CLOTH_LUMPED, &sphere, FRICTION, HALF_THICKNESS))
        return 0;
    total_momentum(&scene, ledger.before);
    while (scene.step < STEPS && example_step(&scene, DT))
        book(&ledger, &scene);

    printf("run %d: exchanged %.3f of %.3f Ns; action + reaction %.1e, sphere's change - impulse %.1e, total momentum %.1e\n",
           run->index, ledger.exchanged[2], ledger.before[2], ledger.action_reaction, ledger.change, ledger.total);
    example_expect(&scene, ledger.action_reaction < EXACT, "impulses are equal and opposite to 1e-9");
    example_expect(&scene, ledger.change < EXACT, "the sphere changes by the impulse pulled, to 1e-9");
    example_expect(&scene, ledger.total < EXACT, "total momentum is kept to 1e-9");
    example_expect(&scene, ledger.exchanged[2] > 0.1 * ledger.before[2], "the sphere was struck");
    example_expect(&scene, is_wrapped(&scene), "the cloth is wrapped around the sphere");
    return example_close(&scene);
}

int main(int argc, char **argv)
{
    return example_main("sphere_wrapped", one_run, argc, argv);
}
