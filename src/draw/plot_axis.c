/* SPDX-License-Identifier: MIT */
#include "draw/plot_axis.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

double loxo_plot_axis_place(const loxo_plot_axis *axis, double value)
{
    if (!isfinite(value)) return (double)NAN;
    if (axis->is_log) {
        if (!(value > 0.0)) return (double)NAN;
        return (log10(value) - log10(axis->low)) / (log10(axis->high) - log10(axis->low));
    }
    /* Halves: the difference of two finite values may overflow. */
    return (0.5 * value - 0.5 * axis->low) / (0.5 * axis->high - 0.5 * axis->low);
}

void loxo_plot_axis_ends(loxo_plot_scale scale, double *low, double *high)
{
    if (scale == LOXO_PLOT_LOG) {
        const double spread = log10(*high) - log10(*low);
        const double room = spread > 0.05 ? 0.04 * spread : 0.3; /* all alike: from a half to twice that */
        *low = fmin(fmax(pow(10.0, log10(*low) - room), DBL_MIN), 0.1 * DBL_MAX);
        *high = fmax(fmin(pow(10.0, log10(*high) + room), DBL_MAX), 10.0 * DBL_MIN);
        return;
    }
    const double spread = 0.5 * *high - 0.5 * *low, size = fmax(fabs(*low), fabs(*high));
    const double room = spread > 1e-9 * size ? 0.08 * spread : fmax(0.1 * size, 1e-300);
    if (size == 0.0) {
        *low = -1.0, *high = 1.0;
        return;
    }
    /* What lies near 0 is seen from 0. */
    const bool from_zero = *low >= 0.0 && *low <= 0.5 * *high, to_zero = *high <= 0.0 && *high >= 0.5 * *low;
    *low = from_zero ? 0.0 : fmax(*low - room, -DBL_MAX);
    *high = to_zero ? 0.0 : fmin(*high + room, DBL_MAX);
}

static void add_tick(loxo_plot_axis *axis, double value, bool is_major)
{
    loxo_plot_tick *tick = &axis->tick[axis->n_ticks++];
    *tick = (loxo_plot_tick){.place = loxo_plot_axis_place(axis, value), .is_major = is_major};
}

static void make_linear(loxo_plot_axis *axis, double n)
{
    const loxo_draw_ticks ticks = loxo_draw_ticks_find(axis->low, axis->high, n);
    axis->shift = ticks.shift;
    for (int64_t i = ticks.first; i <= ticks.last && axis->n_ticks < LOXO_DRAW_MAX_LOG_TICKS; ++i) {
        add_tick(axis, loxo_draw_tick_value(&ticks, i), true);
        loxo_draw_tick_text(&ticks, i, axis->tick[axis->n_ticks - 1].text);
    }
}

/* Plain numbers where all are short, else powers of ten. */
static void make_log(loxo_plot_axis *axis, const loxo_draw_log_tick *found, int n_found)
{
    bool is_plain = true;
    for (int i = 0; i < n_found; ++i)
        is_plain = is_plain && (!found[i].is_major || (found[i].exponent >= -3 && found[i].exponent <= 4));
    for (int i = 0; i < n_found; ++i) {
        add_tick(axis, loxo_draw_log_tick_value(&found[i]), found[i].is_major);
        loxo_plot_tick *tick = &axis->tick[axis->n_ticks - 1];
        if (!found[i].is_major) continue;
        if (is_plain) {
            const loxo_draw_ticks one = {.factor = 1, .exponent = found[i].exponent};
            loxo_draw_tick_text(&one, found[i].factor, tick->text);
            continue;
        }
        if (found[i].factor == 1)
            snprintf(tick->text, sizeof tick->text, "10");
        else
            snprintf(tick->text, sizeof tick->text, "%d x 10", found[i].factor);
        snprintf(tick->power, sizeof tick->power, "%d", found[i].exponent);
    }
}

void loxo_plot_axis_make(loxo_plot_axis *axis, loxo_plot_scale scale, double low, double high, double n)
{
    loxo_draw_log_tick found[LOXO_DRAW_MAX_LOG_TICKS];
    memset(axis, 0, sizeof *axis);
    axis->is_log = scale == LOXO_PLOT_LOG;
    axis->low = low;
    axis->high = high;
    const int n_found = axis->is_log ? loxo_draw_log_ticks_find(low, high, n, found) : 0;
    if (n_found > 0)
        make_log(axis, found, n_found);
    else
        make_linear(axis, n);
}
