/* SPDX-License-Identifier: MIT
 * Many solves with one preparation: farthest points, each solve only as far as it can change anything, and matrices of
 * distances between points. */
#include "base/allocate.h"
#include "kernel/unfold_kernel.h"
#include "par/range.h"
#include "solver/geodesic/geodesic_internal.h"

#include <inttypes.h>
#include <math.h>

/* One solve of a series: no check, no caller's order. Keeps the worst of the statuses that are not failures. */
static loxo_status solve_one(loxo_geodesic *g, const geodesic_seed *seeds, int64_t n_seeds, loxo_status *worst)
{
    loxo_geodesic_info info = {0};
    g->is_solved = false; /* what is left behind is not the solve of a call */
    const loxo_status status = g->engine->solve(g->state, seeds, n_seeds, g->distance, NULL, &info);
    if (status == LOXO_STOPPED) return loxo_fail(g->problem.ctx, LOXO_ERR_STOPPED, "geodesic: stopped between solves");
    if (status > 0) *worst = status;
    return status < 0 ? status : LOXO_OK;
}

/* ---- farthest points ----------------------------------------------------------------------------------------- */

typedef struct sampling {
    loxo_geodesic *g;
    double *least; /* [n_vertices] distance to the nearest of the points so far */
} sampling;

/* least takes in the distances of the last solve. A vertex without a number would be farthest for ever. */
static loxo_status take_in(const sampling *s)
{
    const loxo_geodesic *g = s->g;
    int64_t n_touched = 0;
    const loxo_index *touched = g->engine->touched != NULL ? g->engine->touched(g->state, &n_touched) : NULL;
    const int64_t n = touched != NULL ? n_touched : g->problem.m.n_vertices;
    int64_t n_bad = 0;
#pragma omp parallel num_threads(loxo_threads_for(g->problem.ctx, n, 1.0)) reduction(+ : n_bad)
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const int64_t v = touched != NULL ? touched[i] : i;
            if (g->distance[v] < s->least[v]) s->least[v] = g->distance[v];
            n_bad += isnan(g->distance[v]) ? 1 : 0;
        }
    }
    if (n_bad == 0) return LOXO_OK;
    return loxo_fail(g->problem.ctx, LOXO_ERR_NUMERIC, "geodesic: %" PRId64 " distances are not finite", n_bad);
}

static int64_t caller_vertex(const loxo_mesh_view *m, int64_t v)
{
    return m->vertex_origin != NULL ? m->vertex_origin[v] : v;
}

/* Of equally far ones the caller's lowest. */
static bool is_farther(const sampling *s, int64_t a, int64_t b)
{
    if (b < 0) return true;
    if (s->least[a] != s->least[b]) return s->least[a] > s->least[b];
    return caller_vertex(&s->g->problem.m, a) < caller_vertex(&s->g->problem.m, b);
}

static int64_t find_farthest(const sampling *s)
{
    const loxo_mesh_view *m = &s->g->problem.m;
    int64_t farthest = -1;
#pragma omp parallel num_threads(loxo_threads_for(s->g->problem.ctx, m->n_vertices, 1.0))
    {
        const loxo_range r = loxo_thread_range(m->n_vertices);
        int64_t own = -1;
        for (int64_t v = r.begin; v < r.end; ++v)
            if (m->vertex_halfedge[v] >= 0 && is_farther(s, v, own)) own = v;
#pragma omp critical(loxo_geodesic_farthest)
        if (own >= 0 && is_farther(s, own, farthest)) farthest = own;
    }
    return farthest;
}

static loxo_status add_points(sampling *s, const loxo_index *points, int64_t n, loxo_status *worst)
{
    geodesic_seed *seeds = NULL;
    int64_t n_seeds = 0;
    loxo_status status = geodesic_seeds_from_vertices(&s->g->problem, points, n, &seeds, &n_seeds);
    if (status >= 0) status = solve_one(s->g, seeds, n_seeds, worst);
    loxo_release(s->g->problem.ctx, seeds);
    return status < 0 ? status : take_in(s);
}

static loxo_status sample(sampling *s, int64_t n_start, int64_t n_points, loxo_index *point, double *radius)
{
    loxo_geodesic *g = s->g;
    loxo_context *ctx = g->problem.ctx;
    const double limit = g->problem.settings.max_distance;
    loxo_status worst = LOXO_OK, status = add_points(s, point, n_start, &worst);
    for (int64_t i = n_start; status >= 0; ++i) {
        const int64_t v = find_farthest(s);
        for (int64_t k = i == n_start ? 0 : i - 1; k < i; ++k)
            if (radius != NULL) radius[k] = s->least[v];
        if (i == n_points) break;
        if (!(s->least[v] > 0.0)) {
            status = loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = i},
                                  "geodesic: there are no more than %" PRId64 " points apart", i);
            break;
        }
        point[i] = (loxo_index)caller_vertex(&g->problem.m, v);
        g->problem.settings.max_distance = fmin(limit, s->least[v]); /* beyond, nothing is nearer to the new point */
        status = add_points(s, &point[i], 1, &worst);
        if (status >= 0 && loxo_stop_wanted(ctx, "farthest points", (double)i / (double)n_points))
            status = loxo_fail(ctx, LOXO_ERR_STOPPED, "geodesic: stopped between solves");
    }
    g->problem.settings.max_distance = limit;
    return status < 0 ? status : worst;
}

loxo_status loxo_geodesic_farthest_points(loxo_geodesic *geodesic, const loxo_index *start, int64_t n_start,
                                          int64_t n_points, loxo_index *point, double *radius, double *distance)
{
    if (geodesic == NULL) return LOXO_ERR_ARGUMENT;
    loxo_context *ctx = geodesic->problem.ctx;
    const int64_t n = geodesic->problem.m.n_vertices;
    sampling s = {.g = geodesic};
    if (start == NULL || n_start < 1)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: there is no point to start from");
    if (point == NULL || n_points < n_start)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: fewer points are wanted than are given");
    loxo_progress_begin(ctx);
    s.least = loxo_allocate(ctx, n, sizeof *s.least);
    if (s.least == NULL) return LOXO_ERR_MEMORY;
    for (int64_t v = 0; v < n; ++v)
        s.least[v] = HUGE_VAL;
    for (int64_t i = 0; i < n_start; ++i)
        point[i] = start[i];
    const loxo_status status = sample(&s, n_start, n_points, point, radius);
    if (status >= 0 && distance != NULL) loxo_mesh_scatter_to_caller(geodesic->problem.mesh, s.least, distance);
    loxo_release(ctx, s.least);
    return status;
}

/* ---- matrices ------------------------------------------------------------------------------------------------ */

/* A point that is no vertex, as each face that it lies in sees it: two inside an inner edge. Returns how many. */
static int seen_by_faces(const loxo_mesh_view *m, const geodesic_seed *seed, geodesic_seed seen[2])
{
    seen[0] = *seed;
    for (int k = 0; k < 3; ++k) {
        const loxo_index h = (loxo_index)((int64_t)3 * seed->face + k), twin = m->halfedge_twin[h];
        if (seed->weight[k == 0 ? 2 : k - 1] > 0.0 || twin < 0) continue;
        seen[1] = (geodesic_seed){.vertex = -1, .face = (loxo_index)(twin / 3), .source = seed->source};
        seen[1].weight[twin % 3] = seed->weight[k == 2 ? 0 : k + 1];
        seen[1].weight[k_next(twin) % 3] = seed->weight[k];
        return 2;
    }
    return 1;
}

/* Straight over the face of `to`, from a seed that names it or is one of its corners; HUGE_VAL: neither. */
static double across_face(const loxo_mesh_view *m, const geodesic_seed *from, const geodesic_seed *to)
{
    double length[3], least = HUGE_VAL;
    if (from->vertex < 0 && from->face != to->face) return HUGE_VAL;
    k_face_lengths(m, to->face, length);
    const k_layout face = k_layout_of(length);
    if (from->vertex < 0) {
        const double b = to->weight[1] - from->weight[1], c = to->weight[2] - from->weight[2];
        const double x = b * face.x1 + c * face.x2, y = c * face.y2;
        return sqrt(x * x + y * y);
    }
    for (int k = 0; k < 3; ++k)
        if (m->halfedge_vertex[(int64_t)3 * to->face + k] == from->vertex)
            least = fmin(least, k_distance_to_corner(face, to->weight, k));
    return least;
}

/* Straight from a seed to a point that is no vertex, over a face that has both; HUGE_VAL: none has. */
static double straight(const loxo_mesh_view *m, const geodesic_seed *from, const geodesic_seed *to)
{
    geodesic_seed from_face[2] = {*from, *from}, to_face[2];
    double least = HUGE_VAL;
    const int n_from = from->vertex >= 0 ? 1 : seen_by_faces(m, from, from_face), n_to = seen_by_faces(m, to, to_face);
    for (int i = 0; i < n_from; ++i)
        for (int j = 0; j < n_to; ++j)
            least = fmin(least, across_face(m, &from_face[i], &to_face[j]));
    return least;
}

/* From the distances of a face's corners to a point in it: along it from a corner, or straight through an edge from a point that
 * is as far from both of its ends as they say. */
static double through_face(const loxo_mesh_view *m, const double *distance, const geodesic_seed *to)
{
    double length[3], own[3], away[3], least = HUGE_VAL;
    k_face_lengths(m, to->face, length);
    const k_layout face = k_layout_of(length);
    for (int k = 0; k < 3; ++k) {
        own[k] = distance[m->halfedge_vertex[(int64_t)3 * to->face + k]];
        away[k] = k_distance_to_corner(face, to->weight, k);
        least = fmin(least, own[k] + away[k]);
    }
    for (int k = 0; k < 3; ++k) {
        const int next = k == 2 ? 0 : k + 1;
        if (m->halfedge_twin[(int64_t)3 * to->face + k] < 0) continue; /* nothing comes from beyond a boundary */
        least = fmin(least, k_unfolded_distance(length[k], away[k], away[next], own[k], own[next], 0.0, 0.0));
    }
    return least;
}

/* The distance at a point: from those of its face's corners, or straight from a source in its face. */
static double distance_at(const loxo_geodesic *g, const geodesic_seed *from, int64_t n_from, const geodesic_seed *to)
{
    double sum = 0.0;
    if (to->vertex >= 0) return g->distance[to->vertex];
    for (int k = 0; k < 3; ++k)
        if (to->weight[k] > 0.0)
            sum += to->weight[k] * g->distance[g->problem.m.halfedge_vertex[(int64_t)3 * to->face + k]];
    if (isnan(sum)) return sum;
    double least = HUGE_VAL;
    geodesic_seed seen[2];
    const int n_seen = seen_by_faces(&g->problem.m, to, seen);
    for (int k = 0; k < n_seen && sum < HUGE_VAL; ++k) /* else a corner was not reached */
        least = fmin(least, through_face(&g->problem.m, g->distance, &seen[k]));
    for (int64_t i = 0; i < n_from; ++i)
        least = fmin(least, straight(&g->problem.m, &from[i], to));
    return least;
}

loxo_status loxo_geodesic_matrix(loxo_geodesic *geodesic, const loxo_surface_point *points, int64_t n, double *matrix)
{
    if (geodesic == NULL) return LOXO_ERR_ARGUMENT;
    loxo_geodesic *g = geodesic;
    loxo_context *ctx = g->problem.ctx;
    geodesic_seed *seeds = NULL;
    int64_t *begin = NULL;
    loxo_status worst = LOXO_OK;
    if (matrix == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: the output array is NULL");
    loxo_status status = geodesic_seeds_by_point(&g->problem, points, n, true, &seeds, &begin);
    loxo_progress_begin(ctx);
    for (int64_t i = 0; i < n && status >= 0; ++i) {
        const geodesic_seed *from = &seeds[begin[i]];
        const int64_t n_from = begin[i + 1] - begin[i];
        status = solve_one(g, from, n_from, &worst);
        for (int64_t j = 0; j < n && status >= 0; ++j) {
            double least = i == j ? 0.0 : HUGE_VAL;
            for (int64_t k = begin[j]; k < begin[j + 1]; ++k) {
                const double distance = distance_at(g, from, n_from, &seeds[k]);
                if (isnan(distance))
                    status = loxo_fail_at(ctx, LOXO_ERR_NUMERIC, (loxo_place){.byte = -1, .element = i},
                                          "geodesic: a distance from point %" PRId64 " is not finite", i);
                least = fmin(least, distance);
            }
            matrix[i * n + j] = i == j ? 0.0 : least;
        }
        if (status >= 0 && loxo_stop_wanted(ctx, "matrix", (double)i / (double)n))
            status = loxo_fail(ctx, LOXO_ERR_STOPPED, "geodesic: stopped between solves");
    }
    loxo_release(ctx, begin);
    loxo_release(ctx, seeds);
    return status < 0 ? status : worst;
}
