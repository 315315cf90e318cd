/* SPDX-License-Identifier: MIT
 * Ways back to the sources: by the method itself, or down the distances and then drawn tight. */
#include "base/allocate.h"
#include "mesh/lines/descent.h"
#include "mesh/lines/straighten.h"
#include "solver/geodesic/geodesic_internal.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

/* What ways are found in. engine NULL: by the distances. */
typedef struct path_finder {
    const geodesic_problem *problem;
    const geodesic_engine *engine;
    void *state;
    const double *distance; /* mesh's order */
    line_goal *goal;
    line_descent *descent;
    line_way way;
    line_straightener straightener;
} path_finder;

static double distance_at(const path_finder *p, const geodesic_seed *at)
{
    double sum = 0.0;
    if (at->vertex >= 0) return p->distance[at->vertex];
    for (int k = 0; k < 3; ++k)
        if (at->weight[k] > 0.0)
            sum += at->weight[k] * p->distance[p->problem->m.halfedge_vertex[(int64_t)3 * at->face + k]];
    return sum;
}

static line_goal goal_of(const geodesic_seed *seed)
{
    return (line_goal){seed->vertex, seed->face, {seed->weight[0], seed->weight[1], seed->weight[2]}};
}

static loxo_status begin(path_finder *p, const geodesic_seed *seeds, int64_t n_seeds)
{
    if (p->engine != NULL) return LOXO_OK;
    p->way = (line_way){.ctx = p->problem->ctx};
    line_straightener_begin(p->problem->ctx, &p->problem->m, &p->straightener);
    p->goal = loxo_allocate(p->problem->ctx, n_seeds, sizeof *p->goal);
    if (p->goal == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n_seeds; ++i)
        p->goal[i] = goal_of(&seeds[i]);
    return line_descent_begin(p->problem->ctx, &p->problem->m, p->distance, p->goal, n_seeds, &p->descent);
}

static void end(path_finder *p)
{
    if (p->engine != NULL) return;
    line_descent_end(p->descent);
    line_way_destroy(&p->way);
    line_straightener_end(&p->straightener);
    loxo_release(p->problem->ctx, p->goal);
}

/* The failure speaks of a source or a point: what seeds are made of. */
static loxo_status fail_target(loxo_context *ctx, loxo_status status)
{
    const loxo_failure failure = *loxo_context_failure(ctx);
    const loxo_place place = {.byte = -1, .element = failure.element};
    if (status != LOXO_ERR_ARGUMENT && status != LOXO_ERR_MESH) return status;
    return loxo_fail_at(ctx, status, place, "target %" PRId64 ": %s", failure.element, failure.text);
}

static loxo_status trace(path_finder *p, const geodesic_seed *from, line_builder *builder)
{
    if (p->engine != NULL) return p->engine->trace(p->state, from, builder);
    const line_goal start = goal_of(from);
    const loxo_status status = line_descend(p->descent, &start, &p->way);
    return status < 0 ? status : line_straighten(&p->straightener, &p->way, builder);
}

/* One target may be several seeds after a repair: the nearest of them, and where distances were given by the caller's numbers,
 * which all copies of a vertex share, the nearest from which a way leads on. from is put in that order. */
static loxo_status find_path(path_finder *p, geodesic_seed *from, int64_t n, int64_t i, line_builder *builder)
{
    loxo_context *ctx = p->problem->ctx;
    const loxo_place place = {.byte = -1, .element = i};
    loxo_status status = LOXO_ERR_ARGUMENT;
    if (n == 0) return line_end_none(builder, HUGE_VAL); /* no face has it */
    for (int64_t k = 0; k < n; ++k) {
        int64_t best = k;
        for (int64_t j = k + 1; j < n; ++j)
            if (distance_at(p, &from[j]) < distance_at(p, &from[best])) best = j;
        const geodesic_seed seed = from[best];
        from[best] = from[k];
        from[k] = seed;
        const double distance = distance_at(p, &seed);
        if (k == 0 && !isfinite(distance)) return line_end_none(builder, HUGE_VAL);
        if (!isfinite(distance)) break;
        status = trace(p, &seed, builder);
        if (status >= 0) return line_end_way(builder, distance);
        if (status != LOXO_ERR_ARGUMENT) return status;
    }
    const loxo_failure failure = *loxo_context_failure(ctx);
    return loxo_fail_at(ctx, status, place, "target %" PRId64 ": %s", i, failure.text);
}

static loxo_status find_paths(path_finder *p, const geodesic_seed *seeds, int64_t n_seeds,
                              const loxo_surface_point *targets, int64_t n_targets, loxo_polylines *lines)
{
    loxo_context *ctx = p->problem->ctx;
    line_builder builder;
    geodesic_seed *from = NULL;
    int64_t *from_begin = NULL;
    loxo_status status = geodesic_seeds_by_point(p->problem, targets, n_targets, false, &from, &from_begin);
    if (status < 0) status = fail_target(ctx, status);
    if (status >= 0) status = line_builder_begin(ctx, &p->problem->m, &builder);
    if (status < 0) goto done;
    status = begin(p, seeds, n_seeds);
    for (int64_t i = 0; i < n_targets && status >= 0; ++i) {
        status = find_path(p, &from[from_begin[i]], from_begin[i + 1] - from_begin[i], i, &builder);
        if (status >= 0 && loxo_stop_wanted(ctx, "paths", (double)i / (double)n_targets))
            status = loxo_fail(ctx, LOXO_ERR_STOPPED, "geodesic: stopped while ways were traced");
    }
    end(p);
    if (status < 0)
        loxo_polylines_destroy(ctx, &builder.lines);
    else
        *lines = builder.lines;
done:
    loxo_release(ctx, from_begin);
    loxo_release(ctx, from);
    return status;
}

loxo_status loxo_geodesic_paths(loxo_geodesic *geodesic, const loxo_surface_point *targets, int64_t n_targets,
                                loxo_polylines *lines)
{
    if (geodesic == NULL || lines == NULL) return LOXO_ERR_ARGUMENT;
    const loxo_geodesic *g = geodesic;
    const bool is_known = g->engine->trace != NULL;
    path_finder p = {
        .problem = &g->problem, .engine = is_known ? g->engine : NULL, .state = g->state, .distance = g->distance};
    *lines = (loxo_polylines){0};
    if (!g->is_solved) return loxo_fail(g->problem.ctx, LOXO_ERR_ARGUMENT, "geodesic: no ways before the first solve");
    if (targets == NULL || n_targets < 1)
        return loxo_fail(g->problem.ctx, LOXO_ERR_ARGUMENT, "geodesic: there is no target");
    if (g->problem.m.halfedge_length != NULL) /* its edges are not straight between their ends */
        return loxo_fail(g->problem.ctx, LOXO_ERR_UNSUPPORTED,
                         "geodesic: ways on an intrinsic triangulation: trace them on its surface");
    return find_paths(&p, g->seeds, g->n_seeds, targets, n_targets, lines);
}

loxo_status loxo_geodesic_trace(loxo_context *ctx, const loxo_mesh *mesh, const double *distance,
                                const loxo_surface_point *sources, int64_t n_sources, const loxo_surface_point *targets,
                                int64_t n_targets, loxo_polylines *lines)
{
    if (ctx == NULL || lines == NULL) return LOXO_ERR_ARGUMENT;
    *lines = (loxo_polylines){0};
    if (mesh == NULL || distance == NULL || targets == NULL || n_targets < 1)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: no mesh, no distances or no target");
    const geodesic_problem problem = {.ctx = ctx, .mesh = mesh, .m = loxo_mesh_get_view(mesh)};
    const loxo_index *origin = problem.m.vertex_origin;
    geodesic_seed *seeds = NULL;
    int64_t n_seeds = 0;
    if (problem.m.halfedge_length != NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: ask the surface of an intrinsic triangulation");
    loxo_status status = geodesic_seeds_from_points(&problem, sources, n_sources, &seeds, &n_seeds);
    if (status < 0) return status;
    double *own = origin != NULL ? loxo_allocate(ctx, problem.m.n_vertices, sizeof *own) : NULL;
    if (origin != NULL && own == NULL) status = LOXO_ERR_MEMORY;
    for (int64_t v = 0; v < problem.m.n_vertices && own != NULL; ++v)
        own[v] = distance[origin[v]];
    path_finder p = {.problem = &problem, .distance = own != NULL ? own : distance};
    if (status >= 0) status = find_paths(&p, seeds, n_seeds, targets, n_targets, lines);
    loxo_release(ctx, own);
    loxo_release(ctx, seeds);
    return status;
}
