/* SPDX-License-Identifier: MIT */
#include "io/print.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

__extension__ typedef unsigned __int128 wide;

static const uint64_t power_of_ten[20] = {1u,
                                          10u,
                                          100u,
                                          1000u,
                                          10000u,
                                          100000u,
                                          1000000u,
                                          10000000u,
                                          100000000u,
                                          1000000000u,
                                          10000000000u,
                                          100000000000u,
                                          1000000000000u,
                                          10000000000000u,
                                          100000000000000u,
                                          1000000000000000u,
                                          10000000000000000u,
                                          100000000000000000u,
                                          1000000000000000000u,
                                          10000000000000000000u};

/* A width of floating point: its digits, and how far 128 bits carry m 10^k. */
typedef struct width {
    uint64_t hidden_bit; /* of the significand */
    int n_min, n_max;    /* every decimal of n_min digits survives the trip through it; n_max digits always tell it */
    int k_max;           /* hidden_bit * 2 * 10^k_max < 2^128 */
} width;

static const width double_kind = {(uint64_t)1 << 52, 15, 17, 22};
static const width float_kind = {(uint64_t)1 << 23, 6, 9, 31};

/* Finds the decimal digits * 10^-k of least length that is nearer to m 2^e than to any other number of its kind.
 * Rounding to n digits is tried for n = n_min, n_min + 1, ...: a shorter decimal that survives shows up among n_min
 * digits with zeros at its end. false when 128 bits are not enough. */
static bool find_shortest(uint64_t m, int e, const width *kind, uint64_t *digits, int *k_out)
{
    const int top = e + 63 - __builtin_clzll(m);        /* 2^top <= m 2^e */
    int exponent = (int)(((int64_t)top * 78913) >> 18); /* floor(top log10 2): the decimal exponent or one less */
    if (exponent < kind->n_min - 1 - kind->k_max || exponent > 16 || e < -120) return false;
    for (int n = kind->n_min; n <= 18; ++n) {
        const int k = n - 1 - exponent;
        if (k < 0) continue;
        if (k > kind->k_max) return false;
        const wide scale = k < 20 ? power_of_ten[k] : (wide)power_of_ten[19] * power_of_ten[k - 19];
        const wide product = m * scale; /* m 2^e 10^k = product 2^e */
        const int shift = e < 0 ? -e : 0;
        wide quotient = e < 0 ? product >> shift : product << e;
        wide miss = e < 0 ? product - (quotient << shift) : 0; /* in units of 2^e 10^-k, as scale is one ulp */
        const wide half = e < 0 ? (wide)1 << (shift - 1) : 1;
        bool is_above = false;
        if (miss > half || (miss == half && (quotient & 1u) != 0)) {
            ++quotient;
            miss = 2 * half - miss;
            is_above = true;
        }
        if (quotient >= power_of_ten[n]) { /* exponent was one less, or the rounding carried */
            if (n == 18) return false;
            ++exponent;
            --n;
            continue;
        }
        /* Below the least number of a binade the neighbour is half as far. */
        const wide gap = !is_above && m == kind->hidden_bit ? scale / 2 : scale;
        if (2 * miss < gap || (2 * miss == gap && (m & 1u) == 0)) {
            *digits = (uint64_t)quotient;
            *k_out = k;
            return true;
        }
        if (n > kind->n_max && n > exponent + 1) return false;
    }
    return false;
}

/* Decimal digits of value, most significant first. */
static int write_digits(char *text, uint64_t value)
{
    char reversed[20];
    int n = 0;
    do {
        reversed[n++] = (char)('0' + value % 10);
        value /= 10;
    } while (value != 0);
    for (int i = 0; i < n; ++i)
        text[i] = reversed[n - 1 - i];
    return n;
}

size_t loxo_print_int(char *text, int64_t value)
{
    size_t n = 0;
    uint64_t magnitude = (uint64_t)value;
    if (value < 0) {
        text[n++] = '-';
        magnitude = 0 - magnitude;
    }
    return n + (size_t)write_digits(text + n, magnitude);
}

/* digits * 10^-k, plainly from 1e-5 on and with an exponent below. */
static size_t write_decimal(char *text, uint64_t digits, int k)
{
    char d[20];
    int n = write_digits(d, digits);
    int exponent = n - 1 - k;
    while (n > 1 && d[n - 1] == '0')
        --n;
    size_t used = 0;
    if (exponent < -5) {
        text[used++] = d[0];
        if (n > 1) {
            text[used++] = '.';
            memcpy(text + used, d + 1, (size_t)n - 1);
            used += (size_t)n - 1;
        }
        text[used++] = 'e';
        return used + loxo_print_int(text + used, exponent);
    }
    if (exponent < 0) {
        text[used++] = '0';
        text[used++] = '.';
        for (; exponent < -1; ++exponent)
            text[used++] = '0';
        memcpy(text + used, d, (size_t)n);
        return used + (size_t)n;
    }
    for (int i = 0; i < n || i <= exponent; ++i) {
        if (i == exponent + 1) text[used++] = '.';
        text[used++] = (char)(i < n ? d[i] : '0');
    }
    return used;
}

/* What find_shortest leaves: rare magnitudes. The C library writes the separator of the host's locale; all that is not
 * part of a number stands for it. */
static size_t write_rare(char *text, double value, int n_digits)
{
    char raw[64];
    snprintf(raw, sizeof raw, "%.*e", n_digits - 1, value);
    size_t used = 0;
    bool has_point = false;
    for (const char *c = raw; *c != '\0'; ++c) {
        if ((*c >= '0' && *c <= '9') || *c == '-' || *c == '+' || *c == 'e') {
            text[used++] = *c;
        } else if (!has_point) {
            text[used++] = '.';
            has_point = true;
        }
    }
    return used;
}

/* The magnitude is m 2^e; value is for the rare ones. */
static size_t print_finite(char *text, bool is_negative, uint64_t m, int e, double value, const width *kind)
{
    uint64_t digits = 0;
    int k = 0;
    size_t used = 0;
    if (m != 0 && !find_shortest(m, e, kind, &digits, &k)) return write_rare(text, value, kind->n_max);
    if (is_negative) text[used++] = '-';
    return used + write_decimal(text + used, digits, k);
}

static size_t print_special(char *text, double value)
{
    const char *name = isnan(value) ? "nan" : value < 0 ? "-inf" : "inf";
    const size_t n = strlen(name);
    memcpy(text, name, n);
    return n;
}

size_t loxo_print_double(char *text, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    const int biased = (int)((bits >> 52) & 0x7ff);
    const uint64_t fraction = bits & (double_kind.hidden_bit - 1);
    if (biased == 0x7ff) return print_special(text, value);
    return print_finite(text, bits >> 63 != 0, biased > 0 ? fraction | double_kind.hidden_bit : fraction,
                        (biased > 0 ? biased : 1) - 1075, value, &double_kind);
}

size_t loxo_print_float(char *text, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    const int biased = (int)((bits >> 23) & 0xff);
    const uint64_t fraction = bits & (float_kind.hidden_bit - 1);
    if (biased == 0xff) return print_special(text, (double)value);
    return print_finite(text, bits >> 31 != 0, biased > 0 ? fraction | float_kind.hidden_bit : fraction,
                        (biased > 0 ? biased : 1) - 150, (double)value, &float_kind);
}
