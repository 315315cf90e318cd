/* SPDX-License-Identifier: MIT
 * Which source each vertex is nearest to, from the distances alone: labels move outward in the order of the distance.
 *
 * A vertex asks the neighbours that came before it how far each of their sources is: along the edge, and across the faces
 * both of whose other corners know of that source, laid flat (k_unfolded_distance). The source with the least answer is
 * its own; the one after that is kept, too, with how much farther it is: beside the line where two sources are equally
 * near, a vertex of the one side must know the distance of the other side's source for its neighbours. */
#include "base/allocate.h"
#include "base/sort.h"
#include "kernel/unfold_kernel.h"
#include "par/range.h"
#include "solver/geodesic/geodesic_internal.h"

#include <math.h>
#include <string.h>

#define REACH      1.0 /* how far beyond an edge a ray may pass, in lengths of the edge: distances are nearly true */
#define KEEP_EDGES 3.0 /* the second source is remembered while it is at most so many edges farther */
#define POLL_EVERY 16384
#define UNKNOWN    ((loxo_index)-1)
#define TOLD       ((loxo_index)-2)
#define MOST       16 /* different sources among a vertex's neighbours; what is more is not looked at */

typedef struct second_label {
    loxo_index source; /* -1: none near */
    float farther;
} second_label;

/* A corner of a seed's face. */
typedef struct told {
    loxo_index vertex, source;
    double distance;
} told;

typedef struct labelling {
    const geodesic_problem *problem;
    const double *distance;
    loxo_index *nearest; /* UNKNOWN, TOLD: not yet */
    second_label *second;
    told *told; /* [n_told] by vertex */
    int64_t n_told;
} labelling;

/* Sources that a vertex hears of, and how far they are. */
typedef struct answers {
    int n;
    loxo_index source[MOST];
    double distance[MOST];
} answers;

static void hear(answers *a, loxo_index source, double distance)
{
    int i = 0;
    if (!(distance < HUGE_VAL)) return;
    while (i < a->n && a->source[i] != source)
        ++i;
    if (i == MOST) return;
    if (i == a->n) {
        a->source[a->n] = source;
        a->distance[a->n++] = distance;
    } else if (distance < a->distance[i])
        a->distance[i] = distance;
}

/* How far a source is from a labelled vertex, as far as that knows; HUGE_VAL: it does not. */
static double known(const labelling *l, loxo_index v, loxo_index source)
{
    if (l->nearest[v] == source) return l->distance[v];
    if (l->nearest[v] >= 0 && l->second[v].source == source) return l->distance[v] + (double)l->second[v].farther;
    return HUGE_VAL;
}

/* What v hears over the corner b of one of its faces, at distance along, and across from there and corner c. */
static void ask(const labelling *l, answers *a, loxo_index b, loxo_index c, double along, double across, double other)
{
    if (l->nearest[b] < 0) return;
    const loxo_index source[2] = {l->nearest[b], l->second[b].source};
    for (int k = 0; k < 2 && source[k] >= 0; ++k) {
        const double at_b = known(l, b, source[k]), at_c = known(l, c, source[k]);
        hear(a, source[k], at_b + along);
        if (at_c < HUGE_VAL) hear(a, source[k], k_unfolded_distance(across, along, other, at_b, at_c, REACH, REACH));
    }
}

static void hear_told(const labelling *l, answers *a, loxo_index v)
{
    int64_t low = 0, high = l->n_told;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (l->told[middle].vertex < v)
            low = middle + 1;
        else
            high = middle;
    }
    for (; low < l->n_told && l->told[low].vertex == v; ++low)
        hear(a, l->told[low].source, l->told[low].distance);
}

/* The one source that all labelled neighbours know, and no other; UNKNOWN: there are several or none. Most vertices are
 * inside a cell and need no more. */
static loxo_index only_label(const labelling *l, loxo_index v)
{
    const loxo_mesh_view *m = &l->problem->m;
    const loxo_index start = m->vertex_halfedge[v];
    loxo_index only = UNKNOWN;
    for (loxo_index h = start; h >= 0;) {
        const loxo_index corner[2] = {k_head(m, h), m->halfedge_vertex[k_previous(h)]};
        for (int k = 0; k < 2; ++k) {
            const loxo_index nearest = l->nearest[corner[k]];
            if (nearest < 0) continue;
            if ((only >= 0 && nearest != only) || l->second[corner[k]].source >= 0) return UNKNOWN;
            only = nearest;
        }
        h = m->halfedge_twin[k_previous(h)];
        if (h == start) break;
    }
    return only;
}

/* The label of v from its neighbours' and from what it was told before. */
static void label(labelling *l, loxo_index v)
{
    const loxo_mesh_view *m = &l->problem->m;
    const loxo_index start = m->vertex_halfedge[v];
    const loxo_index only = l->nearest[v] == TOLD ? UNKNOWN : only_label(l, v);
    answers a = {.n = 0};
    double longest = 0.0;
    if (only >= 0) {
        l->nearest[v] = only;
        l->second[v] = (second_label){-1, 0.0f};
        return;
    }
    if (l->nearest[v] == TOLD) hear_told(l, &a, v);
    for (loxo_index h = start; h >= 0;) {
        const loxo_index next = k_next(h), before = k_previous(h);
        const loxo_index b = m->halfedge_vertex[next], c = m->halfedge_vertex[before];
        double face_length[3];
        k_face_lengths(m, h / 3, face_length);
        const double to_b = face_length[h % 3], across = face_length[next % 3], to_c = face_length[before % 3];
        longest = fmax(longest, fmax(to_b, to_c));
        ask(l, &a, b, c, to_b, across, to_c);
        ask(l, &a, c, b, to_c, across, to_b);
        h = m->halfedge_twin[before];
        if (h == start) break;
    }
    int best = -1, after = -1;
    for (int i = 0; i < a.n; ++i) {
        if (best < 0 || a.distance[i] < a.distance[best] ||
            (a.distance[i] == a.distance[best] && a.source[i] < a.source[best])) {
            after = best;
            best = i;
        } else if (after < 0 || a.distance[i] < a.distance[after])
            after = i;
    }
    if (best < 0) return;
    const double farther = after >= 0 ? a.distance[after] - a.distance[best] : HUGE_VAL;
    l->nearest[v] = a.source[best];
    l->second[v] =
        farther <= KEEP_EDGES * longest ? (second_label){a.source[after], (float)farther} : (second_label){-1, 0.0f};
}

static bool comes_before(const void *arg, const void *a, const void *b)
{
    const told *x = a, *y = b;
    (void)arg;
    if (x->vertex != y->vertex) return x->vertex < y->vertex;
    return x->source != y->source ? x->source < y->source : x->distance < y->distance;
}

/* Corners of the seeds' faces know of them from the start. */
static loxo_status tell_corners(labelling *l, const geodesic_seed *seeds, int64_t n_seeds)
{
    const loxo_mesh_view *m = &l->problem->m;
    l->told = loxo_allocate(l->problem->ctx, 3 * n_seeds, sizeof *l->told);
    if (l->told == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n_seeds; ++i) {
        double length[3];
        k_face_lengths(m, seeds[i].face, length);
        const k_layout face = k_layout_of(length);
        for (int k = 0; k < 3; ++k) {
            const loxo_index v = m->halfedge_vertex[(int64_t)3 * seeds[i].face + k];
            if (seeds[i].vertex >= 0 && seeds[i].vertex != v) continue;
            const double distance = seeds[i].vertex >= 0 ? 0.0 : k_distance_to_corner(face, seeds[i].weight, k);
            l->told[l->n_told++] = (told){v, seeds[i].source, distance};
            l->nearest[v] = TOLD;
        }
    }
    loxo_sort(l->told, l->n_told, sizeof *l->told, comes_before, NULL);
    return LOXO_OK;
}

/* Vertices that have a distance, by distance, of equal ones the lower number first. Distances as whole numbers of 32 bits
 * between the least and the largest: what is nearer to each other than that may change places. */
static loxo_status sort_by_distance(const labelling *l, uint32_t **order, int64_t *n_order)
{
    loxo_context *ctx = l->problem->ctx;
    const int64_t n = l->problem->m.n_vertices;
    double least = HUGE_VAL, most = -HUGE_VAL;
    int64_t n_finite = 0;
    for (int64_t v = 0; v < n; ++v) {
        if (!(l->distance[v] < HUGE_VAL)) continue;
        least = fmin(least, l->distance[v]);
        most = fmax(most, l->distance[v]);
        ++n_finite;
    }
    const double unit = most > least ? 4294967295.0 / (most - least) : 0.0;
    uint64_t *key = loxo_allocate(ctx, n_finite, sizeof *key);
    loxo_status status = LOXO_ERR_MEMORY;
    *n_order = n_finite;
    *order = loxo_allocate(ctx, n_finite, sizeof **order);
    if (key != NULL && *order != NULL) {
        for (int64_t v = 0, i = 0; v < n; ++v) {
            if (!(l->distance[v] < HUGE_VAL)) continue;
            key[i] = (uint64_t)((l->distance[v] - least) * unit);
            (*order)[i++] = (uint32_t)v;
        }
        status = loxo_sort_u64(ctx, n_finite, key, *order, 33);
    }
    loxo_release(ctx, key);
    return status;
}

/* Hands labels on, outward from the tail vertices of the queue, which has room for n; through vertices at infinity only
 * where asked. Returns how many are in it then. */
static int64_t spread(labelling *l, uint32_t *queue, int64_t tail, int64_t n, bool through_infinite)
{
    const loxo_mesh_view *m = &l->problem->m;
    for (int64_t i = 0; i < tail && tail < n; ++i) {
        const loxo_index v = (loxo_index)queue[i], start = m->vertex_halfedge[v];
        for (loxo_index h = start; h >= 0;) {
            const loxo_index corner[2] = {m->halfedge_vertex[k_next(h)], m->halfedge_vertex[k_previous(h)]};
            for (int k = 0; k < 2; ++k)
                if (l->nearest[corner[k]] < 0 && (through_infinite || l->distance[corner[k]] < HUGE_VAL)) {
                    l->nearest[corner[k]] = l->nearest[v];
                    queue[tail++] = (uint32_t)corner[k];
                }
            h = m->halfedge_twin[k_previous(h)];
            if (h == start) break;
        }
    }
    return tail;
}

/* A vertex with less than all its neighbours and no source (the distances are not quite true) is left over at first; the
 * labels of what is around it reach it here. A limit may have made islands of such vertices: to them labels go over what
 * is beyond it. order [n] is used up. */
static loxo_status label_rest(labelling *l, uint32_t *order, int64_t n)
{
    const int64_t n_vertices = l->problem->m.n_vertices;
    int64_t tail = 0;
    for (int64_t i = 0; i < n; ++i)
        if (l->nearest[order[i]] >= 0) order[tail++] = order[i];
    tail = spread(l, order, tail, n, false);
    if (tail == n) return LOXO_OK;
    uint32_t *queue = loxo_allocate(l->problem->ctx, n_vertices, sizeof *queue);
    if (queue == NULL) return LOXO_ERR_MEMORY;
    memcpy(queue, order, (size_t)tail * sizeof *queue);
    (void)spread(l, queue, tail, n_vertices, true);
    loxo_release(l->problem->ctx, queue);
    for (int64_t v = 0; v < n_vertices; ++v)
        if (!(l->distance[v] < HUGE_VAL)) l->nearest[v] = UNKNOWN;
    return LOXO_OK;
}

loxo_status geodesic_label_nearest(const geodesic_problem *problem, const geodesic_seed *seeds, int64_t n_seeds,
                                   const double *distance, loxo_index *nearest)
{
    loxo_context *ctx = problem->ctx;
    const int64_t n = problem->m.n_vertices;
    labelling l = {.problem = problem, .distance = distance, .nearest = nearest};
    uint32_t *order = NULL;
    int64_t n_order = 0, i = 0;
    loxo_status status = LOXO_ERR_MEMORY;
    for (int64_t v = 0; v < n; ++v)
        nearest[v] = UNKNOWN;
    if ((l.second = loxo_allocate(ctx, n, sizeof *l.second)) == NULL) goto done;
    if ((status = tell_corners(&l, seeds, n_seeds)) < 0) goto done;
    if ((status = sort_by_distance(&l, &order, &n_order)) < 0) goto done;
    for (; i < n_order; ++i) {
        if (i % POLL_EVERY == 0 && loxo_stop_wanted(ctx, "nearest", (double)i / (double)n_order)) break;
        label(&l, (loxo_index)order[i]);
    }
    if (i < n_order)
        status = loxo_fail(ctx, LOXO_ERR_STOPPED, "geodesic: stopped before the nearest sources were found");
    else
        status = label_rest(&l, order, n_order);
    for (int64_t v = 0; v < n; ++v)
        if (nearest[v] < 0) nearest[v] = -1;
done:
    loxo_release(ctx, order);
    loxo_release(ctx, l.told);
    loxo_release(ctx, l.second);
    return status;
}
