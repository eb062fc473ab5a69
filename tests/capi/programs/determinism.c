/* The same history gives the same hash: serial, with 1, 2, 3 and 5 workers, when the host flushes denormals to zero, and
 * when the world is replaced half-way by its snapshot; the host's floating-point environment is as it was. */
#include "check.h"
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

/* Large enough that a pool splits its work. */
enum { N = 40, COUNT = N * N, FACES = 2 * (N - 1) * (N - 1) };

static double x[COUNT][3], v[COUNT][3], mass[COUNT];
static uint32_t faces[FACES][3];

/* The host's floating-point control register while it calls the library; it computes its own inputs as usual. */
static unsigned int host_csr = 0;

static void enter_host(void) {
#if defined(__x86_64__)
  if (host_csr) _mm_setcsr(host_csr);
#endif
}

static void leave_host(void) {
#if defined(__x86_64__)
  if (host_csr) CHECK((_mm_getcsr() & 0xffc0u) == (host_csr & 0xffc0u)); /* as it was */
  _mm_setcsr(0x1f80u);
#endif
}

static void save_and_load(SgnWorld *world) {
  uint64_t size = 0, written = 0, hash = state_hash(world);
  unsigned char *room;
  SgnBodyId later = {0};
  SgnHalfSpaceDesc plane;
  OK(sgn_world_snapshot_size(world, &size));
  room = malloc(size);
  CHECK(room != NULL);
  if (!room) return;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_world_snapshot_save(world, room, size - 1, &written));
  CHECK(written == 0);
  OK(sgn_world_snapshot_save(world, room, size, &written));
  CHECK(written == size);
  OK(sgn_half_space_desc_init(&plane, sizeof plane));
  plane.offset = -100;
  OK(sgn_half_space_create(world, &plane, &later));
  CHECK(state_hash(world) != hash);
  room[size / 2] ^= 1;
  GIVES(SGN_ERROR_SNAPSHOT_MISMATCH, sgn_world_snapshot_load(world, room, size));
  room[size / 2] ^= 1;
  GIVES(SGN_ERROR_SNAPSHOT_MISMATCH, sgn_world_snapshot_load(world, room, size - 1));
  OK(sgn_world_snapshot_load(world, room, size));
  CHECK(state_hash(world) == hash);
  GIVES(SGN_ERROR_STALE_ID, sgn_body_destroy(world, later));
  free(room);
}

static uint64_t history(int workers, int snapshot_frame) {
  SgnContext *context = NULL;
  SgnContextDesc desc;
  SgnWorld *world = NULL;
  SgnDeformableDesc cloth;
  SgnRigidDesc ball = octahedron_desc(0.5, 0.125);
  SgnHalfSpaceDesc ground;
  SgnMaterialDesc rough;
  SgnMaterialId material = {0};
  SgnBodyId cloth_id = {0}, ball_id = {0}, ground_id = {0};
  SgnStepDesc step;
  SgnView push = sgn_view(SGN_FORMAT_F64X3, v, COUNT);
  SgnViewMut pull = sgn_view_mut(SGN_FORMAT_F64X3, v, COUNT);
  uint64_t hash;
  int f = 0;
  for (int j = 0; j < N; j++) {
    for (int i = 0; i < N; i++) {
      int k = N * j + i;
      x[k][0] = 0.02 * (i - N / 2), x[k][1] = 0.02 * (j - N / 2), x[k][2] = 0.008 + 0.0005 * ((7 * i + 3 * j) % 5);
      v[k][0] = v[k][1] = v[k][2] = 0;
      mass[k] = 1e-4 * (1 + (i + 2 * j) % 3);
      if (i + 1 < N && j + 1 < N) {
        uint32_t a = (uint32_t)k;
        faces[f][0] = a, faces[f][1] = a + 1, faces[f++][2] = a + N + 1;
        faces[f][0] = a, faces[f][1] = a + N + 1, faces[f++][2] = a + N;
      }
    }
  }
  enter_host();
  OK(sgn_context_desc_init(&desc, sizeof desc));
  desc.executor = workers ? SGN_EXECUTOR_POOL : SGN_EXECUTOR_SERIAL;
  desc.workers = workers ? (uint32_t)workers : 1;
  OK(sgn_context_create(SGN_ABI_VERSION, &desc, NULL, 0, &context));
  OK(sgn_world_create(context, NULL, &world));
  OK(sgn_material_desc_init(&rough, sizeof rough));
  rough.friction = 0.4;
  OK(sgn_material_create(world, &rough, &material));
  OK(sgn_half_space_desc_init(&ground, sizeof ground));
  ground.options.material = material;
  OK(sgn_half_space_create(world, &ground, &ground_id));
  OK(sgn_deformable_desc_init(&cloth, sizeof cloth));
  cloth.mesh.vertices = sgn_view(SGN_FORMAT_F64X3, x, COUNT);
  cloth.mesh.triangles = sgn_view(SGN_FORMAT_U32X3, faces, FACES);
  cloth.masses = sgn_view(SGN_FORMAT_F64, mass, COUNT);
  cloth.options.half_thickness = 0.002;
  cloth.options.material = material;
  OK(sgn_deformable_create(world, &cloth, &cloth_id));
  ball.options.material = material;
  ball.velocity[2] = -2;
  ball.angular_velocity[0] = 3;
  OK(sgn_rigid_create(world, &ball, &ball_id));
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  leave_host();
  for (int frame = 0; frame < 6; frame++) {
    for (int i = 0; i < COUNT; i++) v[i][2] -= 0.0981;
    enter_host();
    OK(sgn_body_push(world, cloth_id, SGN_SLOT_VELOCITY, &push, 0));
    CHECK(sgn_world_step(world, &step, NULL) >= 0);
    OK(sgn_body_pull(world, cloth_id, SGN_SLOT_VELOCITY, &pull));
    leave_host();
    if (frame == snapshot_frame) save_and_load(world);
  }
  hash = state_hash(world);
  {
    uint64_t contacts = 0;
    OK(sgn_world_pull_contacts(world, SGN_CONTACT_KEY, NULL, &contacts));
    if (contacts <= 500) printf("%d contacts\n", (int)contacts);
    CHECK(contacts > 500);
  }
  OK(sgn_world_destroy(world));
  OK(sgn_context_destroy(context));
  return hash;
}

int main(void) {
  uint64_t wanted = history(0, -1);
  for (int workers = 1; workers <= 5; workers += workers == 3 ? 2 : 1) CHECK(history(workers, -1) == wanted);
  CHECK(history(0, 3) == wanted);
#if defined(__x86_64__)
  /* Flush to zero with denormals as zero; rounding down; both with rounding up. */
  const unsigned int hosts[3] = {0x1f80u | 0x8040u, 0x1f80u | 0x2000u, 0x1f80u | 0x8040u | 0x4000u};
  for (int i = 0; i < 3; i++) {
    host_csr = hosts[i];
    CHECK(history(0, -1) == wanted);
    CHECK(history(3, 2) == wanted);
  }
#endif
  return finish();
}
