/* SPDX-License-Identifier: MIT
 * Where windows begin: seeds, and vertices at which ways bend. */
#include "solver/geodesic/exact/exact_internal.h"

#include <float.h>

/* Angles as points of a circle that need not be of radius one; only the signs of their parts are looked at. */
typedef struct turn {
    double re, im;
} turn;

static inline turn turn_by(turn a, turn b)
{
    const turn c = {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
    const double size = fabs(c.re) + fabs(c.im);
    return size > 0.0 ? (turn){c.re / size, c.im / size} : (turn){1.0, 0.0};
}

/* Angles below this are taken for rounding errors: what a way gains by bending so little is its square. */
#define LEAST_ANGLE 1e-9
/* Faces whose height is less than so many lengths are flat. */
#define LEAST_HEIGHT 1e-7

static bool is_flat(const k_layout *face, const double length[3])
{
    double longest = length[0];
    if (length[1] > longest) longest = length[1];
    if (length[2] > longest) longest = length[2];
    return !(face->y2 * length[0] > LEAST_HEIGHT * longest * longest);
}

uint8_t exact_look_at(const exact_state *s, loxo_index vertex)
{
    const loxo_mesh_view *m = &s->m;
    const loxo_index first = m->vertex_halfedge[vertex];
    loxo_index h = first;
    turn sum = {1.0, 0.0};
    int half_turns = 0;
    bool is_flat_somewhere = false;
    do {
        double length[3];
        const k_layout face = k_layout_at(m, h, length);
        const bool was_below = sum.im < 0.0;
        is_flat_somewhere |= is_flat(&face, length);
        sum = turn_by(sum, (turn){face.x2, face.y2});
        half_turns += was_below != (sum.im < 0.0);
        h = m->halfedge_twin[k_previous(h)];
    } while (h >= 0 && h != first);
    if (is_flat_somewhere) return EXACT_LOOKED_AT | EXACT_BENDS | EXACT_ALL_ROUND;
    if (h < 0) return (uint8_t)(EXACT_LOOKED_AT | (half_turns >= 1 ? EXACT_BENDS : 0));
    /* Over 2 pi, and by more than rounding makes of 2 pi. */
    return (uint8_t)(EXACT_LOOKED_AT |
                     (half_turns > 2 || (half_turns == 2 && (sum.im > LEAST_ANGLE || sum.re < 0.0)) ? EXACT_BENDS : 0));
}

/* One window into a list of its own. */
static void add(exact_state *s, exact_worker *worker, loxo_index h, const k_window *w, exact_origin origin, double key)
{
    exact_chain chain = EXACT_NO_CHAIN;
    exact_put(s, worker, &chain, w, origin);
    exact_hang(s, worker, &chain, h, key);
}

/* Windows through the part [begin, end] of the edge that faces the start of half-edge h in h's face, measured from h's
 * head, and ways along both sides. The vertex at h's start stands, its distance is the windows' offset. */
static void send_across(exact_state *s, exact_worker *worker, loxo_index h, const k_layout *face,
                        const double length[3], double begin, double end)
{
    const loxo_mesh_view *m = &s->m;
    const loxo_index across = k_next(h), previous = k_previous(h), target = m->halfedge_twin[across];
    const loxo_index vertex = m->halfedge_vertex[h], p = m->halfedge_vertex[across], q = m->halfedge_vertex[previous];
    const double base = length[1], distance = s->distance[vertex];
    exact_make_offer(s, worker, p, distance + length[0], (exact_reach){length[2], length[2], 0.0, previous, vertex});
    exact_make_offer(s, worker, q, distance + length[2], (exact_reach){0.0, 0.0, 0.0, h, vertex});
    if (target < 0 || !(base > 0.0)) return;
    /* The target runs from q to p, and the vertex lies below it: its foot is so far from p. */
    const double foot = length[0] * ((length[0] - face->x2) / base);
    k_window w = {.begin = base - end, .end = base - begin, .x = base - foot, .offset = distance};
    w.y = length[0] * (face->y2 / base);
    if (w.begin < 0.0) w.begin = 0.0;
    if (w.end > base) w.end = base;
    if (w.begin < w.end)
        add(s, worker, target, &w, vertex,
            fmin(fmin(s->distance[p], distance + length[0]), fmin(s->distance[q], distance + length[2])));
}

static void send_around(exact_state *s, exact_worker *worker, loxo_index vertex)
{
    const loxo_index first = s->m.vertex_halfedge[vertex];
    loxo_index h = first;
    do {
        double length[3];
        const k_layout face = k_layout_at(&s->m, h, length);
        send_across(s, worker, h, &face, length, 0.0, length[1]);
        h = s->m.halfedge_twin[k_previous(h)];
    } while (h >= 0 && h != first);
}

static inline turn conjugate(turn a) { return (turn){a.re, -a.im}; }

/* Where a ray from h's start, turned by an angle from h, meets the opposite side, measured from h's head: the point
 * (L0 + t (x2 - L0), t y2) of it that is parallel to the angle. */
static double meet_opposite(const k_layout *face, const double length[3], turn by)
{
    const double across = by.re * face->y2 - by.im * (face->x2 - length[0]), along = by.im * length[0];
    return !(along < across) ? length[1] : along > 0.0 ? along / across * length[1] : 0.0;
}

/* One end of the shadow behind a vertex: in the face of half-edge h, which starts there, at `at` of the opposite side
 * measured from h's head; h < 0: the boundary comes before half a turn. n_steps faces from the one that the way came in. */
typedef struct shadow_end {
    loxo_index h;
    double at;
    int64_t n_steps;
} shadow_end;

/* Turns from the way that came, counter-clockwise, until half a turn is made. angle: from it to the far side of its face. */
static shadow_end turn_left(const exact_state *s, loxo_index incoming, turn angle)
{
    shadow_end end = {.h = incoming};
    for (;;) {
        double length[3];
        end.h = s->m.halfedge_twin[k_previous(end.h)];
        end.n_steps += 1;
        if (end.h < 0 || end.h == incoming) return (shadow_end){.h = -1};
        const k_layout face = k_layout_at(&s->m, end.h, length);
        const turn next = turn_by(angle, (turn){face.x2, face.y2});
        if (next.im < 0.0) {
            const turn rest = conjugate(angle); /* and half a turn */
            end.at = meet_opposite(&face, length, (turn){-rest.re, -rest.im});
            end.at -= LEAST_ANGLE * length[1];
            return end;
        }
        angle = next;
    }
}

/* Clockwise; angle: from it to the near side of its face. */
static shadow_end turn_right(const exact_state *s, loxo_index incoming, turn angle)
{
    shadow_end end = {.h = incoming};
    for (;;) {
        double length[3];
        const loxo_index twin = s->m.halfedge_twin[end.h];
        end.h = twin < 0 ? -1 : k_next(twin);
        end.n_steps += 1;
        if (end.h < 0 || end.h == incoming) return (shadow_end){.h = -1};
        const k_layout face = k_layout_at(&s->m, end.h, length);
        const turn corner = {face.x2, face.y2}, next = turn_by(angle, corner);
        if (next.im < 0.0) {
            end.at = meet_opposite(&face, length, turn_by(corner, (turn){-angle.re, -angle.im}));
            end.at += LEAST_ANGLE * length[1];
            return end;
        }
        angle = next;
    }
}

/* Shortest ways bend only by half a turn or more on both sides: windows go into the shadow alone. */
static void send_into_shadow(exact_state *s, exact_worker *worker, loxo_index vertex)
{
    const loxo_mesh_view *m = &s->m;
    const exact_reach reach = s->reach[vertex];
    double length[3];
    if ((s->known[vertex] & EXACT_ALL_ROUND) || reach.via < 0 || reach.at < 0.0) {
        send_around(s, worker, vertex);
        return;
    }
    const loxo_index incoming = k_previous(reach.via); /* starts at the vertex */
    k_layout face = k_layout_at(m, incoming, length);
    const double share = length[1] > 0.0 ? reach.at / length[1] : 0.0;
    const turn ray = {length[0] + share * (face.x2 - length[0]), share * face.y2};
    if (!(fabs(ray.re) + fabs(ray.im) > LEAST_HEIGHT * (length[0] + length[1]))) {
        send_around(s, worker, vertex);
        return;
    }
    const shadow_end left = turn_left(s, incoming, turn_by((turn){face.x2, face.y2}, conjugate(ray)));
    const shadow_end right = turn_right(s, incoming, turn_by(ray, (turn){1.0, 0.0}));

    const bool is_boundary = m->halfedge_twin[m->vertex_halfedge[vertex]] < 0;
    if (is_boundary) {
        for (loxo_index h = left.h; h >= 0; h = m->halfedge_twin[k_previous(h)]) {
            face = k_layout_at(m, h, length);
            send_across(s, worker, h, &face, length, h == left.h ? left.at : 0.0, length[1]);
        }
        for (loxo_index h = right.h; h >= 0;) {
            const loxo_index twin = m->halfedge_twin[h];
            face = k_layout_at(m, h, length);
            send_across(s, worker, h, &face, length, 0.0, h == right.h ? right.at : length[1]);
            h = twin < 0 ? -1 : k_next(twin);
        }
        return;
    }
    /* Both ends are there, as the angles sum to over 2 pi. From left to right, counter-clockwise; when the ends passed
     * each other by a rounding error, there is nothing between them. */
    if (left.h < 0 || right.h < 0) {
        send_around(s, worker, vertex);
        return;
    }
    int64_t n_faces = 1;
    for (loxo_index h = m->halfedge_twin[k_previous(incoming)]; h != incoming; h = m->halfedge_twin[k_previous(h)])
        n_faces += 1;
    if (left.n_steps > n_faces - right.n_steps) return;
    for (loxo_index h = left.h;; h = m->halfedge_twin[k_previous(h)]) {
        face = k_layout_at(m, h, length);
        send_across(s, worker, h, &face, length, h == left.h ? left.at : 0.0, h == right.h ? right.at : length[1]);
        if (h == right.h) break;
    }
}

bool exact_send_from_vertex(exact_state *s, exact_worker *worker, loxo_index vertex)
{
    const loxo_index first = s->m.vertex_halfedge[vertex];
    loxo_index h = first;
    int64_t n_faces = 0;
    if (s->distance[vertex] > s->max_distance) {
        s->known[vertex] = (uint8_t)(s->known[vertex] & ~EXACT_QUEUED);
        return true;
    }
    do {
        n_faces += 1;
        h = s->m.halfedge_twin[k_previous(h)];
    } while (h >= 0 && h != first);
    /* A boundary's two shadows may lie on each other. */
    if (!exact_has_room(s, worker, &(exact_needs){0, 2 * n_faces, 2 * n_faces, 4 * n_faces})) return false;
    s->known[vertex] = (uint8_t)(s->known[vertex] & ~EXACT_QUEUED);
    worker->n_bends += 1;
    send_into_shadow(s, worker, vertex);
    return true;
}

/* A seed that is nearer to a corner than rounding errors are large starts there, too. */
#define AT_CORNER 1e-13

static void start_at(exact_state *s, exact_worker *worker, loxo_index vertex, double distance, exact_reach reach,
                     bool is_start)
{
    const bool is_better = distance < s->distance[vertex];
    exact_judge(s, worker, &(exact_offer){distance, reach, vertex, true});
    if (!is_better || !is_start || (s->known[vertex] & EXACT_QUEUED)) return;
    s->known[vertex] |= EXACT_QUEUED;
    exact_queue(s, worker, (uint32_t)(3 * s->m.n_faces) + (uint32_t)vertex, distance);
}

loxo_status exact_send_from_seed(exact_state *s, int64_t seed)
{
    const loxo_mesh_view *m = &s->m;
    const geodesic_seed *from = &s->seeds[seed];
    const exact_origin origin = (exact_origin)(-1 - seed);
    exact_worker *worker = &s->worker[0];
    while (!exact_has_room(s, worker, &(exact_needs){0, 3, 9, 0})) {
        const loxo_status status = exact_make_room(s);
        if (status < 0) return status;
    }
    if (from->vertex >= 0) {
        start_at(s, worker, from->vertex, 0.0, (exact_reach){-1.0, 0.0, 0.0, -1, origin}, true);
        return LOXO_OK;
    }
    for (int k = 0; k < 3; ++k) {
        const loxo_index h = (loxo_index)(3 * (int64_t)from->face + k), target = m->halfedge_twin[h];
        double length[3];
        const k_layout face = k_layout_at(m, h, length);
        const double along = from->weight[(k + 1) % 3], across = from->weight[(k + 2) % 3];
        const double px = along * length[0] + across * face.x2, py = across * face.y2,
                     distance = sqrt(px * px + py * py);
        start_at(s, worker, m->halfedge_vertex[h], distance, (exact_reach){-1.0, 0.0, 0.0, k_next(h), origin},
                 !(distance > AT_CORNER * (length[0] + length[2])));
        if (target >= 0 && length[0] > 0.0)
            add(s, worker, target, &(k_window){.end = length[0], .x = length[0] - px, .y = py}, origin, 0.0);
    }
    return LOXO_OK;
}
