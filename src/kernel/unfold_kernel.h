/* SPDX-License-Identifier: MIT
 * Distance across one triangle laid flat: when a straight line from the source would arrive that is as far from two of
 * its corners as they are known to be. */
#ifndef LOXO_KERNEL_UNFOLD_KERNEL_H
#define LOXO_KERNEL_UNFOLD_KERNEL_H

#include "kernel/layout_kernel.h"

#include <math.h>

/* Corners a, b, c; base = |ab|, left = |ac|, right = |bc|; the source is at distance at_a from a and at_b from b, on the
 * side of ab away from c. With a at the origin, b on the x axis and c above it,
 *   c = ((base^2 + left^2 - right^2) / (2 base), y),  source = ((base^2 + at_a^2 - at_b^2) / (2 base), -s),
 * distances that no point has both of (rounding, a field that is only nearly a distance) put it on the axis. reach: how
 * far outside ab, in parts of it, the line may cross the axis beyond a and beyond b; farther out, HUGE_VAL. */
static inline double k_unfolded_distance(double base, double left, double right, double at_a, double at_b,
                                         double reach_a, double reach_b)
{
    if (!(base > 0.0)) return HUGE_VAL;
    const double cx = 0.5 * (base + (left - right) * ((left + right) / base));
    const double sx = 0.5 * (base + (at_a - at_b) * ((at_a + at_b) / base));
    const double cy2 = (left - cx) * (left + cx), sy2 = (at_a - sx) * (at_a + sx);
    const double cy = cy2 > 0.0 ? sqrt(cy2) : 0.0, sy = sy2 > 0.0 ? sqrt(sy2) : 0.0, height = cy + sy;
    const double crossing = height > 0.0 ? sx + (cx - sx) * (sy / height) : cx;
    if (crossing < -reach_a * base || crossing > (1.0 + reach_b) * base) return HUGE_VAL;
    return sqrt((cx - sx) * (cx - sx) + height * height);
}

/* Ways to several vertices at once: along edges, at + length, and across corners as k_unfolded_distance, whose formulas these
 * are, from squares of lengths and without a branch. Where the source would have to be nearer to both ends of the edge than they are
 * to each other, two fronts met there: half of what is missing is added, so that along the edges is shorter. */
#define K_CORNERS 256
typedef struct k_corners {
    int n_edges, n;
    double edge_at[K_CORNERS], edge_square[K_CORNERS], edge_arrival[K_CORNERS];
    double base[K_CORNERS], left[K_CORNERS], right[K_CORNERS]; /* squares of the lengths */
    double at_a[K_CORNERS], at_b[K_CORNERS], reach_a[K_CORNERS], reach_b[K_CORNERS];
    double arrival[K_CORNERS]; /* HUGE_VAL: none */
    uint8_t edge_owner[K_CORNERS], owner[K_CORNERS];
} k_corners;

static inline double k_unfold_corner(const k_corners *c, int i)
{
    const double base = sqrt(c->base[i]), inverse = 1.0 / base, a = c->at_a[i], b = c->at_b[i];
    const double cx = 0.5 * (base + (c->left[i] - c->right[i]) * inverse),
                 sx = 0.5 * (base + (a - b) * ((a + b) * inverse));
    const double cy2 = c->left[i] - cx * cx, sy2 = (a - sx) * (a + sx);
    const double cy = cy2 > 0.0 ? sqrt(cy2) : 0.0, sy = sy2 > 0.0 ? sqrt(sy2) : 0.0, height = cy + sy;
    const double crossing = height > 0.0 ? sx * cy + cx * sy : cx, share = height > 0.0 ? height : 1.0;
    const double from = -c->reach_a[i] * base * share, to = (1.0 + c->reach_b[i]) * base * share;
    const double missing = base - (a + b), dx = cx - sx;
    const double arrival = sqrt(dx * dx + height * height) + (missing > 0.0 ? 0.5 * missing : 0.0);
    const bool is_crossed = (base > 0.0) & (crossing >= from) & (crossing <= to); /* no branch: & */
    return is_crossed ? arrival : HUGE_VAL;
}

/* edge_arrival and arrival from the rest. */
static inline void k_unfold_corners(k_corners *c)
{
    for (int i = 0; i < c->n_edges; ++i)
        c->edge_arrival[i] = c->edge_at[i] + sqrt(c->edge_square[i]);
    for (int i = 0; i < c->n; ++i)
        c->arrival[i] = k_unfold_corner(c, i);
}

/* From the point of barycentric weights to a corner of a face laid flat. */
static inline double k_distance_to_corner(k_layout face, const double weight[3], int corner)
{
    const double x = weight[1] * face.x1 + weight[2] * face.x2, y = weight[2] * face.y2;
    const double dx = x - (corner == 0 ? 0.0 : corner == 1 ? face.x1 : face.x2), dy = y - (corner == 2 ? face.y2 : 0.0);
    return sqrt(dx * dx + dy * dy);
}

#endif
