/* SPDX-License-Identifier: MIT
 * Phases without barriers: every chunk is done once, after all of the phase before, whatever the number of threads. */
#include "base/os.h"
#include "par/phases.h"
#include "test.h"

#define N_PHASES   400
#define MOST_CHUNK 23

/* A run that is watched: who does a chunk notes it and looks whether the phase before is complete. */
typedef struct watched {
    int64_t phase; /* the one being done; -1 before the first */
    int64_t n_chunks[N_PHASES];
    int n_done[N_PHASES]; /* touched atomically, as all below */
    int times[N_PHASES][MOST_CHUNK];
    int n_early, n_foreign; /* chunks done too early; chunk numbers that the phase does not have */
    int n_advances_at_once, n_crowded;
    int n_polls, stop_at_poll; /* 0: never */
    int sum;                   /* plain: what one phase writes the next one reads */
    int parts[MOST_CHUNK];
} watched;

static int64_t next_phase(void *arg)
{
    watched *w = arg;
    if (__atomic_add_fetch(&w->n_advances_at_once, 1, __ATOMIC_SEQ_CST) != 1)
        __atomic_store_n(&w->n_crowded, 1, __ATOMIC_SEQ_CST);
    if (w->phase >= 0) {
        if (__atomic_load_n(&w->n_done[w->phase], __ATOMIC_RELAXED) != w->n_chunks[w->phase]) ++w->n_early;
        for (int64_t c = 0; c < w->n_chunks[w->phase]; ++c)
            w->sum += w->parts[c];
    }
    ++w->phase;
    __atomic_sub_fetch(&w->n_advances_at_once, 1, __ATOMIC_SEQ_CST);
    return w->phase == N_PHASES ? -1 : w->n_chunks[w->phase];
}

static void do_chunk(void *arg, int64_t chunk)
{
    watched *w = arg;
    const int64_t phase = w->phase; /* stands still while chunks are done */
    if (chunk < 0 || chunk >= w->n_chunks[phase]) {
        __atomic_add_fetch(&w->n_foreign, 1, __ATOMIC_RELAXED);
        return;
    }
    w->parts[chunk] = w->sum % 7 + (int)chunk;
    __atomic_add_fetch(&w->times[phase][chunk], 1, __ATOMIC_RELAXED);
    __atomic_add_fetch(&w->n_done[phase], 1, __ATOMIC_RELAXED);
}

static bool stop_at(void *arg)
{
    watched *w = arg;
    return ++w->n_polls == w->stop_at_poll;
}

static watched *watch(void)
{
    watched *w = loxo_allocate(test_context, 1, sizeof *w);
    uint32_t state = 1;
    memset(w, 0, sizeof *w);
    w->phase = -1;
    for (int p = 0; p < N_PHASES; ++p) {
        state = state * 1664525u + 1013904223u;
        w->n_chunks[p] = (int64_t)(state >> 16) % (MOST_CHUNK + 1);
        if (p % 10 < 3) w->n_chunks[p] = 0; /* several empty ones in a row, also the first and the last */
    }
    w->n_chunks[N_PHASES - 1] = 0;
    return w;
}

static const int ladder[] = {1, 2, 3, 8};
#define N_LADDER (int)(sizeof ladder / sizeof ladder[0])

TEST(every_chunk_is_done_once_and_in_its_phase)
{
    int sum = -1;
    for (int i = 0; i < N_LADDER; ++i) {
        watched *w = watch();
        const loxo_phases phases = {next_phase, do_chunk, NULL, w};
        CHECK(!loxo_phases_run(&phases, ladder[i]));
        CHECK_EQUAL(w->phase, N_PHASES);
        CHECK_EQUAL(w->n_early, 0);
        CHECK_EQUAL(w->n_foreign, 0);
        CHECK_EQUAL(w->n_crowded, 0);
        for (int p = 0; p < N_PHASES; ++p)
            for (int c = 0; c < w->n_chunks[p]; ++c)
                CHECK_EQUAL(w->times[p][c], 1);
        if (sum < 0) sum = w->sum;
        CHECK(sum > 0);
        CHECK_EQUAL(w->sum, sum); /* each phase saw what the one before had written */
        loxo_release(test_context, w);
    }
}

TEST(a_poll_ends_the_run_after_the_phase)
{
    for (int i = 0; i < N_LADDER; ++i)
        for (int at = 1; at < 200; at += 13) {
            watched *w = watch();
            const loxo_phases phases = {next_phase, do_chunk, stop_at, w};
            w->stop_at_poll = at;
            const bool is_stopped = loxo_phases_run(&phases, ladder[i]);
            /* With several threads the polling one may get less to do than that. */
            CHECK(is_stopped || ladder[i] > 1);
            CHECK(is_stopped ? w->n_polls >= at : w->phase == N_PHASES);
            if (is_stopped) {
                CHECK(w->phase < N_PHASES);
                for (int64_t p = 0; p <= w->phase; ++p)
                    CHECK_EQUAL(w->n_done[p], w->n_chunks[p]); /* never in the middle of one */
                for (int64_t p = w->phase + 1; p < N_PHASES; ++p)
                    CHECK_EQUAL(w->n_done[p], 0);
            }
            loxo_release(test_context, w);
        }
}

/* One phase of one chunk; who has nothing to do waits, while asked whether to stop, until all is over, and wants to stop then. */
typedef struct late {
    int n_advances, is_over;
} late;

static int64_t one_phase(void *arg)
{
    late *l = arg;
    if (l->n_advances++ == 0) return 1;
    __atomic_store_n(&l->is_over, 1, __ATOMIC_RELEASE);
    return -1;
}

static void take_time(void *arg, int64_t chunk)
{
    const double start_s = loxo_os_clock_s();
    (void)arg, (void)chunk;
    while (loxo_os_clock_s() < start_s + 2e-3)
        loxo_os_yield();
}

static bool wait_for_end(void *arg)
{
    late *l = arg;
    const double start_s = loxo_os_clock_s();
    while (__atomic_load_n(&l->is_over, __ATOMIC_ACQUIRE) == 0 && loxo_os_clock_s() < start_s + 1e-2)
        loxo_os_yield();
    return __atomic_load_n(&l->is_over, __ATOMIC_ACQUIRE) != 0;
}

TEST(a_stop_after_the_end_is_none)
{
    for (int i = 0; i < 50; ++i) {
        late l = {0};
        const loxo_phases phases = {one_phase, take_time, wait_for_end, &l};
        CHECK(!loxo_phases_run(&phases, 2));
    }
}

static int64_t never(void *arg)
{
    (void)arg;
    return -1;
}

TEST(no_phase_is_no_work)
{
    for (int i = 0; i < N_LADDER; ++i) {
        const loxo_phases phases = {never, do_chunk, stop_at, NULL};
        CHECK(!loxo_phases_run(&phases, ladder[i]));
    }
}
