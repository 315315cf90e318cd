/* SPDX-License-Identifier: MIT
 * Ways down a field that is linear on every face: against the gradient from edge to edge, along an edge that both sides
 * push against, from a vertex into the face or along the edge where it goes down fastest. Every step ends lower than it
 * began, or as low at a vertex when it did not begin at one, so no way comes back to where it was. A face that holds a goal about as far off as the field says is left for it
 * on a straight line. Where nothing goes down (the field is only nearly a distance), the nearest vertex that is lower, by
 * edges, is gone to; and a way that takes more steps than any sensible one goes by edges from there on. */
#include "mesh/lines/descent.h"

#include "base/allocate.h"
#include "base/context.h"
#include "base/sort.h"
#include "kernel/plane.h"
#include "kernel/unfold_kernel.h"

#include <stdlib.h>

#define TRUST     1.25 /* of what the field says to what the straight line to a goal in the same face takes */
#define SNAP      1e-9 /* a crossing so near to a vertex, in lengths of the edge, is that vertex if that is lower */
#define NO_FACE   ((loxo_index)-1)
#define UNVISITED ((loxo_index)-1)

/* A goal as a face sees it. */
typedef struct held_goal {
    loxo_index face;
    double weight[3];
    int64_t goal;
} held_goal;

struct line_descent {
    loxo_context *ctx;
    const loxo_mesh_view *m;
    const double *distance;
    const line_goal *goal;
    held_goal *held;       /* [n_held] goals inside faces and edges, by face */
    loxo_index *at_vertex; /* [n_at_vertex] goals at vertices, ascending */
    loxo_index *near;      /* [n_near] corners of the faces of the others, ascending, repeated */
    int64_t n_held, n_at_vertex, n_near;
    loxo_index
        *found_by; /* [n_vertices] of the search for a lower vertex, UNVISITED between searches; made when needed */
    loxo_index *queue;
};

/* Where a way is: at a vertex (vertex >= 0), on an edge (halfedge >= 0, at t from its start), or inside a face. */
typedef struct place {
    loxo_index vertex, halfedge, face;
    double t, weight[3];
    double value;
} place;

/* ---- goals --------------------------------------------------------------------------------------------------- */

static bool by_face(const void *arg, const void *a, const void *b)
{
    const held_goal *x = a, *y = b;
    (void)arg;
    return x->face != y->face ? x->face < y->face : x->goal < y->goal;
}

static bool by_number(const void *arg, const void *a, const void *b)
{
    (void)arg;
    return *(const loxo_index *)a < *(const loxo_index *)b;
}

static int compare_vertices(const void *a, const void *b)
{
    const loxo_index x = *(const loxo_index *)a, y = *(const loxo_index *)b;
    return (x > y) - (x < y);
}

/* The face of a goal, and of one on an edge the face beyond. */
static void hold(line_descent *d, int64_t i)
{
    const line_goal *goal = &d->goal[i];
    for (int k = 0; k < 3; ++k)
        d->near[d->n_near++] = d->m->halfedge_vertex[(int64_t)3 * goal->face + k];
    d->held[d->n_held++] = (held_goal){goal->face, {goal->weight[0], goal->weight[1], goal->weight[2]}, i};
    for (int k = 0; k < 3; ++k) {
        const loxo_index h = (loxo_index)((int64_t)3 * goal->face + k), t = d->m->halfedge_twin[h];
        if (goal->weight[k == 0 ? 2 : k - 1] > 0.0 || t < 0) continue;
        held_goal *beyond = &d->held[d->n_held++];
        *beyond = (held_goal){.face = (loxo_index)(t / 3), .goal = i};
        beyond->weight[t % 3] = goal->weight[k == 2 ? 0 : k + 1];
        beyond->weight[k_next(t) % 3] = goal->weight[k];
        return;
    }
}

loxo_status line_descent_begin(loxo_context *ctx, const loxo_mesh_view *m, const double *distance,
                               const line_goal *goals, int64_t n_goals, line_descent **out)
{
    line_descent *d = loxo_allocate(ctx, 1, sizeof *d);
    *out = NULL;
    if (d == NULL) return LOXO_ERR_MEMORY;
    *d = (line_descent){.ctx = ctx, .m = m, .distance = distance, .goal = goals};
    d->held = loxo_allocate(ctx, 2 * n_goals, sizeof *d->held);
    d->at_vertex = loxo_allocate(ctx, n_goals, sizeof *d->at_vertex);
    d->near = loxo_allocate(ctx, 3 * n_goals, sizeof *d->near);
    if (d->held == NULL || d->at_vertex == NULL || d->near == NULL) {
        line_descent_end(d);
        return LOXO_ERR_MEMORY;
    }
    for (int64_t i = 0; i < n_goals; ++i) {
        if (goals[i].vertex >= 0)
            d->at_vertex[d->n_at_vertex++] = goals[i].vertex;
        else
            hold(d, i);
    }
    loxo_sort(d->held, d->n_held, sizeof *d->held, by_face, NULL);
    loxo_sort(d->at_vertex, d->n_at_vertex, sizeof *d->at_vertex, by_number, NULL);
    loxo_sort(d->near, d->n_near, sizeof *d->near, by_number, NULL);
    *out = d;
    return LOXO_OK;
}

void line_descent_end(line_descent *d)
{
    if (d == NULL) return;
    loxo_context *ctx = d->ctx;
    loxo_release(ctx, d->held);
    loxo_release(ctx, d->at_vertex);
    loxo_release(ctx, d->near);
    loxo_release(ctx, d->found_by);
    loxo_release(ctx, d->queue);
    loxo_release(ctx, d);
}

static bool is_goal(const line_descent *d, loxo_index v)
{
    return d->n_at_vertex > 0 && bsearch(&v, d->at_vertex, (size_t)d->n_at_vertex, sizeof v, compare_vertices) != NULL;
}

/* At a goal, or at a corner of its face. */
static bool is_near_goal(const line_descent *d, loxo_index v)
{
    return is_goal(d, v) ||
           (d->n_near > 0 && bsearch(&v, d->near, (size_t)d->n_near, sizeof v, compare_vertices) != NULL);
}

/* ---- faces laid flat ----------------------------------------------------------------------------------------- */

typedef struct flat_face {
    k_spot corner[3];
    k_spot down;   /* against the gradient */
    bool is_sound; /* it has area and a direction */
} flat_face;

static flat_face lay_flat(const line_descent *d, int64_t f)
{
    const loxo_index *v = &d->m->halfedge_vertex[3 * f];
    const double a = d->distance[v[0]], b = d->distance[v[1]], c = d->distance[v[2]];
    double length[3];
    k_face_lengths(d->m, f, length);
    const k_layout l = k_layout_of(length);
    flat_face face = {.corner = {{0.0, 0.0}, {l.x1, 0.0}, {l.x2, l.y2}}};
    if (!(l.x1 > 0.0) || !(l.y2 > 0.0) || !(a + b + c < HUGE_VAL)) return face;
    const double x = (b - a) / l.x1, y = ((c - a) - x * l.x2) / l.y2;
    face.down = (k_spot){-x, -y};
    face.is_sound = isfinite(x) && isfinite(y) && (x != 0.0 || y != 0.0);
    return face;
}

static double slope(const flat_face *face) { return spot_norm(face->down); }

static k_spot at_weights(const flat_face *face, const double weight[3])
{
    k_spot p = {0.0, 0.0};
    for (int k = 0; k < 3; ++k) {
        p.x += weight[k] * face->corner[k].x;
        p.y += weight[k] * face->corner[k].y;
    }
    return p;
}

/* ---- places -------------------------------------------------------------------------------------------------- */

static place at_vertex(const line_descent *d, loxo_index v)
{
    return (place){.vertex = v, .halfedge = -1, .face = NO_FACE, .value = d->distance[v]};
}

/* Between the values of both ends, also when rounded: neither end is ever below what lies between. */
static double between(double a, double b, double t) { return fmin(fmax(a + t * (b - a), fmin(a, b)), fmax(a, b)); }

/* On half-edge h; at the ends, or next to a lower one, its vertex. value: of the place before. */
static place on_edge(const line_descent *d, loxo_index h, double t, double value)
{
    const loxo_index from = d->m->halfedge_vertex[h], to = k_head(d->m, h);
    const double a = d->distance[from], b = d->distance[to];
    if (t <= 0.0 || (t < SNAP && a < value)) return at_vertex(d, from);
    if (t >= 1.0 || (t > 1.0 - SNAP && b < value)) return at_vertex(d, to);
    return (place){.vertex = -1, .halfedge = h, .face = NO_FACE, .t = t, .value = between(a, b, t)};
}

/* From p in face f against the gradient to the rim, by the edges whose bit is in `edges`; false: it meets none. */
static bool cross_face(const line_descent *d, int64_t f, const flat_face *face, k_spot p, unsigned edges, double value,
                       place *next)
{
    double nearest = HUGE_VAL, t = 0.0;
    int exit = -1;
    for (int k = 0; k < 3; ++k) {
        const k_spot a = face->corner[k], side = spot_sub(face->corner[k == 2 ? 0 : k + 1], a);
        const double outward = -spot_cross(side, face->down), inside = spot_cross(side, spot_sub(p, a));
        if ((edges >> k & 1) == 0 || !(outward > 0.0)) continue;
        const double s = inside > 0.0 ? inside / outward : 0.0;
        if (!(s < nearest)) continue;
        const k_spot q = spot_sub((k_spot){p.x + s * face->down.x, p.y + s * face->down.y}, a);
        nearest = s;
        exit = k;
        t = spot_dot(q, side) / spot_dot(side, side);
    }
    if (exit < 0 || !isfinite(t)) return false;
    *next = on_edge(d, (loxo_index)(3 * f + exit), t, value);
    return true;
}

/* The lower end of an edge. */
static place lower_end(const line_descent *d, loxo_index h)
{
    const loxo_index from = d->m->halfedge_vertex[h], to = k_head(d->m, h);
    return at_vertex(d, d->distance[from] <= d->distance[to] ? from : to);
}

static place lowest_corner(const line_descent *d, int64_t f)
{
    const loxo_index *v = &d->m->halfedge_vertex[3 * f];
    int best = 0;
    for (int k = 1; k < 3; ++k)
        if (d->distance[v[k]] < d->distance[v[best]]) best = k;
    return at_vertex(d, v[best]);
}

static place step_in_face(const line_descent *d, const place *now)
{
    const flat_face face = lay_flat(d, now->face);
    place next;
    if (face.is_sound && cross_face(d, now->face, &face, at_weights(&face, now->weight), 7u, now->value, &next))
        return next;
    return lowest_corner(d, now->face);
}

/* Into the face on either side that goes down from the edge, of two the steeper; else along the edge. */
static place step_on_edge(const line_descent *d, const place *now)
{
    place best = lower_end(d, now->halfedge);
    double steepest = 0.0;
    for (int side = 0; side < 2; ++side) {
        const loxo_index h = side == 0 ? now->halfedge : d->m->halfedge_twin[now->halfedge];
        place next;
        if (h < 0) continue;
        const int k = (int)(h % 3);
        const flat_face face = lay_flat(d, h / 3);
        const k_spot along = spot_sub(face.corner[k == 2 ? 0 : k + 1], face.corner[k]);
        const double t = side == 0 ? now->t : 1.0 - now->t;
        const k_spot p = {face.corner[k].x + t * along.x, face.corner[k].y + t * along.y};
        if (!face.is_sound || !(spot_cross(along, face.down) > 0.0) || !(slope(&face) > steepest)) continue;
        if (!cross_face(d, h / 3, &face, p, 7u & ~(1u << k), now->value, &next)) continue;
        steepest = slope(&face);
        best = next;
    }
    return best;
}

/* From corner k of a face: whether down leads into it. */
static bool leads_into(const flat_face *face, int k)
{
    const k_spot u = spot_sub(face->corner[k == 2 ? 0 : k + 1], face->corner[k]);
    const k_spot w = spot_sub(face->corner[k == 0 ? 2 : k - 1], face->corner[k]);
    return spot_cross(u, face->down) >= 0.0 && spot_cross(face->down, w) >= 0.0;
}

/* Into the face or along the edge that goes down fastest; itself where none does. by_edges: along edges only. */
static place step_at_vertex(const line_descent *d, const place *now, bool by_edges)
{
    const loxo_index v = now->vertex, start = d->m->vertex_halfedge[v];
    place best = *now;
    double steepest = 0.0;
    for (loxo_index h = start; h >= 0;) {
        const int64_t f = h / 3;
        const int k = (int)(h % 3);
        const loxo_index ends[2] = {k_head(d->m, h), d->m->halfedge_vertex[k_previous(h)]};
        const flat_face face = lay_flat(d, f);
        double length[3];
        place next;
        k_face_lengths(d->m, f, length);
        for (int side = 0; side < 2; ++side) {
            const double rate = (now->value - d->distance[ends[side]]) / length[side == 0 ? k : k_previous(h) % 3];
            if (!(rate > steepest)) continue;
            steepest = rate;
            best = at_vertex(d, ends[side]);
        }
        if (!by_edges && face.is_sound && slope(&face) > steepest && leads_into(&face, k) &&
            cross_face(d, f, &face, face.corner[k], 1u << (k == 2 ? 0 : k + 1), now->value, &next) &&
            next.value < now->value) {
            steepest = slope(&face);
            best = next;
        }
        h = d->m->halfedge_twin[k_previous(h)];
        if (h == start) break;
    }
    return best;
}

/* ---- where nothing goes down --------------------------------------------------------------------------------- */

static loxo_status prepare_search(line_descent *d)
{
    if (d->found_by != NULL) return LOXO_OK;
    const int64_t n = d->m->n_vertices;
    d->queue = loxo_allocate(d->ctx, n, sizeof *d->queue);
    if (d->queue == NULL) return LOXO_ERR_MEMORY;
    d->found_by = loxo_allocate(d->ctx, n, sizeof *d->found_by);
    if (d->found_by == NULL) {
        loxo_release(d->ctx, d->queue);
        d->queue = NULL;
        return LOXO_ERR_MEMORY;
    }
    for (int64_t v = 0; v < n; ++v)
        d->found_by[v] = UNVISITED;
    return LOXO_OK;
}

static bool visit(line_descent *d, loxo_index v, loxo_index from, int64_t *n)
{
    if (d->found_by[v] != UNVISITED) return false;
    d->found_by[v] = from;
    d->queue[(*n)++] = v;
    return true;
}

/* The first vertex in breadth-first order that is near a goal or lower than the value; -1: there is none. */
static loxo_index search(line_descent *d, loxo_index from, double value, int64_t *n)
{
    (void)visit(d, from, from, n);
    for (int64_t i = 0; i < *n; ++i) {
        const loxo_index v = d->queue[i], start = d->m->vertex_halfedge[v];
        for (loxo_index h = start; h >= 0;) {
            const loxo_index ends[2] = {k_head(d->m, h), d->m->halfedge_vertex[k_previous(h)]};
            for (int side = 0; side < 2; ++side)
                if (visit(d, ends[side], v, n) && (d->distance[ends[side]] < value || is_near_goal(d, ends[side])))
                    return ends[side];
            h = d->m->halfedge_twin[k_previous(h)];
            if (h == start) break;
        }
    }
    return -1;
}

/* Goes by edges to the nearest vertex that is lower. */
static loxo_status go_lower(line_descent *d, place *now, line_way *way)
{
    int64_t n = 0;
    loxo_status status = prepare_search(d);
    if (status < 0) return status;
    const loxo_index from = now->vertex, lower = search(d, from, now->value, &n);
    if (lower >= 0) {
        /* the way back is turned round in the queue's second meaning: next vertex on the way */
        loxo_index next = lower;
        for (loxo_index v = lower; v != from;) {
            const loxo_index before = d->found_by[v];
            d->found_by[v] = next;
            next = v;
            v = before;
        }
        for (loxo_index v = next; status >= 0; v = d->found_by[v]) {
            const line_place at = {.vertex = v, .halfedge = -1, .face = -1};
            status = line_way_add(way, &at);
            if (v == lower) break;
        }
        *now = at_vertex(d, lower);
    } else
        status = loxo_fail(d->ctx, LOXO_ERR_ARGUMENT, "a way: nothing leads on to a source from vertex %lld",
                           (long long)(d->m->vertex_origin != NULL ? d->m->vertex_origin[from] : from));
    for (int64_t i = 0; i < n; ++i)
        d->found_by[d->queue[i]] = UNVISITED;
    return status;
}

/* ---- the way ------------------------------------------------------------------------------------------------- */

/* The nearest goal of face f from weights, at most so far off. */
static void look_for_goal(const line_descent *d, int64_t f, const double weight[3], double most, double *best,
                          held_goal *found)
{
    double length[3];
    k_face_lengths(d->m, f, length);
    const k_layout layout = k_layout_of(length);
    const flat_face flat = {.corner = {{0.0, 0.0}, {layout.x1, 0.0}, {layout.x2, layout.y2}}};
    const k_spot p = at_weights(&flat, weight);
    const held_goal key = {.face = (loxo_index)f};
    int64_t low = 0, high = d->n_held;
    for (int k = 0; k < 3; ++k) {
        const double away = k_distance_to_corner(layout, weight, k);
        if (away >= *best || away > most || !is_goal(d, d->m->halfedge_vertex[3 * f + k])) continue;
        *best = away;
        *found = (held_goal){.face = (loxo_index)f};
        found->weight[k] = 1.0;
    }
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (d->held[middle].face < key.face)
            low = middle + 1;
        else
            high = middle;
    }
    for (; low < d->n_held && d->held[low].face == key.face; ++low) {
        const k_spot way = spot_sub(at_weights(&flat, d->held[low].weight), p);
        const double away = spot_norm(way);
        if (away >= *best || away > most) continue;
        *best = away;
        *found = d->held[low];
    }
}

/* The goal to leave a place for; false: none. */
static bool find_goal(const line_descent *d, const place *now, double most, held_goal *goal)
{
    double best = HUGE_VAL;
    if (now->face != NO_FACE) {
        look_for_goal(d, now->face, now->weight, most, &best, goal);
    } else if (now->halfedge >= 0) {
        for (int side = 0; side < 2; ++side) {
            const loxo_index h = side == 0 ? now->halfedge : d->m->halfedge_twin[now->halfedge];
            double weight[3] = {0.0, 0.0, 0.0};
            if (h < 0) continue;
            weight[h % 3] = side == 0 ? 1.0 - now->t : now->t;
            weight[k_next(h) % 3] = 1.0 - weight[h % 3];
            look_for_goal(d, h / 3, weight, most, &best, goal);
        }
    } else {
        const loxo_index start = d->m->vertex_halfedge[now->vertex];
        for (loxo_index h = start; h >= 0;) {
            double weight[3] = {0.0, 0.0, 0.0};
            weight[h % 3] = 1.0;
            look_for_goal(d, h / 3, weight, most, &best, goal);
            h = d->m->halfedge_twin[k_previous(h)];
            if (h == start) break;
        }
    }
    return best < HUGE_VAL;
}

static loxo_status add_place(line_way *way, const place *now)
{
    const line_place at = {
        now->vertex, now->halfedge, now->face, now->t, {now->weight[0], now->weight[1], now->weight[2]}};
    return line_way_add(way, &at);
}

static loxo_status add_goal(const line_descent *d, line_way *way, const held_goal *goal)
{
    const line_place at = line_place_in_face(d->m, goal->face, goal->weight);
    return line_way_add(way, &at);
}

static place place_of(const line_descent *d, const line_goal *from)
{
    place now = {.vertex = from->vertex, .halfedge = -1, .face = from->face};
    double lowest = HUGE_VAL;
    if (from->vertex >= 0) return at_vertex(d, from->vertex);
    for (int k = 0; k < 3; ++k) {
        const loxo_index v = d->m->halfedge_vertex[(int64_t)3 * from->face + k];
        now.weight[k] = from->weight[k];
        if (!(from->weight[k] > 0.0)) continue;
        now.value += from->weight[k] * d->distance[v];
        lowest = fmin(lowest, d->distance[v]);
    }
    now.value = fmax(now.value, lowest);
    for (int k = 0; k < 3; ++k)
        if (from->weight[k == 0 ? 2 : k - 1] == 0.0) {
            now.halfedge = (loxo_index)((int64_t)3 * from->face + k);
            now.face = NO_FACE;
            now.t = from->weight[k == 2 ? 0 : k + 1];
            break;
        }
    return now;
}

/* Lower, or as low and at a vertex, from which only lower ones are gone to. */
static bool is_down(const place *now, const place *next)
{
    return next->value < now->value || (!(next->value > now->value) && next->vertex >= 0 && now->vertex < 0);
}

/* The lowest vertex of the edge or face of a place, which is not above it; of a vertex itself. */
static place lowest_at(const line_descent *d, const place *now)
{
    return now->vertex >= 0 ? *now : now->halfedge >= 0 ? lower_end(d, now->halfedge) : lowest_corner(d, now->face);
}

loxo_status line_descend(line_descent *d, const line_goal *from, line_way *way)
{
    const int64_t most_steps = 4 * d->m->n_faces + 64;
    place now = place_of(d, from);
    held_goal goal = {.face = NO_FACE};
    bool is_any_good = false; /* nothing goes down, or did one step ago: any goal of the face */
    way->n = 0;
    loxo_status status = add_place(way, &now);
    if (!isfinite(now.value))
        return loxo_fail(d->ctx, LOXO_ERR_ARGUMENT, "a way: the distance where it begins is not finite");
    for (int64_t n_steps = 0; status >= 0; ++n_steps) {
        if (now.vertex >= 0 && is_goal(d, now.vertex)) return LOXO_OK;
        if (find_goal(d, &now, is_any_good ? HUGE_VAL : TRUST * now.value, &goal)) return add_goal(d, way, &goal);
        const bool by_edges = n_steps > most_steps;
        place next = now.vertex >= 0     ? step_at_vertex(d, &now, by_edges)
                     : now.halfedge >= 0 ? step_on_edge(d, &now)
                                         : step_in_face(d, &now);
        if (by_edges && next.vertex < 0) next = lower_end(d, next.halfedge);
        if (!is_down(&now, &next)) next = lowest_at(d, &now);
        const bool is_stuck = next.vertex >= 0 && next.vertex == now.vertex;
        if (is_stuck && find_goal(d, &now, HUGE_VAL, &goal)) return add_goal(d, way, &goal);
        is_any_good = is_stuck;
        now = next;
        status = is_stuck ? go_lower(d, &now, way) : add_place(way, &now);
    }
    return status;
}
