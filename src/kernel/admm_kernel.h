/* SPDX-License-Identifier: MIT
 * ADMM for the closest integrable field, reduced to what its state is.
 *
 * Both problems of the paper have the form: minimise a sum of squares over x, subject to linear conditions c(x) = 0, each
 * on its own copies of a few components, in which the condition's coefficients have norm 1 after scaling. Eliminate the
 * copies w and the scaled multipliers y from the paper's three updates; what is left per condition is one number a:
 *     r = a + 2 c(x),   a <- a + c(x),   a = -c(x) before the first iteration,
 * and the x-update sees of a condition only -r times its coefficients. In the edge-based problem the x-update is the
 * same contraction theta = mu / (1 + mu) on every edge, so that x stays of the form
 *     x = hbar + (potential of the face on its left - potential on its right) / 2      (whole, not half, at a boundary)
 * and the state is two numbers a face, a and the potential, where the paper keeps six numbers a face and two an edge.
 *
 * In the face-based problem x is a gradient g in the plane of each face. Its products with the face's half-edges tell it:
 * x_0 and x_1 with the first two, and with the third x_2 = -(x_0 + x_1), since the three sum to nothing. The condition
 * across half-edge h and its twin t is c = -(x_h + x_t) = 0. So what a condition needs of the past is a sum of its two
 * faces' own: with
 *     push = x' + x'' + ... + (present x twice),   push <- push - x + 2 (new x),   push = x before the first iteration,
 * r = -(push_h + push_t). The state is x and push, and of its neighbours a face reads nothing but push and area. */
#ifndef LOXO_KERNEL_ADMM_KERNEL_H
#define LOXO_KERNEL_ADMM_KERNEL_H

#include "kernel/vec3.h"

/* So many faces side by side, as in descent_kernel.h; more of them cost more in the end, when the data come from
 * memory. */
#define K_ADMM_BATCH 16

/* Sum around face f of what the potentials add to its three differences: d x - d hbar. Beyond a boundary stands minus the
 * own potential. */
static inline double k_potential_closure(const loxo_index *twin, double own, const double *potential)
{
    const loxo_index a = twin[0], b = twin[1], c = twin[2];
    if ((a | b | c) >= 0)
        return 0.5 *
               ((own - potential[k_face_of(a)]) + (own - potential[k_face_of(b)]) + (own - potential[k_face_of(c)]));
    return 0.5 * ((own - (a < 0 ? -own : potential[k_face_of(a)])) + (own - (b < 0 ? -own : potential[k_face_of(b)])) +
                  (own - (c < 0 ? -own : potential[k_face_of(c)])));
}

/* One iteration of (21), (22) on faces begin..end-1: closure holds d hbar, a the numbers above. */
static inline void k_admm_edge(const loxo_mesh_view *m, double theta, int64_t begin, int64_t end,
                               const double *restrict closure, double *restrict a, const double *restrict potential,
                               double *restrict potential_next)
{
    const loxo_index *restrict twin = m->halfedge_twin;
    for (int64_t line = begin; line < end; line += 8) {
        const int64_t line_end = line + 8 < end ? line + 8 : end;
        if (line + K_AHEAD < m->n_faces) {
            const loxo_index *next_twin = &twin[3 * (line + K_NEXT)];
            __builtin_prefetch(&potential[line + K_AHEAD], 0, 2);
            __builtin_prefetch(next_twin, 0, 2);
            __builtin_prefetch(next_twin + 12, 0, 2);
            __builtin_prefetch(&closure[line + K_NEXT], 0, 2);
            __builtin_prefetch(&a[line + K_NEXT], 1, 2);
            __builtin_prefetch(&potential_next[line + K_NEXT], 1, 2);
        }
        for (int64_t f = line; f < line_end; ++f) {
            const double own = potential[f];
            const double c = closure[f] + k_potential_closure(&twin[3 * f], own, potential);
            const double r = a[f] + 2.0 * c;
            a[f] += c;
            potential_next[f] = theta * (own - r * (1.0 / 3.0));
        }
    }
}

/* Of what sums to nothing around a face, the third from the first two. */
static inline double k_third(double first, double second) { return -(first + second); }

/* What K_ADMM_BATCH faces read of their neighbours, number by number; own numbers where there is none. */
typedef struct k_admm_others {
    double has_twin[3][K_ADMM_BATCH], push[3][K_ADMM_BATCH], area[3][K_ADMM_BATCH];
} k_admm_others;

/* Of faces f..f+n-1, n <= K_ADMM_BATCH. */
static inline void k_gather_others(const loxo_mesh_view *m, int64_t f, int64_t n, const double *restrict area,
                                   const double *restrict push, k_admm_others *restrict others)
{
    const int64_t ahead = f + K_AHEAD / 2; /* three numbers a face: the look-ups reach further in bytes */
    if (ahead + n <= m->n_faces) {
        for (int64_t i = 0; i < 3 * n; i += 8)
            __builtin_prefetch(&push[3 * ahead + i], 0, 2);
        for (int64_t i = 0; i < n; i += 8)
            __builtin_prefetch(&area[ahead + i], 0, 2);
    }
    for (int64_t i = 0; i < n; ++i)
        for (int k = 0; k < 3; ++k) {
            const loxo_index twin = m->halfedge_twin[3 * (f + i) + k];
            const int64_t t = twin < 0 ? 3 * (f + i) + k : twin;
            others->has_twin[k][i] = twin < 0 ? 0.0 : 1.0;
            others->push[k][i] = push[t];
            others->area[k][i] = area[k_face_of((loxo_index)t)];
        }
}

/* The factor q of the copies' pull on a face across its half-edge k: A_other / (A_own + A_other) r / |e|^2. */
static inline double k_admm_pull(const k_admm_others *others, int64_t i, int k, double area, double square, double push)
{
    const double r = -(push + others->push[k][i]), divisor = (area + others->area[k][i]) * square;
    return divisor > 0.0 ? others->has_twin[k][i] * (others->area[k][i] * r / divisor) : 0.0;
}

/* (17) in the face's plane: x of a face after the iteration. The pulls sum to q_0 e_0 + q_1 e_1 + q_2 e_2, which is
 * (q_0 - q_2) e_0 + (q_1 - q_2) e_1. */
static inline void k_admm_face_step(const k_admm_others *others, int64_t i, double penalty, double area,
                                    const double square[3], const double target[2], const double x[2],
                                    const double push[3], double next[2])
{
    const double q2 = k_admm_pull(others, i, 2, area, square[2], push[2]);
    const double q0 = k_admm_pull(others, i, 0, area, square[0], push[0]) - q2;
    const double q1 = k_admm_pull(others, i, 1, area, square[1], push[1]) - q2;
    const double e00 = square[0], e11 = square[1], e01 = 0.5 * (square[2] - e00 - e11);
    const double weight = penalty * (others->has_twin[0][i] + others->has_twin[1][i] + others->has_twin[2][i]);
    const double inverse = 1.0 / (2.0 + weight);
    next[0] = inverse * (2.0 * target[0] + weight * x[0] + penalty * (q0 * e00 + q1 * e01));
    next[1] = inverse * (2.0 * target[1] + weight * x[1] + penalty * (q0 * e01 + q1 * e11));
}

/* One iteration of the face-based problem (10), (11) on faces begin..end-1. area [n_faces]; square [n_faces] of the
 * half-edges' lengths; target [n_faces] h, as x is kept; x_next may be x; push [3 n_faces]. */
static inline void k_admm_face(const loxo_mesh_view *m, double penalty, int64_t begin, int64_t end,
                               const double *restrict area, const double (*restrict square)[3],
                               const double (*target)[2], const double (*x)[2], double (*x_next)[2],
                               const double *restrict push, double *restrict push_next)
{
    k_admm_others others;
    double next[2][K_ADMM_BATCH], pushed[2][K_ADMM_BATCH];
    for (int64_t f = begin; f < end; f += K_ADMM_BATCH) {
        const int64_t n = end - f < K_ADMM_BATCH ? end - f : K_ADMM_BATCH;
        k_gather_others(m, f, n, area, push, &others);
        for (int64_t i = 0; i < n; ++i) {
            const double *own_push = &push[3 * (f + i)];
            double own[2];
            k_admm_face_step(&others, i, penalty, area[f + i], square[f + i], target[f + i], x[f + i], own_push, own);
            for (int k = 0; k < 2; ++k) {
                next[k][i] = own[k];
                pushed[k][i] = own_push[k] - x[f + i][k] + 2.0 * own[k];
            }
        }
        for (int64_t i = 0; i < n; ++i) {
            x_next[f + i][0] = next[0][i];
            x_next[f + i][1] = next[1][i];
            push_next[3 * (f + i)] = pushed[0][i];
            push_next[3 * (f + i) + 1] = pushed[1][i];
            push_next[3 * (f + i) + 2] = k_third(pushed[0][i], pushed[1][i]);
        }
    }
}

#endif
