#include "example_run.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int read_arguments(ExampleRun *run, int argc, char **argv)
{
    int i, numbers = 0;

    for (i = 1; i < argc; i++) {
        char *end;
        unsigned long long number = strtoull(argv[i], &end, 10);
        if (strcmp(argv[i], "--frames") == 0 && i + 1 < argc) {
            run->frames = argv[++i];
        } else if (*argv[i] && !*end && numbers == 0 && number >= 1 && number <= 1000000) {
            run->runs = (int)number;
            numbers++;
        } else if (*argv[i] && !*end && numbers == 1) {
            run->seed = number;
            numbers++;
        } else {
            fprintf(stderr, "usage: %s [RUNS [SEED]] [--frames FOLDER]\n", run->name);
            return 0;
        }
    }
    return 1;
}

int example_main(const char *scene, int (*one_run)(ExampleRun *), int argc, char **argv)
{
    ExampleRun run;

    memset(&run, 0, sizeof run);
    snprintf(run.name, sizeof run.name, "%s_%s", engine_name(), scene);
    run.runs = 10;
    run.seed = 1;
    if (!read_arguments(&run, argc, argv))
        return 2;
    for (run.index = 1; run.index <= run.runs; run.index++) {
        run.random = run.seed * UINT64_C(1000003) + (uint64_t)run.index;
        one_run(&run);
    }
    signorini_host_print_totals(&run.totals);
    printf("%s %s: %d runs, %d expectations failed\n", run.failures ? "FAIL" : "PASS", run.name, run.runs, run.failures);
    return run.failures ? 1 : 0;
}

double example_random(ExampleRun *run)
{
    return host_random(&run->random);
}

int example_fail(ExampleRun *run, const char *what)
{
    printf("run %d: FAILED: %s\n", run->index, what);
    run->failures++;
    return 0;
}

double example_length(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

HostCloth *example_cloth(ExampleRun *run, const HostClothSettings *settings)
{
    HostCloth *cloth = host_cloth_create(settings);
    uint32_t i;

    for (i = 0; cloth && i < 3 * cloth->vertex_count; i++)
        cloth->positions[i] += 1e-3 * example_random(run);
    return cloth;
}

int example_open(ExampleScene *scene, ExampleRun *run, HostCloth *cloth, ClothMetric metric, const EngineBody *body,
                 double friction, double half_thickness)
{
    SgnShapeDesc shape;
    SgnRigidDesc desc;
    int k;

    memset(scene, 0, sizeof *scene);
    if (!cloth)
        return example_fail(run, "no cloth");
    scene->run = run;
    scene->cloth = cloth;
    scene->good = 1;
    signorini_host_create(&scene->host, friction, 0);
    cloth_contact_create(&scene->cloth_contact, &scene->host, cloth, metric, half_thickness);
    sgn_shape_desc_init(&shape, sizeof shape);
    sgn_rigid_desc_init(&desc, sizeof desc);
    shape.kind = body->shape;
    shape.radius = body->radius;
    for (k = 0; k < 3; k++)
        shape.half_extents[k] = body->half_extents[k];
    desc.shape = &shape;
    desc.options.half_thickness = half_thickness;
    scene->engine = engine_create(cloth->settings.gravity, body, &desc, &scene->host, cloth);
    if (!scene->engine) {
        cloth_contact_destroy(&scene->cloth_contact);
        host_cloth_destroy(cloth);
        signorini_host_destroy(&scene->host);
        return example_fail(run, "no engine");
    }
    engine_state(scene->engine, &scene->body);
    return 1;
}

/* FOLDER/frame_0000.obj and so on, the cloth and the body. */
static int write_frame(const ExampleScene *scene)
{
    char path[4096];
    HostMesh meshes[2];
    double *positions;
    uint32_t *triangles;
    int good;

    meshes[0].name = "cloth";
    meshes[0].positions = scene->cloth->positions;
    meshes[0].vertex_count = scene->cloth->vertex_count;
    meshes[0].triangles = scene->cloth->triangles;
    meshes[0].triangle_count = scene->cloth->triangle_count;
    meshes[1].name = "body";
    signorini_host_surface(&scene->host, scene->body.id, &meshes[1], &positions, &triangles);
    snprintf(path, sizeof path, "%s/frame_%04d.obj", scene->run->frames, scene->step);
    good = host_mesh_write_obj(path, meshes, 2);
    free(positions);
    free(triangles);
    return good;
}

int example_step(ExampleScene *scene, double dt)
{
    /* The host loop: the engines tick, push what they want, our step, write back what they get. */
    engine_tick(scene->engine, dt);
    example_expect(scene, host_cloth_predict(scene->cloth, dt) >= 0, "the cloth's linear solver converges");
    engine_push(scene->engine, dt);
    cloth_contact_push(&scene->cloth_contact);
    signorini_host_step(&scene->host, dt);
    cloth_contact_pull(&scene->cloth_contact);
    engine_pull(scene->engine);

    engine_state(scene->engine, &scene->body);
    if (scene->run->frames && scene->run->index == 1)
        example_expect(scene, write_frame(scene), "the frame is written");
    scene->step++;
    return scene->good;
}

void example_expect_above(ExampleScene *scene)
{
    const double down[3] = {0.0, -1.0, 0.0};

    example_expect(scene, host_cloth_crossings(scene->cloth, scene->body.position, down) % 2 == 1,
                   "the body is above the cloth");
}

void example_expect(ExampleScene *scene, int holds, const char *what)
{
    if (!holds)
        scene->good = example_fail(scene->run, what);
}

int example_close(ExampleScene *scene)
{
    example_expect(scene, scene->body.own_contacts == 0, "the engine made no contact of its own");
    example_expect(scene, scene->body.pairs_handed_over > 0, "the engine handed the pair over");
    example_expect(scene, scene->host.intersections == 0 && scene->host.uncertified_steps == 0, "every frame is certified");
    signorini_host_add_totals(&scene->run->totals, &scene->host);
    engine_destroy(scene->engine);
    cloth_contact_destroy(&scene->cloth_contact);
    host_cloth_destroy(scene->cloth);
    signorini_host_destroy(&scene->host);
    return scene->good;
}
