/* SPDX-License-Identifier: MIT
 * Inside of the extension: the curve, the nodes of a quadrature, the search for one barycenter. EXTENSION.md says why. */
#ifndef LOXO_SOLVER_BARYCENTER_EXTENSION_INTERNAL_H
#define LOXO_SOLVER_BARYCENTER_EXTENSION_INTERNAL_H

#include "kernel/variants.h"

#include <loxo/extension.h>

#define EXTENSION_MOST_D     LOXO_MOEBIUS_MOST_DIMENSIONS
#define EXTENSION_MOST_TURNS 16 /* times that a search may shift its atoms */

/* ---- extension_curve.c ---- */

/* Samples that are the same point, from sample `first` on, `n` segments; group: runs that rest at the same point. */
typedef struct extension_run {
    int64_t first, n, group;
} extension_run;

/* Segment j runs from sample j to j + 1, the last one back to sample 0. */
typedef struct extension_curve {
    int64_t n;
    int d, stride;     /* of rows: d, at least 4 */
    bool is_even;      /* all segments have one length on the circle */
    double *sample;    /* [n][d] unit vectors */
    double *angle;     /* [n + 1] ascending, the last 2 pi after the first */
    double *on_circle; /* [n][2] */
    double *row;       /* [n][2][stride]: the linear map of a segment */
    extension_run *runs;
    int64_t n_runs, n_groups;
} extension_curve;

loxo_status extension_curve_create(loxo_context *ctx, const loxo_curve *given, extension_curve *curve);
void extension_curve_destroy(loxo_context *ctx, extension_curve *curve);
/* The segment of a point of the circle. */
int64_t extension_segment_at(const extension_curve *curve, const double direction[2]);
/* The curve's point there, [d]. */
void extension_curve_at(const extension_curve *curve, const double direction[2], double *x);
/* A sample at which the curve rests for half of the harmonic measure of z or more; -1: there is none. z has this direction, and beta is
 * (1 - |z|) / (1 + |z|). mass [n_groups] is overwritten. */
int64_t extension_find_resting(const extension_curve *curve, const double direction[2], double beta, double *mass);

/* ---- extension_nodes.c ---- */

/* Nodes stand in eight parts, every eighth of them in the first; the first half has every second one. */
typedef struct extension_nodes {
    int64_t n;             /* a multiple of K_NODES */
    double *cosine, *sine; /* [n] of half the moving nodes' angles from the direction of z */
    double *x, *y;         /* [n] fixed nodes */
    double *atom;          /* [n][d] the curve there, kinks mended */
} extension_nodes;

/* Nodes as z sees them: cosine and sine of half the angle from its direction. */
typedef struct extension_seen {
    int64_t n;
    const double *cosine, *sine;
} extension_seen;

typedef struct extension_graded {
    double *cosine, *sine, *weight; /* [n] each */
} extension_graded;

loxo_status extension_nodes_create(loxo_context *ctx, const extension_curve *curve, int64_t n, extension_nodes *nodes);
void extension_nodes_destroy(loxo_context *ctx, extension_nodes *nodes);
/* Nodes as seen from a z with (1 - |z|) / (1 + |z|) = complement, as dense at the scale of the whole circle as at that of z and in between. */
void extension_grade_nodes(int64_t n, double complement, const extension_graded *out);
/* The curve at the nodes as moved by z, [n][d]. */
void extension_move_nodes(const k_variant *kernels, const extension_curve *curve, const extension_seen *nodes,
                          const double direction[2], double beta, double *atom);
/* The same, with all digits however near z is to the circle: seen from a point w of the ball near the curve's point in the direction of z. atom:
 * sigma_w of the curve's points; returns co of w, 0 where all nodes are at one point: w. */
double extension_move_nodes_near(const extension_curve *curve, const extension_seen *nodes, const double direction[2],
                                 double beta, double *atom, double *w);

/* ---- extension_search.c ---- */

typedef struct extension_search {
    /* in */
    const k_variant *kernels;
    int d;
    int64_t n;            /* atoms, in the order of extension_nodes */
    const double *atom;   /* [n][d] */
    const double *weight; /* [n], NULL: all alike */
    double *own;          /* [n][d] where atoms may be shifted to; may be atom */
    double tolerance;
    int64_t max_passes;
    /* in and out: the atoms have been shifted so; shift 0 first */
    int n_turns;
    double turn[EXTENSION_MOST_TURNS][EXTENSION_MOST_D], turn_co[EXTENSION_MOST_TURNS];
    /* out */
    double w[EXTENSION_MOST_D], co; /* as seen from outside */
    double bound, error;            /* infinite: none */
    int64_t n_passes, n_coarse_passes;
    bool is_done; /* the bound is within the tolerance, or as small as rounding lets it be */
} extension_search;

void extension_search_run(extension_search *s);

#endif
