/* SPDX-License-Identifier: MIT
 * Lumped areas. Each thread has a range of vertices and passes over the blocks of faces that touch it, so that every vertex adds up
 * its faces in their order, whatever the number of threads. */
#include "base/allocate.h"
#include "base/context.h"
#include "kernel/vec3.h"
#include "mesh/soup.h"
#include "par/range.h"

#include <loxo/mesh.h>

#include <inttypes.h>
#include <math.h>

#define BLOCK 4096 /* faces */

/* The vertices that a block of faces touches: lowest and highest number. */
typedef struct span {
    int64_t low, high;
} span;

static loxo_vec3 corner(const loxo_mesh_arrays *m, loxo_index v)
{
    double p[3];
    loxo_arrays_position(m, v, p);
    return v3_load(p);
}

/* Returns the first face of the block that names a vertex there is not, or -1. */
static int64_t find_span(const loxo_mesh_arrays *m, int64_t begin, int64_t end, span *s)
{
    *s = (span){INT64_MAX, -1};
    for (int64_t i = 3 * begin; i < 3 * end; ++i) {
        const int64_t v = m->triangle[i];
        if (v < 0 || v >= m->n_vertices) return i / 3;
        s->low = v < s->low ? v : s->low;
        s->high = v > s->high ? v : s->high;
    }
    return -1;
}

static void add_block(const loxo_mesh_arrays *m, int64_t begin, int64_t end, loxo_range own, double *area)
{
    for (int64_t f = begin; f < end; ++f) {
        const loxo_index *v = m->triangle + 3 * f;
        const bool is_own[3] = {v[0] >= own.begin && v[0] < own.end, v[1] >= own.begin && v[1] < own.end,
                                v[2] >= own.begin && v[2] < own.end};
        if (!is_own[0] && !is_own[1] && !is_own[2]) continue;
        const loxo_vec3 a = corner(m, v[0]), b = corner(m, v[1]), c = corner(m, v[2]);
        const double third = v3_norm(v3_cross(v3_sub(b, a), v3_sub(c, a))) / 6.0;
        for (int k = 0; k < 3; ++k)
            if (is_own[k]) area[v[k]] += third;
    }
}

/* Returns the first vertex of the range whose area is not finite, or -1. */
static int64_t add_range(const loxo_mesh_arrays *m, const span *spans, int64_t n_blocks, loxo_range own, double *area)
{
    for (int64_t v = own.begin; v < own.end; ++v)
        area[v] = 0.0;
    for (int64_t b = 0; b < n_blocks; ++b) {
        const int64_t begin = b * BLOCK, end = begin + BLOCK < m->n_faces ? begin + BLOCK : m->n_faces;
        if (spans[b].high >= own.begin && spans[b].low < own.end) add_block(m, begin, end, own, area);
    }
    for (int64_t v = own.begin; v < own.end; ++v)
        if (!isfinite(area[v])) return v;
    return -1;
}

loxo_status loxo_mesh_vertex_areas(loxo_context *ctx, const loxo_mesh_arrays *arrays, double *area)
{
    const loxo_status status = loxo_arrays_check_counts(ctx, "vertex areas", arrays);
    if (status < 0) return status;
    if (area == NULL && arrays->n_vertices > 0)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "vertex areas: nowhere to put them");
    const int64_t n_blocks = (arrays->n_faces + BLOCK - 1) / BLOCK;
    int64_t wrong = INT64_MAX;
    span *spans = loxo_allocate(ctx, n_blocks, sizeof *spans);
    if (spans == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(loxo_threads_for(ctx, arrays->n_faces, 1.0)) reduction(min : wrong)
    {
        const loxo_range r = loxo_thread_range(n_blocks);
        for (int64_t b = r.begin; b < r.end; ++b) {
            const int64_t end = (b + 1) * BLOCK < arrays->n_faces ? (b + 1) * BLOCK : arrays->n_faces;
            const int64_t face = find_span(arrays, b * BLOCK, end, &spans[b]);
            if (face >= 0 && face < wrong) wrong = face;
        }
    }
    if (wrong < INT64_MAX) {
        loxo_release(ctx, spans);
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.byte = -1, .element = wrong},
                            "face %" PRId64 ": a vertex number is not in 0..%" PRId64, wrong, arrays->n_vertices - 1);
    }
#pragma omp parallel num_threads(loxo_threads_for(ctx, arrays->n_faces, 4.0)) reduction(min : wrong)
    {
        const int64_t vertex = add_range(arrays, spans, n_blocks, loxo_thread_range(arrays->n_vertices), area);
        if (vertex >= 0) wrong = vertex;
    }
    loxo_release(ctx, spans);
    if (wrong < INT64_MAX)
        return loxo_fail_at(ctx, LOXO_ERR_MESH, (loxo_place){.byte = -1, .element = wrong},
                            "vertex areas: the area around vertex %" PRId64 " is not finite", wrong);
    return LOXO_OK;
}
