/* SPDX-License-Identifier: MIT
 * What closing and sampling share. */
#ifndef LOXO_SOLVER_POLYGON_INTERNAL_H
#define LOXO_SOLVER_POLYGON_INTERNAL_H

#include "kernel/variants.h"

#include <loxo/polygon.h>

#define POLYGON_MOST_LANE_EDGES 2048 /* beyond, buffers leave the cache, and one polygon is enough to fill vectors */
#define POLYGON_FAR             ((int64_t)1 << 22) /* numbers of a batch that come from memory and go there */

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

/* polygon_large.c: one polygon of many edges in the plane or in space. false: it cannot be done so; out is then of no use. buffer: [n_edges][d + 1]; chunk: of polygon_n_chunks, polygon_chunk_bytes each. */
struct polygon_chunk;
int64_t polygon_n_chunks(int64_t n_edges);
size_t polygon_chunk_bytes(void);
bool polygon_close_large(loxo_context *ctx, const loxo_polygons *polygons, int64_t p,
                         const loxo_polygon_settings *settings, const k_variant *kernels, double *buffer,
                         struct polygon_chunk *chunk, double *out, loxo_polygon_report *report, double *w,
                         double *log_factor);

/* Where the numbers of a polygon begin. */
static inline const double *polygon_at(const loxo_polygons *p, int64_t i)
{
    return p->x + i * (p->n_edges + (p->form == LOXO_POLYGON_VERTICES ? 1 : 0)) * p->d;
}

static inline bool polygon_is_large(const loxo_polygons *p)
{
    return p->d <= 3 && p->n_edges > POLYGON_MOST_LANE_EDGES;
}

/* More than caches hold: what is read next is asked for early, and what is written goes past them. */
static inline bool polygon_is_far(const loxo_polygons *p) { return p->n_polygons > POLYGON_FAR / (p->n_edges * p->d); }

static inline bool polygon_is_aligned(const double *row) { return (uintptr_t)row % 64 == 0; }

static inline bool polygon_fits_lanes(const loxo_polygons *p)
{
    return p->d <= 3 && p->n_edges <= POLYGON_MOST_LANE_EDGES;
}

#endif
