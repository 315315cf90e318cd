/* SPDX-License-Identifier: MIT
 * Numbers from text. A decimal m * 10^e with m < 2^64 and |e| <= 27 is rounded exactly in 128 bits; what is longer or
 * further from one goes through integers of many words, which is exact too. */
#include "io/scan.h"

#include <math.h>
#include <string.h>

__extension__ typedef unsigned __int128 uint128;

#define MAX_EXACT_POWER 27  /* 5^27 < 2^63 */
#define MAX_U64_DIGITS  19  /* 10^19 - 1 < 2^64 */
#define MAX_DIGITS      800 /* more than 767 digits decide nothing but whether a tie is exact */
#define BIG_WORDS       100 /* 5^1131 has 2627 bits, 10^801 has 2661, one word of shift on top */

static const uint64_t power_of_5[MAX_EXACT_POWER + 1] = {
    1u,
    5u,
    25u,
    125u,
    625u,
    3125u,
    15625u,
    78125u,
    390625u,
    1953125u,
    9765625u,
    48828125u,
    244140625u,
    1220703125u,
    6103515625u,
    30517578125u,
    152587890625u,
    762939453125u,
    3814697265625u,
    19073486328125u,
    95367431640625u,
    476837158203125u,
    2384185791015625u,
    11920928955078125u,
    59604644775390625u,
    298023223876953125u,
    1490116119384765625u,
    7450580596923828125u,
};

static const double power_of_10[23] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                       1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/* A decimal number as it stands in the text. */
typedef struct decimal {
    const char *digits;  /* first digit or point */
    const char *end;     /* behind the last digit of the mantissa */
    int64_t exponent_10; /* of the last digit */
} decimal;

/* q * 2^exponent, plus less than one unit of q's last bit when more is set, to the nearest double, ties to even.
 * The top bit of q is set. Overflow gives infinity, underflow a subnormal number or zero. */
static double round_to_double(uint64_t q, bool more, int exponent)
{
    const int top = exponent + 63; /* 2^top <= value < 2^(top + 1) */
    const int n_drop = top < -1022 ? 11 + (-1022 - top) : 11;
    uint64_t kept, rest, half, bits;
    double value;
    if (top > 1023) return HUGE_VAL;
    if (n_drop > 64) return 0.0;
    kept = n_drop == 64 ? 0 : q >> n_drop;
    rest = n_drop == 64 ? q : q & ((UINT64_C(1) << n_drop) - 1);
    half = UINT64_C(1) << (n_drop - 1);
    if (rest > half || (rest == half && (more || (kept & 1u) != 0))) ++kept;
    /* A carry out of the mantissa moves into the exponent by itself, up to infinity. */
    bits = top < -1022 ? kept : ((uint64_t)(top + 1022) << 52) + kept;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* m * 10^e for |e| <= MAX_EXACT_POWER and m != 0. */
static double round_small_power(uint64_t m, int e)
{
    if (e < 0) {
        /* m / 5^-e / 2^-e: both to full 64 bits, so that the quotient has 63 or 64. */
        const int shift_d = __builtin_clzll(power_of_5[-e]), shift_m = __builtin_clzll(m);
        const uint64_t d = power_of_5[-e] << shift_d;
        const uint128 n = (uint128)(m << shift_m) << 63;
        const uint64_t q = (uint64_t)(n / d), r = (uint64_t)(n % d);
        const int shift_q = __builtin_clzll(q);
        /* The bit that the shift brings in is 0 or 1 as the next bit of the quotient is. */
        const uint64_t next = shift_q == 1 ? (uint64_t)(((uint128)r << 1) >= d) : 0;
        const bool more = shift_q == 1 ? ((uint128)r << 1) != (next != 0 ? (uint128)d : 0) : r != 0;
        return round_to_double((q << shift_q) | next, more, e - shift_m - 63 + shift_d - shift_q);
    }
    const uint128 n = (uint128)m * power_of_5[e];
    const uint64_t high = (uint64_t)(n >> 64), low = (uint64_t)n;
    if (high == 0) {
        const int shift = __builtin_clzll(low);
        return round_to_double(low << shift, false, e - shift);
    }
    const int shift = __builtin_clzll(high);
    const uint128 top = n << shift;
    return round_to_double((uint64_t)(top >> 64), (uint64_t)top != 0, e + 64 - shift);
}

/* ---- integers of many words ---------------------------------------------------------------------------------- */

typedef struct big {
    int n; /* words in use; the top one is not 0 */
    uint32_t word[BIG_WORDS];
} big;

static void big_multiply_add(big *a, uint32_t factor, uint32_t summand)
{
    uint64_t carry = summand;
    for (int i = 0; i < a->n; ++i) {
        carry += (uint64_t)a->word[i] * factor;
        a->word[i] = (uint32_t)carry;
        carry >>= 32;
    }
    if (carry != 0) a->word[a->n++] = (uint32_t)carry;
}

static void big_times_power_of_5(big *a, int64_t k)
{
    for (; k >= 13; k -= 13)
        big_multiply_add(a, 1220703125u, 0);
    if (k > 0) big_multiply_add(a, (uint32_t)power_of_5[k], 0);
}

static int big_n_bits(const big *a) { return 32 * a->n - __builtin_clz(a->word[a->n - 1]); }

static void big_shift_left(big *a, int n_bits)
{
    const int words = n_bits / 32, bits = n_bits % 32;
    a->word[a->n] = 0;
    for (int i = a->n; i >= 0; --i) {
        const uint32_t low = i > 0 && bits > 0 ? a->word[i - 1] >> (32 - bits) : 0;
        a->word[i + words] = (a->word[i] << bits) | low;
    }
    memset(a->word, 0, (size_t)words * sizeof a->word[0]);
    a->n += words + 1;
    while (a->n > 0 && a->word[a->n - 1] == 0)
        --a->n;
}

static int big_compare(const big *a, const big *b)
{
    if (a->n != b->n) return a->n < b->n ? -1 : 1;
    for (int i = a->n - 1; i >= 0; --i) {
        if (a->word[i] != b->word[i]) return a->word[i] < b->word[i] ? -1 : 1;
    }
    return 0;
}

/* a -= b, for a >= b */
static void big_subtract(big *a, const big *b)
{
    int64_t borrow = 0;
    for (int i = 0; i < a->n; ++i) {
        borrow += (int64_t)a->word[i] - (i < b->n ? (int64_t)b->word[i] : 0);
        a->word[i] = (uint32_t)borrow;
        borrow >>= 32;
    }
    while (a->n > 0 && a->word[a->n - 1] == 0)
        --a->n;
}

/* Any decimal whose digits are not all 0. */
static double round_big(const decimal *number)
{
    big a = {.n = 0}, b = {.n = 1, .word = {1}};
    int64_t e = number->exponent_10, n_digits = 0;
    uint64_t q = 0;
    bool more = false;
    int exponent;

    for (const char *p = number->digits; p < number->end; ++p) {
        if (*p == '.' || (*p == '0' && n_digits == 0)) continue;
        if (n_digits < MAX_DIGITS)
            big_multiply_add(&a, 10, (uint32_t)(*p - '0'));
        else
            more = more || *p != '0';
        ++n_digits;
    }
    /* 10^(n_digits + e - 1) <= value < 10^(n_digits + e) */
    if (n_digits + e > 310) return HUGE_VAL;
    if (n_digits + e < -325) return 0.0;
    if (n_digits > MAX_DIGITS) {
        e += n_digits - MAX_DIGITS;
        if (more) { /* one digit stands for all the others: it only has to be seen */
            big_multiply_add(&a, 10, 1);
            --e;
        }
    }
    exponent = (int)e;
    if (e >= 0)
        big_times_power_of_5(&a, e);
    else
        big_times_power_of_5(&b, -e);
    /* b <= a < 2 b by shifts, then 64 bits of the quotient, one by one. */
    const int shift = big_n_bits(&a) - big_n_bits(&b);
    if (shift > 0) big_shift_left(&b, shift);
    if (shift < 0) big_shift_left(&a, -shift);
    exponent += shift;
    if (big_compare(&a, &b) < 0) {
        big_shift_left(&a, 1);
        --exponent;
    }
    for (int i = 0; i < 64; ++i) {
        q <<= 1;
        if (big_compare(&a, &b) >= 0) {
            big_subtract(&a, &b);
            q |= 1u;
        }
        if (a.n > 0) big_shift_left(&a, 1);
    }
    return round_to_double(q, a.n > 0, exponent - 63);
}

/* ---- tokens -------------------------------------------------------------------------------------------------- */

/* More digits than fit 64 bits, leading zeros counted: the first 19 that matter usually decide. */
static double round_long(const decimal *number)
{
    uint64_t m = 0;
    int n = 0;
    int64_t n_more = 0;
    bool more = false;
    for (const char *p = number->digits; p < number->end; ++p) {
        if (*p == '.' || (*p == '0' && n == 0)) continue;
        if (n < MAX_U64_DIGITS) {
            m = 10 * m + (uint64_t)(*p - '0');
            ++n;
        } else {
            more = more || *p != '0';
            ++n_more;
        }
    }
    const int64_t e = number->exponent_10 + n_more;
    if (m == 0) return 0.0;
    if (e >= -MAX_EXACT_POWER && e <= MAX_EXACT_POWER) {
        const double value = round_small_power(m, (int)e);
        if (!more || round_small_power(m + 1, (int)e) == value) return value;
    }
    return round_big(number);
}

static double decimal_to_double(uint64_t m, int64_t n_digits, const decimal *number)
{
    const int64_t e = number->exponent_10;
    if (n_digits > MAX_U64_DIGITS) return round_long(number);
    if (m == 0) return 0.0;
    /* Clinger 1990: both exact, one rounding. */
    if (m <= UINT64_C(1) << 53 && e >= -22 && e <= 22)
        return e < 0 ? (double)m / power_of_10[-e] : (double)m * power_of_10[e];
    if (e >= -MAX_EXACT_POWER && e <= MAX_EXACT_POWER) return round_small_power(m, (int)e);
    return round_big(number);
}

bool loxo_starts_with(const char *p, const char *end, const char *word)
{
    for (; *word != 0; ++p, ++word) {
        if (p >= end) return false;
        if ((*p >= 'A' && *p <= 'Z' ? (char)(*p - 'A' + 'a') : *p) != *word) return false;
    }
    return true;
}

/* nan, nan(...), inf, infinity behind the sign, or 1.#IND and its kin. */
static bool scan_nonfinite(const char *p, const char *token_end, double *value)
{
    const size_t n = (size_t)(token_end - p);
    if (loxo_starts_with(p, token_end, "nan") && (n == 3 || (p[3] == '(' && token_end[-1] == ')'))) {
        *value = (double)NAN;
        return true;
    }
    if ((n == 3 && loxo_starts_with(p, token_end, "inf")) || (n == 8 && loxo_starts_with(p, token_end, "infinity"))) {
        *value = HUGE_VAL;
        return true;
    }
    if (loxo_starts_with(p, token_end, "1.#")) {
        *value = loxo_starts_with(p, token_end, "1.#inf") ? HUGE_VAL : (double)NAN;
        return true;
    }
    return false;
}

loxo_scan loxo_scan_double(const char **at, const char *end, double *value)
{
    const char *p = *at;
    const bool is_negative = p < end && *p == '-';
    uint64_t m = 0;
    int64_t n_digits, n_fraction = 0, e = 0;
    decimal number;
    double result;

    if (p < end && (*p == '-' || *p == '+')) ++p;
    number.digits = p;
    while (p < end && loxo_is_digit(*p))
        m = 10 * m + (uint64_t)(*p++ - '0');
    n_digits = p - number.digits;
    if (p < end && *p == '.') {
        const char *fraction = ++p;
        while (p < end && loxo_is_digit(*p))
            m = 10 * m + (uint64_t)(*p++ - '0');
        n_fraction = p - fraction;
        n_digits += n_fraction;
    }
    number.end = p;
    if (n_digits == 0) goto not_decimal;
    if (p < end && (*p == 'e' || *p == 'E')) {
        const bool is_small = p + 1 < end && p[1] == '-';
        const char *digits = p + 1 + (p + 1 < end && (p[1] == '-' || p[1] == '+'));
        for (p = digits; p < end && loxo_is_digit(*p); ++p) {
            /* Far beyond any double, whatever number of digits a text can hold. */
            if (e < INT64_C(1) << 56) e = 10 * e + (*p - '0');
        }
        if (p == digits) goto not_decimal;
        if (is_small) e = -e;
    }
    if (p < end && !loxo_is_space(*p)) goto not_decimal;
    *at = p;
    number.exponent_10 = e - n_fraction;
    result = decimal_to_double(m, n_digits, &number);
    *value = is_negative ? -result : result;
    return isfinite(result) ? LOXO_SCAN_OK : LOXO_SCAN_NONFINITE;

not_decimal:
    *at = loxo_token_end(p, end);
    if (!scan_nonfinite(number.digits, *at, &result)) return LOXO_SCAN_BAD;
    *value = is_negative ? -result : result;
    return LOXO_SCAN_NONFINITE;
}

loxo_scan loxo_scan_int64_prefix(const char **at, const char *end, int64_t *value)
{
    const char *p = *at;
    const bool is_negative = p < end && *p == '-';
    const uint64_t limit = is_negative ? (uint64_t)INT64_MAX + 1 : (uint64_t)INT64_MAX;
    uint64_t m = 0;
    bool overflow = false;
    if (p < end && (*p == '-' || *p == '+')) ++p;
    const char *digits = p;
    for (; p < end && loxo_is_digit(*p); ++p) {
        const uint64_t digit = (uint64_t)(*p - '0');
        overflow = overflow || m > (limit - digit) / 10;
        m = 10 * m + digit;
    }
    *at = p;
    if (p == digits) return LOXO_SCAN_BAD;
    if (overflow) return LOXO_SCAN_OVERFLOW;
    *value = is_negative ? (int64_t)(0 - m) : (int64_t)m;
    return LOXO_SCAN_OK;
}

loxo_scan loxo_scan_int64(const char **at, const char *end, int64_t *value)
{
    int64_t result = 0;
    loxo_scan scan = loxo_scan_int64_prefix(at, end, &result);
    if (*at < end && !loxo_is_space(**at)) {
        *at = loxo_token_end(*at, end);
        scan = LOXO_SCAN_BAD;
    }
    if (scan == LOXO_SCAN_OK) *value = result;
    return scan;
}
