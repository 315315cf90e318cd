/* SPDX-License-Identifier: MIT
 * Directions in which the heat of a solve falls: the fast form of gradient_kernel.h, on a mesh's own arrays. */
#ifndef LOXO_KERNEL_DESCENT_KERNEL_H
#define LOXO_KERNEL_DESCENT_KERNEL_H

#include "kernel/scaled.h"
#include "kernel/vec3.h"

/* Unit vector along minus the gradient of the linear function with values u at corners a, b, c, eq. (3); zero where there
 * is none. */
static inline loxo_vec3 k_triangle_descent(loxo_vec3 a, loxo_vec3 b, loxo_vec3 c, const double u[3])
{
    const loxo_vec3 ab = v3_sub(b, a), ac = v3_sub(c, a);
    const loxo_vec3 w = v3_sub(v3_scale(u[1] - u[0], ac), v3_scale(u[2] - u[0], ab));
    const loxo_vec3 d = v3_cross(v3_cross(ab, ac), w);
    const double length = v3_norm(d);
    return v3_scale(length > 0.0 && length < HUGE_VAL ? 1.0 / length : 0.0, d);
}

/* The same for a face with these corners and heat kept as value[v] * 2^scale[v]; zero where a corner was not reached, its
 * scale being K_NOT_REACHED. */
#define K_NOT_REACHED INT32_MIN

static inline loxo_vec3 k_heat_descent(const loxo_mesh_view *m, const loxo_index *corner, const double *value,
                                       const int32_t *scale)
{
    const int32_t s0 = scale[corner[0]], s1 = scale[corner[1]], s2 = scale[corner[2]];
    if (s0 == K_NOT_REACHED || s1 == K_NOT_REACHED || s2 == K_NOT_REACHED) return (loxo_vec3){0.0, 0.0, 0.0};
    int32_t s = s0 > s1 ? s0 : s1;
    s = s > s2 ? s : s2;
    const double u[3] = {value[corner[0]] * k_power_of_two((int64_t)s0 - s),
                         value[corner[1]] * k_power_of_two((int64_t)s1 - s),
                         value[corner[2]] * k_power_of_two((int64_t)s2 - s)};
    return k_triangle_descent(k_position(m, corner[0]), k_position(m, corner[1]), k_position(m, corner[2]), u);
}

#endif
