/* SPDX-License-Identifier: MIT
 * Distances in closed form on the smooth shapes that the generators approach. */
#include "base/context.h"
#include "mesh/generate_internal.h"
#include "par/range.h"

#include <inttypes.h>
#include <math.h>

#define PI 3.141592653589793

static inline void soup_point(const loxo_soup *soup, int64_t v, double p[3])
{
    for (int64_t c = 0; c < 3; ++c)
        p[c] = soup->position != NULL ? soup->position[3 * v + c] : (double)soup->position_float[3 * v + c];
}

static double flat(const double a[3], const double b[3])
{
    const double d[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

/* Angle between two vectors, exact to rounding for small and for blunt ones. */
static double angle_between(const double a[3], const double b[3])
{
    const double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    return atan2(sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]), a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
}

/* Unrolled: a straight line, round the nearer side. */
static double on_cylinder(const double a[3], const double b[3], double radius)
{
    const double flat_a[3] = {a[0], a[1], 0.0}, flat_b[3] = {b[0], b[1], 0.0};
    const double round = radius * angle_between(flat_a, flat_b), along = b[2] - a[2];
    return sqrt(round * round + along * along);
}

/* Straight, unless the hole is in the way: then a tangent to it, an arc of its rim, and a tangent from it. */
static double on_annulus(const double a[3], const double b[3], double inner)
{
    const double ra = fmax(hypot(a[0], a[1]), inner), rb = fmax(hypot(b[0], b[1]), inner);
    const double arc = angle_between(a, b) - acos(inner / ra) - acos(inner / rb);
    if (arc <= 0.0) return flat(a, b);
    return sqrt((ra - inner) * (ra + inner)) + sqrt((rb - inner) * (rb + inner)) + inner * arc;
}

static double exact(const loxo_generator *g, const double a[3], const double b[3])
{
    switch (g->shape) {
    case LOXO_SHAPE_ICOSPHERE:
    case LOXO_SHAPE_LATLONG: return angle_between(a, b);
    case LOXO_SHAPE_CYLINDER: return on_cylinder(a, b, g->params[0]);
    case LOXO_SHAPE_ANNULUS: return on_annulus(a, b, g->params[0]);
    default: return flat(a, b);
    }
}

static bool has_closed_form(loxo_shape shape)
{
    switch (shape) {
    case LOXO_SHAPE_ICOSPHERE:
    case LOXO_SHAPE_LATLONG:
    case LOXO_SHAPE_CYLINDER:
    case LOXO_SHAPE_ANNULUS:
    case LOXO_SHAPE_DISK:
    case LOXO_SHAPE_GRID:
    case LOXO_SHAPE_STRIP: return true;
    default: return false;
    }
}

loxo_status loxo_generate_exact_distance(loxo_context *ctx, const loxo_generate_settings *settings,
                                         const loxo_soup *soup, loxo_index source, double *distance)
{
    loxo_generator g;
    loxo_status status;
    double from[3];
    if (settings == NULL || soup == NULL || distance == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "exact distance: NULL argument");
    if ((status = loxo_generator_make(ctx, settings, &g)) < 0) return status;
    if (!has_closed_form(g.shape))
        return loxo_fail(ctx, LOXO_ERR_UNSUPPORTED, "exact distance: no closed form on %s", loxo_shape_name(g.shape));
    if (source < 0 || source >= soup->n_vertices)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "exact distance: source %lld not in 0..%" PRId64, (long long)source,
                         soup->n_vertices - 1);
    soup_point(soup, source, from);
    const int n_threads = loxo_threads_for(ctx, soup->n_vertices, 50.0);
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(soup->n_vertices);
        for (int64_t v = r.begin; v < r.end; ++v) {
            double to[3];
            soup_point(soup, v, to);
            distance[v] = exact(&g, from, to);
        }
    }
    return LOXO_OK;
}
