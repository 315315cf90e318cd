/* SPDX-License-Identifier: MIT
 * Gradient of a piecewise linear function on one triangle, and its direction for heat of any magnitude. */
#ifndef LOXO_KERNEL_GRADIENT_KERNEL_H
#define LOXO_KERNEL_GRADIENT_KERNEL_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* p holds the corners p0, p1, p2, three coordinates each.
 *
 * normal = (p1 - p0) x (p2 - p0), twice the area long, and normal x w with
 * w = (u1 - u0) (p2 - p0) - (u2 - u0) (p1 - p0), so that gradient = -(normal x w) / |normal|^2. */
static inline void k_gradient_parts(const double p[9], const double u[3], double normal[3], double normal_w[3])
{
    double ab[3], ac[3], w[3];
    for (int k = 0; k < 3; ++k) {
        ab[k] = p[3 + k] - p[k], ac[k] = p[6 + k] - p[k];
        w[k] = (u[1] - u[0]) * ac[k] - (u[2] - u[0]) * ab[k];
    }
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        normal[k] = ab[i] * ac[j] - ab[j] * ac[i];
    }
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        normal_w[k] = normal[i] * w[j] - normal[j] * w[i];
    }
}

/* gradient = 1 / (2 area) sum_i u_i (unit normal x edge_i), edge_i opposite corner i; returns twice the area. A triangle
 * without area has gradient 0.
 * source  Crane, Weischedel, Wardetzky 2013, Geodesics in Heat, section 3.2.1 */
static inline double k_triangle_gradient(const double p[9], const double u[3], double gradient[3])
{
    double normal[3], normal_w[3];
    k_gradient_parts(p, u, normal, normal_w);
    const double square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
    for (int k = 0; k < 3; ++k)
        gradient[k] = square > 0.0 ? -normal_w[k] / square : 0.0;
    return sqrt(square);
}

static inline double k_triangle_area(const double p[9])
{
    static const double none[3] = {0.0, 0.0, 0.0};
    double gradient[3];
    return 0.5 * k_triangle_gradient(p, none, gradient);
}

/* h = -grad u / |grad u|, u_i = value_i * 2^scale_i: the unit direction in which heat falls. false, and h = 0, where
 * there is none: values that are equal or not finite, or a triangle without area.
 * source  Tao et al. 2021, eq. (8); Crane et al. 2013, Algorithm 1 step II */
static inline bool k_heat_direction(const double p[9], const double value[3], const int32_t scale[3], double h[3])
{
    double u[3] = {0.0, 0.0, 0.0}, normal[3];
    int exponent[3];
    int64_t largest = INT64_MIN;
    h[0] = h[1] = h[2] = 0.0;
    for (int k = 0; k < 3; ++k) {
        if (!isfinite(value[k])) return false;
        u[k] = frexp(value[k], &exponent[k]);
        if (u[k] != 0.0 && largest < exponent[k] + (int64_t)scale[k]) largest = exponent[k] + (int64_t)scale[k];
    }
    for (int k = 0; k < 3 && largest != INT64_MIN; ++k) { /* the largest becomes 1/2 to 1; no direction changes */
        const int64_t shift = exponent[k] + (int64_t)scale[k] - largest;
        u[k] = u[k] != 0.0 ? ldexp(u[k], (int)(shift < -2000 ? -2000 : shift)) : 0.0;
    }
    k_gradient_parts(p, u, normal, h);
    /* Scaled by the largest first: products of short edges and small differences may square to nothing. */
    const double size = fmax(fabs(h[0]), fmax(fabs(h[1]), fabs(h[2])));
    if (!(size > 0.0 && size <= 1.7e308)) {
        h[0] = h[1] = h[2] = 0.0;
        return false;
    }
    for (int k = 0; k < 3; ++k)
        h[k] /= size;
    const double length = sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
    for (int k = 0; k < 3; ++k)
        h[k] /= length;
    return true;
}

#endif
