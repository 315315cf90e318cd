/* SPDX-License-Identifier: MIT
 * One axis of a plot: where a value stands along it, and its numbers. */
#ifndef LOXO_DRAW_PLOT_AXIS_H
#define LOXO_DRAW_PLOT_AXIS_H

#include "draw/ticks.h"

#include <loxo/draw.h>

typedef struct loxo_plot_tick {
    double place; /* 0 to 1 */
    bool is_major;
    char text[64], power[16]; /* the number, and what stands raised behind it; "" at ticks that are not major */
} loxo_plot_tick;

typedef struct loxo_plot_axis {
    bool is_log;
    double low, high;
    int shift; /* numbers leave 10^shift out */
    int n_ticks;
    loxo_plot_tick tick[LOXO_DRAW_MAX_LOG_TICKS];
} loxo_plot_axis;

/* An axis from low to high (low < high, both finite; above 0 when logarithmic) with about n numbers. */
void loxo_plot_axis_make(loxo_plot_axis *axis, loxo_plot_scale scale, double low, double high, double n);
/* 0 at the low end, 1 at the high one; NaN where the value has no place: not finite, or not positive on a logarithmic
 * scale. */
double loxo_plot_axis_place(const loxo_plot_axis *axis, double value);
/* Ends that show all values from low to high (low <= high), with some room. */
void loxo_plot_axis_ends(loxo_plot_scale scale, double *low, double *high);

#endif
