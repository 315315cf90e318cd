/* SPDX-License-Identifier: MIT
 * The fast method as an engine of geodesic.c: workspace, seeds, and what comes out. */
#include "base/allocate.h"
#include "base/os.h"
#include "kernel/layout_kernel.h"
#include "par/range.h"
#include "solver/geodesic/fast/fast_internal.h"
#include "solver/geodesic/touched.h"

#include <math.h>

static void lay_out(fast_state *s, const loxo_mesh_view *m)
{
    loxo_arena *a = &s->arena;
    const int64_t n = m->n_vertices;
    s->distance = loxo_arena_take(a, n, sizeof *s->distance);
    s->jet = loxo_arena_take(a, n, sizeof *s->jet);
    s->slope = loxo_arena_take(a, 3 * m->n_faces, sizeof *s->slope);
    s->flags = loxo_arena_take(a, n, sizeof *s->flags);
    s->n_times = loxo_arena_take(a, n, sizeof *s->n_times);
    s->queue[0] = loxo_arena_take(a, n, sizeof *s->queue[0]);
    s->queue[1] = loxo_arena_take(a, n, sizeof *s->queue[1]);
    s->awaited = loxo_arena_take(a, n, sizeof *s->awaited);
    s->fresh = loxo_arena_take(a, n, sizeof *s->fresh);
}

static size_t fast_bytes(const geodesic_problem *problem)
{
    fast_state s = {0};
    lay_out(&s, &problem->m);
    return s.arena.size + (size_t)loxo_context_n_threads(problem->ctx) * fast_bench_bytes(FAST_SPOKES_AT_FIRST) +
           (size_t)fast_lists_at_first(&problem->m) *
               (sizeof(fast_task) + sizeof(fast_step) + 2 * (sizeof(fast_doubtful) + sizeof(loxo_index)));
}

static void fast_destroy(void *state)
{
    fast_state *s = state;
    if (s == NULL) return;
    loxo_release(s->ctx, s->taken_back);
    loxo_release(s->ctx, s->doubtful);
    loxo_release(s->ctx, s->step);
    loxo_release(s->ctx, s->task);
    loxo_arena_destroy(s->ctx, &s->bench_arena);
    loxo_release(s->ctx, s->bench);
    loxo_arena_destroy(s->ctx, &s->arena);
    loxo_release(s->ctx, s);
}

static loxo_status fast_create(const geodesic_problem *problem, void **state)
{
    loxo_context *ctx = problem->ctx;
    fast_state *s = loxo_allocate(ctx, 1, sizeof *s);
    loxo_status status;
    *state = s;
    if (s == NULL) return LOXO_ERR_MEMORY;
    *s = (fast_state){.problem = problem, .ctx = ctx, .m = problem->m, .n_touched = -1};
    s->kernels = k_variant_get(loxo_context_isa(ctx));
    s->n_benches = loxo_context_n_threads(ctx);
    lay_out(s, &s->m);
    if ((status = loxo_arena_reserve(ctx, &s->arena, "geodesic: the workspace")) < 0) return status;
    lay_out(s, &s->m);
    if ((s->bench = loxo_allocate_zero(ctx, s->n_benches, sizeof *s->bench)) == NULL) return LOXO_ERR_MEMORY;
    return fast_make_ready(s);
}

/* The corners of the face that a source lies in hear of it straight; so does a vertex that is one. */
static void plant(fast_state *s, const geodesic_seed *seed)
{
    const int64_t f = seed->face;
    double length[3];
    if (seed->vertex >= 0) {
        fast_seed(s, seed->vertex, 0.0, &(fast_jet){.ray = -1}, seed->source);
        return;
    }
    k_face_lengths(&s->m, f, length);
    const k_layout layout = k_layout_of(length);
    const double corner[3][2] = {{0.0, 0.0}, {layout.x1, 0.0}, {layout.x2, layout.y2}};
    double p[2] = {0.0, 0.0};
    for (int k = 0; k < 3; ++k) {
        p[0] += seed->weight[k] * corner[k][0];
        p[1] += seed->weight[k] * corner[k][1];
    }
    for (int k = 0; k < 3; ++k) {
        const double x = corner[k][0] - p[0], y = corner[k][1] - p[1], d = sqrt(x * x + y * y);
        const double a = seed->weight[(k + 1) % 3], b = seed->weight[(k + 2) % 3];
        const fast_jet jet = {.ray = (loxo_index)(3 * f + k),
                              .crossing = fast_crossing(a + b > 0.0 ? b / (a + b) : 0.5),
                              .length = (float)d};
        fast_seed(s, s->m.halfedge_vertex[3 * f + k], d, &jet, seed->source);
    }
}

static void forget(fast_state *s, int64_t v)
{
    s->distance[v] = HUGE_VAL;
    s->flags[v] = s->n_times[v] = 0;
    s->awaited[v] = -1;
    if (s->nearest != NULL) s->nearest[v] = -1;
}

static void clear(fast_state *s)
{
    const int64_t n = s->m.n_vertices;
    if (s->n_touched >= 0) {
        for (int64_t i = 0; i < s->n_touched; ++i)
            forget(s, s->fresh[i]);
    } else {
#pragma omp parallel num_threads(loxo_threads_for(s->ctx, n, 2.0))
        {
            const loxo_range r = loxo_thread_range(n);
            for (int64_t v = r.begin; v < r.end; ++v)
                forget(s, v);
        }
    }
    s->n_touched = -1;
    s->n_next = s->n_doubtful = s->n_taken_back = s->n_rounds = s->n_final = s->n_updates = 0;
    s->next_horizon = s->overhang = 0;
    s->is_renewing = false;
}

/* After a solve within a small ball: the list of what it reached, in fresh. What was taken back has no distance; its count stands
 * in flags. */
static void list_touched(fast_state *s, const geodesic_seed *seeds, int64_t n_seeds)
{
    const geodesic_touch touch = {&s->m, s->distance, s->flags, (uint8_t)~FAST_LISTED, FAST_LISTED};
    if (s->n_final > s->m.n_vertices / 8) return; /* a pass over all vertices costs as little */
    s->n_touched = geodesic_list_touched(&touch, seeds, n_seeds, s->fresh, s->m.n_vertices);
}

/* What is beyond the limit, and what a stop left in the front, was not reached. */
static void drop_unfinished(fast_state *s, double limit, bool is_stopped)
{
    const bool is_listed = s->n_touched >= 0;
    const int64_t n = is_listed ? s->n_touched : s->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(s->ctx, n, 2.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const int64_t v = is_listed ? s->fresh[i] : i;
            if (s->distance[v] <= limit && (!is_stopped || (s->flags[v] & FAST_FINAL) != 0)) continue;
            s->distance[v] = HUGE_VAL;
            if (s->nearest != NULL) s->nearest[v] = -1;
        }
    }
}

/* sums: estimated errors over distances, and how many. */
static void partial_error(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const fast_state *s = arg;
    for (int64_t i = begin; i < end; ++i) {
        const int64_t v = s->n_touched >= 0 ? s->fresh[i] : i;
        if (!(s->distance[v] > 0.0) || !(s->distance[v] < HUGE_VAL)) continue;
        sums[0] += (double)s->jet[v].doubt / s->distance[v];
        sums[1] += 1.0;
    }
}

static loxo_status fast_solve(void *state, const geodesic_seed *seeds, int64_t n_seeds, double *distance,
                              loxo_index *nearest, loxo_geodesic_info *info)
{
    fast_state *s = state;
    const double start_s = loxo_os_clock_s(), limit = s->problem->settings.max_distance;
    const int most_threads = loxo_threads_for(s->ctx, s->m.n_vertices, 250.0);
    s->n_threads = most_threads < s->n_benches ? most_threads : s->n_benches;
    s->distance = distance; /* the room that was asked for */
    s->nearest = nearest;
    clear(s);
    for (int64_t i = 0; i < n_seeds; ++i)
        plant(s, &seeds[i]);
    const loxo_status status = fast_run(s, limit);
    if (status < 0) return status;
    /* Asked in the last round, nothing was left to stop. */
    const bool is_over = s->stage == FAST_COMMIT && s->n_next == 0 && s->n_doubtful == 0;
    const bool is_stopped = status == LOXO_STOPPED && !is_over;
    if (limit < HUGE_VAL) list_touched(s, seeds, n_seeds);
    drop_unfinished(s, limit, is_stopped);
    double sums[2] = {0.0, 0.0};
    const int64_t n_looked_at = s->n_touched >= 0 ? s->n_touched : s->m.n_vertices;
    const loxo_status of_sum = loxo_sum(s->ctx, n_looked_at, 2, partial_error, s, sums);
    if (of_sum < 0) return of_sum;
    info->error_estimate = sums[1] > 0.0 ? sums[0] / sums[1] : 0.0;
    info->n_iterations = s->n_rounds;
    info->n_evaluations = s->n_updates;
    info->workspace_bytes =
        s->arena.size + s->bench_arena.size + (size_t)s->task_capacity * sizeof *s->task +
        (size_t)(s->task_capacity + s->step_capacity) * (sizeof *s->doubtful + sizeof *s->taken_back) +
        (size_t)s->step_capacity * sizeof *s->step;
    info->phase_s[LOXO_GEODESIC_PHASE_PROPAGATE] += loxo_os_clock_s() - start_s;
    if (!is_stopped) return LOXO_OK;
    info->stop_reason = LOXO_STOP_MONITOR;
    return loxo_fail(s->ctx, LOXO_STOPPED, "geodesic: stopped; what the front had not passed is infinite");
}

static double *fast_room(void *state) { return ((fast_state *)state)->distance; }

static const loxo_index *fast_touched(void *state, int64_t *n)
{
    const fast_state *s = state;
    *n = s->n_touched;
    return s->n_touched >= 0 ? s->fresh : NULL;
}

const geodesic_engine geodesic_engine_fast = {.bytes = fast_bytes,
                                              .vertex_ns = 330.0,
                                              .is_of_ways = true,
                                              .create = fast_create,
                                              .solve = fast_solve,
                                              .destroy = fast_destroy,
                                              .room = fast_room,
                                              .touched = fast_touched};
