/* SPDX-License-Identifier: MIT
 * From the caller's sources to seeds: in the mesh's numbers, sorted, each once. */
#include "base/allocate.h"
#include "solver/geodesic/geodesic_internal.h"

#include <inttypes.h>
#include <stdlib.h>

static int compare_seeds(const void *a, const void *b)
{
    const geodesic_seed *x = a, *y = b;
    if (x->vertex != y->vertex) return (x->vertex > y->vertex) - (x->vertex < y->vertex);
    return (x->source > y->source) - (x->source < y->source);
}

static geodesic_seed seed_at_vertex(const loxo_mesh_view *m, int64_t v, loxo_index source)
{
    const loxo_index h = m->vertex_halfedge[v];
    geodesic_seed seed = {.vertex = (loxo_index)v, .face = (loxo_index)(h / 3), .source = source};
    seed.weight[h % 3] = 1.0;
    return seed;
}

static bool has_copies(const geodesic_problem *problem)
{
    return problem->mesh->caller_to_mesh != NULL && problem->m.vertex_origin != NULL;
}

/* A repair may have split a source's vertex: all its copies are seeds. own [n_sources] the first copies; list [n_vertices]
 * receives vertices and the source of each. */
static loxo_status seeds_of_copies(const geodesic_problem *problem, const loxo_index *own, int64_t n_sources,
                                   geodesic_seed **seeds, int64_t *n_seeds)
{
    loxo_context *ctx = problem->ctx;
    const loxo_mesh_view *m = &problem->m;
    const int64_t n_caller = loxo_mesh_n_vertices(problem->mesh);
    loxo_index *source_of = loxo_allocate(ctx, n_caller, sizeof *source_of);
    int64_t n = 0;
    if (source_of == NULL) return LOXO_ERR_MEMORY;
    for (int64_t v = 0; v < n_caller; ++v)
        source_of[v] = -1;
    for (int64_t i = n_sources - 1; i >= 0; --i)
        source_of[m->vertex_origin[own[i]]] = (loxo_index)i;
    for (int64_t v = 0; v < m->n_vertices; ++v)
        n += source_of[m->vertex_origin[v]] >= 0 && m->vertex_halfedge[v] >= 0;
    geodesic_seed *list = loxo_allocate(ctx, n, sizeof *list);
    if (list != NULL) {
        *seeds = list;
        *n_seeds = n;
        for (int64_t v = 0, k = 0; v < m->n_vertices; ++v) {
            const loxo_index source = source_of[m->vertex_origin[v]];
            if (source >= 0 && m->vertex_halfedge[v] >= 0) list[k++] = seed_at_vertex(m, v, source);
        }
    }
    loxo_release(ctx, source_of);
    return list != NULL ? LOXO_OK : LOXO_ERR_MEMORY;
}

/* The mesh's numbers of the caller's, in a new array. */
static loxo_status find_own(const geodesic_problem *problem, const loxo_index *sources, int64_t n_sources,
                            loxo_index **own)
{
    loxo_context *ctx = problem->ctx;
    const int64_t n = loxo_mesh_n_vertices(problem->mesh);
    *own = NULL;
    if (sources == NULL || n_sources < 1) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "geodesic: there is no source");
    for (int64_t i = 0; i < n_sources; ++i) {
        const loxo_place place = {.byte = -1, .element = sources[i]};
        if (sources[i] < 0 || sources[i] >= n)
            return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, place, "geodesic: source %" PRId64 " is not in 0..%" PRId64,
                                (int64_t)sources[i], n - 1);
    }
    loxo_index *list = loxo_allocate(ctx, n_sources, sizeof *list);
    if (list == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_mesh_indices_from_caller(problem->mesh, n_sources, sources, list);
    for (int64_t i = 0; i < n_sources && status >= 0; ++i) {
        if (list[i] >= 0 && problem->m.vertex_halfedge[list[i]] >= 0) continue;
        const loxo_place place = {.byte = -1, .element = sources[i]};
        status = loxo_fail_at(ctx, LOXO_ERR_MESH, place, "geodesic: source %" PRId64 " belongs to no face",
                              (int64_t)sources[i]);
    }
    if (status < 0) {
        loxo_release(ctx, list);
        return status;
    }
    *own = list;
    return LOXO_OK;
}

loxo_status geodesic_seeds_from_vertices(const geodesic_problem *problem, const loxo_index *sources, int64_t n_sources,
                                         geodesic_seed **seeds, int64_t *n_seeds)
{
    loxo_index *own;
    geodesic_seed *list = NULL;
    int64_t n = n_sources;
    *seeds = NULL;
    *n_seeds = 0;
    loxo_status status = find_own(problem, sources, n_sources, &own);
    if (status < 0) return status;
    if (has_copies(problem)) {
        status = seeds_of_copies(problem, own, n_sources, &list, &n);
    } else if ((list = loxo_allocate(problem->ctx, n, sizeof *list)) == NULL) {
        status = LOXO_ERR_MEMORY;
    } else {
        for (int64_t i = 0; i < n; ++i)
            list[i] = seed_at_vertex(&problem->m, own[i], (loxo_index)i);
    }
    loxo_release(problem->ctx, own);
    if (status < 0) return status;
    qsort(list, (size_t)n, sizeof *list, compare_seeds);
    int64_t n_kept = 1;
    for (int64_t i = 1; i < n; ++i)
        if (list[i].vertex != list[n_kept - 1].vertex) list[n_kept++] = list[i];
    *seeds = list;
    *n_seeds = n_kept;
    return LOXO_OK;
}
