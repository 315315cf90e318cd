/* SPDX-License-Identifier: MIT
 * Soft shadow in hollows: what lies farther from the camera than the mean of its neighbourhood on the screen gets less
 * light. Folds and gaps between parts become visible that lamps alone do not show.
 * source  Luft, Colditz, Deussen 2006, Image Enhancement by Unsharp Masking the Depth Buffer */
#ifndef LOXO_DRAW_CAVITY_H
#define LOXO_DRAW_CAVITY_H

#include "draw/scene.h"

/* Depths, averaged over square cells of the picture, then blurred. */
typedef struct loxo_draw_cavity {
    int cell;             /* samples along a side */
    int width, height;    /* cells */
    int64_t *sum, *count; /* of the depths of what the samples of a cell see: whole numbers, exact in any order */
    double (*mean)[4];    /* blurred: cover, and cover times depth, column, row of cells */
    double *spare;
    double scale; /* a hollow that deep, in radii, has full shadow */
} loxo_draw_cavity;

loxo_status loxo_draw_cavity_create(loxo_context *ctx, const loxo_draw_scene *scene, loxo_draw_cavity *cavity);
void loxo_draw_cavity_destroy(loxo_context *ctx, loxo_draw_cavity *cavity);
/* Takes in what the rows of samples row_begin..row_end-1 see. */
void loxo_draw_cavity_add(loxo_context *ctx, const loxo_draw_scene *scene, const uint64_t *visible, int64_t row_begin,
                          int64_t row_end, loxo_draw_cavity *cavity);
void loxo_draw_cavity_blur(loxo_draw_cavity *cavity);
/* Share of the light that is left, at a place in samples, for what is seen there in that depth. slope, the change of
 * depth from a sample to the next in x and y, tells where the surface would be if it went on straight: only what stands
 * out of that casts shadow, so flat faces keep their light up to the edge. */
double loxo_draw_cavity_light(const loxo_draw_cavity *cavity, double x, double y, double depth, const double slope[2]);

/* Distance from the camera, in radii, out of a cell of loxo_draw_rasterise that is not 0. */
double loxo_draw_depth(uint64_t visible);

#endif
