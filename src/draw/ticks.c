/* SPDX-License-Identifier: MIT */
#include "draw/ticks.h"

#include <math.h>
#include <string.h>

#define MAX_NUMBER 1e12 /* of a tick: beyond, labels would differ in their 13th digit */

/* factor * 10^exponent; dividing by a whole power is exact where multiplying by 0.1 is not. */
static double scaled(double factor, int exponent)
{
    if (exponent >= 0) return factor * pow(10.0, exponent);
    if (exponent >= -300) return factor / pow(10.0, -exponent);
    return factor / 1e300 / pow(10.0, -300 - exponent);
}

loxo_draw_ticks loxo_draw_ticks_find(double low, double high, double n)
{
    loxo_draw_ticks t = {.first = 0, .last = -1, .factor = 1};
    const double wanted = (0.5 * high - 0.5 * low) / n * 2.0; /* halves: high - low may overflow */
    if (!(wanted > 0.0) || !isfinite(wanted)) return t;
    t.exponent = (int)floor(log10(wanted));
    const double mantissa = wanted / scaled(1.0, t.exponent);
    t.factor = mantissa < sqrt(2.0) ? 1 : mantissa < sqrt(10.0) ? 2 : mantissa < sqrt(50.0) ? 5 : 10;
    if (t.factor == 10) t.factor = 1, t.exponent += 1;
    const double largest = fmax(fabs(low), fabs(high)), step = loxo_draw_tick_step(&t);
    const int magnitude = (int)floor(log10(largest));
    t.shift = magnitude >= -3 && magnitude <= 4 ? 0 : magnitude;
    if (!(step > 0.0) || largest / step > MAX_NUMBER) return t;
    t.first = (int64_t)ceil(low / step - 1e-6);
    t.last = (int64_t)floor(high / step + 1e-6);
    return t;
}

double loxo_draw_tick_step(const loxo_draw_ticks *ticks) { return scaled(ticks->factor, ticks->exponent); }

double loxo_draw_tick_value(const loxo_draw_ticks *ticks, int64_t number)
{
    return scaled((double)(number * ticks->factor), ticks->exponent);
}

void loxo_draw_tick_text(const loxo_draw_ticks *ticks, int64_t number, char *text)
{
    char reversed[64];
    const bool is_negative = number < 0;
    uint64_t digits = (uint64_t)(is_negative ? -number : number) * (uint64_t)ticks->factor;
    int n = 0, power = ticks->exponent - ticks->shift; /* of ten, of the last digit of `digits` */
    power = power > 12 ? 12 : power < -30 ? -30 : power;
    for (; power > 0; --power)
        digits *= 10;
    for (int i = 0; i <= -power || digits > 0; ++i) {
        if (i > 0 && i == -power) reversed[n++] = '.';
        reversed[n++] = (char)('0' + digits % 10);
        digits /= 10;
    }
    if (is_negative) reversed[n++] = '-';
    for (int i = 0; i < n; ++i)
        text[i] = reversed[n - 1 - i];
    text[n] = '\0';
}

double loxo_draw_log_tick_value(const loxo_draw_log_tick *tick) { return scaled(tick->factor, tick->exponent); }

int loxo_draw_log_ticks_find(double low, double high, double n, loxo_draw_log_tick tick[LOXO_DRAW_MAX_LOG_TICKS])
{
    const double from = log10(low), to = log10(high), decades = to - from;
    int n_found = 0;
    if (!(decades >= 0.75)) return 0;
    const int stride = decades > n ? (int)ceil(decades / n) : 1; /* decades from one major tick to the next */
    const bool has_minor = decades <= 10.0;
    const double give = 1e-9 * (fabs(from) + fabs(to)); /* what rounding of the ends may hide */
    for (int exponent = (int)floor(from); exponent <= (int)ceil(to); ++exponent)
        for (int factor = 1; factor <= 9; ++factor) {
            const double place = exponent + log10(factor);
            const bool is_one = factor == 1 && exponent % stride == 0;
            const bool is_major = is_one || (decades < 2.0 && (factor == 2 || factor == 5));
            if (place < from - give || place > to + give || n_found == LOXO_DRAW_MAX_LOG_TICKS) continue;
            if (is_major || has_minor || (factor == 1 && stride <= 4))
                tick[n_found++] = (loxo_draw_log_tick){factor, exponent, is_major};
        }
    return n_found;
}
