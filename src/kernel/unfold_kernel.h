/* SPDX-License-Identifier: MIT
 * Distance across one triangle laid flat: where a straight line from the source would arrive that is as far from two of
 * its corners as they are known to be. */
#ifndef LOXO_KERNEL_UNFOLD_KERNEL_H
#define LOXO_KERNEL_UNFOLD_KERNEL_H

#include "kernel/layout_kernel.h"

#include <math.h>

/* Corners a, b, c; base = |ab|, left = |ac|, right = |bc|; the source is at distance at_a from a and at_b from b, on the
 * side of ab away from c. With a at the origin, b on the x axis and c above it,
 *   c = ((base^2 + left^2 - right^2) / (2 base), y),  source = ((base^2 + at_a^2 - at_b^2) / (2 base), -s),
 * distances that no point has both of (rounding, a field that is only nearly a distance) put it on the axis. reach: how
 * far outside ab, in parts of it, the line may cross the axis; beyond, HUGE_VAL. */
static inline double k_unfolded_distance(double base, double left, double right, double at_a, double at_b, double reach)
{
    if (!(base > 0.0)) return HUGE_VAL;
    const double cx = 0.5 * (base + (left - right) * ((left + right) / base));
    const double sx = 0.5 * (base + (at_a - at_b) * ((at_a + at_b) / base));
    const double cy2 = (left - cx) * (left + cx), sy2 = (at_a - sx) * (at_a + sx);
    const double cy = cy2 > 0.0 ? sqrt(cy2) : 0.0, sy = sy2 > 0.0 ? sqrt(sy2) : 0.0, height = cy + sy;
    const double crossing = height > 0.0 ? sx + (cx - sx) * (sy / height) : cx;
    if (crossing < -reach * base || crossing > (1.0 + reach) * base) return HUGE_VAL;
    return sqrt((cx - sx) * (cx - sx) + height * height);
}

/* From the point of barycentric weights to a corner of a face laid flat. */
static inline double k_distance_to_corner(k_layout face, const double weight[3], int corner)
{
    const double x = weight[1] * face.x1 + weight[2] * face.x2, y = weight[2] * face.y2;
    const double dx = x - (corner == 0 ? 0.0 : corner == 1 ? face.x1 : face.x2), dy = y - (corner == 2 ? face.y2 : 0.0);
    return sqrt(dx * dx + dy * dy);
}

#endif
