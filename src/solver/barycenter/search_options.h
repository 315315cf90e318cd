/* SPDX-License-Identifier: MIT
 * Options that every search for a barycenter has: the same rows in all tables. */
#ifndef LOXO_SOLVER_BARYCENTER_SEARCH_OPTIONS_H
#define LOXO_SOLVER_BARYCENTER_SEARCH_OPTIONS_H

#include "base/options.h"

#include <math.h>
#include <stddef.h>

/* of: a settings struct with a double `tolerance`. */
#define SEARCH_TOLERANCE(of, what)                                                                                     \
    {                                                                                                                  \
        .name = "tolerance", .type = LOXO_OPTION_DOUBLE, .offset = offsetof(of, tolerance), .min = 0.0,                \
        .max = HUGE_VAL, .help = "of the certified " what "; 0: as far as doubles go"                                  \
    }

/* of: a settings struct with an int64_t `max_iterations`. */
#define SEARCH_MAX_ITERATIONS(of, text)                                                                                \
    {                                                                                                                  \
        .name = "max-iterations", .type = LOXO_OPTION_INT64, .offset = offsetof(of, max_iterations), .min = 0.0,       \
        .max = 1e9, .help = (text)                                                                                     \
    }

#endif
