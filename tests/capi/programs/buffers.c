/* Views of every layout: strides, floats and doubles, unaligned, columns, memory that ends at a protected page. */
#define _DEFAULT_SOURCE
#include "check.h"
#include <sys/mman.h>
#include <unistd.h>

static Cloth cloth;

static SgnWorld *empty_world(SgnContext *context) {
  SgnWorld *world = NULL;
  OK(sgn_world_create(context, NULL, &world));
  return world;
}

/* Memory whose last byte is followed by a page that must not be touched. */
typedef struct Guarded {
  unsigned char *map, *end;
  size_t size;
} Guarded;

static Guarded guarded(size_t bytes) {
  Guarded g;
  size_t page = (size_t)sysconf(_SC_PAGESIZE);
  g.size = (bytes + page - 1) / page * page + page;
  g.map = mmap(NULL, g.size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  CHECK(g.map != MAP_FAILED);
  g.end = g.map + g.size - page;
  CHECK(mprotect(g.end, page, PROT_NONE) == 0);
  return g;
}

static void release(Guarded g) { CHECK(munmap(g.map, g.size) == 0); }

/* The state after the same history, pushed through a layout: stride, first byte, floats or doubles. */
static uint64_t hash_through(SgnContext *context, size_t stride, size_t first, int single) {
  SgnWorld *world = empty_world(context);
  SgnDeformableDesc desc = cloth_desc(&cloth);
  size_t element = single ? 12 : 24, step = stride ? stride : element;
  /* Exactly as many bytes as the view says: nothing after the last element may be read. */
  size_t bytes = first + step * (VERTICES - 1) + element;
  Guarded g = guarded(bytes);
  unsigned char *start = g.end - bytes;
  SgnView view = sgn_view(single ? SGN_FORMAT_F32X3 : SGN_FORMAT_F64X3, start, VERTICES);
  SgnBodyId body = {0};
  uint64_t hash;
  view.byte_offset = first;
  view.byte_stride = stride;
  memset(start, 0xff, bytes); /* NaN between the elements */
  for (int i = 0; i < VERTICES; i++) {
    for (int k = 0; k < 3; k++) {
      float f = (float)cloth.x[i][k];
      double d = f;
      memcpy(start + first + step * (size_t)i + (single ? 4u : 8u) * (unsigned)k, single ? (void *)&f : (void *)&d, single ? 4 : 8);
    }
  }
  desc.mesh.vertices = view;
  OK(sgn_deformable_create(world, &desc, &body));
  OK(sgn_body_push(world, body, SGN_SLOT_VELOCITY, &view, 0));
  hash = state_hash(world);
  {
    /* And back: written elements are the pushed ones, what lies between is left. */
    SgnViewMut out = sgn_view_mut(view.format, start, VERTICES);
    unsigned char *copy = malloc(bytes);
    out.byte_offset = first;
    out.byte_stride = stride;
    memcpy(copy, start, bytes);
    for (size_t i = 0; i < VERTICES; i++) memset(start + first + step * i, 0x11, element);
    if (single) {
      GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_body_pull(world, body, SGN_SLOT_POSITION, &out));
    } else {
      OK(sgn_body_pull(world, body, SGN_SLOT_POSITION, &out));
      CHECK(memcmp(copy, start, bytes) == 0);
    }
    free(copy);
  }
  OK(sgn_world_destroy(world));
  release(g);
  return hash;
}

static void layouts(SgnContext *context) {
  uint64_t wanted = hash_through(context, 0, 0, 0);
  size_t strides[5] = {0, 24, 25, 32, 71}, firsts[4] = {0, 1, 7, 40};
  for (int i = 0; i < 5; i++) {
    for (int j = 0; j < 4; j++) {
      CHECK(hash_through(context, strides[i], firsts[j], 0) == wanted);
      CHECK(hash_through(context, strides[i] == 24 ? 12 : strides[i], firsts[j], 1) == wanted);
    }
  }
}

/* A matrix given as full rows or as its upper half, rows or columns first, doubles or floats: the same step. */
static uint64_t hash_of_system(SgnContext *context, int upper, int columns_first, int single) {
  SgnWorld *world = empty_world(context);
  SgnDeformableDesc desc = cloth_desc(&cloth);
  SgnSystemDesc system;
  SgnSystemId id = {0};
  SgnBodyId body = {0};
  SgnHalfSpaceDesc ground;
  SgnBodyId ground_id = {0};
  SgnStepDesc step;
  SgnView view;
  uint64_t offsets[VERTICES + 1] = {0}, hash, columns[3 * VERTICES];
  double doubles[3 * VERTICES][9];
  float floats[3 * VERTICES][9];
  double v[VERTICES][3];
  uint64_t n = 0;
  /* Neighbours in the order of numbers are coupled by a block that is not symmetric itself. */
  for (uint64_t i = 0; i < VERTICES; i++) {
    for (uint64_t j = i ? i - 1 : 0; j < VERTICES && j <= i + 1; j++) {
      if (upper && j < i) continue;
      columns[n] = j;
      for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
          double value = i == j ? (r == c ? 0.0625 : 0.00390625) : (r == c ? -0.0078125 : 0);
          if (i < j && r == 0 && c == 1) value = 0.001953125;
          if (i > j && r == 1 && c == 0) value = 0.001953125;
          doubles[n][columns_first ? 3 * c + r : 3 * r + c] = value;
          floats[n][columns_first ? 3 * c + r : 3 * r + c] = (float)value;
        }
      }
      n++;
    }
    offsets[i + 1] = n;
  }
  OK(sgn_deformable_create(world, &desc, &body));
  OK(sgn_half_space_desc_init(&ground, sizeof ground));
  OK(sgn_half_space_create(world, &ground, &ground_id));
  OK(sgn_system_desc_init(&system, sizeof system));
  system.flags = upper ? SGN_SYSTEM_UPPER : 0;
  system.bodies = &body;
  system.body_count = 1;
  system.row_offsets = sgn_view(SGN_FORMAT_U64, offsets, VERTICES + 1);
  system.columns = sgn_view(SGN_FORMAT_U64, columns, n);
  OK(sgn_system_create(world, &system, &id));
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  for (int i = 0; i < VERTICES; i++) v[i][0] = 0.5, v[i][1] = 0.1 * i, v[i][2] = -3.0 - 0.1 * i;
  view = sgn_view(SGN_FORMAT_F64X3, v, VERTICES);
  OK(sgn_body_push(world, body, SGN_SLOT_VELOCITY, &view, 0));
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_world_step(world, &step, NULL)); /* no values yet */
  view = single ? sgn_view(columns_first ? SGN_FORMAT_F32_3X3_COLUMNS : SGN_FORMAT_F32_3X3_ROWS, floats, n)
                : sgn_view(columns_first ? SGN_FORMAT_F64_3X3_COLUMNS : SGN_FORMAT_F64_3X3_ROWS, doubles, n);
  OK(sgn_system_push(world, id, &view));
  CHECK(sgn_world_step(world, &step, NULL) >= 0);
  OK(sgn_system_destroy(world, id)); /* the patterns differ, the results must not */
  hash = state_hash(world);
  OK(sgn_world_destroy(world));
  return hash;
}

static void systems(SgnContext *context) {
  uint64_t wanted;
  make_cloth(&cloth, 0.1, 0.03);
  wanted = hash_of_system(context, 0, 0, 0);
  for (int i = 1; i < 8; i++) CHECK(hash_of_system(context, i & 1, (i >> 1) & 1, (i >> 2) & 1) == wanted);
}

/* Two bodies in one system, coupled; a body may be in one system only. */
static void coupled_bodies(SgnContext *context) {
  SgnWorld *world = empty_world(context);
  SgnRigidDesc ball = octahedron_desc(1, 1);
  SgnBodyId bodies[2] = {{0}, {0}}, wrong[2];
  SgnSystemDesc system;
  SgnSystemId id = {0}, other = {0};
  uint32_t offsets[5] = {0, 2, 3, 5, 6}, columns[6] = {0, 2, 1, 0, 2, 3};
  double blocks[6][9] = {{0}};
  SgnView view = sgn_view(SGN_FORMAT_F64_3X3_ROWS, blocks, 6);
  OK(sgn_rigid_create(world, &ball, &bodies[0]));
  ball.position[2] = 2;
  OK(sgn_rigid_create(world, &ball, &bodies[1]));
  for (int i = 0; i < 6; i++) blocks[i][0] = blocks[i][4] = blocks[i][8] = (i == 1 || i == 3) ? -0.5 : 2;
  OK(sgn_system_desc_init(&system, sizeof system));
  system.bodies = bodies, system.body_count = 2;
  system.row_offsets = sgn_view(SGN_FORMAT_U32, offsets, 5);
  system.columns = sgn_view(SGN_FORMAT_U32, columns, 6);
  OK(sgn_system_create(world, &system, &id));
  OK(sgn_system_push(world, id, &view));
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_system_create(world, &system, &other));
  OK(sgn_system_destroy(world, id));
  GIVES(SGN_ERROR_STALE_ID, sgn_system_push(world, id, &view));
  wrong[0] = wrong[1] = bodies[0];
  system.bodies = wrong;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_system_create(world, &system, &other));
  system.bodies = bodies;
  columns[1] = 3;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_system_create(world, &system, &other));
  columns[1] = 2, offsets[4] = 5;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_system_create(world, &system, &other));
  OK(sgn_world_destroy(world));
}

/* Shapes become closed meshes that can be pulled. */
static void shapes(SgnContext *context) {
  SgnWorld *world = empty_world(context);
  double points[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.1, 0.1, 0.1}};
  float heights[6] = {0, 0.5f, 0, 0.25f, 0, 0};
  for (int kind = SGN_SHAPE_SPHERE; kind <= SGN_SHAPE_HEIGHT_FIELD; kind++) {
    SgnShapeDesc shape;
    SgnRigidDesc rigid;
    SgnKinematicDesc kinematic;
    SgnBodyInfo info;
    SgnBodyId id = {0};
    OK(sgn_shape_desc_init(&shape, sizeof shape));
    shape.kind = kind;
    shape.radius = 0.5, shape.half_height = 1;
    shape.half_extents[0] = 1, shape.half_extents[1] = 2, shape.half_extents[2] = 3;
    shape.rows = 2, shape.columns = 3;
    shape.points = kind == SGN_SHAPE_HEIGHT_FIELD ? sgn_view(SGN_FORMAT_F32, heights, 6) : sgn_view(SGN_FORMAT_F64X3, points, 5);
    OK(sgn_rigid_desc_init(&rigid, sizeof rigid));
    rigid.shape = &shape;
    OK(sgn_rigid_create(world, &rigid, &id));
    OK(sgn_body_info_init(&info, sizeof info));
    OK(sgn_body_info(world, id, &info));
    if (kind != SGN_SHAPE_HEIGHT_FIELD) {
      uint64_t *triangles = malloc(info.triangles * 24);
      double(*x)[3] = malloc(info.vertices * 24), volume = 0, wanted = 0;
      SgnViewMut out = sgn_view_mut(SGN_FORMAT_U64X3, triangles, info.triangles);
      CHECK(info.vertices + info.triangles - info.edges == 2); /* Euler: closed */
      OK(sgn_body_pull(world, id, SGN_SLOT_TRIANGLES, &out));
      out = sgn_view_mut(SGN_FORMAT_F64X3, x, info.vertices);
      OK(sgn_body_pull(world, id, SGN_SLOT_REST_POSITION, &out));
      for (uint64_t t = 0; t < info.triangles; t++) {
        const double *a = x[triangles[3 * t]], *b = x[triangles[3 * t + 1]], *c = x[triangles[3 * t + 2]];
        volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6;
      }
      if (kind == SGN_SHAPE_SPHERE) wanted = 4.18879 * 0.125;
      if (kind == SGN_SHAPE_BOX) wanted = 48;
      if (kind == SGN_SHAPE_CAPSULE) wanted = 4.18879 * 0.125 + 3.14159 * 0.25 * 2;
      if (kind == SGN_SHAPE_CYLINDER) wanted = 3.14159 * 0.25 * 2;
      if (kind == SGN_SHAPE_CONVEX_HULL) wanted = 1.0 / 6;
      CHECK(fabs(volume - wanted) < 0.05 * wanted);
      free(triangles);
      free(x);
    } else {
      CHECK(info.vertices == 6 && info.triangles == 4);
    }
    OK(sgn_kinematic_desc_init(&kinematic, sizeof kinematic));
    kinematic.shape = &shape;
    OK(sgn_kinematic_create(world, &kinematic, &id));
    OK(sgn_body_info(world, id, &info));
    CHECK(info.kind == SGN_BODY_KIND_KINEMATIC_POSED);
    shape.kind = kind == SGN_SHAPE_CONVEX_HULL ? 99 : kind;
    shape.radius = NAN, shape.half_extents[0] = INFINITY, heights[0] = NAN;
    CHECK(sgn_rigid_create(world, &rigid, &id) == (shape.kind == 99 ? SGN_ERROR_INVALID_ARGUMENT : SGN_ERROR_NON_FINITE_INPUT));
    shape.radius = 0, shape.half_extents[0] = -1, heights[0] = 0, shape.rows = kind == SGN_SHAPE_HEIGHT_FIELD ? 1 : 2;
    CHECK(sgn_rigid_create(world, &rigid, &id) == (shape.rows == 1 ? SGN_ERROR_BUFFER_LAYOUT : SGN_ERROR_INVALID_ARGUMENT));
  }
  OK(sgn_world_destroy(world));
}

int main(void) {
  SgnContext *context = NULL;
  OK(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &context));
  make_cloth(&cloth, 0.125, 0.5);
  layouts(context);
  systems(context);
  coupled_bodies(context);
  shapes(context);
  OK(sgn_context_destroy(context));
  return finish();
}
