/* SPDX-License-Identifier: MIT
 * What long work tells while it runs, and how it is stopped. */
#ifndef LOXO_MONITOR_H
#define LOXO_MONITOR_H

#include <loxo/base.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct loxo_progress {
    const char *phase;    /* "read", "half-edges", "diffusion", ...; static storage */
    double fraction;      /* share of the phase that is done, 0 to 1; negative when unknown */
    int64_t iteration;    /* of the phase; for the diffusion: levels taken in */
    int64_t n_iterations; /* most there can be; 0 when unknown */
    double objective;     /* NaN where there is none */
    double residual;      /* NaN where there is none */
    double elapsed_s;     /* since the call into the library began */
    /* of optimisers; 0 where there is none */
    double gradient_norm; /* its largest entry in size */
    double radius;        /* of the trust region */
} loxo_progress;

/* Called between iterations, from the thread that called the library, and not more often than about every
 * 20 ms but by optimisers of which each step solves large systems, which tell of every step; other threads of the library may be at work meanwhile. Nonzero asks the work to stop: it then returns LOXO_STOPPED (output is the last
 * state) or LOXO_ERR_STOPPED (there was none yet). */
typedef int (*loxo_monitor_fn)(void *user, const loxo_progress *progress);

#ifdef __cplusplus
}
#endif
#endif
