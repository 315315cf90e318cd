/* SPDX-License-Identifier: MIT
 * Settings of the geodesic solver: defaults in one function, everything else about them in one table. */
#include "base/options.h"
#include "solver/geodesic/geodesic_internal.h"

#include <math.h>

loxo_geodesic_settings loxo_geodesic_settings_default(void)
{
    return (loxo_geodesic_settings){
        .method = LOXO_GEODESIC_AUTO,
        .diffusion = LOXO_DIFFUSION_MARCHING,
        .time_factor = 1.0, /* t = h^2, eq. (28) */
        .diffusion_tolerance = 1e-3,
        .n_sweeps = 1000,
        .recovery = LOXO_RECOVERY_AUTO,
        .penalty = 100.0,         /* the paper's mu, */
        .n_iterations = 10,       /* its I_max */
        .primal_tolerance = 1e-5, /* and its tolerances */
        .dual_tolerance = 1e-5,
        /* As in the paper, off: within a few iterations their correction stays on the chains, and the distances that are
         * summed across those get worse (kitten, genus 1: 0.93 % on, 0.72 % off). */
        .global_constraints = false,
        .factor = LOXO_FACTOR_MULTIGRID,
        .max_distance = HUGE_VAL,
        .nearest = false,
        .check_gradient_share = 0.6,
        .check_breach = 1.5,
        .check_estimate = 0.05,
    };
}

#define FIELD(name) offsetof(loxo_geodesic_settings, name)

/* Which methods look at an option. */
#define EDGE_FACE (1U << LOXO_GEODESIC_EDGE | 1U << LOXO_GEODESIC_FACE)
#define BY_FACTOR (1U << LOXO_GEODESIC_HEAT | 1U << LOXO_GEODESIC_VARIATIONAL)
#define BY_ADMM   (EDGE_FACE | 1U << LOXO_GEODESIC_VARIATIONAL)
#define BY_HEAT   (EDGE_FACE | BY_FACTOR)

#define CHOICE(NAME, name, help) #name,
#define HELP(NAME, name, help)   help,
static const char *const methods[] = {LOXO_GEODESIC_METHOD_LIST(CHOICE) NULL};
static const char *const factors[] = {"multigrid", "cholesky", NULL};
static const char *const diffusions[] = {"marching", "sweeps", NULL};
static const char *const recoveries[] = {"auto", "unfold", "admm", NULL};

const loxo_option loxo_geodesic_options[] = {
    {.name = "method",
     .type = LOXO_OPTION_CHOICE,
     .offset = FIELD(method),
     .choices = methods,
     .help = "how distances are found; auto: what the mesh and the options given call for"},
    {.name = "diffusion",
     .type = LOXO_OPTION_CHOICE,
     .methods = BY_HEAT,
     .needs = {"factor=multigrid"},
     .offset = FIELD(diffusion),
     .choices = diffusions,
     .help = "marching window that stops by tolerance, or the paper's sweeps"},
    {.name = "time-factor",
     .type = LOXO_OPTION_DOUBLE,
     .methods = BY_HEAT,
     .offset = FIELD(time_factor),
     .min = 1e-6,
     .max = 1e8,
     .help = "m of t = m h^2, h the mean edge length"},
    {.name = "diffusion-tolerance",
     .type = LOXO_OPTION_DOUBLE,
     .methods = BY_HEAT,
     .needs = {"factor=multigrid", "diffusion=marching"},
     .offset = FIELD(diffusion_tolerance),
     .min = 1e-12,
     .max = 1.0,
     .help = "change of the directions, eq. (8), below which a level is final"},
    {.name = "sweeps",
     .type = LOXO_OPTION_INT64,
     .methods = BY_HEAT,
     .needs = {"factor=multigrid", "diffusion=sweeps"},
     .offset = FIELD(n_sweeps),
     .min = 1.0,
     .max = 1e9,
     .help = "number of sweeps of --diffusion sweeps"},
    {.name = "recovery",
     .type = LOXO_OPTION_CHOICE,
     .methods = 1U << LOXO_GEODESIC_EDGE,
     .offset = FIELD(recovery),
     .choices = recoveries,
     .help = "edge: unfold faces in the heat's order, or the paper's ADMM; auto: ADMM where its settings are changed"},
    {.name = "penalty",
     .type = LOXO_OPTION_DOUBLE,
     .methods = BY_ADMM,
     .needs = {"recovery=auto|admm"},
     .offset = FIELD(penalty),
     .min = 0.0,
     .max = 1e12,
     .exclusive_min = true,
     .help = "mu of ADMM"},
    {.name = "iterations",
     .type = LOXO_OPTION_INT64,
     .methods = BY_ADMM,
     .needs = {"recovery=auto|admm"},
     .offset = FIELD(n_iterations),
     .min = 0.0,
     .max = 1e9,
     .help = "most ADMM iterations"},
    {.name = "primal-tolerance",
     .type = LOXO_OPTION_DOUBLE,
     .methods = BY_ADMM,
     .needs = {"recovery=auto|admm"},
     .offset = FIELD(primal_tolerance),
     .min = 0.0,
     .max = 1.0,
     .help = "ADMM stops when both residuals are below their tolerances"},
    {.name = "dual-tolerance",
     .type = LOXO_OPTION_DOUBLE,
     .methods = EDGE_FACE,
     .needs = {"recovery=auto|admm"},
     .offset = FIELD(dual_tolerance),
     .min = 0.0,
     .max = 1.0,
     .help = "the same for the dual residual"},
    {.name = "factor",
     .type = LOXO_OPTION_CHOICE,
     .methods = BY_FACTOR,
     .offset = FIELD(factor),
     .choices = factors,
     .help = "multigrid takes linear memory, cholesky makes factors once for many solves"},
    {.name = "global-constraints",
     .type = LOXO_OPTION_BOOL,
     .methods = EDGE_FACE,
     .offset = FIELD(global_constraints),
     .help = "line integrals vanish along cycles of surfaces that are no disk, and between sources"},
    {.name = "max-distance",
     .type = LOXO_OPTION_DOUBLE,
     .offset = FIELD(max_distance),
     .min = 0.0,
     .max = HUGE_VAL,
     .exclusive_min = true,
     .help = "vertices farther than this get infinity; a solve costs its ball (heat, variational: the whole)"},
    {.name = "nearest",
     .type = LOXO_OPTION_BOOL,
     .offset = FIELD(nearest),
     .help = "tell the nearest source of each vertex, too"},
    {.name = "check-gradient-share",
     .type = LOXO_OPTION_DOUBLE,
     .needs = {"method=edge|face|heat|variational"},
     .offset = FIELD(check_gradient_share),
     .min = 0.0,
     .max = 1.0,
     .help = "largest share of the area where the gradient's length may be off 1 by over a tenth"},
    {.name = "check-breach",
     .type = LOXO_OPTION_DOUBLE,
     .offset = FIELD(check_breach),
     .min = 0.0,
     .max = 1e30,
     .help = "largest 99th percentile of |d(a) - d(b)| / |ab| - 1 over the edges"},
    {.name = "check-estimate",
     .type = LOXO_OPTION_DOUBLE,
     .needs = {"method=fast"},
     .offset = FIELD(check_estimate),
     .min = 0.0,
     .max = 1e30,
     .help = "largest mean relative error that fast may estimate for itself"},
    {.name = NULL},
};

const char *loxo_geodesic_method_name(loxo_geodesic_method method)
{
    return method >= 0 && method < LOXO_GEODESIC_N_METHODS ? methods[method] : "unknown";
}

const char *loxo_geodesic_method_help(loxo_geodesic_method method)
{
    static const char *const helps[] = {LOXO_GEODESIC_METHOD_LIST(HELP)};
    return method >= 0 && method < LOXO_GEODESIC_N_METHODS ? helps[method] : "unknown";
}

uint32_t geodesic_methods_of(const loxo_geodesic_settings *settings)
{
    const loxo_geodesic_settings defaults = loxo_geodesic_settings_default();
    uint32_t left = (1U << LOXO_GEODESIC_N_METHODS) - 1U;
    for (const loxo_option *o = loxo_geodesic_options; o->name != NULL; ++o)
        if (o->methods != 0 && loxo_option_differs(o, settings, &defaults)) left &= o->methods;
    return left;
}
