/* SPDX-License-Identifier: MIT
 * Slow and obvious: the dense matrices of section 3 in long double, and their solution by elimination. */
#ifndef LOXO_TESTS_SOLVER_DENSE_H
#define LOXO_TESTS_SOLVER_DENSE_H

#include "test.h"

#include <loxo/mesh.h>

typedef struct dense_vector {
    long double x, y, z;
} dense_vector;

static inline dense_vector dense_edge(const loxo_mesh_arrays *m, int64_t from, int64_t to)
{
    const double *a = m->position + 3 * from, *b = m->position + 3 * to;
    return (dense_vector){(long double)b[0] - (long double)a[0], (long double)b[1] - (long double)a[1],
                          (long double)b[2] - (long double)a[2]};
}

static inline long double dense_dot(dense_vector a, dense_vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static inline dense_vector dense_cross(dense_vector a, dense_vector b)
{
    return (dense_vector){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline long double dense_norm(dense_vector a) { return sqrtl(dense_dot(a, a)); }

/* Mean length over the edges, each counted once: edges of one face only count fully, others half in each. */
static inline long double dense_mean_edge(const loxo_mesh *mesh)
{
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    long double sum = 0.0L, n = 0.0L;
    for (int64_t h = 0; h < 3 * m.n_faces; ++h) {
        const double *a = m.position[m.halfedge_vertex[h]], *b = m.position[m.halfedge_vertex[h - h % 3 + (h + 1) % 3]];
        const long double share = m.halfedge_twin[h] < 0 ? 1.0L : 0.5L;
        sum +=
            share * hypotl(hypotl((long double)(b[0] - a[0]), (long double)(b[1] - a[1])), (long double)(b[2] - a[2]));
        n += share;
    }
    return sum / n;
}

/* s <- mass_factor A + cotangent_factor C: A the lumped areas, C positive semidefinite with weights (cot a + cot b) / 2. */
static inline void dense_matrix(const loxo_mesh_arrays *m, long double mass_factor, long double cotangent_factor,
                                long double *s)
{
    const int64_t n = m->n_vertices;
    memset(s, 0, (size_t)(n * n) * sizeof *s);
    for (int64_t f = 0; f < m->n_faces; ++f)
        for (int c = 0; c < 3; ++c) {
            const int64_t v = m->triangle[3 * f + c], a = m->triangle[3 * f + (c + 1) % 3],
                          b = m->triangle[3 * f + (c + 2) % 3];
            const dense_vector va = dense_edge(m, v, a), vb = dense_edge(m, v, b);
            const long double twice_area = dense_norm(dense_cross(va, vb));
            s[v * n + v] += mass_factor * twice_area / 6.0L;
            if (!(twice_area > 0.0L)) continue;
            const long double w = cotangent_factor * dense_dot(va, vb) / (2.0L * twice_area);
            s[a * n + b] -= w;
            s[b * n + a] -= w;
            s[a * n + a] += w;
            s[b * n + b] += w;
        }
}

/* x_v = 0 for these vertices, in place of their rows. */
static inline void dense_ground(int64_t n, const loxo_index *vertices, int64_t n_grounded, long double *s,
                                long double *x)
{
    for (int64_t i = 0; i < n_grounded; ++i) {
        const int64_t v = vertices[i];
        for (int64_t k = 0; k < n; ++k)
            s[v * n + k] = s[k * n + v] = 0.0L;
        s[v * n + v] = 1.0L;
        x[v] = 0.0L;
    }
}

/* Elimination without pivoting: the matrix is symmetric and positive definite. x holds the right side, then the
 * solution. */
static inline void dense_solve(int64_t n, long double *s, long double *x)
{
    for (int64_t k = 0; k < n; ++k)
        for (int64_t i = k + 1; i < n; ++i) {
            const long double q = s[i * n + k] / s[k * n + k];
            if (q == 0.0L) continue;
            for (int64_t j = k; j < n; ++j)
                s[i * n + j] -= q * s[k * n + j];
            x[i] -= q * x[k];
        }
    for (int64_t i = n - 1; i >= 0; --i) {
        for (int64_t j = i + 1; j < n; ++j)
            x[i] -= s[i * n + j] * x[j];
        x[i] /= s[i * n + i];
    }
}

#endif
