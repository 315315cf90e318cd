/* SPDX-License-Identifier: MIT
 * Looks at a distance on faces: how far it rises along edges, and where its gradient has not length 1. */
#ifndef LOXO_KERNEL_CHECK_KERNEL_H
#define LOXO_KERNEL_CHECK_KERNEL_H

#include "kernel/layout_kernel.h"

/* So many faces at a time, number by number, as in descent_kernel.h. */
#define K_LOOKS 32
typedef struct k_looks {
    double x[3][K_LOOKS], y[3][K_LOOKS], z[3][K_LOOKS], distance[3][K_LOOKS]; /* by corner */
    double rise_square[3][K_LOOKS], edge_square[3][K_LOOKS];                  /* by edge, edge k from corner k */
    double area[K_LOOKS], area_off[K_LOOKS]; /* the second 0 where the gradient's length is within a tenth of 1 */
} k_looks;

/* |grad d|^2 = |w|^2 / |n|^2 with n = ab x ac, w = (d_a - d_b) ca + (d_a - d_c) ab. A face between sources has no direction. */
static inline void k_look(k_looks *b)
{
    for (int i = 0; i < K_LOOKS; ++i) {
        const loxo_vec3 ab = {b->x[1][i] - b->x[0][i], b->y[1][i] - b->y[0][i], b->z[1][i] - b->z[0][i]};
        const loxo_vec3 bc = {b->x[2][i] - b->x[1][i], b->y[2][i] - b->y[1][i], b->z[2][i] - b->z[1][i]};
        const loxo_vec3 ca = {b->x[0][i] - b->x[2][i], b->y[0][i] - b->y[2][i], b->z[0][i] - b->z[2][i]};
        const double d_a = b->distance[0][i], d_b = b->distance[1][i], d_c = b->distance[2][i];
        b->rise_square[0][i] = (d_b - d_a) * (d_b - d_a);
        b->rise_square[1][i] = (d_c - d_b) * (d_c - d_b);
        b->rise_square[2][i] = (d_a - d_c) * (d_a - d_c);
        b->edge_square[0][i] = v3_dot(ab, ab);
        b->edge_square[1][i] = v3_dot(bc, bc);
        b->edge_square[2][i] = v3_dot(ca, ca);
        const loxo_vec3 n = v3_cross(ab, ca), w = v3_axpy(v3_scale(d_a - d_b, ca), d_a - d_c, ab);
        const double nn = v3_dot(n, n), ww = v3_dot(w, w), area = 0.5 * sqrt(nn);
        const bool is_source = (d_a == 0.0) & (d_b == 0.0) & (d_c == 0.0);
        const bool is_one = (ww > 0.81 * nn) & (ww < 1.21 * nn);
        b->area[i] = area;
        b->area_off[i] = (is_one | is_source) ? 0.0 : area;
    }
}

#endif
