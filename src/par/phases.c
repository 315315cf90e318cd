/* SPDX-License-Identifier: MIT */
#include "par/phases.h"

#include "base/os.h"

#include <omp.h>

#define SPINS_BEFORE_YIELD 2000
#define ALONE_BEFORE_POLL  64
#define OVER               UINT64_MAX
#define CLOSED             UINT32_MAX /* more than any number of chunks */

/* word: number of the phase in the upper half, next unclaimed chunk in the lower. It is written last when a phase is
 * prepared and compared when a chunk is claimed. Before n_chunks changes, the word says that nothing is left (CLOSED):
 * who sees the new n_chunks sees that the old word is gone, too, so a chunk can be claimed of the phase that n_chunks
 * belongs to only. */
typedef struct shared_state {
    _Alignas(64) uint64_t word;
    _Alignas(64) int64_t n_done;
    int64_t n_chunks;
    _Alignas(64) int is_stop_wanted;
    int is_stopped; /* for that reason, before advance gave the end */
} shared_state;

static bool run_alone(const loxo_phases *phases)
{
    for (;;) {
        const int64_t n_chunks = phases->advance(phases->arg);
        if (n_chunks < 0) return false;
        for (int64_t chunk = 0; chunk < n_chunks; ++chunk)
            phases->work(phases->arg, chunk);
        if (phases->poll != NULL && phases->poll(phases->arg)) return true;
    }
}

static void poll(const loxo_phases *phases, shared_state *s)
{
    if (phases->poll(phases->arg)) __atomic_store_n(&s->is_stop_wanted, 1, __ATOMIC_RELAXED);
}

/* Prepares phases until one has chunks for several threads; only one thread is ever here. A phase of one chunk it does itself: given
 * to a thread that is off its processor, that would hold up all. */
static void open_next(const loxo_phases *phases, shared_state *s, uint64_t phase, bool polls)
{
    int64_t n_chunks = 0;
    for (int64_t n_alone = 0; n_chunks == 0;) {
        s->is_stopped = __atomic_load_n(&s->is_stop_wanted, __ATOMIC_RELAXED);
        n_chunks = s->is_stopped != 0 ? -1 : phases->advance(phases->arg);
        if (n_chunks != 1) continue;
        phases->work(phases->arg, 0);
        n_chunks = 0;
        if (polls && ++n_alone % ALONE_BEFORE_POLL == 0) poll(phases, s);
    }
    __atomic_store_n(&s->n_done, 0, __ATOMIC_RELAXED);
    __atomic_store_n(&s->word, (phase & 0x7fffffffu) << 32 | CLOSED, __ATOMIC_RELAXED);
    __atomic_store_n(&s->n_chunks, n_chunks, __ATOMIC_RELEASE);
    __atomic_store_n(&s->word, n_chunks < 0 ? OVER : (phase & 0x7fffffffu) << 32, __ATOMIC_RELEASE);
}

static void run_thread(const loxo_phases *phases, shared_state *s)
{
    const bool polls = phases->poll != NULL && omp_get_thread_num() == 0;
    int n_spins = 0;
    for (;;) {
        uint64_t word = __atomic_load_n(&s->word, __ATOMIC_ACQUIRE);
        if (word == OVER) return;
        const int64_t chunk = (int64_t)(word & UINT32_MAX), n_chunks = __atomic_load_n(&s->n_chunks, __ATOMIC_ACQUIRE);
        if (chunk >= n_chunks) {
            if (++n_spins > SPINS_BEFORE_YIELD) {
                n_spins = 0;
                /* It may get no chunk for long, where phases are short and others quicker. */
                if (polls) poll(phases, s);
                loxo_os_yield();
            }
            continue;
        }
        if (!__atomic_compare_exchange_n(&s->word, &word, word + 1, true, __ATOMIC_ACQ_REL, __ATOMIC_RELAXED)) continue;
        n_spins = 0;
        phases->work(phases->arg, chunk);
        if (polls) poll(phases, s);
        if (__atomic_add_fetch(&s->n_done, 1, __ATOMIC_ACQ_REL) == n_chunks)
            open_next(phases, s, (word >> 32) + 1, polls);
    }
}

bool loxo_phases_run(const loxo_phases *phases, int n_threads)
{
    shared_state s = {0};
    if (n_threads <= 1 || omp_in_parallel()) return run_alone(phases);
    open_next(phases, &s, 0, phases->poll != NULL);
#pragma omp parallel num_threads(n_threads)
    run_thread(phases, &s);
    return s.is_stopped != 0;
}
