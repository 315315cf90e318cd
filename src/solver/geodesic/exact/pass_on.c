/* SPDX-License-Identifier: MIT
 * One list of windows across one face: cut against what is known, then on to the two other sides. */
#include "base/allocate.h"
#include "solver/geodesic/exact/exact_internal.h"

/* A side of the face on which windows arrive. */
typedef struct side {
    loxo_index target; /* half-edge beyond, -1 at a boundary; it runs so that the face lies on its right */
    double length;
    double start_bound, end_bound;                 /* of the distances of its ends */
    double opposite_x, opposite_y, opposite_bound; /* the face's third corner, in the target's frame */
    bool opposite_is_ahead;                        /* all windows passed it at their larger x */
    double key;
    exact_chain chain;
} side;

static double least(double a, double b) { return a < b ? a : b; }
static double most(double a, double b) { return a > b ? a : b; }

/* Windows of the list of h that came in earlier rounds. Those of this one may still be more: they are in front, and wait
 * for the next. */
static int64_t count_older(const exact_state *s, loxo_index h)
{
    int64_t n = 0;
    uint32_t id = __atomic_load_n(&s->list[h], __ATOMIC_ACQUIRE);
    while (id != EXACT_NONE) {
        const exact_block *block = exact_pool_block(&s->pool, id);
        if (block->round != s->round) n += block->n;
        id = block->next;
    }
    return n;
}

/* Moves n older windows of the list of h to the work arrays, without what the distances of the edge's ends make needless;
 * returns how many that are. */
static int64_t take_list(exact_state *s, exact_worker *worker, loxo_index h, double length, double start_bound,
                         double end_bound, int64_t n_listed)
{
    exact_pool *pool = &s->pool;
    exact_taken *taken = worker->work.taken;
    exact_chain newer = EXACT_NO_CHAIN;
    int64_t at = n_listed, n = 0;
    uint32_t id = s->n_threads > 1 ? __atomic_exchange_n(&s->list[h], EXACT_NONE, __ATOMIC_ACQ_REL) : s->list[h];
    if (s->n_threads == 1) s->list[h] = EXACT_NONE;
    while (id != EXACT_NONE && exact_pool_block(pool, id)->round == s->round) {
        if (newer.head == EXACT_NONE) newer.head = id;
        newer.tail = id;
        id = exact_pool_block(pool, id)->next;
    }
    if (newer.head != EXACT_NONE) exact_hang(s, worker, &newer, h, HUGE_VAL); /* the key was told when they came */
    while (id != EXACT_NONE) {
        exact_block *block = exact_pool_block(pool, id);
        const uint32_t older = block->next;
        at -= block->n;
        for (uint32_t i = 0; i < block->n; ++i) {
            taken[at + i].w = block->w[i];
            taken[at + i].origin = block->origin[i];
        }
        exact_free_block(s, worker, id);
        id = older;
    }
    worker->n_more -= n_listed;
    for (int64_t i = 0; i < n_listed; ++i) {
        k_window w = taken[i].w;
        k_window_cut_start(&w, start_bound);
        k_window_cut_end(&w, length, end_bound);
        if (!(w.begin < w.end)) continue;
        taken[n].w = w;
        taken[n].origin = taken[i].origin;
        n += 1;
    }
    return n;
}

/* A window that has come to a side, in the target's frame. */
static void arrive(exact_state *s, exact_worker *worker, side *to, k_window *w, exact_origin origin)
{
    double at;
    k_window_cut_start(w, to->start_bound);
    k_window_cut_end(w, to->length, to->end_bound);
    if (!(w->begin < w->end)) return;
    at = to->opposite_is_ahead ? w->begin : w->end;
    const double dx = at - to->opposite_x, dy = to->opposite_y;
    if (to->opposite_bound + sqrt(dx * dx + dy * dy) < k_window_way(w, at, 0.0)) return;
    if (s->max_distance < HUGE_VAL && k_window_least_way(w) > s->max_distance) return;
    exact_put(s, worker, &to->chain, w, origin);
}

bool exact_pass_on(exact_state *s, exact_worker *worker, loxo_index h)
{
    const loxo_mesh_view *m = &s->m;
    const loxo_index next = k_next(h), previous = k_previous(h);
    const loxo_index a = m->halfedge_vertex[h], b = m->halfedge_vertex[next], c = m->halfedge_vertex[previous];
    const int64_t n_listed = count_older(s, h);
    const exact_needs needs = {n_listed, 2 * (n_listed / EXACT_BLOCK + 1), 3, 1};
    if (!exact_has_room(s, worker, &needs)) return false;
    double length[3];
    const k_layout face = k_layout_at(m, h, length);
    const double x2 = face.x2, y2 = face.y2;
    int64_t n = take_list(s, worker, h, length[0], exact_bound(s->distance[a], length[0]),
                          exact_bound(s->distance[b], length[0]), n_listed);
    exact_taken *window = worker->work.taken;
    if (n > 1) {
        double below[3];
        const k_layout crossed = k_layout_at(m, m->halfedge_twin[h], below);
        n = exact_prune(&worker->work, n, length[0], length[0] - crossed.x2, crossed.y2);
        window = worker->work.kept;
    }
    worker->n_windows += n;

    if (s->n_goals > 0) exact_meet_goals(s, h, &face, window, n);
    /* The apex. A way that bends in the base is a way, too: it closes gaps as wide as rounding errors. */
    double best = s->distance[c], best_at = 0.0;
    int64_t best_i = -1;
    for (int64_t i = 0; i < n; ++i) {
        exact_taken *e = &window[i];
        const k_window *w = &e->w;
        const double below = w->y + y2;
        e->sight = below > 0.0 ? w->x + (x2 - w->x) * (w->y / below) : x2;
        e->way = k_window_way(w, x2, y2);
        if (e->way < best) {
            const double at = most(w->begin, least(w->end, e->sight));
            double way = e->way;
            if (at != e->sight) way = k_window_way(w, at, 0.0) + sqrt((at - x2) * (at - x2) + y2 * y2);
            if (way < best) {
                best = way;
                best_at = at;
                best_i = i;
            }
        }
    }
    exact_reach reach = s->reach[c];
    if (best_i >= 0) {
        reach = (exact_reach){best_at, window[best_i].w.x, window[best_i].w.y, h, window[best_i].origin};
        exact_make_offer(s, worker, c, best, reach);
    }

    /* What other lists offer in this round is not looked at: it might not be there yet. */
    const double apex_bound = exact_bound(best, length[0]);
    const bool is_through = best < HUGE_VAL && reach.via == h && reach.at >= 0.0;
    const double through = reach.at;
    const double ux = length[2] > 0.0 ? x2 / length[2] : 1.0, uy = length[2] > 0.0 ? y2 / length[2] : 0.0;
    const double vx = length[1] > 0.0 ? (length[0] - x2) / length[1] : 1.0, vy = length[1] > 0.0 ? y2 / length[1] : 0.0;
    side left = {
        .target = m->halfedge_twin[previous],
        .length = length[2],
        .start_bound = exact_bound(s->distance[a], length[2]),
        .end_bound = exact_bound(best, length[2]),
        .opposite_x = length[0] * ux,
        .opposite_y = length[0] * uy,
        .opposite_bound = exact_bound(s->distance[b], length[2] + length[1]),
        .opposite_is_ahead = true,
        .key = least(s->distance[a], best),
        .chain = EXACT_NO_CHAIN,
    };
    side right = {
        .target = m->halfedge_twin[next],
        .length = length[1],
        .start_bound = exact_bound(best, length[1]),
        .end_bound = exact_bound(s->distance[b], length[1]),
        .opposite_x = length[1] - length[0] * vx,
        .opposite_y = length[0] * vy,
        .opposite_bound = exact_bound(s->distance[a], length[2] + length[1]),
        .opposite_is_ahead = false,
        .key = least(s->distance[b], best),
        .chain = EXACT_NO_CHAIN,
    };
    for (int64_t i = 0; i < n; ++i) {
        const exact_taken e = window[i];
        double split_left = e.sight, split_right = e.sight;
        if (is_through && e.way > apex_bound) {
            split_left = least(split_left, through);
            split_right = most(split_right, through);
        }
        if (!(e.w.y + y2 > 0.0)) {
            /* The source lies on the base and the face is flat: it lies on one of the sides as well. */
            if (!(e.w.begin <= e.w.x && e.w.x <= e.w.end)) continue;
            k_window w = {.x = e.w.x, .end = length[2], .offset = e.w.offset};
            if (e.w.x < x2) {
                if (left.target >= 0) arrive(s, worker, &left, &w, e.origin);
            } else {
                w.x = length[1] - (length[0] - e.w.x);
                w.end = length[1];
                if (right.target >= 0) arrive(s, worker, &right, &w, e.origin);
            }
            continue;
        }
        if (left.target >= 0 && e.w.begin < split_left) {
            const double end = least(e.w.end, split_left);
            k_window w = {.offset = e.w.offset, .x = e.w.x * ux - e.w.y * uy, .y = e.w.y * ux + e.w.x * uy};
            w.begin = k_window_meet(e.w.begin, e.w.x, e.w.y, ux, uy, length[2]);
            w.end = end >= e.sight ? length[2] : k_window_meet(end, e.w.x, e.w.y, ux, uy, length[2]);
            if (w.y >= 0.0) arrive(s, worker, &left, &w, e.origin);
        }
        if (right.target >= 0 && e.w.end > split_right) {
            const double begin = most(e.w.begin, split_right), x = length[0] - e.w.x;
            k_window w = {.offset = e.w.offset, .x = length[1] - (x * vx - e.w.y * vy), .y = e.w.y * vx + x * vy};
            w.begin =
                begin <= e.sight ? 0.0 : length[1] - k_window_meet(length[0] - begin, x, e.w.y, vx, vy, length[1]);
            w.end = length[1] - k_window_meet(length[0] - e.w.end, x, e.w.y, vx, vy, length[1]);
            if (w.y >= 0.0) arrive(s, worker, &right, &w, e.origin);
        }
    }
    if (left.chain.block != NULL) exact_hang(s, worker, &left.chain, left.target, left.key);
    if (right.chain.block != NULL) exact_hang(s, worker, &right.chain, right.target, right.key);
    return true;
}
