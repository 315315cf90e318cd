/* SPDX-License-Identifier: MIT
 * The faces that a way goes through, one after the other, as the half-edges that it crosses. */
#ifndef LOXO_MESH_LINES_SLEEVE_H
#define LOXO_MESH_LINES_SLEEVE_H

#include "mesh/lines/way.h"

typedef struct line_sleeve {
    loxo_context *ctx;
    const loxo_mesh_view *m;
    line_place start, end;
    int64_t face;     /* that it begins in */
    loxo_index *gate; /* [n] each in the face that is left through it */
    int64_t n, room;
} line_sleeve;

/* Goes on through a half-edge of the face that it ends in; back through the last gate it is one shorter. LOXO_ERR_MEMORY. */
loxo_status line_sleeve_push(line_sleeve *sleeve, loxo_index gate);
/* That of a way, at vertices on the side of the smaller angle; its memory is used again. LOXO_OK, LOXO_ERR_MEMORY;
 * LOXO_ERR_ARGUMENT, without a message: two neighbours lie in no one face. */
loxo_status line_sleeve_of_way(line_sleeve *sleeve, const line_way *way);
/* Leaves out what is before the last face with the start, and behind the first with the end. */
void line_sleeve_trim(line_sleeve *sleeve);
/* The angle of the face at the start of half-edge h. */
double line_corner_angle(const loxo_mesh_view *m, loxo_index h);
void line_sleeve_destroy(line_sleeve *sleeve);

static inline int64_t line_sleeve_face(const line_sleeve *s, int64_t i) /* before gate i; behind the last: i = n */
{
    return i == 0 ? s->face : s->m->halfedge_twin[s->gate[i - 1]] / 3;
}

/* Around a vertex, against the clock or with it: the half-edge by which the face with half-edge h, which starts at the
 * vertex, is left. */
static inline loxo_index line_exit(loxo_index h, bool is_left) { return is_left ? k_previous(h) : h; }

/* The half-edge from the same vertex in the next face; -1 at the boundary. */
static inline loxo_index line_turn(const loxo_mesh_view *m, loxo_index h, bool is_left)
{
    const loxo_index twin = m->halfedge_twin[line_exit(h, is_left)];
    return twin < 0 || is_left ? twin : k_next(twin);
}

#endif
