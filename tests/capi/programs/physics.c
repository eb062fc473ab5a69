/* Physics through the C ABI: rest on the ground, a rigid shape on cloth, impulses, certified floats, pushes between steps. */
#include "check.h"

static const double DT = 0.01, G = 9.81;

typedef struct Scene {
  SgnContext *context;
  SgnWorld *world;
  SgnBodyId cloth, ball, ground;
  Cloth host;
  SgnStepDesc step;
} Scene;

static void open_scene(Scene *scene, SgnPrecision precision, int with_ball) {
  SgnDeformableDesc cloth;
  SgnRigidDesc ball = octahedron_desc(0.05, 0.2);
  SgnHalfSpaceDesc ground;
  SgnMaterialDesc rough;
  SgnMaterialId material = {0};
  SgnShapeDesc shape;
  memset(scene, 0, sizeof *scene);
  make_cloth(&scene->host, 0.0625, 0.0625);
  OK(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &scene->context));
  OK(sgn_world_create(scene->context, NULL, &scene->world));
  OK(sgn_material_desc_init(&rough, sizeof rough));
  rough.friction = 0.6;
  OK(sgn_material_create(scene->world, &rough, &material));
  cloth = cloth_desc(&scene->host);
  cloth.precision = precision;
  cloth.options.material = material;
  OK(sgn_deformable_create(scene->world, &cloth, &scene->cloth));
  OK(sgn_half_space_desc_init(&ground, sizeof ground));
  ground.options.material = material;
  OK(sgn_half_space_create(scene->world, &ground, &scene->ground));
  if (with_ball) {
    OK(sgn_shape_desc_init(&shape, sizeof shape));
    shape.kind = SGN_SHAPE_BOX;
    shape.half_extents[0] = shape.half_extents[1] = 0.1, shape.half_extents[2] = 0.05;
    memset(&ball.mesh.vertices, 0, sizeof ball.mesh.vertices);
    memset(&ball.mesh.triangles, 0, sizeof ball.mesh.triangles);
    ball.shape = &shape;
    ball.precision = precision;
    ball.options.material = material;
    OK(sgn_rigid_create(scene->world, &ball, &scene->ball));
  }
  OK(sgn_step_desc_init(&scene->step, sizeof scene->step));
  scene->step.dt = DT;
  scene->step.flags = SGN_STEP_CERTIFY;
}

static void close_scene(Scene *scene) {
  OK(sgn_world_destroy(scene->world));
  OK(sgn_context_destroy(scene->context));
}

/* A cloth falls on the ground, a box on the cloth; at rest impulses carry the weight, and actions equal reactions. */
static void rest(void) {
  Scene s;
  double ball_v[3] = {0}, ball_w[3] = {0}, total = 0, weight = 0, j[VERTICES][3], box[3], box_angular[3], pose[7];
  SgnView push = sgn_view(SGN_FORMAT_F64X3, s.host.v, VERTICES), push_v = sgn_view(SGN_FORMAT_F64X3, ball_v, 1);
  SgnView push_w = sgn_view(SGN_FORMAT_F64X3, ball_w, 1);
  SgnViewMut pull = sgn_view_mut(SGN_FORMAT_F64X3, s.host.v, VERTICES), pull_v = sgn_view_mut(SGN_FORMAT_F64X3, ball_v, 1);
  SgnViewMut pull_w = sgn_view_mut(SGN_FORMAT_F64X3, ball_w, 1), impulses = sgn_view_mut(SGN_FORMAT_F64X3, j, VERTICES);
  SgnViewMut box_impulse = sgn_view_mut(SGN_FORMAT_F64X3, box, 1), pose_view = sgn_view_mut(SGN_FORMAT_F64X7, pose, 1);
  SgnViewMut box_torque = sgn_view_mut(SGN_FORMAT_F64X3, box_angular, 1);
  SgnStepReport report;
  uint64_t count = 0;
  open_scene(&s, SGN_PRECISION_F64, 1);
  OK(sgn_step_report_init(&report, sizeof report));
  for (int frame = 0; frame < 80; frame++) {
    for (int i = 0; i < VERTICES; i++) s.host.v[i][2] -= G * DT;
    ball_v[2] -= G * DT;
    OK(sgn_body_push(s.world, s.cloth, SGN_SLOT_VELOCITY, &push, 0));
    OK(sgn_body_push(s.world, s.ball, SGN_SLOT_VELOCITY, &push_v, 0));
    OK(sgn_body_push(s.world, s.ball, SGN_SLOT_ANGULAR_VELOCITY, &push_w, 0));
    CHECK(sgn_world_step(s.world, &s.step, &report) >= 0);
    CHECK(report.certified == 1 && report.intersections == 0);
    OK(sgn_body_pull(s.world, s.cloth, SGN_SLOT_END_VELOCITY, &pull));
    OK(sgn_body_pull(s.world, s.ball, SGN_SLOT_END_VELOCITY, &pull_v));
    OK(sgn_body_pull(s.world, s.ball, SGN_SLOT_END_ANGULAR_VELOCITY, &pull_w));
  }
  OK(sgn_body_pull(s.world, s.cloth, SGN_SLOT_IMPULSE, &impulses));
  OK(sgn_body_pull(s.world, s.ball, SGN_SLOT_IMPULSE, &box_impulse));
  OK(sgn_body_pull(s.world, s.ball, SGN_SLOT_ANGULAR_IMPULSE, &box_torque));
  OK(sgn_body_pull(s.world, s.ball, SGN_SLOT_POSE, &pose_view));
  for (int i = 0; i < VERTICES; i++) weight += s.host.mass[i] * G, total += j[i][2];
  /* The box presses the cloth with its weight, the ground carries both. */
  CHECK(fabs(box[2] - 0.05 * G * DT) < 0.01 * 0.05 * G * DT);
  CHECK(fabs(total - weight * DT) < 0.01 * weight * DT);
  CHECK(fabs(ball_v[2]) < 1e-3 && fabs(s.host.v[24][2]) < 1e-3);
  CHECK(fabs(box_angular[0]) < 1e-4 * DT);
  CHECK(fabs(pose[2] - (0.05 + 0.005 + 0.01)) < 0.006);
  /* The contacts say the same: summed impulses on the box, and none beyond the reported number. */
  CHECK(report.contacts > 40 && report.active_contacts <= report.contacts);
  OK(sgn_world_pull_contacts(s.world, SGN_CONTACT_IMPULSE, NULL, &count));
  CHECK(count == report.contacts);
  {
    uint64_t(*bodies)[2] = malloc(16 * count), *keys = malloc(8 * count), written = 0;
    double(*impulse)[3] = malloc(24 * count), (*normal)[3] = malloc(24 * count), *distance = malloc(8 * count);
    double on_box = 0;
    uint32_t *kind = malloc(4 * count), *state = malloc(4 * count);
    SgnViewMut v1 = sgn_view_mut(SGN_FORMAT_U64X2, bodies, count), v2 = sgn_view_mut(SGN_FORMAT_F64X3, impulse, count);
    SgnViewMut v3 = sgn_view_mut(SGN_FORMAT_U64, keys, count), v4 = sgn_view_mut(SGN_FORMAT_U32, kind, count);
    SgnViewMut v5 = sgn_view_mut(SGN_FORMAT_F64X3, normal, count), v6 = sgn_view_mut(SGN_FORMAT_F64, distance, count);
    SgnViewMut v7 = sgn_view_mut(SGN_FORMAT_U32, state, count);
    OK(sgn_world_pull_contacts(s.world, SGN_CONTACT_BODIES, &v1, &written));
    CHECK(written == count);
    OK(sgn_world_pull_contacts(s.world, SGN_CONTACT_IMPULSE, &v2, NULL));
    OK(sgn_world_pull_contacts(s.world, SGN_CONTACT_KEY, &v3, NULL));
    OK(sgn_world_pull_contacts(s.world, SGN_CONTACT_KIND, &v4, NULL));
    OK(sgn_world_pull_contacts(s.world, SGN_CONTACT_NORMAL, &v5, NULL));
    OK(sgn_world_pull_contacts(s.world, SGN_CONTACT_DISTANCE, &v6, NULL));
    OK(sgn_world_pull_contacts(s.world, SGN_CONTACT_STATE, &v7, NULL));
    for (uint64_t i = 0; i < count; i++) {
      if (bodies[i][0] == s.ball.value) on_box += impulse[i][2];
      if (bodies[i][1] == s.ball.value) on_box -= impulse[i][2];
      CHECK(kind[i] <= 2 && state[i] <= 2 && distance[i] >= 0);
      CHECK(fabs(normal[i][0] * normal[i][0] + normal[i][1] * normal[i][1] + normal[i][2] * normal[i][2] - 1) < 1e-9);
      CHECK(kind[i] != 2 || (bodies[i][1] == s.ground.value && bodies[i][0] != s.ground.value));
      for (uint64_t k = 0; k < i; k++) CHECK(keys[i] != keys[k]);
    }
    CHECK(fabs(on_box - box[2]) < 1e-9 * box[2]);
    /* A view that is too small gets the first ones. */
    memset(keys, 0, 8 * count);
    v3.count = 3;
    GIVES(SGN_NOTE_TRUNCATED, sgn_world_pull_contacts(s.world, SGN_CONTACT_KEY, &v3, &written));
    CHECK(written == count && keys[2] != 0 && keys[3] == 0);
    free(bodies), free(keys), free(impulse), free(normal), free(distance), free(kind), free(state);
  }
  close_scene(&s);
}

/* A float host gets the certified numbers: a second world that starts from the pulled floats stands exactly there. */
static void floats_are_certified(void) {
  Scene s;
  float x[VERTICES][3], v[VERTICES][3] = {{0}}, pose[7];
  double wide[VERTICES][3], wide_pose[7];
  SgnView push = sgn_view(SGN_FORMAT_F32X3, v, VERTICES), back = sgn_view(SGN_FORMAT_F32X3, x, VERTICES);
  SgnView pose_back = sgn_view(SGN_FORMAT_F32X7, pose, 1);
  SgnViewMut pull = sgn_view_mut(SGN_FORMAT_F32X3, x, VERTICES), pull_wide = sgn_view_mut(SGN_FORMAT_F64X3, wide, VERTICES);
  SgnViewMut pull_v = sgn_view_mut(SGN_FORMAT_F32X3, v, VERTICES), pull_pose = sgn_view_mut(SGN_FORMAT_F32X7, pose, 1);
  SgnViewMut pull_pose_wide = sgn_view_mut(SGN_FORMAT_F64X7, wide_pose, 1);
  uint64_t hash;
  open_scene(&s, SGN_PRECISION_F32, 1);
  for (int frame = 0; frame < 30; frame++) {
    SgnStepReport report;
    double fall[3] = {0.3, 0.1, -1.0};
    SgnView push_fall = sgn_view(SGN_FORMAT_F64X3, fall, 1);
    for (int i = 0; i < VERTICES; i++) v[i][2] -= (float)(G * DT);
    OK(sgn_body_push(s.world, s.cloth, SGN_SLOT_VELOCITY, &push, 0));
    OK(sgn_body_push(s.world, s.ball, SGN_SLOT_VELOCITY, &push_fall, 0));
    OK(sgn_step_report_init(&report, sizeof report));
    CHECK(sgn_world_step(s.world, &s.step, &report) >= 0);
    CHECK(report.intersections == 0);
    OK(sgn_body_pull(s.world, s.cloth, SGN_SLOT_END_VELOCITY, &pull_v));
    OK(sgn_body_pull(s.world, s.cloth, SGN_SLOT_POSITION, &pull));
    OK(sgn_body_pull(s.world, s.cloth, SGN_SLOT_POSITION, &pull_wide));
    OK(sgn_body_pull(s.world, s.ball, SGN_SLOT_POSE, &pull_pose));
    OK(sgn_body_pull(s.world, s.ball, SGN_SLOT_POSE, &pull_pose_wide));
    for (int i = 0; i < VERTICES; i++) {
      for (int k = 0; k < 3; k++) CHECK((double)x[i][k] == wide[i][k]);
    }
    for (int k = 0; k < 7; k++) CHECK((double)pose[k] == wide_pose[k]);
    /* Written back, they are the state that the library has: nothing moves, nothing is swept. */
    hash = state_hash(s.world);
    OK(sgn_body_push(s.world, s.cloth, SGN_SLOT_POSITION, &back, 0));
    OK(sgn_body_push(s.world, s.ball, SGN_SLOT_POSE, &pose_back, 0));
    CHECK(state_hash(s.world) == hash);
  }
  close_scene(&s);
}

/* A start that was pushed through something is refused unless it is a teleport; an intersecting one always is. */
static void pushes_between_steps(void) {
  Scene s;
  double pose[7] = {0, 0, 0.6, 0, 0, 0, 1}, x[VERTICES][3];
  SgnView push = sgn_view(SGN_FORMAT_F64X7, pose, 1), positions = sgn_view(SGN_FORMAT_F64X3, x, VERTICES);
  SgnCheckReport check;
  uint64_t hash, count = 0, bodies[2];
  SgnViewMut witness = sgn_view_mut(SGN_FORMAT_U64X2, bodies, 1);
  open_scene(&s, SGN_PRECISION_F64, 1);
  OK(sgn_check_report_init(&check, sizeof check));
  OK(sgn_body_push(s.world, s.ball, SGN_SLOT_POSE, &push, 0)); /* before the first step anything goes */
  CHECK(sgn_world_step(s.world, &s.step, NULL) >= 0);
  memcpy(x, s.host.x, sizeof x);
  for (int i = 0; i < VERTICES; i++) x[i][2] = 1.0; /* the cloth from below the box to above it */
  OK(sgn_body_push(s.world, s.cloth, SGN_SLOT_POSITION, &positions, 0));
  hash = state_hash(s.world);
  GIVES(SGN_ERROR_INTERSECTING_START, sgn_world_step(s.world, &s.step, NULL));
  CHECK(state_hash(s.world) == hash);
  OK(sgn_world_pull_witnesses(s.world, SGN_WITNESS_KIND, NULL, &count));
  CHECK(count > 0);
  OK(sgn_body_push(s.world, s.cloth, SGN_SLOT_POSITION, &positions, SGN_PUSH_TELEPORT));
  CHECK(sgn_world_step(s.world, &s.step, NULL) >= 0);
  /* A small move is no jump. */
  for (int i = 0; i < VERTICES; i++) x[i][2] = 0.99;
  OK(sgn_body_push(s.world, s.cloth, SGN_SLOT_POSITION, &positions, 0));
  CHECK(sgn_world_step(s.world, &s.step, NULL) >= 0);
  OK(sgn_world_check(s.world, &check));
  CHECK(check.intersections == 0);
  /* Into the box: refused with witnesses, and the check says the same. */
  for (int i = 0; i < VERTICES; i++) x[i][2] = 0.61;
  OK(sgn_body_push(s.world, s.cloth, SGN_SLOT_POSITION, &positions, SGN_PUSH_TELEPORT));
  hash = state_hash(s.world);
  GIVES(SGN_ERROR_INTERSECTING_START, sgn_world_step(s.world, &s.step, NULL));
  OK(sgn_world_pull_witnesses(s.world, SGN_WITNESS_BODIES, NULL, &count));
  CHECK(count > 0);
  OK(sgn_world_check(s.world, &check));
  CHECK(check.intersections == count);
  CHECK(sgn_world_pull_witnesses(s.world, SGN_WITNESS_BODIES, &witness, NULL) >= 0);
  CHECK((bodies[0] == s.cloth.value && bodies[1] == s.ball.value) || (bodies[1] == s.cloth.value && bodies[0] == s.ball.value));
  CHECK(state_hash(s.world) == hash);
  s.step.policy = SGN_POLICY_PASS;
  GIVES(SGN_NOTE_TANGLED_PAIRS, sgn_world_step(s.world, &s.step, NULL));
  close_scene(&s);
}

/* Kinematic jaws close on a cloth until no room is left, and open again. */
static void pinched(void) {
  Scene s;
  SgnKinematicDesc jaw;
  SgnShapeDesc shape;
  SgnBodyId jaws[2] = {{0}, {0}};
  SgnStepReport report;
  double pose[2][7], x[VERTICES][3];
  int refused = 0;
  SgnViewMut positions = sgn_view_mut(SGN_FORMAT_F64X3, x, VERTICES);
  open_scene(&s, SGN_PRECISION_F64, 0);
  OK(sgn_body_destroy(s.world, s.ground));
  OK(sgn_shape_desc_init(&shape, sizeof shape));
  shape.kind = SGN_SHAPE_BOX;
  shape.half_extents[0] = shape.half_extents[1] = 0.4, shape.half_extents[2] = 0.05;
  OK(sgn_kinematic_desc_init(&jaw, sizeof jaw));
  jaw.shape = &shape;
  jaw.options.half_thickness = 0.005;
  for (int i = 0; i < 2; i++) {
    jaw.position[2] = 0.0625 + (i ? 0.12 : -0.12);
    OK(sgn_kinematic_create(s.world, &jaw, &jaws[i]));
    memset(pose[i], 0, sizeof pose[i]);
    pose[i][6] = 1;
  }
  OK(sgn_step_report_init(&report, sizeof report));
  for (int frame = 0; frame < 40; frame++) {
    SgnResult result;
    int closing = frame < 20;
    for (int i = 0; i < 2; i++) {
      SgnView target = sgn_view(SGN_FORMAT_F64X7, pose[i], 1);
      SgnViewMut now = sgn_view_mut(SGN_FORMAT_F64X7, pose[i], 1);
      OK(sgn_body_pull(s.world, jaws[i], SGN_SLOT_POSE, &now));
      pose[i][2] += (i ? -1 : 1) * (closing ? 0.01 : -0.01);
      OK(sgn_body_push(s.world, jaws[i], SGN_SLOT_TARGET_POSE, &target, 0));
    }
    result = sgn_world_step(s.world, &s.step, &report);
    if (result == SGN_ERROR_PINCHED) {
      uint64_t count = 0;
      refused++;
      CHECK(closing);
      CHECK(report.certified_fraction >= 0 && report.certified_fraction < 1);
      OK(sgn_world_pull_witnesses(s.world, SGN_WITNESS_POINT, NULL, &count));
      CHECK(count > 0);
    } else {
      CHECK(result >= 0);
    }
    OK(sgn_body_pull(s.world, s.cloth, SGN_SLOT_POSITION, &positions));
    for (int i = 0; i < 2; i++) {
      SgnViewMut now = sgn_view_mut(SGN_FORMAT_F64X7, pose[i], 1);
      OK(sgn_body_pull(s.world, jaws[i], SGN_SLOT_POSE, &now));
      for (int k = 0; k < VERTICES; k++) CHECK((i ? 1 : -1) * (pose[i][2] - x[k][2]) > 0.05);
    }
  }
  CHECK(refused > 0);
  CHECK(pose[1][2] - pose[0][2] > 0.25); /* open again */
  close_scene(&s);
}

/* The velocity filter: a falling cloth leaves the ground with the restitution's share of its speed, and comes to rest
 * without any. */
static void filtered(double restitution) {
  Scene s;
  double x[VERTICES][3], lowest = 1, fastest = 0, share;
  SgnView push = sgn_view(SGN_FORMAT_F64X3, s.host.v, VERTICES);
  SgnViewMut pull = sgn_view_mut(SGN_FORMAT_F64X3, s.host.v, VERTICES), positions = sgn_view_mut(SGN_FORMAT_F64X3, x, VERTICES);
  SgnStepReport report;
  open_scene(&s, SGN_PRECISION_F64, 0);
  s.step.method = SGN_METHOD_VELOCITY_FILTER;
  s.step.restitution = restitution;
  OK(sgn_step_report_init(&report, sizeof report));
  for (int i = 0; i < VERTICES; i++) s.host.v[i][2] = -8;
  OK(sgn_body_push(s.world, s.cloth, SGN_SLOT_VELOCITY, &push, 0));
  CHECK(sgn_world_step(s.world, &s.step, &report) == SGN_OK);
  CHECK(report.rounds == 2 && report.iterations == VERTICES && report.certified == 1 && report.intersections == 0);
  OK(sgn_body_pull(s.world, s.cloth, SGN_SLOT_END_VELOCITY, &pull));
  for (int i = 0; i < VERTICES; i++) {
    share = s.host.v[i][2] / 8;
    CHECK(fabs(share - restitution) < 1e-12);
  }
  s.step.restitution = 0;
  for (int frame = 0; frame < 200; frame++) {
    for (int i = 0; i < VERTICES; i++) s.host.v[i][2] -= G * DT;
    OK(sgn_body_push(s.world, s.cloth, SGN_SLOT_VELOCITY, &push, 0));
    CHECK(sgn_world_step(s.world, &s.step, &report) == SGN_OK);
    OK(sgn_body_pull(s.world, s.cloth, SGN_SLOT_END_VELOCITY, &pull));
  }
  OK(sgn_body_pull(s.world, s.cloth, SGN_SLOT_POSITION, &positions));
  for (int i = 0; i < VERTICES; i++) {
    lowest = x[i][2] < lowest ? x[i][2] : lowest;
    fastest = fabs(s.host.v[i][2]) > fastest ? fabs(s.host.v[i][2]) : fastest;
  }
  CHECK(lowest > 0 && lowest < 0.01 && fastest < 0.2);
  close_scene(&s);
}

/* Warm starts and results survive a rebuild: a body far away comes and goes, the others do not notice. */
static void rebuilds_change_nothing(void) {
  uint64_t hashes[2];
  for (int pass = 0; pass < 2; pass++) {
    Scene s;
    SgnView push = sgn_view(SGN_FORMAT_F64X3, s.host.v, VERTICES);
    double x[VERTICES][3];
    SgnViewMut pull = sgn_view_mut(SGN_FORMAT_F64X3, s.host.v, VERTICES), positions = sgn_view_mut(SGN_FORMAT_F64X3, x, VERTICES);
    SgnRigidDesc far_away = octahedron_desc(1, 50);
    SgnBodyId visitor = {0};
    open_scene(&s, SGN_PRECISION_F64, 0);
    hashes[pass] = 0;
    for (int frame = 0; frame < 30; frame++) {
      for (int i = 0; i < VERTICES; i++) s.host.v[i][2] -= G * DT;
      if (pass && frame % 4 == 1) OK(sgn_rigid_create(s.world, &far_away, &visitor));
      if (pass && frame % 4 == 3) OK(sgn_body_destroy(s.world, visitor));
      OK(sgn_body_push(s.world, s.cloth, SGN_SLOT_VELOCITY, &push, 0));
      CHECK(sgn_world_step(s.world, &s.step, NULL) >= 0);
      OK(sgn_body_pull(s.world, s.cloth, SGN_SLOT_END_VELOCITY, &pull));
      OK(sgn_body_pull(s.world, s.cloth, SGN_SLOT_POSITION, &positions));
      for (int i = 0; i < VERTICES; i++) {
        for (int k = 0; k < 3; k++) {
          uint64_t bits;
          memcpy(&bits, &x[i][k], 8);
          hashes[pass] = (hashes[pass] ^ bits) * 1099511628211u;
        }
      }
    }
    close_scene(&s);
  }
  CHECK(hashes[0] == hashes[1]);
}

/* Height at which a body comes to rest on the ground, all masses times `size`. */
static double rest_height(double size) {
  SgnContext *context;
  SgnWorld *world;
  SgnBodyId ball, ground;
  SgnRigidDesc desc = octahedron_desc(size, 0.15);
  SgnHalfSpaceDesc plane;
  SgnStepDesc step;
  double v[3] = {0}, pose[7] = {0};
  SgnView push = sgn_view(SGN_FORMAT_F64X3, v, 1);
  SgnViewMut pull = sgn_view_mut(SGN_FORMAT_F64X3, v, 1), pull_pose = sgn_view_mut(SGN_FORMAT_F64X7, pose, 1);
  OK(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &context));
  OK(sgn_world_create(context, NULL, &world));
  OK(sgn_half_space_desc_init(&plane, sizeof plane));
  OK(sgn_half_space_create(world, &plane, &ground));
  OK(sgn_rigid_create(world, &desc, &ball));
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = DT;
  for (int i = 0; i < 30; i++) {
    v[2] -= DT * G;
    OK(sgn_body_push(world, ball, SGN_SLOT_VELOCITY, &push, 0));
    CHECK(sgn_world_step(world, &step, NULL) >= 0);
    OK(sgn_body_pull(world, ball, SGN_SLOT_END_VELOCITY, &pull));
  }
  OK(sgn_body_pull(world, ball, SGN_SLOT_POSE, &pull_pose));
  OK(sgn_world_destroy(world));
  OK(sgn_context_destroy(context));
  return pose[2];
}

/* A body falls alike whatever its mass and inertia, also where products of them are no doubles any more. */
static void masses_of_any_size(void) {
  static const double sizes[] = {1e-290, 1e-200, 1e-120, 1e120, 1e200, 1e290};
  double height = rest_height(1.0);
  CHECK(height > 0.1 && height < 0.11);
  for (int i = 0; i < 6; i++) CHECK(fabs(rest_height(sizes[i]) - height) < 1e-4);
}

int main(void) {
  rest();
  masses_of_any_size();
  floats_are_certified();
  pushes_between_steps();
  pinched();
  filtered(0);
  filtered(0.75);
  rebuilds_change_nothing();
  return finish();
}
