/* SPDX-License-Identifier: MIT
 * Many short phases, each of a known number of chunks, without a barrier. Threads claim chunks; the one that finishes
 * the last chunk of a phase prepares the next, and does it alone if it is of one chunk. A thread that the system has taken
 * off its processor delays the others only while it holds a chunk, so a busy neighbour costs its share and not a time
 * slice per phase. Which thread does what is left to chance: chunks of one phase must not depend on each other.
 */
#ifndef LOXO_PAR_PHASES_H
#define LOXO_PAR_PHASES_H

#include "base/context.h"

#include <stdint.h>

typedef struct loxo_phases {
    /* Called by one thread at a time, before the first phase and after each: the number of chunks of the next phase, at
     * most 2^31; 0 is allowed; negative ends it. */
    int64_t (*advance)(void *arg);
    void (*work)(void *arg, int64_t chunk);
    /* Called by the calling thread now and then; true asks for the end after the phase. May be NULL. */
    bool (*poll)(void *arg);
    void *arg;
} loxo_phases;

/* Runs all phases on n_threads threads. Returns true when poll asked for the end and got it: advance had not given it yet. Whether
 * it would have, as after the last phase, only the caller can know. */
bool loxo_phases_run(const loxo_phases *phases, int n_threads);

#endif
