/* SPDX-License-Identifier: MIT
 * Settings of the spherical maps: defaults in one function, everything else about them in one table; names of all lists. */
#include "base/options.h"
#include "solver/sphere/sphere_internal.h"

loxo_sphere_settings loxo_sphere_settings_default(void)
{
    return (loxo_sphere_settings){
        .method = LOXO_SPHERE_NEWTON,
        .start = LOXO_SPHERE_START_AUTO,
        .tolerance = 1e-9, /* the paper's */
        .max_iterations = 500,
        .factor = LOXO_SPHERE_MULTIGRID,
        .is_free = false,
        .is_unfolded = true,
        .is_centred = true,
    };
}

#define FIELD(name) offsetof(loxo_sphere_settings, name)

#define NEWTON     (1U << LOXO_SPHERE_NEWTON)
#define HAS_STEPS  (~(1U << LOXO_SPHERE_FLASH))
#define HAS_STARTS (NEWTON | 1U << LOXO_SPHERE_HBTR)

#define CHOICE(NAME, name, help) #name,
#define HELP(NAME, name, help)   help,
static const char *const methods[] = {LOXO_SPHERE_METHOD_LIST(CHOICE) NULL};
static const char *const method_help[] = {LOXO_SPHERE_METHOD_LIST(HELP) NULL};
static const char *const starts[] = {LOXO_SPHERE_START_LIST(CHOICE) NULL};
static const char *const factors[] = {"multigrid", "cholesky", NULL};
static const char *const stops[] = {"tolerance", "rounding", "max-iterations", "rise", "stalled", "monitor"};
static const char *const phases[] = {"prepare", "start", "iterate", "unfold", "center", "check"};

const loxo_option loxo_sphere_options[] = {
    {.name = "method",
     .type = LOXO_OPTION_CHOICE,
     .offset = FIELD(method),
     .choices = methods,
     .help = "how the map is found"},
    {.name = "start",
     .type = LOXO_OPTION_CHOICE,
     .methods = HAS_STARTS,
     .offset = FIELD(start),
     .choices = starts,
     .help = "the map to begin with; auto: harmonic, and where that folds a more robust one"},
    {.name = "tolerance",
     .type = LOXO_OPTION_DOUBLE,
     .methods = HAS_STEPS,
     .offset = FIELD(tolerance),
     .min = 0.0,
     .max = 1.0,
     .help = "newton: the residual; hbtr: (4.4); scem: fall of the energy in a step; cmcf: how far the map moves"},
    {.name = "max-iterations",
     .type = LOXO_OPTION_INT64,
     .methods = HAS_STEPS,
     .offset = FIELD(max_iterations),
     .min = 0.0,
     .max = 1e9,
     .help = "most steps"},
    {.name = "factor",
     .type = LOXO_OPTION_CHOICE,
     .offset = FIELD(factor),
     .choices = factors,
     .help = "linear systems: multigrid, or factors by CHOLMOD"},
    {.name = "free",
     .type = LOXO_OPTION_BOOL,
     .methods = NEWTON,
     .offset = FIELD(is_free),
     .help = "least energy without the constraint that the map be centred"},
    {.name = "unfold",
     .type = LOXO_OPTION_BOOL,
     .offset = FIELD(is_unfolded),
     .help = "mend triangles that are turned over at the end"},
    {.name = "center",
     .type = LOXO_OPTION_BOOL,
     .offset = FIELD(is_centred),
     .help = "move the area-weighted mean to 0 by a Moebius map at the end"},
    {.name = NULL},
};

static const char *name_in(const char *const *names, int n, int i) { return i >= 0 && i < n ? names[i] : "unknown"; }

#define N_OF(list) (int)(sizeof(list) / sizeof(list)[0])

const char *loxo_sphere_method_name(loxo_sphere_method method)
{
    return name_in(methods, LOXO_SPHERE_N_METHODS, (int)method);
}

const char *loxo_sphere_method_help(loxo_sphere_method method)
{
    return name_in(method_help, LOXO_SPHERE_N_METHODS, (int)method);
}

const char *loxo_sphere_start_name(loxo_sphere_start start)
{
    return name_in(starts, LOXO_SPHERE_N_STARTS, (int)start);
}

const char *loxo_sphere_stop_name(loxo_sphere_stop stop) { return name_in(stops, N_OF(stops), (int)stop); }

const char *loxo_sphere_phase_name(loxo_sphere_phase phase) { return name_in(phases, N_OF(phases), (int)phase); }
