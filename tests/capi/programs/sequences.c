/* Random calls with random arguments, good and bad: statuses only, and what is refused leaves the world as it was.
 * Arguments: number of worlds, seed, first world. */
#include "check.h"

static uint64_t random_state;

static uint64_t noise(void) {
  random_state ^= random_state << 13, random_state ^= random_state >> 7, random_state ^= random_state << 17;
  return random_state;
}

static uint32_t below(uint32_t n) { return (uint32_t)((noise() >> 33) % n); }

/* Mostly of order one; now and then huge, tiny, a denormal or no number. */
static double number(void) {
  double unit = (double)(noise() >> 11) / 9007199254740992.0 * 2 - 1;
  switch (below(60)) {
    case 0: return 0;
    case 1: return unit * 1e-310;
    case 2: return unit * 1e300;
    case 3: return NAN;
    case 4: return INFINITY;
    case 5: return unit * 1e18;
    default: return unit;
  }
}

enum { BODIES = 12, MOST = 24 };

typedef struct Numbers {
  double x[MOST][3];
  double scalars[MOST];
  uint32_t triangles[MOST][3];
  uint32_t edges[MOST][2];
  unsigned char flags[MOST];
} Numbers;

static void fill(Numbers *n, uint32_t vertices, int clean) {
  for (int i = 0; i < MOST; i++) {
    for (int k = 0; k < 3; k++) {
      double unit = (double)(noise() >> 11) / 9007199254740992.0;
      n->x[i][k] = clean ? unit : number();
      n->triangles[i][k] = below(vertices + (clean ? 0 : below(40) == 0));
    }
    n->edges[i][0] = below(vertices), n->edges[i][1] = below(vertices);
    n->scalars[i] = clean ? 0.1 + fabs(n->x[i][0]) : number();
    n->flags[i] = below(5) == 0;
  }
}

static SgnBodyId some(const SgnBodyId *bodies) {
  SgnBodyId body = bodies[below(BODIES)];
  if (below(30) == 0) body.value = noise();
  if (below(30) == 0) body.value += 1;
  return body;
}

static long accepted = 0, refused = 0, stepped = 0;

static void one_world(int calls) {
  SgnContext *context = NULL;
  SgnWorld *world = NULL;
  SgnBodyId bodies[BODIES];
  SgnSystemId system = {0};
  SgnMaterialId material = {0};
  Numbers n;
  memset(bodies, 0, sizeof bodies);
  OK(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &context));
  OK(sgn_world_create(context, NULL, &world));
  for (int call = 0; call < calls; call++) {
    uint64_t before = state_hash(world);
    uint32_t vertices = 1 + below(MOST);
    int clean = below(3) != 0;
    SgnBodyId *slot = &bodies[below(BODIES)];
    SgnResult result = SGN_OK;
    int reading = 0;
    fill(&n, vertices, clean);
    switch (below(12)) {
      case 0: {
        SgnDeformableDesc desc;
        OK(sgn_deformable_desc_init(&desc, sizeof desc));
        desc.mesh.vertices = sgn_view(SGN_FORMAT_F64X3, n.x, vertices);
        desc.masses = sgn_view(SGN_FORMAT_F64, n.scalars, vertices);
        if (below(2)) desc.mesh.triangles = sgn_view(SGN_FORMAT_U32X3, n.triangles, below(5));
        if (below(2)) desc.mesh.edges = sgn_view(SGN_FORMAT_U32X2, n.edges, below(5));
        if (below(2)) desc.pinned = sgn_view(SGN_FORMAT_U8, n.flags, vertices);
        if (below(2)) desc.options.half_thickness = clean ? 0.001 : number();
        desc.precision = (int32_t)below(2);
        desc.options.material = material;
        result = sgn_deformable_create(world, &desc, slot);
        break;
      }
      case 1: {
        SgnRigidDesc desc = octahedron_desc(clean ? 1 : number(), clean ? n.x[0][0] : number());
        if (!clean) desc.orientation[1] = number(), desc.inertia[4] = number(), desc.velocity[0] = number();
        desc.precision = (int32_t)below(2);
        result = sgn_rigid_create(world, &desc, slot);
        break;
      }
      case 2: {
        SgnKinematicDesc desc;
        OK(sgn_kinematic_desc_init(&desc, sizeof desc));
        desc.mesh.vertices = sgn_view(SGN_FORMAT_F64X3, n.x, vertices);
        desc.mesh.triangles = sgn_view(SGN_FORMAT_U32X3, n.triangles, below(4));
        desc.options.flags = below(2) ? SGN_BODY_POSED : 0;
        result = sgn_kinematic_create(world, &desc, slot);
        break;
      }
      case 3: {
        SgnHalfSpaceDesc desc;
        OK(sgn_half_space_desc_init(&desc, sizeof desc));
        memcpy(desc.normal, n.x[0], sizeof desc.normal);
        desc.offset = clean ? -1.8 : number();
        result = sgn_half_space_create(world, &desc, slot);
        break;
      }
      case 4: result = below(4) ? sgn_body_set_filter(world, some(bodies), noise(), noise()) : sgn_body_destroy(world, some(bodies)); break;
      case 5:
      case 6: {
        SgnBodyInfo info;
        SgnView view;
        SgnBodyId body = some(bodies);
        int32_t what = (int32_t)below(19);
        uint64_t count = vertices;
        OK(sgn_body_info_init(&info, sizeof info));
        if (sgn_body_info(world, body, &info) == SGN_OK && below(10)) count = info.vertices;
        if (count > MOST || (info.kind == SGN_BODY_KIND_RIGID && below(10))) count = 1;
        view = sgn_view(SGN_FORMAT_F64X3, n.x, count);
        if (what == SGN_SLOT_POSE || what == SGN_SLOT_TARGET_POSE) view = sgn_view(SGN_FORMAT_F64X7, n.x, 1);
        if (what == SGN_SLOT_HALF_SPACE || what == SGN_SLOT_TARGET_HALF_SPACE) view = sgn_view(SGN_FORMAT_F64X4, n.x, 1);
        if (what == SGN_SLOT_MASS) view = sgn_view(SGN_FORMAT_F64, n.scalars, count);
        if (what == SGN_SLOT_PINNED) view = sgn_view(SGN_FORMAT_U8, n.flags, count);
        result = sgn_body_push(world, body, what, &view, below(4) == 0 ? SGN_PUSH_TELEPORT : 0);
        break;
      }
      case 7: {
        uint32_t offsets[3] = {0, 1, 2}, columns[2] = {0, 1};
        SgnSystemDesc desc;
        SgnBodyId body = some(bodies);
        OK(sgn_system_desc_init(&desc, sizeof desc));
        desc.bodies = &body, desc.body_count = 1;
        desc.row_offsets = sgn_view(SGN_FORMAT_U32, offsets, 3);
        desc.columns = sgn_view(SGN_FORMAT_U32, columns, 2);
        result = sgn_system_create(world, &desc, &system);
        if (result == SGN_OK) before = state_hash(world);
        break;
      }
      case 8: {
        double blocks[2][9];
        SgnView view = sgn_view(SGN_FORMAT_F64_3X3_ROWS, blocks, 2);
        for (int i = 0; i < 18; i++) blocks[i / 9][i % 9] = clean ? (i % 9 % 4 == 0) : number();
        result = below(4) ? sgn_system_push(world, system, &view) : sgn_system_destroy(world, system);
        break;
      }
      case 9: {
        SgnMaterialDesc desc;
        OK(sgn_material_desc_init(&desc, sizeof desc));
        desc.friction = number();
        desc.combine = (int32_t)below(6);
        result = sgn_material_create(world, &desc, &material);
        break;
      }
      case 10: {
        SgnCheckReport report;
        uint64_t count = 0;
        SgnViewMut out = sgn_view_mut(SGN_FORMAT_F64X3, n.x, MOST);
        reading = 1;
        OK(sgn_check_report_init(&report, sizeof report));
        result = sgn_world_check(world, &report);
        CHECK(result == SGN_OK);
        CHECK(sgn_world_pull_witnesses(world, SGN_WITNESS_POINT, &out, &count) >= 0 && count == report.intersections);
        CHECK(sgn_world_pull_contacts(world, SGN_CONTACT_POINT, &out, &count) >= 0);
        out.count = 1 + below(MOST);
        (void)sgn_body_pull(world, some(bodies), (int32_t)below(19), &out);
        break;
      }
      default: {
        SgnStepDesc desc;
        OK(sgn_step_desc_init(&desc, sizeof desc));
        desc.dt = clean ? 0.01 : number();
        desc.policy = (int32_t)below(2);
        desc.flags = below(2);
        desc.solver = (int32_t)below(7);
        desc.iterations_max = 50;
        result = sgn_world_step(world, &desc, NULL);
        stepped += result >= 0;
        if (result == SGN_ERROR_PINCHED) before = state_hash(world);
      }
    }
    CHECK(result != SGN_ERROR_PANIC && result != SGN_ERROR_POISONED && result != SGN_ERROR_BUSY);
    if (result == SGN_ERROR_PANIC) {
      char text[300];
      SgnErrorInfo info;
      OK(sgn_error_info_init(&info, sizeof info));
      info.message = text, info.message_capacity = sizeof text;
      if (sgn_context_last_error(context, &info) >= 0) printf("%s\n", text);
      break;
    }
    if (result < 0 || reading) CHECK(state_hash(world) == before);
    if (result < 0) refused++; else accepted++;
  }
  OK(sgn_world_destroy(world));
  OK(sgn_context_destroy(context));
}

int main(int count, char **arguments) {
  int worlds = count > 1 ? atoi(arguments[1]) : 60;
  uint64_t seed = count > 2 ? strtoull(arguments[2], NULL, 10) : 1;
  int first = count > 3 ? atoi(arguments[3]) : 0;
  for (int i = first; i < first + worlds && failures == 0; i++) {
    random_state = (seed * 1000003u + (uint64_t)i + 1) * 0x9e3779b97f4a7c15u;
    one_world(120);
    if (failures) printf("world %d of seed %llu\n", i, (unsigned long long)seed);
  }
  CHECK(accepted > worlds && refused > worlds && stepped > worlds);
  if (failures) printf("%ld accepted, %ld refused, %ld steps\n", accepted, refused, stepped);
  return finish();
}
