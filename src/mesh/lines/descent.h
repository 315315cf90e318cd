/* SPDX-License-Identifier: MIT
 * Ways down a field of distances: from a point of the surface to one of the points that the distances are from. */
#ifndef LOXO_MESH_LINES_DESCENT_H
#define LOXO_MESH_LINES_DESCENT_H

#include "mesh/lines/way.h"

/* A point of the surface in the mesh's numbers: as a solver's seeds. vertex -1: inside a face or an edge. */
typedef struct line_goal {
    loxo_index vertex, face;
    double weight[3];
} line_goal;

typedef struct line_descent line_descent;

/* distance [n_vertices] in the mesh's order, may be infinite; goals [n_goals], kept. Both stay the caller's and stand until
 * the end. LOXO_OK, LOXO_ERR_MEMORY. */
loxo_status line_descent_begin(loxo_context *ctx, const loxo_mesh_view *m, const double *distance,
                               const line_goal *goals, int64_t n_goals, line_descent **out);
/* The way from a point to a goal, in the place of what way held. LOXO_ERR_ARGUMENT: no way leads on, as in a part of the
 * surface that has no goal. */
loxo_status line_descend(line_descent *descent, const line_goal *from, line_way *way);
void line_descent_end(line_descent *descent);

#endif
