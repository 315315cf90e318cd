/* SPDX-License-Identifier: MIT */
#include "base/rng.h"
#include "io/scan.h"
#include "test.h"

#include <locale.h>

static loxo_scan scan(const char *text, double *value)
{
    const char *p = text;
    const loxo_scan result = loxo_scan_double(&p, text + strlen(text), value);
    CHECK(p == loxo_token_end(text, text + strlen(text)));
    return result;
}

/* The C library is the other way to the same bits; tests run in its C locale. */
static void check_as_strtod(const char *text)
{
    double mine = -7.0;
    const double theirs = strtod(text, NULL);
    const loxo_scan result = scan(text, &mine);
    const bool is_same = mine == theirs && signbit(mine) == signbit(theirs);
    if (!is_same) print_error("%s: %a, not %a\n", text, mine, theirs);
    CHECK(is_same);
    CHECK_EQUAL(result, isfinite(theirs) ? LOXO_SCAN_OK : LOXO_SCAN_NONFINITE);
}

TEST(doubles_are_rounded_as_the_c_library_rounds)
{
    static const char *const texts[] = {"0",
                                        "-0",
                                        "+1",
                                        ".5",
                                        "1.",
                                        "-.5e-3",
                                        "1E5",
                                        "1e+5",
                                        "1e22",
                                        "1e23",
                                        "9007199254740993",
                                        "9007199254740993.0000000000000000000000000000001",
                                        "123456789012345678901234567890",
                                        "1e-320",
                                        "4.9406564584124654e-324",
                                        "2.4703282292062327e-324",
                                        "2.4703282292062328e-324",
                                        "2.2250738585072011e-308",
                                        "2.2250738585072014e-308",
                                        "1.7976931348623157e308",
                                        "1.7976931348623159e308",
                                        "1e309",
                                        "1e400",
                                        "-1e400",
                                        "1e-400",
                                        "0e99999999999999999999",
                                        "8.5e-27",
                                        "8.5e-28",
                                        "18446744073709551615e27",
                                        "18446744073709551616e-27",
                                        "6.123233995736766e-17",
                                        "0.000000000000000000000000000000000000000000000000001e51",
                                        "1e99999999999999999999",
                                        "1e-99999999999999999999"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; ++i)
        check_as_strtod(texts[i]);
}

TEST(random_doubles_of_all_lengths_and_sizes)
{
    char text[1400];
    for (uint64_t i = 0; i < 60000; ++i) {
        const uint64_t bits = loxo_random_u64(1, i);
        const double unit = loxo_random_unit(2, i);
        double any;
        memcpy(&any, &bits, sizeof any);
        if (!isfinite(any)) continue;
        snprintf(text, sizeof text, "%.*g", 1 + (int)(i % 25), any);
        check_as_strtod(text);
        snprintf(text, sizeof text, "%.*f", (int)(i % 30), 1000.0 * unit);
        check_as_strtod(text);
        snprintf(text, sizeof text, "%.*e", (int)(i % 22), ldexp(unit, (int)(i % 200) - 100));
        check_as_strtod(text);
    }
}

TEST(ties_between_doubles_go_to_even_at_any_length)
{
    char text[1400];
    for (uint64_t i = 0; i < 3000; ++i) {
        const uint64_t bits = loxo_random_u64(3, i) & (i % 2 == 0 ? UINT64_MAX : 0x801fffffffffffffu);
        double any;
        memcpy(&any, &bits, sizeof any);
        if (!isfinite(any)) continue;
        const long double tie = ((long double)any + (long double)nextafter(any, INFINITY)) / 2.0L;
        snprintf(text, sizeof text, "%.1150Lg", tie);
        check_as_strtod(text);
        snprintf(text, sizeof text, "%.1150Le", tie);
        check_as_strtod(text);
    }
}

TEST(twenty_thousand_digits)
{
    char *text = malloc(20100);
    if (text == NULL) abort();
    memset(text, '0', 20000);
    memcpy(text, "1.5", 3);
    text[20000] = 0;
    check_as_strtod(text);
    text[19999] = '1'; /* a digit out there still decides a tie */
    memcpy(text, "9007199254740993.", 17);
    check_as_strtod(text);
    memset(text, '0', 20000); /* 0.000...1e20001 */
    text[1] = '.';
    memcpy(text + 20000, "1e19999", sizeof "1e19999");
    check_as_strtod(text);
    memset(text, '7', 20000);
    memcpy(text + 20000, "e-20000", sizeof "e-20000");
    check_as_strtod(text);
    free(text);
}

TEST(what_is_no_number_is_refused_as_a_whole)
{
    static const char *const texts[] = {"",       "-",     "+",    ".",    "-.",      "e5",   "1e",       "1e+",
                                        "1.5abc", "0x1p0", "0x10", "1,5",  "1.0D+00", "1..2", "1.2.3",    "--1",
                                        "+-1",    "1_000", "nano", "infi", "1e5.0",   "nan(", "infinity1"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; ++i) {
        double value = -7.0;
        CHECK_EQUAL(scan(texts[i], &value), LOXO_SCAN_BAD);
        CHECK_EQUAL(value, -7.0);
    }
}

TEST(numbers_that_are_not_finite_are_known_by_all_their_names)
{
    static const char *const nans[] = {"nan", "NaN", "-NAN", "nan(7)", "-nan(ind)", "-1.#IND", "1.#QNAN"};
    static const char *const infs[] = {"inf", "+Inf", "INFINITY", "1.#INF", "1e400"};
    double value = 0.0;
    for (size_t i = 0; i < sizeof nans / sizeof nans[0]; ++i) {
        CHECK_EQUAL(scan(nans[i], &value), LOXO_SCAN_NONFINITE);
        CHECK(isnan(value));
    }
    for (size_t i = 0; i < sizeof infs / sizeof infs[0]; ++i) {
        CHECK_EQUAL(scan(infs[i], &value), LOXO_SCAN_NONFINITE);
        CHECK(isinf(value) && value > 0.0);
    }
    CHECK_EQUAL(scan("-inf", &value), LOXO_SCAN_NONFINITE);
    CHECK(isinf(value) && value < 0.0);
}

TEST(integers_keep_to_64_bits)
{
    static const struct {
        const char *text;
        loxo_scan scan;
        int64_t value;
    } cases[] = {{"0", LOXO_SCAN_OK, 0},
                 {"-0", LOXO_SCAN_OK, 0},
                 {"+17", LOXO_SCAN_OK, 17},
                 {"0000000000000000000000000012", LOXO_SCAN_OK, 12},
                 {"9223372036854775807", LOXO_SCAN_OK, INT64_MAX},
                 {"9223372036854775808", LOXO_SCAN_OVERFLOW, -7},
                 {"-9223372036854775808", LOXO_SCAN_OK, INT64_MIN},
                 {"-9223372036854775809", LOXO_SCAN_OVERFLOW, -7},
                 {"18446744073709551617", LOXO_SCAN_OVERFLOW, -7},
                 {"99999999999999999999999", LOXO_SCAN_OVERFLOW, -7},
                 {"", LOXO_SCAN_BAD, -7},
                 {"-", LOXO_SCAN_BAD, -7},
                 {"1.0", LOXO_SCAN_BAD, -7},
                 {"1e3", LOXO_SCAN_BAD, -7},
                 {"0x10", LOXO_SCAN_BAD, -7},
                 {"12a", LOXO_SCAN_BAD, -7},
                 {"99999999999999999999999a", LOXO_SCAN_BAD, -7}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        const char *p = cases[i].text, *end = p + strlen(p);
        int64_t value = -7;
        CHECK_EQUAL(loxo_scan_int64(&p, end, &value), cases[i].scan);
        CHECK(p == end);
        CHECK_EQUAL(value, cases[i].value);
    }
    const char *p = "12/3", *end = p + 4;
    int64_t value = 0;
    CHECK_EQUAL(loxo_scan_int64_prefix(&p, end, &value), LOXO_SCAN_OK);
    CHECK_EQUAL(value, 12);
    CHECK(*p == '/');
}

TEST(nothing_is_read_behind_the_end)
{
    const char text[] = {'1', '2', '5', '.', '5', 'e', '1', '9'};
    for (size_t n = 1; n <= sizeof text; ++n) {
        char *exact = malloc(n); /* the sanitizer guards its end */
        double value = 0.0;
        if (exact == NULL) abort();
        memcpy(exact, text, n);
        const char *p = exact;
        CHECK_EQUAL(loxo_scan_double(&p, exact + n, &value), n == 6 ? LOXO_SCAN_BAD : LOXO_SCAN_OK);
        CHECK(p == exact + n);
        free(exact);
    }
}

TEST(the_locale_changes_nothing)
{
    static const char *const names[] = {"de_DE.UTF-8", "de_DE", "fr_FR.UTF-8"};
    double value = 0.0;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        if (setlocale(LC_ALL, names[i]) == NULL) continue;
        CHECK_EQUAL(scan("1.5", &value), LOXO_SCAN_OK);
        CHECK_EQUAL(value, 1.5);
        CHECK_EQUAL(scan("1,5", &value), LOXO_SCAN_BAD);
    }
    setlocale(LC_ALL, "C");
}
