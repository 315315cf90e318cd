/* SPDX-License-Identifier: MIT
 * Closed surface of any genus: a slab with a row of g square holes. Its plan is a lattice of cells, w wide around holes
 * of m x m:
 *     columns  w m w m ... m w  (g holes)        rows  w m w
 * Every lattice point outside the holes is two vertices, 2 l above and 2 l + 1 below; every cell outside the holes is
 * two triangles on either side; every edge of the plan's rim is a wall of two triangles. So it is closed and manifold
 * whatever the sizes, and its genus is that of a slab with g holes. The sides bulge away from the rim.
 *
 * Points are numbered column by column. A period of w + m columns starts with w + 1 whole columns of 2 w + m + 1 points;
 * the other m - 1 have 2 (w + 1), without the hole's. With cells: w whole columns of 2 w + m, then m of 2 w. */
#include "mesh/generate_internal.h"

#include <math.h>
#include <stdlib.h>

/* n_u is w, n_v is m. */
typedef struct plan {
    int64_t g, w, m, width, height; /* in cells */
    int64_t points_period, cells_period;
} plan;

static plan plan_of(int64_t g, int64_t w, int64_t m)
{
    plan p = {.g = g, .w = w, .m = m, .width = g * (w + m) + w, .height = 2 * w + m};
    p.points_period = (w + 1) * (p.height + 1) + (m - 1) * 2 * (w + 1);
    p.cells_period = w * p.height + m * 2 * w;
    return p;
}

static plan plan_of_generator(const loxo_generator *g) { return plan_of((int64_t)g->params[0], g->n_u, g->n_v); }

static int64_t n_points(const plan *p) { return p->g * p->points_period + (p->w + 1) * (p->height + 1); }
static int64_t n_cells(const plan *p) { return p->g * p->cells_period + p->w * p->height; }
static int64_t n_rim_edges(const plan *p) { return 2 * (p->width + p->height) + 4 * p->m * p->g; }

static int64_t point(const plan *p, int64_t x, int64_t y)
{
    const int64_t period = x / (p->w + p->m), off = x % (p->w + p->m), first = period * p->points_period;
    if (off <= p->w) return first + off * (p->height + 1) + y;
    return first + (p->w + 1) * (p->height + 1) + (off - p->w - 1) * 2 * (p->w + 1) + (y <= p->w ? y : y - (p->m - 1));
}

static void point_place(const plan *p, int64_t l, int64_t *x, int64_t *y)
{
    const int64_t period = l / p->points_period, rest = l % p->points_period, whole = (p->w + 1) * (p->height + 1);
    if (rest < whole) {
        *x = period * (p->w + p->m) + rest / (p->height + 1);
        *y = rest % (p->height + 1);
    } else {
        *x = period * (p->w + p->m) + p->w + 1 + (rest - whole) / (2 * (p->w + 1));
        *y = (rest - whole) % (2 * (p->w + 1));
        if (*y > p->w) *y += p->m - 1;
    }
}

static void cell_place(const plan *p, int64_t cell, int64_t *x, int64_t *y)
{
    const int64_t period = cell / p->cells_period, rest = cell % p->cells_period, whole = p->w * p->height;
    if (rest < whole) {
        *x = period * (p->w + p->m) + rest / p->height;
        *y = rest % p->height;
    } else {
        *x = period * (p->w + p->m) + p->w + (rest - whole) / (2 * p->w);
        *y = (rest - whole) % (2 * p->w);
        if (*y >= p->w) *y += p->m;
    }
}

/* Edge e of the rim, from (x, y)[0] to [1] with the slab at its left. */
static void rim_edge(const plan *p, int64_t e, int64_t x[2], int64_t y[2])
{
    const int64_t outer = 2 * (p->width + p->height);
    int64_t side, i, x0 = 0, y0 = 0, size_x = p->width, size_y = p->height;
    const bool is_hole = e >= outer;
    if (is_hole) {
        const int64_t hole = (e - outer) / (4 * p->m);
        x0 = hole * (p->w + p->m) + p->w;
        y0 = p->w;
        size_x = size_y = p->m;
        e = (e - outer) % (4 * p->m);
    }
    side = e < size_x ? 0 : e < size_x + size_y ? 1 : e < 2 * size_x + size_y ? 2 : 3;
    i = e - (side > 0 ? size_x : 0) - (side > 1 ? size_y : 0) - (side > 2 ? size_x : 0);
    for (int64_t end = 0; end < 2; ++end) {
        const int64_t at = i + end;
        x[end] = x0 + (side == 0 ? at : side == 1 ? size_x : side == 2 ? size_x - at : 0);
        y[end] = y0 + (side == 0 ? 0 : side == 1 ? at : side == 2 ? size_y : size_y - at);
    }
    if (is_hole) { /* the other way round */
        const int64_t swap_x = x[0], swap_y = y[0];
        x[0] = x[1], y[0] = y[1];
        x[1] = swap_x, y[1] = swap_y;
    }
}

/* Cells from (x, y) to the rim. */
static double rim_distance(const plan *p, double x, double y)
{
    const double period = (double)(p->w + p->m), w = (double)p->w, m = (double)p->m;
    double d = fmin(fmin(x, (double)p->width - x), fmin(y, (double)p->height - y));
    for (int64_t k = (int64_t)(x / period) - 1; k <= (int64_t)(x / period); ++k) {
        if (k < 0 || k >= p->g) continue;
        const double left = (double)k * period + w;
        const double dx = fmax(fmax(left - x, x - left - m), 0.0), dy = fmax(fmax(w - y, y - w - m), 0.0);
        d = fmin(d, sqrt(dx * dx + dy * dy));
    }
    return d;
}

static void genus_positions(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3])
{
    const plan p = plan_of_generator(g);
    const double size = 1.0 / (double)p.height, half = 0.5 * (double)p.w;
    for (int64_t v = begin; v < end; ++v) {
        int64_t x, y;
        point_place(&p, v / 2, &x, &y);
        /* Half a cell at the rim, rising by 45 degrees there and level in the middle. */
        const double d = fmin(rim_distance(&p, (double)x, (double)y), half);
        const double z = 0.5 + d * (1.0 - 0.5 * d / half);
        position[v - begin][0] = size * ((double)x - 0.5 * (double)p.width);
        position[v - begin][1] = size * ((double)y - 0.5 * (double)p.height);
        position[v - begin][2] = size * (v % 2 == 0 ? z : -z);
    }
}

static void cell_face(const plan *p, int64_t cell, int64_t which, loxo_index t[3])
{
    const bool is_below = which >= 2;
    int64_t x, y, corner[3];
    cell_place(p, cell, &x, &y);
    corner[0] = which % 2 == 0 ? point(p, x, y) : point(p, x + 1, y + 1);
    corner[1] = which % 2 == 0 ? point(p, x + 1, y) : point(p, x, y + 1);
    corner[2] = which % 2 == 0 ? point(p, x, y + 1) : point(p, x + 1, y);
    t[0] = (loxo_index)(2 * corner[0] + is_below);
    t[1] = (loxo_index)(2 * corner[is_below ? 2 : 1] + is_below);
    t[2] = (loxo_index)(2 * corner[is_below ? 1 : 2] + is_below);
}

static void genus_faces(const loxo_generator *g, int64_t begin, int64_t end, loxo_index (*triangle)[3])
{
    const plan p = plan_of_generator(g);
    const int64_t n_sides = 4 * n_cells(&p);
    for (int64_t f = begin; f < end; ++f) {
        loxo_index *t = triangle[f - begin];
        if (f < n_sides) {
            cell_face(&p, f / 4, f % 4, t);
            continue;
        }
        int64_t x[2], y[2];
        rim_edge(&p, (f - n_sides) / 2, x, y);
        const int64_t a = 2 * point(&p, x[0], y[0]), b = 2 * point(&p, x[1], y[1]);
        t[0] = (loxo_index)((f - n_sides) % 2 == 0 ? b : a + 1);
        t[1] = (loxo_index)((f - n_sides) % 2 == 0 ? a : b + 1);
        t[2] = (loxo_index)((f - n_sides) % 2 == 0 ? a + 1 : b);
    }
}

static int64_t genus_size(int64_t g, int64_t w, int64_t m)
{
    const plan p = plan_of(g, w, m);
    return 2 * n_points(&p);
}

void loxo_make_genus(loxo_generator *g)
{
    const int64_t wanted = g->n_vertices, genus = (int64_t)g->params[0];
    /* With w = m there are 2 (8 g + 3) m^2 vertices or so: near that m, the width that comes nearest. */
    const int64_t guess = (int64_t)sqrt((double)wanted / (2.0 * (8.0 * (double)genus + 3.0)));
    g->n_u = g->n_v = 1;
    for (int64_t m = guess > 3 ? guess - 2 : 1; m <= guess + 2; ++m) {
        for (int64_t w = m > 3 ? m / 2 : 1; w <= 2 * m; ++w) {
            const int64_t size = genus_size(genus, w, m);
            if (llabs(size - wanted) < llabs(genus_size(genus, g->n_u, g->n_v) - wanted)) {
                g->n_u = w;
                g->n_v = m;
            }
            if (size > wanted) break;
        }
    }
    const plan p = plan_of_generator(g);
    g->n_vertices = 2 * n_points(&p);
    g->n_faces = 4 * n_cells(&p) + 2 * n_rim_edges(&p);
    g->smallest = genus_size(genus, 1, 1);
    g->positions = genus_positions;
    g->faces = genus_faces;
}
