/* Wrong arguments: every call gives a status and leaves the world as it was. */
#include "check.h"

typedef struct Fixture {
  SgnContext *context;
  SgnWorld *world;
  SgnBodyId cloth, ball, ground, script;
  SgnMaterialId material;
  SgnSystemId system;
  uint64_t hash;
} Fixture;

static Cloth cloth;

static uint32_t diagonal_offsets[VERTICES + 1], diagonal_columns[VERTICES];
static double diagonal_blocks[VERTICES][9];

static SgnSystemDesc diagonal_desc(const SgnBodyId *body) {
  SgnSystemDesc desc;
  OK(sgn_system_desc_init(&desc, sizeof desc));
  for (uint32_t i = 0; i < VERTICES; i++) {
    diagonal_offsets[i + 1] = i + 1;
    diagonal_columns[i] = i;
    memset(diagonal_blocks[i], 0, sizeof diagonal_blocks[i]);
    diagonal_blocks[i][0] = diagonal_blocks[i][4] = diagonal_blocks[i][8] = 0.01;
  }
  desc.bodies = body;
  desc.body_count = 1;
  desc.row_offsets = sgn_view(SGN_FORMAT_U32, diagonal_offsets, VERTICES + 1);
  desc.columns = sgn_view(SGN_FORMAT_U32, diagonal_columns, VERTICES);
  return desc;
}

static Fixture fixture(void) {
  Fixture f;
  SgnDeformableDesc cloth_;
  SgnRigidDesc ball;
  SgnKinematicDesc script;
  SgnHalfSpaceDesc ground;
  SgnMaterialDesc material;
  SgnSystemDesc system;
  SgnView blocks;
  memset(&f, 0, sizeof f);
  OK(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &f.context));
  OK(sgn_world_create(f.context, NULL, &f.world));
  make_cloth(&cloth, 0.1, 0.5);
  cloth_ = cloth_desc(&cloth);
  OK(sgn_deformable_create(f.world, &cloth_, &f.cloth));
  ball = octahedron_desc(0.1, 1.0);
  OK(sgn_rigid_create(f.world, &ball, &f.ball));
  OK(sgn_kinematic_desc_init(&script, sizeof script));
  script.mesh.vertices = sgn_view(SGN_FORMAT_F64X3, OCTAHEDRON, 6);
  OK(sgn_kinematic_create(f.world, &script, &f.script));
  OK(sgn_half_space_desc_init(&ground, sizeof ground));
  ground.offset = -1;
  OK(sgn_half_space_create(f.world, &ground, &f.ground));
  OK(sgn_material_desc_init(&material, sizeof material));
  material.friction = 0.5;
  OK(sgn_material_create(f.world, &material, &f.material));
  system = diagonal_desc(&f.cloth);
  OK(sgn_system_create(f.world, &system, &f.system));
  blocks = sgn_view(SGN_FORMAT_F64_3X3_ROWS, diagonal_blocks, VERTICES);
  OK(sgn_system_push(f.world, f.system, &blocks));
  f.hash = state_hash(f.world);
  return f;
}

static void destroy(Fixture *f) {
  CHECK(state_hash(f->world) == f->hash);
  OK(sgn_world_destroy(f->world));
  OK(sgn_context_destroy(f->context));
}

/* Every function with each of its pointers NULL, the others right. */
static void null_pointers(void) {
  Fixture f = fixture();
  SgnView view = sgn_view(SGN_FORMAT_F64X3, cloth.v, VERTICES), blocks = sgn_view(SGN_FORMAT_F64_3X3_ROWS, diagonal_blocks, VERTICES);
  SgnViewMut out = sgn_view_mut(SGN_FORMAT_F64X3, cloth.v, VERTICES);
  SgnContextDesc context_desc;
  SgnContext *context;
  SgnWorld *world;
  SgnErrorInfo error;
  SgnDeformableDesc deformable = cloth_desc(&cloth);
  SgnRigidDesc rigid = octahedron_desc(1, 2);
  SgnKinematicDesc kinematic;
  SgnSheetDesc sheet;
  SgnSolidDesc solid;
  const double field[3] = {0, 0, -1};
  SgnHalfSpaceDesc half_space;
  SgnMaterialDesc material;
  SgnSystemDesc system = diagonal_desc(&f.cloth);
  SgnShapeDesc shape;
  SgnStepDesc step;
  SgnStepReport report;
  SgnCheckReport check;
  SgnBodyInfo info;
  SgnVersion version;
  SgnWorldDesc world_desc;
  SgnBodyId body = {77};
  unsigned char room[64] = {0};
  SgnMaterialId material_id = {77};
  SgnSystemId system_id = {77};
  SgnApi api;
  uint64_t number = 77;
  int64_t value;
  const char *name;

#define NULLED(call) GIVES(SGN_ERROR_NULL_ARGUMENT, call)
  NULLED(sgn_context_desc_init(NULL, sizeof context_desc));
  NULLED(sgn_error_info_init(NULL, sizeof error));
  NULLED(sgn_world_desc_init(NULL, sizeof world_desc));
  NULLED(sgn_material_desc_init(NULL, sizeof material));
  NULLED(sgn_deformable_desc_init(NULL, sizeof deformable));
  NULLED(sgn_rigid_desc_init(NULL, sizeof rigid));
  NULLED(sgn_kinematic_desc_init(NULL, sizeof kinematic));
  NULLED(sgn_sheet_desc_init(NULL, sizeof sheet));
  NULLED(sgn_solid_desc_init(NULL, sizeof solid));
  NULLED(sgn_half_space_desc_init(NULL, sizeof half_space));
  NULLED(sgn_shape_desc_init(NULL, sizeof shape));
  NULLED(sgn_system_desc_init(NULL, sizeof system));
  NULLED(sgn_step_desc_init(NULL, sizeof step));
  NULLED(sgn_step_report_init(NULL, sizeof report));
  NULLED(sgn_check_report_init(NULL, sizeof check));
  NULLED(sgn_body_info_init(NULL, sizeof info));
  NULLED(sgn_version_init(NULL, sizeof version));
  NULLED(sgn_api_init(NULL, sizeof api));
  NULLED(sgn_version(NULL));
  NULLED(sgn_query(SGN_CAPABILITY_METHODS, NULL));
  NULLED(sgn_result_name(SGN_OK, NULL));
  NULLED(sgn_get_api(SGN_ABI_VERSION, NULL));
  NULLED(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, NULL));
  OK(sgn_context_destroy(NULL));
  OK(sgn_world_destroy(NULL));
  OK(sgn_error_info_init(&error, sizeof error));
  NULLED(sgn_context_last_error(NULL, &error));
  NULLED(sgn_context_last_error(f.context, NULL));
  NULLED(sgn_world_create(NULL, NULL, &world));
  NULLED(sgn_world_create(f.context, NULL, NULL));
  NULLED(sgn_world_state_hash(NULL, &number));
  NULLED(sgn_world_state_hash(f.world, NULL));
  NULLED(sgn_world_snapshot_size(NULL, &number));
  NULLED(sgn_world_snapshot_size(f.world, NULL));
  NULLED(sgn_world_snapshot_save(NULL, room, sizeof room, &number));
  NULLED(sgn_world_snapshot_save(f.world, NULL, sizeof room, &number));
  NULLED(sgn_world_snapshot_load(NULL, room, sizeof room));
  NULLED(sgn_world_snapshot_load(f.world, NULL, sizeof room));
  GIVES(SGN_ERROR_SNAPSHOT_MISMATCH, sgn_world_snapshot_load(f.world, room, sizeof room));
  GIVES(SGN_ERROR_SNAPSHOT_MISMATCH, sgn_world_snapshot_load(f.world, room, 0));
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_world_snapshot_load(f.world, room, UINT64_MAX));
  OK(sgn_material_desc_init(&material, sizeof material));
  NULLED(sgn_material_create(NULL, &material, &material_id));
  NULLED(sgn_material_create(f.world, NULL, &material_id));
  NULLED(sgn_material_create(f.world, &material, NULL));
  NULLED(sgn_material_set(NULL, f.material, &material));
  NULLED(sgn_material_set(f.world, f.material, NULL));
  NULLED(sgn_material_set_pair(NULL, f.material, f.material, 0.5));
  NULLED(sgn_deformable_create(NULL, &deformable, &body));
  NULLED(sgn_deformable_create(f.world, NULL, &body));
  NULLED(sgn_deformable_create(f.world, &deformable, NULL));
  NULLED(sgn_rigid_create(NULL, &rigid, &body));
  NULLED(sgn_rigid_create(f.world, NULL, &body));
  NULLED(sgn_rigid_create(f.world, &rigid, NULL));
  OK(sgn_kinematic_desc_init(&kinematic, sizeof kinematic));
  NULLED(sgn_kinematic_create(NULL, &kinematic, &body));
  NULLED(sgn_kinematic_create(f.world, NULL, &body));
  NULLED(sgn_kinematic_create(f.world, &kinematic, NULL));
  OK(sgn_sheet_desc_init(&sheet, sizeof sheet));
  NULLED(sgn_sheet_create(NULL, &sheet, &body));
  NULLED(sgn_sheet_create(f.world, NULL, &body));
  NULLED(sgn_sheet_create(f.world, &sheet, NULL));
  OK(sgn_solid_desc_init(&solid, sizeof solid));
  NULLED(sgn_solid_create(NULL, &solid, &body));
  NULLED(sgn_solid_create(f.world, NULL, &body));
  NULLED(sgn_solid_create(f.world, &solid, NULL));
  NULLED(sgn_world_set_gravity(NULL, field));
  NULLED(sgn_world_set_gravity(f.world, NULL));
  NULLED(sgn_world_set_wind(NULL, field));
  NULLED(sgn_world_set_wind(f.world, NULL));
  OK(sgn_half_space_desc_init(&half_space, sizeof half_space));
  NULLED(sgn_half_space_create(NULL, &half_space, &body));
  NULLED(sgn_half_space_create(f.world, NULL, &body));
  NULLED(sgn_half_space_create(f.world, &half_space, NULL));
  NULLED(sgn_body_destroy(NULL, f.cloth));
  NULLED(sgn_body_set_filter(NULL, f.cloth, 1, 1));
  NULLED(sgn_body_set_material(NULL, f.cloth, f.material));
  OK(sgn_body_info_init(&info, sizeof info));
  NULLED(sgn_body_info(NULL, f.cloth, &info));
  NULLED(sgn_body_info(f.world, f.cloth, NULL));
  NULLED(sgn_body_push(NULL, f.cloth, SGN_SLOT_VELOCITY, &view, 0));
  NULLED(sgn_body_push(f.world, f.cloth, SGN_SLOT_VELOCITY, NULL, 0));
  NULLED(sgn_body_pull(NULL, f.cloth, SGN_SLOT_VELOCITY, &out));
  NULLED(sgn_body_pull(f.world, f.cloth, SGN_SLOT_VELOCITY, NULL));
  NULLED(sgn_system_create(NULL, &system, &system_id));
  NULLED(sgn_system_create(f.world, NULL, &system_id));
  NULLED(sgn_system_create(f.world, &system, NULL));
  system.bodies = NULL;
  NULLED(sgn_system_create(f.world, &system, &system_id));
  NULLED(sgn_system_push(NULL, f.system, &blocks));
  NULLED(sgn_system_push(f.world, f.system, NULL));
  NULLED(sgn_system_destroy(NULL, f.system));
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  NULLED(sgn_world_step(NULL, &step, NULL));
  NULLED(sgn_world_step(f.world, NULL, NULL));
  NULLED(sgn_world_pull_contacts(NULL, SGN_CONTACT_KEY, NULL, &number));
  NULLED(sgn_world_pull_contacts(f.world, SGN_CONTACT_KEY, NULL, NULL));
  NULLED(sgn_world_pull_witnesses(NULL, SGN_WITNESS_POINT, NULL, &number));
  NULLED(sgn_world_pull_witnesses(f.world, SGN_WITNESS_POINT, NULL, NULL));
  OK(sgn_check_report_init(&check, sizeof check));
  NULLED(sgn_world_check(NULL, &check));
  NULLED(sgn_world_check(f.world, NULL));
  /* Views without memory. */
  view.ptr = NULL;
  NULLED(sgn_body_push(f.world, f.cloth, SGN_SLOT_VELOCITY, &view, 0));
  out.ptr = NULL;
  NULLED(sgn_body_pull(f.world, f.cloth, SGN_SLOT_VELOCITY, &out));
  deformable.masses.ptr = NULL;
  NULLED(sgn_deformable_create(f.world, &deformable, &body));
  CHECK(body.value == 77 && material_id.value == 77 && system_id.value == 77 && number == 77);
  (void)context, (void)value, (void)name;
  destroy(&f);
}

/* Ids that are null, garbage, of another kind, of another world, or stale. */
static void wrong_ids(void) {
  Fixture f = fixture(), other = fixture();
  SgnView view = sgn_view(SGN_FORMAT_F64X3, cloth.v, VERTICES), blocks = sgn_view(SGN_FORMAT_F64_3X3_ROWS, diagonal_blocks, VERTICES);
  SgnViewMut out = sgn_view_mut(SGN_FORMAT_F64X3, cloth.v, VERTICES);
  SgnSystemDesc system;
  SgnMaterialDesc material;
  SgnBodyInfo info;
  SgnSystemId system_id;
  SgnRigidDesc ball = octahedron_desc(1, 3);
  SgnBodyId removed;
  uint64_t wrong[64];
  int count = 0;
  wrong[count++] = 0;
  wrong[count++] = UINT64_MAX;
  wrong[count++] = 1;
  wrong[count++] = f.material.value;
  wrong[count++] = f.system.value;
  wrong[count++] = other.cloth.value;
  wrong[count++] = f.cloth.value + 100;
  wrong[count++] = f.cloth.value ^ ((uint64_t)1 << 63);
  wrong[count++] = f.cloth.value + ((uint64_t)1 << 32);
  for (uint64_t x = 88172645463325252u; count < 64; count++) { /* and noise */
    x ^= x << 13, x ^= x >> 7, x ^= x << 17;
    wrong[count] = x;
  }
  OK(sgn_body_info_init(&info, sizeof info));
  OK(sgn_material_desc_init(&material, sizeof material));
  for (int i = 0; i < count; i++) {
    SgnBodyId body = {wrong[i]};
    SgnMaterialId m = {wrong[i] == f.material.value ? f.cloth.value : wrong[i]};
    SgnSystemId s = {wrong[i] == f.system.value ? f.cloth.value : wrong[i]};
    SgnBodyId list[2];
    list[0] = f.ball, list[1] = body;
    system = diagonal_desc(&body);
    GIVES(SGN_ERROR_INVALID_ID, sgn_body_destroy(f.world, body));
    GIVES(SGN_ERROR_INVALID_ID, sgn_body_set_filter(f.world, body, 1, 1));
    GIVES(SGN_ERROR_INVALID_ID, sgn_body_set_material(f.world, body, f.material));
    GIVES(SGN_ERROR_INVALID_ID, sgn_body_info(f.world, body, &info));
    GIVES(SGN_ERROR_INVALID_ID, sgn_body_push(f.world, body, SGN_SLOT_VELOCITY, &view, 0));
    GIVES(SGN_ERROR_INVALID_ID, sgn_body_pull(f.world, body, SGN_SLOT_VELOCITY, &out));
    GIVES(SGN_ERROR_INVALID_ID, sgn_system_create(f.world, &system, &system_id));
    system.bodies = list, system.body_count = 2;
    GIVES(SGN_ERROR_INVALID_ID, sgn_system_create(f.world, &system, &system_id));
    GIVES(SGN_ERROR_INVALID_ID, sgn_system_push(f.world, s, &blocks));
    GIVES(SGN_ERROR_INVALID_ID, sgn_system_destroy(f.world, s));
    GIVES(SGN_ERROR_INVALID_ID, sgn_material_set(f.world, m, &material));
    if (m.value != 0) {
      GIVES(SGN_ERROR_INVALID_ID, sgn_material_set_pair(f.world, f.material, m, 0.5));
      GIVES(SGN_ERROR_INVALID_ID, sgn_body_set_material(f.world, f.cloth, m));
      ball.options.material = m;
      GIVES(SGN_ERROR_INVALID_ID, sgn_rigid_create(f.world, &ball, &removed));
    }
  }
  destroy(&f);
  /* Stale ids: of a removed body, and of the system that named it; the slot used again gives another id. */
  OK(sgn_body_destroy(other.world, other.cloth));
  GIVES(SGN_ERROR_STALE_ID, sgn_body_info(other.world, other.cloth, &info));
  GIVES(SGN_ERROR_STALE_ID, sgn_body_destroy(other.world, other.cloth));
  GIVES(SGN_ERROR_STALE_ID, sgn_body_push(other.world, other.cloth, SGN_SLOT_VELOCITY, &view, 0));
  GIVES(SGN_ERROR_STALE_ID, sgn_system_push(other.world, other.system, &blocks));
  ball.options.material.value = 0;
  OK(sgn_rigid_create(other.world, &ball, &removed));
  CHECK(removed.value != other.cloth.value);
  GIVES(SGN_ERROR_STALE_ID, sgn_body_info(other.world, other.cloth, &info));
  OK(sgn_body_info(other.world, removed, &info));
  CHECK(info.kind == SGN_BODY_KIND_RIGID && info.vertices == 6 && info.triangles == 8 && info.edges == 12 && info.velocities == 1);
  OK(sgn_world_destroy(other.world));
  OK(sgn_context_destroy(other.context));
}

/* One struct with each wrong size, and with a tail that is not zero. */
#define SIZES(Type, init, call)                                                     \
  do {                                                                              \
    union {                                                                         \
      Type desc;                                                                    \
      unsigned char bytes[sizeof(Type) + 64];                                       \
    } room;                                                                         \
    uint32_t sizes[6] = {0, 3, (uint32_t)sizeof(Type) - 1, 5000, UINT32_MAX, 4};    \
    Type *desc = &room.desc;                                                        \
    for (int i_ = 0; i_ < 6; i_++) {                                                \
      GIVES(SGN_ERROR_BAD_STRUCT, init(desc, sizes[i_]));                           \
      OK(init(desc, sizeof(Type)));                                                 \
      memcpy(&room, &sizes[i_], 4);                                                 \
      GIVES(SGN_ERROR_BAD_STRUCT, call);                                            \
    }                                                                               \
    memset(&room, 0xff, sizeof room);                                               \
    OK(init(desc, sizeof room));                                                    \
    for (size_t k_ = sizeof(Type); k_ < sizeof room; k_++) CHECK(room.bytes[k_] == 0); \
    room.bytes[sizeof(Type) + 17] = 1;                                              \
    if (tail_counts) GIVES(SGN_ERROR_UNSUPPORTED_STRUCT, call);                     \
  } while (0)

static void wrong_structs(void) {
  Fixture f = fixture();
  SgnContext *context;
  SgnWorld *world;
  SgnBodyId body;
  SgnMaterialId material;
  SgnSystemId system;
  SgnStepDesc step;
  int tail_counts = 1;
  SIZES(SgnContextDesc, sgn_context_desc_init, sgn_context_create(SGN_ABI_VERSION, desc, NULL, 0, &context));
  SIZES(SgnErrorInfo, sgn_error_info_init, sgn_context_last_error(f.context, desc));
  SIZES(SgnWorldDesc, sgn_world_desc_init, sgn_world_create(f.context, desc, &world));
  SIZES(SgnMaterialDesc, sgn_material_desc_init, sgn_material_create(f.world, desc, &material));
  SIZES(SgnMaterialDesc, sgn_material_desc_init, sgn_material_set(f.world, f.material, desc));
  SIZES(SgnDeformableDesc, sgn_deformable_desc_init, sgn_deformable_create(f.world, desc, &body));
  SIZES(SgnRigidDesc, sgn_rigid_desc_init, sgn_rigid_create(f.world, desc, &body));
  SIZES(SgnKinematicDesc, sgn_kinematic_desc_init, sgn_kinematic_create(f.world, desc, &body));
  SIZES(SgnSheetDesc, sgn_sheet_desc_init, sgn_sheet_create(f.world, desc, &body));
  SIZES(SgnSolidDesc, sgn_solid_desc_init, sgn_solid_create(f.world, desc, &body));
  SIZES(SgnHalfSpaceDesc, sgn_half_space_desc_init, sgn_half_space_create(f.world, desc, &body));
  SIZES(SgnSystemDesc, sgn_system_desc_init, sgn_system_create(f.world, desc, &system));
  SIZES(SgnStepDesc, sgn_step_desc_init, sgn_world_step(f.world, desc, NULL));
  /* Output structs: only their size is read; a bad report must not let the step happen. */
  tail_counts = 0;
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  SIZES(SgnStepReport, sgn_step_report_init, sgn_world_step(f.world, &step, desc));
  SIZES(SgnCheckReport, sgn_check_report_init, sgn_world_check(f.world, desc));
  SIZES(SgnBodyInfo, sgn_body_info_init, sgn_body_info(f.world, f.cloth, desc));
  SIZES(SgnVersion, sgn_version_init, sgn_version(desc));
  SIZES(SgnApi, sgn_api_init, sgn_get_api(SGN_ABI_VERSION, desc));
  GIVES(SGN_ERROR_ABI_MISMATCH, sgn_context_create(SGN_ABI_VERSION + 1, NULL, NULL, 0, &context));
  {
    char text[8] = "unused!";
    GIVES(SGN_ERROR_ABI_MISMATCH, sgn_context_create(99, NULL, text, sizeof text, &context));
    CHECK(strcmp(text, "the hea") == 0);
  }
  destroy(&f);
}

/* Enums, flags and numbers out of their range. */
static void wrong_values(void) {
  Fixture f = fixture();
  const double nan_ = NAN, infinity = INFINITY;
  const double bad[3] = {nan_, infinity, -infinity};
  const int32_t codes[5] = {-1, 999, INT32_MIN, INT32_MAX, 77};
  SgnView view = sgn_view(SGN_FORMAT_F64X3, cloth.v, VERTICES);
  SgnViewMut out = sgn_view_mut(SGN_FORMAT_F64X3, cloth.v, VERTICES);
  SgnContext *context;
  SgnContextDesc context_desc;
  SgnMaterialDesc material;
  SgnRigidDesc rigid;
  SgnHalfSpaceDesc plane;
  SgnStepDesc step;
  SgnBodyId body;
  SgnMaterialId material_id;
  uint64_t count;
  for (int i = 0; i < 5; i++) {
    OK(sgn_context_desc_init(&context_desc, sizeof context_desc));
    context_desc.executor = codes[i];
    GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_context_create(SGN_ABI_VERSION, &context_desc, NULL, 0, &context));
    OK(sgn_context_desc_init(&context_desc, sizeof context_desc));
    context_desc.log_level = codes[i];
    GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_context_create(SGN_ABI_VERSION, &context_desc, NULL, 0, &context));
    OK(sgn_material_desc_init(&material, sizeof material));
    material.combine = codes[i];
    GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_material_create(f.world, &material, &material_id));
    rigid = octahedron_desc(1, 2);
    rigid.precision = codes[i];
    GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_rigid_create(f.world, &rigid, &body));
    GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_body_push(f.world, f.cloth, codes[i], &view, 0));
    GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_body_pull(f.world, f.cloth, codes[i], &out));
    GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_world_pull_contacts(f.world, codes[i], NULL, &count));
    GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_world_pull_witnesses(f.world, codes[i], NULL, &count));
    view.format = codes[i];
    GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_body_push(f.world, f.cloth, SGN_SLOT_VELOCITY, &view, 0));
    view.format = SGN_FORMAT_F64X3;
#define WRONG_STEP(field, value, code)                      \
  OK(sgn_step_desc_init(&step, sizeof step));               \
  step.dt = 0.01;                                           \
  step.field = value;                                       \
  GIVES(code, sgn_world_step(f.world, &step, NULL))
    WRONG_STEP(method, codes[i], SGN_ERROR_INVALID_ARGUMENT);
    WRONG_STEP(solver, codes[i], SGN_ERROR_INVALID_ARGUMENT);
    WRONG_STEP(friction_cone, codes[i], SGN_ERROR_INVALID_ARGUMENT);
    WRONG_STEP(policy, codes[i], SGN_ERROR_INVALID_ARGUMENT);
  }
  WRONG_STEP(method, SGN_METHOD_ASYNCHRONOUS, SGN_ERROR_UNSUPPORTED);
  WRONG_STEP(dt, 0, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_STEP(dt, -1, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_STEP(flags, (uint64_t)1 << 40, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_STEP(contact_tolerance, -1, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_STEP(iterations_max, 0, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_STEP(restitution, 1.01, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_STEP(repulsion_stiffness, -1, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_STEP(reserved, 1, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_STEP(halvings_max, 21, SGN_ERROR_INVALID_ARGUMENT);
  OK(sgn_context_desc_init(&context_desc, sizeof context_desc));
  context_desc.executor = SGN_EXECUTOR_HOST;
  GIVES(SGN_ERROR_UNSUPPORTED, sgn_context_create(SGN_ABI_VERSION, &context_desc, NULL, 0, &context));
  context_desc.executor = SGN_EXECUTOR_POOL;
  context_desc.workers = 0;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_context_create(SGN_ABI_VERSION, &context_desc, NULL, 0, &context));
  context_desc.workers = 100000;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_context_create(SGN_ABI_VERSION, &context_desc, NULL, 0, &context));
  for (int i = 0; i < 3; i++) {
    WRONG_STEP(dt, bad[i], SGN_ERROR_NON_FINITE_INPUT);
    WRONG_STEP(turn_max, bad[i], SGN_ERROR_NON_FINITE_INPUT);
    OK(sgn_material_desc_init(&material, sizeof material));
    material.friction = bad[i];
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_material_create(f.world, &material, &material_id));
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_material_set(f.world, f.material, &material));
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_material_set_pair(f.world, f.material, f.material, bad[i]));
#define WRONG_RIGID(field, value, code)                     \
  rigid = octahedron_desc(1, 2);                            \
  rigid.field = value;                                      \
  GIVES(code, sgn_rigid_create(f.world, &rigid, &body))
    WRONG_RIGID(options.half_thickness, bad[i], SGN_ERROR_NON_FINITE_INPUT);
    WRONG_RIGID(mass, bad[i], SGN_ERROR_NON_FINITE_INPUT);
    WRONG_RIGID(inertia[5], bad[i], SGN_ERROR_NON_FINITE_INPUT);
    WRONG_RIGID(position[1], bad[i], SGN_ERROR_NON_FINITE_INPUT);
    WRONG_RIGID(orientation[2], bad[i], SGN_ERROR_NON_FINITE_INPUT);
    WRONG_RIGID(velocity[0], bad[i], SGN_ERROR_NON_FINITE_INPUT);
    WRONG_RIGID(angular_velocity[2], bad[i], SGN_ERROR_NON_FINITE_INPUT);
    OK(sgn_half_space_desc_init(&plane, sizeof plane));
    plane.normal[1] = bad[i];
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_half_space_create(f.world, &plane, &body));
    OK(sgn_half_space_desc_init(&plane, sizeof plane));
    plane.offset = bad[i];
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_half_space_create(f.world, &plane, &body));
  }
  WRONG_RIGID(mass, 0, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_RIGID(mass, -1, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_RIGID(inertia[1], 1, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_RIGID(inertia[4], -1, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_RIGID(orientation[3], 0, SGN_ERROR_INVALID_ARGUMENT);
  WRONG_RIGID(options.flags, 1u << 30, SGN_ERROR_INVALID_ARGUMENT);
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_material_set_pair(f.world, f.material, f.material, -0.1));
  OK(sgn_half_space_desc_init(&plane, sizeof plane));
  plane.normal[2] = 0;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_half_space_create(f.world, &plane, &body));
  /* Slots that a kind of body does not have. */
  GIVES(SGN_ERROR_UNSUPPORTED, sgn_body_push(f.world, f.cloth, SGN_SLOT_IMPULSE, &view, 0));
  GIVES(SGN_ERROR_UNSUPPORTED, sgn_body_push(f.world, f.cloth, SGN_SLOT_TARGET_POSITION, &view, 0));
  GIVES(SGN_ERROR_UNSUPPORTED, sgn_body_push(f.world, f.script, SGN_SLOT_VELOCITY, &view, 0));
  GIVES(SGN_ERROR_UNSUPPORTED, sgn_body_pull(f.world, f.cloth, SGN_SLOT_POSE, &out));
  GIVES(SGN_ERROR_UNSUPPORTED, sgn_body_pull(f.world, f.cloth, SGN_SLOT_MASS, &out));
  GIVES(SGN_ERROR_UNSUPPORTED, sgn_body_pull(f.world, f.ground, SGN_SLOT_VELOCITY, &out));
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_body_push(f.world, f.cloth, SGN_SLOT_VELOCITY, &view, SGN_PUSH_TELEPORT));
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_body_push(f.world, f.cloth, SGN_SLOT_POSITION, &view, 6));
  destroy(&f);
}

/* The last error names function, object, index and value. */
static void error_is(const Fixture *f, SgnResult code, uint64_t object, uint64_t index, double value, const char *part) {
  char text[200];
  SgnErrorInfo info;
  OK(sgn_error_info_init(&info, sizeof info));
  info.message = text;
  info.message_capacity = sizeof text;
  OK(sgn_context_last_error(f->context, &info));
  CHECK(info.code == code);
  CHECK(info.object == object);
  CHECK(info.index == index);
  CHECK(info.value == value || (isnan(info.value) && isnan(value)));
  CHECK(info.message_length == strlen(text));
  if (!strstr(text, part)) {
    failures++;
    printf("\"%s\" does not say \"%s\"\n", text, part);
  }
  CHECK(state_hash(f->world) == f->hash);
}

/* NaN, infinity and wrong indices in every input array. */
static void wrong_arrays(void) {
  Fixture f = fixture();
  const double bad[3] = {NAN, INFINITY, -INFINITY};
  double x[VERTICES][3], mass[VERTICES], blocks[VERTICES][9], pose[7] = {0, 0, 0, 0, 0, 0, 1}, plane[4] = {0, 0, 1, 0};
  uint32_t triangles[TRIANGLES][3];
  uint64_t wide[2] = {3, (uint64_t)1 << 33};
  SgnView view = sgn_view(SGN_FORMAT_F64X3, x, VERTICES), one = sgn_view(SGN_FORMAT_F64X3, x[3], 1);
  SgnView pose_view = sgn_view(SGN_FORMAT_F64X7, pose, 1), plane_view = sgn_view(SGN_FORMAT_F64X4, plane, 1);
  SgnView mass_view = sgn_view(SGN_FORMAT_F64, mass, VERTICES), six = sgn_view(SGN_FORMAT_F64X3, x, 6);
  SgnView block_view = sgn_view(SGN_FORMAT_F64_3X3_ROWS, blocks, VERTICES);
  SgnDeformableDesc desc;
  SgnBodyId body;
  memcpy(blocks, diagonal_blocks, sizeof blocks);
  for (int i = 0; i < 3; i++) {
    memcpy(x, cloth.x, sizeof x);
    memcpy(mass, cloth.mass, sizeof mass);
    x[3][1] = mass[17] = bad[i];
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_body_push(f.world, f.cloth, SGN_SLOT_POSITION, &view, 0));
    error_is(&f, SGN_ERROR_NON_FINITE_INPUT, f.cloth.value, 3, bad[i], "sgn_body_push: position[3]");
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_body_push(f.world, f.cloth, SGN_SLOT_POSITION, &view, SGN_PUSH_TELEPORT));
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_body_push(f.world, f.cloth, SGN_SLOT_VELOCITY, &view, 0));
    error_is(&f, SGN_ERROR_NON_FINITE_INPUT, f.cloth.value, 3, bad[i], "velocity[3]");
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_body_push(f.world, f.ball, SGN_SLOT_VELOCITY, &one, 0));
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_body_push(f.world, f.ball, SGN_SLOT_ANGULAR_VELOCITY, &one, 0));
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_body_push(f.world, f.script, SGN_SLOT_TARGET_POSITION, &six, 0));
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_body_push(f.world, f.cloth, SGN_SLOT_MASS, &mass_view, 0));
    error_is(&f, SGN_ERROR_NON_FINITE_INPUT, f.cloth.value, 17, bad[i], "mass[17]");
    for (int k = 0; k < 7; k++) {
      double kept = pose[k];
      pose[k] = bad[i];
      GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_body_push(f.world, f.ball, SGN_SLOT_POSE, &pose_view, 0));
      pose[k] = kept;
    }
    plane[3] = bad[i];
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_body_push(f.world, f.ground, SGN_SLOT_HALF_SPACE, &plane_view, 0));
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_body_push(f.world, f.ground, SGN_SLOT_TARGET_HALF_SPACE, &plane_view, 0));
    plane[3] = 0;
    blocks[5][2] = bad[i];
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_system_push(f.world, f.system, &block_view));
    blocks[5][2] = 0;
    desc = cloth_desc(&cloth);
    desc.mesh.vertices.ptr = x;
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_deformable_create(f.world, &desc, &body));
    desc = cloth_desc(&cloth);
    desc.rest_positions = view;
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_deformable_create(f.world, &desc, &body));
    desc = cloth_desc(&cloth);
    desc.masses = mass_view;
    GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_deformable_create(f.world, &desc, &body));
    error_is(&f, SGN_ERROR_NON_FINITE_INPUT, 0, 17, bad[i], "sgn_deformable_create: masses[17]");
  }
  /* Values and indices. */
  mass[17] = 0;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_body_push(f.world, f.cloth, SGN_SLOT_MASS, &mass_view, 0));
  error_is(&f, SGN_ERROR_INVALID_ARGUMENT, f.cloth.value, 17, 0, "not positive");
  memcpy(triangles, cloth.triangles, sizeof triangles);
  triangles[9][1] = VERTICES;
  desc = cloth_desc(&cloth);
  desc.mesh.triangles.ptr = triangles;
  GIVES(SGN_ERROR_BAD_TOPOLOGY, sgn_deformable_create(f.world, &desc, &body));
  error_is(&f, SGN_ERROR_BAD_TOPOLOGY, 0, 9, VERTICES, "(element 9)");
  triangles[9][1] = triangles[9][0];
  GIVES(SGN_ERROR_BAD_TOPOLOGY, sgn_deformable_create(f.world, &desc, &body));
  desc = cloth_desc(&cloth);
  desc.mesh.points = sgn_view(SGN_FORMAT_U64, wide, 2);
  GIVES(SGN_ERROR_BAD_TOPOLOGY, sgn_deformable_create(f.world, &desc, &body));
  error_is(&f, SGN_ERROR_BAD_TOPOLOGY, 0, 1, (double)wide[1], "points[1]");
  /* Counts. */
  desc = cloth_desc(&cloth);
  desc.masses.count--;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_deformable_create(f.world, &desc, &body));
  desc = cloth_desc(&cloth);
  desc.mesh.vertices.count = 0;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_deformable_create(f.world, &desc, &body));
  view.ptr = cloth.x;
  view.count--;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_body_push(f.world, f.cloth, SGN_SLOT_VELOCITY, &view, 0));
  pose_view.count = 2;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_body_push(f.world, f.ball, SGN_SLOT_POSE, &pose_view, 0));
  block_view.count--;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_system_push(f.world, f.system, &block_view));
  block_view.count++;
  /* Matrices that are not symmetric, or not positive. */
  blocks[5][1] = 0.001;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_system_push(f.world, f.system, &block_view));
  blocks[5][1] = 0, blocks[5][4] = 0;
  GIVES(SGN_ERROR_SINGULAR_SYSTEM, sgn_system_push(f.world, f.system, &block_view));
  error_is(&f, SGN_ERROR_SINGULAR_SYSTEM, f.system.value, 5, 0, "block row 5");
  /* Host-driven sizes that fit nowhere. */
  view = sgn_view(SGN_FORMAT_F64X3, cloth.x, (uint64_t)1 << 61);
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_body_push(f.world, f.cloth, SGN_SLOT_VELOCITY, &view, 0));
  view.count = VERTICES, view.byte_stride = 23;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_body_push(f.world, f.cloth, SGN_SLOT_VELOCITY, &view, 0));
  view.byte_stride = 0, view.reserved = 1;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_body_push(f.world, f.cloth, SGN_SLOT_VELOCITY, &view, 0));
  destroy(&f);
}

/* A message that does not fit is cut and said to be; a thread without failures has none. */
static void messages(void) {
  Fixture f = fixture();
  char text[10];
  SgnErrorInfo info;
  SgnBodyId body = {0};
  OK(sgn_error_info_init(&info, sizeof info));
  OK(sgn_context_last_error(f.context, &info));
  CHECK(info.code == SGN_OK && info.message_length == 0);
  GIVES(SGN_ERROR_INVALID_ID, sgn_body_destroy(f.world, body));
  OK(sgn_context_last_error(f.context, &info));
  CHECK(info.code == SGN_ERROR_INVALID_ID && info.message_length > 20);
  info.message = text;
  info.message_capacity = sizeof text;
  GIVES(SGN_NOTE_TRUNCATED, sgn_context_last_error(f.context, &info));
  CHECK(strcmp(text, "sgn_body_") == 0);
  for (SgnResult code = -40; code < 20; code++) {
    const char *name = NULL;
    SgnResult known = sgn_result_name(code, &name);
    CHECK((known == SGN_OK) == (code >= SGN_ERROR_PANIC && code <= SGN_NOTE_TRUNCATED));
    CHECK((name != NULL) == (known == SGN_OK));
  }
  destroy(&f);
}

int main(void) {
  null_pointers();
  wrong_ids();
  wrong_structs();
  wrong_values();
  wrong_arrays();
  messages();
  return finish();
}
