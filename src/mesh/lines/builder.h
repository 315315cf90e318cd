/* SPDX-License-Identifier: MIT
 * Lines while they are made. */
#ifndef LOXO_MESH_LINES_BUILDER_H
#define LOXO_MESH_LINES_BUILDER_H

#include "kernel/vec3.h"

#include <loxo/lines.h>

typedef struct line_builder {
    loxo_context *ctx;
    const loxo_mesh_view *m;
    loxo_polylines lines;
    int64_t point_capacity, line_capacity;
} line_builder;

/* n_lines 0 is a set of lines, too: line_begin is always there. LOXO_OK, LOXO_ERR_MEMORY. */
loxo_status line_builder_begin(loxo_context *ctx, const loxo_mesh_view *m, line_builder *builder);
/* Adds a point to the line that is being made, in the mesh's numbers; one where the last one lies is left
 * out. LOXO_OK, LOXO_ERR_MEMORY. */
loxo_status line_add_vertex(line_builder *builder, loxo_index v);
/* At from + t (to - from), 0 <= t <= 1; at the ends, as far as rounding tells, that is the vertex. */
loxo_status line_add_on_edge(line_builder *builder, loxo_index from, loxo_index to, double t);
/* Barycentric, of a face's corners; weights of 0 are no corners. */
loxo_status line_add_in_face(line_builder *builder, int64_t f, const double weight[3]);
/* Ends the line; one that has fewer than two points is dropped. When it is closed its first point is repeated. */
loxo_status line_end(line_builder *builder, double value, bool is_closed);
/* The same of a way, which is kept, with its point twice, where it ends where it begins. */
loxo_status line_end_way(line_builder *builder, double value);
/* A way that there is not: a line without points. LOXO_OK, LOXO_ERR_MEMORY. */
loxo_status line_end_none(line_builder *builder, double value);
/* Points of the line that is being made. */
int64_t line_n_points(const line_builder *builder);

#endif
