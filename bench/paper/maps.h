/* SPDX-License-Identifier: MIT
 * Maps to the sphere for tables and figures: made by a method, measured as they are and after they were centred. */
#ifndef LOXO_BENCH_PAPER_MAPS_H
#define LOXO_BENCH_PAPER_MAPS_H

#include "paper.h"

/* What the monitor heard of an optimiser, point by point. */
#define PAPER_MAP_MOST_POINTS 512
typedef struct paper_map_curve {
    int n;
    double step[PAPER_MAP_MOST_POINTS], energy[PAPER_MAP_MOST_POINTS], gradient[PAPER_MAP_MOST_POINTS],
        move[PAPER_MAP_MOST_POINTS]; /* of (4.4), by which the point was reached; NaN of the first */
} paper_map_curve;

typedef struct paper_map {
    bench *b;
    double *map;        /* [n][3] as the method left it; NULL: it gave none */
    loxo_status status; /* of the solve */
    loxo_sphere_info info;
    loxo_sphere_map_measure raw, centred;
} paper_map;

/* Settings of a row: neither unfolded nor centred. */
loxo_sphere_settings paper_map_settings(loxo_sphere_method method, loxo_sphere_start start);
/* Makes the map and measures it. A solve is stopped after --solve-seconds, and its map then is what is measured. A method that fails on this
 * mesh, or that this build lacks, is no failure of the table: map->status tells.
 *   curve   may be NULL */
loxo_status paper_map_make(paper_subject *s, const loxo_sphere_settings *settings, paper_map_curve *curve,
                           paper_map *map);
void paper_map_close(paper_map *map);
/* "", or the status' name. */
const char *paper_map_note(const paper_map *map);

/* The paper's models that stand in for its own: a name of paper_models, and the paper's name and size. n_printed 0 ends them. */
typedef struct paper_map_model {
    const char *name, *printed_name;
    int n_printed;
} paper_map_model;
extern const paper_map_model paper_map_models[];

#endif
