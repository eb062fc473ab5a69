/* A cloth held at its corners catches a box.
 *
 * The cloth is the host's own (host_cloth.h), the box is the engine's: ODE or Bullet integrates it, makes no contact with
 * what catches it, and takes its end state from Signorini. Asserted for every run: all frames certified, the box above
 * the cloth, at rest at the end, and the impulses that the contacts gave it adding up to its weight times the time.
 *
 *   ode_cloth_catches_box, bullet_cloth_catches_box [RUNS [SEED]] [--frames FOLDER] */
#include "example_run.h"

#include <math.h>
#include <stdio.h>

#define DT 0.01
#define GRAVITY 9.81
#define BOX_MASS 1.5
#define HALF_THICKNESS 0.004
#define FRICTION 0.5
#define STEPS 380
#define LAST 100 /* the last second is measured */

static HostCloth *make_cloth(ExampleRun *run)
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
    cloth = example_cloth(run, &s);
    for (i = 0; cloth && i < 4; i++)
        host_cloth_pin(cloth, host_cloth_vertex(cloth, i % 2 ? s.columns - 1 : 0, i / 2 ? s.rows - 1 : 0));
    return cloth;
}

/* A box at a jittered place and tilt. */
static EngineBody make_box(ExampleRun *run)
{
    EngineBody box = {0};
    double axis[3], half_angle = 0.5 * example_random(run);
    int k;

    box.shape = SGN_SHAPE_BOX;
    box.half_extents[0] = 0.14, box.half_extents[1] = 0.1, box.half_extents[2] = 0.12;
    box.mass = BOX_MASS;
    box.position[0] = 0.05 * example_random(run);
    box.position[1] = 0.35;
    box.position[2] = 0.05 * example_random(run);
    axis[0] = example_random(run), axis[1] = 2.0, axis[2] = example_random(run);
    for (k = 0; k < 3; k++)
        box.orientation[k] = sin(half_angle) * axis[k] / example_length(axis);
    box.orientation[3] = cos(half_angle);
    return box;
}

static int one_run(ExampleRun *run)
{
    const double weight = BOX_MASS * GRAVITY * DT * LAST;
    double lifted[3] = {0.0, 0.0, 0.0}, pressed[3] = {0.0, 0.0, 0.0}, sum[3], speed, turning, sideways;
    ExampleScene scene;
    HostCloth *cloth = make_cloth(run);
    EngineBody box = make_box(run);
    int k;

    if (!example_open(&scene, run, cloth, CLOTH_MATRIX, &box, FRICTION, HALF_THICKNESS))
        return 0;
    while (scene.step < STEPS && example_step(&scene, DT)) {
        example_expect_above(&scene);
        if (scene.step > STEPS - LAST) {
            double on_box[3], on_cloth[3];
            signorini_host_pull_vector(&scene.host, scene.body.id, SGN_SLOT_IMPULSE, on_box);
            cloth_contact_impulse(&scene.cloth_contact, on_cloth);
            for (k = 0; k < 3; k++) {
                lifted[k] += on_box[k];
                pressed[k] += on_cloth[k];
            }
        }
    }

    for (k = 0; k < 3; k++)
        sum[k] = lifted[k] + pressed[k];
    speed = example_length(scene.body.velocity);
    turning = example_length(scene.body.angular_velocity);
    sideways = sqrt(lifted[0] * lifted[0] + lifted[2] * lifted[2]);
    printf("run %d: speed %.2e m/s, turning %.2e rad/s, impulse/weight %.5f, sideways %.1e, pairs handed over %u\n",
           run->index, speed, turning, lifted[1] / weight, sideways / weight, scene.body.pairs_handed_over);
    example_expect(&scene, speed < 0.02, "the box is at rest");
    example_expect(&scene, turning < 0.1, "the box does not turn");
    example_expect(&scene, fabs(lifted[1] / weight - 1.0) < 0.01, "the impulses carry the weight within 1 %");
    example_expect(&scene, sideways / weight < 0.01, "the impulses point up within 1 %");
    example_expect(&scene, example_length(sum) < 1e-9 * weight, "what the box gets the cloth gives");
    return example_close(&scene);
}

int main(int argc, char **argv)
{
    return example_main("cloth_catches_box", one_run, argc, argv);
}
