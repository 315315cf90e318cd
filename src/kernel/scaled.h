/* SPDX-License-Identifier: MIT
 * Numbers as value * 2^scale. Heat falls by a constant factor per edge and leaves the range of doubles after some 700
 * of them; with a power of two per vertex nothing underflows at any width, and the scaling itself rounds nothing. */
#ifndef LOXO_KERNEL_SCALED_H
#define LOXO_KERNEL_SCALED_H

#include <stdint.h>
#include <string.h>

/* 2^n as a double; 0 below the normal range, the largest power above it: differences so large only meet factors that
 * do not matter any more. */
static inline double k_power_of_two(int64_t n)
{
    if (n < -1022) return 0.0;
    if (n > 1023) n = 1023;
    const uint64_t bits = (uint64_t)(n + 1023) << 52;
    double result;
    memcpy(&result, &bits, sizeof result);
    return result;
}

/* Exponent e with |x| in [2^e, 2^(e+1)); x must be a normal number. */
static inline int32_t k_exponent(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return (int32_t)((bits >> 52) & 0x7ffu) - 1023;
}

#endif
