/* SPDX-License-Identifier: MIT
 * Which face each sample sees. Coverage is decided in whole numbers, with the top-left rule, so two triangles that share
 * an edge neither leave a hole nor overlap. Faces go to threads in any order: the nearest wins, whoever comes first. */
#include "draw/scene.h"
#include "par/range.h"

#include <math.h>
#include <string.h>

#define FACES_PER_GRAB 1024
#define NARROW         8 /* spans wider than this are cut to the triangle before they are walked */

typedef struct target {
    int64_t row_begin, row_end, left, right; /* samples that may be written */
    int64_t stride;
    uint64_t *visible;
    bool is_shared;
} target;

/* One edge as a function of the place: >= 0 inside, its own line included for top and left edges only. */
typedef struct edge_line {
    int64_t dx, dy;   /* change for one sample to the right, one down */
    int64_t at_start; /* at the first sample of the box */
} edge_line;

static edge_line line_between(const int32_t a[2], const int32_t b[2], int64_t x, int64_t y)
{
    const int64_t ex = (int64_t)b[0] - a[0], ey = (int64_t)b[1] - a[1];
    /* y runs down: inside is to the right of the way a -> b as seen on the screen. */
    const bool is_top_left = ey < 0 || (ey == 0 && ex > 0);
    edge_line line = {.dx = -ey * LOXO_DRAW_SUBSAMPLE, .dy = ex * LOXO_DRAW_SUBSAMPLE};
    line.at_start = ex * (y - a[1]) - ey * (x - a[0]) - (is_top_left ? 0 : 1);
    return line;
}

static int64_t floor_div(int64_t a, int64_t b) /* b > 0 */
{
    const int64_t q = a / b;
    return q - (a % b < 0 ? 1 : 0);
}

static int64_t min3(int64_t a, int64_t b, int64_t c) { return a < b ? (a < c ? a : c) : (b < c ? b : c); }
static int64_t max3(int64_t a, int64_t b, int64_t c) { return a > b ? (a > c ? a : c) : (b > c ? b : c); }

/* First sample whose centre is at or right of x, and the last at or left of it. */
static int64_t first_sample(int64_t x) { return floor_div(x + LOXO_DRAW_SUBSAMPLE / 2 - 1, LOXO_DRAW_SUBSAMPLE); }
static int64_t last_sample(int64_t x) { return floor_div(x - LOXO_DRAW_SUBSAMPLE / 2, LOXO_DRAW_SUBSAMPLE); }

static void put(const target *t, uint64_t *cell, uint64_t key)
{
    uint64_t old = __atomic_load_n(cell, __ATOMIC_RELAXED);
    if (!t->is_shared) {
        if (key > old) *cell = key;
        return;
    }
    while (key > old && !__atomic_compare_exchange_n(cell, &old, key, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
    }
}

static void draw_face(const loxo_draw_scene *scene, const target *t, int64_t f)
{
    const loxo_index *v = &scene->mesh->triangle[3 * f];
    const int32_t *a = scene->xy[v[0]], *b = scene->xy[v[1]], *c = scene->xy[v[2]];
    double qa = (double)scene->inverse_depth[v[0]], qb = (double)scene->inverse_depth[v[1]];
    double qc = (double)scene->inverse_depth[v[2]];
    if (!(qa > 0.0 && qb > 0.0 && qc > 0.0)) return;

    int64_t left = first_sample(min3(a[0], b[0], c[0])), right = last_sample(max3(a[0], b[0], c[0]));
    int64_t top = first_sample(min3(a[1], b[1], c[1])), bottom = last_sample(max3(a[1], b[1], c[1]));
    if (left < t->left) left = t->left;
    if (right >= t->right) right = t->right - 1;
    if (top < t->row_begin) top = t->row_begin;
    if (bottom >= t->row_end) bottom = t->row_end - 1;
    if (left > right || top > bottom) return; /* most faces of a large mesh end here */

    int64_t area = ((int64_t)b[0] - a[0]) * ((int64_t)c[1] - a[1]) - ((int64_t)b[1] - a[1]) * ((int64_t)c[0] - a[0]);
    if (area == 0) return;
    if (area < 0) { /* seen from the other side: turned */
        const int32_t *swap = b;
        const double q_swap = qb;
        b = c, c = swap, qb = qc, qc = q_swap, area = -area;
    }
    const int64_t x = left * LOXO_DRAW_SUBSAMPLE + LOXO_DRAW_SUBSAMPLE / 2;
    const int64_t y = top * LOXO_DRAW_SUBSAMPLE + LOXO_DRAW_SUBSAMPLE / 2;
    edge_line lines[3] = {line_between(b, c, x, y), line_between(c, a, x, y), line_between(a, b, x, y)};
    const double per_area = 1.0 / (double)area, q_low = fmin(qa, fmin(qb, qc)), q_high = fmax(qa, fmax(qb, qc));
    const uint64_t low_half = 0xffffffffu - (uint64_t)f;

    for (int64_t row = top; row <= bottom; ++row) {
        int64_t begin = 0, end = right - left; /* inclusive */
        if (end > NARROW) {
            for (int k = 0; k < 3; ++k) {
                const int64_t e = lines[k].at_start, d = lines[k].dx;
                if (d > 0 && e < 0) {
                    const int64_t first = floor_div(-e + d - 1, d);
                    if (first > begin) begin = first;
                } else if (d < 0) {
                    const int64_t last = floor_div(e, -d); /* -1 or less when e < 0 */
                    if (last < end) end = last;
                } else if (d == 0 && e < 0) {
                    end = -1;
                }
            }
        }
        uint64_t *cells = &t->visible[(row - t->row_begin) * t->stride + left];
        int64_t e0 = lines[0].at_start + begin * lines[0].dx, e1 = lines[1].at_start + begin * lines[1].dx;
        int64_t e2 = lines[2].at_start + begin * lines[2].dx;
        for (int64_t i = begin; i <= end; ++i) {
            if ((e0 | e1 | e2) >= 0) {
                double q = ((double)e0 * qa + (double)e1 * qb + (double)e2 * qc) * per_area;
                q = q < q_low ? q_low : q > q_high ? q_high : q;
                const float nearness = (float)q; /* > 0: the bits grow with it */
                uint32_t bits;
                memcpy(&bits, &nearness, sizeof bits);
                put(t, &cells[i], ((uint64_t)bits << 32) | low_half);
            }
            e0 += lines[0].dx, e1 += lines[1].dx, e2 += lines[2].dx;
        }
        for (int k = 0; k < 3; ++k)
            lines[k].at_start += lines[k].dy;
    }
}

loxo_status loxo_draw_rasterise(loxo_context *ctx, const loxo_draw_scene *scene, int64_t row_begin, int64_t row_end,
                                uint64_t *visible)
{
    const int64_t n = scene->mesh->n_faces, samples = scene->settings->supersample;
    const int64_t block = (int64_t)1 << 22; /* between two looks at the monitor */
    const int64_t top = (int64_t)ceil(scene->clip.top) * samples, bottom = (int64_t)scene->clip.bottom * samples;
    target t = {
        .row_begin = row_begin,
        .row_end = row_end < bottom ? row_end : bottom,
        .left = (int64_t)ceil(scene->clip.left) * samples,
        .right = (int64_t)scene->clip.right * samples,
        .stride = scene->settings->width * samples,
        .visible = visible,
    };
    if (top > row_begin) {
        if (top >= t.row_end) return LOXO_OK;
        t.visible += (top - row_begin) * t.stride;
        t.row_begin = top;
    }
    for (int64_t begin = 0; begin < n; begin += block) {
        const int64_t count = n - begin < block ? n - begin : block;
        /* A face costs from 10 ns (out of sight) to whole pictures. */
        const int n_threads =
            loxo_threads(ctx, 20.0 * (double)count + (double)(t.row_end - t.row_begin) * (double)t.stride);
        t.is_shared = n_threads > 1;
#pragma omp parallel for num_threads(n_threads) schedule(dynamic, 1)
        for (int64_t grab = 0; grab < count; grab += FACES_PER_GRAB) {
            const int64_t end = grab + FACES_PER_GRAB < count ? grab + FACES_PER_GRAB : count;
            for (int64_t f = begin + grab; f < begin + end; ++f)
                draw_face(scene, &t, f);
        }
        if (loxo_stop_wanted(ctx, "draw", -1.0)) return LOXO_ERR_STOPPED;
    }
    return LOXO_OK;
}
