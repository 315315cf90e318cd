/* SPDX-License-Identifier: MIT
 * Inside of registration. Arrays are in the caller's order, as the landmarks are. */
#ifndef LOXO_SOLVER_SPHERE_REGISTER_INTERNAL_H
#define LOXO_SOLVER_SPHERE_REGISTER_INTERNAL_H

#include <loxo/register.h>

/* A surface with its map and its landmarks. */
typedef struct register_side {
    loxo_context *ctx;
    const loxo_landmarks *landmarks; /* located */
    int64_t n_vertices;
    const double *position; /* [n_vertices][3] */
    const double *map;      /* [n_vertices][3] */
    const loxo_sphere_locator *locator;
} register_side;

/* Points of the two surfaces that correspond. */
typedef struct register_pairs {
    int64_t n, n_curves, n_unpaired;
    loxo_surface_point *fixed, *moving; /* [n] */
} register_pairs;

/* Pairs curves by name and cuts them to the same number of points. pairs: freed by register_pairs_destroy, after a failure too.
 * LOXO_OK, LOXO_ERR_ARGUMENT, LOXO_ERR_MEMORY, LOXO_ERR_STOPPED. */
loxo_status register_pair(const register_side *fixed, const register_side *moving, int64_t n_samples,
                          register_pairs *pairs);
void register_pairs_destroy(loxo_context *ctx, register_pairs *pairs);

/* Positions of a mesh's vertices, [n][3] from loxo_allocate; of a vertex that a repair has split, its first copy's. NULL: no memory. */
double *register_positions(loxo_context *ctx, const loxo_mesh *mesh, const loxo_index *order);

#endif
