/* SPDX-License-Identifier: MIT
 * Exact polyhedral distances: the engine. Windows and bending vertices leave one queue in an order near that of
 * distance; any order would give the same distances. */
#include "base/allocate.h"
#include "base/os.h"
#include "par/range.h"
#include "solver/geodesic/exact/exact_internal.h"

/* How often the monitor is asked, in lists and vertices. */
#define LOOK_UP_EVERY 1024

static void lay_out(exact_state *s)
{
    loxo_arena *arena = &s->arena;
    s->list = loxo_arena_take(arena, 3 * s->m.n_faces, sizeof *s->list);
    s->reach = loxo_arena_take(arena, s->m.n_vertices, sizeof *s->reach);
    s->known = loxo_arena_take(arena, s->m.n_vertices, sizeof *s->known);
}

/* The front is what it is; on scans it was at most 70 windows per square root of the number of vertices, in blocks that are half
 * full. */
#define FRONT_WINDOWS 70.0

static size_t exact_bytes(const geodesic_problem *problem)
{
    exact_state s = {.m = problem->m};
    const double front = FRONT_WINDOWS * sqrt((double)problem->m.n_vertices) * 2.0 * sizeof(exact_block) / EXACT_BLOCK;
    lay_out(&s);
    return s.arena.size + (size_t)front;
}

void exact_destroy(void *state)
{
    exact_state *s = state;
    if (s == NULL) return;
    loxo_context *ctx = s->problem->ctx;
    exact_destroy(s->back); /* which has none itself */
    loxo_release(ctx, s->back_distance);
    exact_pool_destroy(ctx, &s->pool);
    exact_queue_destroy(ctx, &s->queue);
    exact_work_destroy(ctx, &s->work);
    loxo_arena_destroy(ctx, &s->arena);
    loxo_release(ctx, s);
}

/* No window on the way, no vertex in the queue. */
static void forget_front(exact_state *s)
{
    const int64_t n_halfedges = 3 * s->m.n_faces, n_vertices = s->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(s->ctx, n_halfedges, 0.5))
    {
        const loxo_range r = loxo_thread_range(n_halfedges), q = loxo_thread_range(n_vertices);
        for (int64_t h = r.begin; h < r.end; ++h)
            s->list[h] = EXACT_NONE;
        for (int64_t v = q.begin; v < q.end; ++v)
            s->known[v] = (uint8_t)(s->known[v] & ~EXACT_QUEUED);
    }
    exact_queue_clear(&s->queue);
    exact_pool_clear(&s->pool);
}

loxo_status exact_create(const geodesic_problem *problem, void **state)
{
    loxo_context *ctx = problem->ctx;
    exact_state *s = loxo_allocate(ctx, 1, sizeof *s);
    *state = s;
    if (s == NULL) return LOXO_ERR_MEMORY;
    *s = (exact_state){.ctx = ctx, .problem = problem, .m = problem->m};
    s->key_scale = 1.0 / problem->mean_edge_length;
    lay_out(s);
    const loxo_status status = loxo_arena_reserve(ctx, &s->arena, "geodesic: the workspace");
    if (status < 0) return status;
    lay_out(s);
    for (int64_t v = 0; v < s->m.n_vertices; ++v)
        s->known[v] = 0;
    forget_front(s);
    return LOXO_OK;
}

/* Until nothing is on its way. */
static loxo_status propagate(exact_state *s, bool *is_stopped)
{
    const uint32_t first_vertex = (uint32_t)(3 * s->m.n_faces);
    int64_t n_taken = 0;
    loxo_status status = LOXO_OK;
    while (s->queue.n > 0 && status >= 0) {
        const uint32_t item = exact_queue_pop(&s->queue);
        if (item < first_vertex) {
            status = exact_pass_on(s, (loxo_index)item);
        } else if (s->known[item - first_vertex] & EXACT_QUEUED) {
            const loxo_index vertex = (loxo_index)(item - first_vertex);
            s->known[vertex] = (uint8_t)(s->known[vertex] & ~EXACT_QUEUED);
            if (!(s->distance[vertex] > s->max_distance)) status = exact_send_from_vertex(s, vertex);
        }
        if (++n_taken % LOOK_UP_EVERY == 0 &&
            loxo_stop_wanted(s->ctx, "windows", (double)s->n_reached / (double)s->m.n_vertices)) {
            *is_stopped = true;
            break;
        }
    }
    return status;
}

/* The seed that a vertex's way comes from: that of the vertex where it bends last, and so on. */
static void find_nearest(const exact_state *s, loxo_index *nearest)
{
    for (int64_t v = 0; v < s->m.n_vertices; ++v)
        nearest[v] = -1;
    for (int64_t v = 0; v < s->m.n_vertices; ++v) {
        int64_t w = v;
        if (s->distance[v] == HUGE_VAL) continue;
        while (nearest[w] < 0 && s->reach[w].origin >= 0)
            w = s->reach[w].origin;
        const loxo_index source = nearest[w] >= 0 ? nearest[w] : s->seeds[-1 - (int64_t)s->reach[w].origin].source;
        for (w = v; nearest[w] < 0; w = s->reach[w].origin) {
            nearest[w] = source;
            if (s->reach[w].origin < 0) break;
        }
    }
}

static size_t bytes_held(const exact_state *s)
{
    return s->arena.size + exact_pool_bytes(&s->pool) + (size_t)s->queue.room * sizeof *s->queue.entry +
           (size_t)s->work.room * 2 * (sizeof(exact_taken) + sizeof(struct exact_place));
}

loxo_status exact_run(exact_state *s, const geodesic_seed *seeds, int64_t n_seeds, double max_distance,
                      double *distance, bool *is_stopped)
{
    loxo_status status = LOXO_OK;
    *is_stopped = false;
    if (n_seeds > INT32_MAX)
        return loxo_fail(s->ctx, LOXO_ERR_LIMIT, "geodesic: method exact takes at most %d sources", INT32_MAX);
    s->distance = distance;
    s->seeds = seeds;
    s->n_seeds = n_seeds;
    s->max_distance = max_distance;
    s->n_windows = s->n_bends = s->n_reached = 0;
    s->goal_distance = HUGE_VAL;
    s->pool.peak_live = 0;
    s->queue.last = 0;
#pragma omp parallel num_threads(loxo_threads_for(s->ctx, s->m.n_vertices, 0.5))
    {
        const loxo_range r = loxo_thread_range(s->m.n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v)
            distance[v] = HUGE_VAL;
    }
    for (int64_t i = 0; i < n_seeds && status >= 0; ++i)
        status = exact_send_from_seed(s, i);
    if (status >= 0) status = propagate(s, is_stopped);
    if (status < 0 || *is_stopped) forget_front(s);
    if (status >= 0 && max_distance < HUGE_VAL)
        for (int64_t v = 0; v < s->m.n_vertices; ++v)
            if (distance[v] > max_distance) distance[v] = HUGE_VAL;
    return status;
}

static loxo_status exact_solve(void *state, const geodesic_seed *seeds, int64_t n_seeds, double *distance,
                               loxo_index *nearest, loxo_geodesic_info *info)
{
    exact_state *s = state;
    bool is_stopped;
    const double start_s = loxo_os_clock_s();
    const loxo_status status = exact_run(s, seeds, n_seeds, s->problem->settings.max_distance, distance, &is_stopped);
    if (status < 0) return status;
    if (nearest != NULL) find_nearest(s, nearest);
    info->n_evaluations = s->n_windows;
    info->n_bends = s->n_bends;
    info->max_windows = s->pool.peak_live;
    info->workspace_bytes = bytes_held(s);
    info->phase_s[LOXO_GEODESIC_PHASE_PROPAGATE] += loxo_os_clock_s() - start_s;
    info->stop_reason = is_stopped ? LOXO_STOP_MONITOR : LOXO_STOP_TOLERANCE;
    return is_stopped ? loxo_fail(s->ctx, LOXO_STOPPED, "geodesic: stopped; the distances are those of the last state")
                      : LOXO_OK;
}

/* vertex_ns beside other jobs: bumpy sphere of 250k 3,000, of 1M 5,600, igea 8,500: windows a vertex depend on the shape. */
const geodesic_engine geodesic_engine_exact = {
    .bytes = exact_bytes,
    .vertex_ns = 5000.0,
    .growth = 0.1, /* on surfaces whose shape stays; by the windows that meet in a face */
    .is_of_ways = true,
    .create = exact_create,
    .solve = exact_solve,
    .destroy = exact_destroy,
    .trace = exact_trace_from,
};
