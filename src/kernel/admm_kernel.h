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
 * and the state is two numbers a face, a and the potential, where the paper keeps six numbers a face and two an edge. */
#ifndef LOXO_KERNEL_ADMM_KERNEL_H
#define LOXO_KERNEL_ADMM_KERNEL_H

#include "kernel/vec3.h"

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
        if (line + K_AHEAD < m->n_faces) __builtin_prefetch(&potential[line + K_AHEAD], 0, 2);
        for (int64_t f = line; f < line_end; ++f) {
            const double own = potential[f];
            const double c = closure[f] + k_potential_closure(&twin[3 * f], own, potential);
            const double r = a[f] + 2.0 * c;
            a[f] += c;
            potential_next[f] = theta * (own - r * (1.0 / 3.0));
        }
    }
}

/* One iteration of the face-based problem (10), (11) on faces begin..end-1. area [n_faces]; jump [3 n_faces] the numbers a
 * of the edge conditions, kept on both sides, in units of the edge's length. */
static inline void k_admm_face(const loxo_mesh_view *m, double penalty, bool is_first, int64_t begin, int64_t end,
                               const double *restrict area, const double (*restrict target)[3],
                               const double (*restrict gradient)[3], double (*restrict gradient_next)[3],
                               double *restrict jump)
{
    for (int64_t f = begin; f < end; ++f) {
        const loxo_index *corner = &m->halfedge_vertex[3 * f], *twin = &m->halfedge_twin[3 * f];
        const loxo_vec3 g = v3_load(gradient[f]), h = v3_load(target[f]);
        loxo_vec3 p[3], sum = {0.0, 0.0, 0.0};
        double n_copies = 0.0;
        for (int c = 0; c < 3; ++c)
            p[c] = k_position(m, corner[c]);
        for (int c = 0; c < 3; ++c) {
            if (twin[c] < 0) continue;
            const int64_t other = twin[c] / 3;
            const loxo_vec3 e = v3_sub(p[c == 2 ? 0 : c + 1], p[c]);
            const double ee = v3_dot(e, e), both = area[f] + area[other];
            const double c_e = v3_dot(e, v3_sub(v3_load(gradient[other]), g));
            const double r = is_first ? c_e : jump[3 * f + c] + 2.0 * c_e;
            jump[3 * f + c] = is_first ? 0.0 : jump[3 * f + c] + c_e;
            n_copies += 1.0;
            if (ee > 0.0 && both > 0.0) sum = v3_axpy(sum, area[other] / both * r / ee, e);
        }
        const double weight = penalty * n_copies, inverse = 1.0 / (2.0 + weight);
        loxo_vec3 next = v3_scale(2.0, h);
        next = v3_axpy(next, weight, g);
        next = v3_axpy(next, penalty, sum);
        v3_store(gradient_next[f], v3_scale(inverse, next));
    }
}

#endif
