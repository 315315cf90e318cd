/* SPDX-License-Identifier: MIT
 * Points of space out of .npy and text. */
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

/* Three numbers and nothing else. */
static loxo_status read_row(loxo_context *ctx, const loxo_text *text, const char *p, int64_t row, double point[3])
{
    loxo_text_fault fault = {.noun = "point", .element = row, .b = 3};
    for (int k = 0; k < 3; ++k) {
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

loxo_status loxo_read_csv_points(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                 double **position, int64_t *n)
{
    const loxo_text text = loxo_text_of(bytes, n_bytes, name);
    double(*point)[3] = NULL;
    int64_t capacity = 0, row = 0, line = 0;
    loxo_status status = LOXO_OK;
    for (const char *p = text.begin; p < text.end && status >= 0; p = loxo_text_next_line(&text, p)) {
        const char *start = loxo_text_skip(&text, p);
        if (is_row_end(&text, start)) continue;
        if (line++ == 0 && is_header(&text, start)) continue;
        if (row == capacity) {
            capacity = 2 * capacity + 64;
            double(*larger)[3] = loxo_reallocate(ctx, point, capacity, sizeof *larger);
            if (larger == NULL) {
                status = LOXO_ERR_MEMORY;
                break;
            }
            point = larger;
        }
        status = read_row(ctx, &text, start, row, point[row]);
        if (++row % STOP_ROWS == 0 && status >= 0 && loxo_stop_wanted(ctx, "read", -1.0))
            status = loxo_fail(ctx, LOXO_ERR_STOPPED, "stopped while parsing");
    }
    if (status < 0) {
        loxo_release(ctx, point);
        return status;
    }
    *position = (double *)point;
    *n = row;
    return LOXO_OK;
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

loxo_status loxo_read_points(loxo_context *ctx, const char *path, double **position, int64_t *n)
{
    if (ctx == NULL || path == NULL || position == NULL || n == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "reading points needs a path and a place for them");
    uint8_t *bytes = NULL;
    size_t n_bytes = 0;
    *position = NULL;
    *n = 0;
    loxo_progress_begin(ctx);
    loxo_status status = loxo_source_whole(ctx, path, &bytes, &n_bytes);
    if (status >= 0) status = loxo_read_points_bytes(ctx, bytes, n_bytes, path, position, n);
    loxo_release(ctx, bytes);
    if (status < 0) loxo_failure_set_file(ctx, path);
    return status;
}
