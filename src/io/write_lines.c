/* SPDX-License-Identifier: MIT
 * Lines on a surface: OBJ (points and elements l), VTP (PolyData of lines), CSV (a row a point). */
#include "base/context.h"
#include "io/format_names.h"
#include "io/print.h"
#include "io/writers.h"

#define POINTS_A_LINE 512 /* of an OBJ element, so that no reader meets lines of megabytes */

static size_t print_position(char *line, const double position[3], char between)
{
    size_t n = 0;
    for (int c = 0; c < 3; ++c) {
        n += loxo_print_double(line + n, position[c]);
        if (c < 2) line[n++] = between;
    }
    return n;
}

/* Points begin..end-1 of line i; a closed line goes back to its first point by that one's number. */
static void put_element(loxo_stream *stream, const loxo_polylines *lines, int64_t i, int64_t begin, int64_t end)
{
    loxo_stream_text(stream, "l");
    for (int64_t p = begin; p < end; ++p) {
        const bool is_back = lines->is_closed[i] && p == lines->line_begin[i + 1] - 1;
        char *text = (char *)loxo_stream_room(stream, LOXO_PRINT_MAX + 1);
        text[0] = ' ';
        stream->used += 1 + loxo_print_int(text + 1, (is_back ? lines->line_begin[i] : p) + 1);
    }
    loxo_stream_text(stream, "\n");
}

static void write_obj(loxo_stream *stream, const loxo_polylines *lines)
{
    for (int64_t p = 0; p < lines->n_points; ++p) {
        char *line = (char *)loxo_stream_room(stream, (size_t)3 * (LOXO_PRINT_MAX + 1) + 2);
        line[0] = 'v';
        line[1] = ' ';
        size_t n = 2 + print_position(line + 2, lines->position[p], ' ');
        line[n++] = '\n';
        stream->used += n;
    }
    for (int64_t i = 0; i < lines->n_lines; ++i)
        for (int64_t p = lines->line_begin[i]; p + 1 < lines->line_begin[i + 1]; p += POINTS_A_LINE - 1) {
            const int64_t end = lines->line_begin[i + 1], stop = p + POINTS_A_LINE;
            put_element(stream, lines, i, p, stop < end ? stop : end);
        }
}

static void write_csv(loxo_stream *stream, const loxo_polylines *lines)
{
    loxo_stream_text(stream, "line,value,x,y,z\n");
    for (int64_t i = 0; i < lines->n_lines; ++i)
        for (int64_t p = lines->line_begin[i]; p < lines->line_begin[i + 1]; ++p) {
            char *line = (char *)loxo_stream_room(stream, (size_t)5 * (LOXO_PRINT_MAX + 1));
            size_t n = loxo_print_int(line, i);
            line[n++] = ',';
            n += loxo_print_double(line + n, lines->value[i]);
            line[n++] = ',';
            n += print_position(line + n, lines->position[p], ',');
            line[n++] = '\n';
            stream->used += n;
        }
}

static void put_u64(loxo_stream *stream, uint64_t value)
{
    loxo_store_u64(loxo_stream_room(stream, 8), value);
    stream->used += 8;
}

static bool has_points(const loxo_polylines *lines, int64_t i)
{
    return lines->line_begin[i + 1] > lines->line_begin[i];
}

/* Lines without points are left out: readers stumble over cells of none. */
static void write_vtp(loxo_stream *stream, const loxo_polylines *lines)
{
    uint64_t n_lines = 0;
    for (int64_t i = 0; i < lines->n_lines; ++i)
        n_lines += has_points(lines, i);
    const uint64_t n_points = (uint64_t)lines->n_points;
    const uint64_t points_at = 8 + 8 * n_lines, ids_at = points_at + 8 + 24 * n_points,
                   ends_at = ids_at + 8 + 8 * n_points;
    loxo_stream_text(stream, "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
                             "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n  <PolyData>\n");
    loxo_stream_format(stream,
                       "    <Piece NumberOfPoints=\"%llu\" NumberOfVerts=\"0\" NumberOfLines=\"%llu\" "
                       "NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n",
                       (unsigned long long)n_points, (unsigned long long)n_lines);
    loxo_stream_text(stream, "      <CellData Scalars=\"value\">\n        <DataArray type=\"Float64\" Name=\"value\" "
                             "format=\"appended\" offset=\"0\"/>\n      </CellData>\n");
    loxo_stream_format(stream,
                       "      <Points>\n        <DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" "
                       "format=\"appended\" offset=\"%llu\"/>\n      </Points>\n",
                       (unsigned long long)points_at);
    loxo_stream_format(stream,
                       "      <Lines>\n        <DataArray type=\"Int64\" Name=\"connectivity\" format=\"appended\" "
                       "offset=\"%llu\"/>\n        <DataArray type=\"Int64\" Name=\"offsets\" format=\"appended\" "
                       "offset=\"%llu\"/>\n      </Lines>\n",
                       (unsigned long long)ids_at, (unsigned long long)ends_at);
    loxo_stream_text(stream, "    </Piece>\n  </PolyData>\n  <AppendedData encoding=\"raw\">\n_");
    put_u64(stream, 8 * n_lines);
    for (int64_t i = 0; i < lines->n_lines; ++i)
        if (has_points(lines, i)) loxo_stream_put_le(stream, &lines->value[i], 1, 8);
    put_u64(stream, 24 * n_points);
    loxo_stream_put_le(stream, lines->position, 3 * lines->n_points, 8);
    put_u64(stream, 8 * n_points);
    for (uint64_t p = 0; p < n_points; ++p)
        put_u64(stream, p);
    put_u64(stream, 8 * n_lines);
    for (int64_t i = 0; i < lines->n_lines; ++i)
        if (has_points(lines, i)) put_u64(stream, (uint64_t)lines->line_begin[i + 1]);
    loxo_stream_text(stream, "\n  </AppendedData>\n</VTKFile>\n");
}

loxo_status loxo_write_polylines(loxo_context *ctx, const char *path, const loxo_polylines *lines)
{
    loxo_stream stream;
    if (ctx == NULL || path == NULL || lines == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "write: no path or no lines");
    const loxo_format format = strcmp(path, "-") == 0 ? LOXO_FORMAT_CSV : loxo_format_from_suffix(path);
    if (format != LOXO_FORMAT_OBJ && format != LOXO_FORMAT_VTP && format != LOXO_FORMAT_CSV)
        return loxo_fail_at(ctx, LOXO_ERR_UNSUPPORTED, (loxo_place){.file = path, .byte = -1, .element = -1},
                            "lines are written as .obj, .vtp or .csv");
    const loxo_status status = loxo_stream_open(ctx, &stream, path);
    if (status < 0) return status;
    if (format == LOXO_FORMAT_OBJ)
        write_obj(&stream, lines);
    else if (format == LOXO_FORMAT_VTP)
        write_vtp(&stream, lines);
    else
        write_csv(&stream, lines);
    return loxo_stream_close(&stream);
}
