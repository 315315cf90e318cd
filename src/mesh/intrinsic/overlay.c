/* SPDX-License-Identifier: MIT
 * Ways between an intrinsic triangulation and its surface. Which edges a line crosses follows from the crossing numbers;
 * where it crosses them, from faces unfolded along it. */
#include "mesh/intrinsic/overlay.h"

#include "mesh/intrinsic/crossings.h"
#include "mesh/intrinsic/unfold.h"

/* A surface's edge on its way over the intrinsic triangulation: it enters the face of h as number `place`, from 0, counted
 * from the start of h, of those that cross h. */
typedef struct way {
    loxo_index h;
    int64_t place;
} way;

static int64_t crossed(const loxo_mesh *mesh, loxo_index h) { return loxo_crossed(mesh->crossing[h]); }

/* On through the face. false where it ends at the corner opposite: *end is then the surface's half-edge that leaves it
 * there, back along the way. */
static bool step(const loxo_mesh *mesh, way *w, loxo_index *end)
{
    const loxo_index next = k_next(w->h), before = k_previous(w->h), *twin = mesh->view.halfedge_twin;
    const int64_t n_own = crossed(mesh, w->h), n_next = crossed(mesh, next), n_before = crossed(mesh, before);
    const int64_t n_start = loxo_cut_off(n_own, n_before, n_next);
    const int64_t n_end = loxo_from_corner(n_next, n_before, n_own);
    if (w->place < n_start) { /* around the start of h */
        w->h = twin[before];
        return true;
    }
    if (w->place < n_start + n_end) {
        const int64_t n_turns = w->place - n_start + (mesh->crossing[before] < 0 ? 1 : 0);
        *end = loxo_turn_left_by(mesh->surface->view.halfedge_twin, mesh->surface_next[before], n_turns);
        return false;
    }
    w->place += n_next - n_own; /* around its end: as far from there on either side */
    w->h = twin[next];
    return true;
}

/* The surface's half-edge that crosses h from left to right as number `place` from the start of h. */
static loxo_index find_crossing(const loxo_mesh *mesh, loxo_index h, int64_t place)
{
    way w = {h, place};
    loxo_index end = -1;
    while (step(mesh, &w, &end)) {
    }
    return end;
}

/* How the surface's half-edge s begins: the half-edge at or clockwise of it around its vertex, and its number, from 0, among those
 * that run between that and the next one; -1: they are one edge. */
static loxo_index find_start(const loxo_mesh *mesh, loxo_index s, int64_t *number)
{
    const loxo_index *surface_twin = mesh->surface->view.halfedge_twin;
    const loxo_index first = mesh->view.vertex_halfedge[mesh->surface->view.halfedge_vertex[s]];
    loxo_index h = first;
    do {
        const loxo_index next = k_next(h), before = k_previous(h);
        const int64_t n_own = mesh->crossing[h] < 0 ? 1 : 0;
        const int64_t n = n_own + loxo_from_corner(crossed(mesh, h), crossed(mesh, before), crossed(mesh, next));
        loxo_index on = mesh->surface_next[h];
        for (int64_t i = 0; i < n; ++i, on = loxo_turn_left(surface_twin, on)) {
            if (on != s) continue;
            *number = i - n_own;
            return h;
        }
        h = mesh->view.halfedge_twin[before];
    } while (h >= 0 && h != first);
    *number = -1; /* not on a whole overlay */
    return first;
}

/* Across the side opposite the start of h, as that number. */
static way enter(const loxo_mesh *mesh, loxo_index h, int64_t number)
{
    const loxo_index next = k_next(h);
    const int64_t n_next = crossed(mesh, next);
    const int64_t n_end = loxo_cut_off(crossed(mesh, h), n_next, crossed(mesh, k_previous(h)));
    return (way){mesh->view.halfedge_twin[next], n_next - 1 - (n_end + number)};
}

static const loxo_point origin = {0.0, 0.0};

/* Where a line of the other side begins and leads, in the plane in which `start` lies along the x-axis from the origin. */
typedef struct direction {
    loxo_index start;
    loxo_point to;
} direction;

/* The face beyond the side of f through which the surface's edge crosses: that of w's half-edge. */
static loxo_placed_face follow(const loxo_side *side, loxo_placed_face f, loxo_index entered)
{
    for (int i = 0; i < 2 && side->m->halfedge_twin[f.h] != entered; ++i)
        f = loxo_see_next(f);
    return f;
}

/* Of the surface's half-edge s on the intrinsic side. With a sink the line is walked once more, to tell its crossings. */
static direction direction_of_surface_edge(const loxo_mesh *mesh, loxo_index s, loxo_crossing_fn sink, void *user)
{
    const loxo_side side = loxo_side_of_mesh(mesh);
    int64_t number;
    direction d = {.start = find_start(mesh, s, &number)};
    if (number < 0) {
        d.to = loxo_place_at_origin(&side, d.start).end;
        return d;
    }
    for (int pass = 0; pass < (sink != NULL ? 2 : 1); ++pass) {
        way w = enter(mesh, d.start, number);
        loxo_placed_face f = loxo_see_next(loxo_place_at_origin(&side, d.start));
        loxo_index end;
        bool goes_on = true;
        while (goes_on) {
            if (pass == 1) sink(user, (loxo_edge_point){f.h, loxo_share_of_crossing(&f, origin, d.to)});
            f = loxo_unfold_across(&side, &f);
            goes_on = step(mesh, &w, &end);
            if (goes_on) f = follow(&side, loxo_see_next(f), w.h);
        }
        d.to = f.third;
    }
    return d;
}

/* Of the intrinsic half-edge h on the surface. crossing, [n] out, NULL: not wanted. */
static direction direction_of_edge(const loxo_mesh *mesh, loxo_index h, loxo_edge_point *crossing)
{
    const loxo_side side = loxo_side_of_surface(mesh);
    const int64_t n = crossed(mesh, h);
    loxo_placed_face f = {.h = -1};
    direction d = {.start = mesh->surface_next[h]};
    if (n == 0) {
        d.to = loxo_place_at_origin(&side, d.start).end;
        return d;
    }
    for (int64_t i = 0; i < n; ++i) { /* over surface half-edge `over`, from the face on its right */
        const loxo_index over = find_crossing(mesh, h, i), leaving = side.m->halfedge_twin[over];
        if (i == 0) {
            d.start = k_previous(leaving);
            f = loxo_place_at_origin(&side, d.start);
        }
        f = follow(&side, loxo_see_next(f), over);
        if (crossing != NULL) crossing[i].halfedge = leaving;
        f = loxo_unfold_across(&side, &f);
    }
    d.to = f.third;
    if (crossing == NULL) return d;
    f = loxo_place_at_origin(&side, d.start);
    for (int64_t i = 0; i < n; ++i) {
        f = follow(&side, loxo_see_next(f), side.m->halfedge_twin[crossing[i].halfedge]);
        crossing[i].share = loxo_share_of_crossing(&f, origin, d.to);
        f = loxo_unfold_across(&side, &f);
    }
    return d;
}

static double norm(loxo_point p) { return sqrt(p.x * p.x + p.y * p.y); }

double loxo_trace_edge(const loxo_mesh *mesh, loxo_index h, loxo_edge_point *crossing)
{
    return norm(direction_of_edge(mesh, h, crossing).to);
}

double loxo_trace_surface_edge(const loxo_mesh *mesh, loxo_index h, loxo_crossing_fn sink, void *user)
{
    return norm(direction_of_surface_edge(mesh, h, sink, user).to);
}

/* ---- points and segments ------------------------------------------------------------------------------------- */

/* The corner of a point's face that has the most of it, as the half-edge that starts there. */
static loxo_index nearest_corner(const loxo_face_point *p)
{
    const double *w = p->weight;
    const int k = w[0] >= w[1] && w[0] >= w[2] ? 0 : w[1] >= w[2] ? 1 : 2;
    return (loxo_index)(3 * p->face + k);
}

static loxo_point place_of(const loxo_placed_face *f, const loxo_face_point *p)
{
    const double b = p->weight[(f->h + 1) % 3], c = p->weight[(f->h + 2) % 3];
    const double a = p->weight[f->h % 3];
    return (loxo_point){a * f->start.x + b * f->end.x + c * f->third.x, a * f->start.y + b * f->end.y + c * f->third.y};
}

/* Turned by an angle around the origin. */
static loxo_point turned(loxo_point p, double angle)
{
    const double c = cos(angle), s = sin(angle);
    return (loxo_point){c * p.x - s * p.y, s * p.x + c * p.y};
}

/* The face on the other side into which the way to p, a place in the face of a corner, leads from that corner, whose
 * half-edge begins and leads there as `d` says. *turn receives the angle by which places in that corner's face are to be turned
 * there. */
static loxo_placed_face face_towards(const loxo_side *other, const direction *d, loxo_point p, double *turn)
{
    const double own = atan2(p.y, p.x);
    double angle = atan2(d->to.y, d->to.x) + own;
    const loxo_placed_face f = loxo_turn_around(other, d->start, &angle);
    *turn = angle - own;
    return f;
}

static loxo_face_point carry(const loxo_side *own, const loxo_side *other, loxo_index corner, const direction *d,
                             const loxo_face_point *point)
{
    const loxo_placed_face here = loxo_place_at_origin(own, corner);
    const loxo_point p = place_of(&here, point);
    double turn;
    const loxo_placed_face first = face_towards(other, d, p, &turn);
    const loxo_placed_face there = loxo_walk(other, first, origin, turned(p, turn), NULL, NULL);
    return loxo_point_in(&there, turned(p, turn));
}

/* A corner of one side is one of the other. */
static bool is_corner(const loxo_side *own, const loxo_side *other, loxo_index corner, const loxo_face_point *point,
                      loxo_face_point *result)
{
    if (point->weight[corner % 3] < 1.0) return false;
    const loxo_index h = other->m->vertex_halfedge[own->m->halfedge_vertex[corner]];
    *result = (loxo_face_point){.face = (loxo_index)k_face_of(h)};
    result->weight[h % 3] = 1.0;
    return true;
}

loxo_face_point loxo_to_intrinsic(const loxo_mesh *mesh, const loxo_face_point *on_surface)
{
    const loxo_side own = loxo_side_of_surface(mesh), other = loxo_side_of_mesh(mesh);
    const loxo_index corner = nearest_corner(on_surface);
    loxo_face_point result;
    if (is_corner(&own, &other, corner, on_surface, &result)) return result;
    const direction d = direction_of_surface_edge(mesh, corner, NULL, NULL);
    return carry(&own, &other, corner, &d, on_surface);
}

loxo_face_point loxo_to_surface(const loxo_mesh *mesh, const loxo_face_point *on_mesh)
{
    const loxo_side own = loxo_side_of_mesh(mesh), other = loxo_side_of_surface(mesh);
    const loxo_index corner = nearest_corner(on_mesh);
    loxo_face_point result;
    if (is_corner(&own, &other, corner, on_mesh, &result)) return result;
    const direction d = direction_of_edge(mesh, corner, NULL);
    return carry(&own, &other, corner, &d, on_mesh);
}

void loxo_trace_segment(const loxo_mesh *mesh, const loxo_face_point *from, const loxo_face_point *to,
                        loxo_crossing_fn sink, void *user, loxo_face_point ends[2])
{
    const loxo_side own = loxo_side_of_mesh(mesh), other = loxo_side_of_surface(mesh);
    const loxo_index corner = nearest_corner(from);
    const loxo_placed_face here = loxo_place_at_origin(&own, corner);
    const direction d = direction_of_edge(mesh, corner, NULL);
    const loxo_point a = place_of(&here, from), b = place_of(&here, to);
    const bool is_at_corner = a.x == 0.0 && a.y == 0.0;
    double turn;
    loxo_placed_face there = face_towards(&other, &d, is_at_corner ? b : a, &turn);
    const loxo_point start = turned(a, turn), end = turned(b, turn);
    if (!is_at_corner) there = loxo_walk(&other, there, origin, start, NULL, NULL);
    if (ends != NULL) ends[0] = loxo_point_in(&there, start);
    there = loxo_walk(&other, there, start, end, sink, user);
    if (ends != NULL) ends[1] = loxo_point_in(&there, end);
}
