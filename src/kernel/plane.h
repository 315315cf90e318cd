/* SPDX-License-Identifier: MIT
 * Points of the plane in which faces are laid flat. */
#ifndef LOXO_KERNEL_PLANE_H
#define LOXO_KERNEL_PLANE_H

#include <math.h>

typedef struct k_spot {
    double x, y;
} k_spot;

static inline k_spot spot_sub(k_spot a, k_spot b) { return (k_spot){a.x - b.x, a.y - b.y}; }

static inline double spot_cross(k_spot a, k_spot b) { return a.x * b.y - a.y * b.x; }

static inline double spot_dot(k_spot a, k_spot b) { return a.x * b.x + a.y * b.y; }

static inline double spot_norm(k_spot a) { return sqrt(a.x * a.x + a.y * a.y); }

/* Positive: c lies on the left of the line from a to b. */
static inline double spot_turn(k_spot a, k_spot b, k_spot c) { return spot_cross(spot_sub(b, a), spot_sub(c, b)); }

/* Between two directions, 0 to pi. */
static inline double spot_angle(k_spot a, k_spot b) { return atan2(fabs(spot_cross(a, b)), spot_dot(a, b)); }

/* So far along the line from a to b, whose length is known, and so far to its left. */
static inline k_spot spot_beside(k_spot a, k_spot b, double length, double along, double left)
{
    const double ux = length > 0.0 ? (b.x - a.x) / length : 1.0, uy = length > 0.0 ? (b.y - a.y) / length : 0.0;
    return (k_spot){a.x + along * ux - left * uy, a.y + along * uy + left * ux};
}

/* Where the straight way from p to q goes through a gate from a, on its right, to b, on its left; as a share, 0 to 1. An end that
 * rounding puts on the wrong side is where the way touches. Of a gate that lies almost along the way any place may come out: it is
 * kept between `along`, how far the way has come in units of |q - p|, squared, and q. along then tells of this place. */
static inline double spot_gate(k_spot p, k_spot q, k_spot a, k_spot b, double *along)
{
    const k_spot way = spot_sub(q, p), to_a = spot_sub(a, p), to_b = spot_sub(b, p);
    const double right = spot_cross(way, to_a), left = spot_cross(way, to_b), most = spot_dot(way, way);
    const double from = spot_dot(way, to_a), step = spot_dot(way, to_b) - from;
    double t = left > 0.0 ? 0.0 : right < 0.0 || step < 0.0 ? 1.0 : 0.0;
    if (right < 0.0 && left > 0.0) t = right / (right - left);
    if (fabs(step) > left - right) {
        const double at = fmin(fmax(from + t * step, *along), most);
        t = fmin(fmax((at - from) / step, 0.0), 1.0);
    }
    *along = fmax(*along, from + t * step);
    return t;
}

#endif
