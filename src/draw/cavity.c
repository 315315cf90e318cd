/* SPDX-License-Identifier: MIT */
#include "draw/cavity.h"

#include "base/allocate.h"
#include "par/range.h"

#include <math.h>
#include <string.h>

#define GRID   600     /* cells along the picture's longer side, about */
#define BLUR   0.009   /* of the picture's shorter side: half width of the box that is applied three times */
#define SHADOW 0.45    /* light that a deep hollow loses */
#define UNIT   0x1p-24 /* of depths in sums: 2^14 * 4 samples square stay within 64 bits */

double loxo_draw_depth(uint64_t visible)
{
    const uint32_t bits = (uint32_t)(visible >> 32);
    float nearness;
    memcpy(&nearness, &bits, sizeof nearness);
    return 1.0 / (double)nearness;
}

loxo_status loxo_draw_cavity_create(loxo_context *ctx, const loxo_draw_scene *scene, loxo_draw_cavity *cavity)
{
    const loxo_draw_settings *s = scene->settings;
    const int longer = s->width > s->height ? s->width : s->height;
    const int shorter = s->width > s->height ? s->height : s->width;
    *cavity = (loxo_draw_cavity){.cell = s->supersample * ((longer + GRID - 1) / GRID)};
    cavity->width = (s->width * s->supersample + cavity->cell - 1) / cavity->cell;
    cavity->height = (s->height * s->supersample + cavity->cell - 1) / cavity->cell;
    const int64_t n = (int64_t)cavity->width * cavity->height;
    cavity->sum = loxo_allocate_zero(ctx, n, sizeof *cavity->sum);
    cavity->count = loxo_allocate_zero(ctx, n, sizeof *cavity->count);
    cavity->mean = loxo_allocate(ctx, n, sizeof *cavity->mean);
    cavity->spare = loxo_allocate(ctx, n, sizeof *cavity->spare);
    /* As deep as the blur is wide: samples in radii at the depth of the mesh's middle. */
    cavity->scale = 2.0 * BLUR * shorter * s->supersample * scene->middle_depth / scene->scale;
    if (cavity->sum == NULL || cavity->count == NULL || cavity->mean == NULL || cavity->spare == NULL) {
        loxo_draw_cavity_destroy(ctx, cavity);
        return LOXO_ERR_MEMORY; /* loxo_allocate has left the message */
    }
    return LOXO_OK;
}

void loxo_draw_cavity_destroy(loxo_context *ctx, loxo_draw_cavity *cavity)
{
    loxo_release(ctx, cavity->sum);
    loxo_release(ctx, cavity->count);
    loxo_release(ctx, cavity->mean);
    loxo_release(ctx, cavity->spare);
    *cavity = (loxo_draw_cavity){0};
}

void loxo_draw_cavity_add(loxo_context *ctx, const loxo_draw_scene *scene, const uint64_t *visible, int64_t row_begin,
                          int64_t row_end, loxo_draw_cavity *cavity)
{
    const int64_t stride = (int64_t)scene->settings->width * scene->settings->supersample, cell = cavity->cell;
    const int64_t first = row_begin / cell, last = (row_end - 1) / cell; /* rows of cells */
#pragma omp parallel for num_threads(loxo_threads_for(ctx, row_end - row_begin, 4.0 * (double)stride))                 \
    schedule(dynamic, 4)
    for (int64_t j = first; j <= last; ++j) {
        const int64_t begin = j * cell < row_begin ? row_begin : j * cell;
        const int64_t end = (j + 1) * cell < row_end ? (j + 1) * cell : row_end;
        for (int64_t y = begin; y < end; ++y) {
            for (int64_t x = 0; x < stride; ++x) {
                const uint64_t seen = visible[(y - row_begin) * stride + x];
                if (seen == 0) continue;
                cavity->sum[j * cavity->width + x / cell] += llrint(loxo_draw_depth(seen) / UNIT);
                cavity->count[j * cavity->width + x / cell] += 1;
            }
        }
    }
}

/* Means over 2 radius + 1 places along a line of n places that are so many numbers apart; nothing lies beyond its ends. */
static void blur_line(const double *from, int64_t from_step, double *to, int64_t to_step, int64_t n, int64_t radius)
{
    double sum = 0.0;
    for (int64_t i = 0; i < radius && i < n; ++i)
        sum += from[i * from_step];
    for (int64_t i = 0; i < n; ++i) {
        if (i + radius < n) sum += from[(i + radius) * from_step];
        to[i * to_step] = sum / (double)(2 * radius + 1);
        if (i >= radius) sum -= from[(i - radius) * from_step];
    }
}

/* field: every fourth number. */
static void blur(double *field, double *spare, int64_t width, int64_t height)
{
    const int64_t shorter = width < height ? width : height, radius = 1 + (int64_t)(BLUR * (double)shorter);
    for (int pass = 0; pass < 3; ++pass) { /* three boxes are near a bell */
        for (int64_t y = 0; y < height; ++y)
            blur_line(&field[4 * y * width], 4, &spare[y * width], 1, width, radius);
        for (int64_t x = 0; x < width; ++x)
            blur_line(&spare[x], width, &field[4 * x], 4 * width, height, radius);
    }
}

void loxo_draw_cavity_blur(loxo_draw_cavity *cavity)
{
    const int64_t width = cavity->width, height = cavity->height;
    const double per_cell = 1.0 / ((double)cavity->cell * cavity->cell);
    for (int64_t i = 0; i < width * height; ++i) {
        const int64_t column = i % width, row = i / width;
        const double cover = (double)cavity->count[i] * per_cell;
        cavity->mean[i][0] = cover;
        cavity->mean[i][1] = (double)cavity->sum[i] * UNIT * per_cell;
        cavity->mean[i][2] = cover * (double)column;
        cavity->mean[i][3] = cover * (double)row;
    }
    for (int k = 0; k < 4; ++k)
        blur(&cavity->mean[0][k], cavity->spare, width, height);
}

double loxo_draw_cavity_light(const loxo_draw_cavity *cavity, double x, double y, double depth, const double slope[2])
{
    /* Between the middles of four cells. */
    const double gx = fmin(fmax(x / cavity->cell - 0.5, 0.0), cavity->width - 1.0);
    const double gy = fmin(fmax(y / cavity->cell - 0.5, 0.0), cavity->height - 1.0);
    const int64_t i = (int64_t)gx, j = (int64_t)gy;
    const int64_t right = i + 1 < cavity->width ? 1 : 0, down = j + 1 < cavity->height ? cavity->width : 0;
    const double s = gx - (double)i, t = gy - (double)j;
    const double weights[4] = {(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t};
    const int64_t at = j * cavity->width + i, places[4] = {at, at + right, at + down, at + down + right};
    double sums[4] = {0.0, 0.0, 0.0, 0.0};
    for (int k = 0; k < 4; ++k)
        for (int c = 0; c < 4; ++c)
            sums[c] += weights[k] * cavity->mean[places[k]][c];
    if (!(sums[0] > 1e-6)) return 1.0;
    const double straight_on =
        depth + cavity->cell * (slope[0] * (sums[2] / sums[0] - gx) + slope[1] * (sums[3] / sums[0] - gy));
    const double hollow = fmin(fmax((straight_on - sums[1] / sums[0]) / cavity->scale, 0.0), 1.0);
    return 1.0 - SHADOW * hollow * (2.0 - hollow);
}
