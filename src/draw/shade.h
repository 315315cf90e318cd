/* SPDX-License-Identifier: MIT
 * From what each sample sees to the colour of each pixel. */
#ifndef LOXO_DRAW_SHADE_H
#define LOXO_DRAW_SHADE_H

#include "draw/cavity.h"
#include "draw/colormap.h"
#include "draw/scene.h"

/* Shades the pixel rows row_begin..row_end-1 into rgb [height][width][3]; visible is that of loxo_draw_rasterise for
 * their samples. */
void loxo_draw_shade(loxo_context *ctx, const loxo_draw_scene *scene, const loxo_draw_palette *palette,
                     const loxo_draw_cavity *cavity, const uint64_t *visible, int row_begin, int row_end, uint8_t *rgb);

/* sRGB byte of an amount of light, 0 to 1. */
uint8_t loxo_draw_byte(const loxo_draw_palette *palette, double light);

/* Colours that annotations share with the mesh, as sRGB bytes. */
#define LOXO_DRAW_BACKGROUND 255
#define LOXO_DRAW_GAP        176 /* grey of values that are not finite */

#endif
