/* SPDX-License-Identifier: MIT
 * The shape of one face, by nothing but the lengths of its edges: the same for straight triangles between positions and
 * for the faces of an intrinsic triangulation. */
#ifndef LOXO_KERNEL_LAYOUT_KERNEL_H
#define LOXO_KERNEL_LAYOUT_KERNEL_H

#include "kernel/vec3.h"

/* Lengths of half-edges 3 f, 3 f + 1, 3 f + 2; those of twins have the same bits. */
static inline void k_face_lengths(const loxo_mesh_view *m, int64_t f, double length[3])
{
    if (m->halfedge_length != NULL) {
        for (int k = 0; k < 3; ++k)
            length[k] = m->halfedge_length[3 * f + k];
        return;
    }
    const loxo_index *v = &m->halfedge_vertex[3 * f];
    const loxo_vec3 a = k_position(m, v[0]), b = k_position(m, v[1]), c = k_position(m, v[2]);
    length[0] = v3_norm(v3_sub(b, a));
    length[1] = v3_norm(v3_sub(c, b));
    length[2] = v3_norm(v3_sub(a, c));
}

/* A face unfolded into the plane: corner 0 at the origin, corner 1 at (x1, 0), corner 2 at (x2, y2), y2 >= 0. */
typedef struct k_layout {
    double x1, x2, y2;
} k_layout;

/* From the lengths of its half-edges. Heights from Kahan's form of Heron's formula, which loses no digits on needles:
 * 16 area^2 = (a + (b + c)) (c - (a - b)) (c + (a - b)) (a + (b - c)), a >= b >= c. Lengths that break the triangle
 * inequality by rounding give a flat face. */
static inline k_layout k_layout_of(const double length[3])
{
    double a = length[0], b = length[1], c = length[2], swap;
    if (a < b) swap = a, a = b, b = swap;
    if (b < c) swap = b, b = c, c = swap;
    if (a < b) swap = a, a = b, b = swap;
    const double product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    const double base = length[0], left = length[2], right = length[1];
    if (!(base > 0.0)) return (k_layout){0.0, left, 0.0};
    return (k_layout){base, 0.5 * (base + (left - right) * (left + right) / base),
                      product > 0.0 ? 0.5 * sqrt(product) / base : 0.0};
}

#endif
