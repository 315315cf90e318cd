/* SPDX-License-Identifier: MIT
 * A way over the surface while it is looked for: places, two neighbours of which lie in one face. */
#ifndef LOXO_MESH_LINES_WAY_H
#define LOXO_MESH_LINES_WAY_H

#include "mesh/lines/builder.h"

/* At a vertex, on an edge at t from the start of a half-edge of it, or inside a face; the other two numbers are -1. */
typedef struct line_place {
    loxo_index vertex, halfedge, face;
    double t, weight[3];
} line_place;

typedef struct line_way {
    loxo_context *ctx;
    line_place *place; /* [n] */
    int64_t n, room;
} line_way;

/* The place of these weights in a face; where they are 0 that is an edge or a vertex. */
line_place line_place_in_face(const loxo_mesh_view *m, int64_t f, const double weight[3]);
bool line_place_is_in(const loxo_mesh_view *m, const line_place *place, int64_t f);
/* Its weights in a face that it is in. */
void line_place_weights(const loxo_mesh_view *m, const line_place *place, int64_t f, double weight[3]);

/* LOXO_OK, LOXO_ERR_MEMORY. */
loxo_status line_way_add(line_way *way, const line_place *place);
double line_way_length(const line_way *way, const loxo_mesh_view *m);
/* Adds its places to a line, without ending it. LOXO_OK, LOXO_ERR_MEMORY. */
loxo_status line_way_build(const line_way *way, line_builder *builder);
loxo_status line_place_build(const line_place *place, line_builder *builder);
void line_way_destroy(line_way *way);

#endif
