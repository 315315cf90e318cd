/* SPDX-License-Identifier: MIT
 * Colour maps, and the step between the numbers of a picture file (sRGB) and amounts of light. */
#ifndef LOXO_DRAW_COLORMAP_H
#define LOXO_DRAW_COLORMAP_H

#include <loxo/draw.h>

#define LOXO_DRAW_N_COLORS  1024
#define LOXO_DRAW_N_ENCODED 4096

/* Tables that the shading of one picture uses. */
typedef struct loxo_draw_palette {
    float light[LOXO_DRAW_N_COLORS][3];       /* amounts of red, green, blue light, 0 to 1, along the map */
    uint8_t encoded[LOXO_DRAW_N_ENCODED + 1]; /* sRGB byte of the square of (i / LOXO_DRAW_N_ENCODED) */
} loxo_draw_palette;

/* Colour of the map at t in [0, 1], sRGB, 0 to 1. */
void loxo_draw_color(loxo_colormap map, double t, double rgb[3]);
double loxo_draw_decode(double srgb);  /* sRGB, 0 to 1 -> light */
double loxo_draw_encode(double light); /* and back */
void loxo_draw_palette_fill(loxo_draw_palette *palette, loxo_colormap map);

#endif
