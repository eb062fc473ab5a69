/* A cloth that the library drives falls over a soft ball of tetrahedra, which it drives too. Link with -lsignorini. */
#include "signorini.h"
#include <math.h>
#include <stdio.h>

#define TRY(call) if ((call) < 0) return puts("failed: " #call), 1
enum { CELLS = 20, SIDE = CELLS + 1, BALL = 7 };

/* A square of cloth, 1 m wide, 0.75 m above the ground. */
static int add_cloth(SgnWorld *world, SgnBodyId *id) {
  static double x[SIDE * SIDE][3];
  static uint32_t triangles[2 * CELLS * CELLS][3];
  SgnSheetDesc desc;
  for (uint32_t i = 0; i < SIDE * SIDE; i++) {
    x[i][0] = (double)(i % SIDE) / CELLS - 0.5, x[i][1] = (double)(i / SIDE) / CELLS - 0.5, x[i][2] = 0.75;
  }
  for (uint32_t i = 0; i < CELLS * CELLS; i++) {
    const uint32_t a = i / CELLS * SIDE + i % CELLS, two[2][3] = {{a, a + 1, a + SIDE + 1}, {a, a + SIDE + 1, a + SIDE}};
    for (int k = 0; k < 6; k++) triangles[2 * i + k / 3][k % 3] = two[k / 3][k % 3];
  }
  sgn_sheet_desc_init(&desc, sizeof desc);
  desc.mesh.vertices = sgn_view(SGN_FORMAT_F64X3, x, SIDE * SIDE);
  desc.mesh.triangles = sgn_view(SGN_FORMAT_U32X3, triangles, 2 * CELLS * CELLS);
  desc.options.half_thickness = 0.002;
  desc.density = 300; /* kg/m^3, of a fabric 1 mm thick */
  desc.young_modulus = 2e5;
  desc.forces.drag = 0.6;                  /* air of 1.2 kg/m^3 */
  desc.forces.stretch_damping_time = 1e-3; /* s */
  desc.forces.bending_damping_time = 1e-3;
  TRY(sgn_sheet_create(world, &desc, id));
  return 0;
}

/* A ball of radius 0.3 m as the surface of a block of 2 x 2 x 2 cubes, of five tetrahedra each, that carries it. */
static int add_ball(SgnWorld *world, SgnBodyId *id) {
  static double nodes[27][3], surface[2 * BALL * BALL + 2][3];
  static uint32_t tetrahedra[40][4], triangles[4 * BALL * BALL][3];
  static const uint32_t five[5][4] = {{0, 1, 2, 4}, {3, 1, 2, 7}, {5, 1, 4, 7}, {6, 2, 4, 7}, {1, 2, 4, 7}};
  const double pi = acos(-1.0);
  const uint32_t around = 2 * BALL, points = around * BALL + 2;
  uint32_t count = 0;
  SgnSolidDesc desc;
  for (int i = 0; i < 27; i++) {
    nodes[i][0] = 0.32 * (i % 3 - 1), nodes[i][1] = 0.32 * (i / 3 % 3 - 1), nodes[i][2] = 0.32 * (i / 9);
  }
  for (uint32_t cube = 0; cube < 8; cube++) {
    const uint32_t i = cube & 1, j = cube >> 1 & 1, k = cube >> 2, odd = (i + j + k) % 2;
    for (int n = 0; n < 20; n++) {
      const uint32_t c = five[n / 4][n % 4];
      tetrahedra[5 * cube + (uint32_t)n / 4][n % 4] = (k + (c >> 2)) * 9 + (j + (c >> 1 & 1)) * 3 + i + ((c & 1) ^ odd);
    }
  }
  for (uint32_t i = 0; i < points; i++) {
    const double polar = i < points - 2 ? pi * (i / around + 1) / (BALL + 1) : i == points - 2 ? 0 : pi;
    const double turn = 2 * pi * (i % around) / around;
    surface[i][0] = 0.3 * sin(polar) * cos(turn), surface[i][1] = 0.3 * sin(polar) * sin(turn);
    surface[i][2] = 0.32 + 0.3 * cos(polar);
  }
  for (uint32_t i = 0; i < around; i++) {
    const uint32_t next = (i + 1) % around, last = around * (BALL - 1);
    const uint32_t caps[2][3] = {{points - 2, i, next}, {points - 1, last + next, last + i}};
    for (int k = 0; k < 6; k++) triangles[count + (uint32_t)k / 3][k % 3] = caps[k / 3][k % 3];
    count += 2;
    for (uint32_t row = 0; row + 1 < BALL; row++) {
      const uint32_t a = row * around, b = a + around;
      const uint32_t band[2][3] = {{a + i, b + i, b + next}, {a + i, b + next, a + next}};
      for (int k = 0; k < 6; k++) triangles[count + (uint32_t)k / 3][k % 3] = band[k / 3][k % 3];
      count += 2;
    }
  }
  sgn_solid_desc_init(&desc, sizeof desc);
  desc.nodes = sgn_view(SGN_FORMAT_F64X3, nodes, 27);
  desc.tetrahedra = sgn_view(SGN_FORMAT_U32X4, tetrahedra, 40);
  desc.surface.vertices = sgn_view(SGN_FORMAT_F64X3, surface, points);
  desc.surface.triangles = sgn_view(SGN_FORMAT_U32X3, triangles, count);
  desc.options.half_thickness = 0.002;
  desc.options.flags = SGN_BODY_NO_SELF_COLLISION;
  desc.density = 300;
  desc.young_modulus = 5e4;
  desc.forces.stretch_damping_time = 5e-3;
  TRY(sgn_solid_create(world, &desc, id));
  return 0;
}

/* Lowest and highest vertex. */
static int heights(const SgnWorld *world, SgnBodyId body, double *low, double *high) {
  static double x[SIDE * SIDE][3];
  SgnBodyInfo info;
  SgnViewMut view;
  sgn_body_info_init(&info, sizeof info);
  TRY(sgn_body_info(world, body, &info));
  view = sgn_view_mut(SGN_FORMAT_F64X3, x, info.vertices);
  TRY(sgn_body_pull(world, body, SGN_SLOT_POSITION, &view));
  *low = *high = x[0][2];
  for (uint64_t i = 1; i < info.vertices; i++) *low = fmin(*low, x[i][2]), *high = fmax(*high, x[i][2]);
  return 0;
}

int main(void) {
  const double gravity[3] = {0, 0, -9.81};
  uint64_t intersections = 0;
  SgnContext *context;
  SgnWorld *world;
  SgnBodyId ground, cloth, ball;
  SgnHalfSpaceDesc plane;
  SgnStepDesc step;
  SgnStepReport report;
  TRY(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &context));
  TRY(sgn_world_create(context, NULL, &world));
  TRY(sgn_world_set_gravity(world, gravity));
  sgn_half_space_desc_init(&plane, sizeof plane);
  TRY(sgn_half_space_create(world, &plane, &ground));
  if (add_ball(world, &ball) || add_cloth(world, &cloth)) return 1;
  sgn_step_desc_init(&step, sizeof step);
  sgn_step_report_init(&report, sizeof report);
  step.dt = 0.01;
  step.flags = SGN_STEP_CERTIFY;
  for (int frame = 0; frame < 60; frame++) {
    TRY(sgn_world_step(world, &step, &report)); /* nothing is pushed: the library drives both */
    intersections += report.intersections;
    if (frame % 10 == 9) {
      double low, high, ball_low, ball_high;
      if (heights(world, cloth, &low, &high) || heights(world, ball, &ball_low, &ball_high)) return 1;
      printf("t = %.2f s: cloth from %.3f to %.3f m, ball from %.3f to %.3f m, %u contacts\n", (frame + 1) * step.dt, low,
             high, ball_low, ball_high, report.contacts);
    }
  }
  printf("intersections: %llu\n", (unsigned long long)intersections);
  TRY(sgn_world_destroy(world));
  TRY(sgn_context_destroy(context));
  return intersections != 0;
}
