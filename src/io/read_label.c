/* SPDX-License-Identifier: MIT
 * FreeSurfer's labels: text with one vertex a line. */
#include "base/context.h"
#include "io/text.h"
#include "io/vertices.h"

#include <inttypes.h>

#define N_COLUMNS  5     /* vertex x y z value */
#define LEAST_LINE 10    /* bytes of an entry: "0 0 0 0 0\n" */
#define STOP_EVERY 65536 /* entries */

/* Behind the first line, which must begin with #. */
static loxo_status skip_header(loxo_context *ctx, const loxo_text *text, const char **at)
{
    const loxo_place start = {.file = text->name, .line = 1, .byte = -1, .element = -1};
    if (text->begin == text->end)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.file = text->name, .byte = 0, .element = -1},
                            "empty file");
    if (*text->begin != '#')
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, start,
                            "no FreeSurfer label: its first line does not begin with #");
    *at = loxo_text_next_line(text, text->begin);
    return LOXO_OK;
}

/* The number of entries, alone on its line, against the bytes that are left. */
static loxo_status read_count(loxo_context *ctx, const loxo_text *text, const char **at, int64_t *n)
{
    const char *p = loxo_text_skip(text, *at), *token = p;
    const loxo_place place = {
        .file = text->name, .line = loxo_text_line_number(text, token), .byte = -1, .element = -1};
    if (loxo_text_at_line_end(text, p))
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "the number of entries is missing");
    const loxo_scan scan = loxo_scan_int64(&p, text->end, n);
    if (scan == LOXO_SCAN_BAD || !loxo_text_at_line_end(text, loxo_text_skip(text, p)) ||
        (scan == LOXO_SCAN_OK && *n < 0))
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "\"%.*s\" is not a number of entries",
                            (int)(p - token < 40 ? p - token : 40), token);
    *at = loxo_text_next_line(text, p);
    const int64_t n_bytes = text->end - *at;
    if (scan == LOXO_SCAN_OVERFLOW || *n > n_bytes / LEAST_LINE + 1)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "%.*s entries announced, %" PRId64 " bytes are left",
                            (int)(p - token < 40 ? p - token : 40), token, n_bytes);
    return LOXO_OK;
}

/* One entry, at its first character; *at moves to its line's end. Numbers that nobody uses need only be numbers. */
static loxo_status read_entry(loxo_context *ctx, const loxo_text *text, const char **at, int64_t entry,
                              int64_t n_vertices, loxo_index *vertex)
{
    const char *p = *at, *token = p;
    int64_t number = -1;
    loxo_text_fault fault = {.at = token, .noun = "entry", .element = entry, .b = n_vertices - 1};
    const loxo_scan scan = loxo_scan_int64(&p, text->end, &number);
    if (scan == LOXO_SCAN_BAD) {
        fault.trouble = LOXO_TROUBLE_INTEGER;
        return loxo_text_fail(ctx, text, &fault, NULL);
    }
    if (scan == LOXO_SCAN_OK && number == -1) {
        const loxo_place place = {
            .file = text->name, .line = loxo_text_line_number(text, token), .byte = -1, .element = entry};
        return loxo_fail_at(ctx, LOXO_ERR_UNSUPPORTED, place,
                            "an entry with vertex -1 has coordinates only: assign the label to the surface first, or "
                            "give the coordinates as source points");
    }
    if (scan == LOXO_SCAN_OVERFLOW || number < 0 || number >= n_vertices) {
        fault.trouble = LOXO_TROUBLE_INDEX;
        return loxo_text_fail(ctx, text, &fault, NULL);
    }
    for (int column = 1; column < N_COLUMNS; ++column) {
        double value;
        fault.at = p = loxo_text_skip(text, p);
        if (loxo_text_at_line_end(text, p)) {
            fault.trouble = LOXO_TROUBLE_FEW;
            fault.a = column;
            fault.b = N_COLUMNS;
            return loxo_text_fail(ctx, text, &fault, NULL);
        }
        if (loxo_scan_double(&p, text->end, &value) == LOXO_SCAN_BAD) {
            fault.trouble = LOXO_TROUBLE_NUMBER;
            return loxo_text_fail(ctx, text, &fault, NULL);
        }
    }
    fault.at = p = loxo_text_skip(text, p);
    if (!loxo_text_at_line_end(text, p)) {
        fault.trouble = LOXO_TROUBLE_MANY;
        fault.b = N_COLUMNS;
        return loxo_text_fail(ctx, text, &fault, NULL);
    }
    *vertex = (loxo_index)number;
    *at = p;
    return LOXO_OK;
}

/* Over lines with nothing on them. */
static const char *next_entry(const loxo_text *text, const char *p)
{
    p = loxo_text_skip(text, p);
    while (p < text->end && *p == text->line_end)
        p = loxo_text_skip(text, p + 1);
    return p;
}

static loxo_status read_entries(loxo_context *ctx, const loxo_text *text, const char *at, int64_t n_vertices,
                                loxo_index *vertex, int64_t n)
{
    int64_t entry = 0;
    loxo_status status = LOXO_OK;
    for (; entry < n && (at = next_entry(text, at)) < text->end; ++entry) {
        if ((status = read_entry(ctx, text, &at, entry, n_vertices, &vertex[entry])) < 0) return status;
        if (entry % STOP_EVERY == 0 && loxo_stop_wanted(ctx, "read", (double)entry / (double)n))
            return loxo_fail(ctx, LOXO_ERR_STOPPED, "stopped while parsing");
    }
    if (entry < n)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.file = text->name, .byte = -1, .element = -1},
                            "%" PRId64 " entries announced, %" PRId64 " found (is the file cut?)", n, entry);
    at = next_entry(text, at);
    if (at < text->end)
        loxo_warn(ctx, "label-more", 1, "%s: there is more behind the %" PRId64 " entries (first: line %" PRId64 ")",
                  text->name, n, loxo_text_line_number(text, at));
    return LOXO_OK;
}

loxo_status loxo_read_label(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                            int64_t n_vertices, loxo_index **vertex, int64_t *n)
{
    const loxo_text text = loxo_text_of(bytes, n_bytes, name);
    const char *at = text.begin;
    int64_t n_entries = 0;
    *vertex = NULL;
    *n = 0;
    loxo_status status = skip_header(ctx, &text, &at);
    if (status >= 0) status = read_count(ctx, &text, &at, &n_entries);
    if (status < 0) return status;
    loxo_index *list = loxo_allocate(ctx, n_entries, sizeof *list);
    if (list == NULL) return LOXO_ERR_MEMORY;
    if ((status = read_entries(ctx, &text, at, n_vertices, list, n_entries)) < 0) {
        loxo_release(ctx, list);
        return status;
    }
    *vertex = list;
    *n = n_entries;
    return LOXO_OK;
}
