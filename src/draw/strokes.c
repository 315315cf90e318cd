/* SPDX-License-Identifier: MIT */
#include "draw/strokes.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* Okabe and Ito 2008, Color Universal Design, but for their yellow, which is too light for lines on white: grey instead. */
static const uint8_t palette[LOXO_DRAW_N_SERIES_COLORS][3] = {{0, 114, 178},   {213, 94, 0},   {0, 158, 115},
                                                              {204, 121, 167}, {230, 159, 0},  {86, 180, 233},
                                                              {0, 0, 0},       {130, 130, 130}};

void loxo_draw_series_color(int i, uint8_t rgb[3])
{
    for (int k = 0; k < 3; ++k)
        rgb[k] = palette[i % LOXO_DRAW_N_SERIES_COLORS][k];
}

typedef struct pixels {
    int left, top, right, bottom; /* right and bottom are not in it */
} pixels;

/* Pixels of the pen's clip that a box of places touches. */
static pixels touched(const loxo_draw_pen *pen, double left, double top, double right, double bottom)
{
    const double clip_left = fmax(pen->clip.left, 0.0), clip_top = fmax(pen->clip.top, 0.0);
    const double clip_right = fmin(pen->clip.right, pen->canvas->width);
    const double clip_bottom = fmin(pen->clip.bottom, pen->canvas->height);
    pixels p = {(int)fmin(fmax(floor(left), clip_left), clip_right), (int)fmin(fmax(floor(top), clip_top), clip_bottom),
                (int)fmax(fmin(ceil(right), clip_right), clip_left),
                (int)fmax(fmin(ceil(bottom), clip_bottom), clip_top)};
    return p;
}

static void blend(const loxo_draw_pen *pen, int x, int y, double cover)
{
    if (!(cover > 0.0)) return;
    uint8_t *pixel = &pen->canvas->rgb[3 * ((size_t)y * (size_t)pen->canvas->width + (size_t)x)];
    for (int k = 0; k < 3; ++k)
        pixel[k] = (uint8_t)lrint((1.0 - cover) * pixel[k] + cover * pen->rgb[k]);
}

static double clamp01(double x) { return fmin(fmax(x, 0.0), 1.0); }

/* Cuts a line to the clip grown by `reach`, in shares of its length; false: nothing is left. */
static bool cut(const loxo_draw_pen *pen, const double from[2], const double to[2], double reach, double share[2])
{
    const double low[2] = {pen->clip.left - reach, pen->clip.top - reach};
    const double high[2] = {pen->clip.right + reach, pen->clip.bottom + reach};
    share[0] = 0.0, share[1] = 1.0;
    for (int k = 0; k < 2; ++k) {
        const double d = to[k] - from[k];
        if (fabs(d) < 1e-12) {
            if (from[k] < low[k] || from[k] > high[k]) return false;
            continue;
        }
        const double a = (low[k] - from[k]) / d, b = (high[k] - from[k]) / d;
        share[0] = fmax(share[0], fmin(a, b));
        share[1] = fmin(share[1], fmax(a, b));
    }
    return share[0] <= share[1];
}

static void solid_line(const loxo_draw_pen *pen, double x0, double y0, double x1, double y1, double width)
{
    const double reach = 0.5 * width + 1.0, dx = x1 - x0, dy = y1 - y0, square = dx * dx + dy * dy;
    const pixels p =
        touched(pen, fmin(x0, x1) - reach, fmin(y0, y1) - reach, fmax(x0, x1) + reach, fmax(y0, y1) + reach);
    for (int y = p.top; y < p.bottom; ++y) {
        /* Only the columns near where the line crosses this row; all of them where it runs along the row. */
        int left = p.left, right = p.right;
        if (fabs(dy) > 0.0) {
            const double slope = dx / dy, at = x0 + (y + 0.5 - y0) * slope;
            const double wide = reach * sqrt(1.0 + slope * slope) + 1.0 + 0.5 * fabs(slope);
            left = (int)fmin(fmax(floor(at - wide), p.left), p.right);
            right = (int)fmax(fmin(ceil(at + wide), p.right), p.left);
        }
        for (int x = left; x < right; ++x) {
            const double px = x + 0.5 - x0, py = y + 0.5 - y0;
            const double t = square > 0.0 ? clamp01((px * dx + py * dy) / square) : 0.0;
            const double ex = px - t * dx, ey = py - t * dy;
            blend(pen, x, y, clamp01(0.5 * width + 0.5 - sqrt(ex * ex + ey * ey)));
        }
    }
}

void loxo_draw_line(const loxo_draw_pen *pen, const double from[2], const double to[2], double width, double dash,
                    double *along)
{
    const double dx = to[0] - from[0], dy = to[1] - from[1], length = hypot(dx, dy);
    const double start = along != NULL ? *along : 0.0;
    double share[2];
    if (along != NULL) *along = fmod(start + length, 1.5 * fmax(dash, 1e-3));
    if (!isfinite(length) || !cut(pen, from, to, width + 2.0, share)) return;
    if (!(dash > 0.0) || !(length > 0.0)) {
        solid_line(pen, from[0] + share[0] * dx, from[1] + share[0] * dy, from[0] + share[1] * dx,
                   from[1] + share[1] * dy, width);
        return;
    }
    const double period = 1.5 * dash;
    const double begin = start + share[0] * length, end = start + share[1] * length;
    const int64_t first = (int64_t)floor(begin / period), last = (int64_t)floor(end / period);
    for (int64_t i = first; i <= last; ++i) {
        const double a = (fmax((double)i * period, begin) - start) / length;
        const double b = (fmin((double)i * period + dash, end) - start) / length;
        if (a < b) solid_line(pen, from[0] + a * dx, from[1] + a * dy, from[0] + b * dx, from[1] + b * dy, width);
    }
}

/* How far a place is outside of a mark of half width r around the origin; negative inside. Corners are a little sharper
 * than true distances would make them. */
static double outside(loxo_draw_mark mark, double x, double y, double r)
{
    const double root3 = sqrt(3.0);
    switch (mark) {
    case LOXO_DRAW_SQUARE: return fmax(fabs(x), fabs(y)) - 0.88 * r;
    case LOXO_DRAW_TRIANGLE: return fmax(y - 0.62 * r, 0.5 * (root3 * fabs(x) - y) - 0.62 * r);
    case LOXO_DRAW_TRIANGLE_DOWN: return fmax(-y - 0.62 * r, 0.5 * (root3 * fabs(x) + y) - 0.62 * r);
    case LOXO_DRAW_DIAMOND: return (1.5 * fabs(x) + fabs(y)) / sqrt(3.25) - 0.75 * r;
    case LOXO_DRAW_RING: return fabs(hypot(x, y) - 0.85 * r) - 0.22 * r;
    case LOXO_DRAW_FRAME: return fabs(fmax(fabs(x), fabs(y)) - 0.75 * r) - 0.2 * r;
    case LOXO_DRAW_CROSS:
        return fmax(fmin(fabs(x - y), fabs(x + y)) / sqrt(2.0) - 0.24 * r, fmax(fabs(x), fabs(y)) - 0.9 * r);
    default: return hypot(x, y) - r;
    }
}

void loxo_draw_put_mark(const loxo_draw_pen *pen, loxo_draw_mark mark, double x, double y, double size)
{
    const double r = 0.5 * size, reach = 1.5 * size + 1.0;
    if (!(fabs(x) < 1e6) || !(fabs(y) < 1e6)) return;
    const pixels p = touched(pen, x - reach, y - reach, x + reach, y + reach);
    for (int row = p.top; row < p.bottom; ++row)
        for (int column = p.left; column < p.right; ++column)
            blend(pen, column, row, clamp01(0.5 - outside(mark, column + 0.5 - x, row + 0.5 - y, r)));
}

void loxo_draw_fill_between(const loxo_draw_pen *pen, double x0, double a_top, double a_bottom, double x1, double b_top,
                            double b_bottom, double opacity)
{
    const pixels columns = touched(pen, ceil(x0 - 0.5), pen->clip.top, ceil(x1 - 0.5), pen->clip.bottom);
    for (int x = columns.left; x < columns.right; ++x) {
        const double t = (x + 0.5 - x0) / (x1 - x0);
        const double one = a_top + t * (b_top - a_top), other = a_bottom + t * (b_bottom - a_bottom);
        const double top = fmin(one, other), bottom = fmax(one, other);
        const pixels rows = touched(pen, x, top, x + 1.0, bottom);
        for (int y = rows.top; y < rows.bottom; ++y)
            blend(pen, x, y, opacity * clamp01(fmin(bottom, y + 1.0) - fmax(top, y)));
    }
}

void loxo_draw_box(const loxo_draw_pen *pen, const loxo_draw_rectangle *box)
{
    const pixels p = touched(pen, box->left, box->top, box->right, box->bottom);
    for (int y = p.top; y < p.bottom; ++y)
        for (int x = p.left; x < p.right; ++x)
            blend(pen, x, y, 1.0);
}
