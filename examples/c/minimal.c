/* The smallest host: a cloth of nine vertices falls on the ground. Link with -lsignorini. */
#include "signorini.h"
#include <stdio.h>

/* A product would read sgn_context_last_error and go on without contacts. */
#define TRY(call) if ((call) < 0) return puts("failed: " #call), 1

int main(void) {
  double x[9][3], v[9][3] = {{0}}, mass[9];
  uint32_t triangles[8][3] = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {3, 4, 7}, {3, 7, 6}, {4, 5, 8}, {4, 8, 7}};
  const double dt = 0.01, gravity[3] = {0, 0, -9.81};
  SgnContext *context;
  SgnWorld *world;
  SgnBodyId cloth, ground;
  SgnDeformableDesc desc;
  SgnHalfSpaceDesc plane;
  SgnStepDesc step;
  SgnViewMut end = sgn_view_mut(SGN_FORMAT_F64X3, x, 9), velocity = sgn_view_mut(SGN_FORMAT_F64X3, v, 9);
  SgnView push = sgn_view(SGN_FORMAT_F64X3, v, 9);

  for (int i = 0; i < 9; i++) {
    x[i][0] = 0.1 * (i % 3), x[i][1] = 0.1 * (i / 3), x[i][2] = 0.2, mass[i] = 0.01;
  }
  TRY(sgn_context_create(SGN_ABI_VERSION, NULL, NULL, 0, &context));
  TRY(sgn_world_create(context, NULL, &world));
  sgn_half_space_desc_init(&plane, sizeof plane); /* the half-space z >= 0 */
  TRY(sgn_half_space_create(world, &plane, &ground));
  sgn_deformable_desc_init(&desc, sizeof desc);
  desc.mesh.vertices = sgn_view(SGN_FORMAT_F64X3, x, 9);
  desc.mesh.triangles = sgn_view(SGN_FORMAT_U32X3, triangles, 8);
  desc.masses = sgn_view(SGN_FORMAT_F64, mass, 9);
  TRY(sgn_deformable_create(world, &desc, &cloth));
  sgn_step_desc_init(&step, sizeof step);
  step.dt = dt;
  for (int frame = 0; frame < 50; frame++) {
    for (int i = 0; i < 27; i++) v[i / 3][i % 3] += dt * gravity[i % 3]; /* the host's own dynamics, without contact */
    TRY(sgn_body_push(world, cloth, SGN_SLOT_VELOCITY, &push, 0));
    TRY(sgn_world_step(world, &step, NULL)); /* above 0: a note, as that an iteration cap was reached */
    TRY(sgn_body_pull(world, cloth, SGN_SLOT_POSITION, &end));
    TRY(sgn_body_pull(world, cloth, SGN_SLOT_VELOCITY, &velocity));
    if (frame % 10 == 9) printf("t = %.2f s: height %.4f m, speed %.4f m/s\n", dt * (frame + 1), x[4][2], v[4][2]);
  }
  return sgn_world_destroy(world) || sgn_context_destroy(context);
}
