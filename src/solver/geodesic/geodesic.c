/* SPDX-License-Identifier: MIT
 * The geodesic solver: what every method is surrounded with. It turns the caller's sources into seeds, lets the method
 * solve, looks at the answer and gives it in the caller's order. */
#include "base/allocate.h"
#include "base/options.h"
#include "base/os.h"
#include "kernel/layout_kernel.h"
#include "par/range.h"
#include "solver/geodesic/geodesic_internal.h"

#include <inttypes.h>
#include <math.h>

/* Stands in the table only: create and estimate put the method that they choose in its place. */
const geodesic_engine geodesic_engine_auto = {.bytes = NULL};

#define ENGINE(NAME, name, help) &geodesic_engine_##name,
static const geodesic_engine *const engines[] = {LOXO_GEODESIC_METHOD_LIST(ENGINE)};

const char *loxo_geodesic_phase_name(loxo_geodesic_phase phase)
{
    static const char *const names[] = {"prepare", "levels",    "diffusion", "gradient", "ADMM",
                                        "unfold",  "integrate", "propagate", "Poisson",  "check"};
    return phase >= 0 && phase < LOXO_GEODESIC_N_PHASES ? names[phase] : "unknown";
}

/* Faces begin..end-1, an edge at the lower of its two half-edges. sums: edge lengths, edges, boundary edges, area. */
static void partial_measures(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const loxo_mesh_view *m = arg;
    for (int64_t f = begin; f < end; ++f) {
        const loxo_index *twin = &m->halfedge_twin[3 * f];
        loxo_vec3 p[3];
        k_face_corners(m, f, p);
        const loxo_vec3 edge[3] = {v3_sub(p[1], p[0]), v3_sub(p[2], p[1]), v3_sub(p[0], p[2])};
        for (int k = 0; k < 3; ++k) {
            if (twin[k] >= 0 && twin[k] < 3 * f + k) continue;
            sums[0] += v3_norm(edge[k]);
            sums[1] += 1.0;
            sums[2] += twin[k] < 0 ? 1.0 : 0.0;
        }
        sums[3] += 0.5 * v3_norm(v3_cross(edge[0], edge[2]));
    }
}

static loxo_status measure_mesh(geodesic_problem *problem)
{
    double sums[4];
    const loxo_status status = loxo_sum(problem->ctx, problem->m.n_faces, 4, partial_measures, &problem->m, sums);
    if (status < 0) return status;
    problem->area = sums[3];
    problem->mean_edge_length = sums[0] / sums[1];
    problem->n_boundary_edges = (int64_t)sums[2];
    if (!(problem->area > 0.0) || !isfinite(problem->area) || !(problem->mean_edge_length > 1e-40) ||
        !(problem->mean_edge_length < 1e40))
        return loxo_fail(problem->ctx, LOXO_ERR_MESH,
                         "geodesic: the faces have no area (%g), or coordinates too large or small to compute with",
                         problem->area);
    return LOXO_OK;
}

loxo_status loxo_geodesic_create(loxo_context *ctx, const loxo_mesh *mesh, const loxo_geodesic_settings *settings,
                                 loxo_geodesic **out)
{
    loxo_geodesic_settings chosen = settings != NULL ? *settings : loxo_geodesic_settings_default();
    const double start_s = loxo_os_clock_s();
    loxo_geodesic *g = NULL;
    if (out == NULL || ctx == NULL) return LOXO_ERR_ARGUMENT;
    *out = NULL;
    if (mesh == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: the mesh is NULL");
    loxo_status status = loxo_options_check(ctx, "geodesic", loxo_geodesic_options, &chosen);
    if (status < 0) return status;
    if (loxo_mesh_n_faces(mesh) == 0) return loxo_fail(ctx, LOXO_ERR_MESH, "geodesic: the mesh has no faces");

    if ((status = loxo_geodesic_resolve(ctx, loxo_mesh_get_view(mesh).n_vertices, 1, &chosen)) < 0) return status;
    g = loxo_allocate(ctx, 1, sizeof *g);
    if (g == NULL) return LOXO_ERR_MEMORY;
    *g = (loxo_geodesic){.engine = engines[chosen.method]};
    g->problem = (geodesic_problem){.ctx = ctx, .mesh = mesh, .m = loxo_mesh_get_view(mesh), .settings = chosen};
    loxo_progress_begin(ctx);
    if ((status = measure_mesh(&g->problem)) < 0) goto fail;
    if ((status = g->engine->create(&g->problem, &g->state)) < 0) goto fail;
    if (g->engine->room != NULL)
        g->distance = g->engine->room(g->state);
    else
        g->distance = g->own_distance = loxo_allocate(ctx, g->problem.m.n_vertices, sizeof *g->distance);
    if (chosen.nearest) g->nearest = loxo_allocate(ctx, g->problem.m.n_vertices, sizeof *g->nearest);
    if (g->distance == NULL || (chosen.nearest && g->nearest == NULL)) {
        status = LOXO_ERR_MEMORY;
        goto fail;
    }
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
    loxo_context *ctx = geodesic->problem.ctx;
    geodesic->engine->destroy(geodesic->state);
    loxo_release(ctx, geodesic->own_distance);
    loxo_release(ctx, geodesic->nearest);
    loxo_release(ctx, geodesic->seeds);
    loxo_release(ctx, geodesic);
}

/* Warnings and the status of a finished solve: the method's, where that is not good. */
static loxo_status judge(const loxo_geodesic *g, loxo_status of_method, const loxo_geodesic_info *info)
{
    loxo_context *ctx = g->problem.ctx;
    if (info->n_unreached > 0 && !(g->problem.settings.max_distance < HUGE_VAL))
        loxo_warn(ctx, "geodesic-unreached", info->n_unreached,
                  "%" PRId64 " vertices cannot be reached from the sources; their distance is infinite",
                  info->n_unreached);
    if (of_method != LOXO_OK || info->check_passed) return of_method;
    if (info->error_estimate > g->problem.settings.check_estimate)
        return loxo_fail(ctx, LOXO_CHECK_FAILED,
                         "geodesic: the distances are estimated to be off by %.2g %% on average: take an intrinsic "
                         "Delaunay triangulation, or exact",
                         100.0 * info->error_estimate);
    return loxo_fail(ctx, LOXO_CHECK_FAILED,
                     "geodesic: the distances do not pass their check: the gradient's length is off 1 by over a "
                     "tenth on %.1f %% of the area, edges are breached by %.3g (99th percentile), %" PRId64
                     " are negative",
                     100.0 * info->gradient_share, info->breach_percentile_99, info->n_negative);
}

static int64_t count_infinite(loxo_context *ctx, const double *distance, int64_t n)
{
    int64_t n_infinite = 0;
#pragma omp parallel for num_threads(loxo_threads_for(ctx, n, 0.5)) reduction(+ : n_infinite)
    for (int64_t v = 0; v < n; ++v)
        n_infinite += isfinite(distance[v]) ? 0 : 1;
    return n_infinite;
}

/* Adds the time since *clock_s to a phase. */
static void add_phase(loxo_geodesic_info *info, loxo_geodesic_phase phase, double *clock_s)
{
    const double now = loxo_os_clock_s();
    info->phase_s[phase] += now - *clock_s;
    *clock_s = now;
}

/* What the solver holds besides the method's workspace. */
static size_t own_bytes(const loxo_geodesic_settings *settings, const geodesic_engine *engine, int64_t n)
{
    const size_t each = (engine->room == NULL ? sizeof(double) : 0) + (settings->nearest ? sizeof(loxo_index) : 0);
    return each * (size_t)n;
}

/* may_point_anywhere: a given heat, whose distances may be negative. */
static loxo_status solve(loxo_geodesic *g, const geodesic_seed *seeds, int64_t n_seeds, bool may_point_anywhere,
                         double *distance, loxo_geodesic_info *info)
{
    const geodesic_problem *problem = &g->problem;
    g->is_solved = false;
    info->phase_s[LOXO_GEODESIC_PHASE_PREPARE] = g->prepare_s;
    const loxo_status of_method = g->engine->solve(g->state, seeds, n_seeds, g->distance, g->nearest, info);
    if (of_method < 0) return of_method;
    double clock_s = loxo_os_clock_s();
    int64_t n_touched = 0;
    const loxo_index *touched = g->engine->touched != NULL ? g->engine->touched(g->state, &n_touched) : NULL;
    const loxo_status status = geodesic_check(problem, g->distance, touched, n_touched, info);
    if (status < 0) return status;
    if (g->engine->is_of_ways) info->check_passed = info->breach_percentile_99 <= problem->settings.check_breach;
    if (info->error_estimate > problem->settings.check_estimate) info->check_passed = false;
    if (info->n_negative > 0 && !may_point_anywhere) info->check_passed = false;
    add_phase(info, LOXO_GEODESIC_PHASE_CHECK, &clock_s);
    loxo_mesh_scatter_to_caller(problem->mesh, g->distance, distance);
    info->n_unreached = count_infinite(problem->ctx, distance, loxo_mesh_n_vertices(problem->mesh));
    add_phase(info, LOXO_GEODESIC_PHASE_INTEGRATE, &clock_s);
    g->is_solved = true;
    info->workspace_bytes += own_bytes(&problem->settings, g->engine, problem->m.n_vertices);
    info->peak_bytes = loxo_context_memory(problem->ctx).peak_bytes;
    info->method = problem->settings.method;
    info->mean_edge_length = problem->mean_edge_length;
    info->n_sources = n_seeds;
    return judge(g, of_method, info);
}

/* From either of vertices and points. heat_value NULL: the method diffuses its own, if it does at all. */
typedef struct solve_call {
    const loxo_index *sources;
    const loxo_surface_point *points;
    int64_t n;
    const double *heat_value;
    const int32_t *heat_scale;
    double *distance;
} solve_call;

static loxo_status solve_from(loxo_geodesic *g, const solve_call *call, loxo_geodesic_info *info)
{
    const double start_s = loxo_os_clock_s();
    loxo_geodesic_info local;
    geodesic_seed *seeds = NULL;
    int64_t n_seeds = 0;
    loxo_status status;
    if (g == NULL) return LOXO_ERR_ARGUMENT;
    if (info == NULL) info = &local;
    *info = (loxo_geodesic_info){.error_estimate = NAN};
    if (call->distance == NULL)
        return loxo_fail(g->problem.ctx, LOXO_ERR_ARGUMENT, "geodesic: the output array is NULL");
    status = call->points != NULL ? geodesic_seeds_from_points(&g->problem, call->points, call->n, &seeds, &n_seeds)
                                  : geodesic_seeds_from_vertices(&g->problem, call->sources, call->n, &seeds, &n_seeds);
    if (status >= 0 && call->heat_value != NULL)
        status = g->engine->give_heat(g->state, call->heat_value, call->heat_scale);
    if (status < 0) { /* the solve before still stands, with its seeds */
        loxo_release(g->problem.ctx, seeds);
        return status;
    }
    loxo_progress_begin(g->problem.ctx);
    status = solve(g, seeds, n_seeds, call->heat_value != NULL, call->distance, info);
    loxo_release(g->problem.ctx, g->seeds);
    g->seeds = seeds;
    g->n_seeds = n_seeds;
    info->total_s = loxo_os_clock_s() - start_s;
    return status;
}

loxo_status loxo_geodesic_solve(loxo_geodesic *geodesic, const loxo_index *sources, int64_t n_sources, double *distance,
                                loxo_geodesic_info *info)
{
    const solve_call call = {.sources = sources, .n = n_sources, .distance = distance};
    return solve_from(geodesic, &call, info);
}

loxo_status loxo_geodesic_solve_points(loxo_geodesic *geodesic, const loxo_surface_point *points, int64_t n_points,
                                       double *distance, loxo_geodesic_info *info)
{
    const solve_call call = {.points = points, .n = n_points, .distance = distance};
    return solve_from(geodesic, &call, info);
}

loxo_status loxo_geodesic_limit(loxo_geodesic *geodesic, double max_distance)
{
    if (geodesic == NULL) return LOXO_ERR_ARGUMENT;
    loxo_geodesic_settings settings = geodesic->problem.settings;
    settings.max_distance = max_distance;
    const loxo_status status = loxo_options_check(geodesic->problem.ctx, "geodesic", loxo_geodesic_options, &settings);
    if (status >= 0) geodesic->problem.settings = settings;
    return status;
}

loxo_status loxo_geodesic_nearest(const loxo_geodesic *geodesic, loxo_index *source)
{
    if (geodesic == NULL) return LOXO_ERR_ARGUMENT;
    const loxo_geodesic *g = geodesic;
    loxo_context *ctx = g->problem.ctx;
    const loxo_mesh *mesh = g->problem.mesh;
    const loxo_index *origin = g->problem.m.vertex_origin, *to_mesh = mesh->caller_to_mesh;
    const int64_t n = g->problem.m.n_vertices;
    if (source == NULL || g->nearest == NULL || !g->is_solved)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT,
                         "geodesic: no nearest sources: no solve yet, or settings.nearest is off");
    if (to_mesh == NULL) {
        for (int64_t v = 0; v < n; ++v)
            source[origin != NULL ? origin[v] : v] = g->nearest[v];
        return LOXO_OK;
    }
    /* After a repair: of the copies of a vertex the one whose distance was given. */
    const int64_t n_caller = loxo_mesh_n_vertices(mesh);
    loxo_index *copy = loxo_allocate(ctx, n_caller, sizeof *copy);
    if (copy == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n_caller; ++i)
        copy[i] = to_mesh[i];
    for (int64_t v = n - 1; v >= 0; --v)
        if (g->distance[v] <= g->distance[copy[origin[v]]]) copy[origin[v]] = (loxo_index)v;
    for (int64_t i = 0; i < n_caller; ++i)
        source[i] = to_mesh[i] >= 0 ? g->nearest[copy[origin[to_mesh[i]]]] : -1;
    loxo_release(ctx, copy);
    return LOXO_OK;
}

static loxo_status refuse_heat(const loxo_geodesic *g)
{
    return loxo_fail(g->problem.ctx, LOXO_ERR_ARGUMENT, "geodesic: method %s takes and gives no heat",
                     loxo_geodesic_method_name(g->problem.settings.method));
}

loxo_status loxo_geodesic_solve_from_heat(loxo_geodesic *geodesic, const loxo_index *sources, int64_t n_sources,
                                          const double *value, const int32_t *scale, double *distance,
                                          loxo_geodesic_info *info)
{
    const solve_call call = {
        .sources = sources, .n = n_sources, .heat_value = value, .heat_scale = scale, .distance = distance};
    if (geodesic == NULL) return LOXO_ERR_ARGUMENT;
    if (value == NULL) return loxo_fail(geodesic->problem.ctx, LOXO_ERR_ARGUMENT, "geodesic: an array is NULL");
    if (geodesic->engine->give_heat == NULL) return refuse_heat(geodesic);
    return solve_from(geodesic, &call, info);
}

loxo_status loxo_geodesic_heat(const loxo_geodesic *geodesic, double *value, int32_t *scale)
{
    if (geodesic == NULL) return LOXO_ERR_ARGUMENT;
    if (value == NULL || scale == NULL)
        return loxo_fail(geodesic->problem.ctx, LOXO_ERR_ARGUMENT, "geodesic: an array is NULL");
    if (geodesic->engine->heat == NULL) return refuse_heat(geodesic);
    return geodesic->engine->heat(geodesic->state, value, scale);
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

/* Two threads are 1.3 to 1.7 times one. */
#define GAIN_OF_A_THREAD 0.5

#define LABEL_BYTES 32 /* a vertex, while nearest sources are found */

loxo_status loxo_geodesic_estimate(loxo_context *ctx, int64_t n_vertices, int64_t n_faces,
                                   const loxo_geodesic_settings *settings, size_t *workspace_bytes, double *solve_s)
{
    geodesic_problem problem = {.ctx = ctx};
    problem.settings = settings != NULL ? *settings : loxo_geodesic_settings_default();
    if (ctx == NULL) return LOXO_ERR_ARGUMENT;
    if (n_vertices < 0 || n_faces < 0)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: a negative number of vertices or faces");
    if (n_vertices > LOXO_INDEX_MAX || n_faces > LOXO_INDEX_MAX / 3)
        return loxo_fail(ctx, LOXO_ERR_LIMIT,
                         "geodesic: %" PRId64 " vertices and %" PRId64 " half-edges; ids go up to %" PRId64, n_vertices,
                         3 * n_faces, (int64_t)LOXO_INDEX_MAX);
    loxo_status status = loxo_options_check(ctx, "geodesic", loxo_geodesic_options, &problem.settings);
    if (status >= 0) status = loxo_geodesic_resolve(ctx, n_vertices, 1, &problem.settings);
    if (status < 0) return status;
    const geodesic_engine *engine = engines[problem.settings.method];
    problem.m.n_vertices = n_vertices;
    problem.m.n_faces = n_faces;
    /* 2 V - F less twice the Euler number is how many edges are at boundaries, where every vertex has a face. */
    problem.n_boundary_edges = 2 * n_vertices - n_faces - 4;
    if (problem.n_boundary_edges < 0) problem.n_boundary_edges = 0;
    if (problem.n_boundary_edges > 3 * n_faces) problem.n_boundary_edges = 3 * n_faces;
    if (workspace_bytes != NULL) {
        *workspace_bytes = engine->bytes(&problem) + own_bytes(&problem.settings, engine, n_vertices);
        /* rays and windows bring their source along; from distances it has to be found (geodesic_label_nearest) */
        if (problem.settings.nearest && !engine->is_of_ways) *workspace_bytes += LABEL_BYTES * (size_t)n_vertices;
    }
    if (solve_s != NULL) {
        const double n_threads = (double)loxo_threads_for(ctx, n_vertices, 100.0);
        const double growth = n_vertices > 0 ? pow(1e-6 * (double)n_vertices, engine->growth) : 1.0;
        *solve_s =
            1e-9 * engine->vertex_ns * growth * (double)n_vertices / (1.0 + GAIN_OF_A_THREAD * (n_threads - 1.0));
    }
    return LOXO_OK;
}
