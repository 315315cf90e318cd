/* SPDX-License-Identifier: MIT
 * Where a solve starts: the vertices of level 0. A source at a vertex is one of them, with all its heat and distance 0. A
 * source inside a face or an edge starts at the corners that it is a combination of: its heat is spread over them by its
 * weights, which is what a function of hat functions makes of a point; each starts at its straight distance from the
 * point. Faces that hold a source, at a vertex too, ask for the differences of their corners' distances, not for a direction
 * of heat. */
#include "base/allocate.h"
#include "kernel/unfold_kernel.h"
#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

#include <stdlib.h>

typedef struct start {
    loxo_index vertex;
    double heat, distance;
} start;

static int compare_starts(const void *a, const void *b)
{
    const start *x = a, *y = b;
    if (x->vertex != y->vertex) return (x->vertex > y->vertex) - (x->vertex < y->vertex);
    return (x->distance > y->distance) - (x->distance < y->distance);
}

/* All corners with a weight, those of several sources as often, sorted. */
static int64_t list_starts(const parallel_heat *g, const geodesic_seed *seeds, int64_t n_seeds, start *list)
{
    int64_t n = 0;
    for (int64_t i = 0; i < n_seeds; ++i) {
        if (seeds[i].vertex >= 0) {
            list[n++] = (start){seeds[i].vertex, 1.0, 0.0};
            continue;
        }
        double length[3];
        k_face_lengths(&g->m, seeds[i].face, length);
        const k_layout face = k_layout_of(length);
        for (int k = 0; k < 3; ++k)
            if (seeds[i].weight[k] > 0.0)
                list[n++] = (start){g->m.halfedge_vertex[(int64_t)3 * seeds[i].face + k], seeds[i].weight[k],
                                    k_distance_to_corner(face, seeds[i].weight, k)};
    }
    qsort(list, (size_t)n, sizeof *list, compare_starts);
    return n;
}

loxo_status heat_begin(parallel_heat *g, const geodesic_seed *seeds, int64_t n_seeds)
{
    bool is_at_vertices = true;
    for (int64_t i = 0; i < n_seeds; ++i)
        is_at_vertices = is_at_vertices && seeds[i].vertex >= 0;
    const int64_t most = is_at_vertices ? n_seeds : 3 * n_seeds;
    loxo_index *vertex = loxo_allocate(g->ctx, most, sizeof *vertex);
    start *list = NULL;
    loxo_status status = LOXO_ERR_MEMORY;
    int64_t n = 0;
    if (vertex == NULL) goto done;
    if (is_at_vertices) {
        for (; n < n_seeds; ++n)
            vertex[n] = seeds[n].vertex;
    } else {
        list = loxo_allocate(g->ctx, most, sizeof *list);
        g->start_heat = loxo_allocate(g->ctx, most, sizeof *g->start_heat);
        g->start_distance = loxo_allocate(g->ctx, most, sizeof *g->start_distance);
        if (list == NULL || g->start_heat == NULL || g->start_distance == NULL) goto done;
        const int64_t n_listed = list_starts(g, seeds, n_seeds, list);
        for (int64_t i = 0; i < n_listed; ++i) {
            if (i > 0 && list[i].vertex == vertex[n - 1]) {
                g->start_heat[n - 1] += list[i].heat;
                continue;
            }
            vertex[n] = list[i].vertex;
            g->start_heat[n] = list[i].heat;
            g->start_distance[n++] = list[i].distance;
        }
    }
    g->seeds = seeds;
    g->n_seeds = n_seeds;
    status = heat_find_levels(g, vertex, n);
done:
    loxo_release(g->ctx, list);
    loxo_release(g->ctx, vertex);
    return status;
}

void heat_end(parallel_heat *g)
{
    loxo_release(g->ctx, g->start_heat);
    loxo_release(g->ctx, g->start_distance);
    g->start_heat = g->start_distance = NULL;
    g->seeds = NULL;
    g->n_seeds = 0;
}

/* Straight distances from a source to the corners of a face that holds it. */
typedef struct held_face {
    loxo_index face;
    double distance[3];
} held_face;

static int compare_faces(const void *a, const void *b)
{
    const held_face *x = a, *y = b;
    return (x->face > y->face) - (x->face < y->face);
}

static held_face hold(const loxo_mesh_view *m, loxo_index face, const double weight[3])
{
    held_face held = {.face = face};
    double length[3];
    k_face_lengths(m, face, length);
    for (int k = 0; k < 3; ++k)
        held.distance[k] = k_distance_to_corner(k_layout_of(length), weight, k);
    return held;
}

/* The face of a seed inside an edge or a face, and of one inside an edge the face beyond. Returns how many. */
static int64_t hold_point(const loxo_mesh_view *m, const geodesic_seed *seed, held_face held[2])
{
    held[0] = hold(m, seed->face, seed->weight);
    for (int k = 0; k < 3; ++k) {
        const loxo_index h = (loxo_index)((int64_t)3 * seed->face + k), t = m->halfedge_twin[h];
        if (seed->weight[k == 0 ? 2 : k - 1] > 0.0 || t < 0) continue;
        double weight[3] = {0.0, 0.0, 0.0}; /* the twin runs against h */
        weight[t % 3] = seed->weight[k == 2 ? 0 : k + 1];
        weight[k_next(t) % 3] = seed->weight[k];
        held[1] = hold(m, (loxo_index)(t / 3), weight);
        return 2;
    }
    return 1;
}

/* The faces around a seed at a vertex. */
static int64_t hold_vertex(const loxo_mesh_view *m, loxo_index vertex, held_face *held)
{
    const loxo_index first = m->vertex_halfedge[vertex];
    int64_t n = 0;
    for (loxo_index h = first; h >= 0;) {
        double weight[3] = {0.0, 0.0, 0.0};
        weight[h % 3] = 1.0;
        held[n++] = hold(m, (loxo_index)(h / 3), weight);
        h = m->halfedge_twin[k_previous(h)];
        if (h == first) break;
    }
    return n;
}

/* The differences that faces with a source ask for. */
loxo_status heat_aim_from_seeds(parallel_heat *g, double *difference)
{
    int64_t n = 0, most = 0;
    for (int64_t i = 0; i < g->n_seeds; ++i)
        most += g->seeds[i].vertex < 0 ? 2 : g->is_given ? 0 : (int64_t)k_degree(&g->m, g->seeds[i].vertex);
    if (most == 0) return LOXO_OK;
    held_face *held = loxo_allocate(g->ctx, most, sizeof *held);
    if (held == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < g->n_seeds; ++i)
        if (g->seeds[i].vertex < 0)
            n += hold_point(&g->m, &g->seeds[i], &held[n]);
        else if (!g->is_given)
            n += hold_vertex(&g->m, g->seeds[i].vertex, &held[n]);
    qsort(held, (size_t)n, sizeof *held, compare_faces);
    for (int64_t i = 0; i < n;) {
        double nearest[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, *d = &difference[(int64_t)3 * held[i].face];
        const loxo_index f = held[i].face;
        for (; i < n && held[i].face == f; ++i)
            for (int k = 0; k < 3; ++k)
                nearest[k] = fmin(nearest[k], held[i].distance[k]);
        for (int k = 0; k < 3; ++k)
            d[k] = nearest[k == 2 ? 0 : k + 1] - nearest[k];
        if (g->settings.method == LOXO_GEODESIC_EDGE) continue;
        g->target[f][0] = d[0];
        g->target[f][1] = d[1];
    }
    loxo_release(g->ctx, held);
    return LOXO_OK;
}
