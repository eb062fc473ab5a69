/* Lifetimes and callbacks: a thousand worlds leave no threads, file descriptors or memory; calls from callbacks are BUSY. */
#define _DEFAULT_SOURCE
#include "check.h"
#include <dirent.h>
#include <pthread.h>

static Cloth cloth;

static int entries(const char *folder) {
  int count = 0;
  DIR *dir = opendir(folder);
  CHECK(dir != NULL);
  while (dir && readdir(dir)) count++;
  if (dir) closedir(dir);
  return count;
}

static long resident_pages(void) {
  long all = 0, resident = 0;
  FILE *file = fopen("/proc/self/statm", "r");
  CHECK(file && fscanf(file, "%ld %ld", &all, &resident) == 2);
  if (file) fclose(file);
  return resident;
}

static void one_life(int pool, int steps) {
  SgnContext *context = NULL;
  SgnContextDesc desc;
  SgnWorld *world = NULL;
  SgnBodyId body = {0}, ground_id = {0};
  SgnDeformableDesc cloth_ = cloth_desc(&cloth);
  SgnHalfSpaceDesc ground;
  SgnStepDesc step;
  double v[VERTICES][3];
  SgnView view = sgn_view(SGN_FORMAT_F64X3, v, VERTICES);
  OK(sgn_context_desc_init(&desc, sizeof desc));
  desc.executor = pool ? SGN_EXECUTOR_POOL : SGN_EXECUTOR_SERIAL;
  desc.workers = 3;
  OK(sgn_context_create(SGN_ABI_VERSION, &desc, NULL, 0, &context));
  OK(sgn_world_create(context, NULL, &world));
  OK(sgn_deformable_create(world, &cloth_, &body));
  OK(sgn_half_space_desc_init(&ground, sizeof ground));
  OK(sgn_half_space_create(world, &ground, &ground_id));
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  for (int i = 0; i < VERTICES; i++) v[i][0] = v[i][1] = 0, v[i][2] = -1;
  OK(sgn_body_push(world, body, SGN_SLOT_VELOCITY, &view, 0));
  for (int i = 0; i < steps; i++) CHECK(sgn_world_step(world, &step, NULL) >= 0);
  if (pool) {
    /* Either order: a world keeps what it needs of its context. */
    OK(sgn_context_destroy(context));
    CHECK(sgn_world_step(world, &step, NULL) >= 0);
    OK(sgn_world_destroy(world));
  } else {
    OK(sgn_world_destroy(world));
    OK(sgn_context_destroy(context));
  }
}

static void thousand_lives(void) {
  int threads, files;
  long pages;
  for (int i = 0; i < 100; i++) one_life(i & 1, 1);
  threads = entries("/proc/self/task"), files = entries("/proc/self/fd"), pages = resident_pages();
  CHECK(threads == 3); /* this one, and two dots */
  for (int i = 0; i < 1000; i++) one_life(i % 10 == 0, i % 10 == 0);
  CHECK(entries("/proc/self/task") == threads);
  CHECK(entries("/proc/self/fd") == files);
#ifdef __SANITIZE_ADDRESS__
  (void)pages; /* freed memory stays in quarantine; what is lost the sanitizer tells itself */
#else
  CHECK(resident_pages() < pages + 1024); /* 4 MB; a thousand leaked worlds would be 30 */
#endif
}

typedef struct Probe {
  SgnContext *context;
  SgnWorld *world, *other;
  SgnBodyId body;
  int calls, wrong_thread;
  pthread_t thread;
  char text[400];
} Probe;

static void on_log(void *user, SgnLogLevel level, const char *message, uint64_t length) {
  Probe *probe = user;
  SgnStepDesc step;
  SgnBodyInfo info;
  SgnCheckReport check;
  SgnMaterialDesc material;
  SgnMaterialId id;
  uint64_t hash;
  double v[VERTICES][3];
  SgnView view = sgn_view(SGN_FORMAT_F64X3, cloth.v, VERTICES);
  SgnViewMut out = sgn_view_mut(SGN_FORMAT_F64X3, v, VERTICES);
  if (level != SGN_LOG_INFO && level != SGN_LOG_WARNING) return;
  probe->calls++;
  probe->wrong_thread |= !pthread_equal(pthread_self(), probe->thread);
  memcpy(probe->text, message, length < 399 ? (size_t)length : 399);
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  GIVES(SGN_ERROR_BUSY, sgn_world_step(probe->world, &step, NULL));
  GIVES(SGN_ERROR_BUSY, sgn_world_destroy(probe->world));
  GIVES(SGN_ERROR_BUSY, sgn_body_push(probe->world, probe->body, SGN_SLOT_VELOCITY, &view, 0));
  GIVES(SGN_ERROR_BUSY, sgn_body_pull(probe->world, probe->body, SGN_SLOT_VELOCITY, &out));
  GIVES(SGN_ERROR_BUSY, sgn_body_destroy(probe->world, probe->body));
  GIVES(SGN_ERROR_BUSY, sgn_body_set_filter(probe->world, probe->body, 1, 1));
  OK(sgn_body_info_init(&info, sizeof info));
  GIVES(SGN_ERROR_BUSY, sgn_body_info(probe->world, probe->body, &info));
  OK(sgn_check_report_init(&check, sizeof check));
  GIVES(SGN_ERROR_BUSY, sgn_world_check(probe->world, &check));
  OK(sgn_material_desc_init(&material, sizeof material));
  GIVES(SGN_ERROR_BUSY, sgn_material_create(probe->world, &material, &id));
  GIVES(SGN_ERROR_BUSY, sgn_world_state_hash(probe->world, &hash));
  GIVES(SGN_ERROR_BUSY, sgn_world_pull_contacts(probe->world, SGN_CONTACT_KEY, NULL, &hash));
  OK(sgn_world_state_hash(probe->other, &hash)); /* another world is free */
}

static void re_entry(void) {
  Probe probe;
  SgnContextDesc desc;
  SgnDeformableDesc cloth_ = cloth_desc(&cloth);
  SgnStepDesc step;
  memset(&probe, 0, sizeof probe);
  probe.thread = pthread_self();
  OK(sgn_context_desc_init(&desc, sizeof desc));
  desc.executor = SGN_EXECUTOR_POOL;
  desc.workers = 2;
  desc.log_level = SGN_LOG_INFO;
  desc.log_callback = on_log;
  desc.log_user = &probe;
  OK(sgn_context_create(SGN_ABI_VERSION, &desc, NULL, 0, &probe.context));
  OK(sgn_world_create(probe.context, NULL, &probe.world));
  OK(sgn_world_create(probe.context, NULL, &probe.other));
  OK(sgn_deformable_create(probe.world, &cloth_, &probe.body));
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  CHECK(sgn_world_step(probe.world, &step, NULL) >= 0);
  CHECK(probe.calls == 1 && !probe.wrong_thread);
  CHECK(strstr(probe.text, "sgn_world_step: 0 contacts") != NULL);
  OK(sgn_world_destroy(probe.world));
  OK(sgn_world_destroy(probe.other));
  OK(sgn_context_destroy(probe.context));
}

/* Who watches a step, and when he has seen enough: by his answer, or by a call. */
typedef struct {
  SgnWorld *world;
  int calls, stop_at, by_call;
  double fraction;
} Watcher;

static int32_t on_progress(void *user, SgnPhase phase, double fraction) {
  Watcher *watcher = user;
  uint64_t hash;
  CHECK(phase >= SGN_PHASE_DYNAMICS && phase <= SGN_PHASE_FAIL_SAFE);
  CHECK(fraction >= watcher->fraction && fraction < 1);
  watcher->fraction = fraction;
  GIVES(SGN_ERROR_BUSY, sgn_world_state_hash(watcher->world, &hash));
  if (++watcher->calls != watcher->stop_at) return 1;
  if (!watcher->by_call) return 0;
  OK(sgn_world_cancel(watcher->world));
  return 1;
}

static void cancelling(void) {
  SgnContext *context = NULL;
  Watcher watcher;
  SgnBodyId cloth_id = {0}, ground_id = {0};
  SgnDeformableDesc cloth_ = cloth_desc(&cloth);
  SgnHalfSpaceDesc ground;
  SgnStepDesc step;
  uint64_t before, after;
  int phases;
  memset(&watcher, 0, sizeof watcher);
  OK(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &context));
  OK(sgn_world_create(context, NULL, &watcher.world));
  OK(sgn_deformable_create(watcher.world, &cloth_, &cloth_id));
  OK(sgn_half_space_desc_init(&ground, sizeof ground));
  ground.offset = -10;
  OK(sgn_half_space_create(watcher.world, &ground, &ground_id));
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  step.progress_callback = on_progress;
  step.progress_user = &watcher;
  before = state_hash(watcher.world);
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_world_cancel(NULL));
  OK(sgn_world_cancel(watcher.world)); /* nothing runs: nothing is cancelled */
  CHECK(sgn_world_step(watcher.world, &step, NULL) >= 0);
  phases = watcher.calls;
  CHECK(phases >= 3);
  after = state_hash(watcher.world);
  OK(sgn_world_destroy(watcher.world));
  OK(sgn_world_create(context, NULL, &watcher.world));
  OK(sgn_deformable_create(watcher.world, &cloth_, &cloth_id));
  OK(sgn_half_space_create(watcher.world, &ground, &ground_id));
  for (int i = 0; i < 2 * phases; i++) {
    watcher.calls = 0, watcher.fraction = 0;
    watcher.stop_at = 1 + i / 2, watcher.by_call = i % 2;
    GIVES(SGN_ERROR_CANCELLED, sgn_world_step(watcher.world, &step, NULL));
    CHECK(watcher.calls == watcher.stop_at);
    CHECK(state_hash(watcher.world) == before);
  }
  watcher.stop_at = 0, watcher.fraction = 0;
  CHECK(sgn_world_step(watcher.world, &step, NULL) >= 0);
  CHECK(state_hash(watcher.world) == after);
  OK(sgn_world_destroy(watcher.world));
  OK(sgn_context_destroy(context));
}

/* A failed call is over when its message comes: the callback may even destroy the world and the context. */
static void destroy_on_error(void *user, SgnLogLevel level, const char *message, uint64_t length) {
  Probe *probe = user;
  CHECK(level == SGN_LOG_ERROR && length > 10 && memcmp(message, "sgn_", 4) == 0);
  OK(sgn_world_destroy(probe->world));
  OK(sgn_context_destroy(probe->context));
  probe->calls++;
}

static void destruction_from_a_callback(void) {
  Probe probe;
  SgnContextDesc desc;
  SgnBodyId garbage = {4711};
  memset(&probe, 0, sizeof probe);
  OK(sgn_context_desc_init(&desc, sizeof desc));
  desc.log_callback = destroy_on_error;
  desc.log_user = &probe;
  OK(sgn_context_create(SGN_ABI_VERSION, &desc, NULL, 0, &probe.context));
  OK(sgn_world_create(probe.context, NULL, &probe.world));
  GIVES(SGN_ERROR_INVALID_ID, sgn_body_destroy(probe.world, garbage));
  CHECK(probe.calls == 1);
}

/* Errors belong to the thread that made them. */
static void *fail_on_thread(void *user) {
  Probe *probe = user;
  SgnErrorInfo info;
  SgnBodyId garbage = {12345};
  OK(sgn_error_info_init(&info, sizeof info));
  OK(sgn_context_last_error(probe->context, &info));
  CHECK(info.code == SGN_OK);
  GIVES(SGN_ERROR_INVALID_ID, sgn_body_destroy(probe->world, garbage));
  OK(sgn_context_last_error(probe->context, &info));
  CHECK(info.code == SGN_ERROR_INVALID_ID && info.object == 12345);
  return NULL;
}

static void errors_by_thread(void) {
  Probe probe;
  pthread_t thread;
  SgnErrorInfo info;
  SgnContextDesc desc;
  memset(&probe, 0, sizeof probe);
  OK(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &probe.context));
  OK(sgn_world_create(probe.context, NULL, &probe.world));
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_world_step(probe.world, NULL, NULL));
  for (int i = 0; i < 100; i++) { /* more threads than are remembered */
    CHECK(pthread_create(&thread, NULL, fail_on_thread, &probe) == 0);
    CHECK(pthread_join(thread, NULL) == 0);
  }
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_world_state_hash(probe.world, NULL));
  OK(sgn_error_info_init(&info, sizeof info));
  OK(sgn_context_last_error(probe.context, &info));
  CHECK(info.code == SGN_ERROR_NULL_ARGUMENT);
  OK(sgn_world_destroy(probe.world));
  OK(sgn_context_destroy(probe.context));
  (void)desc;
}

/* Two threads at one world: the one that steps is not disturbed, the other is told that it is busy. */
static void *read_on_thread(void *user) {
  Probe *probe = user;
  SgnStepDesc step;
  uint64_t hash;
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  for (int i = 0; i < 3000; i++) {
    SgnResult read = sgn_world_state_hash(probe->world, &hash), stepped;
    CHECK(read == SGN_OK || read == SGN_ERROR_BUSY);
    stepped = sgn_world_step(probe->world, &step, NULL);
    CHECK(stepped >= 0 || stepped == SGN_ERROR_BUSY);
    if (stepped >= 0) probe->calls++;
  }
  return NULL;
}

static void two_threads(void) {
  Probe probes[2];
  pthread_t thread;
  SgnDeformableDesc cloth_ = cloth_desc(&cloth);
  SgnStepDesc step;
  memset(probes, 0, sizeof probes);
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  OK(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &probes[0].context));
  OK(sgn_world_create(probes[0].context, NULL, &probes[0].world));
  OK(sgn_deformable_create(probes[0].world, &cloth_, &probes[0].body));
  probes[1] = probes[0];
  CHECK(pthread_create(&thread, NULL, read_on_thread, &probes[1]) == 0);
  read_on_thread(&probes[0]);
  CHECK(pthread_join(thread, NULL) == 0);
  /* How many were told so is up to the scheduler; once both are done nobody is. */
  CHECK(probes[0].calls + probes[1].calls > 0);
  GIVES(SGN_OK, sgn_world_step(probes[0].world, &step, NULL));
  OK(sgn_world_destroy(probes[0].world));
  OK(sgn_context_destroy(probes[0].context));
}

/* Bodies come and go; ids stay apart, and a step sees who is there. */
static void bodies_come_and_go(void) {
  SgnContext *context = NULL;
  SgnWorld *world = NULL;
  SgnStepDesc step;
  SgnBodyId ids[50];
  SgnBodyInfo info;
  OK(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &context));
  OK(sgn_world_create(context, NULL, &world));
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  OK(sgn_body_info_init(&info, sizeof info));
  OK(sgn_world_step(world, &step, NULL)); /* nobody */
  for (int round = 0; round < 3; round++) {
    for (int i = 0; i < 50; i++) {
      SgnRigidDesc ball = octahedron_desc(1, 0.3 * i);
      ball.options.user_key = (uint64_t)i;
      OK(sgn_rigid_create(world, &ball, &ids[i]));
      for (int j = 0; j < i; j++) CHECK(ids[i].value != ids[j].value);
    }
    CHECK(sgn_world_step(world, &step, NULL) >= 0);
    for (int i = 0; i < 50; i += 2) OK(sgn_body_destroy(world, ids[i]));
    CHECK(sgn_world_step(world, &step, NULL) >= 0);
    for (int i = 0; i < 50; i++) {
      GIVES(i % 2 ? SGN_OK : SGN_ERROR_STALE_ID, sgn_body_info(world, ids[i], &info));
      if (i % 2) CHECK(info.user_key == (uint64_t)i);
    }
    for (int i = 1; i < 50; i += 2) OK(sgn_body_destroy(world, ids[i]));
  }
  OK(sgn_world_destroy(world));
  OK(sgn_context_destroy(context));
}

int main(void) {
  make_cloth(&cloth, 0.1, 0.5);
  re_entry();
  cancelling();
  destruction_from_a_callback();
  errors_by_thread();
  bodies_come_and_go();
  two_threads();
  thousand_lives();
  return finish();
}
