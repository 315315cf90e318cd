/* SPDX-License-Identifier: MIT
 * The geodesic solver: create once, solve for many source sets. A solve reads like Algorithm 1 of the paper. */
#include "base/allocate.h"
#include "base/options.h"
#include "base/os.h"
#include "kernel/descent_kernel.h"
#include "par/range.h"
#include "solver/geodesic/tree.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

const char *loxo_geodesic_phase_name(loxo_geodesic_phase phase)
{
    static const char *const names[] = {"prepare", "levels", "diffusion", "gradient", "ADMM", "integrate", "check"};
    return phase >= 0 && phase < LOXO_GEODESIC_N_PHASES ? names[phase] : "unknown";
}

void geodesic_clock(loxo_geodesic *g, loxo_geodesic_phase phase, loxo_geodesic_info *info)
{
    const double now = loxo_os_clock_s();
    info->phase_s[phase] += now - g->clock_s;
    g->clock_s = now;
}

bool geodesic_tell_iteration(loxo_geodesic *g, int64_t iteration, const loxo_geodesic_info *info)
{
    const loxo_progress p = {.phase = "ADMM",
                             .fraction = (double)iteration / (double)g->settings.n_iterations,
                             .iteration = iteration,
                             .n_iterations = g->settings.n_iterations,
                             .objective = info->objective,
                             .residual = info->residual};
    return loxo_progress_tell(g->ctx, &p, false);
}

/* Hands out the workspace; while the arena has no block this only adds up its size. What the diffusion and the recovery
 * use stands in the same place. */
static void lay_out(loxo_geodesic *g)
{
    loxo_arena *a = &g->arena;
    const int64_t n = g->m.n_vertices, n_faces = g->m.n_faces;
    g->fan = loxo_arena_take(a, n + 1, sizeof *g->fan);
    g->fan_entry = loxo_arena_take(a, 3 * n_faces + g->n_boundary_edges, sizeof *g->fan_entry);
    g->most_levels = n < 1024 ? n : 1024 + n / 64; /* few surfaces have more */
    g->level_begin = loxo_arena_take(a, g->most_levels + 1, sizeof *g->level_begin);
    g->order = loxo_arena_take(a, n, sizeof *g->order);
    g->rank = loxo_arena_take(a, n, sizeof *g->rank);
    g->parent = loxo_arena_take(a, n, sizeof *g->parent);
    g->value = loxo_arena_take(a, 2 * n, sizeof *g->value);
    g->scale = loxo_arena_take(a, n, sizeof *g->scale);

    const size_t mark = loxo_arena_mark(a);
    g->first = loxo_arena_take(a, n, sizeof *g->first);
    g->n_ring = n / BLOCK_ROWS + MAX_UPDATES + 100;
    g->change = loxo_arena_take(a, g->n_ring, sizeof *g->change);
    g->reach = loxo_arena_take(a, g->n_ring, sizeof *g->reach);
    g->row = loxo_arena_take(a, n + 1, sizeof *g->row);
    g->entry = loxo_arena_take(a, 3 * n_faces + g->n_boundary_edges, sizeof *g->entry);

    loxo_arena_release(a, mark);
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

/* Faces begin..end-1, an edge at the lower of its two half-edges. sums: edge lengths, edges, boundary edges, area. */
static void partial_measures(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const loxo_mesh_view *m = arg;
    for (int64_t f = begin; f < end; ++f) {
        const loxo_index *v = &m->halfedge_vertex[3 * f], *twin = &m->halfedge_twin[3 * f];
        const loxo_vec3 a = k_position(m, v[0]), b = k_position(m, v[1]), c = k_position(m, v[2]);
        const loxo_vec3 edge[3] = {v3_sub(b, a), v3_sub(c, b), v3_sub(a, c)};
        for (int k = 0; k < 3; ++k) {
            if (twin[k] >= 0 && twin[k] < 3 * f + k) continue;
            sums[0] += v3_norm(edge[k]);
            sums[1] += 1.0;
            sums[2] += twin[k] < 0 ? 1.0 : 0.0;
        }
        sums[3] += 0.5 * v3_norm(v3_cross(edge[0], edge[2]));
    }
}

static loxo_status measure_mesh(loxo_geodesic *g)
{
    double sums[4];
    const loxo_status status = loxo_sum(g->ctx, g->m.n_faces, 4, partial_measures, &g->m, sums);
    if (status < 0) return status;
    const double area = sums[3];
    g->mean_edge_length = sums[0] / sums[1];
    g->n_boundary_edges = (int64_t)sums[2];
    g->area = area / (g->mean_edge_length * g->mean_edge_length);
    g->time = g->settings.time_factor * g->mean_edge_length * g->mean_edge_length;
    if (!(area > 0.0) || !isfinite(area) || !(g->mean_edge_length > 1e-40) || !(g->mean_edge_length < 1e40))
        return loxo_fail(g->ctx, LOXO_ERR_MESH,
                         "geodesic: the faces have no area (%g), or coordinates too large or small to compute with",
                         area);
    return LOXO_OK;
}

#define PAGE 4096

/* New pages are cleared when they are first written. All threads do that here, each for its share: a good part of a first
 * solve would go into it otherwise, mostly on the one thread that finds the levels, and on several memory nodes all of it
 * would lie on that thread's. */
static void touch_workspace(const loxo_geodesic *g)
{
    const int64_t n_pages = (int64_t)(g->arena.size / PAGE);
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n_pages, 500.0))
    {
        const loxo_range r = loxo_thread_range(n_pages);
        for (int64_t i = r.begin; i < r.end; ++i)
            g->arena.block[i * PAGE] = 0;
    }
}

loxo_status loxo_geodesic_create(loxo_context *ctx, const loxo_mesh *mesh, const loxo_geodesic_settings *settings,
                                 loxo_geodesic **out)
{
    const loxo_geodesic_settings chosen = settings != NULL ? *settings : loxo_geodesic_settings_default();
    const double start_s = loxo_os_clock_s();
    loxo_geodesic *g = NULL;
    if (out == NULL || ctx == NULL) return LOXO_ERR_ARGUMENT;
    *out = NULL;
    if (mesh == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: the mesh is NULL");
    loxo_status status = loxo_options_check(ctx, "geodesic", loxo_geodesic_options, &chosen);
    if (status < 0) return status;
    if (loxo_mesh_n_faces(mesh) == 0) return loxo_fail(ctx, LOXO_ERR_MESH, "geodesic: the mesh has no faces");

    g = loxo_allocate(ctx, 1, sizeof *g);
    if (g == NULL) return LOXO_ERR_MEMORY;
    *g = (loxo_geodesic){.ctx = ctx, .mesh = mesh, .m = loxo_mesh_get_view(mesh), .settings = chosen};
    g->kernels = k_variant_get(loxo_context_isa(ctx));
    loxo_progress_begin(ctx);
    if ((status = measure_mesh(g)) < 0) goto fail;
    lay_out(g);
    if ((status = loxo_arena_reserve(ctx, &g->arena, "geodesic: the workspace")) < 0) goto fail;
    lay_out(g);
    touch_workspace(g);
    if ((status = geodesic_make_fans(g)) < 0) goto fail;
    if (chosen.global_constraints && (status = loxo_cycle_basis(ctx, &g->m, &g->cycles)) < 0) goto fail;
    g->prepare_s = loxo_os_clock_s() - start_s;
    *out = g;
    return LOXO_OK;
fail:
    loxo_geodesic_destroy(g);
    return status;
}

void loxo_geodesic_destroy(loxo_geodesic *geodesic)
{
    if (geodesic == NULL) return;
    loxo_context *ctx = geodesic->ctx;
    loxo_chains_destroy(ctx, &geodesic->cycles);
    loxo_release(ctx, geodesic->more_levels);
    loxo_arena_destroy(ctx, &geodesic->arena);
    loxo_release(ctx, geodesic);
}

static int compare_indices(const void *a, const void *b)
{
    const loxo_index x = *(const loxo_index *)a, y = *(const loxo_index *)b;
    return (x > y) - (x < y);
}

/* A repair may have split a source's vertex: heat starts from all its copies. list is replaced by a longer one. */
static loxo_status add_copies(const loxo_geodesic *g, loxo_index **list, int64_t *n_list)
{
    const int64_t n = g->m.n_vertices;
    int64_t n_all = 0;
    if (g->mesh->caller_to_mesh == NULL || g->m.vertex_origin == NULL) return LOXO_OK;
    bool *is_source = loxo_allocate_zero(g->ctx, loxo_mesh_n_vertices(g->mesh), sizeof *is_source);
    loxo_index *all = loxo_allocate(g->ctx, n, sizeof *all);
    if (is_source == NULL || all == NULL) {
        loxo_release(g->ctx, all);
        loxo_release(g->ctx, is_source);
        return LOXO_ERR_MEMORY;
    }
    for (int64_t i = 0; i < *n_list; ++i)
        is_source[g->m.vertex_origin[(*list)[i]]] = true;
    for (int64_t v = 0; v < n; ++v)
        if (is_source[g->m.vertex_origin[v]] && g->m.vertex_halfedge[v] >= 0) all[n_all++] = (loxo_index)v;
    loxo_release(g->ctx, is_source);
    loxo_release(g->ctx, *list);
    *list = all;
    *n_list = n_all;
    return LOXO_OK;
}

/* The mesh's numbers of the sources, ascending, without repeats; a new array of *n_own in *own. */
static loxo_status take_sources(loxo_geodesic *g, const loxo_index *sources, int64_t n_sources, loxo_index **own,
                                int64_t *n_own)
{
    const int64_t n = loxo_mesh_n_vertices(g->mesh);
    if (sources == NULL || n_sources < 1) return loxo_fail(g->ctx, LOXO_ERR_ARGUMENT, "geodesic: there is no source");
    for (int64_t i = 0; i < n_sources; ++i) {
        const loxo_place place = {.byte = -1, .element = sources[i]};
        if (sources[i] < 0 || sources[i] >= n)
            return loxo_fail_at(g->ctx, LOXO_ERR_ARGUMENT, place, "geodesic: source %" PRId64 " is not in 0..%" PRId64,
                                (int64_t)sources[i], n - 1);
    }
    loxo_index *list = loxo_allocate(g->ctx, n_sources, sizeof *list);
    if (list == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_mesh_indices_from_caller(g->mesh, n_sources, sources, list);
    for (int64_t i = 0; i < n_sources && status >= 0; ++i) {
        if (list[i] >= 0 && g->m.vertex_halfedge[list[i]] >= 0) continue;
        const loxo_place place = {.byte = -1, .element = sources[i]};
        status = loxo_fail_at(g->ctx, LOXO_ERR_MESH, place, "geodesic: source %" PRId64 " belongs to no face",
                              (int64_t)sources[i]);
    }
    if (status >= 0) status = add_copies(g, &list, &n_sources);
    if (status < 0) {
        loxo_release(g->ctx, list);
        return status;
    }
    qsort(list, (size_t)n_sources, sizeof *list, compare_indices);
    int64_t n_kept = 1;
    for (int64_t i = 1; i < n_sources; ++i)
        if (list[i] != list[n_kept - 1]) list[n_kept++] = list[i];
    *own = list;
    *n_own = n_kept;
    return LOXO_OK;
}

/* Puts a given heat, in the caller's order, where the diffusion would have left its own. */
static loxo_status take_heat(loxo_geodesic *g, const double *value, const int32_t *scale)
{
    const int64_t n = loxo_mesh_n_vertices(g->mesh);
    for (int64_t v = 0; v < n; ++v) {
        if (isfinite(value[v])) continue;
        const loxo_place place = {.byte = -1, .element = v};
        return loxo_fail_at(g->ctx, LOXO_ERR_ARGUMENT, place, "geodesic: the heat of vertex %" PRId64 " is not finite",
                            v);
    }
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
    return LOXO_OK;
}

void geodesic_heat_to_vertices(loxo_geodesic *g)
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

/* The recovery is over: the distances go to the mesh's order in its place. */
static void distances_to_vertices(loxo_geodesic *g)
{
    const int64_t n = g->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n, 5.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v) {
            const int64_t p = g->rank[v], next = v + PLACES_AHEAD < n ? g->rank[v + PLACES_AHEAD] : -1;
            if (next >= 0) __builtin_prefetch(&g->value[2 * next + 1], 0, 2);
            g->distance[v] = p >= 0 ? g->value[2 * p + 1] : HUGE_VAL;
        }
    }
}

static loxo_status recover(loxo_geodesic *g, int64_t n_sources, loxo_geodesic_info *info)
{
    loxo_chains chains = {0};
    loxo_status status = LOXO_OK;
    if (g->settings.global_constraints && (g->cycles.n_chains > 0 || n_sources > 1)) {
        if ((status = geodesic_find_chains(g, n_sources, &chains)) < 0) return status;
        info->n_constraints = chains.n_chains;
        info->n_constraints_left_out = chains.n_left_out;
        if (chains.n_left_out > 0)
            loxo_warn(g->ctx, "geodesic-constraints", chains.n_left_out,
                      "%" PRId64 " of %" PRId64 " global constraints were left out: longer than the mesh allows",
                      chains.n_left_out, chains.n_left_out + chains.n_chains);
    }
    status = g->settings.method == LOXO_GEODESIC_EDGE ? geodesic_recover_edge(g, &chains, info)
                                                      : geodesic_recover_face(g, &chains, info);
    loxo_chains_destroy(g->ctx, &chains);
    return status;
}

/* Warnings and the status of a finished solve. */
static loxo_status judge(loxo_geodesic *g, const diffusion_result *diffusion, const loxo_geodesic_info *info)
{
    if (info->n_unreached > 0)
        loxo_warn(g->ctx, "geodesic-unreached", info->n_unreached,
                  "%" PRId64 " vertices cannot be reached from the sources; their distance is infinite",
                  info->n_unreached);
    if (info->n_nonpositive_heat > 0)
        loxo_warn(g->ctx, "geodesic-nonpositive", info->n_nonpositive_heat,
                  "the heat of %" PRId64 " vertices is not positive (obtuse triangles); distances near them suffer",
                  info->n_nonpositive_heat);
    if (diffusion->stopped || info->stop_reason == LOXO_STOP_MONITOR)
        return loxo_fail(g->ctx, LOXO_STOPPED, "geodesic: stopped; the distances are those of the last state");
    if (diffusion->n_unsettled > 0)
        return loxo_fail(g->ctx, LOXO_NOT_CONVERGED,
                         "geodesic: the diffusion did not settle on about %" PRId64 " of %" PRId64 " vertices",
                         64 * diffusion->n_unsettled < g->n_reached ? 64 * diffusion->n_unsettled : g->n_reached,
                         g->n_reached);
    if (!info->check_passed)
        return loxo_fail(g->ctx, LOXO_CHECK_FAILED,
                         "geodesic: the distances do not pass their check: the gradient's length is off 1 by over a "
                         "tenth on %.1f %% of the area, edges are breached by %.3g (99th percentile), %" PRId64
                         " are negative",
                         100.0 * info->gradient_share, info->breach_percentile_99, info->n_negative);
    return LOXO_OK;
}

static int64_t count_infinite(loxo_context *ctx, const double *distance, int64_t n)
{
    int64_t n_infinite = 0;
#pragma omp parallel for num_threads(loxo_threads_for(ctx, n, 0.5)) reduction(+ : n_infinite)
    for (int64_t v = 0; v < n; ++v)
        n_infinite += isfinite(distance[v]) ? 0 : 1;
    return n_infinite;
}

static loxo_status solve(loxo_geodesic *g, const loxo_index *sources, int64_t n_sources, const double *heat_value,
                         const int32_t *heat_scale, double *distance, loxo_geodesic_info *info)
{
    const double start_s = loxo_os_clock_s();
    loxo_index *own = NULL;
    int64_t n_own = 0;
    diffusion_result diffusion = {0};
    loxo_status status = take_sources(g, sources, n_sources, &own, &n_own);
    if (status < 0) return status;
    loxo_progress_begin(g->ctx);
    g->has_heat = false;
    g->clock_s = start_s;
    info->phase_s[LOXO_GEODESIC_PHASE_PREPARE] = g->prepare_s;

    status = geodesic_find_levels(g, own, n_own);
    loxo_release(g->ctx, own);
    if (status < 0) return status;
    geodesic_clock(g, LOXO_GEODESIC_PHASE_LEVELS, info);

    if (heat_value != NULL)
        status = take_heat(g, heat_value, heat_scale);
    else if (g->settings.diffusion == LOXO_DIFFUSION_MARCHING)
        status = geodesic_march(g, &diffusion);
    else
        status = geodesic_sweep(g, &diffusion);
    if (status < 0) return status;
    g->has_heat = true;
    geodesic_clock(g, LOXO_GEODESIC_PHASE_DIFFUSION, info);

    if ((status = recover(g, n_own, info)) < 0) return status;
    geodesic_integrate(g);
    distances_to_vertices(g);
    geodesic_clock(g, LOXO_GEODESIC_PHASE_INTEGRATE, info);
    if ((status = geodesic_check(g, info)) < 0) return status;
    if (heat_value == NULL && info->n_negative > 0) info->check_passed = false; /* a given heat may point anywhere */
    geodesic_clock(g, LOXO_GEODESIC_PHASE_CHECK, info);
    loxo_mesh_scatter_to_caller(g->mesh, g->distance, distance);
    info->n_unreached = count_infinite(g->ctx, distance, loxo_mesh_n_vertices(g->mesh));
    geodesic_clock(g, LOXO_GEODESIC_PHASE_INTEGRATE, info);

    info->n_evaluations = diffusion.n_updates;
    info->total_s = loxo_os_clock_s() - start_s;
    info->workspace_bytes = g->arena.size;
    info->peak_bytes = loxo_context_memory(g->ctx).peak_bytes;
    info->time = g->time;
    info->mean_edge_length = g->mean_edge_length;
    info->n_sources = n_own;
    info->n_levels = g->n_levels;
    info->max_window = diffusion.max_window;
    info->diffusion_converged = diffusion.is_settled;
    info->diffusion_change = diffusion.change;
    info->n_nonpositive_heat = diffusion.n_nonpositive;
    if (diffusion.stopped) info->stop_reason = LOXO_STOP_MONITOR;
    return judge(g, &diffusion, info);
}

loxo_status loxo_geodesic_solve(loxo_geodesic *geodesic, const loxo_index *sources, int64_t n_sources, double *distance,
                                loxo_geodesic_info *info)
{
    loxo_geodesic_info local;
    loxo_geodesic_info *out = info != NULL ? info : &local;
    if (geodesic == NULL) return LOXO_ERR_ARGUMENT;
    *out = (loxo_geodesic_info){0};
    if (distance == NULL) return loxo_fail(geodesic->ctx, LOXO_ERR_ARGUMENT, "geodesic: the output array is NULL");
    return solve(geodesic, sources, n_sources, NULL, NULL, distance, out);
}

loxo_status loxo_geodesic_solve_from_heat(loxo_geodesic *geodesic, const loxo_index *sources, int64_t n_sources,
                                          const double *value, const int32_t *scale, double *distance,
                                          loxo_geodesic_info *info)
{
    loxo_geodesic_info local;
    loxo_geodesic_info *out = info != NULL ? info : &local;
    if (geodesic == NULL) return LOXO_ERR_ARGUMENT;
    *out = (loxo_geodesic_info){0};
    if (distance == NULL || value == NULL)
        return loxo_fail(geodesic->ctx, LOXO_ERR_ARGUMENT, "geodesic: an array is NULL");
    return solve(geodesic, sources, n_sources, value, scale, distance, out);
}

loxo_status loxo_geodesic_heat(const loxo_geodesic *geodesic, double *value, int32_t *scale)
{
    if (geodesic == NULL) return LOXO_ERR_ARGUMENT;
    const loxo_geodesic *g = geodesic;
    const int64_t n = loxo_mesh_n_vertices(g->mesh);
    if (!g->has_heat || value == NULL || scale == NULL)
        return loxo_fail(g->ctx, LOXO_ERR_ARGUMENT, "geodesic: there is no heat before the first solve");
    for (int64_t v = 0; v < n; ++v) {
        value[v] = 0.0;
        scale[v] = 0;
    }
    for (int64_t p = 0; p < g->n_reached; ++p) {
        const loxo_index v = g->order[p];
        const int64_t to = g->m.vertex_origin != NULL ? g->m.vertex_origin[v] : v;
        value[to] = g->value[2 * p];
        scale[to] = g->scale[p];
    }
    return LOXO_OK;
}

loxo_status loxo_geodesic_distance(loxo_context *ctx, const loxo_mesh *mesh, const loxo_geodesic_settings *settings,
                                   const loxo_index *sources, int64_t n_sources, double *distance,
                                   loxo_geodesic_info *info)
{
    loxo_geodesic *g = NULL;
    if (ctx == NULL) return LOXO_ERR_ARGUMENT;
    loxo_progress_enter(ctx);
    loxo_status status = loxo_geodesic_create(ctx, mesh, settings, &g);
    if (status >= 0) status = loxo_geodesic_solve(g, sources, n_sources, distance, info);
    loxo_geodesic_destroy(g);
    loxo_progress_leave(ctx);
    return status;
}

loxo_status loxo_geodesic_estimate(loxo_context *ctx, int64_t n_vertices, int64_t n_faces,
                                   const loxo_geodesic_settings *settings, size_t *workspace_bytes, double *solve_s)
{
    /* Nanoseconds a vertex, edge- and face-based. Measured at 1M vertices in local order, processor time of one thread
     * of an AMD EPYC with AVX-512, a source that lies on no symmetry, best of eight: icosphere 410 and 480, bumpy sphere
     * 450 and 550, folded brain 450 and 550. A source on a symmetry of the icosphere: 320 and 420. Two threads take about
     * 0.6 of it. */
    static const double ns[] = {440.0, 530.0};
    loxo_geodesic g = {.ctx = ctx};
    g.settings = settings != NULL ? *settings : loxo_geodesic_settings_default();
    if (ctx == NULL) return LOXO_ERR_ARGUMENT;
    if (n_vertices < 0 || n_faces < 0)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: a negative number of vertices or faces");
    if (n_vertices > LOXO_INDEX_MAX || n_faces > LOXO_INDEX_MAX / 3)
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "geodesic: more vertices or half-edges than ids");
    const loxo_status status = loxo_options_check(ctx, "geodesic", loxo_geodesic_options, &g.settings);
    if (status < 0) return status;
    g.m.n_vertices = n_vertices;
    g.m.n_faces = n_faces;
    /* 2 V - F less twice the Euler number is how many edges are at boundaries, where every vertex has a face. */
    g.n_boundary_edges = 2 * n_vertices - n_faces - 4;
    if (g.n_boundary_edges < 0) g.n_boundary_edges = 0;
    if (g.n_boundary_edges > 3 * n_faces) g.n_boundary_edges = 3 * n_faces;
    lay_out(&g);
    if (workspace_bytes != NULL) *workspace_bytes = g.arena.size;
    if (workspace_bytes != NULL && g.settings.global_constraints)
        *workspace_bytes += loxo_cycle_basis_bytes(n_vertices, n_faces, g.n_boundary_edges);
    if (solve_s != NULL) {
        const double n_threads = (double)loxo_threads_for(ctx, n_vertices, 100.0);
        *solve_s = 1e-9 * ns[g.settings.method] * (double)n_vertices / (1.0 + 0.7 * (n_threads - 1.0));
    }
    return LOXO_OK;
}
