/* SPDX-License-Identifier: MIT
 * Corners are shared out to parts by a hash of their position, so that the same points meet in one part, and each part
 * is sorted: that bounds the time for any choice of points, and the memory of the sort. */
#include "io/weld.h"

#include "base/context.h"
#include "io/faces.h"
#include "par/range.h"

#include <inttypes.h>

#define PART_CORNERS ((int64_t)1 << 17)
#define MAX_PARTS    4096

typedef struct welding {
    loxo_context *ctx;
    const loxo_corners *corners;
    int64_t n, n_parts;
    uint32_t *corner; /* [n] part after part, ascending in each */
    int64_t *begin;   /* [n_parts + 1] */
    uint32_t *first;  /* [n] the lowest corner at the same point */
} welding;

/* Bits of a coordinate that compare as the numbers do for being the same; -0 is 0. */
static void position_bits(const loxo_corners *corners, int64_t corner, uint64_t bits[3])
{
    float p[3];
    if (corners->facet != NULL) loxo_corner_floats(corners, corner, p);
    for (int i = 0; i < 3; ++i) {
        if (corners->facet != NULL) {
            const float x = p[i] + 0.0f;
            uint32_t narrow;
            memcpy(&narrow, &x, sizeof narrow);
            bits[i] = narrow;
        } else {
            const double x = corners->position[3 * corner + i] + 0.0;
            memcpy(&bits[i], &x, sizeof bits[i]);
        }
    }
}

static bool are_same(const loxo_corners *corners, int64_t a, int64_t b)
{
    uint64_t p[3], q[3];
    position_bits(corners, a, p);
    position_bits(corners, b, q);
    return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

static int64_t part_of(const welding *w, int64_t corner)
{
    uint64_t bits[3], hash = 0;
    position_bits(w->corners, corner, bits);
    for (int i = 0; i < 3; ++i) {
        hash = (hash ^ bits[i]) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 32;
    }
    return (int64_t)(hash * 0xd1342543de82ef95u >> 40) & (w->n_parts - 1);
}

/* Each thread counts and moves its own range; the places are handed out part by part, within a part thread by thread. */
static loxo_status share_out(welding *w)
{
    const int n_threads = loxo_threads_for(w->ctx, w->n, 20.0);
    int64_t *place = loxo_allocate(w->ctx, n_threads * w->n_parts, sizeof *place);
    if (place == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(w->n);
        const int n_team = loxo_thread_count();
        int64_t *mine = place + loxo_thread_id() * w->n_parts;
        memset(mine, 0, (size_t)w->n_parts * sizeof *mine);
        for (int64_t c = r.begin; c < r.end; ++c)
            ++mine[part_of(w, c)];
#pragma omp barrier
#pragma omp single
        {
            int64_t sum = 0;
            for (int64_t part = 0; part < w->n_parts; ++part) {
                w->begin[part] = sum;
                for (int64_t other = 0; other < n_team; ++other) {
                    int64_t *p = &place[other * w->n_parts + part];
                    const int64_t count = *p;
                    *p = sum;
                    sum += count;
                }
            }
            w->begin[w->n_parts] = sum;
        }
        for (int64_t c = r.begin; c < r.end; ++c)
            w->corner[mine[part_of(w, c)]++] = (uint32_t)c;
    }
    loxo_release(w->ctx, place);
    return LOXO_OK;
}

/* Puts the same points of a part side by side, the lower corner first: stable sorts by one coordinate after the other.
 * Floats go two at a time. */
static loxo_status sort_part(const welding *w, int64_t n, uint32_t *corner, uint64_t *key)
{
    const bool is_float = w->corners->facet != NULL;
    for (int round = 0; round < (is_float ? 2 : 3); ++round) {
#pragma omp parallel num_threads(loxo_threads_for(w->ctx, n, 10.0))
        {
            const loxo_range r = loxo_thread_range(n);
            for (int64_t i = r.begin; i < r.end; ++i) {
                uint64_t bits[3];
                position_bits(w->corners, corner[i], bits);
                key[i] = is_float && round == 1 ? bits[0] << 32 | bits[1] : bits[2 - round];
            }
        }
        const loxo_status status = loxo_sort_u64(w->ctx, n, key, corner, is_float && round == 0 ? 32 : 64);
        if (status < 0) return status;
    }
    return LOXO_OK;
}

/* Of the sorted corners of a part. */
static void find_first(const welding *w, int64_t n, const uint32_t *sorted)
{
#pragma omp parallel num_threads(loxo_threads_for(w->ctx, n, 20.0))
    {
        /* Each thread takes the groups that begin in its range. */
        const loxo_range r = loxo_thread_range(n);
        int64_t i = r.begin;
        while (i > 0 && i < r.end && are_same(w->corners, sorted[i - 1], sorted[i]))
            ++i;
        while (i < r.end) {
            const uint32_t lowest = sorted[i];
            do
                w->first[sorted[i++]] = lowest;
            while (i < n && are_same(w->corners, lowest, sorted[i]));
        }
    }
}

static loxo_status join(const welding *w)
{
    int64_t n_key = 0;
    loxo_status status = LOXO_OK;
    for (int64_t part = 0; part < w->n_parts; ++part)
        if (w->begin[part + 1] - w->begin[part] > n_key) n_key = w->begin[part + 1] - w->begin[part];
    uint64_t *key = loxo_allocate(w->ctx, n_key, sizeof *key);
    if (key == NULL) return LOXO_ERR_MEMORY;
    for (int64_t part = 0; part < w->n_parts && status >= 0; ++part) {
        uint32_t *corner = w->corner + w->begin[part];
        const int64_t n = w->begin[part + 1] - w->begin[part];
        if ((status = sort_part(w, n, corner, key)) < 0) break;
        find_first(w, n, corner);
        if (loxo_stop_wanted(w->ctx, "join", (double)part / (double)w->n_parts))
            status = loxo_fail(w->ctx, LOXO_ERR_STOPPED, "stopped while corners were joined");
    }
    loxo_release(w->ctx, key);
    return status;
}

/* Vertices in the order in which they first appear. */
static loxo_status number(const welding *w, loxo_soup *soup)
{
    const loxo_corners *corners = w->corners;
    int64_t n_vertices = 0;
    loxo_status status;
#pragma omp parallel num_threads(loxo_threads_for(w->ctx, w->n, 1.0)) reduction(+ : n_vertices)
    {
        const loxo_range r = loxo_thread_range(w->n);
        for (int64_t c = r.begin; c < r.end; ++c)
            n_vertices += w->first[c] == c;
    }
    if ((status = loxo_soup_allocate_triangles(w->ctx, soup, corners->n_facets)) < 0) return status;
    if ((status = loxo_soup_allocate_vertices(w->ctx, soup, n_vertices, corners->facet != NULL)) < 0) return status;
    n_vertices = 0;
    for (int64_t c = 0; c < w->n; ++c) {
        if (w->first[c] != c) {
            soup->triangle[c] = soup->triangle[w->first[c]];
            continue;
        }
        if (corners->facet != NULL)
            loxo_corner_floats(corners, c, &soup->position_float[3 * n_vertices]);
        else
            memcpy(&soup->position[3 * n_vertices], &corners->position[3 * c], 3 * sizeof(double));
        soup->triangle[c] = (loxo_index)n_vertices++;
    }
    return LOXO_OK;
}

loxo_status loxo_weld(loxo_context *ctx, const loxo_corners *corners, loxo_soup *soup)
{
    welding w = {.ctx = ctx, .corners = corners, .n = 3 * corners->n_facets, .n_parts = 1};
    loxo_status status = LOXO_ERR_MEMORY;
    if (w.n > UINT32_MAX)
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "%" PRId64 " facets are more than can be joined", corners->n_facets);
    while (w.n_parts < MAX_PARTS && w.n_parts * PART_CORNERS < w.n)
        w.n_parts *= 2;
    w.corner = loxo_allocate(ctx, w.n, sizeof *w.corner);
    w.begin = loxo_allocate(ctx, w.n_parts + 1, sizeof *w.begin);
    w.first = loxo_allocate(ctx, w.n, sizeof *w.first);
    if (w.corner == NULL || w.begin == NULL || w.first == NULL) goto end;
    if ((status = share_out(&w)) < 0) goto end;
    if ((status = join(&w)) < 0) goto end;
    loxo_release(ctx, w.corner);
    w.corner = NULL;
    status = number(&w, soup);
end:
    loxo_release(ctx, w.first);
    loxo_release(ctx, w.begin);
    loxo_release(ctx, w.corner);
    return status;
}
