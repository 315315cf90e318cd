/* SPDX-License-Identifier: MIT
 * Triangles whose corners are spelled out become vertices and ids. */
#ifndef LOXO_IO_WELD_H
#define LOXO_IO_WELD_H

#include "io/bytes.h"

#include <loxo/mesh.h>

#define LOXO_STL_FACET_BYTES 50

/* Positions of 3 n_facets corners, where they lie. */
typedef struct loxo_corners {
    const uint8_t *facet;   /* records of binary STL, or NULL */
    const double *position; /* [3 n_facets][3], or NULL */
    int64_t n_facets;
} loxo_corners;

/* Joins corners whose coordinates are the same (-0 equals 0); vertices are numbered as they first appear. The soup is
 * empty and gets positions (float from binary STL) and triangles; on failure it is left for the caller to destroy.
 * returns  LOXO_OK, LOXO_ERR_LIMIT (ids run out), LOXO_ERR_MEMORY, LOXO_ERR_STOPPED
 * cost     linear time, whatever the points are; 8 bytes a corner of workspace, and 6 MB or so */
loxo_status loxo_weld(loxo_context *ctx, const loxo_corners *corners, loxo_soup *soup);

static inline void loxo_corner_floats(const loxo_corners *corners, int64_t corner, float p[3])
{
    const uint8_t *at = corners->facet + LOXO_STL_FACET_BYTES * (corner / 3) + 12 + 12 * (corner % 3);
    for (int i = 0; i < 3; ++i)
        p[i] = loxo_load_float(at + (ptrdiff_t)4 * i, LOXO_HOST_IS_BIG);
}

#endif
