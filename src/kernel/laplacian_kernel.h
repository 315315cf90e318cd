/* SPDX-License-Identifier: MIT
 * The stiffness of one face by the lengths of its edges. */
#ifndef LOXO_KERNEL_LAPLACIAN_KERNEL_H
#define LOXO_KERNEL_LAPLACIAN_KERNEL_H

#include "kernel/layout_kernel.h"

/* Twice the area of a face counts in weights as at least this share of its longest edge squared: a face flatter than a
 * ten-millionth, the noise of float positions, is taken for one of that height. */
#define K_LEAST_FLATNESS 1e-7

/* weight[k] = cot(angle opposite half-edge k) / 2, so that the Dirichlet energy of a linear function on the face is
 * 1/2 sum_k weight[k] (difference along half-edge k)^2. Returns twice the area.
 *
 * By cosines: weight[k] = (l_i^2 + l_j^2 - l_k^2) / 8 A, the other two lengths l_i <= l_j, written as
 * l_i^2 + (l_j - l_k) (l_j + l_k), which loses no digits on needles. The numerators are products -e_i . e_j of edge
 * vectors, so the energy is 1/(8 A) times a sum of squares whatever stands for A: a bound from below on the area alone
 * leaves it positive semidefinite, with the same null space. With it weights are at most 1/4 / K_LEAST_FLATNESS in size.
 * A face without length weighs nothing.
 * source  Pinkall, Polthier 1993, Computing Discrete Minimal Surfaces and Their Conjugates, eq. for E_D */
static inline double k_face_weights(const double length[3], double weight[3])
{
    const double longest = fmax(length[0], fmax(length[1], length[2]));
    if (!(longest > 1e-290)) {
        weight[0] = weight[1] = weight[2] = 0.0;
        return 0.0;
    }
    /* In units of the longest edge, so that nothing overflows or vanishes. */
    const double l[3] = {length[0] / longest, length[1] / longest, length[2] / longest};
    const k_layout shape = k_layout_of(l);
    const double twice_area = shape.x1 * shape.y2, bounded = fmax(twice_area, K_LEAST_FLATNESS);
    for (int k = 0; k < 3; ++k) {
        const double a = l[(k + 1) % 3], b = l[(k + 2) % 3];
        const double low = fmin(a, b), high = fmax(a, b);
        const double twice_product = low * low + (high - l[k]) * (high + l[k]);
        weight[k] = 0.25 * twice_product / bounded;
    }
    return twice_area * longest * longest;
}

#endif
