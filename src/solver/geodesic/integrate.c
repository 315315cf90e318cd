/* SPDX-License-Identifier: MIT
 * Integration (section 3.3): distances add up along the breadth-first tree, level by level. */
#include "par/range.h"
#include "solver/geodesic/geodesic_internal.h"

#define MIN_LEVEL_PER_THREAD 4096 /* an addition a vertex: smaller levels are not worth a barrier */

/* From the differences along the tree's edges in value[2 p + 1] to distances there. The half-edge to the parent is
 * replaced by the parent's place first, so that the sums run through memory in order. */
void geodesic_integrate(loxo_geodesic *g)
{
    const int64_t n = g->n_reached, per_level = n / g->n_levels;
    int n_threads = loxo_threads_for(g->ctx, n, 10.0);
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t p = r.begin; p < r.end; ++p) {
            const loxo_index h = g->parent[p];
            if (h < 0) continue;
            const loxo_index start = g->m.halfedge_vertex[h];
            g->parent[p] = g->rank[start == g->order[p] ? k_head(&g->m, h) : start];
        }
    }
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
