/* SPDX-License-Identifier: MIT
 * What Figures 6 and 7 of Cantarella and Schumacher share: a closed curve on the sphere, a disk, and a surface over it. */
#ifndef LOXO_BENCH_PAPER_SURFACE_H
#define LOXO_BENCH_PAPER_SURFACE_H

#include "paper.h"

/* A point of the curve: great arcs between corners, by the rule of loxo/extension.h. x: on the unit circle. */
void paper_curve_at(const double x[2], double out[3]);
/* A node of equal weight moved with z: the circle's shift that takes the centre to z. */
void paper_move_node(const double z[2], const double node[2], double out[2]);

typedef struct paper_surface {
    bench *b;
    loxo_soup soup; /* a disk in the plane */
    int64_t n;      /* of its vertices */
    double (*z)[2]; /* those */
    double (*w)[3]; /* where they go */
    double *value;  /* what is painted on them */
} paper_surface;

loxo_status paper_surface_open(bench *b, double n_wanted, paper_surface *s);
void paper_surface_close(paper_surface *s);
/* A picture of the surface painted with the values, as paper_plot. */
loxo_status paper_surface_draw(const paper_surface *s, const char *suffix, const char *title, const char *unit);

#endif
