/* SPDX-License-Identifier: MIT */
#include "mesh/lines/sleeve.h"

#include "base/allocate.h"
#include "kernel/layout_kernel.h"

#include <math.h>

loxo_status line_sleeve_push(line_sleeve *s, loxo_index gate)
{
    if (s->n > 0 && s->gate[s->n - 1] == s->m->halfedge_twin[gate]) {
        --s->n;
        return LOXO_OK;
    }
    if (s->n == s->room) {
        const int64_t room = 2 * s->room + 64;
        loxo_index *more = loxo_reallocate(s->ctx, s->gate, room, sizeof *more);
        if (more == NULL) return LOXO_ERR_MEMORY;
        s->gate = more;
        s->room = room;
    }
    s->gate[s->n++] = gate;
    return LOXO_OK;
}

void line_sleeve_destroy(line_sleeve *s)
{
    loxo_release(s->ctx, s->gate);
    s->gate = NULL;
    s->n = s->room = 0;
}

double line_corner_angle(const loxo_mesh_view *m, loxo_index h)
{
    double length[3];
    const k_layout face = k_layout_at(m, h, length);
    return atan2(face.y2, face.x2);
}

/* The half-edge of a face that starts at a vertex. */
static loxo_index from_vertex(const loxo_mesh_view *m, int64_t f, loxo_index v)
{
    int k = 0;
    while (k < 2 && m->halfedge_vertex[3 * f + k] != v)
        ++k;
    return (loxo_index)(3 * f + k);
}

/* A face that has both, the given one if it does (-1: none is given); -1: there is none. */
static int64_t common_face(const loxo_mesh_view *m, const line_place *a, const line_place *b, int64_t given)
{
    if (given >= 0 && line_place_is_in(m, a, given) && line_place_is_in(m, b, given)) return given;
    if (b->vertex < 0) { /* it is in fewer faces */
        const line_place *swap = a;
        a = b;
        b = swap;
    }
    if (a->face >= 0) return line_place_is_in(m, b, a->face) ? a->face : -1;
    if (a->halfedge >= 0) {
        const loxo_index twin = m->halfedge_twin[a->halfedge];
        if (line_place_is_in(m, b, a->halfedge / 3)) return a->halfedge / 3;
        return twin >= 0 && line_place_is_in(m, b, twin / 3) ? twin / 3 : -1;
    }
    const loxo_index start = m->vertex_halfedge[a->vertex];
    for (loxo_index h = start; h >= 0;) {
        if (line_place_is_in(m, b, h / 3)) return h / 3;
        h = line_turn(m, h, true);
        if (h == start) break;
    }
    return -1;
}

/* Angles between a face and another around a vertex; infinite: the boundary is between. */
static double angle_between(const loxo_mesh_view *m, loxo_index from, int64_t face, bool is_left)
{
    double sum = 0.0;
    loxo_index h = line_turn(m, from, is_left);
    for (; h >= 0 && h != from && h / 3 != face; h = line_turn(m, h, is_left))
        sum += line_corner_angle(m, h);
    return h < 0 || h == from ? HUGE_VAL : sum;
}

/* On from one face of a place to another. */
static loxo_status pass(line_sleeve *s, const line_place *at, int64_t from, int64_t to)
{
    const loxo_mesh_view *m = s->m;
    loxo_status status = LOXO_OK;
    if (from == to) return LOXO_OK;
    if (at->halfedge >= 0)
        return line_sleeve_push(s, at->halfedge / 3 == from ? at->halfedge : m->halfedge_twin[at->halfedge]);
    loxo_index h = from_vertex(m, from, at->vertex);
    const double left = angle_between(m, h, to, true), right = angle_between(m, h, to, false);
    const bool is_left = left < right;
    if (!isfinite(is_left ? left : right)) return LOXO_ERR_ARGUMENT;
    for (; h / 3 != to && status >= 0; h = line_turn(m, h, is_left))
        status = line_sleeve_push(s, line_exit(h, is_left));
    return status;
}

loxo_status line_sleeve_of_way(line_sleeve *s, const line_way *way)
{
    loxo_status status = LOXO_OK;
    int64_t face = -1;
    s->start = way->place[0];
    s->end = way->place[way->n - 1];
    s->n = 0;
    for (int64_t i = 1; i < way->n && status >= 0; ++i) {
        const int64_t next = common_face(s->m, &way->place[i - 1], &way->place[i], face);
        if (next < 0) return LOXO_ERR_ARGUMENT;
        if (i == 1)
            s->face = next;
        else
            status = pass(s, &way->place[i - 1], face, next);
        face = next;
    }
    return status;
}

void line_sleeve_trim(line_sleeve *s)
{
    int64_t first = 0, last = 0;
    for (int64_t i = 1; i <= s->n; ++i)
        if (line_place_is_in(s->m, &s->start, line_sleeve_face(s, i))) first = i;
    s->face = line_sleeve_face(s, first);
    for (int64_t i = first; i < s->n; ++i)
        s->gate[i - first] = s->gate[i];
    s->n -= first;
    while (last < s->n && !line_place_is_in(s->m, &s->end, line_sleeve_face(s, last)))
        ++last;
    s->n = last;
}
