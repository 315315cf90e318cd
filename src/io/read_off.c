/* SPDX-License-Identifier: MIT
 * OFF and its kin: text goes to table.c, one vertex or face a line; binary is read here, big-endian.
 * source  Geomview manual, section 4.2.5, OFF files */
#include "base/allocate.h"
#include "base/context.h"
#include "io/bytes.h"
#include "io/counts.h"
#include "io/formats.h"
#include "io/table.h"

#include <inttypes.h>
#include <stdio.h>

typedef struct off_header {
    bool has_texture, has_colour, has_normal, has_fourth, has_dimension, is_binary;
    int64_t n_vertices, n_faces;
    const char *end; /* the data begin here, at the start of a line or of bytes */
} off_header;

static loxo_status fail_here(loxo_context *ctx, const loxo_text *text, const char *at, loxo_status status,
                             const char *what)
{
    return loxo_fail_at(
        ctx, status,
        (loxo_place){.file = text->name, .line = loxo_text_line_number(text, at), .byte = -1, .element = -1}, "%s",
        what);
}

/* To the next token, over line ends and comments. */
static const char *next_token(const loxo_text *text, const char *p)
{
    while (p < text->end && (loxo_is_space(*p) || *p == '#'))
        p = *p == '#' ? loxo_text_next_line(text, p) : p + 1;
    return p;
}

static loxo_status read_count(loxo_context *ctx, const loxo_text *text, const char **p, int64_t *count)
{
    const char *at = *p = next_token(text, *p);
    if (at == text->end) return fail_here(ctx, text, at, LOXO_ERR_MALFORMED, "the file ends inside the counts");
    const loxo_scan scan = loxo_scan_int64(p, text->end, count);
    if (scan == LOXO_SCAN_OVERFLOW && *at != '-')
        return fail_here(ctx, text, at, LOXO_ERR_LIMIT, "a count that is more than any file holds");
    if (scan != LOXO_SCAN_OK)
        return loxo_text_fail(ctx, text, &(loxo_text_fault){.trouble = LOXO_TROUBLE_INTEGER, .at = at}, NULL);
    if (*count < 0) return fail_here(ctx, text, at, LOXO_ERR_MALFORMED, "a negative count");
    return LOXO_OK;
}

/* [ST][C][N][4][n]OFF, the letters in any order; p moves behind it. */
static bool read_magic(const loxo_text *text, const char **p, off_header *header)
{
    const char *q = *p;
    for (; q < text->end && *q != 'O'; ++q) {
        if (*q == 'S' && q + 1 < text->end && q[1] == 'T') {
            header->has_texture = true;
            ++q;
        } else if (*q == 'C') {
            header->has_colour = true;
        } else if (*q == 'N') {
            header->has_normal = true;
        } else if (*q == '4') {
            header->has_fourth = true;
        } else if (*q == 'n') {
            header->has_dimension = true;
        } else {
            return false;
        }
    }
    if (text->end - q < 3 || memcmp(q, "OFF", 3) != 0) return false;
    *p = q + 3;
    return true;
}

static loxo_status read_header(loxo_context *ctx, const loxo_text *text, off_header *header)
{
    const char *p = next_token(text, text->begin), *line;
    int64_t dimension = 3, n_edges;
    loxo_status status;
    *header = (off_header){0};
    if (!read_magic(text, &p, header))
        return fail_here(ctx, text, p, LOXO_ERR_MALFORMED, "the file does not begin with OFF or one of its variants");
    line = loxo_text_skip(text, p);
    if (text->end - line >= 6 && memcmp(line, "BINARY", 6) == 0) {
        header->is_binary = true;
        line = loxo_text_skip(text, line + 6);
        if (line == text->end || *line != '\n')
            return fail_here(ctx, text, line, LOXO_ERR_MALFORMED, "no line end behind BINARY");
        header->end = line + 1;
        if (header->has_dimension || header->has_fourth)
            return fail_here(ctx, text, p, LOXO_ERR_UNSUPPORTED, "binary OFF of more than three dimensions");
        return LOXO_OK;
    }
    if (header->has_dimension && (status = read_count(ctx, text, &p, &dimension)) < 0) return status;
    if (dimension != 3 || header->has_fourth)
        return fail_here(ctx, text, p, LOXO_ERR_UNSUPPORTED, "OFF with points that are not of three dimensions");
    if ((status = read_count(ctx, text, &p, &header->n_vertices)) < 0) return status;
    if ((status = read_count(ctx, text, &p, &header->n_faces)) < 0) return status;
    /* The number of edges may be left out; it is not used. */
    p = loxo_text_skip(text, p);
    if (!loxo_text_at_line_end(text, p) && *p != '#') {
        if ((status = read_count(ctx, text, &p, &n_edges)) < 0) return status;
        p = loxo_text_skip(text, p);
        if (!loxo_text_at_line_end(text, p) && *p != '#')
            return fail_here(ctx, text, p, LOXO_ERR_MALFORMED, "more than three counts");
    }
    header->end = loxo_text_next_line(text, p);
    return LOXO_OK;
}

static void add_column(loxo_table *table, loxo_role role, const char *name)
{
    loxo_column *column = &table->column[table->n_columns++];
    *column = (loxo_column){.role = role, .type = LOXO_FLOAT64, .is_list = role == LOXO_ROLE_CORNERS};
    snprintf(column->name, sizeof column->name, "%s", name);
    ++table->element[table->n_elements - 1].n_columns;
}

static void describe(const off_header *header, loxo_table *table)
{
    *table = (loxo_table){.vertices = 0, .faces = 1, .strips = -1, .n_vertices = header->n_vertices, .comment = '#'};
    /* Colours have three or four numbers. */
    const int n_sure = (header->has_normal ? 3 : 0) + (header->has_colour ? 3 : 0) + (header->has_texture ? 2 : 0);
    table->element[0] = (loxo_element){.name = "vertex",
                                       .kind = LOXO_ELEMENT_VERTICES,
                                       .n_rows = header->n_vertices,
                                       .min_extra = n_sure,
                                       .max_extra = n_sure + (header->has_colour ? 1 : 0)};
    table->n_elements = 1;
    add_column(table, LOXO_ROLE_X, "x");
    add_column(table, LOXO_ROLE_Y, "y");
    add_column(table, LOXO_ROLE_Z, "z");
    /* A face may end with a colour: an index, or up to four numbers. */
    table->element[1] = (loxo_element){
        .name = "face", .kind = LOXO_ELEMENT_FACES, .n_rows = header->n_faces, .first_column = 3, .max_extra = 4};
    table->n_elements = 2;
    add_column(table, LOXO_ROLE_CORNERS, "corners");
}

/* ---- binary -------------------------------------------------------------------------------------------------- */

typedef struct binary {
    loxo_context *ctx;
    const uint8_t *begin, *p, *end;
    const char *name;
    int64_t n_vertices, n_faces;
} binary;

static loxo_status fail_binary(const binary *b, const uint8_t *at, int64_t element, const char *what)
{
    return loxo_fail_at(b->ctx, LOXO_ERR_MALFORMED,
                        (loxo_place){.file = b->name, .byte = at - b->begin, .element = element}, "%s", what);
}

static int64_t load_count(const uint8_t *p) { return (int32_t)loxo_load_u32(p, !LOXO_HOST_IS_BIG); }

/* Over one face, which starts at *p and is there as a whole; the corners are at *p + 4. */
static loxo_status next_face(const binary *b, int64_t face, const uint8_t **p, int64_t *n_corners)
{
    if (b->end - *p < 4) return fail_binary(b, b->end, face, "the file ends early, inside the faces");
    *n_corners = load_count(*p);
    if (*n_corners < 0 || *n_corners > (b->end - *p - 4) / 4)
        return fail_binary(b, *p, face, "the length of a face's list goes beyond the file (byte order?)");
    const uint8_t *colour = *p + 4 + 4 * *n_corners;
    if (b->end - colour < 4) return fail_binary(b, b->end, face, "the file ends early, inside the faces");
    const int64_t n_colours = load_count(colour);
    if (n_colours < 0 || n_colours > (b->end - colour - 4) / 4)
        return fail_binary(b, colour, face, "the length of a face's colour goes beyond the file");
    *p = colour + 4 + 4 * n_colours;
    return LOXO_OK;
}

static int64_t vertex_bytes(const off_header *header)
{
    return (int64_t)4 *
           (3 + (header->has_normal ? 3 : 0) + (header->has_colour ? 4 : 0) + (header->has_texture ? 2 : 0));
}

static loxo_status read_binary_vertices(binary *b, const off_header *header, loxo_soup *soup, int64_t *n_nonfinite)
{
    const int64_t n_row = vertex_bytes(header), n_found = (b->end - b->p) / n_row;
    loxo_status status;
    if (b->n_vertices > n_found)
        return loxo_fail_at(
            b->ctx, LOXO_ERR_MALFORMED, (loxo_place){.file = b->name, .byte = b->end - b->begin, .element = n_found},
            "the file ends early: %" PRId64 " vertices declared, %" PRId64 " found", b->n_vertices, n_found);
    if ((status = loxo_soup_allocate_vertices(b->ctx, soup, b->n_vertices, true)) < 0) return status;
    for (int64_t v = 0; v < b->n_vertices; ++v, b->p += n_row) {
        for (int i = 0; i < 3; ++i)
            soup->position_float[3 * v + i] = loxo_load_float(b->p + (ptrdiff_t)4 * i, !LOXO_HOST_IS_BIG);
        *n_nonfinite += !loxo_is_finite3(soup, v);
    }
    return LOXO_OK;
}

/* Corners into `corner`, checked. */
static loxo_status load_corners(const binary *b, int64_t face, const uint8_t *p, int64_t n, loxo_index *corner)
{
    for (int64_t i = 0; i < n; ++i) {
        const int64_t index = load_count(p + 4 * i);
        if (index < 0 || index >= b->n_vertices)
            return loxo_fail_at(b->ctx, LOXO_ERR_MALFORMED,
                                (loxo_place){.file = b->name, .byte = p + 4 * i - b->begin, .element = face},
                                "face %" PRId64 ": vertex index %" PRId64 " not in 0..%" PRId64, face, index,
                                b->n_vertices - 1);
        corner[i] = (loxo_index)index;
    }
    return LOXO_OK;
}

static loxo_status read_binary_faces(binary *b, loxo_soup *soup, loxo_face_tally *tally)
{
    const uint8_t *p = b->p;
    int64_t n = 0;
    loxo_status status = LOXO_OK;
    for (int64_t f = 0; f < b->n_faces; ++f) {
        if ((status = next_face(b, f, &p, &n)) < 0) return status;
        loxo_face_count(tally, f, n);
    }
    if ((status = loxo_soup_allocate_triangles(b->ctx, soup, tally->n_triangles)) < 0) return status;
    const size_t n_corner = ((size_t)tally->max_corners * sizeof(loxo_index) + 63) / 64 * 64;
    uint8_t *room = loxo_allocate(b->ctx, 1, n_corner + loxo_polygon_room_bytes(tally->max_corners));
    loxo_index *corner = (loxo_index *)(void *)room, *triangle = soup->triangle;
    if (room == NULL) return LOXO_ERR_MEMORY;
    for (int64_t f = 0; f < b->n_faces && status >= 0; ++f) {
        const uint8_t *at = b->p + 4;
        status = next_face(b, f, &b->p, &n);
        if (status >= 0) status = load_corners(b, f, at, n, corner);
        if (status < 0 || n < 3) continue;
        if (!loxo_polygon_triangulate(soup, corner, n, room + n_corner, triangle) && tally->n_doubtful++ == 0)
            tally->first_doubtful = f;
        triangle += 3 * loxo_face_n_triangles(n);
    }
    loxo_release(b->ctx, room);
    return status;
}

/* Counts, to where the vertices begin. */
static loxo_status read_binary_counts(binary *b)
{
    if (b->end - b->p < 12) return fail_binary(b, b->end, -1, "the file ends inside the counts");
    b->n_vertices = load_count(b->p);
    b->n_faces = load_count(b->p + 4);
    if (b->n_vertices < 0 || b->n_faces < 0) return fail_binary(b, b->p, -1, "a negative count (byte order?)");
    b->p += 12;
    return LOXO_OK;
}

static loxo_status read_binary(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name,
                               const off_header *header, loxo_soup *soup)
{
    binary b = {.ctx = ctx, .begin = bytes, .p = (const uint8_t *)header->end, .end = bytes + n, .name = name};
    loxo_face_tally tally = {0};
    int64_t n_nonfinite = 0;
    loxo_status status;
    if ((status = read_binary_counts(&b)) < 0) return status;
    if ((status = read_binary_vertices(&b, header, soup, &n_nonfinite)) < 0) return status;
    const int64_t vertex_row = b.n_vertices == 0 ? 0 : (b.p - (const uint8_t *)header->end - 12) / b.n_vertices;
    if ((status = read_binary_faces(&b, soup, &tally)) < 0) return status;
    const int64_t bad = n_nonfinite == 0 ? -1 : loxo_soup_first_used_nonfinite(ctx, soup);
    if (bad >= 0)
        return loxo_fail_nonfinite(
            ctx, (loxo_place){.file = name, .byte = (const uint8_t *)header->end - bytes + 12 + bad * vertex_row}, soup,
            bad);
    if (b.p < b.end)
        loxo_warn(ctx, "trailing", b.end - b.p, "%s: %td bytes behind the last face are ignored", name, b.end - b.p);
    loxo_face_tally_warn(ctx, name, &tally);
    loxo_soup_warn(ctx, name, soup, n_nonfinite);
    return LOXO_OK;
}

loxo_status loxo_off_head(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_head *head)
{
    const loxo_text text = loxo_text_of(bytes, n, name);
    off_header header;
    loxo_status status = read_header(ctx, &text, &header);
    if (status < 0) return status;
    *head = (loxo_head){.n_vertices = header.n_vertices,
                        .n_faces = header.n_faces,
                        .is_float = header.is_binary,
                        .is_text = !header.is_binary,
                        .comment = '#',
                        .n_rows_before = header.n_vertices,
                        .n_bytes = (size_t)(header.end - (const char *)bytes)};
    if (!header.is_binary) return LOXO_OK;
    binary b = {.ctx = ctx, .begin = bytes, .p = (const uint8_t *)header.end, .end = bytes + n, .name = name};
    if ((status = read_binary_counts(&b)) < 0) return status;
    head->n_bytes = (size_t)(b.p - bytes);
    head->n_vertices = b.n_vertices;
    head->n_faces = b.n_faces;
    return LOXO_OK;
}

loxo_status loxo_read_off(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup)
{
    const loxo_text text = loxo_text_of(bytes, n, name);
    off_header header;
    *soup = (loxo_soup){0};
    loxo_status status = read_header(ctx, &text, &header);
    if (status >= 0 && header.is_binary) {
        status = read_binary(ctx, bytes, n, name, &header, soup);
    } else if (status >= 0) {
        loxo_table *table = loxo_allocate(ctx, 1, sizeof *table);
        status = LOXO_ERR_MEMORY;
        if (table != NULL) {
            describe(&header, table);
            status = loxo_table_read_text(ctx, &text, header.end, table, soup);
        }
        loxo_release(ctx, table);
    }
    if (status >= 0) return LOXO_OK;
    loxo_failure_set_file(ctx, name);
    loxo_soup_destroy(ctx, soup);
    return status;
}
