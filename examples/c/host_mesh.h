/* Triangle meshes as OBJ files, for the example hosts: reading one, and writing a frame that Blender opens. */
#ifndef HOST_MESH_H
#define HOST_MESH_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct HostMesh {
    const char *name;
    const double *positions; /* x y z per vertex [m] */
    uint32_t vertex_count;
    const uint32_t *triangles; /* 3 per triangle, from zero */
    uint32_t triangle_count;
} HostMesh;

/* Writes meshes as objects of one file, every double with the 17 digits that bring it back exactly. 0 on failure. */
int host_mesh_write_obj(const char *path, const HostMesh *meshes, uint32_t mesh_count);

/* Reads the vertices and triangles of a file (`v` and `f` lines with three corners) into arrays that the caller frees.
 * 0 on failure, with a line on stderr. */
int host_mesh_read_obj(const char *path, double **positions, uint32_t *vertex_count, uint32_t **triangles,
                       uint32_t *triangle_count);

#ifdef __cplusplus
}
#endif

#endif
