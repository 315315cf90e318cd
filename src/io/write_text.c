/* SPDX-License-Identifier: MIT
 * Text formats: OBJ, OFF and CSV. */
#include "base/context.h"
#include "io/print.h"
#include "io/writers.h"

static void write_comment(loxo_stream *stream, const char *comment)
{
    if (comment == NULL) return;
    loxo_stream_text(stream, "# ");
    loxo_stream_line(stream, comment);
    loxo_stream_text(stream, "\n");
}

/* Lines `<lead>x y z`; lead is "" or ends in a blank. */
static void write_positions(loxo_stream *stream, const loxo_soup *soup, const char *lead)
{
    const size_t n_lead = strlen(lead);
    for (int64_t v = 0; v < soup->n_vertices; ++v) {
        char *line = (char *)loxo_stream_room(stream, n_lead + (size_t)3 * (LOXO_PRINT_MAX + 1));
        size_t n = n_lead;
        memcpy(line, lead, n_lead);
        for (int c = 0; c < 3; ++c) {
            n += soup->position_float != NULL ? loxo_print_float(line + n, soup->position_float[3 * v + c])
                                              : loxo_print_double(line + n, soup->position[3 * v + c]);
            line[n++] = c < 2 ? ' ' : '\n';
        }
        stream->used += n;
    }
}

/* Lines `<lead>a b c` with numbers from `first` on. */
static void write_triangles(loxo_stream *stream, const loxo_soup *soup, const char *lead, int first)
{
    const size_t n_lead = strlen(lead);
    for (int64_t f = 0; f < soup->n_faces; ++f) {
        char *line = (char *)loxo_stream_room(stream, n_lead + (size_t)3 * (LOXO_PRINT_MAX + 1));
        size_t n = n_lead;
        memcpy(line, lead, n_lead);
        for (int c = 0; c < 3; ++c) {
            n += loxo_print_int(line + n, (int64_t)soup->triangle[3 * f + c] + first);
            line[n++] = c < 2 ? ' ' : '\n';
        }
        stream->used += n;
    }
}

static void warn_fields(loxo_stream *stream, const loxo_soup *soup, const char *format)
{
    if (soup->n_fields > 0)
        loxo_warn(stream->ctx, "write fields", soup->n_fields, "%d fields were not written: %s holds none",
                  soup->n_fields, format);
}

loxo_status loxo_write_obj(loxo_stream *stream, const loxo_soup *soup, const char *comment)
{
    warn_fields(stream, soup, "OBJ");
    write_comment(stream, comment);
    write_positions(stream, soup, "v ");
    write_triangles(stream, soup, "f ", 1);
    return LOXO_OK;
}

loxo_status loxo_write_off(loxo_stream *stream, const loxo_soup *soup, const char *comment)
{
    warn_fields(stream, soup, "OFF");
    loxo_stream_text(stream, "OFF\n");
    write_comment(stream, comment);
    loxo_stream_format(stream, "%lld %lld 0\n", (long long)soup->n_vertices, (long long)soup->n_faces);
    write_positions(stream, soup, "");
    write_triangles(stream, soup, "3 ", 0);
    return LOXO_OK;
}

/* A name with a comma or a quote in it is quoted, as RFC 4180 has it. */
static void write_csv_name(loxo_stream *stream, const char *name)
{
    const char quote[2] = {'"', '\0'};
    if (strpbrk(name, ",\"") == NULL) {
        loxo_stream_line(stream, name);
        return;
    }
    loxo_stream_text(stream, quote);
    for (; *name != '\0'; ++name) {
        const char c[2] = {*name, '\0'};
        if (*name == '"') loxo_stream_text(stream, quote);
        loxo_stream_line(stream, c);
    }
    loxo_stream_text(stream, quote);
}

loxo_status loxo_write_csv(loxo_stream *stream, const char *name, const double *value, int64_t n)
{
    loxo_stream_text(stream, "vertex,");
    write_csv_name(stream, name);
    loxo_stream_text(stream, "\n");
    for (int64_t i = 0; i < n; ++i) {
        char *line = (char *)loxo_stream_room(stream, (size_t)2 * (LOXO_PRINT_MAX + 1));
        size_t k = loxo_print_int(line, i);
        line[k++] = ',';
        k += loxo_print_double(line + k, value[i]);
        line[k++] = '\n';
        stream->used += k;
    }
    return LOXO_OK;
}
