/* SPDX-License-Identifier: MIT */
#include "base/allocate.h"
#include "base/context.h"
#include "io/field.h"
#include "io/text.h"

#include <inttypes.h>

#define STOP_LINES 65536 /* between two looks at the monitor */

/* One line cut into columns. */
typedef struct line {
    int64_t number;
    int64_t n_columns;
    bool has_commas;
    const char *first, *first_end; /* of the first column, without blanks */
    const char *last, *last_end;
} line;

static bool is_comma(char c) { return c == ',' || c == ';'; }

/* Cuts a line without blanks at its ends: at commas where it has any, else at blanks. */
static void cut(const char *p, const char *line_end, line *row)
{
    bool has_commas = false;
    for (const char *c = p; c < line_end && !has_commas; ++c)
        has_commas = is_comma(*c);
    row->n_columns = 0;
    while (p <= line_end) {
        const char *end = p;
        if (p < line_end && *p == '"') {
            const char *close = memchr(p + 1, '"', (size_t)(line_end - p - 1));
            if (close != NULL) end = close;
        }
        while (end < line_end && !(has_commas ? is_comma(*end) : loxo_is_space(*end)))
            ++end;
        const char *next = end + 1; /* behind line_end in the last column */
        while (end > p && loxo_is_space(end[-1]))
            --end;
        if (row->n_columns++ == 0) {
            row->first = p;
            row->first_end = end;
        }
        row->last = p;
        row->last_end = end;
        for (p = next; p < line_end && loxo_is_space(*p);)
            ++p;
    }
    row->has_commas = has_commas;
}

/* Moves *at behind the next line that carries something; false at the end of the text. */
static bool next_row(const loxo_text *text, const char **at, line *row)
{
    while (*at < text->end) {
        const char *next = loxo_text_next_line(text, *at);
        const char *p = *at, *line_end = next;
        *at = next;
        ++row->number;
        while (p < line_end && loxo_is_space(*p))
            ++p;
        while (line_end > p && loxo_is_space(line_end[-1]))
            --line_end;
        if (p == line_end || *p == '#') continue;
        cut(p, line_end, row);
        return true;
    }
    return false;
}

static bool parse_number(const char *at, const char *end, double *value)
{
    const loxo_scan scan = loxo_scan_double(&at, end, value);
    return (scan == LOXO_SCAN_OK || scan == LOXO_SCAN_NONFINITE) && at == end;
}

static bool is_word(const char *at, const char *end, const char *word)
{
    return (size_t)(end - at) == strlen(word) && memcmp(at, word, (size_t)(end - at)) == 0;
}

typedef struct reading {
    loxo_context *ctx;
    loxo_text text;
    bool has_first;
    int64_t n_columns; /* of all lines; 0 when a header does not tell */
    bool is_numbered;  /* the first column counts the lines */
    int64_t first_number;
    double *value;
    int64_t n, capacity;
} reading;

static loxo_status fail(const reading *r, const line *row, const char *what, const char *at, const char *end)
{
    const int n = end - at > 40 ? 40 : (int)(end - at);
    const loxo_place place = {.file = r->text.name, .line = row->number, .byte = -1, .element = r->n};
    if (at < end && memchr(at, 0, (size_t)(end - at)) != NULL)
        return loxo_fail_at(r->ctx, LOXO_ERR_MALFORMED, place, "a NUL byte in text (UTF-16, or a binary file?)");
    return loxo_fail_at(r->ctx, LOXO_ERR_MALFORMED, place, "value %" PRId64 ": \"%.*s\" %s", r->n, n, at, what);
}

static loxo_status append(reading *r, double value)
{
    if (r->n == r->capacity) {
        const int64_t capacity = r->capacity + r->capacity / 2 + 1024;
        double *grown = loxo_reallocate(r->ctx, r->value, capacity, sizeof *grown);
        if (grown == NULL) return LOXO_ERR_MEMORY;
        r->value = grown;
        r->capacity = capacity;
    }
    r->value[r->n++] = value;
    return LOXO_OK;
}

/* The first line: a header or the first value. */
static loxo_status take_first(reading *r, const line *row, bool *is_header)
{
    double value;
    *is_header = !parse_number(row->last, row->last_end, &value);
    r->has_first = true;
    r->n_columns = *is_header && !row->has_commas ? 0 : row->n_columns; /* words of a name are no columns */
    r->is_numbered = row->n_columns > 1;
    if (!*is_header) return LOXO_OK;
    /* 1,5x is a slip, not a name. */
    const char *begin = row->has_commas ? row->last : row->first;
    if (begin == row->last_end || loxo_is_digit(*begin) || memchr("+-.", *begin, 3) != NULL || *begin == '\0')
        return fail(r, row, "is neither a number nor a name", row->last, row->last_end);
    r->is_numbered = is_word(row->first, row->first_end, "vertex");
    return LOXO_OK;
}

static loxo_status take_row(reading *r, const line *row)
{
    double value, number;
    if (r->n_columns == 0) {
        r->n_columns = row->n_columns;
        r->is_numbered = r->is_numbered && row->n_columns > 1;
    }
    if (row->n_columns != r->n_columns)
        return loxo_fail_at(r->ctx, LOXO_ERR_MALFORMED,
                            (loxo_place){.file = r->text.name, .line = row->number, .byte = -1, .element = r->n},
                            "value %" PRId64 ": %" PRId64 " columns where the lines before have %" PRId64, r->n,
                            row->n_columns, r->n_columns);
    if (!parse_number(row->last, row->last_end, &value))
        return fail(r, row, "is not a number", row->last, row->last_end);
    if (r->is_numbered) {
        const bool is_number = parse_number(row->first, row->first_end, &number);
        if (is_number && r->n == 0 && number == 1.0) r->first_number = 1;
        if (!is_number || number != (double)(r->n + r->first_number))
            return fail(r, row,
                        "in the first column is not the number of the line (a decimal comma, or another order?)",
                        row->first, row->first_end);
    }
    return append(r, value);
}

loxo_status loxo_read_csv(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name, double **value,
                          int64_t *n)
{
    reading r = {.ctx = ctx, .text = loxo_text_of(bytes, n_bytes, name)};
    line row = {0};
    const char *at = r.text.begin;
    loxo_status status = LOXO_OK;
    const loxo_place place = {.file = name, .byte = -1, .element = -1};
    if (n_bytes >= 2 && ((bytes[0] == 0xff && bytes[1] == 0xfe) || (bytes[0] == 0xfe && bytes[1] == 0xff)))
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "text in UTF-16: save it as UTF-8");
    while (status >= 0 && next_row(&r.text, &at, &row)) {
        bool is_header = false;
        if (!r.has_first) status = take_first(&r, &row, &is_header);
        if (status >= 0 && !is_header) status = take_row(&r, &row);
        if (status >= 0 && row.number % STOP_LINES == 0 &&
            loxo_stop_wanted(ctx, "read", (double)(at - r.text.begin) / (double)n_bytes))
            status = loxo_fail_at(ctx, LOXO_ERR_STOPPED, place, "stopped while reading");
    }
    if (status >= 0 && r.n == 0)
        status = loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, n_bytes == 0 ? "empty file" : "no number in it");
    if (status < 0) {
        loxo_release(ctx, r.value);
        return status;
    }
    *value = r.value;
    *n = r.n;
    return LOXO_OK;
}
