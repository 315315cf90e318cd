/* SPDX-License-Identifier: MIT */
#include "io/faces.h"

#include "base/allocate.h"
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

loxo_status loxo_fail_nonfinite(loxo_context *ctx, loxo_place place, const loxo_soup *soup, int64_t vertex)
{
    double p[3];
    for (int i = 0; i < 3; ++i)
        p[i] = soup->position_float != NULL ? (double)soup->position_float[3 * vertex + i]
                                            : soup->position[3 * vertex + i];
    place.element = vertex;
    return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place,
                        "vertex %" PRId64 ": a coordinate is not finite (%g, %g, %g), and a face uses it", vertex, p[0],
                        p[1], p[2]);
}

void loxo_soup_warn(loxo_context *ctx, const char *name, const loxo_soup *soup, int64_t n_nonfinite)
{
    if (n_nonfinite > 0)
        loxo_warn(ctx, "vertex-nonfinite", n_nonfinite,
                  "%s: %" PRId64 " vertices that no face uses have a coordinate that is not finite", name, n_nonfinite);
    if (soup->n_faces == 0) loxo_warn(ctx, "no-faces", 1, "%s: no faces", name);
}
