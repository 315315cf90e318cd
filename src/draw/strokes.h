/* SPDX-License-Identifier: MIT
 * Coloured lines, marks and bands, smoothed at their rims: what plots are made of. */
#ifndef LOXO_DRAW_STROKES_H
#define LOXO_DRAW_STROKES_H

#include "draw/canvas.h"

typedef struct loxo_draw_pen {
    const loxo_draw_canvas *canvas;
    loxo_draw_rectangle clip; /* no pixel outside is touched */
    uint8_t rgb[3];
} loxo_draw_pen;

typedef enum loxo_draw_mark {
    LOXO_DRAW_DISC,
    LOXO_DRAW_SQUARE,
    LOXO_DRAW_TRIANGLE,
    LOXO_DRAW_DIAMOND,
    LOXO_DRAW_TRIANGLE_DOWN,
    LOXO_DRAW_RING,
    LOXO_DRAW_FRAME,
    LOXO_DRAW_CROSS,
    LOXO_DRAW_N_MARKS
} loxo_draw_mark;

/* Colour of series i, i modulo 8: told apart by colour-blind readers, too. */
#define LOXO_DRAW_N_SERIES_COLORS 8
void loxo_draw_series_color(int i, uint8_t rgb[3]);

/* A straight line with round ends. dash: length of dashes and half that of the gaps, 0: none; *along is where in the pattern
 * the line begins and is moved on by its length. Places may be anywhere, but finite. */
void loxo_draw_line(const loxo_draw_pen *pen, const double from[2], const double to[2], double width, double dash,
                    double *along);
/* A mark of about that diameter. */
void loxo_draw_put_mark(const loxo_draw_pen *pen, loxo_draw_mark mark, double x, double y, double size);
/* The area between two straight lines over x0..x1 (x0 < x1), a_ at x0, b_ at x1; tops above bottoms or below. Pixels belong
 * to the stretch that has their centre column, so that stretches side by side leave no seam. */
void loxo_draw_fill_between(const loxo_draw_pen *pen, double x0, double a_top, double a_bottom, double x1, double b_top,
                            double b_bottom, double opacity);
/* An upright box, without smoothing. */
void loxo_draw_box(const loxo_draw_pen *pen, const loxo_draw_rectangle *box);

#endif
