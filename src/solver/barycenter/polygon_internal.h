/* SPDX-License-Identifier: MIT
 * What closing and sampling share. */
#ifndef LOXO_SOLVER_POLYGON_INTERNAL_H
#define LOXO_SOLVER_POLYGON_INTERNAL_H

#include "kernel/lanes.h"

#include <loxo/polygon.h>

#define POLYGON_MOST_LANE_EDGES 2048 /* beyond, buffers leave the cache, and one polygon is enough to fill vectors */

/* Room for one polygon at a time. */
typedef struct polygon_room {
    double *x;      /* [n][d] directions */
    double *length; /* [n] */
} polygon_room;

/* polygon_alone.c: one polygon of any size and dimension. p: its number. out [n][d]; w [d] or NULL. log_factor, or NULL: sum over the edges
 * of the log of the map's factor at their directions. */
loxo_status polygon_close_alone(loxo_context *ctx, const loxo_polygons *polygons, int64_t p,
                                const loxo_polygon_settings *settings, polygon_room *room, double *out,
                                loxo_polygon_report *report, double *w, double *log_factor);

/* polygon.c: loxo_polygon_close with that. */
loxo_status polygon_close_batch(loxo_context *ctx, const loxo_polygons *polygons, const loxo_polygon_settings *settings,
                                double *out, loxo_polygon_report *report, double *w, double *log_factor,
                                loxo_polygon_info *info);

/* Where the numbers of a polygon begin. */
static inline const double *polygon_at(const loxo_polygons *p, int64_t i)
{
    return p->x + i * (p->n_edges + (p->form == LOXO_POLYGON_VERTICES ? 1 : 0)) * p->d;
}

static inline bool polygon_fits_lanes(const loxo_polygons *p)
{
    return p->d <= 3 && p->n_edges <= POLYGON_MOST_LANE_EDGES;
}

#endif
