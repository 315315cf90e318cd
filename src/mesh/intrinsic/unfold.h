/* SPDX-License-Identifier: MIT
 * Faces unfolded one after the other into one plane, along a line that crosses them. */
#ifndef LOXO_MESH_INTRINSIC_UNFOLD_H
#define LOXO_MESH_INTRINSIC_UNFOLD_H

#include "kernel/layout_kernel.h"
#include "mesh/intrinsic/overlay.h"

/* One of the two triangulations. */
typedef struct loxo_side {
    const loxo_mesh_view *m;
    double lengthened; /* added to every edge of the view */
} loxo_side;

static inline loxo_side loxo_side_of_mesh(const loxo_mesh *mesh) { return (loxo_side){&mesh->view, 0.0}; }

static inline loxo_side loxo_side_of_surface(const loxo_mesh *mesh)
{
    return (loxo_side){&mesh->surface->view, mesh->lengthened};
}

typedef struct loxo_point {
    double x, y;
} loxo_point;

static inline double loxo_turn(loxo_point a, loxo_point b) { return a.x * b.y - a.y * b.x; }
static inline loxo_point loxo_minus(loxo_point a, loxo_point b) { return (loxo_point){a.x - b.x, a.y - b.y}; }

/* A face in the plane, counter-clockwise, seen from its half-edge h, which runs from `start` to `end`. */
typedef struct loxo_placed_face {
    loxo_index h;
    loxo_point start, end, third;
} loxo_placed_face;

/* Lengths of h and of the two half-edges behind it. */
void loxo_lengths_from(const loxo_side *side, loxo_index h, double length[3]);
/* The face of h with the start of h at the origin and h along the x-axis. */
loxo_placed_face loxo_place_at_origin(const loxo_side *side, loxo_index h);
/* The same face seen from the next half-edge. */
static inline loxo_placed_face loxo_see_next(loxo_placed_face f)
{
    return (loxo_placed_face){k_next(f.h), f.end, f.third, f.start};
}
/* The face beyond half-edge h of f, which has a twin, seen from that twin. */
loxo_placed_face loxo_unfold_across(const loxo_side *side, const loxo_placed_face *f);
/* Share of h, from its start, where the line from a to b crosses it; 0 to 1. */
double loxo_share_of_crossing(const loxo_placed_face *f, loxo_point a, loxo_point b);
/* Angle between h and the half-edge before it. */
double loxo_corner_angle(const loxo_side *side, loxo_index h);

/* Goes from `from`, in face f, straight to `to`, unfolding faces; ends in the face that `to` is in, or at the boundary
 * before it. Crossings go to sink, which may be NULL. */
loxo_placed_face loxo_walk(const loxo_side *side, loxo_placed_face f, loxo_point from, loxo_point to,
                           loxo_crossing_fn sink, void *user);
/* Turns from half-edge h by an angle around its start, and gives the face there, seen from its half-edge that leaves that
 * vertex, which stands at the origin with that half-edge along the x-axis; *angle is what is left of it. */
loxo_placed_face loxo_turn_around(const loxo_side *side, loxo_index h, double *angle);
loxo_face_point loxo_point_in(const loxo_placed_face *f, loxo_point p);

#endif
