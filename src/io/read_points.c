/* SPDX-License-Identifier: MIT
 * Points of space, and arrays of numbers, out of .npy and text. */
#include "base/allocate.h"
#include "base/context.h"
#include "io/field.h"
#include "io/source.h"
#include "io/text.h"

#include <loxo/io.h>

#include <inttypes.h>
#include <math.h>
#include <string.h>

#define STOP_ROWS 65536 /* between two looks at the monitor */

/* Within a line: blanks, and at most one comma or semicolon. */
static const char *skip_between(const loxo_text *text, const char *p)
{
    p = loxo_text_skip(text, p);
    if (p < text->end && (*p == ',' || *p == ';')) p = loxo_text_skip(text, p + 1);
    return p;
}

static const char *number_end(const loxo_text *text, const char *p)
{
    while (p < text->end && !loxo_is_space(*p) && *p != ',' && *p != ';' && *p != '#')
        ++p;
    return p;
}

static bool is_row_end(const loxo_text *text, const char *p) { return loxo_text_at_line_end(text, p) || *p == '#'; }

/* So many numbers and nothing else. */
static loxo_status read_row(loxo_context *ctx, const loxo_text *text, const char *p, const char *noun, int64_t row,
                            int64_t n_columns, double *point)
{
    loxo_text_fault fault = {.noun = noun, .element = row, .b = n_columns};
    for (int64_t k = 0; k < n_columns; ++k) {
        if (k > 0) p = skip_between(text, p);
        fault.at = p;
        if (is_row_end(text, p)) {
            fault.trouble = LOXO_TROUBLE_FEW;
            fault.a = k;
            return loxo_text_fail(ctx, text, &fault, NULL);
        }
        const char *end = number_end(text, p);
        if (loxo_scan_double(&p, end, &point[k]) != LOXO_SCAN_OK || p != end) {
            fault.trouble = LOXO_TROUBLE_NUMBER;
            return loxo_text_fail(ctx, text, &fault, NULL);
        }
    }
    fault.at = p = skip_between(text, p);
    if (is_row_end(text, p)) return LOXO_OK;
    fault.trouble = LOXO_TROUBLE_MANY;
    return loxo_text_fail(ctx, text, &fault, NULL);
}

/* A first line whose first word is no number, and does not begin as one: `1.5abc` is a fault, `x` is not. */
static bool is_header(const loxo_text *text, const char *p)
{
    const char *end = number_end(text, p), *digit = p;
    double value;
    while (digit < end && (*digit == '+' || *digit == '-' || *digit == '.'))
        ++digit;
    return (digit == end || !loxo_is_digit(*digit)) && loxo_scan_double(&p, end, &value) == LOXO_SCAN_BAD;
}

/* Numbers, or what stands for them, to the end of a line that has one. */
static int64_t count_columns(const loxo_text *text, const char *p)
{
    for (int64_t n = 1;; ++n) {
        const char *end = number_end(text, p);
        p = skip_between(text, end);
        if (is_row_end(text, p) || (p == end && end < text->end)) return n;
    }
}

/* Rows of *n_columns numbers; of as many as the first one has where that comes in as 0. */
static loxo_status read_csv_rows(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                 const char *noun, int64_t *n_columns, double **value, int64_t *n)
{
    const loxo_text text = loxo_text_of(bytes, n_bytes, name);
    double *point = NULL;
    int64_t capacity = 0, row = 0, line = 0;
    loxo_status status = LOXO_OK;
    for (const char *p = text.begin; p < text.end && status >= 0; p = loxo_text_next_line(&text, p)) {
        const char *start = loxo_text_skip(&text, p);
        if (is_row_end(&text, start)) continue;
        if (line++ == 0 && is_header(&text, start)) continue;
        if (*n_columns == 0) *n_columns = count_columns(&text, start);
        if (row == capacity) {
            capacity = 2 * capacity + 1 + 1024 / *n_columns; /* memory grows with what was read, long rows or short */
            double *larger = loxo_reallocate(ctx, point, capacity, (size_t)*n_columns * sizeof *larger);
            if (larger == NULL) {
                status = LOXO_ERR_MEMORY;
                break;
            }
            point = larger;
        }
        status = read_row(ctx, &text, start, noun, row, *n_columns, point + row * *n_columns);
        if (++row % STOP_ROWS == 0 && status >= 0 && loxo_stop_wanted(ctx, "read", -1.0))
            status = loxo_fail(ctx, LOXO_ERR_STOPPED, "stopped while parsing");
    }
    if (status < 0) {
        loxo_release(ctx, point);
        return status;
    }
    *value = point;
    *n = row;
    return LOXO_OK;
}

loxo_status loxo_read_csv_points(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                 double **position, int64_t *n)
{
    int64_t n_columns = 3;
    return read_csv_rows(ctx, bytes, n_bytes, name, "point", &n_columns, position, n);
}

loxo_status loxo_read_array_bytes(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                  loxo_array *array)
{
    loxo_array own = {.n_dimensions = 2};
    loxo_status status;
    if (n_bytes >= 6 && memcmp(bytes, "\x93NUMPY", 6) == 0)
        status = loxo_read_npy_array(ctx, bytes, n_bytes, name, &own);
    else
        status = read_csv_rows(ctx, bytes, n_bytes, name, "row", &own.shape[1], &own.value, &own.shape[0]);
    if (status >= 0 && own.value == NULL)
        status = loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.file = name, .byte = -1, .element = -1},
                              "no number in it");
    *array = status >= 0 ? own : (loxo_array){0};
    return status;
}

loxo_status loxo_read_points_bytes(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                   double **position, int64_t *n)
{
    const bool is_npy = n_bytes >= 6 && memcmp(bytes, "\x93NUMPY", 6) == 0;
    const loxo_place place = {.file = name, .byte = -1, .element = -1};
    *position = NULL;
    *n = 0;
    loxo_status status = (is_npy ? loxo_read_npy_points : loxo_read_csv_points)(ctx, bytes, n_bytes, name, position, n);
    if (status >= 0 && *n == 0) status = loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "no point in it");
    for (int64_t i = 0; i < 3 * *n && status >= 0; ++i)
        if (!isfinite((*position)[i]))
            status = loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.file = name, .byte = -1, .element = i / 3},
                                  "point %" PRId64 " is not finite", i / 3);
    if (status >= 0) return status;
    loxo_release(ctx, *position);
    *position = NULL;
    *n = 0;
    return status;
}

/* Reads the whole file; the caller releases the bytes. */
static loxo_status read_whole(loxo_context *ctx, const char *path, uint8_t **bytes, size_t *n_bytes)
{
    *bytes = NULL;
    *n_bytes = 0;
    loxo_progress_begin(ctx);
    return loxo_source_whole(ctx, path, bytes, n_bytes);
}

loxo_status loxo_read_points(loxo_context *ctx, const char *path, double **position, int64_t *n)
{
    if (ctx == NULL || path == NULL || position == NULL || n == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "reading points needs a path and a place for them");
    uint8_t *bytes;
    size_t n_bytes;
    *position = NULL;
    *n = 0;
    loxo_status status = read_whole(ctx, path, &bytes, &n_bytes);
    if (status >= 0) status = loxo_read_points_bytes(ctx, bytes, n_bytes, path, position, n);
    loxo_release(ctx, bytes);
    if (status < 0) loxo_failure_set_file(ctx, path);
    return status;
}

loxo_status loxo_read_array(loxo_context *ctx, const char *path, loxo_array *array)
{
    if (ctx == NULL || path == NULL || array == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "reading an array needs a path and a place for it");
    uint8_t *bytes;
    size_t n_bytes;
    *array = (loxo_array){0};
    loxo_status status = read_whole(ctx, path, &bytes, &n_bytes);
    if (status >= 0) status = loxo_read_array_bytes(ctx, bytes, n_bytes, path, array);
    loxo_release(ctx, bytes);
    if (status < 0) loxo_failure_set_file(ctx, path);
    return status;
}

loxo_status loxo_read_array_shape(loxo_context *ctx, const char *path, loxo_array *array, size_t *peak_bytes)
{
    loxo_source source;
    int64_t numbers = 1;
    if (ctx == NULL || path == NULL || array == NULL || peak_bytes == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "a shape needs a path and places for it");
    *array = (loxo_array){0};
    loxo_status status = loxo_source_open(ctx, path, &source);
    const bool is_told =
        status >= 0 && source.n_bytes >= 0 && source.n_head >= 6 && memcmp(source.head, "\x93NUMPY", 6) == 0;
    if (is_told) {
        status = loxo_read_npy_shape(ctx, source.head, source.n_head, path, array);
        for (int k = 0; k < array->n_dimensions && status >= 0; ++k)
            if (__builtin_mul_overflow(numbers, array->shape[k], &numbers) || numbers > INT64_MAX / 8)
                status = loxo_fail_at(ctx, LOXO_ERR_LIMIT, (loxo_place){.byte = -1, .element = -1}, "too many numbers");
        *peak_bytes = (size_t)source.n_bytes + (size_t)numbers * sizeof(double);
    }
    loxo_source_close(ctx, &source);
    if (status < 0) loxo_failure_set_file(ctx, path);
    if (status < 0 || is_told) return status;
    if ((status = loxo_read_array(ctx, path, array)) < 0) return status;
    *peak_bytes = loxo_context_memory(ctx).peak_bytes;
    loxo_release(ctx, array->value);
    array->value = NULL;
    return status;
}

void loxo_array_destroy(loxo_context *ctx, loxo_array *array)
{
    if (array == NULL) return;
    loxo_release(ctx, array->value);
    *array = (loxo_array){0};
}
