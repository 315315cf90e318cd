/* SPDX-License-Identifier: MIT
 * A picture that is being drawn, and a part of it. */
#ifndef LOXO_DRAW_CANVAS_H
#define LOXO_DRAW_CANVAS_H

#include <stdint.h>

typedef struct loxo_draw_canvas {
    uint8_t *rgb; /* [height][width][3] */
    int width, height;
} loxo_draw_canvas;

/* In pixels, from the upper left corner. */
typedef struct loxo_draw_rectangle {
    double left, top, right, bottom;
} loxo_draw_rectangle;

#endif
