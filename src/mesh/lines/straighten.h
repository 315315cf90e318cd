/* SPDX-License-Identifier: MIT
 * Ways drawn tight: from one that is nearly shortest to one that nothing beside it is shorter than. */
#ifndef LOXO_MESH_LINES_STRAIGHTEN_H
#define LOXO_MESH_LINES_STRAIGHTEN_H

#include "kernel/plane.h"
#include "mesh/lines/sleeve.h"

/* A place of the strip of faces laid flat: an end of the way, or a vertex at an end of gates. */
typedef struct line_node {
    k_spot at;
    loxo_index vertex;
    bool is_left;
    int64_t first, last; /* gates that end at it */
    int64_t parent;      /* the node before it on the shortest way to it */
    double gain;         /* by passing it on the other side */
} line_node;

/* Serves one way after the other; its memory grows with the longest. */
typedef struct line_straightener {
    loxo_context *ctx;
    const loxo_mesh_view *m;
    line_sleeve sleeve, next, kept;
    double length;          /* of the way inside the sleeve */
    line_node *node;        /* [n + 3] */
    int64_t *left, *right;  /* [n] nodes at the ends of each gate */
    int64_t *funnel, *path; /* [2 n + 8], [n + 3] */
    int64_t room;           /* for n */
    int64_t n_nodes, n_path;
    int64_t low, apex, high; /* of the funnel: its left end, where the sides part, its right end */
} line_straightener;

void line_straightener_begin(loxo_context *ctx, const loxo_mesh_view *m, line_straightener *s);
/* Adds the way between the same ends that comes of it, without ending the line. LOXO_OK, LOXO_ERR_MEMORY, LOXO_ERR_STOPPED. */
loxo_status line_straighten(line_straightener *s, const line_way *way, line_builder *builder);
void line_straightener_end(line_straightener *s);

#endif
