/* SPDX-License-Identifier: MIT
 * Midpoint subdivision and random renumbering of soup. */
#include "base/allocate.h"
#include "base/rng.h"
#include "mesh/halfedge.h"
#include "mesh/repair.h"
#include "mesh/soup.h"
#include "par/range.h"

#include <string.h>

/* ---- subdivide ----------------------------------------------------------------------------------------------- */

/* edge[h] over what was twin[h]: numbers of edges in the order of their lowest half-edges. In place: an edge's lower
 * half-edges have their number by the time a higher one looks at them. */
static void number_edges(int64_t n_halfedges, loxo_index *twin)
{
    loxo_index n = 0;
    for (int64_t h = 0; h < n_halfedges; ++h) {
        if (twin[h] == LOXO_NO_EDGE) continue;
        twin[h] = twin[h] < 0 || twin[h] > h ? n++ : twin[twin[h]];
    }
}

/* A copy of old with the values at the midpoints of edges behind those of the vertices. */
static void *extend_vertices(loxo_context *ctx, const loxo_soup *soup, const loxo_index *edge, int64_t n_edges,
                             const void *old, int width, bool is_float)
{
    const size_t size = (size_t)width * (is_float ? sizeof(float) : sizeof(double));
    unsigned char *block = loxo_allocate(ctx, soup->n_vertices + n_edges, size);
    if (block == NULL) return NULL;
    if (soup->n_vertices > 0) memcpy(block, old, (size_t)soup->n_vertices * size);
    double *wide = (double *)(void *)block;
    float *narrow = (float *)(void *)block;
    loxo_index next = 0;
    for (int64_t h = 0; h < 3 * soup->n_faces; ++h) {
        if (edge[h] != next) continue; /* numbers rise with the half-edges, so this is the first of its edge */
        const int64_t a = width * (int64_t)soup->triangle[h];
        const int64_t b = width * (int64_t)soup->triangle[loxo_halfedge_next((loxo_index)h)];
        const int64_t to = width * (soup->n_vertices + next);
        for (int k = 0; k < width; ++k) {
            if (is_float)
                narrow[to + k] = (float)(0.5 * (double)narrow[a + k] + 0.5 * (double)narrow[b + k]);
            else
                wide[to + k] = 0.5 * wide[a + k] + 0.5 * wide[b + k];
        }
        ++next;
    }
    return block;
}

static loxo_index *split_faces(loxo_context *ctx, const loxo_soup *soup, const loxo_index *edge, int64_t n_degenerate)
{
    loxo_index *triangle = loxo_allocate(ctx, 4 * (soup->n_faces - n_degenerate), 3 * sizeof *triangle);
    if (triangle == NULL) return NULL;
    loxo_index *to = triangle;
    for (int64_t f = 0; f < soup->n_faces; ++f) {
        const loxo_index *v = &soup->triangle[3 * f];
        loxo_index m[3];
        if (loxo_is_degenerate(v)) continue;
        for (int c = 0; c < 3; ++c)
            m[c] = (loxo_index)(soup->n_vertices + edge[3 * f + c]);
        const loxo_index four[12] = {v[0], m[0], m[2], m[0], v[1], m[1], m[2], m[1], v[2], m[0], m[1], m[2]};
        memcpy(to, four, sizeof four);
        to += 12;
    }
    return triangle;
}

/* New arrays of one subdivision replace the old ones when all are there. */
static loxo_status subdivide_once(loxo_context *ctx, loxo_soup *soup, loxo_index *edge, int64_t n_edges,
                                  int64_t n_degenerate)
{
    const int n_fields = soup->n_fields;
    loxo_status status = LOXO_ERR_MEMORY;
    double **value = NULL;
    loxo_index *triangle = NULL;
    void *position = NULL;
    const bool is_float = soup->position == NULL;
    int n_done = 0;
    number_edges(3 * soup->n_faces, edge);
    value = loxo_allocate(ctx, n_fields, sizeof *value);
    if (value == NULL) return status;
    for (; n_done < n_fields; ++n_done) {
        value[n_done] = extend_vertices(ctx, soup, edge, n_edges, soup->fields[n_done].value, 1, false);
        if (value[n_done] == NULL) goto done;
    }
    triangle = split_faces(ctx, soup, edge, n_degenerate);
    if (triangle == NULL) goto done;
    position =
        extend_vertices(ctx, soup, edge, n_edges,
                        is_float ? (const void *)soup->position_float : (const void *)soup->position, 3, is_float);
    if (position == NULL) goto done;
    status = LOXO_OK;
    for (int i = 0; i < n_fields; ++i) {
        double *old = soup->fields[i].value;
        soup->fields[i].value = value[i];
        value[i] = old;
    }
    loxo_release(ctx, is_float ? (void *)soup->position_float : (void *)soup->position);
    if (is_float)
        soup->position_float = position;
    else
        soup->position = position;
    loxo_release(ctx, soup->triangle);
    soup->triangle = triangle;
    soup->n_vertices += n_edges;
    soup->n_faces = 4 * (soup->n_faces - n_degenerate);
    triangle = NULL;
done:
    while (n_done > 0)
        loxo_release(ctx, value[--n_done]);
    loxo_release(ctx, value);
    loxo_release(ctx, triangle);
    return status;
}

/* Each time, E edges and F faces become 2 E + 3 F and 4 F, and E vertices are added. */
static loxo_status check_limit(loxo_context *ctx, int64_t n_vertices, int64_t n_edges, int64_t n_faces, int n_times)
{
    for (int i = 0; i < n_times; ++i) {
        n_vertices += n_edges;
        n_edges = 2 * n_edges + 3 * n_faces;
        n_faces *= 4;
        if (n_vertices > LOXO_INDEX_MAX || n_faces > LOXO_INDEX_MAX / 3)
            return loxo_fail(ctx, LOXO_ERR_LIMIT,
                             "subdivide: %d times give more vertices or faces than ids of %d bits can number", n_times,
                             (int)(8 * sizeof(loxo_index)));
        if (n_faces == 0) break; /* nothing grows any more */
    }
    return LOXO_OK;
}

loxo_status loxo_soup_subdivide(loxo_context *ctx, loxo_soup *soup, int n_times)
{
    int64_t n_degenerate = 0, first_degenerate;
    loxo_status status;
    if (ctx == NULL || soup == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "subdivide: no context or no soup");
    if (n_times < 0) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "subdivide: %d times", n_times);
    loxo_progress_begin(ctx);
    loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    if ((status = loxo_arrays_check_counts(ctx, "subdivide", &arrays)) < 0) return status;
    if ((status = loxo_arrays_check_ids(ctx, &arrays, &n_degenerate, &first_degenerate)) < 0) return status;
    for (int i = 0; i < n_times && soup->n_faces > 0; ++i) {
        loxo_edge_counts edges;
        loxo_index *twin = loxo_allocate(ctx, 3 * soup->n_faces, sizeof *twin);
        if (twin == NULL) return LOXO_ERR_MEMORY;
        status = loxo_match_halfedges(ctx, soup->n_vertices, soup->n_faces, soup->triangle, twin, &edges);
        if (status >= 0 && i == 0) {
            status = check_limit(ctx, soup->n_vertices, edges.n_edges, soup->n_faces - n_degenerate, n_times);
            if (status >= 0 && n_degenerate > 0) loxo_warn_degenerate(ctx, n_degenerate, first_degenerate);
        }
        if (status >= 0) status = subdivide_once(ctx, soup, twin, edges.n_edges, i == 0 ? n_degenerate : 0);
        loxo_release(ctx, twin);
        if (status < 0) return status;
        if (loxo_stop_wanted(ctx, "subdivide", (double)(i + 1) / n_times) && i + 1 < n_times)
            return loxo_fail(ctx, LOXO_ERR_STOPPED, "subdivide: stopped by the monitor after %d times", i + 1);
    }
    return LOXO_OK;
}

/* ---- shuffle ------------------------------------------------------------------------------------------------- */

/* order[i]: the old number of what comes to place i; NULL without memory. */
static loxo_index *random_order(loxo_context *ctx, int64_t n, uint64_t seed)
{
    loxo_index *order = NULL;
    uint32_t *item = NULL;
    uint64_t *key = loxo_allocate(ctx, n, sizeof *key);
    if (key == NULL) goto done;
    item = loxo_allocate(ctx, n, sizeof *item);
    if (item == NULL) goto done;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 3))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            key[i] = loxo_random_u64(seed, (uint64_t)i);
            item[i] = (uint32_t)i;
        }
    }
    if (loxo_sort_u64(ctx, n, key, item, 64) < 0) goto done;
    order = loxo_allocate(ctx, n, sizeof *order);
    for (int64_t i = 0; order != NULL && i < n; ++i)
        order[i] = (loxo_index)item[i];
done:
    loxo_release(ctx, item);
    loxo_release(ctx, key);
    return order;
}

loxo_status loxo_soup_shuffle(loxo_context *ctx, loxo_soup *soup, uint64_t seed, loxo_index **vertex_origin)
{
    loxo_index *vertex = NULL, *face = NULL, *inverse = NULL, *triangle = NULL;
    int64_t n_degenerate, first_degenerate;
    loxo_status status;
    if (vertex_origin != NULL) *vertex_origin = NULL;
    if (ctx == NULL || soup == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "shuffle: no context or no soup");
    loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    if ((status = loxo_arrays_check_counts(ctx, "shuffle", &arrays)) < 0) return status;
    if ((status = loxo_arrays_check_ids(ctx, &arrays, &n_degenerate, &first_degenerate)) < 0) return status;
    const int64_t n_vertices = soup->n_vertices, n_faces = soup->n_faces;
    status = LOXO_ERR_MEMORY;
    vertex = random_order(ctx, n_vertices, seed);
    if (vertex == NULL) goto done;
    face = random_order(ctx, n_faces, ~seed);
    if (face == NULL) goto done;
    inverse = loxo_allocate(ctx, n_vertices, sizeof *inverse);
    if (inverse == NULL) goto done;
    for (int64_t i = 0; i < n_vertices; ++i)
        inverse[vertex[i]] = (loxo_index)i;
    triangle = loxo_gather(ctx, soup->triangle, face, n_faces, 3 * sizeof *triangle);
    if (triangle == NULL) goto done;
    for (int64_t h = 0; h < 3 * n_faces; ++h)
        triangle[h] = inverse[triangle[h]];
    if ((status = loxo_soup_gather_vertices(ctx, soup, vertex, n_vertices)) < 0) goto done;
    loxo_release(ctx, soup->triangle);
    soup->triangle = triangle;
    triangle = NULL;
    if (vertex_origin != NULL) {
        *vertex_origin = vertex;
        vertex = NULL;
    }
done:
    loxo_release(ctx, triangle);
    loxo_release(ctx, inverse);
    loxo_release(ctx, face);
    loxo_release(ctx, vertex);
    return status;
}
