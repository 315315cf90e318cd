/* SPDX-License-Identifier: MIT
 * Integration (section 3.3): distances add up along the breadth-first tree, level by level. */
#include "par/range.h"
#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

#define MIN_LEVEL_PER_THREAD 4096 /* an addition a vertex: smaller levels are not worth a barrier */

/* From the steps along the tree's edges in value[2 p + 1] to distances there. */
void heat_integrate(parallel_heat *g)
{
    const int64_t per_level = g->n_reached / g->n_levels;
    int n_threads = loxo_threads_for(g->ctx, g->n_reached, 10.0);
    if (per_level / MIN_LEVEL_PER_THREAD < n_threads) n_threads = (int)(per_level / MIN_LEVEL_PER_THREAD);
    if (n_threads < 1) n_threads = 1;
    for (int64_t p = 0; p < g->level_begin[1]; ++p)
        g->value[2 * p + 1] = g->start_distance != NULL ? g->start_distance[p] : 0.0;
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
