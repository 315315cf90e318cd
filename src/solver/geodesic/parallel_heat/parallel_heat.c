/* SPDX-License-Identifier: MIT
 * The parallel heat method, edge- and face-based: create once, solve for many sets of sources. A solve reads like
 * Algorithm 1 of the paper. */
#include "base/allocate.h"
#include "base/os.h"
#include "kernel/descent_kernel.h"
#include "par/range.h"
#include "solver/geodesic/parallel_heat/tree.h"

#include <inttypes.h>
#include <math.h>

#define TOLERANCE_OF_ORDER 0.1
#define RING_SHARE         5     /* sixteenths of the places whose rows fit into the rings, */
#define LEAST_RING         65536 /* but so many places at least */

void heat_clock(parallel_heat *g, loxo_geodesic_phase phase, loxo_geodesic_info *info)
{
    const double now = loxo_os_clock_s();
    info->phase_s[phase] += now - g->clock_s;
    g->clock_s = now;
}

bool heat_tell_iteration(parallel_heat *g, int64_t iteration, const loxo_geodesic_info *info)
{
    const loxo_progress p = {.phase = "ADMM",
                             .fraction = (double)iteration / (double)g->settings.n_iterations,
                             .iteration = iteration,
                             .n_iterations = g->settings.n_iterations,
                             .objective = info->objective,
                             .residual = info->residual};
    return loxo_progress_tell(g->ctx, &p, false);
}

bool heat_unfolds(const loxo_geodesic_settings *settings)
{
    const loxo_geodesic_settings defaults = loxo_geodesic_settings_default();
    const bool has_changed = settings->penalty != defaults.penalty || settings->n_iterations != defaults.n_iterations ||
                             settings->primal_tolerance != defaults.primal_tolerance ||
                             settings->dual_tolerance != defaults.dual_tolerance;
    if (settings->method != LOXO_GEODESIC_EDGE || settings->global_constraints) return false;
    return settings->recovery == LOXO_RECOVERY_UNFOLD || (settings->recovery == LOXO_RECOVERY_AUTO && !has_changed);
}

double heat_tolerance(const loxo_geodesic_settings *settings)
{
    const double usual = loxo_geodesic_settings_default().diffusion_tolerance;
    if (settings->diffusion_tolerance != usual || !heat_unfolds(settings)) return settings->diffusion_tolerance;
    return TOLERANCE_OF_ORDER;
}

/* A window is some hundred levels wide, and a part of a large mesh. All places, and one more a level, where the settling
 * needs them or every level is to stay. */
static void lay_out_rings(parallel_heat *g)
{
    const int64_t n = g->m.n_vertices, n_entries = 3 * g->m.n_faces + g->n_boundary_edges, part = RING_SHARE * (n / 16);
    const int64_t most = n + n / 4 + 64, wanted = part > LEAST_RING ? part : LEAST_RING;
    const bool is_whole =
        g->settings.diffusion == LOXO_DIFFUSION_SWEEPS || !heat_unfolds(&g->settings) || wanted >= most;
    g->n_ring_rows = is_whole ? most : wanted;
    g->n_ring_entries = is_whole ? n_entries : (int64_t)((double)n_entries * ((double)wanted / (double)n));
    g->ring_row = loxo_arena_take(&g->arena, g->n_ring_rows, sizeof *g->ring_row);
    g->ring_entry = loxo_arena_take(&g->arena, g->n_ring_entries, sizeof *g->ring_entry);
}

/* Hands out the workspace; while the arena has no block this only adds up its size. What the diffusion and the recovery
 * use stands in the same place. */
void heat_lay_out(parallel_heat *g)
{
    loxo_arena *a = &g->arena;
    const int64_t n = g->m.n_vertices, n_faces = g->m.n_faces;
    g->most_levels = n < 1024 ? n : 1024 + n / 64; /* few surfaces have more */
    g->level_begin = loxo_arena_take(a, g->most_levels + 1, sizeof *g->level_begin);
    g->order = loxo_arena_take(a, n, sizeof *g->order);
    g->rank = loxo_arena_take(a, n, sizeof *g->rank);
    g->loose_begin = loxo_arena_mark(a);
    g->parent = loxo_arena_take(a, n, sizeof *g->parent);
    g->value = loxo_arena_take(a, 2 * n, sizeof *g->value);
    g->scale = loxo_arena_take(a, n, sizeof *g->scale);

    const size_t mark = loxo_arena_mark(a);
    g->first = loxo_arena_take(a, n, sizeof *g->first);
    g->n_ring = n / BLOCK_ROWS + MAX_UPDATES + 100;
    g->change = loxo_arena_take(a, g->n_ring, sizeof *g->change);
    g->reach = loxo_arena_take(a, g->n_ring, sizeof *g->reach);
    g->degree = (uint32_t *)(void *)g->first;
    lay_out_rings(g);

    loxo_arena_release(a, mark);
    if (heat_unfolds(&g->settings)) {
        g->distance = loxo_arena_take(a, n, sizeof *g->distance);
        g->heat_key = loxo_arena_take(a, n, sizeof *g->heat_key);
        g->waits_for = loxo_arena_take(a, n, sizeof *g->waits_for);
        g->queue = g->order;
        return;
    }
    g->found_by = loxo_arena_take(a, n, sizeof *g->found_by);
    const size_t recovery = loxo_arena_mark(a);
    if (g->settings.method == LOXO_GEODESIC_EDGE) {
        g->vertex_value = loxo_arena_take(a, n, sizeof *g->vertex_value);
        g->vertex_scale = loxo_arena_take(a, n, sizeof *g->vertex_scale);
        const size_t heat_end = loxo_arena_mark(a);
        loxo_arena_release(a, recovery);
        g->closure = loxo_arena_take(a, n_faces, sizeof *g->closure);
        const size_t closure_end = loxo_arena_mark(a), start = closure_end > heat_end ? closure_end : heat_end;
        loxo_arena_release(a, start);
        g->difference = loxo_arena_take(a, 3 * n_faces, sizeof *g->difference);
        loxo_arena_release(a, start);
        g->multiplier = loxo_arena_take(a, n_faces, sizeof *g->multiplier);
        g->potential[0] = loxo_arena_take(a, n_faces, sizeof *g->potential[0]);
        g->potential[1] = loxo_arena_take(a, n_faces, sizeof *g->potential[1]);
    } else {
        g->face_area = loxo_arena_take(a, n_faces, sizeof *g->face_area);
        g->side_square = loxo_arena_take(a, n_faces, sizeof *g->side_square);
        g->target = loxo_arena_take(a, n_faces, sizeof *g->target);
        g->face_gradient = loxo_arena_take(a, n_faces, sizeof *g->face_gradient);
        g->push[0] = loxo_arena_take(a, 3 * n_faces, sizeof *g->push[0]);
        const size_t start = loxo_arena_mark(a);
        g->vertex_value = loxo_arena_take(a, n, sizeof *g->vertex_value);
        g->vertex_scale = loxo_arena_take(a, n, sizeof *g->vertex_scale);
        loxo_arena_release(a, start);
        g->push[1] = loxo_arena_take(a, 3 * n_faces, sizeof *g->push[1]);
    }
    /* An unreferenced vertex has a distance, too: there may be more vertices than faces. */
    loxo_arena_release(a, mark);
    g->distance = loxo_arena_take(a, n, sizeof *g->distance);
}

#define PAGE 4096

/* New pages are cleared when they are first written. All threads do that here, each for its share: a good part of a first
 * solve would go into it otherwise, mostly on the one thread that finds the levels, and on several memory nodes all of it
 * would lie on that thread's. */
static void touch_workspace(const parallel_heat *g)
{
    const int64_t n_pages = (int64_t)(g->arena.size / PAGE);
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n_pages, 500.0))
    {
        const loxo_range r = loxo_thread_range(n_pages);
        for (int64_t i = r.begin; i < r.end; ++i)
            g->arena.block[i * PAGE] = 0;
    }
}

static void parallel_heat_destroy(void *state)
{
    parallel_heat *g = state;
    if (g == NULL) return;
    loxo_context *ctx = g->ctx;
    loxo_chains_destroy(ctx, &g->cycles);
    loxo_release(ctx, g->more_levels);
    loxo_arena_destroy(ctx, &g->arena);
    loxo_release(ctx, g);
}

static loxo_status parallel_heat_create(const geodesic_problem *problem, void **state)
{
    loxo_context *ctx = problem->ctx;
    loxo_status status;
    parallel_heat *g = loxo_allocate(ctx, 1, sizeof *g);
    *state = g;
    if (g == NULL) return LOXO_ERR_MEMORY;
    *g = (parallel_heat){
        .problem = problem, .ctx = ctx, .mesh = problem->mesh, .m = problem->m, .settings = problem->settings};
    g->kernels = k_variant_get(loxo_context_isa(ctx));
    g->n_boundary_edges = problem->n_boundary_edges;
    g->mean_edge_length = problem->mean_edge_length;
    g->area = problem->area / (g->mean_edge_length * g->mean_edge_length);
    g->time = g->settings.time_factor * g->mean_edge_length * g->mean_edge_length;
    heat_lay_out(g);
    if ((status = loxo_arena_reserve(ctx, &g->arena, "geodesic: the workspace")) < 0) return status;
    heat_lay_out(g);
    touch_workspace(g);
    if (g->settings.global_constraints) status = loxo_cycle_basis(ctx, &g->m, &g->cycles);
    return status;
}

/* Puts a given heat, in the caller's order, where the diffusion would have left its own. */
static void take_heat(parallel_heat *g, const double *value, const int32_t *scale)
{
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, g->n_reached, 5.0))
    {
        const loxo_range r = loxo_thread_range(g->n_reached);
        for (int64_t p = r.begin; p < r.end; ++p) {
            const loxo_index v = g->order[p];
            const int64_t from = g->m.vertex_origin != NULL ? g->m.vertex_origin[v] : v;
            const int shift = value[from] != 0.0 && fabs(value[from]) >= 0x1p-1000 ? k_exponent(value[from]) : 0;
            g->value[2 * p] = value[from] * k_power_of_two(-(int64_t)shift);
            g->value[2 * p + 1] = g->value[2 * p];
            const int64_t sum = (scale != NULL ? (int64_t)scale[from] : 0) + shift;
            g->scale[p] = sum > INT32_MIN / 2 ? (sum < INT32_MAX / 2 ? (int32_t)sum : INT32_MAX / 2) : INT32_MIN / 2;
        }
    }
}

void heat_to_vertices(parallel_heat *g)
{
    const int64_t n = g->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n, 5.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v) {
            const int64_t p = g->rank[v], parent = p >= 0 ? g->parent[p] : -1;
            const int64_t soon = v + PLACES_AHEAD < n ? g->rank[v + PLACES_AHEAD] : -1;
            const int64_t sooner = v + PLACES_AHEAD / 2 < n ? g->rank[v + PLACES_AHEAD / 2] : -1;
            if (soon >= 0) {
                __builtin_prefetch(&g->value[2 * soon], 0, 2);
                __builtin_prefetch(&g->scale[soon], 0, 2);
                __builtin_prefetch(&g->parent[soon], 0, 2);
            }
            if (sooner >= 0 && g->parent[sooner] >= 0) __builtin_prefetch(&g->order[g->parent[sooner]], 0, 2);
            g->vertex_value[v] = p >= 0 ? g->value[2 * p] : 0.0;
            g->vertex_scale[v] = p >= 0 ? g->scale[p] : K_NOT_REACHED;
            g->found_by[v] = parent >= 0 ? g->order[parent] : -1;
        }
    }
}

/* The recovery is over: the distances go to the mesh's order, in its place. */
static void distances_to_vertices(const parallel_heat *g, double *distance)
{
    const int64_t n = g->m.n_vertices;
    const double most = g->problem->settings.max_distance;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n, 5.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v) {
            const int64_t p = g->rank[v], next = v + PLACES_AHEAD < n ? g->rank[v + PLACES_AHEAD] : -1;
            if (next >= 0) __builtin_prefetch(&g->value[2 * next + 1], 0, 2);
            const double d = p >= 0 ? g->value[2 * p + 1] : 0.0;
            distance[v] = !isfinite(d) ? (double)NAN : p < 0 || d > most ? HUGE_VAL : d;
        }
    }
}

static loxo_status recover(parallel_heat *g, loxo_geodesic_info *info)
{
    /* What (25), (26) ask of the way between two sources does not hold between corners around them. */
    const int64_t n_sources = g->start_distance == NULL ? g->level_begin[1] : 1;
    loxo_chains chains = {0};
    loxo_status status = LOXO_OK;
    if (g->settings.global_constraints && (g->cycles.n_chains > 0 || n_sources > 1)) {
        if ((status = heat_find_chains(g, n_sources, &chains)) < 0) return status;
        info->n_constraints = chains.n_chains;
        info->n_constraints_left_out = chains.n_left_out;
        if (chains.n_left_out > 0)
            loxo_warn(g->ctx, "geodesic-constraints", chains.n_left_out,
                      "%" PRId64 " of %" PRId64 " global constraints were left out: longer than the mesh allows",
                      chains.n_left_out, chains.n_left_out + chains.n_chains);
    }
    status = g->settings.method == LOXO_GEODESIC_EDGE ? heat_recover_edge(g, &chains, info)
                                                      : heat_recover_face(g, &chains, info);
    loxo_chains_destroy(g->ctx, &chains);
    return status;
}

/* Warnings and the status of a finished solve. */
static loxo_status judge(const parallel_heat *g, const diffusion_result *diffusion, const loxo_geodesic_info *info)
{
    if (info->n_nonpositive_heat > 0)
        loxo_warn(g->ctx, "geodesic-nonpositive", info->n_nonpositive_heat,
                  "the heat of %" PRId64 " vertices is not positive (obtuse triangles); distances near them suffer",
                  info->n_nonpositive_heat);
    if (info->stop_reason == LOXO_STOP_MONITOR)
        return loxo_fail(g->ctx, LOXO_STOPPED, "geodesic: stopped; the distances are those of the last state");
    if (diffusion->n_unsettled > 0)
        return loxo_fail(g->ctx, LOXO_NOT_CONVERGED,
                         "geodesic: the diffusion did not settle on about %" PRId64 " of %" PRId64 " vertices",
                         64 * diffusion->n_unsettled < diffusion->n_reached ? 64 * diffusion->n_unsettled
                                                                            : diffusion->n_reached,
                         diffusion->n_reached);
    return LOXO_OK;
}

loxo_status heat_find_distances(parallel_heat *g, const geodesic_seed *seeds, int64_t n_seeds, double *distance,
                                diffusion_result *diffusion, loxo_geodesic_info *info)
{
    const double *given_value = g->given_value;
    const int32_t *given_scale = g->given_scale;
    g->given_value = NULL;
    g->given_scale = NULL;
    g->is_given = given_value != NULL;
    g->has_heat = g->is_rank_clear = false;
    g->clock_s = loxo_os_clock_s();
    loxo_status status = heat_begin(g, seeds, n_seeds);
    if (status < 0) return status;
    heat_clock(g, LOXO_GEODESIC_PHASE_LEVELS, info);

    if (given_value != NULL)
        take_heat(g, given_value, given_scale);
    else if (g->settings.diffusion == LOXO_DIFFUSION_MARCHING)
        status = heat_march(g, diffusion);
    else
        status = heat_sweep(g, diffusion);
    if (status < 0) return status;
    g->has_heat = true;
    heat_clock(g, LOXO_GEODESIC_PHASE_DIFFUSION, info);

    if (heat_unfolds(&g->settings)) {
        if (heat_unfold(g, distance, &info->n_iterations)) diffusion->stopped = true;
        heat_clock(g, LOXO_GEODESIC_PHASE_UNFOLD, info);
    } else {
        if ((status = recover(g, info)) < 0) return status;
        heat_integrate(g);
        distances_to_vertices(g, distance);
    }
    info->n_levels = g->n_levels;
    heat_clock(g, LOXO_GEODESIC_PHASE_INTEGRATE, info);
    return LOXO_OK;
}

/* What a small mesh of its own would change: sweeps go by the number of levels, and it has no cycles. */
static bool can_be_limited(const parallel_heat *g)
{
    return isfinite(g->problem->settings.max_distance) && g->settings.diffusion == LOXO_DIFFUSION_MARCHING &&
           !g->settings.global_constraints && g->given_value == NULL;
}

static loxo_status parallel_heat_solve(void *state, const geodesic_seed *seeds, int64_t n_seeds, double *distance,
                                       loxo_index *nearest, loxo_geodesic_info *info)
{
    parallel_heat *g = state;
    diffusion_result diffusion = {0};
    bool is_done = false;
    loxo_status status = LOXO_OK;
    g->touched = NULL;
    if (can_be_limited(g)) status = heat_solve_limited(g, seeds, n_seeds, distance, &diffusion, info, &is_done);
    if (status >= 0 && !is_done) status = heat_find_distances(g, seeds, n_seeds, distance, &diffusion, info);
    heat_end(g);
    if (status < 0) return status;
    if (nearest != NULL && (status = geodesic_label_nearest(g->problem, seeds, n_seeds, distance, nearest)) < 0)
        return status;
    heat_clock(g, LOXO_GEODESIC_PHASE_INTEGRATE, info);

    info->n_evaluations = diffusion.n_updates;
    info->workspace_bytes = g->arena.size;
    info->time = g->time;
    info->max_window = diffusion.max_window;
    info->diffusion_converged = diffusion.is_settled;
    info->diffusion_change = diffusion.change;
    info->n_nonpositive_heat = diffusion.n_nonpositive;
    if (diffusion.stopped) info->stop_reason = LOXO_STOP_MONITOR;
    return judge(g, &diffusion, info);
}

static double *parallel_heat_room(void *state)
{
    const parallel_heat *g = state;
    return g->distance;
}

static const loxo_index *parallel_heat_touched(void *state, int64_t *n)
{
    const parallel_heat *g = state;
    *n = g->n_touched;
    return g->touched;
}

static loxo_status parallel_heat_heat(const void *state, double *value, int32_t *scale)
{
    const parallel_heat *g = state;
    const int64_t n = loxo_mesh_n_vertices(g->mesh);
    if (!g->has_heat)
        return loxo_fail(g->ctx, LOXO_ERR_ARGUMENT,
                         "geodesic: there is no heat before the first solve, and of a limited one");
    for (int64_t v = 0; v < n; ++v) {
        value[v] = 0.0;
        scale[v] = 0;
    }
    for (int64_t v = 0; v < g->m.n_vertices; ++v) {
        const int64_t p = g->rank[v], to = g->m.vertex_origin != NULL ? g->m.vertex_origin[v] : v;
        if (p < 0) continue;
        value[to] = g->value[2 * p];
        scale[to] = g->scale[p];
    }
    return LOXO_OK;
}

static loxo_status parallel_heat_give(void *state, const double *value, const int32_t *scale)
{
    parallel_heat *g = state;
    const int64_t n = loxo_mesh_n_vertices(g->mesh);
    for (int64_t v = 0; v < n; ++v) {
        if (isfinite(value[v])) continue;
        const loxo_place place = {.byte = -1, .element = v};
        return loxo_fail_at(g->ctx, LOXO_ERR_ARGUMENT, place, "geodesic: the heat of vertex %" PRId64 " is not finite",
                            v);
    }
    g->given_value = value;
    g->given_scale = scale;
    return LOXO_OK;
}

static size_t parallel_heat_bytes(const geodesic_problem *problem)
{
    parallel_heat g = {.m = problem->m, .settings = problem->settings, .n_boundary_edges = problem->n_boundary_edges};
    heat_lay_out(&g);
    size_t bytes = g.arena.size;
    if (g.settings.global_constraints) bytes += loxo_cycle_basis_bytes(g.m.n_vertices, g.m.n_faces, g.n_boundary_edges);
    return bytes;
}

/* vertex_ns at 1M vertices in local order, user time of one thread of an AMD EPYC with AVX-512, a source that lies on no
 * symmetry, bumpy sphere, least of three on a busy machine. */
#define ENGINE(ns)                                                                                                     \
    {                                                                                                                  \
        .bytes = parallel_heat_bytes, .vertex_ns = (ns), .growth = 0.03, .create = parallel_heat_create,               \
        .solve = parallel_heat_solve, .destroy = parallel_heat_destroy, .room = parallel_heat_room,                    \
        .touched = parallel_heat_touched, .heat = parallel_heat_heat, .give_heat = parallel_heat_give                  \
    }
const geodesic_engine geodesic_engine_edge = ENGINE(600.0);
const geodesic_engine geodesic_engine_face = ENGINE(700.0);
