#include "example_run.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int example_begin(ExampleRun *example, const char *name, int argc, char **argv)
{
    int i, numbers = 0;

    memset(example, 0, sizeof *example);
    example->name = name;
    example->runs = 10;
    example->seed = 1;
    for (i = 1; i < argc; i++) {
        char *end;
        unsigned long long number = strtoull(argv[i], &end, 10);
        if (strcmp(argv[i], "--frames") == 0 && i + 1 < argc) {
            example->frames = argv[++i];
        } else if (*argv[i] && !*end && numbers == 0 && number >= 1 && number <= 1000000) {
            example->runs = (int)number;
            numbers++;
        } else if (*argv[i] && !*end && numbers == 1) {
            example->seed = number;
            numbers++;
        } else {
            fprintf(stderr, "usage: %s [RUNS [SEED]] [--frames FOLDER]\n", name);
            return 0;
        }
    }
    return 1;
}

int example_next(ExampleRun *example)
{
    if (example->index == example->runs)
        return 0;
    example->index++;
    example->random = example->seed * UINT64_C(1000003) + (uint64_t)example->index;
    return 1;
}

int example_fail(ExampleRun *example, const char *what)
{
    printf("run %d: FAILED: %s\n", example->index, what);
    example->failures++;
    return 0;
}

void example_expect(ExampleRun *example, int *good, int holds, const char *what)
{
    if (!holds)
        *good = example_fail(example, what);
}

int example_write_frame(ExampleRun *example, int frame, const HostCloth *cloth, const SignoriniHost *host, SgnBodyId body,
                        const char *body_name)
{
    char path[4096];
    HostMesh meshes[2];
    double *positions;
    uint32_t *triangles;
    int good;

    if (!example->frames || example->index != 1)
        return 1;
    meshes[0].name = "cloth";
    meshes[0].positions = cloth->positions;
    meshes[0].vertex_count = cloth->vertex_count;
    meshes[0].triangles = cloth->triangles;
    meshes[0].triangle_count = cloth->triangle_count;
    meshes[1].name = body_name;
    signorini_host_surface(host, body, &meshes[1], &positions, &triangles);
    snprintf(path, sizeof path, "%s/frame_%04d.obj", example->frames, frame);
    good = host_mesh_write_obj(path, meshes, 2);
    free(positions);
    free(triangles);
    return good;
}

int example_end(ExampleRun *example)
{
    signorini_host_print_totals(&example->totals);
    printf("%s %s: %d runs, %d expectations failed\n", example->failures ? "FAIL" : "PASS", example->name, example->runs,
           example->failures);
    return example->failures ? 1 : 0;
}
