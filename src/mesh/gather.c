/* SPDX-License-Identifier: MIT */
#include "mesh/gather.h"

#include "base/allocate.h"
#include "base/context.h"

#include <inttypes.h>

#define BLOCK 4096 /* faces */

/* The vertices that a block of faces touches: lowest and highest number. */
typedef struct span {
    int64_t low, high;
} span;

/* Returns the first face of the block that names a vertex there is not, or -1. */
static int64_t find_span(const loxo_mesh_arrays *m, loxo_range block, span *s)
{
    *s = (span){INT64_MAX, -1};
    for (int64_t i = 3 * block.begin; i < 3 * block.end; ++i) {
        const int64_t v = m->triangle[i];
        if (v < 0 || v >= m->n_vertices) return i / 3;
        s->low = v < s->low ? v : s->low;
        s->high = v > s->high ? v : s->high;
    }
    return -1;
}

static loxo_range block_of(const loxo_mesh_arrays *m, int64_t b)
{
    const int64_t end = (b + 1) * BLOCK;
    return (loxo_range){b * BLOCK, end < m->n_faces ? end : m->n_faces};
}

loxo_status loxo_gather_faces(loxo_context *ctx, const loxo_mesh_arrays *arrays, double ns_each, loxo_take_fn take,
                              void *arg)
{
    const int64_t n_blocks = (arrays->n_faces + BLOCK - 1) / BLOCK;
    int64_t wrong = INT64_MAX;
    span *spans = loxo_allocate(ctx, n_blocks, sizeof *spans);
    if (spans == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(ctx, arrays->n_faces, 1.0)) reduction(min : wrong)
    {
        const loxo_range r = loxo_thread_range(n_blocks);
        for (int64_t b = r.begin; b < r.end; ++b) {
            const int64_t face = find_span(arrays, block_of(arrays, b), &spans[b]);
            if (face >= 0 && face < wrong) wrong = face;
        }
    }
    if (wrong < INT64_MAX) {
        loxo_release(ctx, spans);
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.byte = -1, .element = wrong},
                            "face %" PRId64 ": a vertex number is not in 0..%" PRId64, wrong, arrays->n_vertices - 1);
    }
#pragma omp parallel num_threads(loxo_threads_for(ctx, arrays->n_faces, ns_each))
    {
        const loxo_range own = loxo_thread_range(arrays->n_vertices);
        for (int64_t b = 0; b < n_blocks; ++b) {
            const loxo_range block = block_of(arrays, b);
            if (spans[b].high >= own.begin && spans[b].low < own.end) take(arg, block.begin, block.end, own);
        }
    }
    loxo_release(ctx, spans);
    return LOXO_OK;
}
