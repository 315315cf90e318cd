/* SPDX-License-Identifier: MIT
 * What the rows of the heat system are made of and no source changes: neighbours, cotangent weights and areas, made once,
 * part by part: the shapes of a part's faces stay in the cache while its vertices look at them. Both ends of an edge get
 * the same weight to the bit. */
#include "base/allocate.h"
#include "par/range.h"
#include "solver/geodesic/geodesic_internal.h"

#define MOST_SHAPES 2048 /* faces of a piece, 64 KiB; parts with more are cut into pieces */

/* Pieces of parts: piece i of a part has the i-th share of its vertices and of its faces. Faces of other pieces are looked
 * at again. */
typedef struct pieces {
    int64_t n, per_part;
    uint32_t *first_entry; /* [n] */
} pieces;

static loxo_range piece_of(const int64_t *part, const pieces *all, int64_t i)
{
    const int64_t begin = part[i / all->per_part], end = part[i / all->per_part + 1];
    const loxo_range r = loxo_range_of(end - begin, i % all->per_part, all->per_part);
    return (loxo_range){begin + r.begin, begin + r.end};
}

static void count_piece(loxo_geodesic *g, const pieces *all, int64_t i)
{
    const loxo_range r = piece_of(g->m.part_vertex, all, i);
    uint32_t n = 0;
    for (int64_t v = r.begin; v < r.end; ++v) {
        g->fan[v].begin = n;
        n += k_degree(&g->m, (loxo_index)v);
    }
    all->first_entry[i] = n;
}

static void make_piece(loxo_geodesic *g, const pieces *all, int64_t i)
{
    k_face_shape room[MOST_SHAPES];
    const loxo_range vertices = piece_of(g->m.part_vertex, all, i), faces = piece_of(g->m.part_face, all, i);
    const k_face_shapes kept = {faces.begin, faces.end, room};
    const double unit = 1.0 / (g->mean_edge_length * g->mean_edge_length);
    for (int64_t f = faces.begin; f < faces.end; ++f)
        room[f - faces.begin] = k_shape_of_face(&g->m, f);
    for (int64_t v = vertices.begin; v < vertices.end; ++v) {
        k_fan *fan = &g->fan[v];
        fan->begin += all->first_entry[i];
        if (g->m.vertex_halfedge[v] < 0)
            fan->area = 0.0f;
        else
            fan->area = (float)(unit * k_cotangent_row(&g->m, &kept, (loxo_index)v, &g->fan_entry[fan->begin]));
    }
}

static int64_t pieces_per_part(const loxo_mesh_view *m)
{
    int64_t most = 1;
    for (int64_t i = 0; i < m->n_parts; ++i) {
        const int64_t n_faces = m->part_face[i + 1] - m->part_face[i];
        if (most < (n_faces + MOST_SHAPES - 1) / MOST_SHAPES) most = (n_faces + MOST_SHAPES - 1) / MOST_SHAPES;
    }
    return most;
}

loxo_status geodesic_make_fans(loxo_geodesic *g)
{
    const int n_threads = loxo_threads_for(g->ctx, g->m.n_vertices, 60.0);
    const int64_t per_part = pieces_per_part(&g->m);
    pieces p = {.n = g->m.n_parts * per_part, .per_part = per_part};
    p.first_entry = loxo_allocate(g->ctx, p.n, sizeof *p.first_entry);
    if (p.first_entry == NULL) return LOXO_ERR_MEMORY;
    uint32_t n_entries = 0;
#pragma omp parallel num_threads(n_threads)
    {
#pragma omp for schedule(dynamic)
        for (int64_t i = 0; i < p.n; ++i)
            count_piece(g, &p, i);
#pragma omp single
        for (int64_t i = 0; i < p.n; ++i) {
            const uint32_t n = p.first_entry[i];
            p.first_entry[i] = n_entries;
            n_entries += n;
        }
#pragma omp for schedule(dynamic)
        for (int64_t i = 0; i < p.n; ++i)
            make_piece(g, &p, i);
    }
    g->fan[g->m.n_vertices] = (k_fan){n_entries, 0.0f};
    loxo_release(g->ctx, p.first_entry);
    return LOXO_OK;
}
