/* SPDX-License-Identifier: MIT
 * Inside of the geodesic solver: what is done for every method alike. */
#ifndef LOXO_SOLVER_GEODESIC_INTERNAL_H
#define LOXO_SOLVER_GEODESIC_INTERNAL_H

#include "solver/geodesic/engine.h"

struct loxo_geodesic {
    geodesic_problem problem;
    const geodesic_engine *engine;
    void *state;
    double *distance; /* [n_vertices] of the last solve, in the mesh's order; in the engine's room where it has one */
    double *own_distance; /* else here */
    loxo_index *nearest;  /* [n_vertices] with settings.nearest, else NULL */
    geodesic_seed *seeds; /* [n_seeds] of the last solve */
    int64_t n_seeds;
    double prepare_s;
    bool is_solved; /* distance and nearest are those of a solve */
};

/* sources.c: the caller's sources as seeds, in a new array that the caller releases. Of a vertex that a repair has split
 * every copy is a seed. LOXO_ERR_ARGUMENT, LOXO_ERR_MESH with the element. */
loxo_status geodesic_seeds_from_vertices(const geodesic_problem *problem, const loxo_index *sources, int64_t n_sources,
                                         geodesic_seed **seeds, int64_t *n_seeds);
/* A point with a repaired edge may be several. LOXO_ERR_ARGUMENT: with the number of the point. */
loxo_status geodesic_seeds_from_points(const geodesic_problem *problem, const loxo_surface_point *points,
                                       int64_t n_points, geodesic_seed **seeds, int64_t *n_seeds);
/* The same of each point by itself: those of point i are begin[i] .. begin[i + 1] - 1. begin [n_points + 1] is new, too. Where
 * no faces are needed a vertex without them has no seed. */
loxo_status geodesic_seeds_by_point(const geodesic_problem *problem, const loxo_surface_point *points, int64_t n_points,
                                    bool needs_faces, geodesic_seed **seeds, int64_t **begin);

/* check.c: looks at distances in the mesh's order, at those of a list of vertices, or of all (NULL). LOXO_ERR_NUMERIC: one
 * is not a number. */
loxo_status geodesic_check(const geodesic_problem *problem, const double *distance, const loxo_index *vertices,
                           int64_t n_vertices, loxo_geodesic_info *info);

/* settings.c: the methods (bit 1 << method) that look at every setting that is not its default. */
uint32_t geodesic_methods_of(const loxo_geodesic_settings *settings);

#endif
