/* The velocity filter alone: a recorded cloth falls through a scripted roof; its filtered copy does not. */
#include "signorini.h"
#include <stdio.h>

/* A product would read sgn_context_last_error and keep the recorded frame. */
#define TRY(call) if ((call) < 0) return puts("failed: " #call), 1

enum { SIDE = 11, CLOTH = SIDE * SIDE, VERTICES = CLOTH + 4, TRIANGLES = 2 * (SIDE - 1) * (SIDE - 1) + 2 };

static float recorded[2][VERTICES][3], filtered[VERTICES][3];
static uint32_t triangles[TRIANGLES][3], groups[VERTICES];
static double masses[VERTICES];

/* The recorded cloth at a frame: flat, falling, and then rising again. */
static void record(int frame, float x[VERTICES][3]) {
  const float roof[4][3] = {{-0.2f, -1, 0.5f}, {0.2f, -1, 0.5f}, {0.2f, 1, 0.55f}, {-0.2f, 1, 0.55f}};
  for (int i = 0; i < CLOTH; i++) {
    x[i][0] = 0.1f * (float)(i % SIDE) - 0.5f, x[i][1] = 0.1f * (float)(i / SIDE) - 0.5f;
    x[i][2] = 0.6f + (frame < 15 ? -0.02f * (float)frame : -0.3f + 0.04f * (float)(frame - 15));
  }
  for (int i = 0; i < 4; i++)
    for (int k = 0; k < 3; k++) x[CLOTH + i][k] = roof[i][k];
}

int main(void) {
  SgnContext *context;
  SgnFilter *filter;
  SgnFilterDesc desc;
  SgnStepDesc step;
  SgnStepReport report;
  const uint32_t roof[2][3] = {{CLOTH, CLOTH + 1, CLOTH + 2}, {CLOTH, CLOTH + 2, CLOTH + 3}};
  int t = 0;
  for (uint32_t j = 0; j + 1 < SIDE; j++)
    for (uint32_t i = 0; i + 1 < SIDE; i++) {
      const uint32_t a = SIDE * j + i, quad[2][3] = {{a, a + 1, a + SIDE + 1}, {a, a + SIDE + 1, a + SIDE}};
      for (int half = 0; half < 2; half++, t++)
        for (int k = 0; k < 3; k++) triangles[t][k] = quad[half][k];
    }
  for (int half = 0; half < 2; half++, t++)
    for (int k = 0; k < 3; k++) triangles[t][k] = roof[half][k];
  for (int i = 0; i < VERTICES; i++) {
    groups[i] = i >= CLOTH;               /* the roof is a body of its own */
    masses[i] = i < CLOTH ? 0.01 : 0;     /* mass 0: scripted */
  }
  record(0, recorded[0]);
  TRY(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &context));
  sgn_filter_desc_init(&desc, sizeof desc);
  desc.precision = SGN_PRECISION_F32; /* positions are certified as the floats that are handed back */
  desc.half_thickness = 0.002;
  desc.mesh.vertices = sgn_view(SGN_FORMAT_F32X3, recorded[0], VERTICES);
  desc.mesh.triangles = sgn_view(SGN_FORMAT_U32X3, triangles, TRIANGLES);
  desc.masses = sgn_view(SGN_FORMAT_F64, masses, VERTICES);
  desc.groups = sgn_view(SGN_FORMAT_U32, groups, VERTICES);
  TRY(sgn_filter_create(context, &desc, &filter));
  sgn_step_desc_init(&step, sizeof step);
  step.dt = 1.0 / 60;
  step.flags = SGN_STEP_CERTIFY;
  sgn_step_report_init(&report, sizeof report);
  for (int frame = 1; frame <= 30; frame++) {
    const SgnView x0 = sgn_view(SGN_FORMAT_F32X3, recorded[0], VERTICES);
    const SgnView x1 = sgn_view(SGN_FORMAT_F32X3, recorded[1], VERTICES);
    const SgnViewMut end = sgn_view_mut(SGN_FORMAT_F32X3, filtered, VERTICES);
    const int mode = frame == 1 ? SGN_FILTER_MOTION : SGN_FILTER_POSITION; /* follow the recording, around the roof */
    record(frame - 1, recorded[0]);
    record(frame, recorded[1]);
    TRY(sgn_filter_run(filter, mode, &x0, &x1, &step, &end, NULL, &report));
    if (frame % 5 == 0)
      printf("frame %2d: recorded %.3f, filtered %.3f, %u contacts, %u intersections\n", frame,
             (double)recorded[1][CLOTH / 2][2], (double)filtered[CLOTH / 2][2], report.active_contacts,
             (unsigned)report.intersections);
  }
  return sgn_filter_destroy(filter) || sgn_context_destroy(context);
}
