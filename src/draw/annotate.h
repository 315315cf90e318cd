/* SPDX-License-Identifier: MIT
 * Title and colour bar, and how much of the picture they leave to the mesh. */
#ifndef LOXO_DRAW_ANNOTATE_H
#define LOXO_DRAW_ANNOTATE_H

#include "draw/font.h"
#include "draw/scene.h"
#include "draw/ticks.h"

typedef struct loxo_draw_layout {
    double cap_height; /* of numbers */
    bool has_bar, has_numbers;
    loxo_draw_rectangle bar;
    loxo_draw_ticks ticks;
    loxo_draw_rectangle fit, clip; /* where the mesh goes, and where it must not leave */
} loxo_draw_layout;

loxo_draw_layout loxo_draw_lay_out(const loxo_draw_scene *scene);
void loxo_draw_annotate(const loxo_draw_scene *scene, const loxo_draw_layout *layout, uint8_t *rgb);

#endif
