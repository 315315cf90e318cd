/* SPDX-License-Identifier: MIT */
#include "mesh/components.h"

#include "mesh/halfedge.h"
#include "mesh/soup.h"
#include "par/range.h"

static void start_sets(int64_t n_vertices, loxo_index *parent)
{
    const loxo_range r = loxo_thread_range(n_vertices);
    for (int64_t v = r.begin; v < r.end; ++v)
        parent[v] = (loxo_index)v;
}

int64_t loxo_join_faces(loxo_context *ctx, int64_t n_vertices, int64_t n_faces, const loxo_index *triangle,
                        loxo_index *parent)
{
    int64_t n_unions = 0;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n_faces, 10)) reduction(+ : n_unions)
    {
        const loxo_range r = loxo_thread_range(n_faces), v = loxo_thread_range(n_vertices);
        start_sets(n_vertices, parent);
#pragma omp barrier
        for (int64_t f = r.begin; f < r.end; ++f) {
            const loxo_index *corner = &triangle[3 * f];
            if (loxo_is_degenerate(corner)) continue;
            n_unions += loxo_set_unite(parent, corner[0], corner[1]);
            n_unions += loxo_set_unite(parent, corner[0], corner[2]);
        }
#pragma omp barrier
        for (int64_t i = v.begin; i < v.end; ++i)
            __atomic_store_n(&parent[i], loxo_set_find(parent, (loxo_index)i), __ATOMIC_RELAXED);
    }
    return n_unions;
}

int64_t loxo_join_boundary(loxo_context *ctx, int64_t n_vertices, int64_t n_faces, const loxo_index *triangle,
                           const loxo_index *twin, loxo_index *parent)
{
    int64_t n_unions = 0;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n_faces, 5)) reduction(+ : n_unions)
    {
        const loxo_range r = loxo_thread_range(3 * n_faces);
        start_sets(n_vertices, parent);
#pragma omp barrier
        for (int64_t h = r.begin; h < r.end; ++h)
            if (twin[h] == -1)
                n_unions += loxo_set_unite(parent, triangle[h], triangle[loxo_halfedge_next((loxo_index)h)]);
    }
    return n_unions;
}
