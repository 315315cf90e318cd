/* SPDX-License-Identifier: MIT
 * What a run tells: aligned rows for people, kept until the end is known, and one JSON object for machines. */
#ifndef LOXO_TOOLS_REPORT_H
#define LOXO_TOOLS_REPORT_H

#include "base/options.h"

#include <loxo/loxo.h>

#include <jansson.h>
#include <stdio.h>

typedef struct cli_report {
    json_t *json;
    json_t *warnings, *files; /* arrays that join it at the end */
    FILE *rows;               /* into memory */
    char *text;               /* what rows holds once it is flushed */
    size_t n_text;
} cli_report;

bool report_create(cli_report *report);
void report_destroy(cli_report *report);

/* One row: a label and a text. */
void report_row(cli_report *report, const char *label, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* Into an object; none of these fails on NaN (null), infinity (null) or bytes that are no UTF-8 (escaped). */
json_t *json_of_number(double number);
json_t *json_of_text(const char *text);
void json_put_number(json_t *object, const char *key, double number);
void json_put_integer(json_t *object, const char *key, int64_t number);
void json_put_text(json_t *object, const char *key, const char *text);
void json_put_bool(json_t *object, const char *key, bool value);
/* A new object or array inside another. */
json_t *json_put_object(json_t *object, const char *key);
json_t *json_put_array(json_t *object, const char *key);
void json_append(json_t *array, json_t *value);
/* The report with its warnings and files as text that ends with a newline, to be freed; NULL when memory ran out for
 * any part of it: better none than one with holes. */
char *report_json(cli_report *report, size_t *n_text);
/* Every setting of a table under its own name. */
void json_put_settings(json_t *object, const char *key, const loxo_option *options, const void *settings);

/* Numbers for people, into static storage that the next eight calls leave alone. */
const char *text_count(int64_t n);       /* 1,234,567 */
const char *text_bytes(double n_bytes);  /* 12.3 MB */
const char *text_seconds(double s);      /* 0.123 s */
const char *text_path(const char *path); /* control bytes escaped, long ones cut in front */

#endif
