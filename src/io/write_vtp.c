/* SPDX-License-Identifier: MIT
 * VTK XML PolyData: arrays appended raw behind the XML, each after its length in bytes as a UInt64. Connectivity and
 * offsets are of one width, as VTK wants them: 32 bits while the corners fit. */
#include "base/context.h"
#include "io/writers.h"

typedef struct vtp {
    loxo_stream *stream;
    uint64_t offset; /* of the next array in the appended data */
} vtp;

static void declare_array(vtp *file, const char *type, const char *name, const char *components, uint64_t n_bytes)
{
    loxo_stream_format(file->stream, "        <DataArray type=\"%s\" Name=\"", type);
    loxo_stream_xml(file->stream, name);
    loxo_stream_format(file->stream, "\"%s format=\"appended\" offset=\"%llu\"/>\n", components,
                       (unsigned long long)file->offset);
    file->offset += 8 + n_bytes;
}

static void put_u64(loxo_stream *stream, uint64_t value)
{
    loxo_store_u64(loxo_stream_room(stream, 8), value);
    stream->used += 8;
}

/* n integers base, base + step, ... or those of ids, 4 or 8 bytes wide. */
static void put_integers(loxo_stream *stream, const loxo_index *ids, int64_t n, int64_t base, int64_t step,
                         size_t width)
{
    put_u64(stream, (uint64_t)n * width);
    for (int64_t i = 0; i < n; ++i) {
        const int64_t value = ids != NULL ? ids[i] : base + i * step;
        unsigned char *to = loxo_stream_room(stream, 8);
        if (width == 4)
            loxo_store_u32(to, (uint32_t)value);
        else
            loxo_store_u64(to, (uint64_t)value);
        stream->used += width;
    }
}

/* "--" may not stand in an XML comment, nor a "-" at its end. */
static void write_comment(loxo_stream *stream, const char *comment)
{
    if (comment == NULL) return;
    loxo_stream_text(stream, "<!-- ");
    for (; *comment != '\0'; ++comment) {
        const char c[2] = {*comment, '\0'};
        loxo_stream_xml(stream, c);
        if (*comment == '-') loxo_stream_text(stream, " ");
    }
    loxo_stream_text(stream, " -->\n");
}

loxo_status loxo_write_vtp(loxo_stream *stream, const loxo_soup *soup, const char *comment)
{
    const int64_t n_vertices = soup->n_vertices, n_corners = 3 * soup->n_faces;
    const size_t width = soup->position_float != NULL ? 4 : 8, id_width = n_corners <= INT32_MAX ? 4 : 8;
    const void *position = width == 4 ? (const void *)soup->position_float : (const void *)soup->position;
    const char *id_type = id_width == 4 ? "Int32" : "Int64";
    vtp file = {.stream = stream};

    loxo_stream_text(stream, "<?xml version=\"1.0\"?>\n");
    write_comment(stream, comment);
    loxo_stream_text(stream, "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
                             "header_type=\"UInt64\">\n  <PolyData>\n");
    loxo_stream_format(stream,
                       "    <Piece NumberOfPoints=\"%lld\" NumberOfVerts=\"0\" NumberOfLines=\"0\" "
                       "NumberOfStrips=\"0\" NumberOfPolys=\"%lld\">\n",
                       (long long)n_vertices, (long long)soup->n_faces);
    loxo_stream_text(stream, "      <PointData");
    if (soup->n_fields > 0) {
        loxo_stream_text(stream, " Scalars=\"");
        loxo_stream_xml(stream, soup->fields[0].name);
        loxo_stream_text(stream, "\"");
    }
    loxo_stream_text(stream, ">\n");
    for (int i = 0; i < soup->n_fields; ++i)
        declare_array(&file, "Float64", soup->fields[i].name, "", 8 * (uint64_t)n_vertices);
    loxo_stream_text(stream, "      </PointData>\n      <Points>\n");
    declare_array(&file, width == 4 ? "Float32" : "Float64", "Points", " NumberOfComponents=\"3\"",
                  3 * width * (uint64_t)n_vertices);
    loxo_stream_text(stream, "      </Points>\n      <Polys>\n");
    declare_array(&file, id_type, "connectivity", "", id_width * (uint64_t)n_corners);
    declare_array(&file, id_type, "offsets", "", id_width * (uint64_t)soup->n_faces);
    loxo_stream_text(stream, "      </Polys>\n    </Piece>\n  </PolyData>\n  <AppendedData encoding=\"raw\">\n_");

    for (int i = 0; i < soup->n_fields; ++i) {
        put_u64(stream, 8 * (uint64_t)n_vertices);
        loxo_stream_put_le(stream, soup->fields[i].value, n_vertices, 8);
    }
    put_u64(stream, 3 * width * (uint64_t)n_vertices);
    loxo_stream_put_le(stream, position, 3 * n_vertices, width);
    put_integers(stream, soup->triangle, n_corners, 0, 0, id_width);
    put_integers(stream, NULL, soup->n_faces, 3, 3, id_width);
    loxo_stream_text(stream, "\n  </AppendedData>\n</VTKFile>\n");
    return LOXO_OK;
}
