/* SPDX-License-Identifier: MIT */
#include "base/options.h"

#include "base/context.h"
#include "base/os.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const void *field_of(const loxo_option *option, const void *settings)
{
    return (const unsigned char *)settings + option->offset;
}

/* Every type as a double, for the range check: exact up to 2^53, beyond every bound in use. */
static double value_of(const loxo_option *option, const void *settings)
{
    const void *p = field_of(option, settings);
    switch (option->type) {
    case LOXO_OPTION_BOOL: return *(const bool *)p ? 1.0 : 0.0;
    case LOXO_OPTION_INT:
    case LOXO_OPTION_CHOICE: return (double)*(const int *)p;
    case LOXO_OPTION_INT64: return (double)*(const int64_t *)p;
    case LOXO_OPTION_UINT64: return (double)*(const uint64_t *)p;
    case LOXO_OPTION_SIZE: return (double)*(const size_t *)p;
    case LOXO_OPTION_DOUBLE: return *(const double *)p;
    }
    return NAN;
}

bool loxo_option_differs(const loxo_option *option, const void *a, const void *b)
{
    return value_of(option, a) != value_of(option, b);
}

bool loxo_option_is_of_method(const loxo_option *options, const loxo_option *option, const void *settings)
{
    const loxo_option *method = loxo_options_find(options, "method");
    if (option->methods == 0 || method == NULL) return true;
    return (option->methods & 1U << (int)value_of(method, settings)) != 0;
}

/* One of "a|b|c". */
static bool is_among(const char *word, const char *words)
{
    const size_t n = strlen(word);
    for (;; ++words) {
        const size_t n_this = strcspn(words, "|");
        if (n_this == n && strncmp(word, words, n) == 0) return true;
        words += n_this;
        if (*words == '\0') return false;
    }
}

const char *loxo_option_unmet(const loxo_option *options, const loxo_option *option, const void *settings)
{
    for (int i = 0; i < 2 && option->needs[i] != NULL; ++i) {
        const char *need = option->needs[i];
        const size_t n_name = strcspn(need, "=");
        char value[64];
        const loxo_option *other = options;
        while (other->name != NULL && (strlen(other->name) != n_name || strncmp(other->name, need, n_name) != 0))
            ++other;
        if (other->name == NULL || !loxo_option_is_of_method(options, other, settings)) continue;
        (void)loxo_option_print(other, settings, value, sizeof value);
        if (!is_among(value, need + n_name + 1)) return need;
    }
    return NULL;
}

static int n_choices(const loxo_option *option)
{
    int n = 0;
    while (option->choices[n] != NULL)
        ++n;
    return n;
}

static loxo_status check_one(loxo_context *ctx, const char *who, const loxo_option *option, const void *settings)
{
    const double value = value_of(option, settings);
    if (option->type == LOXO_OPTION_BOOL) return LOXO_OK;
    if (option->type == LOXO_OPTION_CHOICE) {
        if (value >= 0.0 && value < (double)n_choices(option)) return LOXO_OK;
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: %s is %g, not one of its choices", who, option->name, value);
    }
    const bool is_low = option->exclusive_min ? !(value > option->min) : !(value >= option->min);
    if (is_low || !(value <= option->max))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: %s is %g; it must be %s %g and at most %g", who, option->name,
                         value, option->exclusive_min ? "above" : "at least", option->min, option->max);
    return LOXO_OK;
}

loxo_status loxo_options_check(loxo_context *ctx, const char *who, const loxo_option *options, const void *settings)
{
    for (const loxo_option *o = options; o->name != NULL; ++o) {
        const loxo_status status = check_one(ctx, who, o, settings);
        if (status < 0) return status;
    }
    return LOXO_OK;
}

const loxo_option *loxo_options_find(const loxo_option *options, const char *name)
{
    for (const loxo_option *o = options; o->name != NULL; ++o)
        if (strcmp(o->name, name) == 0) return o;
    return NULL;
}

static bool parse_bool(const char *text, bool *value)
{
    static const char *const yes[] = {"true", "yes", "on", "1"}, *const no[] = {"false", "no", "off", "0"};
    if (text == NULL || text[0] == '\0') return *value = true, true;
    for (int i = 0; i < 4; ++i) {
        if (strcmp(text, yes[i]) == 0) return *value = true, true;
        if (strcmp(text, no[i]) == 0) return *value = false, true;
    }
    return false;
}

/* A whole number that fills the text; a sign only where it may be negative. */
static bool parse_int64(const char *text, int64_t *value)
{
    char *end = NULL;
    if (!(*text >= '0' && *text <= '9') && *text != '-' && *text != '+') return false;
    errno = 0;
    const long long n = strtoll(text, &end, 10);
    *value = (int64_t)n;
    return errno == 0 && end != text && *end == '\0';
}

static bool parse_uint64(const char *text, uint64_t *value, char **end)
{
    if (!(*text >= '0' && *text <= '9')) return false;
    errno = 0;
    *value = (uint64_t)strtoull(text, end, 10);
    return errno == 0;
}

static bool parse_size(const char *text, size_t *value)
{
    static const char suffixes[] = "KMGT";
    char *end = NULL;
    uint64_t n;
    if (!parse_uint64(text, &n, &end)) return false;
    if (*end != '\0') {
        const char *found = strchr(suffixes, *end);
        if (found == NULL || end[1] != '\0') return false;
        const int shift = 10 * ((int)(found - suffixes) + 1);
        if (n > (UINT64_MAX >> shift)) return false;
        n <<= shift;
    }
    *value = (size_t)n;
    return n <= SIZE_MAX;
}

/* «inf» only where it is the bound. */
static bool parse_double(const char *text, double most, double *value)
{
    char *end = NULL;
    if (strcmp(text, "inf") == 0 && isinf(most)) return *value = most, true;
    if (strspn(text, "0123456789+-.eE") != strlen(text) || text[0] == '\0') return false; /* no nan, hex, blanks */
    *value = loxo_os_strtod(text, &end);
    return end != text && *end == '\0' && isfinite(*value);
}

static bool parse_choice(const loxo_option *option, const char *text, int *value)
{
    for (int i = 0; option->choices[i] != NULL; ++i)
        if (strcmp(option->choices[i], text) == 0) return *value = i, true;
    return false;
}

static loxo_status fail_choice(loxo_context *ctx, const char *who, const loxo_option *option, const char *text)
{
    char list[256] = "";
    size_t used = 0;
    for (int i = 0; option->choices[i] != NULL && used < sizeof list; ++i)
        used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", i > 0 ? ", " : "", option->choices[i]);
    return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: --%s takes one of %s, not '%s'", who, option->name, list, text);
}

loxo_status loxo_options_set(loxo_context *ctx, const char *who, const loxo_option *options, void *settings,
                             const char *name, const char *text)
{
    const loxo_option *o = loxo_options_find(options, name);
    if (o == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: there is no option --%s", who, name);
    if (text == NULL && o->type != LOXO_OPTION_BOOL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: --%s needs a value", who, name);
    void *p = (unsigned char *)settings + o->offset;
    bool good = false;
    int64_t wide = 0;
    char *end = NULL;
    switch (o->type) {
    case LOXO_OPTION_BOOL: good = parse_bool(text, p); break;
    case LOXO_OPTION_INT:
        good = parse_int64(text, &wide) && wide >= INT_MIN && wide <= INT_MAX;
        if (good) *(int *)p = (int)wide;
        break;
    case LOXO_OPTION_INT64: good = parse_int64(text, p); break;
    case LOXO_OPTION_UINT64: good = parse_uint64(text, p, &end) && *end == '\0'; break;
    case LOXO_OPTION_SIZE: good = parse_size(text, p); break;
    case LOXO_OPTION_DOUBLE: good = parse_double(text, o->max, p); break;
    case LOXO_OPTION_CHOICE:
        if (!parse_choice(o, text, p)) return fail_choice(ctx, who, o, text);
        good = true;
        break;
    }
    if (!good) {
        static const char *const kinds[] = {
            "true or false",     "a whole number", "a whole number", "a whole number, no sign",
            "a number of bytes", "a number",       "a choice"};
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "%s: --%s takes %s, not '%s'", who, name, kinds[o->type],
                         text != NULL ? text : "");
    }
    return check_one(ctx, who, o, settings);
}

int loxo_option_print(const loxo_option *option, const void *settings, char *text, size_t n)
{
    const void *p = field_of(option, settings);
    switch (option->type) {
    case LOXO_OPTION_BOOL: return snprintf(text, n, "%s", *(const bool *)p ? "true" : "false");
    case LOXO_OPTION_INT: return snprintf(text, n, "%d", *(const int *)p);
    case LOXO_OPTION_INT64: return snprintf(text, n, "%" PRId64, *(const int64_t *)p);
    case LOXO_OPTION_UINT64: return snprintf(text, n, "%" PRIu64, *(const uint64_t *)p);
    case LOXO_OPTION_SIZE: return snprintf(text, n, "%zu", *(const size_t *)p);
    case LOXO_OPTION_CHOICE: {
        const int i = *(const int *)p;
        return snprintf(text, n, "%s", i >= 0 && i < n_choices(option) ? option->choices[i] : "?");
    }
    case LOXO_OPTION_DOUBLE: {
        /* The shortest text that comes back to the same bits. The decimal point is a full stop in every locale. */
        const double value = *(const double *)p;
        int length = 0;
        for (int digits = 1; digits <= 17; ++digits) {
            length = snprintf(text, n, "%.*g", digits, value);
            if (length > 0 && (size_t)length < n) {
                char *comma = strchr(text, ',');
                if (comma != NULL) *comma = '.';
            }
            if (length < 0 || (size_t)length >= n || loxo_os_strtod(text, NULL) == value) break;
        }
        /* %g takes to exponents as soon as digits are fewer than the number has before the point: 3e+01. */
        if (fabs(value) < 1e15 && fabs(value) >= 1.0 && length > 0 && (size_t)length < n && strchr(text, 'e') != NULL)
            length = snprintf(text, n, "%.0f", value);
        return length;
    }
    }
    return 0;
}
