/* SPDX-License-Identifier: MIT
 * Flips to the intrinsic Delaunay triangulation.
 *
 * An edge whose opposite angles a and b sum to more than pi has cot a + cot b < 0. The four angles at its ends then sum to less
 * than pi, so the two triangles unfold to a convex quadrangle, and the edge may be replaced by the other diagonal.
 *
 * That it ends. Let q of a face be the sum of its three cotangents, as it is computed from the lengths in the order in
 * which they stand. Exact arithmetic lowers the sum of q over a convex quadrangle's two triangles by such a flip (Rippa
 * 1990; cotangents are what the Dirichlet energy is made of). Here a flip is made only where the computed sums say so,
 * too. Rounding keeps the order of numbers: when a sum of two computes to less than another one, it is less. So the
 * sum of q over all faces, taken exactly, falls with every flip, no state comes twice, and there are finitely many: which
 * faces, which lengths, as computer numbers. What rounding alone decides is left as it is. A face without area has a q that
 * is not finite, and no flip that would make one is made.
 *
 * Order. Half-edges are looked at as they stand in memory; the four edges around a flip are looked at next, from a stack,
 * so that work stays where the cache is. The stack is short; where it overflows, the whole is gone through once more. */
#include "mesh/intrinsic/flip.h"

#include "base/context.h"
#include "kernel/layout_kernel.h"
#include "mesh/intrinsic/crossings.h"

#include <string.h>

enum { STACK = 4096, BETWEEN_LOOKS = 65536 };

/* The two faces of half-edge h, i to j, with corners (i, j, k) on its left and (j, i, l) on its right. */
typedef struct quadrangle {
    loxo_index ij, jk, ki, ji, il, lj;
} quadrangle;

static quadrangle around(const loxo_flips *t, loxo_index h)
{
    const loxo_index twin = t->halfedge_twin[h];
    return (quadrangle){h, k_next(h), k_previous(h), twin, k_next(twin), k_previous(twin)};
}

/* The distance of k and l in the quadrangle unfolded. With i at the origin and j at (base, 0), x_k = (base^2 + ik^2 - jk^2) /
 * (2 base) and x_l alike; of the difference only differences of squares are left. */
static double other_diagonal(const loxo_flips *t, const quadrangle *q)
{
    const double *length = t->length, base = length[q->ij];
    const double left[3] = {base, length[q->jk], length[q->ki]}, right[3] = {base, length[q->il], length[q->lj]};
    const double ik = left[2], jk = left[1], il = right[1], jl = right[2];
    const double x = 0.5 * ((ik - il) * (ik + il) + (jl - jk) * (jl + jk)) / base;
    const double y = 2.0 * (k_area_of(left) + k_area_of(right)) / base;
    return sqrt(x * x + y * y);
}

/* What the two faces become: (i, l, k) in place of (i, j, k), (j, k, l) in place of (j, i, l). Half-edges ki and lj stay
 * where they are; il moves to ij's place, jk to ji's, and the diagonal takes theirs. */
typedef struct new_faces {
    double diagonal;
    double cotangent[2][3]; /* by half-edge modulo 3 */
} new_faces;

static bool is_better(const loxo_flips *t, const quadrangle *q, new_faces *new)
{
    double length[2][3] = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, sum_old[2], sum_new[2];
    new->diagonal = other_diagonal(t, q);
    length[0][q->ij % 3] = t->length[q->il];
    length[0][q->jk % 3] = new->diagonal;
    length[0][q->ki % 3] = t->length[q->ki];
    length[1][q->ji % 3] = t->length[q->jk];
    length[1][q->il % 3] = new->diagonal;
    length[1][q->lj % 3] = t->length[q->lj];
    const double *old[2] = {&t->cotangent[q->ij - q->ij % 3], &t->cotangent[q->ji - q->ji % 3]};
    for (int i = 0; i < 2; ++i) {
        k_cotangents_of(length[i], new->cotangent[i]);
        sum_old[i] = (old[i][0] + old[i][1]) + old[i][2];
        sum_new[i] = (new->cotangent[i][0] + new->cotangent[i][1]) + new->cotangent[i][2];
    }
    return sum_new[0] + sum_new[1] < sum_old[0] + sum_old[1]; /* false with NaN */
}

/* Twin of what is now half-edge h: a, which may itself have moved. */
static void glue(loxo_flips *t, loxo_index h, loxo_index a)
{
    t->halfedge_twin[h] = a;
    if (a >= 0) t->halfedge_twin[a] = h;
}

static void relink(loxo_flips *t, const quadrangle *q)
{
    loxo_index *vertex = t->halfedge_vertex, *twin = t->halfedge_twin;
    const loxo_index i = vertex[q->ij], j = vertex[q->ji], k = vertex[q->ki], l = vertex[q->lj];
    const loxo_index beyond_il = twin[q->il], beyond_jk = twin[q->jk];
    vertex[q->ij] = i;        /* i l */
    vertex[q->jk] = l;        /* l k */
    vertex[q->ji] = j;        /* j k */
    vertex[q->il] = k;        /* k l */
    if (beyond_il == q->jk) { /* il and jk are one edge */
        glue(t, q->ij, q->ji);
    } else {
        glue(t, q->ij, beyond_il);
        glue(t, q->ji, beyond_jk);
    }
    glue(t, q->jk, q->il);
    if (t->vertex_halfedge[i] == q->il) t->vertex_halfedge[i] = q->ij;
    if (t->vertex_halfedge[j] == q->jk) t->vertex_halfedge[j] = q->ji;
}

static loxo_status flip(loxo_flips *t, const quadrangle *q, const new_faces *new)
{
    double *length = t->length;
    if (t->crossing != NULL) {
        loxo_flip_rim rim = {q->ij, q->jk, q->ki, q->ji, q->il, q->lj};
        if (!loxo_crossings_flip(t->crossing, t->surface_next, t->surface_twin, &rim))
            return loxo_fail(t->ctx, LOXO_ERR_LIMIT, "intrinsic: an edge crosses more than 2^31 edges of the surface");
    }
    length[q->ij] = length[q->il];
    length[q->ji] = length[q->jk];
    length[q->jk] = length[q->il] = new->diagonal;
    memcpy(&t->cotangent[q->ij - q->ij % 3], new->cotangent[0], sizeof new->cotangent[0]);
    memcpy(&t->cotangent[q->ji - q->ji % 3], new->cotangent[1], sizeof new->cotangent[1]);
    relink(t, q);
    ++t->n_flips;
    return LOXO_OK;
}

static bool is_to_flip(const loxo_flips *t, loxo_index h)
{
    const loxo_index twin = t->halfedge_twin[h];
    return twin >= 0 && t->cotangent[h] + t->cotangent[twin] < -t->tolerance && k_face_of(h) != k_face_of(twin);
}

static loxo_status settle(loxo_flips *t, loxo_index start, bool *is_overfull)
{
    loxo_index stack[STACK];
    int n = 0;
    stack[n++] = start;
    while (n > 0) {
        const loxo_index h = stack[--n];
        if (!is_to_flip(t, h)) continue;
        const quadrangle q = around(t, h);
        new_faces new;
        if (!is_better(t, &q, &new)) continue;
        if (t->most_flips > 0 && t->n_flips == t->most_flips)
            return loxo_fail(t->ctx, LOXO_NOT_CONVERGED, "intrinsic: %lld flips were not enough (--max-flips)",
                             (long long)t->most_flips);
        const loxo_status status = flip(t, &q, &new);
        if (status < 0) return status;
        if (t->n_flips % BETWEEN_LOOKS == 0 && loxo_stop_wanted(t->ctx, "flips", -1.0))
            return loxo_fail(t->ctx, LOXO_ERR_STOPPED, "intrinsic: stopped by the monitor among its flips");
        if (n + 4 > STACK) {
            *is_overfull = true;
            continue;
        }
        stack[n++] = q.ji;
        stack[n++] = q.lj;
        stack[n++] = q.ki;
        stack[n++] = q.ij;
    }
    return LOXO_OK;
}

loxo_status loxo_flip_to_delaunay(loxo_flips *t)
{
    const int64_t n_halfedges = 3 * t->n_faces;
    bool is_overfull = true;
    while (is_overfull) {
        is_overfull = false;
        for (int64_t h = 0; h < n_halfedges; ++h) {
            if (h % BETWEEN_LOOKS == 0 && loxo_stop_wanted(t->ctx, "flips", (double)h / (double)n_halfedges))
                return loxo_fail(t->ctx, LOXO_ERR_STOPPED, "intrinsic: stopped by the monitor among its flips");
            if (t->halfedge_twin[h] < h || !is_to_flip(t, (loxo_index)h)) continue; /* each edge once */
            const loxo_status status = settle(t, (loxo_index)h, &is_overfull);
            if (status != LOXO_OK) return status;
        }
    }
    return LOXO_OK;
}
