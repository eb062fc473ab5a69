/* A sphere at 100 m/s strikes a thin cloth that is pinned all round, at a time step of 10 ms: it flies a metre, five
 * times its own diameter, in one step.
 *
 * Asserted for every step of every run: the sphere stays on its side of the cloth (counted by a half-line, without any
 * collision library), nothing moves faster than twice the speed of the impact, and the frame is certified. In the end
 * the cloth has turned the sphere back.
 *
 *   ode_fast_sphere, bullet_fast_sphere [RUNS [SEED]] [--frames FOLDER] */
#include "example_run.h"

#include <math.h>
#include <stdio.h>

#define DT 0.01
#define SPEED 100.0
#define RADIUS 0.1
#define SPHERE_MASS 0.05
#define HALF_THICKNESS 0.001
#define FRICTION 0.3
#define STEPS 20 /* then the sphere is still over the cloth */

static HostCloth *make_cloth(ExampleRun *run)
{
    HostClothSettings s = {0};
    HostCloth *cloth;
    uint32_t row, column;

    s.columns = s.rows = 31;
    s.origin[0] = s.origin[2] = -1.0;
    s.along[0] = s.across[2] = 2.0;
    s.mass = 0.4;
    s.stretch_stiffness = 20000.0;
    s.shear_stiffness = 6000.0;
    s.bend_stiffness = 1.0;
    s.damping_time = 0.001;
    s.linear_tolerance = 1e-9;
    cloth = example_cloth(run, &s);
    for (row = 0; cloth && row < s.rows; row++)
        for (column = 0; column < s.columns; column++)
            if (row == 0 || column == 0 || row == s.rows - 1 || column == s.columns - 1)
                host_cloth_pin(cloth, host_cloth_vertex(cloth, column, row));
    return cloth;
}

static EngineBody make_sphere(ExampleRun *run)
{
    EngineBody sphere = {0};

    sphere.shape = SGN_SHAPE_SPHERE;
    sphere.radius = RADIUS;
    sphere.mass = SPHERE_MASS;
    /* Any height over one metre: where within its step the sphere strikes differs from run to run. */
    sphere.position[0] = 0.3 * example_random(run);
    sphere.position[1] = 1.7 + 0.5 * example_random(run);
    sphere.position[2] = 0.3 * example_random(run);
    sphere.orientation[3] = 1.0;
    sphere.velocity[1] = -SPEED;
    return sphere;
}

static int one_run(ExampleRun *run)
{
    double fastest = 0.0, lowest = 1e9;
    ExampleScene scene;
    HostCloth *cloth = make_cloth(run);
    EngineBody sphere = make_sphere(run);

    if (!example_open(&scene, run, cloth, CLOTH_MATRIX, &sphere, FRICTION, HALF_THICKNESS))
        return 0;
    while (scene.step < STEPS && example_step(&scene, DT)) {
        example_expect_above(&scene);
        fastest = fmax(fastest, fmax(host_cloth_fastest(cloth), example_length(scene.body.velocity)));
        lowest = fmin(lowest, scene.body.position[1]);
    }
    printf("run %d: fastest %.1f m/s, sphere down to %.3f m, leaves at %.1f m/s\n", run->index, fastest, lowest,
           scene.body.velocity[1]);
    example_expect(&scene, fastest <= 2.0 * SPEED, "nothing is faster than twice the impact");
    example_expect(&scene, lowest < 0.0, "the cloth was struck");
    example_expect(&scene, scene.body.velocity[1] > -0.2 * SPEED, "the cloth stopped the sphere");
    return example_close(&scene);
}

int main(int argc, char **argv)
{
    return example_main("fast_sphere", one_run, argc, argv);
}
