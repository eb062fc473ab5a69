/* Runs of an example host: arguments, seeds, expectations, frames, and the summary line. */
#ifndef EXAMPLE_RUN_H
#define EXAMPLE_RUN_H

#include "host_cloth.h"
#include "signorini_host.h"

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct ExampleRun {
    const char *name;
    int runs, index; /* index counts from 1 */
    uint64_t seed;
    uint64_t random;    /* state for host_random, another for each run */
    const char *frames; /* folder for OBJ files of the first run, or NULL */
    int failures;
    SignoriniHost totals; /* sums over all runs; no world */
} ExampleRun;

/* Reads `[RUNS [SEED]] [--frames FOLDER]`; 0 with a line on stderr if it is none of that. */
int example_begin(ExampleRun *example, const char *name, int argc, char **argv);
/* Goes to the next run; 0 when there is none. */
int example_next(ExampleRun *example);
/* Counts a failure and says so. Returns 0. */
int example_fail(ExampleRun *example, const char *what);
/* Fails, and clears `good`, unless `holds`. */
void example_expect(ExampleRun *example, int *good, int holds, const char *what);
/* FOLDER/frame_0000.obj and so on, the cloth and one rigid body; 0 on failure. Nothing after the first run. */
int example_write_frame(ExampleRun *example, int frame, const HostCloth *cloth, const SignoriniHost *host, SgnBodyId body,
                        const char *body_name);
/* Prints `PASS name: ...` or `FAIL name: ...`; the exit status. */
int example_end(ExampleRun *example);

#ifdef __cplusplus
}
#endif

#endif
