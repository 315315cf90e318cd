/* SPDX-License-Identifier: MIT
 * A vertex has become final: the slopes of the distance along its edges, and what its neighbours hear of it. */
#include "base/allocate.h"
#include "kernel/vec3.h"
#include "par/range.h"
#include "solver/geodesic/fast/fast_internal.h"

#include <string.h>

/* In place of the half-edge along the last spoke of a fan: it is the first one again, or a boundary edge that has no
 * half-edge starting here. */
#define FAN_CLOSED (-2)
#define FAN_OPEN   (-1)

static double square(loxo_vec3 a, loxo_vec3 b)
{
    const loxo_vec3 e = v3_sub(b, a);
    return v3_dot(e, e);
}

static double length_square(const loxo_mesh_view *m, loxo_index h)
{
    return m->halfedge_length[h] * m->halfedge_length[h];
}

/* Lays the fan of v from spoke k on; returns the first spoke after it, or -1 when it does not fit. */
static int64_t lay_fan(const loxo_mesh_view *m, fast_bench *b, loxo_index v, int64_t k)
{
    const loxo_vec3 nowhere = {0.0, 0.0, 0.0};
    const bool has_lengths = m->halfedge_length != NULL;
    const loxo_index first = m->vertex_halfedge[v];
    const int64_t begin = k;
    loxo_index h = first, y = k_head(m, h);
    const loxo_vec3 at_v = has_lengths ? nowhere : k_position(m, v);
    loxo_vec3 at_y = has_lengths ? nowhere : k_position(m, y);
    double spoke = has_lengths ? length_square(m, h) : square(at_v, at_y);
    for (;;) {
        const loxo_index across = k_next(h), back = k_previous(h), z = m->halfedge_vertex[back];
        const loxo_vec3 at_z = has_lengths ? nowhere : k_position(m, z);
        if (k + 2 > b->capacity) return -1;
        b->halfedge[k] = h;
        b->neighbour[k] = y;
        b->spoke[k] = spoke;
        b->rim[k] = has_lengths ? length_square(m, across) : square(at_y, at_z);
        ++k;
        spoke = has_lengths ? length_square(m, back) : square(at_z, at_v);
        y = z;
        at_y = at_z;
        h = m->halfedge_twin[back];
        if (h < 0 || h == first) break;
    }
    b->halfedge[k] = h < 0 ? FAN_OPEN : FAN_CLOSED;
    b->neighbour[k] = y;
    b->spoke[k] = h < 0 ? spoke : b->spoke[begin];
    b->rim[k] = 0.0; /* a corner between this fan and the next, which nothing looks at */
    return k + 1;
}

double fast_edge_across(const loxo_mesh_view *m, loxo_index ray)
{
    const loxo_index h = k_next(ray);
    if (m->halfedge_length != NULL) return m->halfedge_length[h];
    return v3_norm(v3_sub(k_position(m, k_head(m, h)), k_position(m, m->halfedge_vertex[h])));
}

static int64_t count_spokes(const loxo_mesh_view *m, loxo_index v)
{
    const loxo_index first = m->vertex_halfedge[v];
    int64_t n = 1;
    for (loxo_index h = first;; ++n)
        if ((h = m->halfedge_twin[k_previous(h)]) < 0 || h == first) return n + 1;
}

/* Of a spoke that no ray straight on or beside it reaches: the distance along it is counted from the vertex itself. */
#define SLOPE_FROM_HERE 2.0f
/* A turn by so much more than a straight angle, as its sine, is none. */
#define STRAIGHT 1e-9

/* Slopes along the spokes begin..end of a fan, end the last. The distance grows along a spoke by -cos of the angle between it
 * and the ray, on whichever side of the vertex that is less than a straight angle, and less. */
static void find_slopes(fast_bench *b, const fast_jet *jet, int64_t begin, int64_t end)
{
    const bool is_closed = b->halfedge[end] == FAN_CLOSED;
    const int64_t n = end - begin;
    for (int64_t i = begin; i <= end; ++i)
        b->slope[i] = SLOPE_FROM_HERE;
    if (jet->ray < 0) return;
    int64_t corner = begin;
    while (b->halfedge[corner] != jet->ray)
        ++corner;

    /* the ray in its corner, spoke `corner` along the first axis */
    const double t = (double)jet->crossing, a = b->spoke[corner], c = b->spoke[corner + 1];
    const double c_x = c * b->cosine[corner], c_y = c * b->sine[corner];
    const double x = t < 0.0 ? c_x + t * (c_x - a) : a + t * (c_x - a), y = t < 0.0 ? c_y + t * c_y : t * c_y;
    const double square = x * x + y * y, inverse = square > 0.0 ? 1.0 / sqrt(square) : 0.0;
    const double u = square > 0.0 ? x * inverse : 1.0, w = y * inverse;

    /* counter-clockwise: the angle from the ray to the spoke as a point of the unit circle, turned corner by corner */
    double re = b->cosine[corner] * u + b->sine[corner] * w, im = b->sine[corner] * u - b->cosine[corner] * w;
    int64_t i = corner + 1;
    for (int64_t k = 0; k < n && (im >= -STRAIGHT || k == 0); ++k) {
        if (i == end && is_closed) i = begin;
        b->slope[i] = (float)-re;
        if (i == end) break;
        const double next = re * b->cosine[i] - im * b->sine[i];
        im = re * b->sine[i] + im * b->cosine[i];
        re = next;
        ++i;
    }
    /* clockwise */
    re = u;
    im = w;
    i = corner;
    for (int64_t k = 0; k < n && (im >= -STRAIGHT || k == 0); ++k) {
        if ((float)-re < b->slope[i]) b->slope[i] = (float)-re;
        if (i == begin) {
            if (!is_closed) break;
            i = end;
        }
        --i;
        const double next = re * b->cosine[i] - im * b->sine[i];
        im = re * b->sine[i] + im * b->cosine[i];
        re = next;
    }
    if (is_closed) b->slope[end] = b->slope[begin];
}

static loxo_index source_of(const fast_state *s, loxo_index v) { return s->nearest != NULL ? s->nearest[v] : -1; }

/* Whether others may have their distances from a vertex: it is final, or was. */
static bool may_be_leant_on(unsigned flags) { return (flags & (FAST_FINAL | FAST_TAKEN_BACK)) != 0; }

/* Whether the ray of a came past target, so that what a knows it has from there. Straight lines from one point do not cross each
 * other's edges like that: a and target would hold each other up, however wrong they are. */
static bool leans_on(const fast_state *s, loxo_index a, loxo_index target)
{
    const loxo_index ray = s->jet[a].ray;
    if (ray < 0) return false;
    const double t = (double)s->jet[a].crossing; /* at an end: that one alone */
    const loxo_index h = k_next(ray);
    return (s->m.halfedge_vertex[h] == target && !(t < 0.0 && t > -1e-20)) ||
           (k_head(&s->m, h) == target && (t > 0.0 || t < 0.0));
}

/* The edge of half-edge base, from a to b, both final, as seen from the third vertex. A vertex that is final already may
 * still hear something new, but hardly over a vertex that is farther than itself, unless its corner is obtuse. */
static void emit_task(const fast_state *s, fast_bench *bench, int64_t *n_tasks, loxo_index base, loxo_index a,
                      loxo_index b, loxo_index target, double base_square, double a_square, double b_square)
{
    const double d_a = s->distance[a], d_b = s->distance[b], near = d_a < d_b ? d_a : d_b, far = d_a < d_b ? d_b : d_a;
    if (s->m.halfedge_twin[base] < 0) return; /* no ray comes from beyond a boundary */
    const bool is_obtuse = a_square + b_square < base_square;
    const double d = s->distance[target];
    /* a source inside the face is not behind its edge */
    const bool is_renewal =
        s->jet[target].ray == k_previous(base) && d < HUGE_VAL && (double)s->jet[target].length * (1.0 + 1e-6) < d;
    const unsigned flags = fast_flags(s, target);
    if (!is_renewal && (flags & FAST_FINAL) != 0 && d <= (is_obtuse ? near : far)) return;
    const bool is_round = may_be_leant_on(flags) && (leans_on(s, a, target) || leans_on(s, b, target));
    if (is_round && !is_renewal) return;
    bench->task[(*n_tasks)++] = (fast_task){.base_square = base_square,
                                            .a_square = a_square,
                                            .b_square = b_square,
                                            .d_a = is_round ? (double)NAN : d_a, /* nothing arrives */
                                            .d_b = d_b,
                                            .sigma_a = s->jet[a].sigma,
                                            .sigma_b = s->jet[b].sigma,
                                            .doubt_a = s->jet[a].doubt,
                                            .doubt_b = s->jet[b].doubt,
                                            .base = base,
                                            .source_a = source_of(s, a),
                                            .source_b = source_of(s, b),
                                            .renewed = is_renewal ? d : HUGE_VAL};
}

/* One end of an edge speaks for it where the edge across is longer than a quarter of the way to the point that the distance is
 * counted from. Part of the answer. */
#define LONG_EDGE 16.0

/* The edge from v to its neighbour across which `target` lies is final at v only. Its other end may become final long after
 * target, which hears of its ray through this edge from v alone: the front is taken for the circle that v knows, at the
 * distance from sigma and in the direction that its slope gives. When the other end is final, the edge is told as others are;
 * if that is later by more than FAST_RISE, target is taken back. Corner i; is_first: the edge is spoke i, and target at spoke
 * i + 1; else the other way. */
static void emit_one_end(const fast_state *s, fast_bench *b, loxo_index v, int64_t i, bool is_first, int64_t *n_steps)
{
    const int64_t edge = is_first ? i : i + 1, other = is_first ? i + 1 : i;
    const loxo_index h = b->halfedge[i], half_of_edge = is_first ? h : k_previous(h), target = b->neighbour[other];
    const double sigma = (double)s->jet[v].sigma, radius = s->distance[v] - sigma;
    if (LONG_EDGE * b->rim[i] < radius * radius || s->m.halfedge_twin[half_of_edge] < 0) return;
    const double slope = b->slope[edge] < 1.0f ? (double)b->slope[edge] : 1.0, base = b->spoke[edge];
    const double x = b->spoke[other] * b->cosine[i], y = b->spoke[other] * b->sine[i];
    const double from = -slope * radius, depth = radius * sqrt(1.0 - slope * slope), sum = y + depth;
    const double way = sqrt((x - from) * (x - from) + sum * sum), crossing = from + (x - from) * depth / sum;
    if (!(sigma + way < s->distance[target]) || !(crossing > 0.0) || !(crossing < base)) return;
    if (may_be_leant_on(fast_flags(s, target)) && leans_on(s, v, target)) return;
    const double share = crossing / base; /* from v; the ray's corner at target counts from the end of its half-edge */
    b->step[(*n_steps)++] = (fast_step){.arrival = sigma + way,
                                        .renewed = HUGE_VAL,
                                        .sigma = (float)sigma,
                                        .length = (float)(way * y / sum),
                                        .crossing = fast_crossing(is_first ? share : 1.0 - share),
                                        .doubt = s->jet[v].doubt,
                                        .target = target,
                                        .ray = is_first ? k_previous(h) : k_next(h),
                                        .source = source_of(s, v),
                                        .is_guess = true};
}

/* What y at the end of spoke i hears along it. Its half-edge h is -1 at the end of an open fan: there is one that starts at y. If
 * y has its ray from here and v was taken back in between, it hears that again, too. */
static void emit_along(const fast_state *s, fast_bench *b, loxo_index v, loxo_index y, loxo_index h, int64_t i,
                       int64_t *n_steps)
{
    const loxo_index twin = h >= 0 ? s->m.halfedge_twin[h] : -1;
    const loxo_index ray = h < 0 ? k_previous(b->halfedge[i - 1]) : twin >= 0 ? twin : k_next(h);
    const float crossing = h < 0 || twin >= 0 ? 0.0f : fast_crossing(1.0);
    const double arrival = s->distance[v] + b->spoke[i], before = s->distance[y];
    double renewed = HUGE_VAL;
    if (arrival > before) {
        const fast_jet *jet = &s->jet[y];
        if ((fast_flags(s, v) & FAST_TAKEN_BACK) == 0 || jet->ray != ray || jet->crossing < crossing ||
            jet->crossing > crossing)
            return;
        renewed = before;
    } else if (may_be_leant_on(fast_flags(s, y)) && leans_on(s, v, y)) {
        return;
    }
    b->step[(*n_steps)++] =
        (fast_step){.arrival = arrival,
                    .renewed = renewed,
                    .sigma = b->slope[i] == SLOPE_FROM_HERE ? (float)s->distance[v] : s->jet[v].sigma,
                    .length = (float)b->spoke[i],
                    .doubt = s->jet[v].doubt,
                    .target = y,
                    .ray = ray,
                    .crossing = crossing,
                    .source = source_of(s, v)};
}

/* What the neighbours of v hear: along the spokes, and through the edges of its faces whose other end is final too. An
 * edge between two vertices that became final together is told by the one where its half-edge in that face starts. */
static void emit(const fast_state *s, fast_bench *b, loxo_index v, int64_t begin, int64_t end, int64_t *n_tasks,
                 int64_t *n_steps)
{
    for (int64_t i = begin; i < end + (b->halfedge[end] == FAN_OPEN); ++i) {
        const loxo_index y = b->neighbour[i], h = i < end ? b->halfedge[i] : -1;
        emit_along(s, b, v, y, h, i, n_steps);
        if (i == end) return;
        const loxo_index z = b->neighbour[i + 1], back = k_previous(h);
        const double y_square = b->spoke[i] * b->spoke[i], z_square = b->spoke[i + 1] * b->spoke[i + 1];
        const bool y_is_final = (fast_flags(s, y) & FAST_FINAL) != 0, z_is_final = (fast_flags(s, z) & FAST_FINAL) != 0;
        if (y_is_final) emit_task(s, b, n_tasks, h, v, y, z, y_square, z_square, b->rim[i]);
        if ((fast_flags(s, z) & (FAST_FINAL | FAST_NEW)) == FAST_FINAL)
            emit_task(s, b, n_tasks, back, z, v, y, z_square, b->rim[i], y_square);
        if (y_is_final || z_is_final) continue;
        emit_one_end(s, b, v, i, true, n_steps);
        emit_one_end(s, b, v, i, false, n_steps);
    }
}

/* Neighbours that waited for v are to be looked at again. */
static int64_t wake(fast_state *s, fast_bench *b, loxo_index v, int64_t begin, int64_t end, int64_t n)
{
    for (int64_t i = begin; i < end + (b->halfedge[end] == FAN_OPEN); ++i) {
        const loxo_index y = b->neighbour[i];
        if (s->awaited[y] != v || (fast_flags(s, y) & (FAST_FINAL | FAST_QUEUED)) != 0) continue;
        if (s->n_threads > 1) {
            if ((__atomic_fetch_or(&s->flags[y], FAST_QUEUED, __ATOMIC_RELAXED) & FAST_QUEUED) != 0) continue;
        } else {
            s->flags[y] |= FAST_QUEUED;
        }
        b->woken[n++] = y;
    }
    return n;
}

/* Room for n more in a list of the round, as far as it fits; the number of all is counted in any case. */
static int64_t reserve(int64_t *count, int64_t n, int64_t capacity)
{
    const int64_t begin = __atomic_fetch_add(count, n, __ATOMIC_RELAXED);
    return begin + n <= capacity ? begin : -1;
}

/* Asks for what the fans of the vertices fresh[begin..end-1] will look up: the front meets most of its vertices and faces for the
 * first time. All fans take a step at a time, so that what the next step needs of one comes while the others take theirs. */
static void ask_for_fans(const fast_state *s, int64_t begin, int64_t end)
{
    const loxo_mesh_view *m = &s->m;
    loxo_index now[FAST_EXPAND_CHUNK], first[FAST_EXPAND_CHUNK];
    int64_t n = end - begin;
    for (int64_t i = 0; i < n; ++i)
        now[i] = first[i] = m->vertex_halfedge[s->fresh[begin + i]];
    while (n > 0) {
        int64_t n_left = 0;
        for (int64_t i = 0; i < n; ++i) {
            const loxo_index back = k_previous(now[i]), z = m->halfedge_vertex[back], h = m->halfedge_twin[back];
            __builtin_prefetch(&s->distance[z]);
            __builtin_prefetch(&s->jet[z]);
            __builtin_prefetch(&s->flags[z]);
            __builtin_prefetch(&s->awaited[z]);
            __builtin_prefetch(&m->vertex_halfedge[z]);
            if (m->position != NULL)
                __builtin_prefetch(&m->position[z]);
            else
                __builtin_prefetch(&m->position_float[z]);
            if (h < 0 || h == first[i]) continue;
            __builtin_prefetch(&m->halfedge_vertex[k_previous(h)]);
            __builtin_prefetch(&m->halfedge_twin[k_previous(h)]);
            now[n_left] = h;
            first[n_left++] = first[i];
        }
        n = n_left;
    }
}

/* Lays the fans of some vertices one after the other; their spokes, or 0 when they do not fit: that is then noted. */
static int64_t lay_fans(fast_state *s, fast_bench *b, const loxo_index *vertex, int64_t n)
{
    int64_t k = 0;
    for (int64_t i = 0; i < n; ++i) {
        if ((k = lay_fan(&s->m, b, vertex[i], k)) >= 0) continue;
        for (k = i = 0; i < n; ++i)
            k += count_spokes(&s->m, vertex[i]);
        int64_t wanted = __atomic_load_n(&s->bench_wanted, __ATOMIC_RELAXED);
        while (k > wanted &&
               !__atomic_compare_exchange_n(&s->bench_wanted, &wanted, k, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
        }
        return 0;
    }
    return k;
}

static void hand_over(fast_state *s, const fast_bench *b, int64_t n_tasks, int64_t n_steps)
{
    const int64_t task = reserve(&s->n_tasks, n_tasks, s->task_capacity);
    if (task >= 0) memcpy(&s->task[task], b->task, (size_t)n_tasks * sizeof *b->task);
    const int64_t step = reserve(&s->n_steps, n_steps, s->step_capacity);
    if (step >= 0) memcpy(&s->step[step], b->step, (size_t)n_steps * sizeof *b->step);
}

static fast_bench *my_bench(const fast_state *s) { return &s->bench[s->n_threads > 1 ? loxo_thread_id() : 0]; }

void fast_expand(fast_state *s, int64_t begin, int64_t end)
{
    fast_bench *b = my_bench(s);
    int64_t n_tasks = 0, n_steps = 0, n_woken = 0;
    ask_for_fans(s, begin, end);
    const int64_t n = lay_fans(s, b, s->fresh + begin, end - begin);
    if (n == 0) return;
    s->kernels->ring_corners(n - 1, b->spoke, b->rim, b->cosine, b->sine);
    for (int64_t i = begin, first = 0, last; i < end; ++i, first = last + 1) {
        const loxo_index v = s->fresh[i];
        for (last = first; b->halfedge[last] >= 0;)
            ++last;
        find_slopes(b, &s->jet[v], first, last);
        for (int64_t j = first; j < last; ++j)
            s->slope[b->halfedge[j]] = b->slope[j] < 1.0f ? b->slope[j] : 1.0f;
        emit(s, b, v, first, last, &n_tasks, &n_steps);
        n_woken = wake(s, b, v, first, last, n_woken);
    }
    fast_queue(s, b->woken, n_woken);
    hand_over(s, b, n_tasks, n_steps);
}

/* What v hears along the spokes from neighbours that are final, and through edges across whose ends both are. Spokes hold
 * squares here. */
static void collect(const fast_state *s, fast_bench *b, loxo_index v, int64_t begin, int64_t end, int64_t *n_tasks,
                    int64_t *n_steps)
{
    for (int64_t i = begin; i < end + (b->halfedge[end] == FAN_OPEN); ++i) {
        const loxo_index y = b->neighbour[i], h = i < end ? b->halfedge[i] : b->halfedge[end - 1];
        if ((fast_flags(s, y) & FAST_FINAL) == 0) continue;
        const bool z_is_final = i < end && (fast_flags(s, b->neighbour[i + 1]) & FAST_FINAL) != 0;
        if (z_is_final)
            emit_task(s, b, n_tasks, k_next(h), y, b->neighbour[i + 1], v, b->rim[i], b->spoke[i], b->spoke[i + 1]);
        if (leans_on(s, y, v)) continue;
        if ((fast_flags(s, y) & FAST_NEW) != 0) continue; /* it tells of the way itself: its slopes are being written */
        /* from y to v; a boundary edge may have no half-edge that starts there, nor then a slope */
        const loxo_index to_here = i < end ? s->m.halfedge_twin[h] : k_previous(h);
        const float d = (float)s->distance[y];
        b->step[(*n_steps)++] = (fast_step){.arrival = s->distance[y] + sqrt(b->spoke[i]),
                                            .renewed = HUGE_VAL,
                                            .sigma = to_here >= 0 && s->slope[to_here] < 1.0f ? s->jet[y].sigma : d,
                                            .length = (float)sqrt(b->spoke[i]),
                                            .crossing = i < end ? 0.0f : fast_crossing(1.0),
                                            .doubt = s->jet[y].doubt,
                                            .target = v,
                                            .ray = h,
                                            .source = source_of(s, y)};
    }
}

void fast_ask_again(fast_state *s, int64_t begin, int64_t end)
{
    fast_bench *b = my_bench(s);
    int64_t n_tasks = 0, n_steps = 0, n_woken = 0;
    if (lay_fans(s, b, s->taken_back + begin, end - begin) == 0) return;
    for (int64_t i = begin, first = 0, last; i < end; ++i, first = last + 1) {
        for (last = first; b->halfedge[last] >= 0;)
            ++last;
        collect(s, b, s->taken_back[i], first, last, &n_tasks, &n_steps);
        /* who waited for what was nearer may now be nearer itself: two that wait for each other wait forever */
        n_woken = wake(s, b, s->taken_back[i], first, last, n_woken);
    }
    fast_queue(s, b->woken, n_woken);
    hand_over(s, b, n_tasks, n_steps);
}

static void lay_out_bench(fast_bench *b, loxo_arena *a, int64_t n_spokes)
{
    b->capacity = n_spokes;
    b->halfedge = loxo_arena_take(a, n_spokes, sizeof *b->halfedge);
    b->neighbour = loxo_arena_take(a, n_spokes, sizeof *b->neighbour);
    b->spoke = loxo_arena_take(a, n_spokes, sizeof *b->spoke);
    b->rim = loxo_arena_take(a, n_spokes, sizeof *b->rim);
    b->cosine = loxo_arena_take(a, n_spokes, sizeof *b->cosine);
    b->sine = loxo_arena_take(a, n_spokes, sizeof *b->sine);
    b->slope = loxo_arena_take(a, n_spokes, sizeof *b->slope);
    b->woken = loxo_arena_take(a, n_spokes, sizeof *b->woken);
    b->task = loxo_arena_take(a, FAST_TASKS_A_SPOKE * n_spokes, sizeof *b->task);
    b->step = loxo_arena_take(a, FAST_STEPS_A_SPOKE * n_spokes, sizeof *b->step);
}

size_t fast_bench_bytes(int64_t n_spokes)
{
    fast_bench b;
    loxo_arena a = {0};
    lay_out_bench(&b, &a, n_spokes);
    return a.size;
}

loxo_status fast_reserve_benches(fast_state *s, int64_t n_spokes)
{
    loxo_arena_destroy(s->ctx, &s->bench_arena);
    s->bench_arena = (loxo_arena){0};
    s->bench_capacity = 0;
    for (int t = 0; t < s->n_benches; ++t)
        lay_out_bench(&s->bench[t], &s->bench_arena, n_spokes);
    const loxo_status status = loxo_arena_reserve(s->ctx, &s->bench_arena, "geodesic: the fans of vertices");
    if (status < 0) return status;
    for (int t = 0; t < s->n_benches; ++t)
        lay_out_bench(&s->bench[t], &s->bench_arena, n_spokes);
    s->bench_capacity = n_spokes;
    return LOXO_OK;
}
