/* SPDX-License-Identifier: MIT
 * Vertices that a file names: which reader, and lists of numbers. */
#include "base/allocate.h"
#include "base/context.h"
#include "io/format_names.h"
#include "io/source.h"
#include "io/text.h"
#include "io/vertices.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define STOP_TOKENS 65536 /* between two looks at the monitor */

static bool begins_with(const uint8_t *bytes, size_t n, const char *word)
{
    const size_t n_word = strlen(word);
    return n >= n_word && memcmp(bytes, word, n_word) == 0;
}

static bool ends_in(const char *path, size_t n_path, const char *suffix)
{
    const size_t n = strlen(suffix);
    return n_path >= n && memcmp(path + n_path - n, suffix, n) == 0;
}

/* ---- lists --------------------------------------------------------------------------------------------------- */

static bool is_between(char c) { return c == ',' || loxo_is_space(c); }

/* Behind blanks, commas and comments. */
static const char *next_token(const loxo_text *text, const char *p)
{
    while (p < text->end && (is_between(*p) || *p == '#'))
        p = *p == '#' ? loxo_text_next_line(text, p) : p + 1;
    return p;
}

static loxo_status fail_at(loxo_context *ctx, const loxo_text *text, const char *token, const char *end,
                           loxo_status status, const char *what)
{
    const loxo_place place = {
        .file = text->name, .line = loxo_text_line_number(text, token), .byte = -1, .element = -1};
    return loxo_fail_at(ctx, status, place, "'%.*s' is %s", end - token < 60 ? (int)(end - token) : 60, token, what);
}

static loxo_status read_number(loxo_context *ctx, const loxo_text *text, const char *token, const char *end,
                               int64_t n_vertices, loxo_index *vertex)
{
    const char *p = token;
    int64_t number = 0;
    const loxo_scan scan = loxo_scan_int64(&p, end, &number);
    if (scan == LOXO_SCAN_BAD || p != end)
        return fail_at(ctx, text, token, end, LOXO_ERR_MALFORMED, "not a vertex number");
    if (scan == LOXO_SCAN_OVERFLOW || number < 0 || number >= n_vertices) {
        char range[64];
        (void)snprintf(range, sizeof range, "not in 0..%" PRId64, n_vertices - 1);
        return fail_at(ctx, text, token, end, LOXO_ERR_ARGUMENT, range);
    }
    *vertex = (loxo_index)number;
    return LOXO_OK;
}

loxo_status loxo_read_vertex_list(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                  int64_t n_vertices, loxo_index **vertex, int64_t *n)
{
    const loxo_text text = loxo_text_of(bytes, n_bytes, name);
    int64_t capacity = 0;
    loxo_status status = LOXO_OK;
    loxo_index *list = NULL;
    *vertex = NULL;
    *n = 0;
    int64_t n_found = 0;
    for (const char *p = next_token(&text, text.begin); p < text.end && status >= 0; ++n_found) {
        const char *token = p;
        while (p < text.end && !is_between(*p) && *p != '#')
            ++p;
        if (n_found == capacity) {
            capacity = 2 * capacity + 64;
            loxo_index *larger = loxo_reallocate(ctx, list, capacity, sizeof *larger);
            if (larger == NULL) {
                status = LOXO_ERR_MEMORY;
                break;
            }
            list = larger;
        }
        status = read_number(ctx, &text, token, p, n_vertices, &list[n_found]);
        if (status >= 0 && n_found % STOP_TOKENS == 0 && loxo_stop_wanted(ctx, "read", -1.0))
            status = loxo_fail(ctx, LOXO_ERR_STOPPED, "stopped while parsing");
        p = next_token(&text, p);
    }
    if (status < 0) {
        loxo_release(ctx, list);
        return status;
    }
    *vertex = list;
    *n = n_found;
    return LOXO_OK;
}

/* ---- which reader -------------------------------------------------------------------------------------------- */

static bool is_gifti(const uint8_t *bytes, size_t n, const char *name)
{
    const size_t n_mark = begins_with(bytes, n, "\xef\xbb\xbf") ? 3 : 0;
    return begins_with(bytes + n_mark, n - n_mark, "<?xml") || begins_with(bytes + n_mark, n - n_mark, "<GIFTI") ||
           loxo_format_from_suffix(name) == LOXO_FORMAT_GIFTI;
}

loxo_status loxo_read_vertices_bytes(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                     const char *key, int64_t n_vertices, loxo_index **vertex, int64_t *n)
{
    const loxo_place place = {.file = name, .byte = -1, .element = -1};
    loxo_status status;
    *vertex = NULL;
    *n = 0;
    if (is_gifti(bytes, n_bytes, name))
        status = loxo_read_gifti_region(ctx, bytes, n_bytes, name, key, n_vertices, vertex, n);
    else if (begins_with(bytes, n_bytes, "#!ascii label") || ends_in(name, strlen(name), ".label"))
        status = loxo_read_label(ctx, bytes, n_bytes, name, n_vertices, vertex, n);
    else
        status = loxo_read_vertex_list(ctx, bytes, n_bytes, name, n_vertices, vertex, n);
    if (status < 0 || *n > 0) return status;
    loxo_release(ctx, *vertex);
    *vertex = NULL;
    return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place,
                        key == NULL ? "no vertex in it" : "no vertex has the key '%.60s'", key);
}

/* "FILE.gii:KEY": where the key begins, which may have colons of its own; NULL: there is none. */
static const char *key_of(const char *path)
{
    for (const char *colon = strchr(path, ':'); colon != NULL; colon = strchr(colon + 1, ':')) {
        const size_t n = (size_t)(colon - path);
        if (ends_in(path, n, ".gii") || ends_in(path, n, ".gii.gz")) return colon + 1;
    }
    return NULL;
}

static loxo_status read_file(loxo_context *ctx, const char *path, const char *key, int64_t n_vertices,
                             loxo_index **vertex, int64_t *n)
{
    uint8_t *bytes = NULL;
    size_t n_bytes = 0;
    loxo_status status = loxo_source_whole(ctx, path, &bytes, &n_bytes);
    if (status >= 0) status = loxo_read_vertices_bytes(ctx, bytes, n_bytes, path, key, n_vertices, vertex, n);
    loxo_release(ctx, bytes);
    if (status < 0) loxo_failure_set_file(ctx, path);
    return status;
}

loxo_status loxo_read_vertices(loxo_context *ctx, const char *path, int64_t n_vertices, loxo_index **vertex, int64_t *n)
{
    char file[4097];
    if (ctx == NULL || path == NULL || vertex == NULL || n == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "reading vertices needs a path and a place for them");
    *vertex = NULL;
    *n = 0;
    loxo_progress_begin(ctx);
    const char *key = key_of(path);
    const size_t n_file = key == NULL ? strlen(path) : (size_t)(key - 1 - path);
    if (n_file >= sizeof file) return loxo_fail(ctx, LOXO_ERR_READ, "a file name of %zu characters", n_file);
    memcpy(file, path, n_file);
    file[n_file] = '\0';
    return read_file(ctx, file, key, n_vertices, vertex, n);
}
