/* SPDX-License-Identifier: MIT
 * Shortest ways back to their sources. Each straight piece is followed from face to face in the plane in which it is
 * straight, towards the place of its origin there; when the origin is found, the line to it tells where edges are crossed. */
#include "base/allocate.h"
#include "solver/geodesic/exact/exact_internal.h"

#include <inttypes.h>

/* The origin is found when it lies so near to where it should be, in lengths of the piece and of the edge beside it: far
 * more than rounding errors, far less than other places of the same vertex. */
#define FOUND_WITHIN 1e-7
/* A piece passes through a vertex when the way by it is longer by no more, relative. */
#define PASSES_WITHIN 1e-13
/* The line to the origin passes beside an edge by no more, in lengths of the edge; the way is then bent at its end. */
#define MISSES_BY 1e-6

typedef struct spot {
    double x, y;
} spot;

static inline spot spot_sub(spot a, spot b) { return (spot){a.x - b.x, a.y - b.y}; }

static inline double spot_cross(spot a, spot b) { return a.x * b.y - a.y * b.x; }

static inline double spot_norm(spot a) { return sqrt(a.x * a.x + a.y * a.y); }

void exact_way_destroy(loxo_context *ctx, exact_way *way)
{
    loxo_release(ctx, way->stop);
    *way = (exact_way){0};
}

static loxo_status add_stop(loxo_context *ctx, exact_way *way, exact_stop stop)
{
    if (way->n == way->room) {
        const int64_t room = way->room == 0 ? 64 : 2 * way->room;
        exact_stop *more = loxo_reallocate(ctx, way->stop, room, sizeof *more);
        if (more == NULL) return LOXO_ERR_MEMORY;
        way->stop = more;
        way->room = room;
    }
    way->stop[way->n++] = stop;
    return LOXO_OK;
}

static inline spot on_line(spot a, spot b, double length, double along, double up)
{
    const double ux = length > 0.0 ? (b.x - a.x) / length : 1.0, uy = length > 0.0 ? (b.y - a.y) / length : 0.0;
    return (spot){a.x + along * ux - up * uy, a.y + along * uy + up * ux};
}

/* Where the segment from p to q crosses that from a to b, 0 to 1 along the latter when it does; of one without length, or along the
 * latter, where p is. */
static double crossing(spot p, spot q, spot a, spot b)
{
    const spot pq = spot_sub(q, p), ab = spot_sub(b, a), ap = spot_sub(p, a);
    const double from = spot_cross(pq, spot_sub(a, p)), to = spot_cross(pq, spot_sub(b, p));
    const double square = ab.x * ab.x + ab.y * ab.y;
    double t = 0.0;
    if (from != to)
        t = from / (from - to);
    else if (square > 0.0)
        t = (ap.x * ab.x + ap.y * ab.y) / square;
    return t;
}

/* A half-edge that a piece crosses, in the plane; the piece's end lies above it, in its face. */
typedef struct gate {
    loxo_index h;
    spot a, b;
} gate;

/* The gate after the one that was crossed, on the way to aim. */
static gate next_gate(const exact_state *s, gate g, spot from, spot aim)
{
    double length[3];
    const loxo_index twin = s->m.halfedge_twin[g.h];
    const k_layout face = k_layout_at(&s->m, twin, length);
    const spot apex = on_line(g.b, g.a, length[0], face.x2, face.y2);
    /* twin runs from b to a, its next from a to the apex. An apex on the left is passed on its right, where a is. Nothing goes
     * through an edge without length. */
    const double none = FOUND_WITHIN * FOUND_WITHIN * length[0];
    const bool is_at_a = length[1] <= none, is_at_b = length[2] <= none;
    const bool is_left = spot_cross(spot_sub(aim, from), spot_sub(apex, from)) > 0.0;
    if ((is_left && !is_at_a) || is_at_b) return (gate){k_next(twin), g.a, apex};
    return (gate){k_previous(twin), apex, g.b};
}

/* A vertex u at an end of the gate ends the piece when it is its origin, and also when the piece passes through it: the rest
 * of the way is then that vertex's. In the piece's own face a vertex beside it will do, too: the window that gave the
 * distance may have ended there. */
static bool ends_at(const exact_state *s, loxo_index vertex, loxo_index u, spot at, spot from, spot aim,
                    exact_origin origin, double here, bool is_first)
{
    const spot to = spot_sub(at, from), line = spot_sub(aim, from);
    const double straight = spot_norm(to), total = spot_norm(line);
    if (u == origin && spot_norm(spot_sub(at, aim)) <= FOUND_WITHIN * total) return true;
    if (u == vertex || !(s->distance[u] < here)) return false;
    if (!is_first && !(fabs(spot_cross(line, to)) <= FOUND_WITHIN * total * straight)) return false;
    return s->distance[u] + straight <= here + PASSES_WITHIN * here;
}

/* Is the piece's seed in the face of the gate? */
static bool is_seed_here(const exact_state *s, const geodesic_seed *seed, gate g, spot aim, double total, spot *at)
{
    double length[3];
    if (k_face_of(g.h) != seed->face) return false;
    const k_layout face = k_layout_at(&s->m, g.h, length);
    double along, up;
    exact_place(seed, g.h, &face, length[0], &along, &up);
    *at = on_line(g.a, g.b, length[0], along, up);
    return spot_norm(spot_sub(*at, aim)) <= FOUND_WITHIN * (total + length[0]);
}

/* Where vertices lie on each other, a piece may start at one and leave by the other: by which end of the first gate? -1: by
 * none. */
static loxo_index way_around(const exact_state *s, loxo_index vertex, gate g, spot from, double here, spot *at)
{
    const loxo_index end[2] = {s->m.halfedge_vertex[g.h], k_head(&s->m, g.h)};
    for (int i = 0; i < 2; ++i) {
        *at = i == 0 ? g.a : g.b;
        if (end[i] == vertex || s->reach[end[i]].origin == vertex) continue;
        if (s->distance[end[i]] + spot_norm(spot_sub(*at, from)) <= here + PASSES_WITHIN * here) return end[i];
    }
    return -1;
}

static loxo_status lost(const exact_state *s, loxo_index vertex)
{
    const loxo_place place = {.byte = -1, .element = vertex};
    return loxo_fail_at(s->ctx, LOXO_ERR_NUMERIC, place, "geodesic: the way back from vertex %" PRId64 " is lost",
                        (int64_t)vertex);
}

/* One straight piece, from a vertex, or the goal (-1) at `from` in the frame of reach.via, a distance `here`, to where it
 * ends, which is added as a stop; *vertex is then that vertex, -1 a seed. */
static loxo_status follow(const exact_state *s, loxo_index *vertex, exact_reach reach, spot from, double here,
                          exact_way *way)
{
    const loxo_mesh_view *m = &s->m;
    double length[3];
    (void)k_layout_at(m, reach.via, length);
    const spot source = {reach.x, -reach.y};
    const double total = spot_norm(spot_sub(from, source));
    const double before = reach.origin >= 0 ? s->distance[reach.origin] : 0.0;
    /* Where the window ended beside the straight line, the way bends at a vertex there: on the edge, or behind a flat face. */
    const bool is_bent = before + total < here - PASSES_WITHIN * here;
    const spot aim = is_bent ? (spot){reach.at, 0.0} : source;
    const gate first = {reach.via, {0.0, 0.0}, {length[0], 0.0}};
    const int64_t seed = -1 - (int64_t)reach.origin;
    exact_stop end = {-1, -1, -1, 0.0};
    int64_t n_gates = 0;
    gate g = first;
    spot at;
    for (;; ++n_gates) {
        const loxo_index a = m->halfedge_vertex[g.h], b = k_head(m, g.h);
        if (seed >= 0 && is_seed_here(s, &s->seeds[seed], g, aim, total, &at)) {
            end.seed = seed;
            break;
        }
        if (ends_at(s, *vertex, a, g.a, from, aim, reach.origin, here, n_gates == 0)) {
            end.vertex = a;
            at = g.a;
            break;
        }
        if (ends_at(s, *vertex, b, g.b, from, aim, reach.origin, here, n_gates == 0)) {
            end.vertex = b;
            at = g.b;
            break;
        }
        if (m->halfedge_twin[g.h] < 0 || n_gates > 3 * m->n_faces) {
            end.vertex = way_around(s, *vertex, first, from, here, &at);
            if (end.vertex < 0 || way->n > 6 * m->n_faces) return lost(s, *vertex);
            n_gates = 0;
            break;
        }
        g = next_gate(s, g, from, aim);
    }
    g = first;
    for (int64_t i = 0; i < n_gates; ++i) {
        const double t = crossing(from, at, g.a, g.b);
        if (!(t >= -MISSES_BY && t <= 1.0 + MISSES_BY)) return lost(s, *vertex);
        const loxo_status status = add_stop(s->ctx, way, (exact_stop){-1, g.h, -1, t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t});
        if (status < 0) return status;
        g = next_gate(s, g, from, aim);
    }
    *vertex = end.vertex;
    return add_stop(s->ctx, way, end);
}

loxo_status exact_trace(const exact_state *s, loxo_index vertex, exact_way *way)
{
    loxo_status status = add_stop(s->ctx, way, (exact_stop){vertex, -1, -1, 0.0});
    while (status >= 0 && vertex >= 0) {
        const exact_reach reach = s->reach[vertex];
        double length[3];
        if (reach.via < 0) return status;
        if (reach.at < 0.0) return add_stop(s->ctx, way, (exact_stop){-1, -1, -1 - (int64_t)reach.origin, 0.0});
        const k_layout face = k_layout_at(&s->m, reach.via, length);
        status = follow(s, &vertex, reach, (spot){face.x2, face.y2}, s->distance[vertex], way);
    }
    return status;
}

loxo_status exact_trace_goal(const exact_state *s, exact_way *way)
{
    loxo_index vertex = -1;
    loxo_status status = add_stop(s->ctx, way, (exact_stop){-1, -1, -1, 0.0});
    double length[3];
    spot from;
    const k_layout face = k_layout_at(&s->m, s->goal_reach.via, length);
    exact_place(&s->goals[s->goal], s->goal_reach.via, &face, length[0], &from.x, &from.y);
    if (status >= 0) status = follow(s, &vertex, s->goal_reach, from, s->goal_distance, way);
    if (status < 0 || vertex < 0) return status;
    way->n -= 1; /* which the rest begins with */
    return exact_trace(s, vertex, way);
}
