/* SPDX-License-Identifier: MIT
 * The front moves in rounds of three phases, each shared out in chunks: which of the front are final now; what those
 * tell; what their neighbours make of it. A round reads what earlier rounds wrote, and of all that a vertex hears in
 * one round it keeps the least: so nothing depends on the order in which chunks are worked on. */
#include "base/allocate.h"
#include "kernel/vec3.h"
#include "par/phases.h"
#include "par/range.h"
#include "solver/geodesic/fast/fast_internal.h"

#include <math.h>
#include <string.h>

#define SELECT_CHUNK   ((int64_t)512)
#define COMMIT_CHUNK   ((int64_t)2 * K_JETS)
#define LISTS_AT_FIRST 16384
#define ASK_AHEAD      ((int64_t)12)

/* The bits of a distance: as whole numbers they are ordered as distances are. */
static uint64_t bits_of(double distance)
{
    uint64_t bits;
    memcpy(&bits, &distance, sizeof bits);
    return bits;
}

static void lower(uint64_t *least, uint64_t bits)
{
    uint64_t old = __atomic_load_n(least, __ATOMIC_RELAXED);
    while (bits < old && !__atomic_compare_exchange_n(least, &old, bits, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
    }
}

static void lift(uint64_t *most, uint64_t bits)
{
    uint64_t old = __atomic_load_n(most, __ATOMIC_RELAXED);
    while (bits > old && !__atomic_compare_exchange_n(most, &old, bits, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
    }
}

void fast_queue(fast_state *s, const loxo_index *vertex, int64_t n)
{
    if (n == 0) return;
    const int64_t begin = __atomic_fetch_add(&s->n_next, n, __ATOMIC_RELAXED);
    memcpy(&s->queue[1 - s->side][begin], vertex, (size_t)n * sizeof *vertex);
}

/* Whether v has to wait for y. What becomes final in this very round counts as not final: so it does not matter which of the
 * two is looked at first. */
static bool is_nearer(const fast_state *s, loxo_index y, double d)
{
    return s->distance[y] < d && (fast_flags(s, y) & (FAST_FINAL | FAST_NEW)) != FAST_FINAL;
}

/* A neighbour that v has to wait for, -1: none. Looked at are the ends of the four spokes about its ray: those beside it are the
 * ones that may still tell it something, and the front has been there, so they are in the cache, unlike those ahead. */
static loxo_index find_nearer(const fast_state *s, loxo_index v, double d)
{
    const loxo_mesh_view *m = &s->m;
    const loxo_index ray = s->jet[v].ray;
    if (ray < 0) return -1;
    const loxo_index back = k_previous(ray), left = m->halfedge_twin[back], right = m->halfedge_twin[ray];
    const loxo_index beside[4] = {k_head(m, ray), m->halfedge_vertex[back],
                                  left >= 0 ? m->halfedge_vertex[k_previous(left)] : -1,
                                  right >= 0 ? m->halfedge_vertex[k_previous(right)] : -1};
    for (int i = 0; i < 4; ++i)
        if (beside[i] >= 0 && is_nearer(s, beside[i], d)) return beside[i];
    return -1;
}

/* Asks for what looking at the queue's entries after i will need: most of it is in a farther cache. */
static inline void ask_ahead(const fast_state *s, const loxo_index *queue, int64_t i, int64_t end)
{
    if (i + 2 * ASK_AHEAD < end) {
        __builtin_prefetch(&s->distance[queue[i + 2 * ASK_AHEAD]]);
        __builtin_prefetch(&s->jet[queue[i + 2 * ASK_AHEAD]]);
    }
    if (i + ASK_AHEAD < end) {
        const loxo_index v = queue[i + ASK_AHEAD], ray = s->jet[v].ray;
        if (ray < 0 || s->distance[v] > s->horizon + FAST_WIDTH * (double)s->jet[v].length) return;
        __builtin_prefetch(&s->m.halfedge_vertex[ray]);
        __builtin_prefetch(&s->m.halfedge_twin[ray]);
        __builtin_prefetch(&s->flags[v], 1);
    }
}

/* Of those in the queue, the ones that are too far before the horizon stay; the ones that have a nearer neighbour leave it until
 * that is final; the others become final. */
static void select_chunk(fast_state *s, int64_t begin, int64_t end)
{
    loxo_index fresh[SELECT_CHUNK], kept[SELECT_CHUNK];
    int64_t n_fresh = 0, n_kept = 0;
    uint64_t least = UINT64_MAX;
    double overhang = 0.0;
    const loxo_index *queue = s->queue[s->side];
    for (int64_t i = begin; i < end; ++i) {
        const loxo_index v = queue[i];
        ask_ahead(s, queue, i, end);
        const double d = s->distance[v];
        if (!(d < HUGE_VAL)) { /* taken back since, and not heard of yet */
            __atomic_fetch_and(&s->flags[v], (uint8_t)~FAST_QUEUED, __ATOMIC_RELAXED);
            continue;
        }
        const bool is_near = d <= s->horizon + FAST_WIDTH * (double)s->jet[v].length;
        const loxo_index nearer = is_near ? find_nearer(s, v, d) : -1;
        if (nearer >= 0) {
            s->awaited[v] = nearer;
            __atomic_store_n(&s->flags[v], (uint8_t)(fast_flags(s, v) & ~(unsigned)FAST_QUEUED), __ATOMIC_RELAXED);
            continue;
        }
        if (bits_of(d) < least) least = bits_of(d);
        if (!is_near) {
            kept[n_kept++] = v;
            continue;
        }
        fresh[n_fresh++] = v;
        if (s->limit < HUGE_VAL && d <= s->limit && s->jet[v].ray >= 0)
            overhang = fmax(overhang, fast_edge_across(&s->m, s->jet[v].ray));
        const unsigned kept_flags = fast_flags(s, v) & (FAST_TAKEN_BACK | FAST_GUESSED);
        __atomic_store_n(&s->flags[v], (uint8_t)(FAST_FINAL | FAST_NEW | kept_flags), __ATOMIC_RELAXED);
    }
    lower(&s->next_horizon, least);
    if (overhang > 0.0) lift(&s->overhang, bits_of(overhang));
    fast_queue(s, kept, n_kept);
    const int64_t to = __atomic_fetch_add(&s->n_fresh, n_fresh, __ATOMIC_RELAXED);
    memcpy(&s->fresh[to], fresh, (size_t)n_fresh * sizeof *fresh);
}

/* What a chunk of arrivals puts into the queue. */
typedef struct fast_batch {
    loxo_index vertex[COMMIT_CHUNK];
    int64_t n;
} fast_batch;

static void lock(fast_state *s, loxo_index v)
{
    while ((__atomic_fetch_or(&s->flags[v], FAST_LOCKED, __ATOMIC_ACQUIRE) & FAST_LOCKED) != 0) {
    }
}

/* A ray arrives at v. Kept is the earliest, of equal ones that of the lowest half-edge. */
static void offer(fast_state *s, fast_batch *batch, loxo_index v, double arrival, const fast_jet *jet,
                  loxo_index source, bool is_guess)
{
    double d;
    __atomic_load(&s->distance[v], &d, __ATOMIC_RELAXED);
    if (!(arrival <= d)) return;
    if (s->n_threads > 1) lock(s, v);
    const unsigned flags = s->n_threads > 1 ? __atomic_load_n(&s->flags[v], __ATOMIC_RELAXED) : s->flags[v];
    unsigned toggled = s->n_threads > 1 ? FAST_LOCKED : 0;
    const fast_jet old = s->jet[v];
    d = s->distance[v];
    const bool is_better = (flags & FAST_FINAL) != 0 ? arrival < d - FAST_GAIN * (double)old.length
                                                     : arrival < d || (arrival == d && jet->ray < old.ray);
    if (is_better) {
        __atomic_store(&s->distance[v], &arrival, __ATOMIC_RELAXED);
        s->jet[v] = *jet;
        if (s->nearest != NULL) s->nearest[v] = source;
        if ((flags & FAST_QUEUED) == 0) {
            const loxo_index h = s->m.vertex_halfedge[v];
            __builtin_prefetch(&s->m.halfedge_vertex[h]);
            __builtin_prefetch(&s->m.halfedge_twin[h]);
            __builtin_prefetch(&s->slope[h], 1);
            batch->vertex[batch->n++] = v;
        }
        toggled |= (flags & FAST_FINAL) | (~flags & FAST_QUEUED);
        toggled |= (flags ^ (is_guess ? FAST_GUESSED : 0)) & FAST_GUESSED;
    }
    /* Another thread may take FAST_NEW away meanwhile: that bit stays out of it. */
    if (s->n_threads > 1)
        __atomic_fetch_xor(&s->flags[v], (uint8_t)toggled, __ATOMIC_RELEASE);
    else
        s->flags[v] ^= (uint8_t)toggled;
}

static void note_doubtful(fast_state *s, const fast_doubtful *doubtful, int64_t n)
{
    if (n == 0) return;
    const int64_t to = __atomic_fetch_add(&s->n_doubtful, n, __ATOMIC_RELAXED);
    memcpy(&s->doubtful[to], doubtful, (size_t)n * sizeof *doubtful);
}

/* What one end of an edge makes of it. */
typedef struct circle {
    double arrival, crossing, way; /* crossing from A, 0 to 1 */
    float sigma;
} circle;

/* The ends of an edge may be lit from different points, about a corner between them; q is then no front, and mostly says too much.
 * The circle that one end knows is taken instead, where the third vertex sees its centre through the edge, and the other end does
 * not refute it by being later than it says. is_a: the circle of A. */
static bool find_circle(const fast_task *t, double slope, bool is_a, circle *out)
{
    const double base = sqrt(t->base_square), sigma = (double)(is_a ? t->sigma_a : t->sigma_b);
    const double d = is_a ? t->d_a : t->d_b, d_other = is_a ? t->d_b : t->d_a, radius = d - sigma;
    const double here_square = is_a ? t->a_square : t->b_square, there_square = is_a ? t->b_square : t->a_square;
    if (!(slope < 1.0) || !(slope > -1.0) || !(radius > 0.0) || !(base > 0.0)) return false;
    const double from = -slope * radius, depth = radius * sqrt(1.0 - slope * slope);
    const double said = sigma + sqrt((base - from) * (base - from) + depth * depth);
    const double x = 0.5 * (base + (here_square - there_square) / base), y_square = here_square - x * x;
    const double y = y_square > 0.0 ? sqrt(y_square) : 0.0, sum = y + depth;
    const double crossing = from + (x - from) * depth / sum;
    if (d_other > said + FAST_REFUTED * base || !(sum > 0.0) || !(crossing > 0.0) || !(crossing < base)) return false;
    const double way = sqrt((x - from) * (x - from) + sum * sum);
    *out = (circle){sigma + way, is_a ? crossing / base : 1.0 - crossing / base, way * y / sum, (float)sigma};
    return true;
}

static double merged_sigma(const fast_task *t)
{
    const double near = t->d_a < t->d_b ? t->d_a : t->d_b;
    const float high = t->sigma_a < t->sigma_b ? t->sigma_b : t->sigma_a;
    const float low = t->sigma_a < t->sigma_b ? t->sigma_a : t->sigma_b;
    return (double)high <= near ? (double)high : (double)low;
}

static void commit_tasks(fast_state *s, int64_t begin, int64_t end)
{
    fast_doubtful doubtful[COMMIT_CHUNK];
    int64_t n_doubtful = 0;
    k_jet_batch b;
    fast_batch batch = {.n = 0};
    const loxo_mesh_view *m = &s->m;
    for (int64_t first = begin; first < end; first += K_JETS) {
        const int64_t n = end - first < K_JETS ? end - first : K_JETS;
        for (int64_t i = 0; i < K_JETS; ++i) {
            const fast_task *t = &s->task[first + (i < n ? i : n - 1)];
            b.base_square[i] = t->base_square;
            b.a_square[i] = t->a_square;
            b.b_square[i] = t->b_square;
            b.d_a[i] = t->d_a;
            b.d_b[i] = t->d_b;
            b.slope_a[i] = (double)s->slope[t->base];
            b.slope_b[i] = (double)s->slope[m->halfedge_twin[t->base]];
            b.sigma[i] = merged_sigma(t);
        }
        s->kernels->jet_arrivals(&b);
        for (int64_t i = 0; i < n; ++i) {
            const fast_task *t = &s->task[first + i];
            const loxo_index ray = k_previous(t->base);
            const bool is_none = isnan(b.arrival[i]);
            bool is_across = b.crossing[i] > 0.0 && b.crossing[i] < 1.0;
            circle c = {b.arrival[i], b.crossing[i], b.way[i], (float)b.sigma[i]};
            double doubt = b.doubt[i];
            if (!is_none && (t->sigma_a < t->sigma_b || t->sigma_a > t->sigma_b)) {
                const double least = is_across ? c.arrival - FAST_MIXED_GAIN * sqrt(t->base_square) : HUGE_VAL;
                circle of_a, of_b;
                const bool has_a = find_circle(t, b.slope_a[i], true, &of_a) && of_a.arrival < least;
                const bool has_b = find_circle(t, b.slope_b[i], false, &of_b) && of_b.arrival < least;
                if (has_a || has_b) {
                    c = !has_a || (has_b && of_b.arrival < of_a.arrival) ? of_b : of_a;
                    is_across = true;
                    doubt += FAST_MIXED_DOUBT * sqrt(t->base_square);
                }
            }
            const double arrival = is_none ? HUGE_VAL : c.arrival;
            if (arrival > t->renewed) doubtful[n_doubtful++] = (fast_doubtful){arrival, t->renewed, ray};
            if (!is_across) continue; /* along an edge, which is told by its end */
            const float share = (float)c.crossing;
            const fast_jet jet = {.ray = ray,
                                  .crossing = fast_crossing(c.crossing),
                                  .sigma = c.sigma,
                                  .length = (float)c.way,
                                  .doubt = (1.0f - share) * t->doubt_a + share * t->doubt_b + (float)doubt};
            offer(s, &batch, m->halfedge_vertex[ray], c.arrival, &jet, share < 0.5f ? t->source_a : t->source_b, false);
        }
    }
    fast_queue(s, batch.vertex, batch.n);
    note_doubtful(s, doubtful, n_doubtful);
}

static void commit_steps(fast_state *s, int64_t begin, int64_t end)
{
    fast_doubtful doubtful[COMMIT_CHUNK];
    int64_t n_doubtful = 0;
    fast_batch batch = {.n = 0};
    for (int64_t i = begin; i < end; ++i) {
        const fast_step *step = &s->step[i];
        const fast_jet jet = {step->ray, step->crossing, step->sigma, step->length, step->doubt};
        if (step->arrival > step->renewed)
            doubtful[n_doubtful++] = (fast_doubtful){step->arrival, step->renewed, step->ray};
        offer(s, &batch, step->target, step->arrival, &jet, step->source, step->is_guess);
    }
    fast_queue(s, batch.vertex, batch.n);
    note_doubtful(s, doubtful, n_doubtful);
}

static int64_t n_chunks(int64_t n, int64_t chunk) { return (n + chunk - 1) / chunk; }

static int64_t least(int64_t a, int64_t b) { return a < b ? a : b; }

static void commit_chunk(fast_state *s, int64_t chunk)
{
    const int64_t of_tasks = n_chunks(s->n_tasks, COMMIT_CHUNK), of_steps = n_chunks(s->n_steps, COMMIT_CHUNK);
    if (chunk < of_tasks) {
        commit_tasks(s, chunk * COMMIT_CHUNK, least((chunk + 1) * COMMIT_CHUNK, s->n_tasks));
        return;
    }
    chunk -= of_tasks;
    if (chunk < of_steps) {
        commit_steps(s, chunk * COMMIT_CHUNK, least((chunk + 1) * COMMIT_CHUNK, s->n_steps));
        return;
    }
    chunk -= of_steps;
    for (int64_t i = chunk * SELECT_CHUNK; i < least((chunk + 1) * SELECT_CHUNK, s->n_fresh); ++i)
        __atomic_fetch_and(&s->flags[s->fresh[i]], (uint8_t)~FAST_NEW, __ATOMIC_RELAXED);
}

static void expand_chunk(fast_state *s, int64_t chunk)
{
    const int64_t of_fresh = n_chunks(s->n_fresh, FAST_EXPAND_CHUNK);
    if (chunk < of_fresh) {
        fast_expand(s, chunk * FAST_EXPAND_CHUNK, least((chunk + 1) * FAST_EXPAND_CHUNK, s->n_fresh));
        return;
    }
    chunk -= of_fresh;
    fast_ask_again(s, chunk * FAST_EXPAND_CHUNK, least((chunk + 1) * FAST_EXPAND_CHUNK, s->n_taken_back));
}

static void work(void *arg, int64_t chunk)
{
    fast_state *s = arg;
    if (s->stage == FAST_SELECT)
        select_chunk(s, chunk * SELECT_CHUNK, least((chunk + 1) * SELECT_CHUNK, s->n_queue));
    else if (s->stage == FAST_EXPAND)
        expand_chunk(s, chunk);
    else
        commit_chunk(s, chunk);
}

static bool fits(const fast_state *s)
{
    return s->bench_wanted <= s->bench_capacity && s->n_tasks <= s->task_capacity && s->n_steps <= s->step_capacity;
}

static int64_t begin_expand(fast_state *s)
{
    s->stage = FAST_EXPAND;
    s->n_tasks = s->n_steps = 0;
    return n_chunks(s->n_fresh, FAST_EXPAND_CHUNK) + n_chunks(s->n_taken_back, FAST_EXPAND_CHUNK);
}

/* After a round: the vertices that have heard of nothing but their own ray, and later, know nothing for the moment, and will ask
 * all their edges. Whether any is within the limit. */
static bool take_back(fast_state *s)
{
    bool any_within = false;
    s->n_taken_back = 0;
    for (int64_t i = 0; i < s->n_doubtful; ++i) {
        const fast_doubtful *now = &s->doubtful[i];
        const loxo_index v = s->m.halfedge_vertex[now->ray];
        const double rise = (s->flags[v] & FAST_GUESSED) != 0 ? FAST_RISE_OF_A_GUESS : FAST_RISE;
        if (s->jet[v].ray != now->ray || s->distance[v] < now->before || s->distance[v] > now->before ||
            !(now->arrival > now->before + rise * (double)s->jet[v].length))
            continue;
        if (s->n_times[v] == FAST_TAKEN_BACK_MOST) {
            /* it stays, and is known to be off by that; where nothing arrives any more, by a part of the edge */
            const double most = fast_edge_across(&s->m, now->ray), off = now->arrival - now->before;
            s->jet[v].doubt = fmaxf(s->jet[v].doubt, (float)(off < most ? off : most));
            continue;
        }
        any_within = any_within || now->before <= s->limit;
        s->distance[v] = HUGE_VAL;
        s->flags[v] = (uint8_t)((s->flags[v] & ~FAST_FINAL) | FAST_TAKEN_BACK);
        ++s->n_times[v];
        s->taken_back[s->n_taken_back++] = v;
    }
    s->n_doubtful = 0;
    return any_within;
}

/* Whether what is left of the front is so far beyond the limit that nothing within hears of it. A ray within may come through an
 * edge whose other end is beyond, and be told again once that is final: it is nearer than limit + that edge. A vertex that was
 * taken back asks in one round, and what it heard is looked at in the next. */
static bool is_beyond(fast_state *s, bool any_taken_back)
{
    const bool was_renewing = s->is_renewing;
    double overhang;
    memcpy(&overhang, &s->overhang, sizeof overhang);
    s->is_renewing = any_taken_back;
    return !was_renewing && !any_taken_back && s->horizon > s->limit + overhang;
}

static int64_t advance(void *arg)
{
    fast_state *s = arg;
    if (!s->is_begun) { /* the first call of all, or an expansion that is done again with more room */
        s->is_begun = true;
        if (s->stage == FAST_EXPAND) return begin_expand(s);
    } else if (s->stage == FAST_SELECT) {
        return begin_expand(s);
    } else if (s->stage == FAST_EXPAND) {
        if (!fits(s)) return -1;
        s->stage = FAST_COMMIT;
        __atomic_store_n(&s->n_final, s->n_final + s->n_fresh, __ATOMIC_RELAXED);
        s->n_updates += s->n_tasks;
        return n_chunks(s->n_tasks, COMMIT_CHUNK) + n_chunks(s->n_steps, COMMIT_CHUNK) +
               n_chunks(s->n_fresh, SELECT_CHUNK);
    }
    const bool any_taken_back = take_back(s);
    s->side = 1 - s->side;
    s->n_queue = s->n_next;
    s->n_next = s->n_fresh = 0;
    if (s->next_horizon != UINT64_MAX) memcpy(&s->horizon, &s->next_horizon, sizeof s->horizon);
    s->next_horizon = UINT64_MAX;
    s->stage = FAST_SELECT;
    if (is_beyond(s, any_taken_back) || (s->n_taken_back == 0 && s->n_queue == 0)) {
        s->is_over = true;
        return -1;
    }
    ++s->n_rounds;
    return n_chunks(s->n_queue, SELECT_CHUNK);
}

static bool poll(void *arg)
{
    const fast_state *s = arg;
    const double done = (double)__atomic_load_n(&s->n_final, __ATOMIC_RELAXED) / (double)s->m.n_vertices;
    return loxo_stop_wanted(s->ctx, "propagate", fmin(1.0, done));
}

/* At least wanted, and half as many again as there were. */
static loxo_status grow(fast_state *s, void **list, int64_t *capacity, int64_t wanted, size_t size)
{
    if (wanted <= *capacity) return LOXO_OK;
    const int64_t more = *capacity + *capacity / 2, n = wanted > more ? wanted : more;
    loxo_release(s->ctx, *list);
    *capacity = 0;
    if ((*list = loxo_allocate(s->ctx, n, size)) == NULL) return LOXO_ERR_MEMORY;
    *capacity = n;
    return LOXO_OK;
}

static loxo_status make_room(fast_state *s)
{
    const int64_t had = s->task_capacity + s->step_capacity;
    void *task = s->task, *step = s->step;
    loxo_status status = grow(s, &task, &s->task_capacity, s->n_tasks, sizeof *s->task);
    s->task = task;
    if (status >= 0) status = grow(s, &step, &s->step_capacity, s->n_steps, sizeof *s->step);
    s->step = step;
    const int64_t both = s->task_capacity + s->step_capacity;
    if (status >= 0 && both > had) {
        /* of both lists only this one is not empty between an expansion and the next */
        loxo_index *taken_back = loxo_reallocate(s->ctx, s->taken_back, both, sizeof *taken_back);
        if (taken_back != NULL) s->taken_back = taken_back;
        loxo_release(s->ctx, s->doubtful);
        s->doubtful = loxo_allocate(s->ctx, both, sizeof *s->doubtful);
        if (taken_back == NULL || s->doubtful == NULL) {
            s->task_capacity = 0; /* there is no room for one without the others */
            status = LOXO_ERR_MEMORY;
        }
    }
    if (status >= 0 && s->bench_wanted > s->bench_capacity) status = fast_reserve_benches(s, s->bench_wanted);
    return status;
}

int64_t fast_lists_at_first(const loxo_mesh_view *m) { return least(LISTS_AT_FIRST, 3 * m->n_faces); }

loxo_status fast_make_ready(fast_state *s)
{
    s->n_tasks = s->n_steps = fast_lists_at_first(&s->m);
    s->bench_wanted = FAST_SPOKES_AT_FIRST;
    return make_room(s);
}

void fast_seed(fast_state *s, loxo_index v, double distance, const fast_jet *jet, loxo_index source)
{
    fast_batch batch = {.n = 0};
    offer(s, &batch, v, distance, jet, source, false);
    fast_queue(s, batch.vertex, batch.n);
}

loxo_status fast_run(fast_state *s, double limit)
{
    const loxo_phases phases = {advance, work, poll, s};
    s->limit = limit;
    s->is_over = false;
    s->stage = FAST_SELECT;
    const loxo_status ready = fast_make_ready(s);
    if (ready < 0) return ready;
    for (;;) {
        s->is_begun = false;
        if (loxo_phases_run(&phases, s->n_threads)) return LOXO_STOPPED;
        if (s->is_over) return LOXO_OK;
        const loxo_status status = make_room(s);
        if (status < 0) return status;
    }
}
