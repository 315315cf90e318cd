/* SPDX-License-Identifier: MIT
 * What the rows of the heat system are made of and no source changes: neighbours, cotangent weights and areas, made once,
 * part by part: the shapes of a part's faces stay in the cache while its vertices look at them. Both ends of an edge get
 * the same weight to the bit. */
#include "base/allocate.h"
#include "par/range.h"
#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

#define MOST_SHAPES 2048 /* faces of a piece, 64 KiB; parts with more are cut into pieces */

/* The i-th share of a part's vertices and of its faces. Faces of other pieces are looked at again. */
typedef struct piece {
    loxo_range vertices, faces;
    uint32_t first_entry;
} piece;

static int64_t pieces_of_part(const loxo_mesh_view *m, int64_t part)
{
    const int64_t n_faces = m->part_face[part + 1] - m->part_face[part];
    return n_faces <= MOST_SHAPES ? 1 : (n_faces + MOST_SHAPES - 1) / MOST_SHAPES;
}

static loxo_range share_of(const int64_t *part_begin, int64_t part, int64_t i, int64_t n)
{
    const int64_t begin = part_begin[part];
    const loxo_range r = loxo_range_of(part_begin[part + 1] - begin, i, n);
    return (loxo_range){begin + r.begin, begin + r.end};
}

/* [*n]; the caller releases it. NULL: no memory. */
static piece *cut_pieces(loxo_context *ctx, const loxo_mesh_view *m, int64_t *n)
{
    *n = 0;
    for (int64_t part = 0; part < m->n_parts; ++part)
        *n += pieces_of_part(m, part);
    piece *pieces = loxo_allocate(ctx, *n, sizeof *pieces);
    if (pieces == NULL) return NULL;
    for (int64_t part = 0, k = 0; part < m->n_parts; ++part) {
        const int64_t n_pieces = pieces_of_part(m, part);
        for (int64_t i = 0; i < n_pieces; ++i)
            pieces[k++] = (piece){.vertices = share_of(m->part_vertex, part, i, n_pieces),
                                  .faces = share_of(m->part_face, part, i, n_pieces)};
    }
    return pieces;
}

static void count_piece(parallel_heat *g, piece *p)
{
    uint32_t n = 0;
    for (int64_t v = p->vertices.begin; v < p->vertices.end; ++v) {
        g->fan[v].begin = n;
        n += k_degree(&g->m, (loxo_index)v);
    }
    p->first_entry = n;
}

static void make_piece(parallel_heat *g, const piece *p)
{
    k_face_shape room[MOST_SHAPES];
    const k_face_shapes kept = {p->faces.begin, p->faces.end, room};
    const double unit = 1.0 / (g->mean_edge_length * g->mean_edge_length);
    for (int64_t f = kept.begin; f < kept.end; ++f)
        room[f - kept.begin] = k_shape_of_face(&g->m, f);
    for (int64_t v = p->vertices.begin; v < p->vertices.end; ++v) {
        k_fan *fan = &g->fan[v];
        fan->begin += p->first_entry;
        fan->area = 0.0f;
        if (g->m.vertex_halfedge[v] >= 0)
            fan->area = (float)(unit * k_cotangent_row(&g->m, &kept, (loxo_index)v, &g->fan_entry[fan->begin]));
    }
}

/* Asked by the calling thread before each of its pieces; once it said so, all others are skipped. */
static bool is_stopped(const parallel_heat *g, bool *stopped, double fraction)
{
    if (loxo_thread_id() == 0 && loxo_stop_wanted(g->ctx, "prepare", fraction))
        __atomic_store_n(stopped, true, __ATOMIC_RELAXED);
    return __atomic_load_n(stopped, __ATOMIC_RELAXED);
}

loxo_status heat_make_fans(parallel_heat *g)
{
    int64_t n_pieces;
    uint32_t n_entries = 0;
    bool stopped = false;
    piece *pieces = cut_pieces(g->ctx, &g->m, &n_pieces);
    if (pieces == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, g->m.n_vertices, 60.0))
    {
#pragma omp for schedule(dynamic)
        for (int64_t i = 0; i < n_pieces; ++i)
            if (!is_stopped(g, &stopped, 0.3 * (double)i / (double)n_pieces)) count_piece(g, &pieces[i]);
#pragma omp single
        for (int64_t i = 0; i < n_pieces; ++i) {
            const uint32_t n = pieces[i].first_entry;
            pieces[i].first_entry = n_entries;
            n_entries += n;
        }
#pragma omp for schedule(dynamic)
        for (int64_t i = 0; i < n_pieces; ++i)
            if (!is_stopped(g, &stopped, 0.3 + 0.7 * (double)i / (double)n_pieces)) make_piece(g, &pieces[i]);
    }
    g->fan[g->m.n_vertices] = (k_fan){n_entries, 0.0f};
    loxo_release(g->ctx, pieces);
    return stopped ? loxo_fail(g->ctx, LOXO_ERR_STOPPED, "geodesic: stopped before there was any distance") : LOXO_OK;
}
