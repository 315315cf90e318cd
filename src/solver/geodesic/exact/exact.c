/* SPDX-License-Identifier: MIT
 * Exact polyhedral distances: the engine. Windows and bending vertices go on in an order near that of distance; any order
 * would give the same distances. */
#include "base/allocate.h"
#include "base/os.h"
#include "par/range.h"
#include "solver/geodesic/exact/exact_internal.h"
#include "solver/geodesic/touched.h"

/* Of the band of keys that a round takes, in mean edge lengths: as many windows as from a queue that gives the nearest. */
#define WIDTH 1.0

static void lay_out(exact_state *s)
{
    loxo_arena *arena = &s->arena;
    s->list = loxo_arena_take(arena, 3 * s->m.n_faces, sizeof *s->list);
    s->reach = loxo_arena_take(arena, s->m.n_vertices, sizeof *s->reach);
    s->known = loxo_arena_take(arena, s->m.n_vertices, sizeof *s->known);
    s->distance = loxo_arena_take(arena, s->m.n_vertices, sizeof *s->distance);
}

/* The front is what it is: on scans at most 70 windows per square root of the number of vertices, on a flat disk 135, in blocks
 * that are half full, or three quarters there. */
#define FRONT_WINDOWS 110.0
/* Of a thread: free blocks, offers, items. */
#define THREAD_BYTES 80000

static size_t exact_bytes(const geodesic_problem *problem)
{
    exact_state s = {.m = problem->m};
    const double front = FRONT_WINDOWS * sqrt((double)problem->m.n_vertices) * 2.0 * sizeof(exact_block) / EXACT_BLOCK;
    lay_out(&s);
    return s.arena.size + (size_t)front + THREAD_BYTES * (size_t)loxo_context_n_threads(problem->ctx);
}

void exact_destroy(void *state)
{
    exact_state *s = state;
    if (s == NULL) return;
    loxo_context *ctx = s->problem->ctx;
    exact_destroy(s->back); /* which has none itself */
    exact_pool_destroy(ctx, &s->pool);
    for (int i = 0; i < s->n_workers; ++i)
        exact_worker_destroy(ctx, &s->worker[i]);
    loxo_release(ctx, s->worker);
    loxo_release(ctx, s->task);
    loxo_release(ctx, s->touched);
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
            s->known[v] = (uint8_t)(s->known[v] & ~(EXACT_QUEUED | EXACT_LOCKED));
    }
    exact_clear_workers(s);
}

loxo_status exact_create(const geodesic_problem *problem, void **state)
{
    loxo_context *ctx = problem->ctx;
    exact_state *s = loxo_allocate(ctx, 1, sizeof *s);
    *state = s;
    if (s == NULL) return LOXO_ERR_MEMORY;
    *s = (exact_state){.ctx = ctx, .problem = problem, .m = problem->m};
    s->width = WIDTH * problem->mean_edge_length;
    s->n_touched = -1;
    lay_out(s);
    const loxo_status status = loxo_arena_reserve(ctx, &s->arena, "geodesic: the workspace");
    if (status < 0) return status;
    lay_out(s);
    const int n_workers = loxo_context_n_threads(ctx);
    if ((s->worker = loxo_allocate_zero(ctx, n_workers, sizeof *s->worker)) == NULL) return LOXO_ERR_MEMORY;
    s->n_workers = n_workers;
    for (int64_t v = 0; v < s->m.n_vertices; ++v)
        s->known[v] = 0;
    forget_front(s);
    return LOXO_OK;
}

/* After a solve within a small ball: the list of what it reached. Who passes windows on has offered a distance to all corners of
 * the face; should an offer that a stop has left be missed, the count says so. */
static loxo_status list_touched(exact_state *s)
{
    const geodesic_touch touch = {&s->m, s->distance, s->known, 0, EXACT_LISTED};
    if (s->n_reached > s->m.n_vertices / 8) return LOXO_OK; /* a pass over all vertices costs as little */
    if (s->n_reached > s->touched_room) {
        const int64_t room = s->n_reached + s->n_reached / 2;
        loxo_index *touched = loxo_reallocate(s->ctx, s->touched, room, sizeof *touched);
        if (touched == NULL) return LOXO_ERR_MEMORY;
        s->touched = touched;
        s->touched_room = room;
    }
    const int64_t n = geodesic_list_touched(&touch, s->seeds, s->n_seeds, s->touched, s->touched_room);
    if (n == s->n_reached) s->n_touched = n;
    return LOXO_OK;
}

const loxo_index *exact_touched(void *state, int64_t *n)
{
    const exact_state *s = state;
    *n = s->n_touched >= 0 ? s->n_touched : s->m.n_vertices;
    return s->n_touched >= 0 ? s->touched : NULL;
}

/* What the last solve has left of distances. */
static void forget_distances(exact_state *s)
{
    int64_t n;
    const loxo_index *touched = exact_touched(s, &n);
#pragma omp parallel num_threads(loxo_threads_for(s->ctx, n, 0.5))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const int64_t v = touched != NULL ? touched[i] : i;
            s->distance[v] = HUGE_VAL;
            if (s->nearest != NULL) s->nearest[v] = -1;
        }
    }
    s->n_touched = -1;
}

static void drop_beyond(exact_state *s, double max_distance)
{
    int64_t n;
    const loxo_index *touched = exact_touched(s, &n);
    for (int64_t i = 0; i < n; ++i) {
        const int64_t v = touched != NULL ? touched[i] : i;
        if (s->distance[v] > max_distance) s->distance[v] = HUGE_VAL;
    }
}

/* The seed that a vertex's way comes from: that of the vertex where it bends last, and so on. */
static void find_nearest(exact_state *s)
{
    int64_t n;
    const loxo_index *touched = exact_touched(s, &n);
    loxo_index *nearest = s->nearest;
    for (int64_t i = 0; i < n; ++i) {
        const int64_t v = touched != NULL ? touched[i] : i;
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
    size_t size = s->arena.size + exact_pool_bytes(&s->pool) + (size_t)s->task_room * sizeof *s->task +
                  (size_t)s->touched_room * sizeof *s->touched;
    for (int i = 0; i < s->n_workers; ++i)
        size += exact_worker_bytes(&s->worker[i]);
    return size;
}

/* Vertices along a front, and lists in a round, are some for each square root of all. Goals are met by one thread. */
#define ROOTS_A_THREAD 12.0
/* Vertices up to which one thread is done in some milliseconds. Two gain a few of these, and on a machine with others at work lose a time slice
 * a phase: 2,562 vertices with three others to a core, 0.02 s on one thread and 0.3 s on two. */
#define FEW_VERTICES 5000

static int threads_for(const exact_state *s)
{
    const int n_threads = loxo_threads_for(s->ctx, s->m.n_vertices, 3000.0);
    const double most = sqrt((double)s->m.n_vertices) / ROOTS_A_THREAD;
    if (s->n_goals > 0 || most < 2.0 || s->m.n_vertices <= FEW_VERTICES) return 1;
    return most < (double)n_threads ? (int)most : n_threads;
}

loxo_status exact_run(exact_state *s, const geodesic_seed *seeds, int64_t n_seeds, double max_distance,
                      bool *is_stopped)
{
    loxo_status status = LOXO_OK;
    *is_stopped = false;
    if (n_seeds > INT32_MAX)
        return loxo_fail(s->ctx, LOXO_ERR_LIMIT, "geodesic: method exact takes at most %d sources", INT32_MAX);
    s->n_threads = threads_for(s);
    s->seeds = seeds;
    s->n_seeds = n_seeds;
    s->max_distance = max_distance;
    s->n_windows = s->n_bends = s->n_reached = s->n_rounds = 0;
    s->goal_distance = HUGE_VAL;
    s->pool.peak_live = 0;
    forget_distances(s);
    for (int i = 0; i < s->n_workers; ++i) {
        s->worker[i].n_windows = s->worker[i].n_bends = s->worker[i].n_reached = 0;
        s->worker[i].least = HUGE_VAL;
    }
    for (int64_t i = 0; i < n_seeds && status >= 0; ++i)
        status = exact_send_from_seed(s, i);
    if (status >= 0) status = exact_run_rounds(s);
    double limit = max_distance;
    if (status == LOXO_STOPPED) {
        const double to_come = exact_least_to_come(s);
        *is_stopped = to_come < HUGE_VAL; /* asked in the last round, nothing was left to stop */
        limit = fmin(limit, to_come * (1.0 - K_WINDOW_SLACK));
    }
    if (status != LOXO_OK) forget_front(s);
    if (status < 0) return status;
    s->n_reached = 0;
    for (int i = 0; i < s->n_threads; ++i) {
        s->n_windows += s->worker[i].n_windows;
        s->n_bends += s->worker[i].n_bends;
        s->n_reached += s->worker[i].n_reached;
    }
    if (limit < HUGE_VAL) {
        const loxo_status of_list = list_touched(s);
        if (of_list < 0) return of_list;
        drop_beyond(s, limit);
    }
    return LOXO_OK;
}

static loxo_status exact_solve(void *state, const geodesic_seed *seeds, int64_t n_seeds, double *distance,
                               loxo_index *nearest, loxo_geodesic_info *info)
{
    exact_state *s = state;
    bool is_stopped;
    const double start_s = loxo_os_clock_s();
    s->distance = distance; /* the room that was asked for */
    s->nearest = nearest;
    const loxo_status status = exact_run(s, seeds, n_seeds, s->problem->settings.max_distance, &is_stopped);
    if (status < 0) return status;
    if (nearest != NULL) find_nearest(s);
    info->n_evaluations = s->n_windows;
    info->n_bends = s->n_bends;
    info->n_iterations = s->n_rounds;
    info->max_windows = s->pool.peak_live;
    info->workspace_bytes = bytes_held(s);
    info->phase_s[LOXO_GEODESIC_PHASE_PROPAGATE] += loxo_os_clock_s() - start_s;
    info->stop_reason = is_stopped ? LOXO_STOP_MONITOR : LOXO_STOP_TOLERANCE;
    return is_stopped ? loxo_fail(s->ctx, LOXO_STOPPED, "geodesic: stopped; what was not certain yet is infinite")
                      : LOXO_OK;
}

static double *exact_room(void *state) { return ((exact_state *)state)->distance; }

/* vertex_ns beside other jobs: bumpy sphere of 250k 3,000, of 1M 5,600, igea 8,500: windows a vertex depend on the shape. */
const geodesic_engine geodesic_engine_exact = {
    .bytes = exact_bytes,
    .vertex_ns = 5000.0,
    .growth = 0.1, /* on surfaces whose shape stays; by the windows that meet in a face */
    .is_of_ways = true,
    .create = exact_create,
    .solve = exact_solve,
    .destroy = exact_destroy,
    .room = exact_room,
    .touched = exact_touched,
    .trace = exact_trace_from,
};
