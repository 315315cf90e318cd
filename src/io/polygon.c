/* SPDX-License-Identifier: MIT
 * Polygons into triangles by cutting off ears. Dents are found through a grid of cells, so that a test sees few of
 * them. A triangle of positive area whose corners follow each other and that holds no dent can be cut off; when all
 * that were cut off are positive their areas add up to the polygon's, so that none overlap.
 * source  Meisters 1975, Polygons Have Ears; the grid and the bound on the work are ours */
#include "io/faces.h"

#include <math.h>

#define WORK_PER_CORNER 1000
#define WORK_SQUARED    100000000 /* quadratic work up to here: long thin ears look at every dent */

typedef struct polygon {
    const loxo_index *corner;
    int64_t n; /* of all corners */
    double (*point)[2];
    int64_t *previous, *next;      /* of the corners that are left */
    int64_t *cell_first;           /* [n_cells * n_cells], -1: empty */
    int64_t *cell_next;            /* [n] */
    bool *is_dent;                 /* [n] not convex, and left */
    bool *is_in_cell;              /* [n] */
    int64_t n_cells;               /* along a side of the grid */
    double origin[2], per_cell[2]; /* per_cell: cells a unit of length */
    int64_t n_left, work;
    loxo_index *triangle; /* the next to write */
    bool is_certain;
} polygon;

static int64_t cells_along_side(int64_t n)
{
    const int64_t n_cells = (int64_t)sqrt(0.5 * (double)n);
    return n_cells < 1 ? 1 : n_cells;
}

size_t loxo_polygon_room_bytes(int64_t n)
{
    const int64_t n_cells = cells_along_side(n);
    return (size_t)n * (2 * sizeof(double) + 3 * sizeof(int64_t) + 2 * sizeof(bool)) +
           (size_t)(n_cells * n_cells) * sizeof(int64_t);
}

static void get_position(const loxo_soup *soup, loxo_index v, double p[3])
{
    for (int i = 0; i < 3; ++i)
        p[i] = soup->position_float != NULL ? (double)soup->position_float[3 * (int64_t)v + i]
                                            : soup->position[3 * (int64_t)v + i];
}

/* Twice the signed area of a, b, c. */
static double cross(const double a[2], const double b[2], const double c[2])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static bool are_equal(const double a[2], const double b[2]) { return a[0] == b[0] && a[1] == b[1]; }

/* Newell's normal: sums of the projected areas; relative to the first corner, so that an offset costs no digits. */
static void polygon_normal(const loxo_soup *soup, const polygon *p, double normal[3])
{
    double origin[3], a[3], b[3];
    get_position(soup, p->corner[0], origin);
    normal[0] = normal[1] = normal[2] = 0.0;
    for (int i = 0; i < 3; ++i)
        a[i] = 0.0;
    for (int64_t k = 1; k <= p->n; ++k) {
        get_position(soup, p->corner[k == p->n ? 0 : k], b);
        for (int i = 0; i < 3; ++i)
            b[i] -= origin[i];
        normal[0] += a[1] * b[2] - a[2] * b[1];
        normal[1] += a[2] * b[0] - a[0] * b[2];
        normal[2] += a[0] * b[1] - a[1] * b[0];
        for (int i = 0; i < 3; ++i)
            a[i] = b[i];
    }
}

/* Drops the axis of the largest normal, so that coordinates stay what they were, and turns the polygon to run
 * counter-clockwise. false when it has no area. */
static bool project(const loxo_soup *soup, polygon *p)
{
    double normal[3], position[3];
    int axis = 0;
    polygon_normal(soup, p, normal);
    for (int i = 1; i < 3; ++i) {
        if (fabs(normal[i]) > fabs(normal[axis])) axis = i;
    }
    if (!(fabs(normal[axis]) > 0.0) || !isfinite(normal[axis])) return false;
    const int u = (axis + (normal[axis] > 0.0 ? 1 : 2)) % 3, v = (axis + (normal[axis] > 0.0 ? 2 : 1)) % 3;
    for (int64_t k = 0; k < p->n; ++k) {
        get_position(soup, p->corner[k], position);
        p->point[k][0] = position[u];
        p->point[k][1] = position[v];
    }
    return true;
}

/* All corners turn left and the boundary goes around once: the first coordinate rises once and falls once. */
static bool is_convex(const polygon *p)
{
    int n_changes = 0;
    double last = 0.0;
    for (int64_t k = 0; k < p->n; ++k) {
        const int64_t before = k == 0 ? p->n - 1 : k - 1, after = k + 1 == p->n ? 0 : k + 1;
        if (!(cross(p->point[before], p->point[k], p->point[after]) > 0.0)) return false;
    }
    for (int64_t k = 0; k <= p->n; ++k) { /* the first edge twice, to close the circle */
        const int64_t here = k == p->n ? 0 : k, next = here + 1 == p->n ? 0 : here + 1;
        const double step = p->point[next][0] - p->point[here][0];
        if (step == 0.0) continue;
        n_changes += (last < 0.0 && step > 0.0) || (last > 0.0 && step < 0.0);
        last = step;
    }
    return n_changes <= 2;
}

/* A polygon that does not cross itself turns around once; repeated corners have no direction and are passed over. */
static bool turns_once(const polygon *p)
{
    double turn = 0.0, last[2] = {0.0, 0.0};
    for (int64_t k = 0; k < 2 * p->n; ++k) { /* the first round finds a direction to start with */
        const double *a = p->point[k % p->n], *b = p->point[(k + 1) % p->n];
        const double step[2] = {b[0] - a[0], b[1] - a[1]};
        if (step[0] == 0.0 && step[1] == 0.0) continue;
        if (k >= p->n) turn += atan2(last[0] * step[1] - last[1] * step[0], last[0] * step[0] + last[1] * step[1]);
        last[0] = step[0];
        last[1] = step[1];
    }
    return fabs(turn - 6.283185307179586) < 3.0;
}

static int64_t cell_along(const polygon *p, int axis, double x)
{
    const double at = (x - p->origin[axis]) * p->per_cell[axis];
    if (!(at > 0.0)) return 0;
    return at >= (double)p->n_cells ? p->n_cells - 1 : (int64_t)at;
}

static void lay_grid(polygon *p)
{
    double low[2] = {p->point[0][0], p->point[0][1]}, high[2] = {low[0], low[1]};
    p->n_cells = cells_along_side(p->n);
    for (int64_t k = 1; k < p->n; ++k) {
        for (int i = 0; i < 2; ++i) {
            low[i] = fmin(low[i], p->point[k][i]);
            high[i] = fmax(high[i], p->point[k][i]);
        }
    }
    for (int i = 0; i < 2; ++i) {
        p->origin[i] = low[i];
        p->per_cell[i] = high[i] > low[i] ? (double)p->n_cells / (high[i] - low[i]) : 0.0;
    }
    for (int64_t c = 0; c < p->n_cells * p->n_cells; ++c)
        p->cell_first[c] = -1;
}

/* Whether corner k is a dent now; those that are stand in the grid. */
static void look_at(polygon *p, int64_t k)
{
    p->is_dent[k] = !(cross(p->point[p->previous[k]], p->point[k], p->point[p->next[k]]) > 0.0);
    if (p->is_dent[k] && !p->is_in_cell[k]) {
        const int64_t cell = cell_along(p, 1, p->point[k][1]) * p->n_cells + cell_along(p, 0, p->point[k][0]);
        p->cell_next[k] = p->cell_first[cell];
        p->cell_first[cell] = k;
        p->is_in_cell[k] = true;
    }
}

static bool is_ear(polygon *p, int64_t k)
{
    const double *a = p->point[p->previous[k]], *b = p->point[k], *c = p->point[p->next[k]];
    int64_t from[2], to[2];
    if (!(cross(a, b, c) > 0.0)) return false;
    for (int i = 0; i < 2; ++i) {
        from[i] = cell_along(p, i, fmin(a[i], fmin(b[i], c[i])));
        to[i] = cell_along(p, i, fmax(a[i], fmax(b[i], c[i])));
    }
    for (int64_t row = from[1]; row <= to[1]; ++row) {
        p->work += to[0] - from[0] + 1;
        for (int64_t column = from[0]; column <= to[0]; ++column) {
            for (int64_t d = p->cell_first[row * p->n_cells + column]; d >= 0; d = p->cell_next[d]) {
                const double *q = p->point[d];
                ++p->work;
                if (!p->is_dent[d] || are_equal(q, a) || are_equal(q, b) || are_equal(q, c)) continue;
                if (cross(a, b, q) >= 0.0 && cross(b, c, q) >= 0.0 && cross(c, a, q) >= 0.0) return false;
            }
        }
    }
    return true;
}

static void cut_off(polygon *p, int64_t k)
{
    const int64_t a = p->previous[k], c = p->next[k];
    p->triangle[0] = p->corner[a];
    p->triangle[1] = p->corner[k];
    p->triangle[2] = p->corner[c];
    p->triangle += 3;
    if (cross(p->point[a], p->point[k], p->point[c]) < 0.0) p->is_certain = false;
    p->next[a] = c;
    p->previous[c] = a;
    p->is_dent[k] = false;
    --p->n_left;
    look_at(p, a);
    look_at(p, c);
}

/* Rounds over what is left. When a whole round finds no ear, corners without area go; when there are none of these
 * either, the polygon crosses itself and any corner goes. */
static void cut_ears(polygon *p)
{
    const int64_t squared = p->n < 10000 ? p->n * p->n : WORK_SQUARED;
    const int64_t max_work = WORK_PER_CORNER * p->n + squared;
    int64_t k = 1, n_missed = 0;
    while (p->n_left > 3) {
        const double area = cross(p->point[p->previous[k]], p->point[k], p->point[p->next[k]]);
        const bool is_stuck = n_missed >= 2 * p->n_left || p->work > max_work;
        if (is_stuck || is_ear(p, k) || (n_missed >= p->n_left && area == 0.0)) {
            const int64_t after = p->next[k];
            if (is_stuck) p->is_certain = false;
            cut_off(p, k);
            k = p->next[after]; /* one is passed over, which gives rounder triangles */
            n_missed = 0;
        } else {
            k = p->next[k];
            ++n_missed;
            ++p->work;
        }
    }
    cut_off(p, k);
}

static void fan(const polygon *p, loxo_index *triangle)
{
    for (int64_t k = 1; k + 1 < p->n; ++k, triangle += 3) {
        triangle[0] = p->corner[0];
        triangle[1] = p->corner[k];
        triangle[2] = p->corner[k + 1];
    }
}

bool loxo_polygon_triangulate(const loxo_soup *soup, const loxo_index *corner, int64_t n_corners, void *room,
                              loxo_index *triangle)
{
    polygon p = {.corner = corner, .n = n_corners, .n_left = n_corners, .triangle = triangle, .is_certain = true};
    unsigned char *rest = room;
    if (n_corners == 3) {
        fan(&p, triangle);
        return true;
    }
    p.point = (double(*)[2])room;
    p.previous = (int64_t *)(void *)(rest + (size_t)n_corners * sizeof *p.point);
    p.next = p.previous + n_corners;
    p.cell_next = p.next + n_corners;
    p.cell_first = p.cell_next + n_corners;
    p.is_dent = (bool *)(p.cell_first + cells_along_side(n_corners) * cells_along_side(n_corners));
    p.is_in_cell = p.is_dent + n_corners;
    if (!project(soup, &p)) {
        fan(&p, triangle);
        return false;
    }
    if (is_convex(&p)) {
        fan(&p, triangle);
        return true;
    }
    p.is_certain = turns_once(&p);
    lay_grid(&p);
    for (int64_t k = 0; k < p.n; ++k) {
        p.previous[k] = k == 0 ? p.n - 1 : k - 1;
        p.next[k] = k + 1 == p.n ? 0 : k + 1;
        p.is_in_cell[k] = false;
    }
    for (int64_t k = 0; k < p.n; ++k)
        look_at(&p, k);
    cut_ears(&p);
    return p.is_certain;
}
