/* SPDX-License-Identifier: MIT */
#include "mesh/intrinsic/unfold.h"

void loxo_lengths_from(const loxo_side *side, loxo_index h, double length[3])
{
    double own[3];
    k_face_lengths(side->m, k_face_of(h), own);
    for (int k = 0; k < 3; ++k)
        length[k] = own[(h % 3 + k) % 3] + side->lengthened;
}

loxo_placed_face loxo_place_at_origin(const loxo_side *side, loxo_index h)
{
    double length[3];
    loxo_lengths_from(side, h, length);
    const k_layout face = k_layout_of(length);
    return (loxo_placed_face){h, {0.0, 0.0}, {face.x1, 0.0}, {face.x2, face.y2}};
}

loxo_placed_face loxo_unfold_across(const loxo_side *side, const loxo_placed_face *f)
{
    const loxo_index twin = side->m->halfedge_twin[f->h];
    const loxo_placed_face flat = loxo_place_at_origin(side, twin);
    const loxo_point along = loxo_minus(f->start, f->end);
    const double length = sqrt(along.x * along.x + along.y * along.y);
    const loxo_point u = {length > 0.0 ? along.x / length : 1.0, length > 0.0 ? along.y / length : 0.0};
    const loxo_point third = {f->end.x + flat.third.x * u.x - flat.third.y * u.y,
                              f->end.y + flat.third.x * u.y + flat.third.y * u.x};
    return (loxo_placed_face){twin, f->end, f->start, third};
}

double loxo_share_of_crossing(const loxo_placed_face *f, loxo_point a, loxo_point b)
{
    const loxo_point line = loxo_minus(b, a);
    const double right = -loxo_turn(line, loxo_minus(f->start, a)), left = loxo_turn(line, loxo_minus(f->end, a));
    if (!(right > 0.0)) return 0.0; /* the line runs through an end, as far as rounding tells */
    if (!(left > 0.0)) return 1.0;
    return right / (right + left);
}

double loxo_corner_angle(const loxo_side *side, loxo_index h)
{
    const loxo_placed_face f = loxo_place_at_origin(side, h);
    return atan2(f.third.y, f.third.x);
}

/* Whether p lies beyond half-edge h of f. */
static bool is_beyond(const loxo_placed_face *f, loxo_point p)
{
    return loxo_turn(loxo_minus(f->end, f->start), loxo_minus(p, f->start)) < 0.0;
}

/* Turns f to the side through which the way from `from`, in it, to `to` leaves it. Where `to` lies beyond two sides, the
 * corner between them decides; rounding may choose either where the way runs through that corner. false: `to` is in f. */
static bool find_exit(loxo_placed_face *f, loxo_point from, loxo_point to)
{
    const loxo_placed_face next = loxo_see_next(*f), side[3] = {*f, next, loxo_see_next(next)};
    const bool is_out[3] = {is_beyond(&side[0], to), is_beyond(&side[1], to), is_beyond(&side[2], to)};
    for (int i = 0; i < 3; ++i) {
        if (!is_out[i] || is_out[(i + 2) % 3]) continue; /* the first of them, counter-clockwise */
        const bool is_corner_right = loxo_turn(loxo_minus(to, from), loxo_minus(side[i].end, from)) <= 0.0;
        *f = is_corner_right && is_out[(i + 1) % 3] ? side[(i + 1) % 3] : side[i];
        return true;
    }
    return false;
}

loxo_placed_face loxo_walk(const loxo_side *side, loxo_placed_face f, loxo_point from, loxo_point to,
                           loxo_crossing_fn sink, void *user)
{
    if (!find_exit(&f, from, to)) return f;
    /* Of the two sides beyond, the line takes the one between the new corner and the old end on the other side of it. A
     * straight line meets each face of a chain once; the bound is for lengths that are no surface's. */
    for (int64_t n = 0; n < 3 * side->m->n_faces && side->m->halfedge_twin[f.h] >= 0 && is_beyond(&f, to); ++n) {
        if (sink != NULL) sink(user, (loxo_edge_point){f.h, loxo_share_of_crossing(&f, from, to)});
        f = loxo_see_next(loxo_unfold_across(side, &f)); /* from the old start to the new corner */
        if (loxo_turn(loxo_minus(f.end, from), loxo_minus(to, from)) > 0.0) f = loxo_see_next(f);
    }
    return f;
}

loxo_placed_face loxo_turn_around(const loxo_side *side, loxo_index h, double *angle)
{
    const loxo_index *twin = side->m->halfedge_twin;
    double corner = loxo_corner_angle(side, h);
    while (*angle > corner && twin[k_previous(h)] >= 0) {
        *angle -= corner;
        h = twin[k_previous(h)];
        corner = loxo_corner_angle(side, h);
    }
    if (*angle > corner) *angle = corner; /* the boundary */
    return loxo_place_at_origin(side, h);
}

loxo_face_point loxo_point_in(const loxo_placed_face *f, loxo_point p)
{
    const loxo_point a = loxo_minus(f->start, p), b = loxo_minus(f->end, p), c = loxo_minus(f->third, p);
    const double weight[3] = {fmax(loxo_turn(b, c), 0.0), fmax(loxo_turn(c, a), 0.0), fmax(loxo_turn(a, b), 0.0)};
    const double sum = weight[0] + weight[1] + weight[2];
    loxo_face_point point = {.face = (loxo_index)k_face_of(f->h)};
    for (int k = 0; k < 3; ++k)
        point.weight[(f->h % 3 + k) % 3] = sum > 0.0 ? weight[k] / sum : k == 0 ? 1.0 : 0.0;
    return point;
}
