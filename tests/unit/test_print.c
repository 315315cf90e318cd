/* SPDX-License-Identifier: MIT
 * Numbers as text: back to the same bits, as short as can be, under any locale. */
#include "base/rng.h"
#include "io/print.h"
#include "test.h"

#include <float.h>
#include <locale.h>

static const char *print_double(double value)
{
    static char text[LOXO_PRINT_MAX + 1];
    text[loxo_print_double(text, value)] = '\0';
    return text;
}

static const char *print_float(float value)
{
    static char text[LOXO_PRINT_MAX + 1];
    text[loxo_print_float(text, value)] = '\0';
    return text;
}

static const char *print_int(int64_t value)
{
    static char text[LOXO_PRINT_MAX + 1];
    text[loxo_print_int(text, value)] = '\0';
    return text;
}

/* Significant digits of a number's text. */
static int n_digits(const char *text)
{
    int n = 0, n_zeros = 0;
    for (; *text != '\0' && *text != 'e'; ++text) {
        if (*text < '0' || *text > '9') continue;
        if (*text == '0') {
            if (n > 0) ++n_zeros;
        } else {
            n += n_zeros + 1;
            n_zeros = 0;
        }
    }
    return n;
}

static void check_shortest(double value)
{
    char reference[64];
    int n = 1;
    const char *text = print_double(value);
    CHECK(strtod(text, NULL) == value && signbit(strtod(text, NULL)) == signbit(value));
    for (; n < 17; ++n) {
        snprintf(reference, sizeof reference, "%.*e", n - 1, value);
        if (strtod(reference, NULL) == value) break;
    }
    if (n_digits(text) > n) {
        print_error("%s is longer than %s\n", text, reference);
        CHECK(false);
    }
}

TEST(numbers_read_well)
{
    CHECK_TEXT(print_double(0.0), "0");
    CHECK_TEXT(print_double(-0.0), "-0");
    CHECK_TEXT(print_double(1.0), "1");
    CHECK_TEXT(print_double(-1.5), "-1.5");
    CHECK_TEXT(print_double(0.1), "0.1");
    CHECK_TEXT(print_double(100.0), "100");
    CHECK_TEXT(print_double(123456.789), "123456.789");
    CHECK_TEXT(print_double(1e-5), "0.00001");
    CHECK_TEXT(print_double(1.25e-7), "1.25e-7");
    CHECK_TEXT(print_double(1e-7), "1e-7");
    CHECK_TEXT(print_double(0x1p100), "1.2676506002282294e+30");
    CHECK_TEXT(print_double(9007199254740993.0), "9007199254740992");
    CHECK_TEXT(print_double(9.9999999999999995e16), "100000000000000000");
    CHECK_TEXT(print_double(0.3), "0.3");
    CHECK_TEXT(print_double(0.1 + 0.2), "0.30000000000000004");
    CHECK_TEXT(print_double((double)INFINITY), "inf");
    CHECK_TEXT(print_double((double)-INFINITY), "-inf");
    CHECK_TEXT(print_double((double)NAN), "nan");
    CHECK_TEXT(print_float(0.1f), "0.1");
    CHECK_TEXT(print_float(16777216.0f), "16777216");
    CHECK_TEXT(print_float(1e10f), "10000000000");
    CHECK_TEXT(print_float(3.4f), "3.4");
    CHECK_TEXT(print_float(-INFINITY), "-inf");
    CHECK_TEXT(print_int(0), "0");
    CHECK_TEXT(print_int(-17), "-17");
    CHECK_TEXT(print_int(INT64_MAX), "9223372036854775807");
    CHECK_TEXT(print_int(INT64_MIN), "-9223372036854775808");
}

TEST(doubles_come_back_and_are_shortest)
{
    for (uint64_t i = 0; i < 100000; ++i) {
        const double value = ldexp(loxo_random_unit(1, 2 * i) - 0.5, (int)(loxo_random_u64(1, 2 * i + 1) % 70) - 20);
        if (fabs(value) >= 1e-6) check_shortest(value);
    }
    for (int i = -5; i < 16; ++i) { /* powers of ten and their neighbours; below a power of two the gap is half */
        const double power = pow(10.0, i);
        check_shortest(power);
        check_shortest(nextafter(power, 1e300));
        check_shortest(nextafter(power, -1.0));
    }
    for (int i = -19; i < 53; ++i) {
        check_shortest(ldexp(1.0, i));
        check_shortest(nextafter(ldexp(1.0, i), 1e300));
        check_shortest(nextafter(ldexp(1.0, i), -1.0));
    }
    for (int64_t i = 0; i < 100000; i += 7)
        check_shortest((double)i / 1000.0);
}

TEST(all_bit_patterns_come_back)
{
    for (uint64_t i = 0; i < 200000; ++i) {
        const uint64_t bits = loxo_random_u64(2, i);
        const uint32_t float_bits = (uint32_t)loxo_random_u64(3, i);
        double value;
        float single;
        memcpy(&value, &bits, sizeof value);
        memcpy(&single, &float_bits, sizeof single);
        if (isfinite(value)) CHECK(strtod(print_double(value), NULL) == value);
        if (isfinite(single)) CHECK(strtof(print_float(single), NULL) == single);
    }
    CHECK(strtod(print_double(DBL_TRUE_MIN), NULL) == DBL_TRUE_MIN);
    CHECK(strtod(print_double(DBL_MAX), NULL) == DBL_MAX);
    CHECK(strtof(print_float(FLT_TRUE_MIN), NULL) == FLT_TRUE_MIN);
}

TEST(locales_change_nothing)
{
    const char *names[] = {"de_DE.UTF-8", "de_DE", "fr_FR.UTF-8", "tr_TR.UTF-8"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        if (setlocale(LC_ALL, names[i]) == NULL) continue;
        const bool is_plain = strcmp(print_double(1.5), "1.5") == 0;
        const bool is_rare_plain = strcmp(print_double(0x1p100), "1.2676506002282294e+30") == 0;
        setlocale(LC_ALL, "C");
        CHECK(is_plain && is_rare_plain);
    }
}
