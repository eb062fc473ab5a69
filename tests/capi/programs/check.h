/* What the programs of the tests share: checks that count, a world with a cloth, a ball of triangles and the ground. */
#ifndef CHECK_H
#define CHECK_H

#include "signorini.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

#define CHECK(condition)                                                              \
  do {                                                                                \
    if (!(condition)) {                                                               \
      if (++failures <= 20) printf("%s:%d: %s\n", __FILE__, __LINE__, #condition);     \
    }                                                                                 \
  } while (0)

/* The call returns this code. */
#define GIVES(code, call)                                                             \
  do {                                                                                \
    SgnResult got_ = (call);                                                          \
    if (got_ != (code)) {                                                             \
      if (++failures <= 20)                                                           \
        printf("%s:%d: %s gives %d, not %s\n", __FILE__, __LINE__, #call, (int)got_, #code); \
    }                                                                                 \
  } while (0)

#define OK(call) GIVES(SGN_OK, call)

static inline int finish(void) {
  if (failures == 0) printf("PASS\n");
  return failures != 0;
}

enum { SIDE = 7, VERTICES = SIDE * SIDE, TRIANGLES = 2 * (SIDE - 1) * (SIDE - 1) };

typedef struct Cloth {
  double x[VERTICES][3];
  double v[VERTICES][3];
  double mass[VERTICES];
  uint32_t triangles[TRIANGLES][3];
} Cloth;

/* A square cloth with this spacing at this height, its middle above the origin. */
static inline void make_cloth(Cloth *cloth, double spacing, double height) {
  int t = 0;
  memset(cloth, 0, sizeof *cloth);
  for (int j = 0; j < SIDE; j++) {
    for (int i = 0; i < SIDE; i++) {
      double *x = cloth->x[SIDE * j + i];
      x[0] = spacing * (i - (SIDE - 1) / 2), x[1] = spacing * (j - (SIDE - 1) / 2), x[2] = height;
      cloth->mass[SIDE * j + i] = 0.002 + 0.0001 * i;
      if (i + 1 < SIDE && j + 1 < SIDE) {
        uint32_t a = (uint32_t)(SIDE * j + i);
        uint32_t first[3] = {a, a + 1, a + SIDE + 1}, second[3] = {a, a + SIDE + 1, a + SIDE};
        memcpy(cloth->triangles[t++], first, sizeof first);
        memcpy(cloth->triangles[t++], second, sizeof second);
      }
    }
  }
}

static inline SgnDeformableDesc cloth_desc(const Cloth *cloth) {
  SgnDeformableDesc desc;
  OK(sgn_deformable_desc_init(&desc, sizeof desc));
  desc.mesh.vertices = sgn_view(SGN_FORMAT_F64X3, cloth->x, VERTICES);
  desc.mesh.triangles = sgn_view(SGN_FORMAT_U32X3, cloth->triangles, TRIANGLES);
  desc.masses = sgn_view(SGN_FORMAT_F64, cloth->mass, VERTICES);
  desc.options.half_thickness = 0.005;
  return desc;
}

/* A regular octahedron, about the centre of mass. */
static const double OCTAHEDRON[6][3] = {{0.1, 0, 0}, {-0.1, 0, 0}, {0, 0.1, 0}, {0, -0.1, 0}, {0, 0, 0.1}, {0, 0, -0.1}};
static const uint32_t OCTAHEDRON_FACES[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                                {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};

static inline SgnRigidDesc octahedron_desc(double mass, double height) {
  SgnRigidDesc desc;
  OK(sgn_rigid_desc_init(&desc, sizeof desc));
  desc.mesh.vertices = sgn_view(SGN_FORMAT_F64X3, OCTAHEDRON, 6);
  desc.mesh.triangles = sgn_view(SGN_FORMAT_U32X3, OCTAHEDRON_FACES, 8);
  desc.options.half_thickness = 0.005;
  desc.mass = mass;
  desc.inertia[0] = desc.inertia[4] = desc.inertia[8] = 0.004 * mass;
  desc.position[2] = height;
  return desc;
}

static inline uint64_t state_hash(const SgnWorld *world) {
  uint64_t hash = 0;
  OK(sgn_world_state_hash(world, &hash));
  return hash;
}

#endif
