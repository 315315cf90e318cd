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

/* Where the segment from p to q crosses that from a to b, as a share of the latter when it does; of one without length, or
 * along the latter, where p is. */
static inline double spot_crossing(k_spot p, k_spot q, k_spot a, k_spot b)
{
    const k_spot pq = spot_sub(q, p), ab = spot_sub(b, a);
    const double from = spot_cross(pq, spot_sub(a, p)), to = spot_cross(pq, spot_sub(b, p)), square = spot_dot(ab, ab);
    if (from != to) return from / (from - to);
    return square > 0.0 ? spot_dot(spot_sub(p, a), ab) / square : 0.0;
}

#endif
