/* SPDX-License-Identifier: MIT
 * Moebius centring: the conformal barycenter of the vertices, weighted by the area of the surface that they stand for, is moved to
 * the centre. */
#include "base/context.h"
#include "base/options.h"
#include "base/os.h"
#include "hyperbolic/hyperbolic.h"
#include "kernel/ball_kernel.h"
#include "par/range.h"
#include "solver/barycenter/search_options.h"

#include <loxo/center.h>

#include <inttypes.h>

loxo_center_settings loxo_center_settings_default(void)
{
    return (loxo_center_settings){.off_sphere = 1e-5, .tolerance = 0.0, .max_iterations = 100};
}

#define FIELD(name) offsetof(loxo_center_settings, name)

const loxo_option loxo_center_options[] = {
    {.name = "off-sphere",
     .type = LOXO_OPTION_DOUBLE,
     .offset = FIELD(off_sphere),
     .min = 0.0,
     .max = 0.5,
     .help = "how far from the unit sphere a vertex may be; it is put onto it"},
    SEARCH_TOLERANCE(loxo_center_settings, "hyperbolic distance"),
    SEARCH_MAX_ITERATIONS(loxo_center_settings, "most steps"),
    {.name = NULL},
};

/* Unit vectors; returns the first vertex of the range that is too far from the sphere, or -1. *off: the farthest. */
static int64_t put_on_sphere(loxo_range r, const double *sphere, const float *sphere_float, double most, double *out,
                             double *off)
{
    int64_t wrong = -1;
    for (int64_t i = r.begin; i < r.end; ++i) {
        double x[3];
        for (int k = 0; k < 3; ++k)
            x[k] = sphere != NULL ? sphere[3 * i + k] : (double)sphere_float[3 * i + k];
        const double norm = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]), away = fabs(norm - 1.0);
        const double inverse = away <= 2.3e-16 ? 1.0 : 1.0 / norm; /* what is on it stays as it is */
        if (!(away <= most) && wrong < 0) wrong = i;
        *off = away > *off ? away : *off;
        for (int k = 0; k < 3; ++k)
            out[3 * i + k] = x[k] * inverse;
    }
    return wrong;
}

static loxo_status put_all_on_sphere(loxo_context *ctx, int64_t n, const double *sphere, const float *sphere_float,
                                     double most, double *out, double *farthest)
{
    int64_t wrong = INT64_MAX;
    double off = 0.0;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 4.0)) reduction(min : wrong) reduction(max : off)
    {
        const int64_t found = put_on_sphere(loxo_thread_range(n), sphere, sphere_float, most, out, &off);
        if (found >= 0) wrong = found;
    }
    *farthest = off;
    if (wrong == INT64_MAX) return LOXO_OK;
    return loxo_fail_at(ctx, LOXO_ERR_MESH, (loxo_place){.byte = -1, .element = wrong},
                        "center: vertex %" PRId64 " is not on the unit sphere within %g", wrong, most);
}

/* Length of the weighted mean. The atoms have been checked. */
static loxo_status find_mean(loxo_context *ctx, const loxo_atoms *atoms, double *length)
{
    static const double centre[3] = {0.0, 0.0, 0.0};
    const hyper_atoms seen = {.n = atoms->n, .d = 3, .x = atoms->x, .weight = atoms->weight, .is_unit = true};
    hyper_moments moments;
    const loxo_status status = hyper_find_moments(ctx, &seen, centre, 1.0, &moments);
    if (status >= 0) *length = sqrt(k_ball_dot(3, moments.mean, moments.mean));
    return status;
}

/* turn after the rotation by 2 phi from e towards f, both unit vectors at right angles. */
static void turn_more(double turn[3][3], const double *e, const double *f, double phi)
{
    const double c = -2.0 * sin(phi) * sin(phi), s = sin(2.0 * phi); /* c: cos(2 phi) - 1 */
    for (int i = 0; i < 3; ++i) {
        const double along_e = k_ball_dot(3, turn[i], e), along_f = k_ball_dot(3, turn[i], f);
        for (int k = 0; k < 3; ++k)
            turn[i][k] += (c * along_e + s * along_f) * e[k] + (c * along_f - s * along_e) * f[k];
    }
}

/* The rotation that the shifts of a map leave beside one shift: map = turn o sigma_w. README.md, «Several shifts turn». */
static void find_turn(const loxo_moebius *map, double turn[3][3])
{
    double a[3] = {0.0, 0.0, 0.0}, co = 1.0;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
            turn[i][k] = i == k ? 1.0 : 0.0;
    for (int s = 0; s < map->n_shifts; ++s) {
        double b[3], sum[3], e[3], f[3];
        for (int k = 0; k < 3; ++k) {
            b[k] = turn[0][k] * map->shift[s][0] + turn[1][k] * map->shift[s][1] + turn[2][k] * map->shift[s][2];
            sum[k] = a[k] + b[k];
        }
        const double length = sqrt(k_ball_dot(3, a, a));
        for (int k = 0; k < 3; ++k)
            e[k] = length > 0.0 ? a[k] / length : 0.0;
        const double along = k_ball_dot(3, sum, e);
        for (int k = 0; k < 3; ++k)
            f[k] = sum[k] - along * e[k];
        const double across = sqrt(k_ball_dot(3, f, f));
        if (length > 0.0 && across > 0.0) {
            for (int k = 0; k < 3; ++k)
                f[k] /= across;
            turn_more(turn, e, f, atan2(length * across, 0.5 * (k_ball_dot(3, sum, sum) + co + map->co[s])));
        }
        co = k_ball_compose(3, a, co, b, map->co[s], a);
    }
}

/* Takes the turn back. */
static void turn_back(loxo_context *ctx, double turn[3][3], int64_t n, double *x)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 2.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const double p[3] = {x[3 * i], x[3 * i + 1], x[3 * i + 2]};
            for (int k = 0; k < 3; ++k)
                x[3 * i + k] = turn[0][k] * p[0] + turn[1][k] * p[1] + turn[2][k] * p[2];
        }
    }
}

static loxo_status center(loxo_context *ctx, const loxo_atoms *atoms, const loxo_center_settings *s, double *centred,
                          loxo_center_info *info)
{
    const loxo_barycenter_settings how = {
        .method = LOXO_BARYCENTER_DAMPED, .tolerance = s->tolerance, .max_iterations = s->max_iterations};
    const loxo_status found = loxo_barycenter(ctx, atoms, &how, &info->barycenter);
    if (found < 0) return found;
    loxo_status status = find_mean(ctx, atoms, &info->mean_before);
    if (status >= 0) status = loxo_moebius_map_sphere(ctx, &info->barycenter.map, atoms->n, centred, centred);
    find_turn(&info->barycenter.map, info->turn);
    if (status >= 0 && info->barycenter.map.n_shifts > 1) turn_back(ctx, info->turn, atoms->n, centred);
    if (status >= 0) status = find_mean(ctx, atoms, &info->mean_after);
    return status < 0 ? status : found;
}

loxo_status loxo_moebius_center(loxo_context *ctx, int64_t n, const double *sphere, const float *sphere_float,
                                const double *area, const loxo_center_settings *settings, double *centred,
                                loxo_center_info *info)
{
    const loxo_center_settings s = settings == NULL ? loxo_center_settings_default() : *settings;
    const double start_s = loxo_os_clock_s();
    loxo_center_info own = {.total_s = 0.0};
    loxo_status status = loxo_options_check(ctx, "center", loxo_center_options, &s);
    if (status < 0) return status;
    if (n < 1 || (sphere == NULL) == (sphere_float == NULL) || centred == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "center: positions are to come as doubles or as floats, one at least");
    status = put_all_on_sphere(ctx, n, sphere, sphere_float, s.off_sphere, centred, &own.off_sphere);
    if (status < 0) return status;
    const loxo_atoms atoms = {.n = n, .d = 3, .x = centred, .weight = area};
    status = center(ctx, &atoms, &s, centred, &own);
    own.total_s = loxo_os_clock_s() - start_s;
    own.peak_bytes = loxo_context_memory(ctx).peak_bytes;
    if (status >= 0 && info != NULL) *info = own;
    return status;
}
