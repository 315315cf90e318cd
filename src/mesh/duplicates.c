/* SPDX-License-Identifier: MIT */
#include "base/allocate.h"
#include "base/rng.h"
#include "base/sort.h"
#include "mesh/soup.h"
#include "par/range.h"

#include <string.h>

/* ---- faces --------------------------------------------------------------------------------------------------- */

/* The two larger vertices of a face in one number. */
static uint64_t larger_corners(const loxo_index *corner)
{
    const loxo_index lowest = loxo_smallest_corner(corner);
    loxo_index a = corner[0], b = corner[1];
    if (a == lowest)
        a = corner[2];
    else if (b == lowest)
        b = corner[2];
    return a < b ? (uint64_t)a << 32 | (uint64_t)b : (uint64_t)b << 32 | (uint64_t)a;
}

static bool by_corners(const void *arg, const void *item_a, const void *item_b)
{
    const loxo_index *triangle = arg, a = *(const loxo_index *)item_a, b = *(const loxo_index *)item_b;
    const uint64_t key_a = larger_corners(&triangle[(int64_t)3 * a]);
    const uint64_t key_b = larger_corners(&triangle[(int64_t)3 * b]);
    return key_a != key_b ? key_a < key_b : a < b;
}

loxo_status loxo_mark_duplicate_faces(loxo_context *ctx, int64_t n_vertices, int64_t n_faces,
                                      const loxo_index *triangle, uint8_t *duplicate)
{
    loxo_status status = LOXO_ERR_MEMORY;
    int64_t *begin = NULL;
    loxo_index *order = loxo_allocate(ctx, n_faces, sizeof *order);
    if (order == NULL) goto done;
    begin = loxo_allocate(ctx, n_vertices + 1, sizeof *begin);
    if (begin == NULL) goto done;
    loxo_sort_faces(ctx, n_vertices, n_faces, triangle, order, begin);
#pragma omp parallel num_threads(loxo_threads_for(ctx, n_faces, 20))
    {
        const loxo_range r = loxo_thread_range(n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v) {
            loxo_index *face = order + begin[v];
            const int64_t n = begin[v + 1] - begin[v];
            loxo_sort(face, n, sizeof *face, by_corners, triangle);
            for (int64_t i = 0; i < n; ++i) {
                const loxo_index *corner = &triangle[(int64_t)3 * face[i]];
                duplicate[face[i]] = i > 0 && !loxo_is_degenerate(corner) &&
                                     larger_corners(corner) == larger_corners(&triangle[(int64_t)3 * face[i - 1]]) &&
                                     !loxo_is_degenerate(&triangle[(int64_t)3 * face[i - 1]]);
            }
        }
    }
    status = LOXO_OK;
done:
    loxo_release(ctx, begin);
    loxo_release(ctx, order);
    return status;
}

/* ---- vertices ------------------------------------------------------------------------------------------------ */

/* -0 and 0 give the same. */
static uint64_t position_hash(const double p[3])
{
    uint64_t hash = 0;
    for (int k = 0; k < 3; ++k) {
        const double x = p[k] == 0.0 ? 0.0 : p[k];
        uint64_t bits;
        memcpy(&bits, &x, sizeof bits);
        hash = loxo_random_u64(hash, bits);
    }
    return hash;
}

static bool same_position(const loxo_mesh_arrays *arrays, int64_t a, int64_t b)
{
    double p[3], q[3];
    loxo_arrays_position(arrays, a, p);
    loxo_arrays_position(arrays, b, q);
    return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

loxo_status loxo_find_duplicate_vertices(loxo_context *ctx, const loxo_mesh_arrays *arrays, loxo_index *first)
{
    const int64_t n = arrays->n_vertices;
    loxo_status status = LOXO_ERR_MEMORY;
    uint32_t *vertex = NULL;
    uint64_t *key = loxo_allocate(ctx, n, sizeof *key);
    if (key == NULL) goto done;
    vertex = loxo_allocate(ctx, n, sizeof *vertex);
    if (vertex == NULL) goto done;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 10))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v) {
            double p[3];
            loxo_arrays_position(arrays, v, p);
            key[v] = position_hash(p);
            vertex[v] = (uint32_t)v;
        }
    }
    if ((status = loxo_sort_u64(ctx, n, key, vertex, 64)) < 0) goto done;
    /* The sort is stable, so a run of equal hashes is in ascending order. Its vertices nearly always are at one place;
     * a place met after another one in the same run is a collision of 64-bit hashes, looked for all the same. */
    for (int64_t begin = 0, end; begin < n; begin = end) {
        end = begin + 1;
        while (end < n && key[end] == key[begin])
            ++end;
        for (int64_t i = begin; i < end; ++i) {
            first[vertex[i]] = (loxo_index)vertex[i];
            if (i == begin || !loxo_arrays_finite(arrays, vertex[i])) continue;
            for (int64_t j = begin; j < i; ++j) {
                if (!same_position(arrays, vertex[i], vertex[j])) continue;
                first[vertex[i]] = first[vertex[j]];
                break;
            }
        }
    }
done:
    loxo_release(ctx, vertex);
    loxo_release(ctx, key);
    return status;
}
