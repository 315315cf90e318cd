/* SPDX-License-Identifier: MIT */
#include "mesh/partition.h"

#include "base/allocate.h"
#include "base/context.h"
#include "loxo_config.h"
#include "mesh/reorder_internal.h"

#ifdef LOXO_WITH_METIS
#include <inttypes.h>
#include <metis.h>

/* What METIS itself allocates, for the graph of a triangle mesh: 12.7 GB at 100 million vertices, graph included. */
#define METIS_BYTES_A_VERTEX 100

/* Neighbours of each vertex, once each. */
typedef struct graph {
    idx_t n;
    idx_t *offset; /* [n + 1] */
    idx_t *neighbour;
} graph;

static void graph_destroy(loxo_context *ctx, graph *g)
{
    loxo_release(ctx, g->neighbour);
    loxo_release(ctx, g->offset);
    *g = (graph){0};
}

/* Neighbours of v, each marked with v when first met; stored where out is not NULL. */
static int64_t gather(const loxo_mesh_arrays *arrays, const loxo_fans *fans, loxo_index v, loxo_index *met, idx_t *out)
{
    int64_t count = 0;
    for (loxo_index k = fans->offset[v]; k < fans->offset[v + 1]; ++k) {
        const loxo_index h = fans->corner[k], c = (loxo_index)(h % 3);
        for (int side = 1; side <= 2; ++side) {
            const loxo_index u = arrays->triangle[h - c + (c + side) % 3];
            if (u == v || met[u] == v) continue;
            met[u] = v;
            if (out != NULL) out[count] = u;
            ++count;
        }
    }
    return count;
}

/* Twice over the fans: once to count, once to store. */
static loxo_status graph_make(loxo_context *ctx, const loxo_mesh_arrays *arrays, graph *g)
{
    const int64_t n = arrays->n_vertices;
    loxo_index *met = loxo_allocate(ctx, n, sizeof *met);
    loxo_fans fans = {0};
    loxo_status status = LOXO_ERR_MEMORY;
    int64_t n_arcs = 0;
    *g = (graph){.n = (idx_t)n, .offset = loxo_allocate(ctx, n + 1, sizeof *g->offset)};
    if (met == NULL || g->offset == NULL) goto done;
    if ((status = loxo_fans_make(ctx, arrays, &fans)) < 0) goto done;
    for (int64_t v = 0; v < n; ++v)
        met[v] = -1;
    for (int64_t v = 0; v < n; ++v) {
        g->offset[v] = (idx_t)n_arcs;
        n_arcs += gather(arrays, &fans, (loxo_index)v, met, NULL);
        if (n_arcs > IDX_MAX) {
            status = loxo_fail(ctx, LOXO_ERR_LIMIT, "METIS: more arcs than its numbers reach (%" PRId64 ")",
                               (int64_t)IDX_MAX);
            goto done;
        }
    }
    g->offset[n] = (idx_t)n_arcs;
    status = LOXO_ERR_MEMORY;
    g->neighbour = loxo_allocate(ctx, n_arcs, sizeof *g->neighbour);
    if (g->neighbour == NULL) goto done;
    for (int64_t v = 0; v < n; ++v)
        met[v] = -1;
    for (int64_t v = 0; v < n; ++v)
        (void)gather(arrays, &fans, (loxo_index)v, met, g->neighbour + g->offset[v]);
    status = LOXO_OK;
done:
    loxo_fans_destroy(ctx, &fans);
    loxo_release(ctx, met);
    if (status < 0) graph_destroy(ctx, g);
    return status;
}

static loxo_status metis_status(loxo_context *ctx, int code)
{
    if (code == METIS_OK) return LOXO_OK;
    if (code == METIS_ERROR_MEMORY) return loxo_fail(ctx, LOXO_ERR_MEMORY, "METIS: out of memory");
    return loxo_fail(ctx, LOXO_ERR_NUMERIC, "METIS: failed with code %d", code);
}

/* The graph, after a look at the memory that METIS will want beside it. */
static loxo_status prepare(loxo_context *ctx, const loxo_mesh_arrays *arrays, graph *g, idx_t options[METIS_NOPTIONS])
{
    loxo_status status = graph_make(ctx, arrays, g);
    if (status < 0) return status;
    METIS_SetDefaultOptions(options);
    options[METIS_OPTION_NUMBERING] = 0;
    options[METIS_OPTION_SEED] = 1;
    status = loxo_memory_check(ctx, (size_t)arrays->n_vertices * METIS_BYTES_A_VERTEX, "METIS");
    if (status < 0) graph_destroy(ctx, g);
    return status;
}

loxo_status loxo_partition_parts(loxo_context *ctx, const loxo_mesh_arrays *arrays, int64_t n_parts, loxo_index *part)
{
    const int64_t n = arrays->n_vertices;
    idx_t options[METIS_NOPTIONS], n_constraints = 1, n_wanted = (idx_t)n_parts, cut = 0;
    graph g;
    loxo_status status = prepare(ctx, arrays, &g, options);
    if (status < 0) return status;
    idx_t *assigned = loxo_allocate(ctx, n, sizeof *assigned);
    status = assigned == NULL
                 ? LOXO_ERR_MEMORY
                 : metis_status(ctx, METIS_PartGraphKway(&g.n, &n_constraints, g.offset, g.neighbour, NULL, NULL, NULL,
                                                         &n_wanted, NULL, NULL, options, &cut, assigned));
    for (int64_t v = 0; status >= 0 && v < n; ++v)
        part[v] = (loxo_index)assigned[v];
    loxo_release(ctx, assigned);
    graph_destroy(ctx, &g);
    return status;
}

loxo_status loxo_partition_dissect(loxo_context *ctx, const loxo_mesh_arrays *arrays, const unsigned char *is_used,
                                   loxo_index *new_to_old)
{
    const int64_t n = arrays->n_vertices;
    idx_t options[METIS_NOPTIONS];
    graph g;
    loxo_status status = prepare(ctx, arrays, &g, options);
    if (status < 0) return status;
    idx_t *order = loxo_allocate(ctx, 2 * n, sizeof *order);
    status = order == NULL
                 ? LOXO_ERR_MEMORY
                 : metis_status(ctx, METIS_NodeND(&g.n, g.offset, g.neighbour, NULL, options, order, order + n));
    int64_t at = 0;
    for (int64_t i = 0; status >= 0 && i < n; ++i) /* row i of the new matrix is row order[i] of the old */
        if (is_used[order[i]]) new_to_old[at++] = (loxo_index)order[i];
    for (int64_t v = 0; status >= 0 && v < n; ++v)
        if (!is_used[v]) new_to_old[at++] = (loxo_index)v;
    loxo_release(ctx, order);
    graph_destroy(ctx, &g);
    return status;
}

#else

static loxo_status metis_is_off(loxo_context *ctx)
{
    return loxo_fail(ctx, LOXO_ERR_UNSUPPORTED, "METIS is off in this build: choose the Hilbert order");
}

loxo_status loxo_partition_parts(loxo_context *ctx, const loxo_mesh_arrays *arrays, int64_t n_parts, loxo_index *part)
{
    (void)arrays, (void)n_parts, (void)part;
    return metis_is_off(ctx);
}

loxo_status loxo_partition_dissect(loxo_context *ctx, const loxo_mesh_arrays *arrays, const unsigned char *is_used,
                                   loxo_index *new_to_old)
{
    (void)arrays, (void)is_used, (void)new_to_old;
    return metis_is_off(ctx);
}

#endif
