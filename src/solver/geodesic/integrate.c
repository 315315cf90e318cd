/* SPDX-License-Identifier: MIT
 * Integration (section 3.3): distances add up along the breadth-first tree, level by level. */
#include "par/range.h"
#include "solver/geodesic/tree.h"

#define MIN_LEVEL_PER_THREAD 4096 /* an addition a vertex: smaller levels are not worth a barrier */

/* Half-edge between vertex v and one of its neighbours. */
static loxo_index halfedge_between(const loxo_mesh_view *m, loxo_index v, loxo_index neighbour)
{
    loxo_index h = m->vertex_halfedge[v];
    while (k_head(m, h) != neighbour) {
        const loxo_index back = k_previous(h);
        if (m->halfedge_vertex[back] == neighbour) return back;
        h = m->halfedge_twin[back];
    }
    return h;
}

void geodesic_find_tree_halfedges(loxo_geodesic *g)
{
    const int64_t n = g->m.n_vertices;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, n, 20.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v) {
            const int64_t p = g->rank[v], next = v + PLACES_AHEAD < n ? g->rank[v + PLACES_AHEAD] : -1;
            if (next >= 0) __builtin_prefetch(&g->parent[next], 1, 2);
            if (p < 0 || g->parent[p] < 0) continue;
            g->parent[p] = halfedge_between(&g->m, (loxo_index)v, g->order[g->parent[p]]);
        }
    }
}

int64_t geodesic_vertices_before(const loxo_geodesic *g, int64_t f)
{
    const loxo_mesh_view *m = &g->m;
    int64_t low = 0, high = m->n_parts; /* part_face[low] <= f < part_face[high] */
    if (f <= 0) return 0;
    if (f >= m->n_faces) return m->n_vertices;
    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        if (m->part_face[middle] <= f)
            low = middle;
        else
            high = middle;
    }
    const int64_t n_vertices = m->part_vertex[high] - m->part_vertex[low];
    const double share = (double)(f - m->part_face[low]) / (double)(m->part_face[high] - m->part_face[low]);
    return m->part_vertex[low] + (int64_t)(share * (double)n_vertices);
}

/* From the differences along the tree's edges in value[2 p + 1] to distances there; parent holds places by now, so that
 * the sums run through memory in order. */
void geodesic_integrate(loxo_geodesic *g)
{
    const int64_t per_level = g->n_reached / g->n_levels;
    int n_threads = loxo_threads_for(g->ctx, g->n_reached, 10.0);
    if (per_level / MIN_LEVEL_PER_THREAD < n_threads) n_threads = (int)(per_level / MIN_LEVEL_PER_THREAD);
    if (n_threads < 1) n_threads = 1;
#pragma omp parallel num_threads(n_threads)
    {
        for (int64_t level = 1; level < g->n_levels; ++level) {
            const int64_t base = g->level_begin[level];
            const loxo_range r = loxo_thread_range(g->level_begin[level + 1] - base);
            for (int64_t p = base + r.begin; p < base + r.end; ++p)
                g->value[2 * p + 1] += g->value[2 * (int64_t)g->parent[p] + 1];
#pragma omp barrier
        }
    }
}
