/* SPDX-License-Identifier: MIT
 * The point of a triangle nearest to a point of space. */
#ifndef LOXO_KERNEL_CLOSEST_KERNEL_H
#define LOXO_KERNEL_CLOSEST_KERNEL_H

#include "kernel/scaled.h"
#include "kernel/vec3.h"

/* A power of two that brings the larger of two vectors to a length near 1, by which products neither overflow nor underflow; to
 * multiply by it rounds nothing. */
static inline double k_closest_unit(loxo_vec3 u, loxo_vec3 v)
{
    const double of_u = fmax(fmax(fabs(u.x), fabs(u.y)), fabs(u.z)), of_v = fmax(fmax(fabs(v.x), fabs(v.y)), fabs(v.z));
    const int32_t exponent = k_exponent(fmax(of_u, of_v));
    return k_power_of_two(exponent < 1022 ? -(int64_t)exponent : -1022);
}

/* Of segment a b: t with nearest = a + t (b - a), in 0..1; 0 where it has no length. */
static inline double k_closest_on_segment(loxo_vec3 p, loxo_vec3 a, loxo_vec3 b)
{
    const loxo_vec3 ab = v3_sub(b, a), unit = v3_scale(k_closest_unit(ab, ab), ab);
    const double along = v3_dot(v3_sub(p, a), unit), square = v3_dot(ab, unit);
    if (!(along > 0.0)) return 0.0;
    return along < square ? along / square : 1.0;
}

/* Squared distance from p to triangle a b c, and the nearest point's barycentric weights. The foot of the perpendicular
 * counts where it lies inside: its weights are the areas of the triangles that it makes with the edges, seen along the
 * normal n = ab x ac: w_c = n . (ab x ap) / |n|^2 and so on. Else the nearest point is on an edge: the nearest of three. The
 * triangle is first brought to a size near 1: |n|^2 is the fourth power of it. */
static inline double k_closest_in_triangle(loxo_vec3 p, loxo_vec3 a, loxo_vec3 b, loxo_vec3 c, double weight[3])
{
    const double unit = k_closest_unit(v3_sub(b, a), v3_sub(c, a));
    const loxo_vec3 ab = v3_scale(unit, v3_sub(b, a)), ac = v3_scale(unit, v3_sub(c, a)), ap = v3_sub(p, a);
    const loxo_vec3 n = v3_cross(ab, ac), away = v3_scale(unit, ap);
    const double nn = v3_dot(n, n);
    const double w_c = v3_dot(n, v3_cross(ab, away)), w_b = v3_dot(n, v3_cross(away, ac)), w_a = nn - w_b - w_c;
    if (nn > 0.0 && w_a >= 0.0 && w_b >= 0.0 && w_c >= 0.0) {
        const double height = v3_dot(n, ap);
        weight[0] = w_a / nn;
        weight[1] = w_b / nn;
        weight[2] = w_c / nn;
        return height * (height / nn);
    }
    const loxo_vec3 corner[3] = {a, b, c};
    double best = HUGE_VAL;
    for (int k = 0; k < 3; ++k) {
        const int l = k == 2 ? 0 : k + 1;
        const double t = k_closest_on_segment(p, corner[k], corner[l]);
        const loxo_vec3 way = v3_sub(p, v3_axpy(corner[k], t, v3_sub(corner[l], corner[k])));
        const double square = v3_dot(way, way);
        if (!(square < best)) continue;
        best = square;
        weight[0] = weight[1] = weight[2] = 0.0;
        weight[l] = t;
        weight[k] = 1.0 - t;
    }
    return best;
}

#endif
