/* SPDX-License-Identifier: MIT
 * Settings of the barycenter: defaults in one function, everything else about them in one table; names. */
#include "solver/barycenter/search_options.h"

#include <loxo/barycenter.h>
#include <loxo/polygon.h>

#include <math.h>

loxo_barycenter_settings loxo_barycenter_settings_default(void)
{
    return (loxo_barycenter_settings){
        .method = LOXO_BARYCENTER_DAMPED,
        .tolerance = 0.0,
        .max_iterations = 100,
        .regularization = 1.0, /* the paper's alpha */
    };
}

#define FIELD(name)              offsetof(loxo_barycenter_settings, name)
#define CHOICE(NAME, name, help) name,

static const char *const methods[] = {LOXO_BARYCENTER_METHOD_LIST(CHOICE) NULL};

const loxo_option loxo_barycenter_options[] = {
    {.name = "method",
     .type = LOXO_OPTION_CHOICE,
     .offset = FIELD(method),
     .choices = methods,
     .help = "how the barycenter is searched for"},
    SEARCH_TOLERANCE(loxo_barycenter_settings, "hyperbolic distance"),
    SEARCH_MAX_ITERATIONS(loxo_barycenter_settings, "most steps"),
    {.name = "regularization",
     .type = LOXO_OPTION_DOUBLE,
     .offset = FIELD(regularization),
     .methods = 1U << LOXO_BARYCENTER_REGULARIZED,
     .min = 0.0,
     .max = 1e6,
     .help = "alpha of (29)"},
    {.name = NULL},
};

const char *loxo_barycenter_method_name(loxo_barycenter_method method)
{
    return (unsigned)method < LOXO_BARYCENTER_N_METHODS ? methods[method] : "unknown";
}

const char *loxo_barycenter_class_name(loxo_barycenter_class kind)
{
    static const char *const names[] = {"stable", "not unique", "none"};
    return (unsigned)kind < 3 ? names[kind] : "unknown";
}

const char *loxo_barycenter_stop_name(loxo_barycenter_stop stop)
{
    static const char *const names[] = {"bound", "rounding", "iterations", "ideal", "monitor"};
    return (unsigned)stop < 5 ? names[stop] : "unknown";
}

loxo_polygon_settings loxo_polygon_settings_default(void)
{
    return (loxo_polygon_settings){.tolerance = 0.0, .max_iterations = 100, .edges = false};
}

#define POLYGON_FIELD(name) offsetof(loxo_polygon_settings, name)

const loxo_option loxo_polygon_options[] = {
    SEARCH_TOLERANCE(loxo_polygon_settings, "distance of the edges' barycenter from the centre"),
    SEARCH_MAX_ITERATIONS(loxo_polygon_settings, "most steps of one polygon"),
    {.name = "edges", .type = LOXO_OPTION_BOOL, .offset = POLYGON_FIELD(edges), .help = "write edges, not vertices"},
    {.name = NULL},
};

loxo_polygon_sample_settings loxo_polygon_sample_settings_default(void)
{
    return (loxo_polygon_sample_settings){
        .seed = 1, .measure = LOXO_POLYGON_WALKS, .tolerance = 0.0, .max_iterations = 100, .edges = false};
}

#define SAMPLE_FIELD(name) offsetof(loxo_polygon_sample_settings, name)

static const char *const measures[] = {"walks", "volume", NULL};

const loxo_option loxo_polygon_sample_options[] = {
    {.name = "seed",
     .type = LOXO_OPTION_UINT64,
     .offset = SAMPLE_FIELD(seed),
     .min = 0.0,
     .max = HUGE_VAL,
     .help = "of the random numbers"},
    {.name = "measure",
     .type = LOXO_OPTION_CHOICE,
     .offset = SAMPLE_FIELD(measure),
     .choices = measures,
     .help = "what the weights lead to: random walks that close, or the volume of the set of closed polygons"},
    SEARCH_TOLERANCE(loxo_polygon_sample_settings, "distance of the edges' barycenter from the centre"),
    SEARCH_MAX_ITERATIONS(loxo_polygon_sample_settings, "most steps of one polygon"),
    {.name = "edges", .type = LOXO_OPTION_BOOL, .offset = SAMPLE_FIELD(edges), .help = "write edges, not vertices"},
    {.name = NULL},
};

const char *loxo_polygon_state_name(loxo_polygon_state state)
{
    static const char *const names[] = {"closed", "loose", "flat", "cannot close", "bad", "left"};
    return (unsigned)state < 6 ? names[state] : "unknown";
}
