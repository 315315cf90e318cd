/* SPDX-License-Identifier: MIT
 * A monitor that stops a solve when it is asked for the stop_at-th time. */
#ifndef LOXO_TESTS_SOLVER_STOPPER_H
#define LOXO_TESTS_SOLVER_STOPPER_H

#include "../test.h"
#include "base/context.h"

typedef struct stopper {
    loxo_context *ctx;
    int n_calls, stop_at;
} stopper;

/* Asked every 20 ms only; here the clock of the last question is turned back. */
static inline int stop_monitor(void *user, const loxo_progress *progress)
{
    stopper *w = user;
    w->ctx->last_progress_s = -1e9;
    CHECK(progress->fraction >= 0.0 && progress->fraction <= 1.0);
    return ++w->n_calls == w->stop_at;
}

/* Asks from the first chance on, and not after 20 ms, until stopper_end. */
static inline void stopper_begin(stopper *w, loxo_context *ctx, int stop_at)
{
    *w = (stopper){.ctx = ctx, .stop_at = stop_at};
    loxo_context_set_monitor(ctx, stop_monitor, w);
    loxo_progress_enter(ctx);
    ctx->last_progress_s = -1e9;
}

static inline void stopper_end(const stopper *w)
{
    loxo_progress_leave(w->ctx);
    loxo_context_set_monitor(w->ctx, NULL, NULL);
}

#endif
