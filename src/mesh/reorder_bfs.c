/* SPDX-License-Identifier: MIT
 * Corners around vertices, and breadth-first orders, of the whole mesh or inside parts. */
#include "base/allocate.h"
#include "base/context.h"
#include "mesh/reorder_internal.h"
#include "par/range.h"

#include <string.h>

/* ---- corners at each vertex ------------------------------------------------------------------------------------ */

loxo_status loxo_fans_make(loxo_context *ctx, const loxo_mesh_arrays *arrays, loxo_fans *fans)
{
    const int64_t n = arrays->n_vertices, n_corners = 3 * arrays->n_faces;
    *fans = (loxo_fans){loxo_allocate_zero(ctx, n + 1, sizeof *fans->offset),
                        loxo_allocate(ctx, n_corners, sizeof *fans->corner)};
    if (fans->offset == NULL || fans->corner == NULL) {
        loxo_fans_destroy(ctx, fans);
        return LOXO_ERR_MEMORY;
    }
    /* Counts, then starts, then filled from behind, so that offset ends as the starts. */
    for (int64_t h = 0; h < n_corners; ++h)
        ++fans->offset[arrays->triangle[h]];
    for (int64_t v = 0; v < n; ++v)
        fans->offset[v + 1] = (loxo_index)(fans->offset[v + 1] + fans->offset[v]);
    for (int64_t h = n_corners - 1; h >= 0; --h)
        fans->corner[--fans->offset[arrays->triangle[h]]] = (loxo_index)h;
    return LOXO_OK;
}

void loxo_fans_destroy(loxo_context *ctx, loxo_fans *fans)
{
    loxo_release(ctx, fans->corner);
    loxo_release(ctx, fans->offset);
    *fans = (loxo_fans){0};
}

/* ---- breadth first --------------------------------------------------------------------------------------------- */

typedef struct walk {
    const loxo_index *triangle;
    loxo_fans fans;
    const loxo_index *part; /* NULL: all one part */
    unsigned char *mark;    /* [n_vertices] number of the last pass that met it; 2: has its place */
    loxo_index *queue;      /* [n_vertices] the order itself */
} walk;

/* Fills queue from `begin` with all that can be reached from seed inside its part; returns the end. */
static int64_t breadth_first(const walk *w, loxo_index seed, unsigned char pass, int64_t begin)
{
    int64_t end = begin;
    w->queue[end++] = seed;
    w->mark[seed] = pass;
    for (int64_t at = begin; at < end; ++at) {
        const loxo_index v = w->queue[at];
        for (loxo_index k = w->fans.offset[v]; k < w->fans.offset[v + 1]; ++k) {
            const loxo_index h = w->fans.corner[k], c = (loxo_index)(h % 3);
            for (int side = 1; side <= 2; ++side) {
                const loxo_index u = w->triangle[h - c + (c + side) % 3];
                if (w->part != NULL && w->part[u] != w->part[v]) continue;
                if (w->mark[u] >= pass) continue;
                w->mark[u] = pass;
                w->queue[end++] = u;
            }
        }
    }
    return end;
}

/* Every piece twice: from its lowest vertex to find one far away, then from that one for good. */
static void walk_part(const walk *w, const loxo_index *seeds, int64_t begin, int64_t end)
{
    int64_t at = begin;
    for (int64_t i = begin; i < end; ++i) {
        if (w->mark[seeds[i]] == 2) continue;
        const int64_t last = breadth_first(w, seeds[i], 1, at);
        at = breadth_first(w, w->queue[last - 1], 2, at);
    }
}

/* Used vertices by part, ascending inside each, then the unused. Returns the number of the used ones. */
static int64_t sort_by_part(const walk *w, const unsigned char *is_used, int64_t n, int64_t n_parts,
                            int64_t *part_vertex, loxo_index *seeds)
{
    int64_t n_used = 0, at_unused;
    memset(part_vertex, 0, (size_t)(n_parts + 1) * sizeof *part_vertex);
    for (int64_t v = 0; v < n; ++v)
        if (is_used[v]) ++part_vertex[w->part != NULL ? w->part[v] : 0];
    for (int64_t p = 0; p <= n_parts; ++p) {
        const int64_t count = part_vertex[p];
        part_vertex[p] = n_used;
        n_used += count;
    }
    at_unused = n_used;
    for (int64_t v = 0; v < n; ++v) {
        if (is_used[v])
            seeds[part_vertex[w->part != NULL ? w->part[v] : 0]++] = (loxo_index)v;
        else
            seeds[at_unused++] = (loxo_index)v;
    }
    for (int64_t p = n_parts; p > 0; --p) /* each start has moved to the next one's */
        part_vertex[p] = part_vertex[p - 1];
    part_vertex[0] = 0;
    return n_used;
}

loxo_status loxo_order_bfs(loxo_context *ctx, const loxo_mesh_arrays *arrays, const unsigned char *is_used,
                           const loxo_index *part, int64_t n_parts, int64_t *part_vertex, loxo_index *new_to_old)
{
    const int64_t n = arrays->n_vertices;
    walk w = {.triangle = arrays->triangle, .part = part, .queue = new_to_old};
    loxo_index *seeds = loxo_allocate(ctx, n, sizeof *seeds);
    loxo_status status = LOXO_ERR_MEMORY;
    w.mark = loxo_allocate_zero(ctx, n, sizeof *w.mark);
    if (seeds == NULL || w.mark == NULL) goto done;
    if ((status = loxo_fans_make(ctx, arrays, &w.fans)) < 0) goto done;
    const int64_t n_used = sort_by_part(&w, is_used, n, n_parts, part_vertex, seeds);
    const int n_threads = n_parts > 1 ? loxo_threads_for(ctx, n, 100.0) : 1;
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(n_parts);
        for (int64_t p = r.begin; p < r.end; ++p)
            walk_part(&w, seeds, part_vertex[p], part_vertex[p + 1]);
    }
    memcpy(new_to_old + n_used, seeds + n_used, (size_t)(n - n_used) * sizeof *new_to_old);
    part_vertex[n_parts] = n;
    status = LOXO_OK;
done:
    loxo_fans_destroy(ctx, &w.fans);
    loxo_release(ctx, w.mark);
    loxo_release(ctx, seeds);
    return status;
}
