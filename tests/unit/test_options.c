/* SPDX-License-Identifier: MIT
 * Options tables: text to settings and back. */
#include "base/options.h"
#include "test.h"

#include <loxo/geodesic.h>

typedef struct settings {
    bool flag;
    int count;
    int64_t wide;
    uint64_t seed;
    size_t bytes;
    double factor;
    int choice;
} settings;

static const char *const names[] = {"edge", "face", NULL};
static const loxo_option options[] = {
    {.name = "flag", .type = LOXO_OPTION_BOOL, .offset = offsetof(settings, flag)},
    {.name = "count", .type = LOXO_OPTION_INT, .offset = offsetof(settings, count), .min = 1, .max = 10},
    {.name = "wide", .type = LOXO_OPTION_INT64, .offset = offsetof(settings, wide), .min = -5, .max = 1e15},
    {.name = "seed", .type = LOXO_OPTION_UINT64, .offset = offsetof(settings, seed), .min = 0, .max = 2e19},
    {.name = "bytes", .type = LOXO_OPTION_SIZE, .offset = offsetof(settings, bytes), .min = 0, .max = 2e19},
    {.name = "factor",
     .type = LOXO_OPTION_DOUBLE,
     .offset = offsetof(settings, factor),
     .min = 0,
     .max = 1e6,
     .exclusive_min = true},
    {.name = "choice", .type = LOXO_OPTION_CHOICE, .offset = offsetof(settings, choice), .choices = names},
    {.name = NULL},
};

static const settings good = {.count = 1, .factor = 1.0};

static void takes(const char *name, const char *text, const char *printed)
{
    settings s = good;
    char out[64];
    CHECK_OK(loxo_options_set(test_context, "test", options, &s, name, text));
    loxo_option_print(loxo_options_find(options, name), &s, out, sizeof out);
    CHECK_TEXT(out, printed);
    settings again = good;
    CHECK_OK(loxo_options_set(test_context, "test", options, &again, name, out));
    CHECK(memcmp(&again, &s, sizeof s) == 0);
    CHECK_OK(loxo_options_check(test_context, "test", options, &s));
}

static void refuses(const char *name, const char *text)
{
    settings s = good;
    loxo_context_clear(test_context);
    CHECK_STATUS(test_context, loxo_options_set(test_context, "test", options, &s, name, text), LOXO_ERR_ARGUMENT);
    CHECK(strstr(loxo_context_failure(test_context)->text, name) != NULL);
}

/* What an option needs counts as far as the method looks at it. */
TEST(options_that_need_others)
{
    static const char *const speeds[] = {"slow", "fast", "faster", NULL};
    static const loxo_option table[] = {
        {.name = "method", .type = LOXO_OPTION_CHOICE, .offset = offsetof(settings, choice), .choices = names},
        {.name = "speed",
         .type = LOXO_OPTION_CHOICE,
         .offset = offsetof(settings, count),
         .choices = speeds,
         .methods = 1U << 1},
        {.name = "gear",
         .type = LOXO_OPTION_INT64,
         .offset = offsetof(settings, wide),
         .needs = {"speed=fast|faster", "method=face"}},
        {.name = NULL},
    };
    settings s = {.choice = 1, .count = 1};
    CHECK(loxo_option_unmet(table, &table[2], &s) == NULL && loxo_option_unmet(table, &table[0], &s) == NULL);
    s.count = 2;
    CHECK(loxo_option_unmet(table, &table[2], &s) == NULL);
    s.count = 0;
    CHECK_TEXT(loxo_option_unmet(table, &table[2], &s), "speed=fast|faster");
    s.choice = 0; /* the first method has no speed */
    CHECK_TEXT(loxo_option_unmet(table, &table[2], &s), "method=face");
    CHECK(!loxo_option_is_of_method(table, &table[1], &s) && loxo_option_is_of_method(table, &table[2], &s));
}

/* Each need in the library's own table names an option, and values that it has. */
TEST(needs_can_be_met)
{
    for (const loxo_option *o = loxo_geodesic_options; o->name != NULL; ++o)
        for (int i = 0; i < 2 && o->needs[i] != NULL; ++i) {
            loxo_geodesic_settings s = loxo_geodesic_settings_default();
            char name[32], word[32];
            const char *at = o->needs[i];
            size_t n = strcspn(at, "=");
            CHECK(n < sizeof name && at[n] == '=');
            (void)snprintf(name, sizeof name, "%.*s", (int)n, at);
            do {
                at += n + 1;
                n = strcspn(at, "|");
                (void)snprintf(word, sizeof word, "%.*s", (int)n, at);
                CHECK_OK(loxo_options_set(test_context, "test", loxo_geodesic_options, &s, name, word));
            } while (at[n] == '|');
        }
}

TEST(options_take_what_fits)
{
    takes("flag", NULL, "true");
    takes("flag", "off", "false");
    takes("count", "10", "10");
    takes("wide", "-5", "-5");
    takes("wide", "123456789012345", "123456789012345");
    takes("seed", "18446744073709551615", "18446744073709551615");
    takes("bytes", "3G", "3221225472");
    takes("factor", "0.1", "0.1");
    takes("factor", "1e-300", "1e-300");
    takes("factor", "0.30000000000000004", "0.30000000000000004");
    takes("choice", "face", "face");
}

TEST(options_refuse_the_rest)
{
    refuses("count", "0");
    refuses("count", "11");
    refuses("count", "3x");
    refuses("count", "");
    refuses("count", " 3");
    refuses("count", NULL);
    refuses("count", "99999999999999999999");
    refuses("wide", "-6");
    refuses("seed", "-1");
    refuses("seed", "18446744073709551616");
    refuses("bytes", "3X");
    refuses("bytes", "3GB");
    refuses("bytes", "999999999999T");
    refuses("factor", "0");
    refuses("factor", "nan");
    refuses("factor", "inf");
    refuses("factor", "0x1p0");
    refuses("factor", "1,5");
    refuses("factor", "1e400");
    refuses("flag", "maybe");
    refuses("choice", "vertex");
    refuses("nonsense", "1");
}

TEST(options_check_what_a_program_filled_in)
{
    settings s = good;
    CHECK_OK(loxo_options_check(test_context, "test", options, &s));
    s.factor = NAN;
    CHECK_STATUS(test_context, loxo_options_check(test_context, "test", options, &s), LOXO_ERR_ARGUMENT);
    s = good;
    s.choice = 2;
    CHECK_STATUS(test_context, loxo_options_check(test_context, "test", options, &s), LOXO_ERR_ARGUMENT);
}
