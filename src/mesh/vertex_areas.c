/* SPDX-License-Identifier: MIT
 * Lumped areas. */
#include "base/context.h"
#include "kernel/vec3.h"
#include "mesh/gather.h"
#include "mesh/soup.h"

#include <inttypes.h>
#include <math.h>

typedef struct areas {
    const loxo_mesh_arrays *mesh;
    double *area;
} areas;

static loxo_vec3 corner(const loxo_mesh_arrays *m, loxo_index v)
{
    double p[3];
    loxo_arrays_position(m, v, p);
    return v3_load(p);
}

static void take(void *arg, int64_t begin, int64_t end, loxo_range own)
{
    const areas *to = arg;
    const loxo_mesh_arrays *m = to->mesh;
    for (int64_t f = begin; f < end; ++f) {
        const loxo_index *v = m->triangle + 3 * f;
        const bool is_own[3] = {loxo_is_own(own, v[0]), loxo_is_own(own, v[1]), loxo_is_own(own, v[2])};
        if (!is_own[0] && !is_own[1] && !is_own[2]) continue;
        const loxo_vec3 a = corner(m, v[0]), b = corner(m, v[1]), c = corner(m, v[2]);
        const double third = v3_norm(v3_cross(v3_sub(b, a), v3_sub(c, a))) / 6.0;
        for (int k = 0; k < 3; ++k)
            if (is_own[k]) to->area[v[k]] += third;
    }
}

/* Returns the first vertex of the range whose area is not finite, or INT64_MAX. */
static int64_t find_infinite(const double *area, loxo_range r)
{
    for (int64_t v = r.begin; v < r.end; ++v)
        if (!isfinite(area[v])) return v;
    return INT64_MAX;
}

loxo_status loxo_mesh_vertex_areas(loxo_context *ctx, const loxo_mesh_arrays *arrays, double *area)
{
    loxo_status status = loxo_arrays_check_counts(ctx, "vertex areas", arrays);
    if (status < 0) return status;
    areas to = {arrays, area};
    int64_t wrong = INT64_MAX;
    if (arrays->n_vertices == 0) return loxo_gather_faces(ctx, arrays, 4.0, take, &to); /* where any face is wrong */
    if (area == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "vertex areas: nowhere to put them");
#pragma omp parallel num_threads(loxo_threads_for(ctx, arrays->n_faces, 4.0))
    {
        const loxo_range r = loxo_thread_range(arrays->n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v)
            area[v] = 0.0;
    }
    if ((status = loxo_gather_faces(ctx, arrays, 4.0, take, &to)) < 0) return status;
#pragma omp parallel num_threads(loxo_threads_for(ctx, arrays->n_vertices, 1.0)) reduction(min : wrong)
    {
        const int64_t vertex = find_infinite(area, loxo_thread_range(arrays->n_vertices));
        if (vertex < wrong) wrong = vertex;
    }
    if (wrong == INT64_MAX) return LOXO_OK;
    return loxo_fail_at(ctx, LOXO_ERR_MESH, (loxo_place){.byte = -1, .element = wrong},
                        "vertex areas: the area around vertex %" PRId64 " is not finite", wrong);
}
