/* SPDX-License-Identifier: MIT */
#include "io/faces.h"

#include "base/allocate.h"
#include "base/context.h"
#include "par/range.h"

#include <inttypes.h>

void loxo_face_tally_add(loxo_face_tally *sum, const loxo_face_tally *more)
{
    if (sum->n_small == 0) sum->first_small = more->first_small;
    if (sum->n_doubtful == 0) sum->first_doubtful = more->first_doubtful;
    if (more->max_corners > sum->max_corners) sum->max_corners = more->max_corners;
    sum->n_triangles += more->n_triangles;
    sum->n_small += more->n_small;
    sum->n_doubtful += more->n_doubtful;
    sum->has_index_0 = sum->has_index_0 || more->has_index_0;
}

void loxo_face_tally_warn(loxo_context *ctx, const char *name, const loxo_face_tally *tally)
{
    if (tally->n_small > 0)
        loxo_warn(ctx, "face-small", tally->n_small,
                  "%s: %" PRId64 " faces with fewer than 3 corners dropped (first: face %" PRId64 ")", name,
                  tally->n_small, tally->first_small);
    if (tally->n_doubtful > 0)
        loxo_warn(ctx, "face-doubtful", tally->n_doubtful,
                  "%s: %" PRId64 " polygons cross themselves or have no area: their triangles may overlap (first: face "
                  "%" PRId64 ")",
                  name, tally->n_doubtful, tally->first_doubtful);
}

int64_t loxo_strip_triangles(const loxo_index *corner, int64_t n_corners, loxo_index *triangle)
{
    int64_t n = 0, n_before = 0; /* n_before: ids of this strip so far */
    for (int64_t i = 0; i < n_corners; ++i) {
        if (corner[i] < 0) {
            n_before = 0;
            continue;
        }
        if (++n_before < 3) continue;
        const loxo_index a = corner[i - 2], b = corner[i - 1], c = corner[i];
        if (a == b || b == c || c == a) continue;
        if (triangle != NULL) {
            const bool is_turned = n_before % 2 == 0;
            triangle[3 * n] = is_turned ? b : a;
            triangle[3 * n + 1] = is_turned ? a : b;
            triangle[3 * n + 2] = c;
        }
        ++n;
    }
    return n;
}

loxo_status loxo_soup_allocate_vertices(loxo_context *ctx, loxo_soup *soup, int64_t n_vertices, bool is_float)
{
    if (n_vertices > LOXO_INDEX_MAX)
        return loxo_fail(ctx, LOXO_ERR_LIMIT,
                         "%" PRId64 " vertices are more than this build's ids can count (%" PRId64 ")", n_vertices,
                         (int64_t)LOXO_INDEX_MAX);
    if (is_float)
        soup->position_float = loxo_allocate(ctx, n_vertices, 3 * sizeof *soup->position_float);
    else
        soup->position = loxo_allocate(ctx, n_vertices, 3 * sizeof *soup->position);
    if (soup->position_float == NULL && soup->position == NULL) return LOXO_ERR_MEMORY;
    soup->n_vertices = n_vertices;
    return LOXO_OK;
}

loxo_status loxo_soup_allocate_triangles(loxo_context *ctx, loxo_soup *soup, int64_t n_triangles)
{
    loxo_release(ctx, soup->triangle);
    soup->n_faces = 0;
    soup->triangle = loxo_allocate(ctx, n_triangles, 3 * sizeof *soup->triangle);
    if (soup->triangle == NULL) return LOXO_ERR_MEMORY;
    soup->n_faces = n_triangles;
    return LOXO_OK;
}

int64_t loxo_soup_first_used_nonfinite(const loxo_context *ctx, const loxo_soup *soup)
{
    int64_t first = INT64_MAX;
#pragma omp parallel num_threads(loxo_threads_for(ctx, soup->n_faces, 5.0)) reduction(min : first)
    {
        const loxo_range r = loxo_thread_range(3 * soup->n_faces);
        for (int64_t i = r.begin; i < r.end; ++i) {
            if (soup->triangle[i] < first && !loxo_is_finite3(soup, soup->triangle[i])) first = soup->triangle[i];
        }
    }
    return first == INT64_MAX ? -1 : first;
}

void loxo_soup_warn(loxo_context *ctx, const char *name, const loxo_soup *soup, int64_t n_nonfinite)
{
    if (n_nonfinite > 0)
        loxo_warn(ctx, "vertex-nonfinite", n_nonfinite,
                  "%s: %" PRId64 " vertices that no face uses have a coordinate that is not finite", name, n_nonfinite);
    if (soup->n_faces == 0) loxo_warn(ctx, "no-faces", 1, "%s: no faces", name);
}
