/* SPDX-License-Identifier: MIT
 * Polygons with given edge lengths, in R^d, 2 <= d <= 64: closing open ones, and random closed ones.
 *
 * An open polygon's edge directions are points of the sphere, weighted with the edges' lengths. The Moebius map that takes their conformal
 * barycenter to the centre makes their weighted sum 0: a closed polygon of the same edge lengths, unique up to a rotation.
 *
 * source  Cantarella, Schumacher 2022, Computing the conformal barycenter, sections 1 and 6.2; after Kapovich, Millson 1996 */
#ifndef LOXO_POLYGON_H
#define LOXO_POLYGON_H

#include <loxo/moebius.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum loxo_polygon_form {
    LOXO_POLYGON_VERTICES,  /* [n_edges + 1][d] of the open polygon, the first one to the last one */
    LOXO_POLYGON_EDGES,     /* [n_edges][d], from each vertex to the next */
    LOXO_POLYGON_DIRECTIONS /* [n_edges][d] unit vectors within 1e-6; lengths apart */
} loxo_polygon_form;

/* A batch of polygons with as many edges each; the caller's. */
typedef struct loxo_polygons {
    int64_t n_polygons, n_edges;
    int d;
    loxo_polygon_form form;
    const double *x;      /* [n_polygons][n_edges + 1 or n_edges][d] */
    const double *length; /* [n_edges] > 0, of LOXO_POLYGON_DIRECTIONS; NULL: all 1 */
} loxo_polygons;

typedef enum loxo_polygon_state {
    LOXO_POLYGON_CLOSED,
    LOXO_POLYGON_LOOSE, /* closed as far as doubles or max_iterations go; the tolerance was not met */
    LOXO_POLYGON_FLAT,  /* two directions with half of the length each: closed to and fro on a line; not unique */
    LOXO_POLYGON_CANNOT, /* an edge, or edges of one direction, with half of the length or more: cannot be closed; as given */
    LOXO_POLYGON_BAD, /* numbers that are not finite, directions that are none, no length at all; zeros */
    LOXO_POLYGON_LEFT /* not looked at: the monitor stopped before; untouched */
} loxo_polygon_state;

LOXO_API const char *loxo_polygon_state_name(loxo_polygon_state state);

/* Of one polygon. */
typedef struct loxo_polygon_report {
    loxo_polygon_state state;
    double length; /* of all edges */
    double
        gap; /* length of the closed polygon's edges' sum, as they are in doubles; of what is not closed the open gap */
    double bound; /* certified hyperbolic distance of the directions' barycenter from the centre; infinite: none */
    double co;    /* 1 - |w|^2 of the barycenter of the open polygon; 0: none */
} loxo_polygon_report;

typedef struct loxo_polygon_settings {
    double tolerance; /* of the certified hyperbolic distance; 0: as far as doubles go */
    int64_t max_iterations;
    bool edges; /* write edges, not vertices */
} loxo_polygon_settings;

LOXO_API loxo_polygon_settings loxo_polygon_settings_default(void);

typedef struct loxo_polygon_info {
    int64_t n_closed, n_loose, n_flat, n_cannot, n_bad, n_left;
    int64_t first_failed; /* the first polygon that is cannot or bad; -1: none */
    int64_t n_alone;      /* that were closed one by one, not side by side */
    double gap_max;       /* of those closed, over their lengths */
    double bound_max;
    double total_s;
    size_t peak_bytes; /* of the context */
} loxo_polygon_info;

/* Closes a batch of polygons: edges keep their lengths, and their directions are shifted.
 *   settings   NULL: the defaults
 *   out        [n_polygons][n_edges][d]: vertices, of which the first is the given one (0 where edges or directions are given); edge k goes
 *              from vertex k to the next, the last one back to the first. With settings.edges: edges. Not to overlap x.
 *              NULL: only barycenters are wanted; report[].gap then is of no use
 *   report     [n_polygons] out, may be NULL
 *   w          [n_polygons][d] out, may be NULL: the barycenters; 0 where there is none
 *   info       out, may be NULL
 * returns      LOXO_OK; LOXO_NOT_CONVERGED: some are loose; LOXO_CHECK_FAILED: some cannot or are bad; LOXO_STOPPED;
 *              LOXO_ERR_ARGUMENT: no polygons, nothing to write to, fewer than 1 edge, d, a length or a setting out of its range; LOXO_ERR_LIMIT;
 *              LOXO_ERR_MEMORY: out is untouched
 * accuracy     edge lengths to 4 ulp of the size of the positions; sums are compensated: the gap is rounding of the edges
 * cost         in the plane and in space up to 2048 edges: 8 polygons side by side on each thread, n_edges * 256 bytes of buffer a
 *              thread, 2 to 4 ns an edge; else one after the other, n_edges * (d + 1) * 16 bytes. Fastest where x and out are aligned to 64
 *              bytes. Same bits for any number of threads and instruction set */
LOXO_API loxo_status loxo_polygon_close(loxo_context *ctx, const loxo_polygons *polygons,
                                        const loxo_polygon_settings *settings, double *out, loxo_polygon_report *report,
                                        double *w, loxo_polygon_info *info);

/* What random closed polygons are uniform in. */
typedef enum loxo_polygon_measure {
    LOXO_POLYGON_WALKS, /* random walks of independent uniform directions, on condition that they close; up to rotations in space the symplectic
                           volume of Kapovich and Millson's polygon space */
    LOXO_POLYGON_VOLUME /* volume of the set of closed polygons in the product of the edges' spheres */
} loxo_polygon_measure;

typedef struct loxo_polygon_sample_settings {
    uint64_t seed;
    loxo_polygon_measure measure; /* that the weights lead to */
    double tolerance;             /* as of closing */
    int64_t max_iterations;
    bool edges;
} loxo_polygon_sample_settings;

LOXO_API loxo_polygon_sample_settings loxo_polygon_sample_settings_default(void);

/* Random closed polygons of given edge lengths: open ones of independent uniform directions, closed. What comes out is not uniform; weights make
 * it so: the mean of exp(log_weight) f over polygons, over the mean of exp(log_weight), tends to the mean of f over the measure. The mean of
 * exp(log_weight) of LOXO_POLYGON_WALKS tends to the density at 0 of the sum of edges of independent directions.
 * Polygon number i is drawn from seed and i alone: a stream may be taken in pieces of any size.
 *   first      number of the first polygon of this call, >= 0
 *   n_edges    >= 3
 *   length     [n_edges] > 0; NULL: all 1. No edge may have half of the length or more
 *   out        [n_polygons][n_edges][d] out, as of loxo_polygon_close, vertex 0 in 0
 *   log_weight [n_polygons] out, may be NULL; -infinity for a polygon that could not be closed
 *   info       out, may be NULL
 * returns      as loxo_polygon_close; LOXO_ERR_ARGUMENT: an edge too long, too
 * cost         as closing, and some 10 ns an edge; same bits for any number of threads and instruction set, and of calls
 * source       after Cantarella, Schumacher 2023, CoBarS: Fast reweighted sampling for polygon spaces in any dimension; the weights are derived in
 *              src/solver/barycenter/README.md */
LOXO_API loxo_status loxo_polygon_sample(loxo_context *ctx, const loxo_polygon_sample_settings *settings, int64_t first,
                                         int64_t n_polygons, int64_t n_edges, int d, const double *length, double *out,
                                         double *log_weight, loxo_polygon_info *info);

#ifdef __cplusplus
}
#endif
#endif
