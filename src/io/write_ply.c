/* SPDX-License-Identifier: MIT
 * Binary little-endian PLY: positions in the width they have, fields as double vertex properties. */
#include "base/context.h"
#include "io/writers.h"

/* PLY cuts its header at blanks and knows no quoting: what could not stand in a name becomes `_`. */
static void property_name(const char *name, char out[64])
{
    size_t n = 0;
    for (; name[n] != '\0'; ++n)
        out[n] = (char)((unsigned char)name[n] <= 0x20 || name[n] == 0x7f ? '_' : name[n]);
    if (n == 0) memcpy(out, "value", n = 5);
    out[n] = '\0';
}

static loxo_status write_properties(loxo_stream *stream, const loxo_soup *soup)
{
    char name[64], other[64];
    for (int i = 0; i < soup->n_fields; ++i) {
        property_name(soup->fields[i].name, name);
        bool is_taken = strcmp(name, "x") == 0 || strcmp(name, "y") == 0 || strcmp(name, "z") == 0;
        for (int k = 0; k < i && !is_taken; ++k) {
            property_name(soup->fields[k].name, other);
            is_taken = strcmp(name, other) == 0;
        }
        if (is_taken)
            return loxo_fail(stream->ctx, LOXO_ERR_ARGUMENT, "write: two vertex properties would be called %s", name);
        loxo_stream_format(stream, "property double %s\n", name);
    }
    return LOXO_OK;
}

static void write_vertices(loxo_stream *stream, const loxo_soup *soup)
{
    const size_t width = soup->position_float != NULL ? 4 : 8;
    const unsigned char *position =
        width == 4 ? (const unsigned char *)soup->position_float : (const unsigned char *)soup->position;
    if (soup->n_fields == 0) {
        loxo_stream_put_le(stream, position, 3 * soup->n_vertices, width);
        return;
    }
    for (int64_t v = 0; v < soup->n_vertices; ++v, position += 3 * width) {
        loxo_stream_put_le(stream, position, 3, width);
        for (int i = 0; i < soup->n_fields; ++i) {
            loxo_store_f64(loxo_stream_room(stream, 8), soup->fields[i].value[v]);
            stream->used += 8;
        }
    }
}

loxo_status loxo_write_ply(loxo_stream *stream, const loxo_soup *soup, const char *comment)
{
    const char *type = soup->position_float != NULL ? "float" : "double";
    loxo_stream_text(stream, "ply\nformat binary_little_endian 1.0\n");
    if (comment != NULL) {
        loxo_stream_text(stream, "comment ");
        loxo_stream_line(stream, comment);
        loxo_stream_text(stream, "\n");
    }
    loxo_stream_format(stream, "element vertex %lld\nproperty %s x\nproperty %s y\nproperty %s z\n",
                       (long long)soup->n_vertices, type, type, type);
    const loxo_status status = write_properties(stream, soup);
    if (status < 0) return status;
    loxo_stream_format(stream, "element face %lld\nproperty list uchar int vertex_indices\nend_header\n",
                       (long long)soup->n_faces);
    write_vertices(stream, soup);
    for (int64_t f = 0; f < soup->n_faces; ++f) {
        const loxo_index *v = &soup->triangle[3 * f];
        unsigned char *to = loxo_stream_room(stream, 13);
        to[0] = 3;
        for (int c = 0; c < 3; ++c)
            loxo_store_u32(to + 1 + (ptrdiff_t)4 * c, (uint32_t)v[c]);
        stream->used += 13;
    }
    return LOXO_OK;
}
