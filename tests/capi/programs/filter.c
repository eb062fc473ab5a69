/* The stand-alone filter: a cloth is sent through an octahedron; modes, layouts, misuse, witnesses. */
#include "check.h"

enum { ALL = VERTICES + 6, FACES = TRIANGLES + 8 };

static Cloth cloth;
static double x0[ALL][3], x1[ALL][3], end[ALL][3], velocity[ALL][3], masses[ALL];
static uint32_t triangles[FACES][3], groups[ALL];
static float narrow[ALL][5];

static void make(void) {
  static const uint32_t eight[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  static const double six[6][3] = {{0.1, 0, 0}, {-0.1, 0, 0}, {0, 0.1, 0}, {0, -0.1, 0}, {0, 0, 0.1}, {0, 0, -0.1}};
  make_cloth(&cloth, 0.05, 0.13);
  for (int i = 0; i < VERTICES; i++) {
    memcpy(x0[i], cloth.x[i], sizeof x0[i]);
    memcpy(x1[i], cloth.x[i], sizeof x1[i]);
    x1[i][2] -= 0.15;
    masses[i] = cloth.mass[i];
  }
  for (int i = 0; i < 6; i++) {
    memcpy(x0[VERTICES + i], six[i], sizeof six[i]);
    memcpy(x1[VERTICES + i], six[i], sizeof six[i]);
    groups[VERTICES + i] = 9;
    masses[VERTICES + i] = i % 2 ? 0 : HUGE_VAL;
  }
  memcpy(triangles, cloth.triangles, sizeof cloth.triangles);
  for (int i = 0; i < 8; i++)
    for (int k = 0; k < 3; k++) triangles[TRIANGLES + i][k] = VERTICES + eight[i][k];
}

static SgnFilterDesc description(void) {
  SgnFilterDesc desc;
  OK(sgn_filter_desc_init(&desc, sizeof desc));
  desc.half_thickness = 1e-3;
  desc.friction = 0.3;
  desc.mesh.vertices = sgn_view(SGN_FORMAT_F64X3, x0, ALL);
  desc.mesh.triangles = sgn_view(SGN_FORMAT_U32X3, triangles, FACES);
  desc.masses = sgn_view(SGN_FORMAT_F64, masses, ALL);
  desc.groups = sgn_view(SGN_FORMAT_U32, groups, ALL);
  return desc;
}

static SgnStepDesc step_desc(void) {
  SgnStepDesc step;
  OK(sgn_step_desc_init(&step, sizeof step));
  step.dt = 0.02;
  step.flags = SGN_STEP_CERTIFY;
  return step;
}

static void motions(SgnFilter *filter) {
  SgnView from = sgn_view(SGN_FORMAT_F64X3, x0, ALL), to = sgn_view(SGN_FORMAT_F64X3, x1, ALL);
  SgnViewMut out = sgn_view_mut(SGN_FORMAT_F64X3, end, ALL), v = sgn_view_mut(SGN_FORMAT_F64X3, velocity, ALL);
  SgnStepDesc step = step_desc();
  SgnStepReport report;
  OK(sgn_step_report_init(&report, sizeof report));
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_filter_run(filter, SGN_FILTER_POSITION, NULL, &to, &step, &out, &v, &report));
  CHECK(sgn_filter_run(filter, SGN_FILTER_MOTION, &from, &to, &step, &out, &v, &report) >= 0);
  CHECK(report.certified == 1 && report.intersections == 0 && report.active_contacts > 0);
  CHECK(end[VERTICES / 2][2] > 0.1);              /* the middle rests on the tip */
  CHECK(fabs(end[0][2] - x1[0][2]) < 1e-12);      /* a corner arrives */
  for (int i = 0; i < ALL; i++)
    for (int k = 0; k < 3; k++) CHECK(fabs(velocity[i][k] - (end[i][k] - x0[i][k]) / step.dt) < 1e-9);
  for (int i = VERTICES; i < ALL; i++) CHECK(memcmp(end[i], x1[i], sizeof end[i]) == 0);
  /* Up again: the displacement mode keeps what contact changed, the position mode does not. */
  CHECK(sgn_filter_run(filter, SGN_FILTER_DISPLACEMENT, &to, &from, &step, &out, NULL, NULL) >= 0);
  CHECK(end[VERTICES / 2][2] > x0[VERTICES / 2][2] + 0.05);
  CHECK(sgn_filter_run(filter, SGN_FILTER_POSITION, NULL, &from, &step, &out, NULL, NULL) >= 0);
  CHECK(fabs(end[VERTICES / 2][2] - x0[VERTICES / 2][2]) < 1e-12);
  OK(sgn_filter_restart(filter));
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_filter_run(filter, SGN_FILTER_POSITION, NULL, &to, &step, &out, NULL, NULL));
}

static void layouts(SgnContext *context) {
  SgnFilter *filter = NULL;
  SgnFilterDesc desc = description();
  SgnStepDesc step = step_desc();
  SgnView from = sgn_view(SGN_FORMAT_F64X3, x0, ALL), to = sgn_view(SGN_FORMAT_F64X3, x1, ALL);
  SgnViewMut out = sgn_view_mut(SGN_FORMAT_F32X3, narrow, ALL);
  out.byte_offset = sizeof(float);
  out.byte_stride = sizeof narrow[0];
  OK(sgn_filter_create(context, &desc, &filter));
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_filter_run(filter, SGN_FILTER_MOTION, &from, &to, &step, &out, NULL, NULL));
  OK(sgn_filter_destroy(filter));
  desc.precision = SGN_PRECISION_F32;
  OK(sgn_filter_create(context, &desc, &filter));
  for (int i = 0; i < ALL; i++) narrow[i][0] = narrow[i][4] = 7;
  CHECK(sgn_filter_run(filter, SGN_FILTER_MOTION, &from, &to, &step, &out, NULL, NULL) >= 0);
  CHECK(narrow[VERTICES / 2][3] > 0.1f && narrow[3][0] == 7 && narrow[3][4] == 7);
  out.count = ALL - 1;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_filter_run(filter, SGN_FILTER_MOTION, &from, &to, &step, &out, NULL, NULL));
  OK(sgn_filter_destroy(filter));
}

static void refusals(SgnContext *context, SgnFilter *filter) {
  SgnFilter *none = NULL;
  SgnFilterDesc desc = description(), bad;
  SgnStepDesc step = step_desc();
  SgnStepReport report;
  SgnView from = sgn_view(SGN_FORMAT_F64X3, x0, ALL), to = sgn_view(SGN_FORMAT_F64X3, x1, ALL);
  SgnViewMut out = sgn_view_mut(SGN_FORMAT_F64X3, end, ALL);
  double middle[ALL][3];
  uint64_t bodies[512][2], count = 0;
  uint32_t first[512][3], second[512][3];
  SgnView at;
  SgnViewMut body_view = sgn_view_mut(SGN_FORMAT_U64X2, bodies, 512);
  SgnViewMut first_view = sgn_view_mut(SGN_FORMAT_U32X3, first, 512), second_view = sgn_view_mut(SGN_FORMAT_U32X3, second, 512);
  OK(sgn_step_report_init(&report, sizeof report));
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_filter_desc_init(NULL, sizeof desc));
  GIVES(SGN_ERROR_BAD_STRUCT, sgn_filter_desc_init(&bad, 8));
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_filter_create(NULL, &desc, &none));
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_filter_create(context, NULL, &none));
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_filter_create(context, &desc, NULL));
  OK(sgn_filter_destroy(NULL));
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_filter_restart(NULL));
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_filter_pull_witnesses(NULL, SGN_WITNESS_KIND, NULL, &count));
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_filter_run(NULL, 0, &from, &to, &step, &out, NULL, NULL));
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_filter_run(filter, 0, NULL, &to, &step, &out, NULL, NULL));
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_filter_run(filter, 0, &from, NULL, &step, &out, NULL, NULL));
  GIVES(SGN_ERROR_NULL_ARGUMENT, sgn_filter_run(filter, 0, &from, &to, NULL, &out, NULL, NULL));
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_filter_run(filter, 3, &from, &to, &step, &out, NULL, NULL));
  step.dt = 0;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_filter_run(filter, 0, &from, &to, &step, &out, NULL, NULL));
  step.dt = 0.02;
  to.count = ALL - 1;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_filter_run(filter, 0, &from, &to, &step, &out, NULL, NULL));
  to.count = ALL;
  bad = desc, bad.flags = 2;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_filter_create(context, &bad, &none));
  bad = desc, bad.precision = 7;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_filter_create(context, &bad, &none));
  bad = desc, bad.friction = -1;
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_filter_create(context, &bad, &none));
  bad = desc, bad.masses.count = 3;
  GIVES(SGN_ERROR_BUFFER_LAYOUT, sgn_filter_create(context, &bad, &none));
  groups[0] = 4;
  GIVES(SGN_ERROR_BAD_TOPOLOGY, sgn_filter_create(context, &desc, &none));
  groups[0] = 0;
  masses[1] = NAN;
  GIVES(SGN_ERROR_NON_FINITE_INPUT, sgn_filter_create(context, &desc, &none));
  masses[1] = cloth.mass[1];
  CHECK(none == NULL);
  /* A start in the middle of the octahedron. */
  memcpy(middle, x0, sizeof middle);
  for (int i = 0; i < VERTICES; i++) middle[i][2] = 0.02;
  at = sgn_view(SGN_FORMAT_F64X3, middle, ALL);
  memset(end, 0, sizeof end);
  GIVES(SGN_ERROR_INTERSECTING_START, sgn_filter_run(filter, SGN_FILTER_MOTION, &at, &to, &step, &out, NULL, &report));
  CHECK(end[0][0] == 0);
  OK(sgn_filter_pull_witnesses(filter, SGN_WITNESS_BODIES, NULL, &count));
  CHECK(count > 0 && count <= 512);
  OK(sgn_filter_pull_witnesses(filter, SGN_WITNESS_BODIES, &body_view, &count));
  OK(sgn_filter_pull_witnesses(filter, SGN_WITNESS_FIRST_VERTICES, &first_view, NULL));
  OK(sgn_filter_pull_witnesses(filter, SGN_WITNESS_SECOND_VERTICES, &second_view, NULL));
  for (uint64_t i = 0; i < count && i < 512; i++) {
    CHECK(bodies[i][0] + bodies[i][1] == 9);
    for (int k = 0; k < 3; k++) CHECK(groups[first[i][k]] == bodies[i][0] && groups[second[i][k]] == bodies[i][1]);
  }
  GIVES(SGN_ERROR_INVALID_ARGUMENT, sgn_filter_pull_witnesses(filter, 7, NULL, &count));
}

int main(void) {
  SgnContext *context = NULL;
  SgnFilter *filter = NULL;
  SgnFilterDesc desc;
  make();
  desc = description();
  OK(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &context));
  OK(sgn_filter_create(context, &desc, &filter));
  motions(filter);
  layouts(context);
  refusals(context, filter);
  OK(sgn_context_destroy(context)); /* the filter keeps what it needs of it */
  OK(sgn_filter_restart(filter));
  OK(sgn_filter_destroy(filter));
  return finish();
}
