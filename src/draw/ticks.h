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

#endif
