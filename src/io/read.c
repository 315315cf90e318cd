/* SPDX-License-Identifier: MIT
 * Reading surfaces: bytes, format, reader. */
#include "base/context.h"
#include "io/formats.h"
#include "io/ply.h"
#include "io/sniff.h"
#include "io/source.h"

loxo_read_settings loxo_read_settings_default(void)
{
    return (loxo_read_settings){.format = LOXO_FORMAT_AUTO, .max_bytes = 0};
}

typedef loxo_status (*reader_fn)(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup);

static loxo_status read_bytes(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_format format,
                              loxo_soup *soup)
{
    static const reader_fn readers[LOXO_FORMAT_FREESURFER + 1] = {
        [LOXO_FORMAT_PLY] = loxo_read_ply,     [LOXO_FORMAT_OBJ] = loxo_read_obj,
        [LOXO_FORMAT_OFF] = loxo_read_off,     [LOXO_FORMAT_STL] = loxo_read_stl,
        [LOXO_FORMAT_GIFTI] = loxo_read_gifti, [LOXO_FORMAT_FREESURFER] = loxo_read_freesurfer,
    };
    if (readers[format] == NULL)
        return loxo_fail_at(ctx, LOXO_ERR_UNSUPPORTED, (loxo_place){.file = name, .byte = -1, .element = -1},
                            "this build does not read %s", loxo_format_name(format));
    return readers[format](ctx, bytes, n, name, soup);
}

/* Bytes in memory, plain or packed. */
static loxo_status read_memory(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name,
                               const loxo_read_settings *settings, loxo_soup *soup)
{
    loxo_format format;
    loxo_status status;
    if (loxo_is_gzip(bytes, n)) {
        uint8_t *unpacked = NULL;
        size_t n_unpacked = 0;
        status = loxo_source_inflate(ctx, bytes, n, false, name, settings->max_bytes, &unpacked, &n_unpacked);
        if (status < 0) return status;
        status = loxo_sniff(ctx, unpacked, n_unpacked < LOXO_SOURCE_HEAD ? n_unpacked : LOXO_SOURCE_HEAD,
                            (int64_t)n_unpacked, name, settings->format, &format);
        if (status >= 0) status = read_bytes(ctx, unpacked, n_unpacked, name, format, soup);
        loxo_release(ctx, unpacked);
        return status;
    }
    status = loxo_sniff(ctx, bytes, n < LOXO_SOURCE_HEAD ? n : LOXO_SOURCE_HEAD, (int64_t)n, name, settings->format,
                        &format);
    return status < 0 ? status : read_bytes(ctx, bytes, n, name, format, soup);
}

/* A file or stream that is open: its head tells whether the rest is worth reading, and how. */
static loxo_status read_source(loxo_context *ctx, loxo_source *source, const loxo_read_settings *settings,
                               loxo_soup *soup)
{
    uint8_t *bytes = NULL;
    size_t n = 0;
    loxo_format format = LOXO_FORMAT_AUTO;
    loxo_status status;
    const bool is_packed = loxo_is_gzip(source->head, source->n_head);
    if (!is_packed) {
        status =
            loxo_sniff(ctx, source->head, source->n_head, source->n_bytes, source->name, settings->format, &format);
        if (status < 0) return status;
        if (format == LOXO_FORMAT_PLY && source->file.is_regular && source->n_bytes > 0)
            return loxo_read_ply_source(ctx, source, soup);
    }
    if ((status = loxo_source_read(ctx, source, settings->max_bytes, &bytes, &n)) < 0) return status;
    if (is_packed) {
        uint8_t *packed = bytes;
        status = loxo_source_inflate(ctx, packed, n, false, source->name, settings->max_bytes, &bytes, &n);
        loxo_release(ctx, packed);
        if (status < 0) return status;
    }
    /* Of the whole, the format is sure. */
    status = loxo_sniff(ctx, bytes, n < LOXO_SOURCE_HEAD ? n : LOXO_SOURCE_HEAD, (int64_t)n, source->name,
                        settings->format, &format);
    if (status >= 0) status = read_bytes(ctx, bytes, n, source->name, format, soup);
    loxo_release(ctx, bytes);
    return status;
}

static loxo_status check_arguments(loxo_context *ctx, const void *input, const loxo_read_settings *settings,
                                   const loxo_soup *soup)
{
    if (input == NULL || soup == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "reading needs an input and a soup");
    if (settings != NULL && ((int)settings->format < 0 || settings->format > LOXO_FORMAT_CSV))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "reading: no such format: %d", (int)settings->format);
    return LOXO_OK;
}

loxo_status loxo_read_mesh(loxo_context *ctx, const char *path, const loxo_read_settings *settings, loxo_soup *soup)
{
    const loxo_read_settings s = settings != NULL ? *settings : loxo_read_settings_default();
    loxo_source source;
    loxo_status status;
    if (soup != NULL) *soup = (loxo_soup){0};
    if ((status = check_arguments(ctx, path, settings, soup)) < 0) return status;
    loxo_progress_begin(ctx);
    status = loxo_source_open(ctx, path, &source);
    if (status >= 0) status = read_source(ctx, &source, &s, soup);
    loxo_source_close(ctx, &source);
    return status;
}

loxo_status loxo_read_mesh_memory(loxo_context *ctx, const void *bytes, size_t n_bytes, const char *name,
                                  const loxo_read_settings *settings, loxo_soup *soup)
{
    const loxo_read_settings s = settings != NULL ? *settings : loxo_read_settings_default();
    loxo_status status;
    if (soup != NULL) *soup = (loxo_soup){0};
    if ((status = check_arguments(ctx, bytes, settings, soup)) < 0) return status;
    loxo_progress_begin(ctx);
    return read_memory(ctx, bytes, n_bytes, name != NULL ? name : "memory", &s, soup);
}
