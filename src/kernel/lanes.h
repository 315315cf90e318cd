/* SPDX-License-Identifier: MIT
 * Eight polygons that are closed side by side, or eight pieces of one, as lane_kernel.h does it. */
#ifndef LOXO_KERNEL_LANES_H
#define LOXO_KERNEL_LANES_H

#include <stdbool.h>
#include <stdint.h>

#define K_LANES 8

/* What the numbers of a polygon are. */
typedef enum k_lane_form {
    K_LANE_VERTICES,  /* [n + 1][d] of an open polygon */
    K_LANE_EDGES,     /* [n][d] */
    K_LANE_DIRECTIONS /* [n][d] unit vectors to 1e-6; lengths apart */
} k_lane_form;

typedef struct k_lanes {
    /* in */
    k_lane_form form;
    int d; /* 2 or 3 */
    int64_t n;
    const double *x[K_LANES];
    const double *length[K_LANES]; /* [n] of K_LANE_DIRECTIONS; NULL, all of them: 1 */
    double tolerance;              /* of the certified distance; 0: as far as doubles go */
    double *buffer;                /* [n][d + 1][K_LANES] */
    double start[K_LANES][3];      /* vertex 0 of what is written */
    double fix[3];                 /* of one polygon in all lanes: see k_lane_writer */
    double *out[K_LANES];          /* [n][d]; NULL: of this lane nothing is written */
    bool as_edges;                 /* written are edges, not vertices */
    bool log_stretch;              /* is wanted */
    bool is_far;                   /* x comes from memory, not from a cache */
    bool streams;                  /* out is written past the caches; all of it starts at 64 aligned bytes */
    /* out */
    bool is_done
        [K_LANES]; /* else: leave it to the way that does not mind where the barycenter lies; nothing was written */
    int n_passes;
    double w[K_LANES][3], co[K_LANES], bound[K_LANES]; /* barycenter, 1 - |w|^2, certified distance */
    double total[K_LANES];                             /* length of the polygon */
    double gap[K_LANES];     /* length of the sum of the closed polygon's edges; where it was written */
    double stretch[K_LANES]; /* sum of log |x - w|^2 */
    double sum[K_LANES][3];  /* of edges, of k_lanes_last */
} k_lanes;

/* For one polygon whose pieces stand in the lanes: sums of the lanes, in the order weight; p v; p v v^T but its last entry. */
typedef double k_lane_table[9][K_LANES];

/* A point of the search for one polygon. */
typedef struct k_lane_point {
    double w[3], co, bound, left;
    bool is_done, is_tried, is_over;
} k_lane_point;

#endif
