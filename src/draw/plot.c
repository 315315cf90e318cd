/* SPDX-License-Identifier: MIT
 * A plot: ranges, layout, axes, then the series from the back to the front. */
#include "base/context.h"
#include "base/os.h"
#include "draw/font.h"
#include "draw/plot_axis.h"
#include "draw/png.h"
#include "draw/strokes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define INK        38   /* of letters and axes */
#define GRID       225  /* of the lines behind the data */
#define MARGIN     0.03 /* of the picture's shorter side */
#define TITLE_SIZE 1.25 /* capitals, in those of the numbers */
#define MARK_SIZE  0.85
#define LINE_WIDTH 0.17
#define BAND       0.25 /* opacity */
#define COLUMN     0.35 /* half width, of the step between two */

typedef struct frame {
    const loxo_plot *plot;
    loxo_draw_canvas canvas;
    double cap; /* height of the numbers' capitals */
    loxo_draw_rectangle area;
    double legend_top;
    loxo_plot_axis x, y;
} frame;

loxo_plot loxo_plot_default(void)
{
    return (loxo_plot){.width = 1200,
                       .height = 800,
                       .x_min = (double)NAN,
                       .x_max = (double)NAN,
                       .y_min = (double)NAN,
                       .y_max = (double)NAN};
}

static loxo_status check_axis(loxo_context *ctx, const char *name, loxo_plot_scale scale, double low, double high)
{
    if (scale != LOXO_PLOT_LINEAR && scale != LOXO_PLOT_LOG)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "plot: no scale has number %d", (int)scale);
    if (isinf(low) || isinf(high) || low >= high)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "plot: the %s axis cannot go from %g to %g", name, low, high);
    if (scale == LOXO_PLOT_LOG && (low <= 0.0 || high <= 0.0))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "plot: the %s axis is logarithmic and cannot go from %g to %g", name,
                         low, high);
    return LOXO_OK;
}

static loxo_status check(loxo_context *ctx, const loxo_plot *plot)
{
    if (plot == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "plot: it is NULL");
    if (plot->width < 64 || plot->width > 16384 || plot->height < 64 || plot->height > 16384)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "plot: %d x %d pixels; 64 to 16384 can be drawn", plot->width,
                         plot->height);
    if (plot->n_series < 0 || (plot->n_series > 0 && plot->series == NULL) || plot->n_x_names < 0 ||
        (plot->n_x_names > 0 && plot->x_names == NULL))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "plot: a list is NULL, or its length negative");
    for (int i = 0; i < plot->n_series; ++i) {
        const loxo_plot_series *s = &plot->series[i];
        if (s->n < 0 || (s->n > 0 && (s->x == NULL || s->y == NULL)) || s->color < 0 || (int)s->style < 0 ||
            s->style > LOXO_PLOT_BARS)
            return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "plot: series %d has no points, or no such colour or style", i);
    }
    const loxo_status status = check_axis(ctx, "x", plot->x_scale, plot->x_min, plot->x_max);
    return status < 0 ? status : check_axis(ctx, "y", plot->y_scale, plot->y_min, plot->y_max);
}

static bool has_boxes(const loxo_plot_series *s) { return s->style == LOXO_PLOT_COLUMNS || s->style == LOXO_PLOT_BARS; }

static bool has_place(loxo_plot_scale scale, double value)
{
    return isfinite(value) && (scale == LOXO_PLOT_LINEAR || value > 0.0);
}

static void widen(loxo_plot_scale scale, double value, double *low, double *high)
{
    if (!has_place(scale, value)) return;
    *low = fmin(*low, value);
    *high = fmax(*high, value);
}

/* Ends of both axes, from the data where they are not given. Returns how many points cannot be shown on a logarithmic
 * axis. */
static int64_t find_ends(const loxo_plot *plot, double x[2], double y[2])
{
    int64_t n_left_out = 0;
    x[0] = y[0] = INFINITY, x[1] = y[1] = -INFINITY;
    for (int i = 0; i < plot->n_series; ++i) {
        const loxo_plot_series *s = &plot->series[i];
        for (int64_t k = 0; k < s->n; ++k) {
            if (!isfinite(s->x[k]) || !isfinite(s->y[k])) continue;
            if (!has_place(plot->x_scale, s->x[k]) || !has_place(plot->y_scale, s->y[k])) {
                n_left_out += 1;
                continue;
            }
            widen(plot->x_scale, s->x[k], &x[0], &x[1]);
            widen(plot->y_scale, s->y[k], &y[0], &y[1]);
            if (s->low != NULL) widen(plot->y_scale, s->low[k], &y[0], &y[1]);
            if (s->high != NULL) widen(plot->y_scale, s->high[k], &y[0], &y[1]);
            if (has_boxes(s) && s->low == NULL && plot->y_scale == LOXO_PLOT_LINEAR)
                widen(plot->y_scale, 0.0, &y[0], &y[1]);
        }
    }
    for (int k = 0; k < 2; ++k) {
        double *ends = k == 0 ? x : y;
        if (ends[0] > ends[1]) ends[0] = 1.0, ends[1] = 10.0; /* nothing to show */
        loxo_plot_axis_ends(k == 0 ? plot->x_scale : plot->y_scale, &ends[0], &ends[1]);
    }
    if (plot->n_x_names > 0) x[0] = -0.7, x[1] = plot->n_x_names - 0.3;
    const double wanted[2][2] = {{plot->x_min, plot->x_max}, {plot->y_min, plot->y_max}};
    for (int k = 0; k < 2; ++k) {
        double *ends = k == 0 ? x : y;
        const bool is_log = (k == 0 ? plot->x_scale : plot->y_scale) == LOXO_PLOT_LOG;
        if (isfinite(wanted[k][0])) ends[0] = wanted[k][0];
        if (isfinite(wanted[k][1])) ends[1] = wanted[k][1];
        if (ends[0] < ends[1]) continue; /* else the data end where a given end begins */
        if (isfinite(wanted[k][0]))
            ends[1] = is_log ? 10.0 * ends[0] : ends[0] + fmax(fabs(ends[0]), 1.0);
        else
            ends[0] = is_log ? 0.1 * ends[1] : ends[1] - fmax(fabs(ends[1]), 1.0);
    }
    return n_left_out;
}

static void set_color(loxo_draw_pen *pen, const loxo_plot_series *s, int number)
{
    loxo_draw_series_color(s->color > 0 ? s->color - 1 : number, pen->rgb);
}

/* Where colours come again they have the next marks. */
static loxo_draw_mark mark_of(const loxo_plot_series *s, int number)
{
    const int k = s->color > 0 ? s->color - 1 : number;
    return (loxo_draw_mark)((k % LOXO_DRAW_N_MARKS + k / LOXO_DRAW_N_SERIES_COLORS) % LOXO_DRAW_N_MARKS);
}

static double dash_of(const frame *f, const loxo_plot_series *s, int number)
{
    return s->is_dashed || (s->color == 0 && number >= LOXO_DRAW_N_SERIES_COLORS) ? 0.9 * f->cap : 0.0;
}

static bool has_line(const loxo_plot_series *s) { return s->style == LOXO_PLOT_LINE || s->style == LOXO_PLOT_BOTH; }
static bool has_marks(const loxo_plot_series *s) { return s->style == LOXO_PLOT_POINTS || s->style == LOXO_PLOT_BOTH; }

static double margin_of(const frame *f) { return MARGIN * fmin(f->canvas.width, f->canvas.height); }

static double tick_width(const frame *f, const loxo_plot_tick *tick)
{
    return loxo_draw_text_width(tick->text, f->cap) +
           (tick->power[0] != '\0' ? loxo_draw_text_width(tick->power, 0.7 * f->cap) + 0.15 * f->cap : 0.0);
}

/* Number with its power raised; x is the left end. */
static void draw_number(const frame *f, const char *text, const char *power, double x, double y)
{
    loxo_draw_text(&f->canvas, text, x, y, f->cap, LOXO_DRAW_LEFT, INK);
    x += loxo_draw_text_width(text, f->cap) + 0.15 * f->cap;
    loxo_draw_text(&f->canvas, power, x, y - 0.55 * f->cap, 0.7 * f->cap, LOXO_DRAW_LEFT, INK);
}

#define LEGEND_SAMPLE 3.0
#define LEGEND_GAP    1.8
#define LEGEND_ROW    2.0

/* Walks through the entries of the legend, in rows from the left; draws them when `is_drawn`. Returns their rows. */
static int walk_legend(frame *f, bool is_drawn)
{
    const double cap = f->cap, left = margin_of(f), right = f->canvas.width - left;
    loxo_draw_pen pen = {&f->canvas, {0.0, 0.0, f->canvas.width, f->canvas.height}, {0}};
    double x = left;
    int n_rows = 0;
    for (int i = 0; i < f->plot->n_series; ++i) {
        const loxo_plot_series *s = &f->plot->series[i];
        if (s->name == NULL || s->name[0] == '\0') continue;
        const double sample = has_line(s) ? LEGEND_SAMPLE * cap : 1.2 * cap;
        const double width = sample + 0.6 * cap + loxo_draw_text_width(s->name, cap);
        if (n_rows == 0) n_rows = 1;
        if (x > left && x + width > right) x = left, n_rows += 1;
        if (is_drawn) {
            const double base = f->legend_top + LEGEND_ROW * cap * (n_rows - 1) + 1.4 * cap, y = base - 0.5 * cap;
            set_color(&pen, s, i);
            if (has_line(s))
                loxo_draw_line(&pen, (double[2]){x, y}, (double[2]){x + sample, y}, LINE_WIDTH * cap, dash_of(f, s, i),
                               &(double){0.0});
            if (has_marks(s)) loxo_draw_put_mark(&pen, mark_of(s, i), x + 0.5 * sample, y, MARK_SIZE * cap);
            if (has_boxes(s)) loxo_draw_box(&pen, &(loxo_draw_rectangle){x, y - 0.5 * cap, x + sample, y + 0.5 * cap});
            loxo_draw_text(&f->canvas, s->name, x + sample + 0.6 * cap, base, cap, LOXO_DRAW_LEFT, INK);
        }
        x += width + LEGEND_GAP * cap;
    }
    return n_rows;
}

static bool is_text(const char *text) { return text != NULL && text[0] != '\0'; }

/* Where everything goes; the axes' ends and their numbers' widths decide how much the plot keeps. */
static void lay_out(frame *f, const double x[2], const double y[2])
{
    const double width = f->canvas.width, height = f->canvas.height, margin = margin_of(f);
    const double cap = f->cap;
    double top = margin, number_width = 0.0;
    if (is_text(f->plot->title)) top += 2.4 * TITLE_SIZE * cap;
    f->legend_top = top;
    f->area = (loxo_draw_rectangle){margin, top, width - margin, height - margin - 2.4 * cap};
    if (is_text(f->plot->x_title)) f->area.bottom -= 2.2 * cap;
    top += LEGEND_ROW * cap * walk_legend(f, false);
    f->area.top = fmin(top + 2.8 * cap, 0.5 * height); /* the y axis' title stands over it */
    f->area.bottom = fmax(f->area.bottom, f->area.top + 0.2 * height);
    loxo_plot_axis_make(&f->y, f->plot->y_scale, y[0], y[1], fmax((f->area.bottom - f->area.top) / (4.5 * cap), 2.0));
    for (int i = 0; i < f->y.n_ticks; ++i)
        number_width = fmax(number_width, tick_width(f, &f->y.tick[i]));
    f->area.left = floor(fmin(margin + number_width + 1.0 * cap, 0.4 * width)) + 0.5;
    f->area.right = floor(f->area.right - 1.2 * cap) + 0.5;
    f->area.top = floor(f->area.top) + 0.5;
    f->area.bottom = floor(f->area.bottom) + 0.5;
    loxo_plot_axis_make(&f->x, f->plot->x_scale, x[0], x[1], fmax((f->area.right - f->area.left) / (8.0 * cap), 2.0));
}

static double at_x(const frame *f, double place) { return f->area.left + place * (f->area.right - f->area.left); }
static double at_y(const frame *f, double place) { return f->area.bottom - place * (f->area.bottom - f->area.top); }

static bool is_inside(double place) { return place >= -1e-9 && place <= 1.0 + 1e-9; }

static void draw_grid(const frame *f)
{
    const loxo_draw_canvas *c = &f->canvas;
    for (int i = 0; i < f->x.n_ticks && f->plot->n_x_names == 0; ++i)
        if (f->x.tick[i].is_major && is_inside(f->x.tick[i].place)) {
            const double x = at_x(f, f->x.tick[i].place);
            loxo_draw_stroke(c, x, f->area.top, x, f->area.bottom, 1.0, GRID);
        }
    for (int i = 0; i < f->y.n_ticks; ++i)
        if (f->y.tick[i].is_major && is_inside(f->y.tick[i].place)) {
            const double y = at_y(f, f->y.tick[i].place);
            loxo_draw_stroke(c, f->area.left, y, f->area.right, y, 1.0, GRID);
        }
}

/* Names in place of numbers, under 0, 1, 2, ...; every few of them where they would touch. */
static void draw_names(const frame *f)
{
    const double step = at_x(f, loxo_plot_axis_place(&f->x, 1.0)) - at_x(f, loxo_plot_axis_place(&f->x, 0.0));
    double widest = 1.0;
    for (int i = 0; i < f->plot->n_x_names; ++i)
        if (f->plot->x_names[i] != NULL) widest = fmax(widest, loxo_draw_text_width(f->plot->x_names[i], f->cap));
    const int stride = (int)fmax(ceil((widest + 0.5 * f->cap) / step), 1.0);
    for (int i = 0; i < f->plot->n_x_names; i += stride) {
        const double place = loxo_plot_axis_place(&f->x, i);
        if (!is_inside(place) || f->plot->x_names[i] == NULL) continue;
        loxo_draw_text(&f->canvas, f->plot->x_names[i], at_x(f, place), f->area.bottom + 2.0 * f->cap, f->cap,
                       LOXO_DRAW_CENTRE, INK);
    }
}

static void draw_axes(const frame *f)
{
    const loxo_draw_canvas *c = &f->canvas;
    const double cap = f->cap, line = fmax(cap / 10.0, 1.0);
    double free_from = -INFINITY; /* numbers of the x axis must not touch */
    loxo_draw_stroke(c, f->area.left, f->area.top, f->area.left, f->area.bottom, line, INK);
    loxo_draw_stroke(c, f->area.left, f->area.bottom, f->area.right, f->area.bottom, line, INK);
    for (int i = 0; i < f->y.n_ticks; ++i) {
        const loxo_plot_tick *tick = &f->y.tick[i];
        if (!is_inside(tick->place)) continue;
        const double y = at_y(f, tick->place);
        loxo_draw_stroke(c, f->area.left - (tick->is_major ? 0.5 : 0.25) * cap, y, f->area.left, y, line, INK);
        draw_number(f, tick->text, tick->power, f->area.left - 0.9 * cap - tick_width(f, tick), y + 0.5 * cap);
    }
    if (f->plot->n_x_names > 0) {
        draw_names(f);
        return;
    }
    for (int i = 0; i < f->x.n_ticks; ++i) {
        const loxo_plot_tick *tick = &f->x.tick[i];
        if (!is_inside(tick->place)) continue;
        const double x = at_x(f, tick->place), left = x - 0.5 * tick_width(f, tick);
        loxo_draw_stroke(c, x, f->area.bottom, x, f->area.bottom + (tick->is_major ? 0.5 : 0.25) * cap, line, INK);
        if (!tick->is_major || left < free_from) continue;
        draw_number(f, tick->text, tick->power, left, f->area.bottom + 2.0 * cap);
        free_from = left + tick_width(f, tick) + 0.8 * cap;
    }
}

/* An axis' title, and the power of ten that its numbers leave out; x is the right or left end. */
static void draw_title(const frame *f, const loxo_plot_axis *axis, const char *title, double x, double y, bool is_right)
{
    const char *text = is_text(title) ? title : "";
    char power[16] = "";
    double width = loxo_draw_text_width(text, f->cap);
    if (axis->shift != 0) snprintf(power, sizeof power, "%d", axis->shift);
    const double gap = text[0] != '\0' ? 0.8 * f->cap : 0.0;
    const double power_width = power[0] != '\0' ? gap + loxo_draw_text_width("x 10", f->cap) + 0.15 * f->cap +
                                                      loxo_draw_text_width(power, 0.7 * f->cap)
                                                : 0.0;
    if (is_right) x -= width + power_width;
    loxo_draw_text(&f->canvas, text, x, y, f->cap, LOXO_DRAW_LEFT, INK);
    if (power[0] != '\0') draw_number(f, "x 10", power, x + width + gap, y);
}

static void draw_titles(frame *f)
{
    const double margin = margin_of(f), cap = f->cap;
    if (is_text(f->plot->title))
        loxo_draw_text(&f->canvas, f->plot->title, margin, margin + 1.3 * TITLE_SIZE * cap, TITLE_SIZE * cap,
                       LOXO_DRAW_LEFT, INK);
    (void)walk_legend(f, true);
    draw_title(f, &f->y, f->plot->y_title, margin, f->area.top - 1.1 * cap, false);
    draw_title(f, &f->x, f->plot->x_title, f->area.right, f->area.bottom + 4.4 * cap, true);
}

/* Place of a point; false when it has none. */
static bool point_at(const frame *f, double x, double y, double at[2])
{
    at[0] = at_x(f, loxo_plot_axis_place(&f->x, x));
    at[1] = at_y(f, loxo_plot_axis_place(&f->y, y));
    return isfinite(at[0]) && isfinite(at[1]);
}

static void draw_band(const frame *f, const loxo_draw_pen *pen, const loxo_plot_series *s)
{
    for (int64_t k = 0; k + 1 < s->n; ++k) {
        double low[2][2], high[2][2];
        bool is_there = true;
        for (int i = 0; i < 2; ++i)
            is_there = is_there && point_at(f, s->x[k + i], s->low[k + i], low[i]) &&
                       point_at(f, s->x[k + i], s->high[k + i], high[i]);
        if (is_there && low[0][0] < low[1][0])
            loxo_draw_fill_between(pen, low[0][0], high[0][1], low[0][1], low[1][0], high[1][1], low[1][1], BAND);
    }
}

/* Columns around each x, or bars from each x to the next, with a line of paper between those that are wide enough. */
static void draw_boxes(const frame *f, const loxo_draw_pen *pen, const loxo_plot_series *s)
{
    const bool is_bars = s->style == LOXO_PLOT_BARS;
    for (int64_t k = 0; k + (is_bars ? 1 : 0) < s->n; ++k) {
        const double base = s->low != NULL ? s->low[k] : f->y.is_log ? f->y.low : 0.0;
        const double from = is_bars ? s->x[k] : s->x[k] - COLUMN, to = is_bars ? s->x[k + 1] : s->x[k] + COLUMN;
        double top[2], left[2], right[2];
        if (!point_at(f, s->x[k], s->y[k], top) || !point_at(f, from, base, left) || !point_at(f, to, base, right))
            continue;
        loxo_draw_rectangle box = {floor(left[0]), fmin(top[1], left[1]), ceil(right[0]), fmax(top[1], left[1])};
        if (is_bars) box.right = floor(right[0]) - (right[0] - left[0] >= 6.0 ? 1.0 : 0.0);
        if (is_bars && box.bottom - box.top < 0.5) continue; /* nothing was counted there */
        loxo_draw_box(pen, &box);
    }
}

static void draw_error_bars(const frame *f, const loxo_draw_pen *pen, const loxo_plot_series *s)
{
    const double width = 0.6 * LINE_WIDTH * f->cap, cap = 0.4 * f->cap;
    for (int64_t k = 0; k < s->n; ++k) {
        double low[2], high[2];
        if (!point_at(f, s->x[k], s->low[k], low) || !point_at(f, s->x[k], s->high[k], high)) continue;
        loxo_draw_line(pen, low, high, width, 0.0, NULL);
        for (int i = 0; i < 2; ++i) {
            const double *end = i == 0 ? low : high;
            loxo_draw_line(pen, (double[2]){end[0] - cap, end[1]}, (double[2]){end[0] + cap, end[1]}, width, 0.0, NULL);
        }
    }
}

static void draw_line(const frame *f, const loxo_draw_pen *pen, const loxo_plot_series *s, double dash)
{
    double along = 0.0, before[2] = {0.0, 0.0};
    bool has_before = false;
    for (int64_t k = 0; k < s->n; ++k) {
        double here[2];
        const bool is_there = point_at(f, s->x[k], s->y[k], here);
        if (is_there && has_before) loxo_draw_line(pen, before, here, LINE_WIDTH * f->cap, dash, &along);
        has_before = is_there;
        if (is_there) memcpy(before, here, sizeof before);
    }
}

static void draw_marks(const frame *f, const loxo_draw_pen *pen, const loxo_plot_series *s, loxo_draw_mark mark)
{
    for (int64_t k = 0; k < s->n; ++k) {
        double at[2];
        if (point_at(f, s->x[k], s->y[k], at) && is_inside((at[0] - f->area.left) / (f->area.right - f->area.left)) &&
            is_inside((f->area.bottom - at[1]) / (f->area.bottom - f->area.top)))
            loxo_draw_put_mark(pen, mark, at[0], at[1], MARK_SIZE * f->cap);
    }
}

static void draw_series(const frame *f)
{
    /* Lines end at the axes; marks at the rim are whole. */
    const loxo_draw_pen blank = {&f->canvas, f->area, {0}};
    const double room = f->cap;
    for (int layer = 0; layer < 4; ++layer)
        for (int i = 0; i < f->plot->n_series; ++i) {
            const loxo_plot_series *s = &f->plot->series[i];
            const bool has_range = s->low != NULL && s->high != NULL;
            loxo_draw_pen pen = blank;
            set_color(&pen, s, i);
            if (layer == 0 && s->style == LOXO_PLOT_LINE && has_range) draw_band(f, &pen, s);
            if (layer == 1 && has_boxes(s)) draw_boxes(f, &pen, s);
            if (layer == 2 && has_line(s)) draw_line(f, &pen, s, dash_of(f, s, i));
            if (layer != 3 || !has_marks(s)) continue;
            pen.clip = (loxo_draw_rectangle){f->area.left - room, f->area.top - room, f->area.right + room,
                                             f->area.bottom + room};
            if (has_range) draw_error_bars(f, &pen, s);
            draw_marks(f, &pen, s, mark_of(s, i));
        }
}

loxo_status loxo_plot_draw(loxo_context *ctx, const loxo_plot *plot, uint8_t *rgb)
{
    double x[2], y[2];
    if (ctx == NULL) return LOXO_ERR_ARGUMENT;
    const loxo_status status = check(ctx, plot);
    if (status < 0) return status;
    if (rgb == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "plot: no picture to draw into");
    const int64_t n_left_out = find_ends(plot, x, y);
    if (n_left_out > 0)
        loxo_warn(ctx, "plot-log", n_left_out, "%lld points are not positive and have no place on a logarithmic axis",
                  (long long)n_left_out);
    frame f = {.plot = plot, .canvas = {rgb, plot->width, plot->height}};
    f.cap = fmax(0.0175 * fmin(plot->height, 0.9 * plot->width), 6.0);
    memset(rgb, 255, (size_t)3 * (size_t)plot->width * (size_t)plot->height);
    lay_out(&f, x, y);
    draw_grid(&f);
    draw_series(&f);
    draw_axes(&f);
    draw_titles(&f);
    return LOXO_OK;
}

loxo_status loxo_plot_png(loxo_context *ctx, const loxo_plot *plot, const char *path)
{
    if (ctx == NULL) return LOXO_ERR_ARGUMENT;
    loxo_status status = loxo_draw_png_available(ctx);
    if (status < 0 || (status = check(ctx, plot)) < 0) return status;
    if (path == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "plot: no path");
    if ((status = loxo_os_output_check(ctx, path)) < 0) return status;
    uint8_t *rgb = loxo_allocate(ctx, (int64_t)3 * plot->width * plot->height, sizeof *rgb);
    if (rgb == NULL) return LOXO_ERR_MEMORY;
    status = loxo_plot_draw(ctx, plot, rgb);
    if (status >= 0) status = loxo_draw_png_save(ctx, path, rgb, plot->width, plot->height);
    loxo_release(ctx, rgb);
    return status;
}
