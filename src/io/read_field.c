/* SPDX-License-Identifier: MIT
 * Reading fields: bytes, format, reader; or a property of a PLY. */
#include "base/context.h"
#include "io/field.h"
#include "io/format_names.h"
#include "io/gifti.h"
#include "io/source.h"

#include <string.h>

static bool begins_with(const uint8_t *bytes, size_t n, const char *word)
{
    const size_t n_word = strlen(word);
    return n >= n_word && memcmp(bytes, word, n_word) == 0;
}

loxo_status loxo_read_field_bytes(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                  double **value, int64_t *n)
{
    const size_t n_mark = begins_with(bytes, n_bytes, "\xef\xbb\xbf") ? 3 : 0;
    *value = NULL;
    *n = 0;
    if (begins_with(bytes, n_bytes, "\x93NUMPY")) return loxo_read_npy(ctx, bytes, n_bytes, name, value, n);
    if (begins_with(bytes + n_mark, n_bytes - n_mark, "<?xml") ||
        begins_with(bytes + n_mark, n_bytes - n_mark, "<GIFTI") || loxo_format_from_suffix(name) == LOXO_FORMAT_GIFTI)
        return loxo_read_gifti_field(ctx, bytes, n_bytes, name, value, n);
    if (loxo_format_from_suffix(name) == LOXO_FORMAT_NPY) return loxo_read_npy(ctx, bytes, n_bytes, name, value, n);
    return loxo_read_csv(ctx, bytes, n_bytes, name, value, n);
}

/* "file.ply:name", or a PLY with one property that is no position. */
static loxo_status read_property(loxo_context *ctx, const char *path, const char *property, double **value, int64_t *n)
{
    loxo_soup soup;
    int found = -1;
    const loxo_status status = loxo_read_mesh(ctx, path, NULL, &soup);
    if (status < 0) return status;
    for (int i = 0; i < soup.n_fields; ++i)
        if (property != NULL ? strcmp(soup.fields[i].name, property) == 0 : soup.n_fields == 1) found = i;
    if (found >= 0) {
        *value = soup.fields[found].value;
        *n = soup.n_vertices;
        soup.fields[found].value = NULL;
    }
    const int n_fields = soup.n_fields;
    loxo_soup_destroy(ctx, &soup);
    if (found >= 0) return LOXO_OK;
    const loxo_place place = {.file = path, .byte = -1, .element = -1};
    if (property != NULL)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "there is no vertex property called \"%s\"", property);
    return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, place, "%d vertex properties: say which one, as FILE:NAME", n_fields);
}

static bool is_ply_name(const char *path)
{
    const size_t n = strlen(path);
    char plain[4097];
    if (n < 3 || n >= sizeof plain || strcmp(path + n - 3, ".gz") != 0)
        return loxo_format_from_suffix(path) == LOXO_FORMAT_PLY;
    memcpy(plain, path, n - 3);
    plain[n - 3] = '\0';
    return loxo_format_from_suffix(plain) == LOXO_FORMAT_PLY;
}

static loxo_status read_file(loxo_context *ctx, const char *path, double **value, int64_t *n)
{
    uint8_t *bytes = NULL;
    size_t n_bytes = 0;
    loxo_status status = loxo_source_whole(ctx, path, &bytes, &n_bytes);
    if (status >= 0) status = loxo_read_field_bytes(ctx, bytes, n_bytes, path, value, n);
    loxo_release(ctx, bytes);
    if (status < 0) loxo_failure_set_file(ctx, path);
    return status;
}

loxo_status loxo_read_field(loxo_context *ctx, const char *path, double **value, int64_t *n)
{
    char file[4097];
    if (ctx == NULL || path == NULL || value == NULL || n == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "reading a field needs a path and a place for it");
    *value = NULL;
    *n = 0;
    loxo_progress_begin(ctx);
    if (is_ply_name(path)) return read_property(ctx, path, NULL, value, n);
    const char *colon = strrchr(path, ':');
    if (colon != NULL && (size_t)(colon - path) < sizeof file) {
        memcpy(file, path, (size_t)(colon - path));
        file[colon - path] = '\0';
        if (is_ply_name(file)) return read_property(ctx, file, colon + 1, value, n);
    }
    return read_file(ctx, path, value, n);
}
