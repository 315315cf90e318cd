/* SPDX-License-Identifier: MIT
 * Writing: the arguments' checks, the format by suffix, one stream a file. */
#include "base/context.h"
#include "io/format_names.h"
#include "io/print.h"
#include "io/writers.h"

loxo_write_settings loxo_write_settings_default(void)
{
    return (loxo_write_settings){.format = LOXO_FORMAT_AUTO, .comment = NULL};
}

/* Where the format is not said: by the suffix; standard output gets `standard`. */
static loxo_status choose_format(loxo_context *ctx, const char *path, const loxo_write_settings *settings,
                                 loxo_format standard, loxo_format *format)
{
    *format = settings != NULL ? settings->format : LOXO_FORMAT_AUTO;
    if (*format == LOXO_FORMAT_AUTO) *format = strcmp(path, "-") == 0 ? standard : loxo_format_from_suffix(path);
    if (*format != LOXO_FORMAT_AUTO) return LOXO_OK;
    return loxo_fail_at(ctx, LOXO_ERR_UNSUPPORTED, (loxo_place){.file = path, .byte = -1, .element = -1},
                        "the file's suffix names no format that can be written");
}

static loxo_status cannot_write(loxo_context *ctx, const char *path, loxo_format format, const char *what)
{
    return loxo_fail_at(ctx, LOXO_ERR_UNSUPPORTED, (loxo_place){.file = path, .byte = -1, .element = -1},
                        "%s is no format that %s can be written in", loxo_format_name(format), what);
}

static loxo_status check_soup(loxo_context *ctx, const loxo_soup *soup)
{
    if (soup == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: no mesh");
    if (soup->n_vertices < 0 || soup->n_faces < 0 || soup->n_fields < 0)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: a count is negative");
    if (soup->n_vertices > LOXO_INDEX_MAX || soup->n_faces > INT64_MAX / 64)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: more vertices or faces than can be");
    if (soup->n_vertices > 0 && (soup->position != NULL) == (soup->position_float != NULL))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: exactly one of position and position_float must be set");
    if (soup->n_faces > 0 && soup->triangle == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: faces without triangles");
    for (int i = 0; i < soup->n_fields; ++i)
        if (soup->fields == NULL || (soup->n_vertices > 0 && soup->fields[i].value == NULL) ||
            memchr(soup->fields[i].name, 0, sizeof soup->fields[i].name) == NULL)
            return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: field %d has no values or no end of its name", i);
    for (int64_t i = 0; i < 3 * soup->n_faces; ++i)
        if (soup->triangle[i] < 0 || soup->triangle[i] >= soup->n_vertices)
            return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = i / 3},
                                "write: face %lld: vertex %lld not in 0..%lld", (long long)(i / 3),
                                (long long)soup->triangle[i], (long long)soup->n_vertices - 1);
    return LOXO_OK;
}

/* status is the writer's own; the stream's comes first, as it is what went wrong first. */
static loxo_status finish(loxo_stream *stream, loxo_status status)
{
    if (stream->status >= 0 && status < 0) stream->status = status;
    return loxo_stream_close(stream);
}

loxo_status loxo_write_mesh(loxo_context *ctx, const char *path, const loxo_soup *soup,
                            const loxo_write_settings *settings)
{
    typedef loxo_status (*writer_fn)(loxo_stream *, const loxo_soup *, const char *);
    loxo_stream stream;
    loxo_format format;
    writer_fn write = NULL;
    if (ctx == NULL || path == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: no path");
    loxo_status status = check_soup(ctx, soup);
    if (status < 0) return status;
    if ((status = choose_format(ctx, path, settings, LOXO_FORMAT_PLY, &format)) < 0) return status;
    switch (format) {
    case LOXO_FORMAT_PLY: write = loxo_write_ply; break;
    case LOXO_FORMAT_OBJ: write = loxo_write_obj; break;
    case LOXO_FORMAT_OFF: write = loxo_write_off; break;
    case LOXO_FORMAT_VTP: write = loxo_write_vtp; break;
    case LOXO_FORMAT_GIFTI: write = loxo_write_gifti; break;
    default: return cannot_write(ctx, path, format, "a mesh");
    }
    if ((status = loxo_stream_open(ctx, &stream, path)) < 0) return status;
    return finish(&stream, write(&stream, soup, settings != NULL ? settings->comment : NULL));
}

loxo_status loxo_write_field(loxo_context *ctx, const char *path, const char *name, const double *value, int64_t n,
                             const loxo_write_settings *settings)
{
    loxo_stream stream;
    loxo_format format;
    if (ctx == NULL || path == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: no path");
    if (n < 0 || n > INT64_MAX / 64 || (n > 0 && value == NULL))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: field without values");
    loxo_status status = choose_format(ctx, path, settings, LOXO_FORMAT_CSV, &format);
    if (status < 0) return status;
    if (format != LOXO_FORMAT_NPY && format != LOXO_FORMAT_CSV && format != LOXO_FORMAT_GIFTI)
        return cannot_write(ctx, path, format, "a field");
    if (name == NULL || name[0] == '\0') name = "value";
    if ((status = loxo_stream_open(ctx, &stream, path)) < 0) return status;
    if (format == LOXO_FORMAT_NPY) {
        status = loxo_write_npy(&stream, value, n);
    } else if (format == LOXO_FORMAT_CSV) {
        status = loxo_write_csv(&stream, name, value, n);
    } else {
        status = loxo_write_gifti_field(&stream, name, value, n, settings != NULL ? settings->comment : NULL);
    }
    return finish(&stream, status);
}

static void write_csv_rows(loxo_stream *stream, const double *value, int64_t n_rows, int64_t n_columns)
{
    for (int64_t i = 0; i < n_rows * n_columns; ++i) {
        char *text = (char *)loxo_stream_room(stream, LOXO_PRINT_MAX + 1);
        const size_t n = loxo_print_double(text, value[i]);
        text[n] = (i + 1) % n_columns == 0 ? '\n' : ',';
        stream->used += n + 1;
    }
}

loxo_status loxo_write_array(loxo_context *ctx, const char *path, const double *value, int n_dimensions,
                             const int64_t *shape)
{
    loxo_stream stream;
    loxo_format format;
    int64_t n = 1;
    if (ctx == NULL || path == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: no path");
    if (n_dimensions < 1 || n_dimensions > 3 || shape == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: an array has one to three dimensions");
    for (int k = 0; k < n_dimensions; ++k)
        if (n >= 0 && (shape[k] < 0 || __builtin_mul_overflow(n, shape[k], &n) || n > INT64_MAX / 64)) n = -1;
    if (n < 0 || (n > 0 && value == NULL)) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: array without values");
    loxo_status status = choose_format(ctx, path, NULL, LOXO_FORMAT_CSV, &format);
    if (status < 0) return status;
    if (format != LOXO_FORMAT_NPY && format != LOXO_FORMAT_CSV) return cannot_write(ctx, path, format, "an array");
    if ((status = loxo_stream_open(ctx, &stream, path)) < 0) return status;
    const int64_t n_columns = n_dimensions == 1 ? 1 : shape[n_dimensions - 1];
    if (format == LOXO_FORMAT_NPY)
        status = loxo_write_npy_array(&stream, value, n_dimensions, shape);
    else if (n > 0)
        write_csv_rows(&stream, value, n / n_columns, n_columns);
    return finish(&stream, status);
}

loxo_status loxo_write_matrix(loxo_context *ctx, const char *path, const double *value, int64_t n_rows,
                              int64_t n_columns)
{
    return loxo_write_array(ctx, path, value, 2, (const int64_t[]){n_rows, n_columns});
}

loxo_status loxo_write_check(loxo_context *ctx, const char *path)
{
    if (ctx == NULL || path == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: no path");
    return loxo_os_output_check(ctx, path);
}

loxo_status loxo_write_bytes(loxo_context *ctx, const char *path, const void *bytes, size_t n_bytes)
{
    loxo_stream stream;
    if (ctx == NULL || path == NULL || (bytes == NULL && n_bytes > 0))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: no path or no bytes");
    const loxo_status status = loxo_stream_open(ctx, &stream, path);
    if (status < 0) return status;
    loxo_stream_put(&stream, bytes, n_bytes);
    return loxo_stream_close(&stream);
}
