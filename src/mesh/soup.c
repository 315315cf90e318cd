/* SPDX-License-Identifier: MIT */
#include "mesh/soup.h"

#include "base/allocate.h"
#include "base/rng.h"
#include "base/sort.h"
#include "par/range.h"

#include <stdalign.h>
#include <string.h>

void loxo_soup_destroy(loxo_context *ctx, loxo_soup *soup)
{
    if (soup == NULL) return;
    loxo_release(ctx, soup->position);
    loxo_release(ctx, soup->position_float);
    loxo_release(ctx, soup->triangle);
    for (int i = 0; soup->fields != NULL && i < soup->n_fields; ++i)
        loxo_release(ctx, soup->fields[i].value);
    loxo_release(ctx, soup->fields);
    *soup = (loxo_soup){0};
}

loxo_mesh_arrays loxo_soup_arrays(const loxo_soup *soup)
{
    return (loxo_mesh_arrays){
        .n_vertices = soup->n_vertices,
        .n_faces = soup->n_faces,
        .position = soup->position,
        .position_float = soup->position_float,
        .triangle = soup->triangle,
    };
}

void *loxo_gather(loxo_context *ctx, const void *from, const loxo_index *origin, int64_t n, size_t size)
{
    unsigned char *to = loxo_allocate(ctx, n, size);
    if (to == NULL) return NULL;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 5))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            memcpy(to + (size_t)i * size, (const unsigned char *)from + (size_t)origin[i] * size, size);
    }
    return to;
}

loxo_status loxo_soup_gather_vertices(loxo_context *ctx, loxo_soup *soup, const loxo_index *origin, int64_t n)
{
    const size_t size = 3 * (soup->position != NULL ? sizeof(double) : sizeof(float));
    const void *from = soup->position != NULL ? (const void *)soup->position : (const void *)soup->position_float;
    double **value = NULL;
    void *position = NULL;
    int n_done = 0;
    if (soup->n_fields > 0) {
        value = loxo_allocate(ctx, soup->n_fields, sizeof *value);
        if (value == NULL) return LOXO_ERR_MEMORY;
    }
    for (; n_done < soup->n_fields; ++n_done) {
        value[n_done] = loxo_gather(ctx, soup->fields[n_done].value, origin, n, sizeof(double));
        if (value[n_done] == NULL) goto fail;
    }
    if (from != NULL && (position = loxo_gather(ctx, from, origin, n, size)) == NULL) goto fail;
    for (int i = 0; i < soup->n_fields; ++i) {
        loxo_release(ctx, soup->fields[i].value);
        soup->fields[i].value = value[i];
    }
    loxo_release(ctx, value);
    if (soup->position != NULL) {
        loxo_release(ctx, soup->position);
        soup->position = position;
    } else {
        loxo_release(ctx, soup->position_float);
        soup->position_float = position;
    }
    soup->n_vertices = n;
    return LOXO_OK;
fail:
    while (n_done > 0)
        loxo_release(ctx, value[--n_done]);
    loxo_release(ctx, value);
    return LOXO_ERR_MEMORY;
}

static bool is_aligned(const void *pointer, size_t alignment) { return (uintptr_t)pointer % alignment == 0; }

loxo_status loxo_arrays_check_counts(loxo_context *ctx, const char *who, const loxo_mesh_arrays *arrays)
{
    if (arrays == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: no arrays", who);
    if (arrays->n_vertices < 0 || arrays->n_faces < 0)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: negative number of vertices or faces", who);
    if (arrays->position != NULL && arrays->position_float != NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: positions given both as double and as float", who);
    if (arrays->n_vertices > 0 && arrays->position == NULL && arrays->position_float == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: no positions", who);
    if (arrays->n_faces > 0 && arrays->triangle == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: no triangles", who);
    if (!is_aligned(arrays->position, alignof(double)) || !is_aligned(arrays->position_float, alignof(float)) ||
        !is_aligned(arrays->triangle, alignof(loxo_index)))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: an array is not aligned to its type", who);
    if (arrays->n_vertices > LOXO_INDEX_MAX || arrays->n_faces > LOXO_INDEX_MAX / 3)
        return loxo_fail(ctx, LOXO_ERR_LIMIT,
                         "%s: %lld vertices and %lld faces; ids of %d bits hold %lld vertices and %lld faces", who,
                         (long long)arrays->n_vertices, (long long)arrays->n_faces, (int)(8 * sizeof(loxo_index)),
                         (long long)LOXO_INDEX_MAX, (long long)LOXO_INDEX_MAX / 3);
    return LOXO_OK;
}

loxo_status loxo_arrays_check_ids(loxo_context *ctx, const loxo_mesh_arrays *arrays, int64_t *n_degenerate,
                                  int64_t *first_degenerate)
{
    const int64_t n_faces = arrays->n_faces, n_vertices = arrays->n_vertices;
    int64_t bad = INT64_MAX, first = INT64_MAX, n = 0;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n_faces, 2)) reduction(min : bad, first) reduction(+ : n)
    {
        const loxo_range r = loxo_thread_range(n_faces);
        for (int64_t f = r.begin; f < r.end; ++f) {
            const loxo_index *v = &arrays->triangle[3 * f];
            if (v[0] < 0 || v[1] < 0 || v[2] < 0 || v[0] >= n_vertices || v[1] >= n_vertices || v[2] >= n_vertices) {
                if (f < bad) bad = f;
            } else if (loxo_is_degenerate(v)) {
                ++n;
                if (f < first) first = f;
            }
        }
    }
    *n_degenerate = n;
    *first_degenerate = n > 0 ? first : -1;
    if (bad == INT64_MAX) return LOXO_OK;
    int c = 0;
    while (arrays->triangle[3 * bad + c] >= 0 && arrays->triangle[3 * bad + c] < n_vertices)
        ++c;
    const long long id = arrays->triangle[3 * bad + c];
    const loxo_place place = {.byte = -1, .element = bad};
    if (n_vertices == 0)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "face %lld: vertex index %lld, but there are no vertices",
                            (long long)bad, id);
    return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "face %lld: vertex index %lld not in 0..%lld", (long long)bad,
                        id, (long long)n_vertices - 1);
}

loxo_status loxo_arrays_check_finite(loxo_context *ctx, const loxo_mesh_arrays *arrays)
{
    int64_t n_bad = 0, worst = INT64_MAX;
#pragma omp parallel num_threads(loxo_threads_for(ctx, arrays->n_vertices, 3)) reduction(+ : n_bad)
    {
        const loxo_range r = loxo_thread_range(arrays->n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v)
            n_bad += !loxo_arrays_finite(arrays, v);
    }
    if (n_bad == 0) return LOXO_OK;
#pragma omp parallel num_threads(loxo_threads_for(ctx, arrays->n_faces, 10)) reduction(min : worst)
    {
        const loxo_range r = loxo_thread_range(3 * arrays->n_faces);
        for (int64_t h = r.begin; h < r.end; ++h) {
            const int64_t v = arrays->triangle[h];
            if (v < worst && !loxo_arrays_finite(arrays, v)) worst = v;
        }
    }
    if (worst == INT64_MAX) {
        loxo_warn(ctx, "nonfinite-unused", n_bad, "%lld vertices are not finite, but no face uses them",
                  (long long)n_bad);
        return LOXO_OK;
    }
    return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.byte = -1, .element = worst},
                        "vertex %lld has a coordinate that is not finite, and faces use it", (long long)worst);
}

static bool by_number(const void *arg, const void *a, const void *b)
{
    (void)arg;
    return *(const loxo_index *)a < *(const loxo_index *)b;
}

void loxo_bucket_starts(loxo_context *ctx, int64_t n, int64_t *begin)
{
    /* the scan of the first n - 1 counts puts their total, where the last bucket starts, over the last count */
    if (n > 0) loxo_scan_in_place(ctx, n - 1, begin + 1);
}

void loxo_sort_faces(loxo_context *ctx, int64_t n_vertices, int64_t n_faces, const loxo_index *triangle,
                     loxo_index *face_order, int64_t *begin)
{
    const int n_threads = loxo_threads_for(ctx, n_faces, 8);
    const bool is_shared = n_threads > 1;
    /* begin[v + 1] counts, becomes the start of v's faces, and ends as their end: which is begin of v + 1 */
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range v = loxo_thread_range(n_vertices + 1), r = loxo_thread_range(n_faces);
        memset(begin + v.begin, 0, (size_t)(v.end - v.begin) * sizeof *begin);
#pragma omp barrier
        for (int64_t f = r.begin; f < r.end; ++f) {
            int64_t *count = &begin[1 + loxo_smallest_corner(&triangle[3 * f])];
            if (is_shared)
                __atomic_fetch_add(count, 1, __ATOMIC_RELAXED);
            else
                ++*count;
        }
    }
    loxo_bucket_starts(ctx, n_vertices, begin);
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(n_faces);
        for (int64_t f = r.begin; f < r.end; ++f) {
            int64_t *next = &begin[1 + loxo_smallest_corner(&triangle[3 * f])];
            const int64_t at = is_shared ? __atomic_fetch_add(next, 1, __ATOMIC_RELAXED) : (*next)++;
            face_order[at] = (loxo_index)f;
        }
    }
    if (!is_shared) return; /* one thread has filled in ascending order */
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v)
            loxo_sort(face_order + begin[v], begin[v + 1] - begin[v], sizeof *face_order, by_number, NULL);
    }
}
