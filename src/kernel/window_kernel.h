/* SPDX-License-Identifier: MIT
 * Windows: the straight ways from one source through one interval of an edge, unfolded into the plane of the face that
 * they enter. Lengths of polyhedral geodesics are distances to such sources (Mitchell, Mount, Papadimitriou 1987).
 *
 * Frame of a half-edge: it runs from 0 to its length on the x axis, the face that it belongs to lies above. The source
 * lies below, at (x, -y), y >= 0. */
#ifndef LOXO_KERNEL_WINDOW_KERNEL_H
#define LOXO_KERNEL_WINDOW_KERNEL_H

#include "kernel/layout_kernel.h"

typedef struct k_window {
    double begin, end; /* interval of the edge, 0 <= begin <= end <= length */
    double x, y;       /* the source is at (x, -y) */
    double offset;     /* distance of that source */
} k_window;

/* Length of the way to the point at (px, py), on the edge or above it. */
static inline double k_window_way(const k_window *w, double px, double py)
{
    const double dx = px - w->x, dy = py + w->y;
    return w->offset + sqrt(dx * dx + dy * dy);
}

/* The shortest of its ways to its interval. */
static inline double k_window_least_way(const k_window *w)
{
    return k_window_way(w, w->x < w->begin ? w->begin : w->x > w->end ? w->end : w->x, 0.0);
}

/* What a rounding error can make of a bound: ways are cut off only when they are longer by more than this. */
#define K_WINDOW_SLACK 1e-12

/* Cuts off the ways that are longer than one by the edge's start, whose distance is at most bound: x with
 * offset + |S - x| > bound + x. The difference of the two sides falls with x, so they are those below
 *
 *     x* = (|S|^2 - k^2) / (2 (k + S_x)),   k = bound - offset,   or all where k + S_x <= 0.
 *
 * bound comes with its slack. */
static inline void k_window_cut_start(k_window *w, double bound)
{
    const double k = bound - w->offset, slope = 2.0 * (k + w->x), rest = w->x * w->x + w->y * w->y - k * k;
    if (!(slope > 0.0)) {
        w->begin = HUGE_VAL;
    } else if (rest > w->begin * slope) {
        w->begin = rest / slope;
    }
}

/* The same from the edge's end. */
static inline void k_window_cut_end(k_window *w, double length, double bound)
{
    const double x = length - w->x, k = bound - w->offset, slope = 2.0 * (k + x), rest = x * x + w->y * w->y - k * k;
    if (!(slope > 0.0)) {
        w->end = -HUGE_VAL;
    } else if (rest > (length - w->end) * slope) {
        w->end = length - rest / slope;
    }
}

/* Where the way through x of the base meets a side that leaves the base's start in direction (ux, uy), uy >= 0; how far
 * along the side. Both sources and sides may lie on the base's line. */
static inline double k_window_meet(double x, double source_x, double source_y, double ux, double uy, double length)
{
    const double across = source_y * ux - (x - source_x) * uy, along = x * source_y;
    if (!(along > 0.0)) return 0.0;
    return along < length * across ? along / across : length;
}

#endif
