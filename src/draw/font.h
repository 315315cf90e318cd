/* SPDX-License-Identifier: MIT
 * Letters drawn as strokes: smooth at any size, no font files. */
#ifndef LOXO_DRAW_FONT_H
#define LOXO_DRAW_FONT_H

#include "draw/canvas.h"

typedef enum loxo_draw_anchor { LOXO_DRAW_LEFT, LOXO_DRAW_CENTRE, LOXO_DRAW_RIGHT } loxo_draw_anchor;

/* Width of the text in pixels, with capitals of that height. */
double loxo_draw_text_width(const char *text, double cap_height);
/* Draws printable ASCII (anything else as a small box) in the grey level `ink`; x is the anchor's, y the base line. */
void loxo_draw_text(const loxo_draw_canvas *canvas, const char *text, double x, double y, double cap_height,
                    loxo_draw_anchor anchor, uint8_t ink);
/* A line of that width with round ends. */
void loxo_draw_stroke(const loxo_draw_canvas *canvas, double x0, double y0, double x1, double y1, double width,
                      uint8_t ink);

#endif
