/* SPDX-License-Identifier: MIT
 * Directions in which the heat of a solve falls: the fast form of gradient_kernel.h, on a mesh's own arrays.
 *
 * The recovery needs h = -grad u / |grad u|, eq. (3), only by its products with a face's edges, and the derivative of u
 * along an edge is the difference of u at its ends: h . e = -(u_end - u_start) / |grad u|. With the normal
 * n = ab x ac, twice the area long, and w = (u_b - u_a) ac - (u_c - u_a) ab, grad u = -n x w / |n|^2 and
 * |grad u| = |w| / |n|. */
#ifndef LOXO_KERNEL_DESCENT_KERNEL_H
#define LOXO_KERNEL_DESCENT_KERNEL_H

#include "kernel/layout_kernel.h"
#include "kernel/scaled.h"

/* So many faces are worked on at a time: their numbers are gathered one by one, then computed with side by side, which
 * compilers turn into vector instructions. Several times a vector's width, or vectors would be read before the single
 * numbers that they consist of have left the store queue (measured, 8 and 32 faces: 8.6 and 5.5 ns a face). */
#define K_BATCH 32

/* Scale of a vertex that has no heat. */
#define K_NOT_REACHED INT32_MIN

/* 1 / |grad u| of the linear function that rises by rise_b and rise_c from corner a to the other two, n = ab x ac; zero
 * where there is none: equal heat, no area. */
static inline double k_inverse_slope(loxo_vec3 ab, loxo_vec3 ac, loxo_vec3 n, double rise_b, double rise_c)
{
    const loxo_vec3 w = v3_sub(v3_scale(rise_b, ac), v3_scale(rise_c, ab));
    const double square = v3_dot(w, w), q = v3_dot(n, n) / square;
    return sqrt(square > 0.0 && q < HUGE_VAL ? q : 0.0);
}

/* Number by number of K_BATCH faces: corners' coordinates, heat value * 2^scale. */
typedef struct k_face_batch {
    double x[3][K_BATCH], y[3][K_BATCH], z[3][K_BATCH], value[3][K_BATCH];
    int32_t scale[3][K_BATCH];
} k_face_batch;

/* Asks for what the faces some way ahead will look up; faces are ordered by their vertices, about two to one. */
static inline void k_prefetch_corners(const loxo_mesh_view *m, const double *value, const int32_t *scale, int64_t f)
{
    const int64_t v = (int64_t)m->halfedge_vertex[3 * f] + K_AHEAD / 2;
    if (v >= m->n_vertices) return;
    __builtin_prefetch(&value[v], 0, 2);
    __builtin_prefetch(&scale[v], 0, 2);
    if (m->halfedge_length != NULL) return;
    if (m->position != NULL)
        __builtin_prefetch(&m->position[v], 0, 2);
    else
        __builtin_prefetch(&m->position_float[v], 0, 2);
}

static inline void k_gather_corner(k_face_batch *restrict b, int64_t i, int k, loxo_vec3 p, double value, int32_t scale)
{
    b->x[k][i] = p.x;
    b->y[k][i] = p.y;
    b->z[k][i] = p.z;
    b->value[k][i] = value;
    b->scale[k][i] = scale;
}

/* Faces f..f+n-1, n <= K_BATCH; the rest of the batch repeats the last of them. */
static inline void k_gather_batch(const loxo_mesh_view *m, const double *value, const int32_t *scale, int64_t f,
                                  int64_t n, k_face_batch *restrict b)
{
    const bool has_lengths = m->halfedge_length != NULL;
    for (int64_t i = 0; i < n; i += 4)
        k_prefetch_corners(m, value, scale, f + i);
    for (int64_t i = 0; i < K_BATCH && !has_lengths; ++i) {
        const loxo_index *corner = &m->halfedge_vertex[3 * (f + (i < n ? i : n - 1))];
        for (int k = 0; k < 3; ++k)
            k_gather_corner(b, i, k, k_position(m, corner[k]), value[corner[k]], scale[corner[k]]);
    }
    for (int64_t i = 0; i < K_BATCH && has_lengths; ++i) {
        const int64_t face = f + (i < n ? i : n - 1);
        const loxo_index *corner = &m->halfedge_vertex[3 * face];
        loxo_vec3 p[3];
        k_face_corners(m, face, p);
        for (int k = 0; k < 3; ++k)
            k_gather_corner(b, i, k, p[k], value[corner[k]], scale[corner[k]]);
    }
}

/* 2^(a - b) for a <= b, 0 where it is out of range. */
static inline double k_octaves_down(int32_t a, int32_t b)
{
    const uint32_t down = (uint32_t)b - (uint32_t)a;
    return k_power_of_two(down < 1100 ? -(int64_t)down : -1100);
}

/* u at the corners of face i of the batch, in units of the largest scale; all zero where a corner was not reached. */
static inline void k_batch_heat(const k_face_batch *b, int i, double u[3])
{
    const int32_t s0 = b->scale[0][i], s1 = b->scale[1][i], s2 = b->scale[2][i];
    const int32_t high_01 = s0 > s1 ? s0 : s1, high = high_01 > s2 ? high_01 : s2;
    const int32_t low_01 = s0 < s1 ? s0 : s1, low = low_01 < s2 ? low_01 : s2;
    const double unit = low == K_NOT_REACHED ? 0.0 : 1.0;
    u[0] = unit * b->value[0][i] * k_octaves_down(s0, high);
    u[1] = unit * b->value[1][i] * k_octaves_down(s1, high);
    u[2] = unit * b->value[2][i] * k_octaves_down(s2, high);
}

static inline loxo_vec3 k_batch_edge(const k_face_batch *b, int i, int from, int to)
{
    return (loxo_vec3){b->x[to][i] - b->x[from][i], b->y[to][i] - b->y[from][i], b->z[to][i] - b->z[from][i]};
}

/* h . e of the three half-edges of face i; returns its area. */
static inline double k_batch_differences(const k_face_batch *b, int i, double difference[3])
{
    const loxo_vec3 ab = k_batch_edge(b, i, 0, 1), ac = k_batch_edge(b, i, 0, 2), n = v3_cross(ab, ac);
    double u[3];
    k_batch_heat(b, i, u);
    const double factor = k_inverse_slope(ab, ac, n, u[1] - u[0], u[2] - u[0]);
    difference[0] = factor * (u[0] - u[1]);
    difference[1] = factor * (u[1] - u[2]);
    difference[2] = factor * (u[2] - u[0]);
    return 0.5 * v3_norm(n);
}

#endif
