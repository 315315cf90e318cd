/* SPDX-License-Identifier: MIT
 * For methods whose front goes from neighbour to neighbour: the list of what a solve within a small ball has touched, so that
 * what is done with the distances costs as little as the solve. */
#ifndef LOXO_SOLVER_GEODESIC_TOUCHED_H
#define LOXO_SOLVER_GEODESIC_TOUCHED_H

#include "solver/geodesic/engine.h"

typedef struct geodesic_touch {
    const loxo_mesh_view *m;
    const double *distance; /* [n_vertices]; finite: touched */
    uint8_t *flags;         /* [n_vertices] */
    uint8_t reached;        /* flags of which each says touched, too */
    uint8_t listed;         /* a flag that is clear before and after */
} geodesic_touch;

/* From the corners of the seeds' faces on; list [room], ascending. Returns how many; room: there may be more. */
int64_t geodesic_list_touched(const geodesic_touch *touch, const geodesic_seed *seeds, int64_t n_seeds,
                              loxo_index *list, int64_t room);

#endif
