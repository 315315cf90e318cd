/* SPDX-License-Identifier: MIT */
#define _DEFAULT_SOURCE /* sigaction, SIGXFSZ */

#include "signals.h"

#include <signal.h>
#include <stddef.h>
#include <time.h>
#include <unistd.h>

/* timeout(1) and some shells send a signal to the process and to its group: both are one request. */
#define ONE_REQUEST_MS 200

static volatile sig_atomic_t caught, caught_at;
static volatile sig_atomic_t pipe_closed, is_held;

/* Milliseconds, for differences only. clock_gettime may be called in a handler. */
static sig_atomic_t milliseconds(void)
{
    struct timespec t;
    if (clock_gettime(CLOCK_MONOTONIC, &t) != 0) return 0;
    return (sig_atomic_t)((t.tv_sec % 1000000) * 1000 + t.tv_nsec / 1000000);
}

static void on_stop(int number)
{
    const sig_atomic_t now = milliseconds();
    if (caught == 0) {
        caught = number;
        caught_at = now;
    } else if (is_held == 0 && (now - caught_at > ONE_REQUEST_MS || now < caught_at)) {
        _exit(128 + number); /* asked twice: at once */
    }
}

static void on_pipe(int number)
{
    (void)number;
    pipe_closed = 1;
}

void signals_install(void)
{
    /* A shell starts jobs in the background with SIGINT ignored; whoever sends it to this process by number means it, so
     * only SIGHUP stays ignored where it is (nohup). */
    static const int stops[] = {SIGINT, SIGTERM, SIGHUP};
    struct sigaction action = {.sa_handler = on_stop, .sa_flags = SA_RESTART}, old;
    (void)sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < sizeof stops / sizeof *stops; ++i) {
        if (sigaction(stops[i], NULL, &old) != 0) continue;
        if (stops[i] == SIGHUP && old.sa_handler == SIG_IGN) continue;
        (void)sigaction(stops[i], &action, NULL);
    }
    /* Writing to a closed pipe then fails with EPIPE, which takes the ordinary way out: nothing is left half done. */
    action.sa_handler = on_pipe;
    (void)sigaction(SIGPIPE, &action, NULL);
    /* The same for a file that grows beyond its limit: EFBIG instead of a signal. */
    action.sa_handler = SIG_IGN;
    (void)sigaction(SIGXFSZ, &action, NULL);
}

int signals_caught(void) { return caught; }

void signals_hold(void) { is_held = 1; }

bool signals_pipe_closed(void) { return pipe_closed != 0; }
