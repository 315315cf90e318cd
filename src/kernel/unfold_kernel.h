/* SPDX-License-Identifier: MIT
 * Distance across one triangle laid flat: when a straight line from the source would arrive that is as far from two of
 * its corners as they are known to be. */
#ifndef LOXO_KERNEL_UNFOLD_KERNEL_H
#define LOXO_KERNEL_UNFOLD_KERNEL_H

#include "kernel/layout_kernel.h"

#include <math.h>

/* Corners a, b, c; base = |ab|, left = |ac|, right = |bc|; the source is at distance at_a from a and at_b from b, on the
 * side of ab away from c. With a at the origin, b on the x axis and c above it,
 *   c = ((base^2 + left^2 - right^2) / (2 base), y),  source = ((base^2 + at_a^2 - at_b^2) / (2 base), -s),
 * distances that no point has both of (rounding, a field that is only nearly a distance) put it on the axis. reach: how
 * far outside ab, in parts of it, the line may cross the axis beyond a and beyond b; farther out, HUGE_VAL. */
static inline double k_unfolded_distance(double base, double left, double right, double at_a, double at_b,
                                         double reach_a, double reach_b)
{
    if (!(base > 0.0)) return HUGE_VAL;
    const double cx = 0.5 * (base + (left - right) * ((left + right) / base));
    const double sx = 0.5 * (base + (at_a - at_b) * ((at_a + at_b) / base));
    const double cy2 = (left - cx) * (left + cx), sy2 = (at_a - sx) * (at_a + sx);
    const double cy = cy2 > 0.0 ? sqrt(cy2) : 0.0, sy = sy2 > 0.0 ? sqrt(sy2) : 0.0, height = cy + sy;
    const double crossing = height > 0.0 ? sx + (cx - sx) * (sy / height) : cx;
    if (crossing < -reach_a * base || crossing > (1.0 + reach_b) * base) return HUGE_VAL;
    return sqrt((cx - sx) * (cx - sx) + height * height);
}

/* A neighbour of a vertex x, as far as it matters for an arrival at x. */
typedef struct k_spoke {
    double at, length; /* its distance; to x */
    loxo_vec3 position;
} k_spoke;

/* h: the half-edge between them, either way. */
static inline k_spoke k_spoke_to(const loxo_mesh_view *m, loxo_vec3 x, loxo_index to, loxo_index h, double at)
{
    k_spoke s = {.at = at};
    if (!(at < HUGE_VAL)) return s; /* most of what is not known yet is not looked up */
    if (m->halfedge_length != NULL) {
        s.length = m->halfedge_length[h];
    } else {
        s.position = k_position(m, to);
        s.length = v3_norm(v3_sub(s.position, x));
    }
    return s;
}

/* Shortest arrival at vertex v: along an edge from a neighbour, or straight across a face around it, from the distances that
 * its neighbours have; HUGE_VAL where one has none yet. reach as above; no line comes from beyond a boundary. */
static inline double k_arrival(const loxo_mesh_view *m, loxo_index v, const double *distance, double reach)
{
    const loxo_index first = m->vertex_halfedge[v], from = k_head(m, first);
    const loxo_vec3 x = m->halfedge_length != NULL ? (loxo_vec3){0.0, 0.0, 0.0} : k_position(m, v);
    loxo_index h = first;
    k_spoke a = k_spoke_to(m, x, from, h, distance[from]);
    double least = a.at + a.length, reach_a = m->halfedge_twin[first] < 0 ? 0.0 : reach;
    do {
        const loxo_index back = k_previous(h), to = m->halfedge_vertex[back];
        const k_spoke b = k_spoke_to(m, x, to, back, distance[to]);
        const double reach_b = m->halfedge_twin[back] < 0 ? 0.0 : reach;
        if (b.at + b.length < least) least = b.at + b.length;
        if (a.at < HUGE_VAL && b.at < HUGE_VAL && (a.at < least || b.at < least)) {
            const double base =
                m->halfedge_length != NULL ? m->halfedge_length[k_next(h)] : v3_norm(v3_sub(b.position, a.position));
            const double across = k_unfolded_distance(base, a.length, b.length, a.at, b.at, reach_a, reach_b);
            if (across < least) least = across;
        }
        a = b;
        reach_a = reach_b;
        h = m->halfedge_twin[back];
    } while (h >= 0 && h != first);
    return least;
}

/* From the point of barycentric weights to a corner of a face laid flat. */
static inline double k_distance_to_corner(k_layout face, const double weight[3], int corner)
{
    const double x = weight[1] * face.x1 + weight[2] * face.x2, y = weight[2] * face.y2;
    const double dx = x - (corner == 0 ? 0.0 : corner == 1 ? face.x1 : face.x2), dy = y - (corner == 2 ? face.y2 : 0.0);
    return sqrt(dx * dx + dy * dy);
}

#endif
