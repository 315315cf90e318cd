/* SPDX-License-Identifier: MIT
 * Polyhedral distances of small meshes by another way: all straight lines from a point to vertices, through any sequence
 * of faces, found by unfolding one after the other into the plane of the first without discarding any for being long; then
 * Dijkstra's algorithm over vertices, as shortest ways are chains of such lines. In long double. Slow. */
#ifndef LOXO_TESTS_SOLVER_STRAIGHT_LINES_H
#define LOXO_TESTS_SOLVER_STRAIGHT_LINES_H

#include "test.h"

#include <loxo/geodesic.h>

typedef struct plane_point {
    long double x, y;
} plane_point;

typedef struct lines_surface {
    int n_vertices, n_faces;
    const loxo_index *triangle;
    long double *length; /* [n_faces][3] of edge k, from corner k to the next */
    plane_point
        *third; /* [n_faces][3] the third corner, where edge k runs from 0 along x: (x, its distance from the line) */
    int *twin;  /* [n_faces][3] 3 * face + edge, -1 at a boundary */
} lines_surface;

static inline plane_point plane_add(plane_point a, long double s, plane_point b)
{
    return (plane_point){a.x + s * b.x, a.y + s * b.y};
}

static inline long double plane_cross(plane_point a, plane_point b) { return a.x * b.y - a.y * b.x; }

static inline long double plane_norm(plane_point a) { return sqrtl(a.x * a.x + a.y * a.y); }

static inline void difference(const loxo_soup *soup, loxo_index from, loxo_index to, long double d[3])
{
    for (int k = 0; k < 3; ++k)
        d[k] = (long double)soup->position[3 * to + k] - (long double)soup->position[3 * from + k];
}

static inline long double dot3(const long double a[3], const long double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Edges by comparing all with all; shapes from positions, so that faces without height have none. */
static inline lines_surface lines_surface_make(const loxo_soup *soup)
{
    lines_surface s = {(int)soup->n_vertices, (int)soup->n_faces, soup->triangle, NULL, NULL, NULL};
    const int n = 3 * s.n_faces;
    s.length = calloc((size_t)n, sizeof *s.length);
    s.third = calloc((size_t)n, sizeof *s.third);
    s.twin = calloc((size_t)n, sizeof *s.twin);
    CHECK(s.length != NULL && s.third != NULL && s.twin != NULL);
    for (int e = 0; e < n; ++e) {
        const loxo_index a = s.triangle[e], b = s.triangle[e - e % 3 + (e + 1) % 3];
        const loxo_index c = s.triangle[e - e % 3 + (e + 2) % 3];
        long double ab[3], ac[3], cross[3];
        difference(soup, a, b, ab);
        difference(soup, a, c, ac);
        for (int k = 0; k < 3; ++k)
            cross[k] = ab[(k + 1) % 3] * ac[(k + 2) % 3] - ab[(k + 2) % 3] * ac[(k + 1) % 3];
        s.length[e] = sqrtl(dot3(ab, ab));
        s.third[e] = (plane_point){dot3(ab, ac) / s.length[e], sqrtl(dot3(cross, cross)) / s.length[e]};
        s.twin[e] = -1;
        for (int f = 0; f < n; ++f)
            if (s.triangle[f] == b && s.triangle[f - f % 3 + (f + 1) % 3] == a) s.twin[e] = f;
    }
    return s;
}

static inline void lines_surface_destroy(lines_surface *s)
{
    free(s->length);
    free(s->third);
    free(s->twin);
}

/* The third corner of the face of an edge that runs from a to b, on the left of it. */
static inline plane_point third_corner(const lines_surface *s, int edge, plane_point a, plane_point b)
{
    const plane_point along = {(b.x - a.x) / s->length[edge], (b.y - a.y) / s->length[edge]};
    return plane_add(plane_add(a, s->third[edge].x, along), s->third[edge].y, (plane_point){-along.y, along.x});
}

typedef struct cone {
    int edge;             /* that it leaves a face by, from a to b, its origin on the left */
    plane_point a, b;     /* unfolded */
    plane_point from, to; /* directions, counter-clockwise, between which it is */
} cone;

static inline long double distance_to_segment(plane_point a, plane_point b)
{
    const plane_point e = {b.x - a.x, b.y - a.y};
    const long double square = e.x * e.x + e.y * e.y, t = square > 0.0L ? -(a.x * e.x + a.y * e.y) / square : 0.0L;
    return plane_norm(plane_add(a, t < 0.0L ? 0.0L : t > 1.0L ? 1.0L : t, e));
}

/* More than one ray; half a turn is open, too: its origin lies on a face's edge. */
static inline bool is_open(cone c)
{
    return plane_cross(c.from, c.to) > 0.0L || c.from.x * c.to.x + c.from.y * c.to.y < 0.0L;
}

static inline void line_to(long double *line, loxo_index vertex, plane_point at)
{
    const long double d = plane_norm(at);
    if (d < line[vertex]) line[vertex] = d;
}

/* Follows a cone through all faces up to limit; line[v] takes the shortest line met. Returns the number of cones. */
static inline int64_t follow_cone(const lines_surface *s, cone first, long double limit, long double *line)
{
    static cone stack[100000];
    int n = 0;
    int64_t n_cones = 0;
    stack[n++] = first;
    while (n > 0) {
        const cone c = stack[--n];
        const int in = s->twin[c.edge];
        n_cones += 1;
        if (in < 0 || distance_to_segment(c.a, c.b) > limit) continue;
        /* The face behind has its edges in from b to a, then from a to its third corner, then to b. */
        const int face = in / 3, left_edge = 3 * face + (in + 1) % 3, right_edge = 3 * face + (in + 2) % 3;
        const plane_point third = third_corner(s, in, c.b, c.a);
        const bool above = plane_cross(c.from, third) >= 0.0L, below = plane_cross(third, c.to) >= 0.0L;
        if (above && below) line_to(line, s->triangle[right_edge], third);
        CHECK(n + 2 <= 100000);
        const cone left = {left_edge, c.a, third, c.from, below ? third : c.to};
        const cone right = {right_edge, third, c.b, above ? third : c.from, c.to};
        if (above && is_open(left)) stack[n++] = left;
        if (below && is_open(right)) stack[n++] = right;
    }
    return n_cones;
}

/* Lines from a vertex. */
static inline int64_t lines_from_vertex(const lines_surface *s, int vertex, long double limit, long double *line)
{
    int64_t n = 0;
    for (int e = 0; e < 3 * s->n_faces; ++e) {
        if (s->triangle[e] != vertex) continue;
        const int next = e - e % 3 + (e + 1) % 3, last = e - e % 3 + (e + 2) % 3;
        const plane_point origin = {0.0L, 0.0L}, a = {s->length[e], 0.0L};
        const plane_point b = third_corner(s, e, origin, a);
        line_to(line, s->triangle[next], a);
        line_to(line, s->triangle[last], b);
        n += follow_cone(s, (cone){next, a, b, a, b}, limit, line);
    }
    return n;
}

/* Lines from a point inside a face or on its edges. */
static inline int64_t lines_from_point(const lines_surface *s, int face, const double weight[3], long double limit,
                                       long double *line)
{
    const plane_point a = {0.0L, 0.0L}, b = {s->length[3 * face], 0.0L};
    const plane_point c = third_corner(s, 3 * face, a, b);
    plane_point corner[3] = {a, b, c}, at = {0.0L, 0.0L};
    int64_t n = 0;
    for (int k = 0; k < 3; ++k)
        at = plane_add(at, (long double)weight[k], corner[k]);
    for (int k = 0; k < 3; ++k) {
        corner[k] = plane_add(corner[k], -1.0L, at);
        line_to(line, s->triangle[3 * face + k], corner[k]);
    }
    for (int k = 0; k < 3; ++k)
        n += follow_cone(s, (cone){3 * face + k, corner[k], corner[(k + 1) % 3], corner[k], corner[(k + 1) % 3]}, limit,
                         line);
    return n;
}

/* Where a distance starts: a vertex (face < 0), or a point of a face. */
typedef struct lines_source {
    int vertex, face;
    double weight[3];
} lines_source;

/* distance [n_vertices] out, HUGE_VAL where nothing reaches. Returns the number of cones. */
static inline int64_t straight_line_distances(const lines_surface *s, const lines_source *sources, int n_sources,
                                              double *distance)
{
    const int n = s->n_vertices;
    long double *best = calloc((size_t)n, sizeof *best), *line = calloc((size_t)n, sizeof *line), limit = 0.0L;
    bool *done = calloc((size_t)n, sizeof *done);
    int64_t n_cones = 0;
    CHECK(best != NULL && line != NULL && done != NULL);
    for (int v = 0; v < n; ++v)
        best[v] = HUGE_VALL;
    for (int i = 0; i < n_sources; ++i) {
        if (sources[i].face < 0)
            best[sources[i].vertex] = 0.0L;
        else /* the corners bound the limit */
            n_cones += lines_from_point(s, sources[i].face, sources[i].weight, 0.0L, best);
    }
    for (bool changed = true; changed;) { /* along edges: how far it can be */
        changed = false;
        for (int e = 0; e < 3 * s->n_faces; ++e) {
            const loxo_index a = s->triangle[e], b = s->triangle[e - e % 3 + (e + 1) % 3];
            if (best[a] + s->length[e] < best[b]) best[b] = best[a] + s->length[e], changed = true;
            if (best[b] + s->length[e] < best[a]) best[a] = best[b] + s->length[e], changed = true;
        }
    }
    for (int v = 0; v < n; ++v)
        if (best[v] < HUGE_VALL && best[v] > limit) limit = best[v];
    for (int i = 0; i < n_sources; ++i)
        if (sources[i].face >= 0) n_cones += lines_from_point(s, sources[i].face, sources[i].weight, limit, best);
    for (;;) {
        int p = -1;
        for (int v = 0; v < n; ++v)
            if (!done[v] && best[v] < HUGE_VALL && (p < 0 || best[v] < best[p])) p = v;
        if (p < 0) break;
        done[p] = true;
        limit = 0.0L;
        for (int v = 0; v < n; ++v) {
            line[v] = HUGE_VALL;
            if (!done[v] && best[v] < HUGE_VALL && best[v] - best[p] > limit) limit = best[v] - best[p];
        }
        n_cones += lines_from_vertex(s, p, limit, line);
        for (int v = 0; v < n; ++v)
            if (best[p] + line[v] < best[v]) best[v] = best[p] + line[v];
    }
    for (int v = 0; v < n; ++v)
        distance[v] = best[v] < HUGE_VALL ? (double)best[v] : HUGE_VAL;
    free(best);
    free(line);
    free(done);
    return n_cones;
}

#endif
