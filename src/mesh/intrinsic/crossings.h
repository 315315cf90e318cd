/* SPDX-License-Identifier: MIT
 * How the edges of a surface run over its intrinsic triangulation, in whole numbers: normal coordinates, which no rounding
 * can spoil.
 *
 * crossing[h] is the number of the surface's edges that cross the edge of h between its ends, -1 where it is itself one
 * of them. It tells all: inside a face a surface's edge either cuts off a corner, or comes from a corner and leaves
 * through the side opposite; how many do what follows from the three numbers of the sides, and as they do not cross each
 * other, those that meet a side come one after the other.
 * surface_next[h] names those that end at a vertex: the first half-edge of the surface that leaves the vertex of h in the
 * direction of h or counter-clockwise of it; -1 where there is none before the boundary.
 * source  Gillespie, Sharp, Crane 2021, Integer Coordinates for Intrinsic Geometry Processing; derived again here */
#ifndef LOXO_MESH_INTRINSIC_CROSSINGS_H
#define LOXO_MESH_INTRINSIC_CROSSINGS_H

#include "kernel/vec3.h"

static inline int64_t loxo_crossed(int32_t crossing) { return crossing > 0 ? crossing : 0; }

/* Of a triangle whose sides are crossed a, b, and o times: how many cut off the corner between a and b, and how many come
 * from that corner and leave through o. If some come from a corner, say e of them, they and those that cut off the other two are
 * all that crosses o: o = a + b + e, and none cuts off the corner itself. Without any, a = c_ab + c_ao and so on give
 * c_ab = (a + b - o) / 2. */
static inline int64_t loxo_cut_off(int64_t a, int64_t b, int64_t o)
{
    if (o >= a + b) return 0;
    if (a >= b + o) return b;
    if (b >= a + o) return a;
    return (a + b - o) / 2;
}

static inline int64_t loxo_from_corner(int64_t a, int64_t b, int64_t o) { return o > a + b ? o - a - b : 0; }

/* The next half-edge of the surface counter-clockwise around the vertex where h starts; -1 beyond the boundary. */
static inline loxo_index loxo_turn_left(const loxo_index *twin, loxo_index h) { return twin[k_previous(h)]; }

/* n times. */
static inline loxo_index loxo_turn_left_by(const loxo_index *twin, loxo_index h, int64_t n)
{
    for (; n > 0 && h >= 0; --n)
        h = loxo_turn_left(twin, h);
    return h;
}

/* The six half-edges around an edge that is flipped: faces (i, j, k) and (j, i, l). */
typedef struct loxo_flip_rim {
    loxo_index ij, jk, ki, ji, il, lj;
} loxo_flip_rim;

static inline int64_t loxo_positive(int64_t n) { return n > 0 ? n : 0; }

/* What crosses k l. Count a surface's edges by where they go from ij: on the left, from i on, those that cut off i, then
 * those that end at k, then those that cut off j; on the right, i, l, j. One crosses k l that goes from the left's i to the
 * right's j or the other way, that cuts off k or l, or comes from i or j; and so does ij itself. One that goes from k to l is the
 * diagonal: -1. */
static inline int64_t loxo_crossings_of_diagonal(const int32_t *crossing, const loxo_flip_rim *q)
{
    const int64_t ij = loxo_crossed(crossing[q->ij]), jk = loxo_crossed(crossing[q->jk]);
    const int64_t ki = loxo_crossed(crossing[q->ki]), il = loxo_crossed(crossing[q->il]);
    const int64_t lj = loxo_crossed(crossing[q->lj]);
    const int64_t left_i = loxo_cut_off(ij, ki, jk), left_j = loxo_cut_off(ij, jk, ki);
    const int64_t right_i = loxo_cut_off(ij, il, lj), right_j = loxo_cut_off(ij, lj, il);
    const int64_t left_end = left_i + loxo_from_corner(jk, ki, ij), right_end = right_i + loxo_from_corner(il, lj, ij);
    const int64_t begin = left_i > right_i ? left_i : right_i, end = left_end < right_end ? left_end : right_end;
    if (end > begin) return -1;
    return loxo_positive(left_i + right_j - ij) + loxo_positive(left_j + right_i - ij) + /* across */
           loxo_cut_off(jk, ki, ij) + loxo_cut_off(il, lj, ij) +                         /* around k, l */
           loxo_from_corner(ij, ki, jk) + loxo_from_corner(ij, jk, ki) +                 /* from i, j on the left */
           loxo_from_corner(ij, il, lj) + loxo_from_corner(ij, lj, il) +                 /* from i, j on the right */
           (crossing[q->ij] < 0 ? 1 : 0);
}

/* Carries both arrays over a flip, whose new faces are (i, l, k) and (j, k, l) with half-edges il, lk, ki in the places of
 * ij, jk, ki, and jk, kl, lj in those of ji, il, lj. false, and nothing changed: a number outgrows its type. */
static inline bool loxo_crossings_flip(int32_t *crossing, loxo_index *surface_next, const loxo_index *surface_twin,
                                       const loxo_flip_rim *q)
{
    const int64_t n = loxo_crossings_of_diagonal(crossing, q);
    if (n > INT32_MAX) return false;
    const int64_t kl = loxo_positive(n), jk = loxo_crossed(crossing[q->jk]), il = loxo_crossed(crossing[q->il]);
    /* Left of k i, up to k l: k i itself where it is a surface's edge, and what comes from k between the two. */
    const int64_t from_k = loxo_from_corner(loxo_crossed(crossing[q->ki]), kl, il) + (crossing[q->ki] < 0 ? 1 : 0);
    const int64_t from_l = loxo_from_corner(loxo_crossed(crossing[q->lj]), kl, jk) + (crossing[q->lj] < 0 ? 1 : 0);
    const loxo_index k_l = loxo_turn_left_by(surface_twin, surface_next[q->ki], from_k);
    const loxo_index l_k = loxo_turn_left_by(surface_twin, surface_next[q->lj], from_l);
    crossing[q->ij] = crossing[q->il];
    crossing[q->ji] = crossing[q->jk];
    crossing[q->jk] = crossing[q->il] = (int32_t)n;
    surface_next[q->ij] = surface_next[q->il];
    surface_next[q->ji] = surface_next[q->jk];
    surface_next[q->jk] = l_k;
    surface_next[q->il] = k_l;
    return true;
}

#endif
