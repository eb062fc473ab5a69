/* Runs of an example scene: arguments, seeds, the host loop of a cloth and one rigid body, expectations, frames, and the
 * summary line. */
#ifndef EXAMPLE_RUN_H
#define EXAMPLE_RUN_H

#include "cloth_contact.h"
#include "example_engine.h"

#include <stdint.h>

typedef struct ExampleRun {
    char name[64]; /* of the engine and the scene */
    int runs, index; /* index counts from 1 */
    uint64_t seed;
    uint64_t random;    /* state for host_random, another for each run */
    const char *frames; /* folder for OBJ files of the first run, or NULL */
    int failures;
    SignoriniHost totals; /* sums over all runs; no world */
} ExampleRun;

/* What a scene consists of. */
typedef struct ExampleScene {
    ExampleRun *run;
    SignoriniHost host;
    HostCloth *cloth;
    ClothContact cloth_contact;
    Engine *engine;
    EngineState body; /* after the last step */
    int step;
    int good; /* 0 once an expectation of this run has failed */
} ExampleScene;

/* Runs `one_run` as often as the arguments `[RUNS [SEED]] [--frames FOLDER]` say; the exit status. */
int example_main(const char *scene, int (*one_run)(ExampleRun *), int argc, char **argv);
/* Random number in [-1, 1]. */
double example_random(ExampleRun *run);
/* Counts a failure and says so. Returns 0. */
int example_fail(ExampleRun *run, const char *what);

/* A cloth whose vertices lie up to a millimetre beside the grid, so that no two runs are alike; NULL without memory. */
HostCloth *example_cloth(ExampleRun *run, const HostClothSettings *settings);
/* Takes the cloth over and puts the body beside it, gravity as the cloth has it. 0 on failure, with nothing to close. */
int example_open(ExampleScene *scene, ExampleRun *run, HostCloth *cloth, ClothMetric metric, const EngineBody *body,
                 double friction, double half_thickness);
/* One step of the host loop, and its frame. 0 once the run has failed. */
int example_step(ExampleScene *scene, double dt);
/* Fails unless the body is on its side of the cloth: above it, y up. */
void example_expect_above(ExampleScene *scene);
/* Fails unless `holds`. */
void example_expect(ExampleScene *scene, int holds, const char *what);
/* Expects that every frame was certified and that the engine handed the pair over; frees. Whether the run was good. */
int example_close(ExampleScene *scene);

double example_length(const double v[3]);

#endif
