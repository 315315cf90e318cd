/* SPDX-License-Identifier: MIT
 * How far a field of distances, or of heat directions, is from a reference. */
#include "base/context.h"
#include "kernel/gradient_kernel.h"
#include "par/range.h"

#include <loxo/measure.h>

#include <math.h>

typedef struct two_fields {
    const double *distance, *reference;
} two_fields;

static double relative(double distance, double reference)
{
    return reference != 0.0 ? fabs(distance - reference) / fabs(reference) : 0.0;
}

/* Sum of relative errors, number of vertices compared, number of mismatches. */
static void add_errors(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const two_fields *f = arg;
    for (int64_t v = begin; v < end; ++v) {
        const bool is_finite = isfinite(f->distance[v]), is_known = isfinite(f->reference[v]);
        if (is_finite && is_known) {
            sums[0] += relative(f->distance[v], f->reference[v]);
            sums[1] += 1.0;
        } else if (is_finite != is_known) {
            sums[2] += 1.0;
        }
    }
}

loxo_status loxo_measure_distance_error(loxo_context *ctx, const double *distance, const double *reference, int64_t n,
                                        loxo_distance_error *error)
{
    if (n < 0 || error == NULL || (n > 0 && (distance == NULL || reference == NULL)))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "measure: distance error needs two fields and a place for the result");
    const two_fields fields = {distance, reference};
    double sums[3], max_relative = 0.0, max_absolute = 0.0;
    const loxo_status status = loxo_sum(ctx, n, 3, add_errors, &fields, sums);
    if (status < 0) return status;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 2.0)) reduction(max : max_relative, max_absolute)
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v) {
            if (!isfinite(distance[v]) || !isfinite(reference[v])) continue;
            max_absolute = fmax(max_absolute, fabs(distance[v] - reference[v]));
            max_relative = fmax(max_relative, relative(distance[v], reference[v]));
        }
    }
    *error = (loxo_distance_error){
        .mean_relative = sums[1] > 0.0 ? sums[0] / sums[1] : 0.0,
        .max_relative = max_relative,
        .max_absolute = max_absolute,
        .n_compared = (int64_t)sums[1],
        .n_mismatched = (int64_t)sums[2],
    };
    return LOXO_OK;
}

typedef struct two_heats {
    const loxo_mesh_arrays *mesh;
    const double *value, *reference_value;
    const int32_t *scale, *reference_scale; /* NULL: 0 */
} two_heats;

static bool is_in_range(const loxo_mesh_arrays *mesh, const loxo_index *v)
{
    for (int c = 0; c < 3; ++c)
        if (v[c] < 0 || v[c] >= mesh->n_vertices) return false;
    return true;
}

static void load_heat(const double *value, const int32_t *scale, const loxo_index *v, double u[3], int32_t s[3])
{
    for (int c = 0; c < 3; ++c) {
        u[c] = value[v[c]];
        s[c] = scale != NULL ? scale[v[c]] : 0;
    }
}

/* Sum of area |h - h*|^2, of area, number of faces with a vertex number out of range. */
static void add_direction_errors(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const two_heats *t = arg;
    const loxo_mesh_arrays *mesh = t->mesh;
    for (int64_t f = begin; f < end; ++f) {
        const loxo_index *v = &mesh->triangle[3 * f];
        double p[9], u[3], h[3], h_star[3], square = 0.0;
        int32_t s[3];
        if (!is_in_range(mesh, v)) {
            sums[2] += 1.0;
            continue;
        }
        for (int c = 0; c < 3; ++c)
            for (int k = 0; k < 3; ++k)
                p[3 * c + k] = mesh->position != NULL ? mesh->position[(int64_t)3 * v[c] + k]
                                                      : (double)mesh->position_float[(int64_t)3 * v[c] + k];
        load_heat(t->value, t->scale, v, u, s);
        k_heat_direction(p, u, s, h);
        const double area = k_triangle_area(p);
        load_heat(t->reference_value, t->reference_scale, v, u, s);
        k_heat_direction(p, u, s, h_star);
        for (int k = 0; k < 3; ++k)
            square += (h[k] - h_star[k]) * (h[k] - h_star[k]);
        sums[0] += area * square;
        sums[1] += area;
    }
}

loxo_status loxo_measure_direction_error(loxo_context *ctx, const loxo_mesh_arrays *mesh, const double *value,
                                         const int32_t *scale, const double *reference_value,
                                         const int32_t *reference_scale, double *error)
{
    if (mesh == NULL || error == NULL || mesh->n_vertices < 0 || mesh->n_faces < 0)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "measure: direction error needs a mesh and a place for the result");
    if (mesh->n_faces > 0 && (mesh->triangle == NULL || (mesh->position == NULL) == (mesh->position_float == NULL) ||
                              value == NULL || reference_value == NULL))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "measure: direction error needs triangles, positions and two fields");
    const two_heats heats = {mesh, value, reference_value, scale, reference_scale};
    double sums[3];
    const loxo_status status = loxo_sum(ctx, mesh->n_faces, 3, add_direction_errors, &heats, sums);
    if (status < 0) return status;
    if (sums[2] > 0.0) {
        int64_t f = 0;
        while (is_in_range(mesh, &mesh->triangle[3 * f]))
            ++f;
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.byte = -1, .element = f},
                            "measure: face %lld has a vertex number out of range", (long long)f);
    }
    if (!isfinite(sums[0]) || !isfinite(sums[1]))
        return loxo_fail(ctx, LOXO_ERR_NUMERIC, "measure: the mesh's area is not finite");
    *error = sums[1] > 0.0 ? sqrt(sums[0] / sums[1]) : 0.0;
    return LOXO_OK;
}
