/* SPDX-License-Identifier: MIT
 * The barycenter of one measure: checks, and the public face of what src/hyperbolic finds. */
#include "base/context.h"
#include "base/options.h"
#include "base/os.h"
#include "hyperbolic/hyperbolic.h"
#include "kernel/ball_kernel.h"

#include <loxo/barycenter.h>

#include <string.h>

_Static_assert(HYPER_MOST_DIMENSIONS == LOXO_MOEBIUS_MOST_DIMENSIONS && HYPER_MOST_SHIFTS == LOXO_MOEBIUS_MOST_SHIFTS,
               "results are copied as they are");
_Static_assert((int)HYPER_ABIKOFF_YE == (int)LOXO_BARYCENTER_ABIKOFF_YE &&
                   (int)HYPER_NONE == (int)LOXO_BARYCENTER_NONE &&
                   (int)HYPER_STOP_MONITOR == (int)LOXO_BARYCENTER_STOP_MONITOR,
               "the lists are alike");

static loxo_status check(loxo_context *ctx, const loxo_atoms *atoms, hyper_atoms *out, hyper_moments *first)
{
    if (atoms == NULL || atoms->n <= 0) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "barycenter: no atoms");
    if (atoms->d < 2 || atoms->d > HYPER_MOST_DIMENSIONS)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "barycenter: %d dimensions, not 2 to %d", atoms->d,
                         HYPER_MOST_DIMENSIONS);
    if ((atoms->x == NULL) == (atoms->x_float == NULL))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "barycenter: atoms are to come as doubles or as floats");
    if (atoms->n > INT64_MAX / 8 / atoms->d) return loxo_fail(ctx, LOXO_ERR_LIMIT, "barycenter: too many atoms");
    *out =
        (hyper_atoms){.n = atoms->n, .d = atoms->d, .x = atoms->x, .x_float = atoms->x_float, .weight = atoms->weight};
    return hyper_check_atoms(ctx, "barycenter", out, first);
}

static void tell_map(const hyper_result *r, int d, loxo_moebius *map)
{
    memset(map, 0, sizeof *map);
    map->d = d;
    if (r->kind != HYPER_STABLE) return;
    map->n_shifts = r->n_shifts;
    memcpy(map->shift, r->shift, (size_t)r->n_shifts * sizeof map->shift[0]);
    memcpy(map->co, r->shift_co, (size_t)r->n_shifts * sizeof map->co[0]);
}

static void tell(const hyper_result *r, int d, loxo_barycenter_info *info)
{
    const size_t row = (size_t)d * sizeof(double);
    const double length = sqrt(k_ball_dot(d, r->w, r->w));
    info->kind = (loxo_barycenter_class)r->kind;
    info->stop_reason = (loxo_barycenter_stop)r->stop;
    info->n_iterations = r->n_iterations;
    info->residual = r->residual;
    memcpy(info->w, r->w, row);
    for (int k = 0; k < d; ++k)
        info->direction[k] = length > 0.0 ? r->w[k] / length : 0.0;
    info->co = r->co;
    info->gap = k_ball_gap(r->co);
    info->radius = r->co > 0.0 ? k_ball_radius(r->co) : HUGE_VAL;
    if (r->kind == HYPER_NOT_UNIQUE) {
        memcpy(info->end[0], r->shift[0], row);
        memcpy(info->end[1], r->other, row);
    }
    tell_map(r, d, &info->map);
    info->lambda_min = r->lambda;
    info->q = r->q;
    info->bound = r->bound;
    info->frame_bound = r->frame_bound;
    info->kantorovich_bound = r->q < 1.0 ? 0.5 * r->lambda * r->q : HUGE_VAL; /* (18), k = 0 from w */
    info->kantorovich_wasserstein = 2.0 * info->kantorovich_bound;
    info->wasserstein = 2.0 * r->frame_bound; /* (10) */
}

loxo_status loxo_barycenter(loxo_context *ctx, const loxo_atoms *atoms, const loxo_barycenter_settings *settings,
                            loxo_barycenter_info *info)
{
    const loxo_barycenter_settings s = settings == NULL ? loxo_barycenter_settings_default() : *settings;
    const double start_s = loxo_os_clock_s();
    hyper_settings how = hyper_settings_default();
    hyper_atoms checked;
    hyper_moments first;
    hyper_result result;
    if (info == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "barycenter: nowhere to put the answer");
    loxo_status status = loxo_options_check(ctx, "barycenter", loxo_barycenter_options, &s);
    if (status >= 0) status = check(ctx, atoms, &checked, &first);
    if (status < 0) return status;
    loxo_progress_begin(ctx);
    how.method = (hyper_method)s.method;
    how.tolerance = s.tolerance;
    how.max_iterations = s.max_iterations;
    how.regularization = s.regularization;
    status = hyper_barycenter(ctx, &checked, &first, &how, &result);
    if (status < 0) return status;
    memset(info, 0, sizeof *info);
    tell(&result, checked.d, info);
    info->total_s = loxo_os_clock_s() - start_s;
    info->peak_bytes = loxo_context_memory(ctx).peak_bytes;
    return status;
}
