/* SPDX-License-Identifier: MIT */
#define _POSIX_C_SOURCE 200809L /* open_memstream */

#include "report.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

bool report_create(cli_report *report)
{
    *report = (cli_report){.json = json_object(), .warnings = json_array(), .files = json_array()};
    report->rows = open_memstream(&report->text, &report->n_text);
    return report->json != NULL && report->warnings != NULL && report->files != NULL && report->rows != NULL;
}

void report_destroy(cli_report *report)
{
    json_decref(report->json);
    json_decref(report->warnings);
    json_decref(report->files);
    if (report->rows != NULL) (void)fclose(report->rows);
    free(report->text);
    *report = (cli_report){0};
}

void report_row(cli_report *report, const char *label, const char *format, ...)
{
    va_list args;
    (void)fprintf(report->rows, "%-15s ", label);
    va_start(args, format);
    (void)vfprintf(report->rows, format, args);
    va_end(args);
    (void)fputc('\n', report->rows);
}

/* Set once memory ran out for a value. */
static bool incomplete;

/* jansson takes NULL for a value or an object, and says so. */
static void put(json_t *object, const char *key, json_t *value)
{
    if (json_object_set_new(object, key, value) != 0) incomplete = true;
}

void json_append(json_t *array, json_t *value)
{
    if (json_array_append_new(array, value) != 0) incomplete = true;
}

json_t *json_of_number(double number) { return isfinite(number) ? json_real(number) : json_null(); }

json_t *json_of_text(const char *text)
{
    json_t *plain = json_string(text);
    char *escaped = NULL;
    size_t n = 0;
    if (plain != NULL) return plain;
    /* not UTF-8: a file name may be anything */
    FILE *out = open_memstream(&escaped, &n);
    if (out == NULL) return json_null();
    for (; *text != '\0'; ++text) {
        const unsigned char c = (unsigned char)*text;
        if (c < 0x80)
            (void)fputc(c, out);
        else
            (void)fprintf(out, "\\x%02x", c);
    }
    plain = fclose(out) == 0 ? json_string(escaped) : json_null();
    free(escaped);
    return plain;
}

void json_put_number(json_t *object, const char *key, double number) { put(object, key, json_of_number(number)); }

void json_put_integer(json_t *object, const char *key, int64_t number) { put(object, key, json_integer(number)); }

void json_put_text(json_t *object, const char *key, const char *text) { put(object, key, json_of_text(text)); }

void json_put_bool(json_t *object, const char *key, bool value) { put(object, key, json_boolean(value)); }

json_t *json_put_object(json_t *object, const char *key)
{
    json_t *inner = json_object();
    put(object, key, inner);
    return inner;
}

json_t *json_put_array(json_t *object, const char *key)
{
    json_t *inner = json_array();
    put(object, key, inner);
    return inner;
}

static json_t *json_of_option(const loxo_option *option, const void *settings)
{
    const void *at = (const unsigned char *)settings + option->offset;
    int choice;
    int64_t i64;
    uint64_t u64;
    size_t size;
    double number;
    bool on;
    switch (option->type) {
    case LOXO_OPTION_BOOL: memcpy(&on, at, sizeof on); return json_boolean(on);
    case LOXO_OPTION_INT: memcpy(&choice, at, sizeof choice); return json_integer(choice);
    case LOXO_OPTION_INT64: memcpy(&i64, at, sizeof i64); return json_integer(i64);
    case LOXO_OPTION_UINT64: memcpy(&u64, at, sizeof u64); return json_integer((json_int_t)u64);
    case LOXO_OPTION_SIZE: memcpy(&size, at, sizeof size); return json_integer((json_int_t)size);
    case LOXO_OPTION_DOUBLE: memcpy(&number, at, sizeof number); return json_of_number(number);
    case LOXO_OPTION_CHOICE: memcpy(&choice, at, sizeof choice); return json_of_text(option->choices[choice]);
    }
    return json_null();
}

void json_put_settings(json_t *object, const char *key, const loxo_option *options, const void *settings)
{
    json_t *inner = json_put_object(object, key);
    for (; options->name != NULL; ++options)
        put(inner, options->name, json_of_option(options, settings));
}

typedef struct buffer {
    char *text;
    size_t n, capacity;
} buffer;

/* For json_dump_callback, which does not pass every failure on. */
static int append_text(const char *text, size_t n, void *user)
{
    buffer *b = user;
    if (n > b->capacity - b->n) {
        const size_t capacity = 2 * (b->n + n) + 4096;
        char *bigger = realloc(b->text, capacity);
        if (bigger == NULL) {
            incomplete = true;
            return -1;
        }
        b->text = bigger;
        b->capacity = capacity;
    }
    memcpy(b->text + b->n, text, n);
    b->n += n;
    return 0;
}

char *report_json(cli_report *report, size_t *n_text)
{
    buffer b = {0};
    put(report->json, "warnings", json_incref(report->warnings));
    put(report->json, "files", json_incref(report->files));
    if (json_dump_callback(report->json, append_text, &b, JSON_INDENT(2) | JSON_REAL_PRECISION(17)) != 0)
        incomplete = true;
    (void)append_text("\n", 1, &b);
    *n_text = b.n;
    if (!incomplete) return b.text;
    free(b.text);
    return NULL;
}

static char *next_text(void)
{
    enum { N_TEXTS = 8, LENGTH = 48 };
    static char texts[N_TEXTS][LENGTH];
    static int at;
    at = (at + 1) % N_TEXTS;
    return texts[at];
}

const char *text_count(int64_t n)
{
    char digits[24];
    char *text = next_text();
    const int length = snprintf(digits, sizeof digits, "%" PRId64, n);
    int k = 0;
    for (int i = 0; i < length; ++i) {
        text[k++] = digits[i];
        if (digits[i] != '-' && i + 1 < length && (length - 1 - i) % 3 == 0) text[k++] = ',';
    }
    text[k] = '\0';
    return text;
}

const char *text_bytes(double n_bytes)
{
    static const char *const units[] = {"bytes", "kB", "MB", "GB", "TB", "PB"};
    char *text = next_text();
    int i = 0;
    while (i < 5 && n_bytes >= 999.5)
        n_bytes /= 1000.0, ++i;
    (void)snprintf(text, 48, i > 0 && n_bytes < 99.95 ? "%.1f %s" : "%.0f %s", n_bytes, units[i]);
    return text;
}

const char *text_seconds(double s)
{
    char *text = next_text();
    (void)snprintf(text, 48, "%.*f s", s < 10.0 ? 3 : 1, s);
    return text;
}

const char *text_path(const char *path)
{
    enum { LENGTH = 4096 };
    static char texts[2][LENGTH];
    static int which;
    char *text = texts[which = 1 - which];
    const size_t length = strlen(path), most = (LENGTH - 8) / 4;
    size_t k = 0;
    if (length > most) {
        path += length - most;
        k = (size_t)snprintf(text, LENGTH, "...");
    }
    for (; *path != '\0'; ++path) {
        const unsigned char c = (unsigned char)*path;
        if (c < 0x20 || c == 0x7f)
            k += (size_t)snprintf(text + k, LENGTH - k, "\\x%02x", c);
        else
            text[k++] = *path;
    }
    text[k] = '\0';
    return text;
}
