#include "host_cloth.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double dot3(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* ---- building ---------------------------------------------------------------------------------------------------- */

uint32_t host_cloth_vertex(const HostCloth *cloth, uint32_t column, uint32_t row)
{
    return row * cloth->settings.columns + column;
}

/* Adds a spring if both ends lie in the grid. */
static void add_spring(HostCloth *cloth, uint32_t column, uint32_t row, int right, int down, double stiffness)
{
    const HostClothSettings *s = &cloth->settings;
    long other_column = (long)column + right, other_row = (long)row + down;
    HostSpring *spring = &cloth->springs[cloth->spring_count];
    double d[3];
    int k;

    if (other_column < 0 || other_column >= (long)s->columns || other_row >= (long)s->rows || stiffness <= 0.0)
        return;
    spring->a = host_cloth_vertex(cloth, column, row);
    spring->b = host_cloth_vertex(cloth, (uint32_t)other_column, (uint32_t)other_row);
    for (k = 0; k < 3; k++)
        d[k] = cloth->positions[3 * spring->b + k] - cloth->positions[3 * spring->a + k];
    spring->rest_length = sqrt(dot3(d, d));
    spring->stiffness = stiffness;
    spring->damping = stiffness * s->damping_time;
    cloth->spring_count++;
}

static void lay_out_grid(HostCloth *cloth)
{
    const HostClothSettings *s = &cloth->settings;
    uint32_t i, j, k;
    uint32_t *triangle = cloth->triangles;

    for (j = 0; j < s->rows; j++) {
        for (i = 0; i < s->columns; i++) {
            uint32_t v = host_cloth_vertex(cloth, i, j);
            double u = (double)i / (s->columns - 1), w = (double)j / (s->rows - 1);
            for (k = 0; k < 3; k++)
                cloth->positions[3 * v + k] = s->origin[k] + u * s->along[k] + w * s->across[k];
        }
    }
    for (j = 0; j < s->rows; j++) {
        for (i = 0; i < s->columns; i++) {
            add_spring(cloth, i, j, 1, 0, s->stretch_stiffness);
            add_spring(cloth, i, j, 0, 1, s->stretch_stiffness);
            add_spring(cloth, i, j, 1, 1, s->shear_stiffness);
            add_spring(cloth, i, j, -1, 1, s->shear_stiffness);
            add_spring(cloth, i, j, 2, 0, s->bend_stiffness);
            add_spring(cloth, i, j, 0, 2, s->bend_stiffness);
        }
    }
    /* Diagonals alternate from cell to cell, so that the cloth folds alike in both directions. Each triangle carries a
     * third of its mass to each corner. */
    for (j = 0; j + 1 < s->rows; j++) {
        for (i = 0; i + 1 < s->columns; i++) {
            uint32_t a = host_cloth_vertex(cloth, i, j), b = a + 1, c = a + s->columns, d = c + 1;
            uint32_t even[6], odd[6];
            even[0] = a, even[1] = b, even[2] = d, even[3] = a, even[4] = d, even[5] = c;
            odd[0] = a, odd[1] = b, odd[2] = c, odd[3] = b, odd[4] = d, odd[5] = c;
            memcpy(triangle, (i + j) % 2 ? odd : even, sizeof even);
            triangle += 6;
        }
    }
    for (i = 0; i < 3 * cloth->triangle_count; i++)
        cloth->masses[cloth->triangles[i]] += s->mass / (3.0 * cloth->triangle_count);
}

/* Finds the block (row, column); the pattern holds it. */
static size_t find_block(const HostCloth *cloth, uint32_t row, uint32_t column)
{
    size_t block = (size_t)cloth->row_offsets[row];
    while (cloth->columns[block] != column)
        block++;
    return block;
}

/* The pattern of A: one block per vertex and two per spring. Returns 0 when memory is short. */
static int build_pattern(HostCloth *cloth)
{
    uint32_t i, n = cloth->vertex_count;
    size_t *fill;

    cloth->block_count = n + 2 * (size_t)cloth->spring_count;
    cloth->columns = malloc(cloth->block_count * sizeof *cloth->columns);
    cloth->blocks = malloc(cloth->block_count * 9 * sizeof *cloth->blocks);
    fill = malloc(n * sizeof *fill);
    if (!cloth->columns || !cloth->blocks || !fill) {
        free(fill);
        return 0;
    }
    for (i = 0; i < n; i++)
        cloth->row_offsets[i + 1] = 1;
    for (i = 0; i < cloth->spring_count; i++) {
        cloth->row_offsets[cloth->springs[i].a + 1]++;
        cloth->row_offsets[cloth->springs[i].b + 1]++;
    }
    for (i = 0; i < n; i++) {
        cloth->row_offsets[i + 1] += cloth->row_offsets[i];
        fill[i] = (size_t)cloth->row_offsets[i];
        cloth->columns[fill[i]++] = i;
    }
    for (i = 0; i < cloth->spring_count; i++) {
        const HostSpring *s = &cloth->springs[i];
        cloth->columns[fill[s->a]++] = s->b;
        cloth->columns[fill[s->b]++] = s->a;
    }
    for (i = 0; i < n; i++) { /* insertion sort: a row has some thirteen entries */
        size_t first = (size_t)cloth->row_offsets[i], end = (size_t)cloth->row_offsets[i + 1], k;
        for (k = first + 1; k < end; k++) {
            uint32_t column = cloth->columns[k];
            size_t to = k;
            for (; to > first && cloth->columns[to - 1] > column; to--)
                cloth->columns[to] = cloth->columns[to - 1];
            cloth->columns[to] = column;
        }
        cloth->diagonal[i] = find_block(cloth, i, i);
    }
    for (i = 0; i < cloth->spring_count; i++) {
        HostSpring *s = &cloth->springs[i];
        s->block_ab = find_block(cloth, s->a, s->b);
        s->block_ba = find_block(cloth, s->b, s->a);
    }
    free(fill);
    return 1;
}

HostCloth *host_cloth_create(const HostClothSettings *settings)
{
    HostCloth *cloth;
    size_t n, cells;

    if (settings->columns < 2 || settings->rows < 2 || settings->columns > 10000 || settings->rows > 10000 ||
        !(settings->linear_tolerance > 0.0))
        return NULL;
    cloth = calloc(1, sizeof *cloth);
    if (!cloth)
        return NULL;
    n = (size_t)settings->columns * settings->rows;
    cells = (size_t)(settings->columns - 1) * (settings->rows - 1);
    cloth->settings = *settings;
    cloth->vertex_count = (uint32_t)n;
    cloth->triangle_count = (uint32_t)(2 * cells);
    cloth->positions = calloc(3 * n, sizeof *cloth->positions);
    cloth->velocities = calloc(3 * n, sizeof *cloth->velocities);
    cloth->free_velocity = calloc(3 * n, sizeof *cloth->free_velocity);
    cloth->masses = calloc(n, sizeof *cloth->masses);
    cloth->pinned = calloc(n, sizeof *cloth->pinned);
    cloth->triangles = calloc(6 * cells, sizeof *cloth->triangles);
    cloth->springs = calloc(6 * n, sizeof *cloth->springs);
    cloth->row_offsets = calloc(n + 1, sizeof *cloth->row_offsets);
    cloth->diagonal = calloc(n, sizeof *cloth->diagonal);
    cloth->work = calloc((9 + 5 * 3) * n, sizeof *cloth->work);
    if (!cloth->positions || !cloth->velocities || !cloth->free_velocity || !cloth->masses || !cloth->pinned ||
        !cloth->triangles || !cloth->springs || !cloth->row_offsets || !cloth->diagonal || !cloth->work) {
        host_cloth_destroy(cloth);
        return NULL;
    }
    lay_out_grid(cloth);
    if (!build_pattern(cloth)) {
        host_cloth_destroy(cloth);
        return NULL;
    }
    return cloth;
}

void host_cloth_destroy(HostCloth *cloth)
{
    if (!cloth)
        return;
    free(cloth->positions);
    free(cloth->velocities);
    free(cloth->free_velocity);
    free(cloth->masses);
    free(cloth->pinned);
    free(cloth->triangles);
    free(cloth->springs);
    free(cloth->row_offsets);
    free(cloth->columns);
    free(cloth->blocks);
    free(cloth->diagonal);
    free(cloth->work);
    free(cloth);
}

void host_cloth_pin(HostCloth *cloth, uint32_t vertex)
{
    int k;
    cloth->pinned[vertex] = 1;
    for (k = 0; k < 3; k++)
        cloth->velocities[3 * vertex + k] = 0.0;
}

void host_cloth_release(HostCloth *cloth, uint32_t vertex)
{
    cloth->pinned[vertex] = 0;
}

/* ---- dynamics ---------------------------------------------------------------------------------------------------- */

/* Adds one spring to A and b. With d the unit vector from a to b, l the length and L the rest length:
 *   force on a      f = k (l - L) d
 *   -df/dx          k (d d^T + max(0, 1 - L/l) (1 - d d^T)): a pressed spring would make A indefinite, so its
 *                   transverse part is dropped (this is the projection of each spring's Hessian)
 *   -df/dv          c d d^T */
static void assemble_spring(HostCloth *cloth, const HostSpring *s, double dt, double *b)
{
    double *aa = &cloth->blocks[9 * cloth->diagonal[s->a]], *bb = &cloth->blocks[9 * cloth->diagonal[s->b]];
    double *ab = &cloth->blocks[9 * s->block_ab], *ba = &cloth->blocks[9 * s->block_ba];
    double d[3], length, transverse, axial, pull;
    int i, j;

    for (i = 0; i < 3; i++)
        d[i] = cloth->positions[3 * s->b + i] - cloth->positions[3 * s->a + i];
    length = sqrt(dot3(d, d));
    if (length <= 1e-9 * s->rest_length)
        return; /* no direction: no force */
    for (i = 0; i < 3; i++)
        d[i] /= length;
    pull = dt * s->stiffness * (length - s->rest_length);
    transverse = dt * dt * s->stiffness * fmax(0.0, 1.0 - s->rest_length / length);
    axial = dt * dt * s->stiffness + dt * s->damping;
    for (i = 0; i < 3; i++) {
        b[3 * s->a + i] += pull * d[i];
        b[3 * s->b + i] -= pull * d[i];
        for (j = 0; j < 3; j++) {
            double h = (axial - transverse) * d[i] * d[j] + (i == j ? transverse : 0.0);
            aa[3 * i + j] += h;
            bb[3 * i + j] += h;
            ab[3 * i + j] -= h;
            ba[3 * i + j] -= h;
        }
    }
}

/* Pinned vertices keep their velocity: their columns move to the right side, their rows become mass times identity. */
static void eliminate_pinned(HostCloth *cloth, double *b)
{
    uint32_t row;
    size_t block;
    int i, j;

    for (row = 0; row < cloth->vertex_count; row++) {
        for (block = (size_t)cloth->row_offsets[row]; block < (size_t)cloth->row_offsets[row + 1]; block++) {
            uint32_t column = cloth->columns[block];
            double *h = &cloth->blocks[9 * block];
            const double *v = &cloth->velocities[3 * column];
            if (!cloth->pinned[row] && !cloth->pinned[column])
                continue;
            if (!cloth->pinned[row])
                for (i = 0; i < 3; i++)
                    b[3 * row + i] -= dot3(&h[3 * i], v);
            for (i = 0; i < 3; i++)
                for (j = 0; j < 3; j++)
                    h[3 * i + j] = row == column && i == j ? cloth->masses[row] : 0.0;
        }
        if (cloth->pinned[row])
            for (i = 0; i < 3; i++)
                b[3 * row + i] = cloth->masses[row] * cloth->velocities[3 * row + i];
    }
}

static void assemble(HostCloth *cloth, double dt, double *b)
{
    const HostClothSettings *s = &cloth->settings;
    uint32_t v, k;

    memset(cloth->blocks, 0, cloth->block_count * 9 * sizeof *cloth->blocks);
    for (v = 0; v < cloth->vertex_count; v++) {
        for (k = 0; k < 3; k++) {
            cloth->blocks[9 * cloth->diagonal[v] + 4 * k] = cloth->masses[v] * (1.0 + dt * s->drag);
            b[3 * v + k] = cloth->masses[v] * (cloth->velocities[3 * v + k] + dt * s->gravity[k]);
        }
    }
    for (k = 0; k < cloth->spring_count; k++)
        assemble_spring(cloth, &cloth->springs[k], dt, b);
    eliminate_pinned(cloth, b);
}

static void multiply(const HostCloth *cloth, const double *x, double *y)
{
    uint32_t row;
    size_t block;
    int i;

    for (row = 0; row < cloth->vertex_count; row++) {
        double sum[3] = {0.0, 0.0, 0.0};
        for (block = (size_t)cloth->row_offsets[row]; block < (size_t)cloth->row_offsets[row + 1]; block++)
            for (i = 0; i < 3; i++)
                sum[i] += dot3(&cloth->blocks[9 * block + 3 * i], &x[3 * cloth->columns[block]]);
        memcpy(&y[3 * row], sum, sizeof sum);
    }
}

/* Inverse of a symmetric positive definite 3x3 matrix, by cofactors. */
static void invert3(const double *a, double *inverse)
{
    double c0 = a[4] * a[8] - a[5] * a[7], c1 = a[5] * a[6] - a[3] * a[8], c2 = a[3] * a[7] - a[4] * a[6];
    double scale = 1.0 / (a[0] * c0 + a[1] * c1 + a[2] * c2);
    inverse[0] = scale * c0;
    inverse[1] = inverse[3] = scale * c1;
    inverse[2] = inverse[6] = scale * c2;
    inverse[4] = scale * (a[0] * a[8] - a[2] * a[6]);
    inverse[5] = inverse[7] = scale * (a[1] * a[6] - a[0] * a[7]);
    inverse[8] = scale * (a[0] * a[4] - a[1] * a[3]);
}

static double precondition(const HostCloth *cloth, const double *inverse, const double *r, double *z)
{
    double product = 0.0;
    uint32_t v;
    int i;

    for (v = 0; v < cloth->vertex_count; v++) {
        for (i = 0; i < 3; i++)
            z[3 * v + i] = dot3(&inverse[9 * v + 3 * i], &r[3 * v]);
        product += dot3(&z[3 * v], &r[3 * v]);
    }
    return product;
}

/* Conjugate gradients with the inverse diagonal blocks as preconditioner; x is the start and the result. */
static int solve(HostCloth *cloth, const double *b, double *x, double *inverse, double *vectors)
{
    size_t n = 3 * (size_t)cloth->vertex_count, i;
    double *r = vectors, *z = r + n, *p = z + n, *q = p + n;
    double product, limit, tolerance = cloth->settings.linear_tolerance;
    uint32_t v;
    int iteration, most = (int)(10 * n);

    for (v = 0; v < cloth->vertex_count; v++)
        invert3(&cloth->blocks[9 * cloth->diagonal[v]], &inverse[9 * v]);
    limit = tolerance * tolerance * precondition(cloth, inverse, b, z);
    multiply(cloth, x, r);
    for (i = 0; i < n; i++)
        r[i] = b[i] - r[i];
    product = precondition(cloth, inverse, r, z);
    memcpy(p, z, n * sizeof *p);
    for (iteration = 0; product > limit; iteration++) {
        double curvature = 0.0, step, previous = product;
        if (iteration == most)
            return -1;
        multiply(cloth, p, q);
        for (i = 0; i < n; i++)
            curvature += p[i] * q[i];
        step = product / curvature;
        for (i = 0; i < n; i++) {
            x[i] += step * p[i];
            r[i] -= step * q[i];
        }
        product = precondition(cloth, inverse, r, z);
        for (i = 0; i < n; i++)
            p[i] = z[i] + product / previous * p[i];
    }
    return iteration;
}

int host_cloth_predict(HostCloth *cloth, double dt)
{
    size_t n = cloth->vertex_count;
    double *inverse = cloth->work, *b = inverse + 9 * n;

    assemble(cloth, dt, b);
    memcpy(cloth->free_velocity, cloth->velocities, 3 * n * sizeof *cloth->velocities);
    return solve(cloth, b, cloth->free_velocity, inverse, b + 3 * n);
}

/* ---- measuring --------------------------------------------------------------------------------------------------- */

void host_cloth_momentum(const HostCloth *cloth, double momentum[3])
{
    uint32_t v;
    int k;

    momentum[0] = momentum[1] = momentum[2] = 0.0;
    for (v = 0; v < cloth->vertex_count; v++)
        for (k = 0; k < 3; k++)
            momentum[k] += cloth->masses[v] * cloth->velocities[3 * v + k];
}

double host_cloth_kinetic_energy(const HostCloth *cloth)
{
    double energy = 0.0;
    uint32_t v;

    for (v = 0; v < cloth->vertex_count; v++)
        energy += 0.5 * cloth->masses[v] * dot3(&cloth->velocities[3 * v], &cloth->velocities[3 * v]);
    return energy;
}

double host_cloth_fastest(const HostCloth *cloth)
{
    double fastest = 0.0;
    uint32_t v;

    for (v = 0; v < cloth->vertex_count; v++)
        fastest = fmax(fastest, sqrt(dot3(&cloth->velocities[3 * v], &cloth->velocities[3 * v])));
    return fastest;
}

static void cross3(const double *a, const double *b, double *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

int host_cloth_crossings(const HostCloth *cloth, const double point[3], const double direction[3])
{
    int crossings = 0, i, k;
    uint32_t t;

    for (t = 0; t < cloth->triangle_count; t++) {
        /* The line passes inside when it turns the same way round all three edges: the same expression decides for
         * both triangles at an edge, so a line through an edge is counted once. */
        double corner[3][3], edge[3][3], normal[3], height, slope;
        int positive = 0;
        for (i = 0; i < 3; i++)
            for (k = 0; k < 3; k++)
                corner[i][k] = cloth->positions[3 * cloth->triangles[3 * t + i] + k] - point[k];
        for (i = 0; i < 3; i++) {
            const double *from = corner[i], *to = corner[(i + 1) % 3];
            uint32_t a = cloth->triangles[3 * t + i], b = cloth->triangles[3 * t + (i + 1) % 3];
            double moment[3], side;
            if (a < b)
                cross3(from, to, moment);
            else
                cross3(to, from, moment);
            side = dot3(moment, direction);
            positive += a < b ? side > 0.0 : !(side > 0.0);
        }
        if (positive != 0 && positive != 3)
            continue;
        for (k = 0; k < 3; k++) {
            edge[0][k] = corner[1][k] - corner[0][k];
            edge[1][k] = corner[2][k] - corner[0][k];
        }
        cross3(edge[0], edge[1], normal);
        height = dot3(corner[0], normal);
        slope = dot3(direction, normal);
        crossings += slope != 0.0 && height / slope > 0.0;
    }
    return crossings;
}

double host_random(uint64_t *state)
{
    /* splitmix64 */
    uint64_t z = (*state += UINT64_C(0x9e3779b97f4a7c15));
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    z ^= z >> 31;
    return (double)(z >> 11) / 4503599627370496.0 - 1.0;
}
