/* SPDX-License-Identifier: MIT
 * Points of the sphere in spherical triangles.
 *
 * q = (w_a a + w_b b + w_c c) / det(a, b, c) with w_a = det(q, b, c), w_b = det(q, c, a), w_c = det(q, a, b) (Cramer). Where the corners run
 * counter-clockwise, seen from outside, the determinant is positive, and q lies in the cone over the triangle when no w is negative. Where they
 * run the other way that holds for -q: the sum must point along q. */
#ifndef LOXO_KERNEL_LOCATE_KERNEL_H
#define LOXO_KERNEL_LOCATE_KERNEL_H

#include "kernel/vec3.h"

#include <stdbool.h>

/* det(q, b, c) = q . (b x c) = q . ((b - q) x (c - q)): by differences it keeps its sign for triangles of any size near q, and exchanging b
 * and c changes nothing but the sign, to the bit: of the two faces at an edge one has a point beside it. */
static inline double k_cone_side(loxo_vec3 q, loxo_vec3 b, loxo_vec3 c)
{
    return v3_dot(q, v3_cross(v3_sub(b, q), v3_sub(c, q)));
}

/* Whether q lies in the cone over a triangle that looks outward, and its weights there, which sum to 1. */
static inline bool k_cone_weights(loxo_vec3 q, loxo_vec3 a, loxo_vec3 b, loxo_vec3 c, double weight[3])
{
    const double w_a = k_cone_side(q, b, c), w_b = k_cone_side(q, c, a), w_c = k_cone_side(q, a, b);
    const double sum = w_a + w_b + w_c;
    if (!(w_a >= 0.0 && w_b >= 0.0 && w_c >= 0.0 && sum > 0.0)) return false;
    if (!(v3_dot(q, v3_axpy(v3_axpy(v3_scale(w_a, a), w_b, b), w_c, c)) > 0.0)) return false;
    weight[0] = w_a / sum;
    weight[1] = w_b / sum;
    weight[2] = w_c / sum;
    return true;
}

/* How far a point of the spherical triangle can be from its flat triangle: the flat one lies in a disk around its vertices of radius
 * r <= l / sqrt(3), l the longest edge (Jung), whose plane is sqrt(1 - r^2) from the centre or more; so is every point p of it, and p / |p| is
 * 1 - |p| away from it. */
static inline double k_cone_bulge(loxo_vec3 a, loxo_vec3 b, loxo_vec3 c)
{
    const loxo_vec3 ab = v3_sub(b, a), bc = v3_sub(c, b), ca = v3_sub(a, c);
    const double square = fmax(v3_dot(ab, ab), fmax(v3_dot(bc, bc), v3_dot(ca, ca))) / 3.0;
    if (!(square < 1.0)) return 1.0;
    return square / (1.0 + sqrt(1.0 - square)); /* 1 - sqrt(1 - r^2) */
}

#endif
