/* Bodies that the library drives, through the C ABI: what is refused, what is pulled, that a step does what it says. */
#include "check.h"

static double nodes[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
static const uint32_t tetrahedra[2][4] = {{0, 1, 2, 3}, {1, 2, 3, 4}};
static const uint64_t wide[2][4] = {{0, 1, 2, 3}, {1, 2, 3, 4}};
static double points[4][3] = {{0.1, 0.1, 0.1}, {0.5, 0.2, 0.2}, {0.2, 0.5, 0.2}, {0.2, 0.2, 0.5}};
static const uint32_t faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

static SgnSolidDesc solid(void) {
  SgnSolidDesc desc;
  OK(sgn_solid_desc_init(&desc, sizeof desc));
  desc.nodes = sgn_view(SGN_FORMAT_F64X3, nodes, 5);
  desc.tetrahedra = sgn_view(SGN_FORMAT_U32X4, tetrahedra, 2);
  return desc;
}

static SgnErrorInfo last(SgnContext *context) {
  SgnErrorInfo info;
  OK(sgn_error_info_init(&info, sizeof info));
  OK(sgn_context_last_error(context, &info));
  return info;
}

static void refusals(SgnContext *context, SgnWorld *world) {
  SgnSolidDesc desc = solid();
  SgnSheetDesc sheet;
  SgnBodyId id = {0};
  const double nan3[3] = {0, NAN, 0};
  const uint32_t ends[1][2] = {{0, 7}};
  const double stiff[2] = {1, 1};
  uint64_t before, after;
  OK(sgn_world_state_hash(world, &before));
  desc.young_modulus = -5;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_solid_create(world, &desc, &id));
  CHECK(last(context).value == -5);
  desc = solid();
  desc.poisson_ratio = 0.5;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_solid_create(world, &desc, &id));
  desc = solid();
  desc.density = NAN;
  GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_solid_create(world, &desc, &id));
  desc = solid();
  desc.tetrahedra.format = SGN_FORMAT_U32X3;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_solid_create(world, &desc, &id));
  desc = solid();
  desc.nodes.count = 4;
  GIVES(SGN_ERROR_BAD_TOPOLOGY, sgn_solid_create(world, &desc, &id));
  CHECK(last(context).index == 1 && last(context).value == 4);
  desc = solid();
  desc.options.flags = SGN_BODY_POSED;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_solid_create(world, &desc, &id));
  desc = solid();
  desc.forces.springs = sgn_view(SGN_FORMAT_U32X2, ends, 1);
  desc.forces.spring_stiffness = sgn_view(SGN_FORMAT_F64, stiff, 2);
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_solid_create(world, &desc, &id));
  desc.forces.spring_stiffness.count = 1;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_solid_create(world, &desc, &id));
  CHECK(last(context).value == 7);
  desc.options.flags = SGN_BODY_HOST_DRIVEN;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_solid_create(world, &desc, &id));
  OK(sgn_sheet_desc_init(&sheet, sizeof sheet));
  sheet.mesh.vertices = sgn_view(SGN_FORMAT_F64X3, points, 4);
  GIVES(SGN_ERROR_BAD_TOPOLOGY, sgn_sheet_create(world, &sheet, &id));
  sheet.mesh.triangles = sgn_view(SGN_FORMAT_U32X3, faces, 4);
  sheet.model = 2;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_sheet_create(world, &sheet, &id));
  GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_world_set_gravity(world, nan3));
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_world_set_wind(world, NULL));
  CHECK(id.value == 0);
  OK(sgn_world_state_hash(world, &after));
  CHECK(before == after);
}

static void falling(SgnWorld *world) {
  const double gravity[3] = {0, 0, -10};
  const uint32_t held[1] = {0};
  const double stiff[1] = {100}, target[1][3] = {{0, 0, 0}};
  double x[5][3], carried[4][3], rest[4][3];
  SgnSolidDesc desc = solid();
  SgnBodyId free_body, tied;
  SgnBodyInfo info;
  SgnStepDesc step;
  SgnViewMut out;
  SgnView in;
  OK(sgn_world_set_gravity(world, gravity));
  desc.surface.vertices = sgn_view(SGN_FORMAT_F64X3, points, 4);
  desc.surface.triangles = sgn_view(SGN_FORMAT_U32X3, faces, 4);
  desc.tetrahedra = sgn_view(SGN_FORMAT_U64X4, wide, 2);
  desc.options.mask = 0;
  OK(sgn_solid_create(world, &desc, &free_body));
  desc.forces.attachments = sgn_view(SGN_FORMAT_U32, held, 1);
  desc.forces.attachment_stiffness = sgn_view(SGN_FORMAT_F64, stiff, 1);
  OK(sgn_solid_create(world, &desc, &tied));
  OK(sgn_body_info_init(&info, sizeof info));
  OK(sgn_body_info(world, free_body, &info));
  CHECK(info.kind == SGN_BODY_KIND_DEFORMABLE && info.vertices == 4 && info.velocities == 5 && info.triangles == 4);
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  for (int n = 0; n < 10; n++) GIVES(SGN_OK, sgn_world_step(world, &step, NULL));
  out = sgn_view_mut(SGN_FORMAT_F64X3, x, 5);
  OK(sgn_body_pull(world, free_body, SGN_SLOT_NODE_POSITION, &out));
  out = sgn_view_mut(SGN_FORMAT_F64X3, carried, 4);
  OK(sgn_body_pull(world, free_body, SGN_SLOT_POSITION, &out));
  out = sgn_view_mut(SGN_FORMAT_F64X3, rest, 4);
  OK(sgn_body_pull(world, free_body, SGN_SLOT_REST_POSITION, &out));
  /* Backward Euler: g dt^2 n (n + 1) / 2. */
  for (int i = 0; i < 5; i++) CHECK(fabs(x[i][2] - nodes[i][2] + 10 * 1e-4 * 55) < 1e-9);
  for (int i = 0; i < 4; i++) {
    CHECK(fabs(carried[i][2] - points[i][2] + 10 * 1e-4 * 55) < 1e-9);
    CHECK(rest[i][0] == points[i][0] && rest[i][2] == points[i][2]);
  }
  in = sgn_view(SGN_FORMAT_F64X3, carried, 4);
  GIVES(SGN_ERROR_UNSUPPORTED, sgn_body_push(world, free_body, SGN_SLOT_POSITION, &in, 0));
  in = sgn_view(SGN_FORMAT_F64X3, nodes, 5);
  OK(sgn_body_push(world, free_body, SGN_SLOT_NODE_POSITION, &in, SGN_PUSH_TELEPORT));
  out = sgn_view_mut(SGN_FORMAT_F64X3, carried, 4);
  OK(sgn_body_pull(world, free_body, SGN_SLOT_POSITION, &out));
  for (int i = 0; i < 4; i++) CHECK(fabs(carried[i][1] - points[i][1]) < 1e-15);
  in = sgn_view(SGN_FORMAT_F64X3, target, 1);
  GIVES(SGN_ERROR_UNSUPPORTED, sgn_body_push(world, free_body, SGN_SLOT_ATTACHMENT_TARGET, &in, 0));
  OK(sgn_body_push(world, tied, SGN_SLOT_ATTACHMENT_TARGET, &in, 0));
  out = sgn_view_mut(SGN_FORMAT_F64X3, x, 5);
  GIVES(SGN_ERROR_UNSUPPORTED, sgn_body_pull(world, tied, SGN_SLOT_ATTACHMENT_TARGET, &out));
}

static void spinning(SgnWorld *world) {
  SgnRigidDesc desc = octahedron_desc(2, 0);
  SgnBodyId id;
  SgnStepDesc step;
  double pose[7], w[3];
  SgnViewMut out = sgn_view_mut(SGN_FORMAT_F64X7, pose, 1);
  desc.options.flags = SGN_BODY_MODEL_DRIVEN;
  desc.options.mask = 0;
  desc.linear_damping = -1;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_rigid_create(world, &desc, &id));
  desc.linear_damping = 0;
  desc.velocity[0] = 1;
  desc.angular_velocity[2] = 1;
  OK(sgn_rigid_create(world, &desc, &id));
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.01;
  for (int n = 0; n < 10; n++) GIVES(SGN_OK, sgn_world_step(world, &step, NULL));
  OK(sgn_body_pull(world, id, SGN_SLOT_POSE, &out));
  CHECK(fabs(pose[0] - 0.1) < 1e-12 && fabs(pose[2] + 10 * 1e-4 * 55) < 1e-12);
  CHECK(fabs(pose[5] - sin(0.05)) < 1e-12);
  out = sgn_view_mut(SGN_FORMAT_F64X3, w, 1);
  OK(sgn_body_pull(world, id, SGN_SLOT_END_ANGULAR_VELOCITY, &out));
  CHECK(fabs(w[2] - 1) < 1e-12);
}

int main(void) {
  SgnContext *context;
  SgnWorld *world;
  OK(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &context));
  OK(sgn_world_create(context, NULL, &world));
  refusals(context, world);
  falling(world);
  spinning(world);
  OK(sgn_world_destroy(world));
  OK(sgn_context_destroy(context));
  return finish();
}
