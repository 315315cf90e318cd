/* SPDX-License-Identifier: MIT
 * Values at points of a surface. */
#include "base/context.h"
#include "par/range.h"

#include <loxo/mesh.h>

#include <inttypes.h>

loxo_status loxo_surface_interpolate(loxo_context *ctx, int64_t n, const loxo_surface_point *point, int64_t n_vertices,
                                     int64_t n_columns, const double *field, double *value)
{
    if (n < 0 || n_columns < 0 || (n > 0 && (point == NULL || field == NULL || value == NULL)))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "interpolate: an array is NULL, or a count negative");
    for (int64_t i = 0; i < 3 * n; ++i) {
        const loxo_index v = point[i / 3].vertex[i % 3];
        if (v >= n_vertices)
            return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = i / 3},
                                "interpolate: point %" PRId64 ": vertex %" PRId64 " not in 0..%" PRId64, i / 3,
                                (int64_t)v, n_vertices - 1);
    }
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 10.0 * (double)n_columns))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const loxo_surface_point *p = &point[i];
            for (int64_t c = 0; c < n_columns; ++c) {
                double sum = 0.0;
                for (int k = 0; k < 3; ++k)
                    if (p->vertex[k] >= 0) sum += p->weight[k] * field[p->vertex[k] * n_columns + c];
                value[i * n_columns + c] = sum;
            }
        }
    }
    return LOXO_OK;
}
