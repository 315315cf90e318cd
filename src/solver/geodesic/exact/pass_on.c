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
} side;

loxo_status exact_improve(exact_state *s, loxo_index vertex, double distance, exact_reach reach)
{
    const double old = s->distance[vertex];
    uint8_t known = s->known[vertex];
    if (!(distance < old)) return LOXO_OK;
    if (old == HUGE_VAL) s->n_reached += 1;
    s->distance[vertex] = distance;
    s->reach[vertex] = reach;
    if (!(known & EXACT_LOOKED_AT)) s->known[vertex] = known = (uint8_t)(known | exact_look_at(s, vertex));
    if (!(known & EXACT_BENDS)) return LOXO_OK;
    if (!(known & EXACT_QUEUED) && old - distance <= 1e-14 * distance) return LOXO_OK; /* its windows are as good */
    s->known[vertex] = (uint8_t)(known | EXACT_QUEUED);
    return exact_queue_vertex(s, vertex);
}

loxo_status exact_add(exact_state *s, loxo_index h, const k_window *w, exact_origin origin, double key)
{
    exact_pool *pool = &s->pool;
    uint32_t id = s->list[h];
    exact_block *block = id != EXACT_NONE ? exact_pool_block(pool, id) : NULL;
    pool->n_live += 1;
    if (pool->n_live > pool->peak_live) pool->peak_live = pool->n_live;
    if (block == NULL || block->n == EXACT_BLOCK) {
        const uint32_t older = id;
        loxo_status status = LOXO_OK;
        if (pool->first_free == EXACT_NONE) status = exact_pool_grow(s->ctx, pool);
        if (status >= 0 && older == EXACT_NONE) status = exact_queue_halfedge(s, h, key);
        if (status < 0) return status;
        id = pool->first_free;
        block = exact_pool_block(pool, id);
        pool->first_free = block->next;
        block->n = 0;
        block->next = older;
        s->list[h] = id;
    }
    block->w[block->n] = *w;
    block->origin[block->n] = origin;
    block->n += 1;
    return LOXO_OK;
}

static loxo_status reserve_work(exact_state *s, int64_t n)
{
    exact_work *work = &s->work;
    const int64_t room = 2 * n;
    exact_work more = {.room = room};
    more.taken = loxo_allocate(s->ctx, room, sizeof *more.taken);
    more.kept = loxo_allocate(s->ctx, room, sizeof *more.kept);
    more.place = loxo_allocate(s->ctx, room, sizeof *more.place);
    more.other_place = loxo_allocate(s->ctx, room, sizeof *more.other_place);
    if (more.taken == NULL || more.kept == NULL || more.place == NULL || more.other_place == NULL) {
        exact_work_destroy(s->ctx, &more);
        return LOXO_ERR_MEMORY;
    }
    exact_work_destroy(s->ctx, work);
    *work = more;
    return LOXO_OK;
}

void exact_work_destroy(loxo_context *ctx, exact_work *work)
{
    loxo_release(ctx, work->taken);
    loxo_release(ctx, work->kept);
    loxo_release(ctx, work->place);
    loxo_release(ctx, work->other_place);
}

/* Moves the list of h to the work arrays in the order in which it came, without what the distances of the edge's ends make
 * needless. */
static loxo_status take_list(exact_state *s, loxo_index h, double length, double start_bound, double end_bound,
                             int64_t *n_taken)
{
    exact_pool *pool = &s->pool;
    exact_taken *taken;
    int64_t n_listed = 0, at, n = 0;
    for (uint32_t id = s->list[h]; id != EXACT_NONE; id = exact_pool_block(pool, id)->next)
        n_listed += exact_pool_block(pool, id)->n;
    if (n_listed > s->work.room) {
        const loxo_status status = reserve_work(s, n_listed + 64);
        if (status < 0) return status;
    }
    taken = s->work.taken;
    at = n_listed;
    for (uint32_t id = s->list[h]; id != EXACT_NONE;) {
        exact_block *block = exact_pool_block(pool, id);
        const uint32_t older = block->next;
        at -= block->n;
        for (uint32_t i = 0; i < block->n; ++i) {
            taken[at + i].w = block->w[i];
            taken[at + i].origin = block->origin[i];
        }
        block->next = pool->first_free;
        pool->first_free = id;
        id = older;
    }
    s->list[h] = EXACT_NONE;
    pool->n_live -= n_listed;
    for (int64_t i = 0; i < n_listed; ++i) {
        k_window w = taken[i].w;
        k_window_cut_start(&w, start_bound);
        k_window_cut_end(&w, length, end_bound);
        if (!(w.begin < w.end)) continue;
        taken[n].w = w;
        taken[n].origin = taken[i].origin;
        n += 1;
    }
    *n_taken = n;
    return LOXO_OK;
}

/* A window that has come to a side, in the target's frame. */
static loxo_status arrive(exact_state *s, const side *to, k_window *w, exact_origin origin)
{
    double at;
    k_window_cut_start(w, to->start_bound);
    k_window_cut_end(w, to->length, to->end_bound);
    if (!(w->begin < w->end)) return LOXO_OK;
    at = to->opposite_is_ahead ? w->begin : w->end;
    const double dx = at - to->opposite_x, dy = to->opposite_y;
    if (to->opposite_bound + sqrt(dx * dx + dy * dy) < k_window_way(w, at, 0.0)) return LOXO_OK;
    if (s->max_distance < HUGE_VAL) {
        const double nearest = w->x < w->begin ? w->begin : w->x > w->end ? w->end : w->x;
        if (k_window_way(w, nearest, 0.0) > s->max_distance) return LOXO_OK;
    }
    return exact_add(s, to->target, w, origin, to->key);
}

static double least(double a, double b) { return a < b ? a : b; }
static double most(double a, double b) { return a > b ? a : b; }

loxo_status exact_pass_on(exact_state *s, loxo_index h)
{
    const loxo_mesh_view *m = &s->m;
    const loxo_index next = k_next(h), previous = k_previous(h);
    const loxo_index a = m->halfedge_vertex[h], b = m->halfedge_vertex[next], c = m->halfedge_vertex[previous];
    double length[3];
    const k_layout face = k_layout_at(m, h, length);
    const double x2 = face.x2, y2 = face.y2;
    int64_t n = 0;
    loxo_status status =
        take_list(s, h, length[0], exact_bound(s->distance[a], length[0]), exact_bound(s->distance[b], length[0]), &n);
    if (status < 0) return status;
    exact_taken *window = s->work.taken;
    if (n > 1) {
        double below[3];
        const k_layout crossed = k_layout_at(m, m->halfedge_twin[h], below);
        n = exact_prune(&s->work, n, length[0], length[0] - crossed.x2, crossed.y2);
        window = s->work.kept;
    }
    s->n_windows += n;

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
    if (best_i >= 0 &&
        (status = exact_improve(
             s, c, best, (exact_reach){best_at, window[best_i].w.x, window[best_i].w.y, h, window[best_i].origin})) < 0)
        return status;

    const double apex_bound = exact_bound(s->distance[c], length[0]);
    const bool is_through = s->reach[c].via == h && s->reach[c].at >= 0.0;
    const double through = s->reach[c].at;
    const double ux = length[2] > 0.0 ? x2 / length[2] : 1.0, uy = length[2] > 0.0 ? y2 / length[2] : 0.0;
    const double vx = length[1] > 0.0 ? (length[0] - x2) / length[1] : 1.0, vy = length[1] > 0.0 ? y2 / length[1] : 0.0;
    const side left = {
        .target = m->halfedge_twin[previous],
        .length = length[2],
        .start_bound = exact_bound(s->distance[a], length[2]),
        .end_bound = exact_bound(s->distance[c], length[2]),
        .opposite_x = length[0] * ux,
        .opposite_y = length[0] * uy,
        .opposite_bound = exact_bound(s->distance[b], length[2] + length[1]),
        .opposite_is_ahead = true,
        .key = least(s->distance[a], s->distance[c]),
    };
    const side right = {
        .target = m->halfedge_twin[next],
        .length = length[1],
        .start_bound = exact_bound(s->distance[c], length[1]),
        .end_bound = exact_bound(s->distance[b], length[1]),
        .opposite_x = length[1] - length[0] * vx,
        .opposite_y = length[0] * vy,
        .opposite_bound = exact_bound(s->distance[a], length[2] + length[1]),
        .opposite_is_ahead = false,
        .key = least(s->distance[b], s->distance[c]),
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
                if (left.target >= 0 && (status = arrive(s, &left, &w, e.origin)) < 0) return status;
            } else {
                w.x = length[1] - (length[0] - e.w.x);
                w.end = length[1];
                if (right.target >= 0 && (status = arrive(s, &right, &w, e.origin)) < 0) return status;
            }
            continue;
        }
        if (left.target >= 0 && e.w.begin < split_left) {
            const double end = least(e.w.end, split_left);
            k_window w = {.offset = e.w.offset, .x = e.w.x * ux - e.w.y * uy, .y = e.w.y * ux + e.w.x * uy};
            w.begin = k_window_meet(e.w.begin, e.w.x, e.w.y, ux, uy, length[2]);
            w.end = end >= e.sight ? length[2] : k_window_meet(end, e.w.x, e.w.y, ux, uy, length[2]);
            if (w.y >= 0.0 && (status = arrive(s, &left, &w, e.origin)) < 0) return status;
        }
        if (right.target >= 0 && e.w.end > split_right) {
            const double begin = most(e.w.begin, split_right), x = length[0] - e.w.x;
            k_window w = {.offset = e.w.offset, .x = length[1] - (x * vx - e.w.y * vy), .y = e.w.y * vx + x * vy};
            w.begin =
                begin <= e.sight ? 0.0 : length[1] - k_window_meet(length[0] - begin, x, e.w.y, vx, vy, length[1]);
            w.end = length[1] - k_window_meet(length[0] - e.w.end, x, e.w.y, vx, vy, length[1]);
            if (w.y >= 0.0 && (status = arrive(s, &right, &w, e.origin)) < 0) return status;
        }
    }
    return LOXO_OK;
}
