/* SPDX-License-Identifier: MIT
 * The front moves in rounds of three phases, each shared out in chunks: which lists and vertices are within the band of the
 * nearest; those send their windows on, by the distances that stood when the round began; what that offers to vertices is
 * judged. Of each vertex the least offer stays and windows of a list are sorted, so nothing depends on the order in which
 * chunks are worked on. */
#include "base/allocate.h"
#include "par/phases.h"
#include "par/range.h"
#include "solver/geodesic/exact/exact_internal.h"

#include <string.h>

#define SELECT_CHUNK  ((int64_t)256)
#define PASS_ON_CHUNK ((int64_t)8)
#define JUDGE_CHUNK   ((int64_t)128)

static inline double least(double a, double b) { return a < b ? a : b; }

static inline bool is_vertex(const exact_state *s, uint32_t item) { return item >= (uint32_t)(3 * s->m.n_faces); }

static inline double key_of(const exact_state *s, loxo_index h)
{
    return least(s->distance[s->m.halfedge_vertex[h]], s->distance[k_head(&s->m, h)]);
}

/* A list waits for those that may still add to it: what lies on the other sides of the face below, and is nearer. */
static bool has_to_wait(const exact_state *s, loxo_index h, double key)
{
    const loxo_index below = s->m.halfedge_twin[h], left = k_next(below), right = k_previous(below);
    return (s->list[left] != EXACT_NONE && key_of(s, left) < key) ||
           (s->list[right] != EXACT_NONE && key_of(s, right) < key);
}

static void select_items(exact_state *s, exact_worker *worker, const uint32_t *item, int64_t n)
{
    const double limit = s->horizon + s->width;
    uint32_t taken[SELECT_CHUNK];
    int64_t n_taken = 0;
    for (int64_t i = 0; i < n; ++i) {
        const bool is_list = !is_vertex(s, item[i]);
        const double key =
            is_list ? key_of(s, (loxo_index)item[i]) : s->distance[item[i] - (uint32_t)(3 * s->m.n_faces)];
        if (key <= limit && !(is_list && has_to_wait(s, (loxo_index)item[i], key)))
            taken[n_taken++] = item[i];
        else
            exact_queue(s, worker, item[i], key);
    }
    const int64_t to = s->n_threads > 1 ? __atomic_fetch_add(&s->n_tasks, n_taken, __ATOMIC_RELAXED) : s->n_tasks;
    if (s->n_threads == 1) s->n_tasks += n_taken;
    memcpy(&s->task[to], taken, (size_t)n_taken * sizeof *taken);
}

#define BLOCKS_AHEAD 4

/* What a list needs lies anywhere: that of all lists of a chunk is asked for side by side before it is looked at. The first blocks
 * and what is around the apex, then block after block. */
static void fetch_lists(const exact_state *s, const uint32_t *task, int64_t n)
{
    const loxo_mesh_view *m = &s->m;
    uint32_t at[PASS_ON_CHUNK];
    for (int64_t i = 0; i < n; ++i) {
        const uint32_t item = task[i];
        at[i] = EXACT_NONE;
        if (item == EXACT_NONE || is_vertex(s, item)) continue;
        const loxo_index next = k_next((loxo_index)item), previous = k_previous((loxo_index)item);
        const loxo_index apex = m->halfedge_vertex[previous];
        const loxo_index left = m->halfedge_twin[previous], right = m->halfedge_twin[next];
        at[i] = __atomic_load_n(&s->list[item], __ATOMIC_ACQUIRE);
        if (at[i] != EXACT_NONE) __builtin_prefetch(&exact_pool_block(&s->pool, at[i])->n);
        __builtin_prefetch(&s->distance[apex]);
        __builtin_prefetch(&s->reach[apex]);
        if (m->position != NULL) __builtin_prefetch(m->position[apex]);
        if (m->position_float != NULL) __builtin_prefetch(m->position_float[apex]);
        if (left >= 0) __builtin_prefetch(&s->list[left]);
        if (right >= 0) __builtin_prefetch(&s->list[right]);
    }
    for (int k = 0; k < BLOCKS_AHEAD; ++k)
        for (int64_t i = 0; i < n; ++i) {
            if (at[i] == EXACT_NONE) continue;
            const exact_block *block = exact_pool_block(&s->pool, at[i]);
            for (int j = 0; j < EXACT_BLOCK; j += 2)
                __builtin_prefetch(&block->w[j]);
            at[i] = block->next;
            if (at[i] != EXACT_NONE) __builtin_prefetch(&exact_pool_block(&s->pool, at[i])->n);
        }
}

static void send_on(exact_state *s, exact_worker *worker, int64_t begin, int64_t end)
{
    fetch_lists(s, &s->task[begin], end - begin);
    for (int64_t i = begin; i < end; ++i) {
        const uint32_t item = s->task[i];
        bool is_done = true;
        if (item == EXACT_NONE) continue;
        if (is_vertex(s, item))
            is_done = exact_send_from_vertex(s, worker, (loxo_index)(item - (uint32_t)(3 * s->m.n_faces)));
        else
            is_done = exact_pass_on(s, worker, (loxo_index)item);
        if (is_done) s->task[i] = EXACT_NONE;
    }
}

/* Of two ways that are equally long, the same one whatever comes first. */
static bool is_preferred(const exact_reach *a, const exact_reach *b)
{
    if (a->via != b->via) return a->via < b->via;
    if (a->at != b->at) return a->at < b->at;
    if (a->origin != b->origin) return a->origin < b->origin;
    return a->x != b->x ? a->x < b->x : a->y < b->y;
}

void exact_judge(exact_state *s, exact_worker *worker, const exact_offer *offer)
{
    const loxo_index v = offer->vertex;
    uint8_t known;
    if (s->n_threads > 1) do
            known = __atomic_fetch_or(&s->known[v], EXACT_LOCKED, __ATOMIC_ACQUIRE);
        while ((known & EXACT_LOCKED) != 0);
    else
        known = s->known[v];
    const double old = s->distance[v];
    if (offer->distance < old || (offer->distance == old && is_preferred(&offer->reach, &s->reach[v]))) {
        if (old == HUGE_VAL) worker->n_reached += 1;
        s->distance[v] = offer->distance;
        s->reach[v] = offer->reach;
        if (!(known & EXACT_LOOKED_AT)) known = (uint8_t)(known | exact_look_at(s, v));
        if ((known & EXACT_BENDS) && !(known & EXACT_QUEUED) && offer->is_news) {
            known = (uint8_t)(known | EXACT_QUEUED);
            exact_queue(s, worker, (uint32_t)(3 * s->m.n_faces) + (uint32_t)v, offer->distance);
        } else if ((known & EXACT_QUEUED) && offer->distance < worker->least) {
            worker->least = offer->distance; /* else the key of the first to come would be what is known of it */
        }
    }
    if (s->n_threads > 1)
        __atomic_store_n(&s->known[v], known, __ATOMIC_RELEASE);
    else
        s->known[v] = known;
}

static int64_t n_chunks(int64_t n, int64_t chunk) { return (n + chunk - 1) / chunk; }

static int64_t items_of(const exact_state *s, const exact_worker *worker) { return worker->n_items[s->side]; }

/* Items or offers stand with the workers that found them; chunks are numbered through all of them. */
static void work(void *arg, int64_t chunk)
{
    exact_state *s = arg;
    exact_worker *worker = &s->worker[s->n_threads > 1 ? loxo_thread_id() : 0];
    if (s->stage == EXACT_PASS_ON) {
        const int64_t end = (chunk + 1) * PASS_ON_CHUNK;
        send_on(s, worker, chunk * PASS_ON_CHUNK, end < s->n_tasks ? end : s->n_tasks);
        return;
    }
    const int64_t size = s->stage == EXACT_SELECT ? SELECT_CHUNK : JUDGE_CHUNK;
    for (int i = 0; i < s->n_threads; ++i) {
        const exact_worker *from = &s->worker[i];
        const int64_t n = s->stage == EXACT_SELECT ? items_of(s, from) : from->n_offers;
        if (chunk < n_chunks(n, size)) {
            const int64_t begin = chunk * size, end = begin + size < n ? begin + size : n;
            if (s->stage == EXACT_SELECT)
                select_items(s, worker, from->item[s->side] + begin, end - begin);
            else
                for (int64_t k = begin; k < end; ++k)
                    exact_judge(s, worker, &from->offer[k]);
            return;
        }
        chunk -= n_chunks(n, size);
    }
}

/* The number of chunks of the stage; -1: there is no room for what it may bring. */
static int64_t begin_stage(exact_state *s)
{
    int64_t n = 0, n_all = 0;
    bool fits = true;
    if (s->stage == EXACT_PASS_ON) return n_chunks(s->n_tasks, PASS_ON_CHUNK);
    for (int i = 0; i < s->n_threads; ++i) {
        const int64_t n_here = s->stage == EXACT_SELECT ? items_of(s, &s->worker[i]) : s->worker[i].n_offers;
        n += n_chunks(n_here, s->stage == EXACT_SELECT ? SELECT_CHUNK : JUDGE_CHUNK);
        n_all += n_here;
    }
    for (int i = 0; i < s->n_threads; ++i)
        fits &= exact_has_room(s, &s->worker[i], &(exact_needs){.n_items = n_all});
    if (s->stage == EXACT_SELECT && n_all > s->task_room) {
        s->task_wanted = n_all;
        fits = false;
    }
    return fits ? n : -1;
}

static void begin_round(exact_state *s)
{
    s->horizon = HUGE_VAL;
    int64_t n_reached = 0;
    for (int i = 0; i < s->n_threads; ++i) {
        exact_worker *worker = &s->worker[i];
        s->horizon = least(s->horizon, worker->least);
        worker->least = HUGE_VAL;
        s->pool.n_live += worker->n_more;
        worker->n_more = 0;
        worker->n_items[s->side] = 0;
        worker->n_offers = 0;
        n_reached += worker->n_reached;
    }
    if (s->pool.n_live > s->pool.peak_live) s->pool.peak_live = s->pool.n_live;
    __atomic_store_n(&s->n_reached, n_reached, __ATOMIC_RELAXED);
    s->side = 1 - s->side;
    s->round += 1;
    s->n_tasks = 0;
    s->stage = EXACT_SELECT;
}

static bool is_room_wanted(const exact_state *s)
{
    for (int i = 0; i < s->n_threads; ++i) {
        const exact_needs *wanted = &s->worker[i].wanted;
        if (wanted->n_windows + wanted->n_blocks + wanted->n_items + wanted->n_offers > 0) return true;
    }
    return false;
}

static bool is_queue_empty(const exact_state *s)
{
    for (int i = 0; i < s->n_threads; ++i)
        if (items_of(s, &s->worker[i]) > 0) return false;
    return true;
}

static int64_t advance(void *arg)
{
    exact_state *s = arg;
    if (!s->is_begun) { /* the first call of all, or a stage that is begun, or gone on with, when there is more room */
        s->is_begun = true;
    } else if (s->stage == EXACT_SELECT) {
        s->stage = EXACT_PASS_ON;
    } else if (s->stage == EXACT_PASS_ON) {
        if (is_room_wanted(s)) return -1;
        s->stage = EXACT_JUDGE;
    } else {
        begin_round(s);
        s->n_rounds += 1;
    }
    if (s->stage == EXACT_SELECT && is_queue_empty(s)) {
        s->is_over = true;
        return -1;
    }
    return begin_stage(s);
}

static bool poll(void *arg)
{
    const exact_state *s = arg;
    const double n_reached = (double)__atomic_load_n(&s->n_reached, __ATOMIC_RELAXED);
    return loxo_stop_wanted(s->ctx, "windows", n_reached / (double)s->m.n_vertices);
}

double exact_least_to_come(const exact_state *s)
{
    const loxo_mesh_view *m = &s->m;
    double to_come = HUGE_VAL;
    for (int64_t h = 0; h < 3 * m->n_faces; ++h)
        for (uint32_t id = s->list[h]; id != EXACT_NONE; id = exact_pool_block(&s->pool, id)->next) {
            const exact_block *block = exact_pool_block(&s->pool, id);
            for (uint32_t i = 0; i < block->n; ++i)
                to_come = least(to_come, k_window_least_way(&block->w[i]));
        }
    for (int64_t v = 0; v < m->n_vertices; ++v)
        if ((s->known[v] & EXACT_QUEUED) != 0) to_come = least(to_come, s->distance[v]);
    for (int i = 0; i < s->n_threads && s->stage == EXACT_PASS_ON; ++i) /* found, and not judged */
        for (int64_t k = 0; k < s->worker[i].n_offers; ++k)
            to_come = least(to_come, s->worker[i].offer[k].distance);
    return to_come;
}

static loxo_status make_room(exact_state *s)
{
    if (s->task_wanted > s->task_room) {
        const int64_t room = s->task_wanted + s->task_wanted / 2;
        uint32_t *task = loxo_reallocate(s->ctx, s->task, room, sizeof *task);
        if (task == NULL) return LOXO_ERR_MEMORY;
        s->task = task;
        s->task_room = room;
    }
    return exact_make_room(s);
}

loxo_status exact_run_rounds(exact_state *s)
{
    const loxo_phases phases = {advance, work, poll, s};
    s->is_over = false;
    begin_round(s);
    for (;;) {
        s->is_begun = false;
        if (loxo_phases_run(&phases, s->n_threads)) return LOXO_STOPPED;
        if (s->is_over) return LOXO_OK;
        const loxo_status status = make_room(s);
        if (status < 0) return status;
    }
}
