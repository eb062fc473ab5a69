#include "host_mesh.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int host_mesh_write_obj(const char *path, const HostMesh *meshes, uint32_t mesh_count)
{
    FILE *file = fopen(path, "w");
    uint32_t m, i, first = 1; /* OBJ counts vertices through the whole file, from one */
    int good;

    if (!file) {
        fprintf(stderr, "cannot write %s\n", path);
        return 0;
    }
    for (m = 0; m < mesh_count; m++) {
        const HostMesh *mesh = &meshes[m];
        const double *x = mesh->positions;
        const uint32_t *t = mesh->triangles;
        fprintf(file, "o %s\n", mesh->name);
        for (i = 0; i < mesh->vertex_count; i++, x += 3)
            fprintf(file, "v %.17g %.17g %.17g\n", x[0], x[1], x[2]);
        for (i = 0; i < mesh->triangle_count; i++, t += 3)
            fprintf(file, "f %u %u %u\n", (unsigned)(t[0] + first), (unsigned)(t[1] + first), (unsigned)(t[2] + first));
        first += mesh->vertex_count;
    }
    good = !ferror(file);
    if (fclose(file) != 0)
        good = 0;
    if (!good)
        fprintf(stderr, "could not finish %s\n", path);
    return good;
}

/* Counts what the file holds, then reads it. */
int host_mesh_read_obj(const char *path, double **positions, uint32_t *vertex_count, uint32_t **triangles,
                       uint32_t *triangle_count)
{
    FILE *file = fopen(path, "r");
    char line[1024];
    uint32_t vertices = 0, faces = 0, i;
    double *x = NULL;
    uint32_t *t = NULL;

    if (!file) {
        fprintf(stderr, "cannot read %s\n", path);
        return 0;
    }
    while (fgets(line, sizeof line, file)) {
        vertices += strncmp(line, "v ", 2) == 0;
        faces += strncmp(line, "f ", 2) == 0;
    }
    x = malloc(3 * sizeof *x * (vertices + 1));
    t = malloc(3 * sizeof *t * (faces + 1));
    if (!x || !t)
        goto bad;
    rewind(file);
    vertices = faces = 0;
    while (fgets(line, sizeof line, file)) {
        if (strncmp(line, "v ", 2) == 0) {
            double *to = &x[3 * vertices];
            if (sscanf(line + 2, "%lf %lf %lf", &to[0], &to[1], &to[2]) != 3)
                goto bad;
            vertices++;
        } else if (strncmp(line, "f ", 2) == 0) {
            char *corner = line + 2, *end;
            for (i = 0; i < 3; i++) {
                long index = strtol(corner, &end, 10);
                if (end == corner || index < 1)
                    goto bad;
                t[3 * faces + i] = (uint32_t)(index - 1);
                corner = end + strcspn(end, " \t\r\n"); /* over "/texture/normal" */
            }
            faces++;
        }
    }
    for (i = 0; i < 3 * faces; i++)
        if (t[i] >= vertices)
            goto bad;
    fclose(file);
    *positions = x;
    *vertex_count = vertices;
    *triangles = t;
    *triangle_count = faces;
    return 1;

bad:
    fprintf(stderr, "%s is not a triangle mesh, or memory is short: %s", path, line);
    fclose(file);
    free(x);
    free(t);
    return 0;
}
