/* SPDX-License-Identifier: MIT
 * Round numbers along a scale. */
#ifndef LOXO_DRAW_TICKS_H
#define LOXO_DRAW_TICKS_H

#include <stdbool.h>
#include <stdint.h>

/* Values number * factor * 10^exponent, number from first to last; factor 1, 2 or 5. Labels leave 10^shift out. */
typedef struct loxo_draw_ticks {
    int64_t first, last; /* last < first: none */
    int factor, exponent, shift;
} loxo_draw_ticks;

/* About n round values between low and high (low < high, both finite). */
loxo_draw_ticks loxo_draw_ticks_find(double low, double high, double n);
double loxo_draw_tick_step(const loxo_draw_ticks *ticks);
double loxo_draw_tick_value(const loxo_draw_ticks *ticks, int64_t number);
/* Its digits, exactly, whatever the locale; text takes 64 bytes. */
void loxo_draw_tick_text(const loxo_draw_ticks *ticks, int64_t number, char *text);

/* On a logarithmic scale: factor * 10^exponent, factor 1 to 9. */
typedef struct loxo_draw_log_tick {
    int factor, exponent;
    bool is_major; /* round enough for a number beside it */
} loxo_draw_log_tick;

#define LOXO_DRAW_MAX_LOG_TICKS 128

/* Ticks between low and high (0 < low < high, both finite), about n of them major: powers of ten, or every few of them;
 * over less than two decades 1, 2 and 5 times such; none where low and high are so near that a linear scale has the better
 * numbers. Returns how many. */
int loxo_draw_log_ticks_find(double low, double high, double n, loxo_draw_log_tick tick[LOXO_DRAW_MAX_LOG_TICKS]);
double loxo_draw_log_tick_value(const loxo_draw_log_tick *tick);

#endif
