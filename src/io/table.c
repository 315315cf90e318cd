/* SPDX-License-Identifier: MIT
 * Rows of text into a soup. First the lines of each chunk are counted, which tells every chunk where its rows belong;
 * then all are parsed into place, faces as if all were triangles; where some are not, faces are parsed once more, now
 * with the place of their triangles known. */
#include "io/table.h"

#include "base/allocate.h"
#include "base/context.h"

#include <inttypes.h>
#include <stdio.h>

typedef struct reading {
    const loxo_text *text;
    const loxo_table *table;
    loxo_soup *soup;
    int64_t n_here[LOXO_MAX_ELEMENTS]; /* rows of each element that the text has lines for */
    int64_t n_triangles_fit;           /* the array holds so many */
    bool is_second;                    /* faces go to their final place */
    unsigned char *room;               /* one of room_bytes a thread */
    size_t room_bytes;
    int64_t max_corners;
} reading;

/* A row being read. */
typedef struct row {
    const reading *r;
    loxo_text_chunk *chunk;
    const char *p;
    const char *noun;
    int64_t number; /* in its element */
    int thread;
} row;

static bool is_row_end(const row *w)
{
    return loxo_text_at_line_end(w->r->text, w->p) || (w->r->table->comment != 0 && *w->p == w->r->table->comment);
}

static bool fault(row *w, loxo_trouble trouble, const char *at, int64_t a, int64_t b)
{
    w->chunk->fault =
        (loxo_text_fault){.trouble = trouble, .at = at, .noun = w->noun, .element = w->number, .a = a, .b = b};
    return false;
}

static bool read_number(row *w, double *value, loxo_scan *scan, int64_t n_before, int64_t n_needed)
{
    const char *at = w->p = loxo_text_skip(w->r->text, w->p);
    if (is_row_end(w)) return fault(w, LOXO_TROUBLE_FEW, at, n_before, n_needed);
    *scan = loxo_scan_double(&w->p, w->r->text->end, value);
    return *scan != LOXO_SCAN_BAD || fault(w, LOXO_TROUBLE_NUMBER, at, 0, 0);
}

static bool read_length(row *w, int64_t *n, int64_t n_before, int64_t n_needed)
{
    const char *at = w->p = loxo_text_skip(w->r->text, w->p);
    if (is_row_end(w)) return fault(w, LOXO_TROUBLE_FEW, at, n_before, n_needed);
    const loxo_scan scan = loxo_scan_int64(&w->p, w->r->text->end, n);
    if (scan == LOXO_SCAN_BAD) return fault(w, LOXO_TROUBLE_INTEGER, at, 0, 0);
    return (scan == LOXO_SCAN_OK && *n >= 0) || fault(w, LOXO_TROUBLE_LENGTH, at, 0, 0);
}

/* A vertex index; -1 too where is_strip. */
static bool read_index(row *w, bool is_strip, int64_t n_before, int64_t n_needed, loxo_index *index)
{
    const int64_t n_vertices = w->r->table->n_vertices;
    const char *at = w->p = loxo_text_skip(w->r->text, w->p);
    int64_t value = 0;
    if (is_row_end(w)) return fault(w, LOXO_TROUBLE_FEW, at, n_before, n_needed);
    const loxo_scan scan = loxo_scan_int64(&w->p, w->r->text->end, &value);
    if (scan == LOXO_SCAN_BAD) return fault(w, LOXO_TROUBLE_INTEGER, at, 0, 0);
    if (scan != LOXO_SCAN_OK || value >= n_vertices || value < (is_strip ? -1 : 0))
        return fault(w, LOXO_TROUBLE_INDEX, at, 0, n_vertices - 1);
    if (value == 0) w->chunk->tally.has_index_0 = true;
    *index = (loxo_index)value;
    return true;
}

static bool skip_column(row *w, const loxo_column *column, int64_t n_before, int64_t n_needed)
{
    int64_t n = 1;
    double value;
    loxo_scan scan;
    if (column->is_list && !read_length(w, &n, n_before, n_needed)) return false;
    for (int64_t i = 0; i < n; ++i) {
        if (!read_number(w, &value, &scan, column->is_list ? i : n_before, column->is_list ? n : n_needed))
            return false;
        w->chunk->n_nonfinite_other += scan == LOXO_SCAN_NONFINITE;
    }
    return true;
}

static bool finish_row(row *w, const loxo_element *element)
{
    int n_extra = 0;
    double value;
    loxo_scan scan;
    for (w->p = loxo_text_skip(w->r->text, w->p); !is_row_end(w); w->p = loxo_text_skip(w->r->text, w->p)) {
        if (n_extra == element->max_extra)
            return fault(w, LOXO_TROUBLE_MANY, w->p, 0, element->n_columns + element->max_extra);
        if (!read_number(w, &value, &scan, 0, 0)) return false;
        w->chunk->n_nonfinite_other += scan == LOXO_SCAN_NONFINITE;
        ++n_extra;
    }
    if (n_extra < element->min_extra)
        return fault(w, LOXO_TROUBLE_FEW, w->p, element->n_columns + n_extra, element->n_columns + element->min_extra);
    return true;
}

static bool read_vertex(row *w, const loxo_element *element)
{
    const reading *r = w->r;
    const loxo_column *column = &r->table->column[element->first_column];
    loxo_soup *soup = r->soup;
    bool is_finite = true;
    const int64_t n_needed = element->n_columns + element->min_extra;
    for (int i = 0; i < element->n_columns; ++i) {
        const loxo_role role = column[i].role;
        double value = 0.0;
        loxo_scan scan;
        if (role == LOXO_ROLE_SKIP) {
            if (!skip_column(w, &column[i], i, n_needed)) return false;
            continue;
        }
        if (!read_number(w, &value, &scan, i, n_needed)) return false;
        if (role == LOXO_ROLE_FIELD) {
            soup->fields[column[i].field].value[w->number] = value;
        } else if (soup->position_float != NULL) {
            soup->position_float[3 * w->number + (int)role - (int)LOXO_ROLE_X] = (float)value;
            is_finite = is_finite && (float)value - (float)value == 0.0f;
        } else {
            soup->position[3 * w->number + (int)role - (int)LOXO_ROLE_X] = value;
            is_finite = is_finite && scan != LOXO_SCAN_NONFINITE;
        }
    }
    w->chunk->n_nonfinite += !is_finite;
    return finish_row(w, element);
}

static loxo_index *room_of(const row *w)
{
    return (loxo_index *)(void *)(w->r->room + (size_t)w->thread * w->r->room_bytes);
}

/* Corners into the workspace where it has room, else just through the check. */
static bool read_corners(row *w, int64_t n, bool is_strip, loxo_index *corner)
{
    loxo_index unused = 0;
    for (int64_t i = 0; i < n; ++i) {
        if (!read_index(w, is_strip, i, n, corner != NULL ? &corner[i] : &unused)) return false;
    }
    return true;
}

static size_t corner_bytes(int64_t n) { return ((size_t)n * sizeof(loxo_index) + 63) / 64 * 64; }

static bool put_polygon(row *w, int64_t n)
{
    const reading *r = w->r;
    loxo_index *corner = room_of(w);
    loxo_index *triangle = &r->soup->triangle[3 * (w->chunk->first_triangle + w->chunk->tally.n_triangles)];
    if (!read_corners(w, n, false, corner)) return false;
    if (n >= 3 &&
        !loxo_polygon_triangulate(r->soup, corner, n, (unsigned char *)corner + corner_bytes(r->max_corners),
                                  triangle) &&
        w->chunk->tally.n_doubtful++ == 0)
        w->chunk->tally.first_doubtful = w->number;
    return true;
}

static bool read_strip(row *w, int64_t n)
{
    loxo_face_tally *tally = &w->chunk->tally;
    loxo_index *triangle = w->r->is_second ? &w->r->soup->triangle[3 * w->chunk->first_triangle] : NULL;
    loxo_strip strip = {0};
    for (int64_t i = 0; i < n; ++i) {
        loxo_index id = 0, made[3];
        if (!read_index(w, true, i, n, &id)) return false;
        if (!loxo_strip_next(&strip, id, made)) continue;
        if (triangle != NULL) memcpy(&triangle[3 * tally->n_triangles], made, sizeof made);
        ++tally->n_triangles;
    }
    return true;
}

static bool read_face(row *w, const loxo_element *element)
{
    const reading *r = w->r;
    const loxo_column *column = &r->table->column[element->first_column];
    const bool is_strip = element->kind == LOXO_ELEMENT_STRIPS;
    loxo_face_tally *tally = &w->chunk->tally;
    for (int i = 0; i < element->n_columns; ++i) {
        int64_t n = 0;
        if (column[i].role != LOXO_ROLE_CORNERS) {
            if (!skip_column(w, &column[i], i, element->n_columns)) return false;
            continue;
        }
        if (!read_length(w, &n, i, element->n_columns)) return false;
        if (is_strip) {
            if (!read_strip(w, n)) return false;
            continue;
        }
        if (r->is_second) {
            if (!put_polygon(w, n)) return false;
        } else {
            /* As if all faces so far were triangles: if not, this is parsed again. */
            loxo_index *at = n == 3 && w->number < r->n_triangles_fit ? &r->soup->triangle[3 * w->number] : NULL;
            if (!read_corners(w, n, false, at)) return false;
        }
        loxo_face_count(tally, w->number, n);
    }
    return finish_row(w, element);
}

static bool skip_row(row *w, const loxo_element *element)
{
    const loxo_column *column = &w->r->table->column[element->first_column];
    for (int i = 0; i < element->n_columns; ++i) {
        if (!skip_column(w, &column[i], i, element->n_columns)) return false;
    }
    return finish_row(w, element);
}

static void count_rows(void *arg, loxo_text_chunk *chunk, int thread)
{
    const reading *r = arg;
    (void)thread;
    for (const char *p = chunk->begin; p < chunk->end; p = loxo_text_next_line(r->text, p)) {
        p = loxo_text_skip(r->text, p);
        chunk->n_rows += !loxo_text_at_line_end(r->text, p) && (r->table->comment == 0 || *p != r->table->comment);
    }
}

/* The rows of a chunk; in the second round, those of faces and strips. */
static void read_rows(void *arg, loxo_text_chunk *chunk, int thread)
{
    const reading *r = arg;
    row w = {.r = r, .chunk = chunk, .p = chunk->begin, .number = chunk->first_row, .thread = thread};
    int e = 0;
    chunk->tally = (loxo_face_tally){.has_index_0 = chunk->tally.has_index_0};
    for (; w.p < chunk->end; w.p = loxo_text_next_line(r->text, w.p)) {
        bool is_good;
        w.p = loxo_text_skip(r->text, w.p);
        if (is_row_end(&w)) continue;
        while (e < r->table->n_elements && w.number >= r->n_here[e])
            w.number -= r->n_here[e++];
        if (e == r->table->n_elements) break; /* what follows is told as a warning */
        const loxo_element *element = &r->table->element[e];
        switch (element->kind) {
        case LOXO_ELEMENT_VERTICES:
            w.noun = "vertex";
            is_good = r->is_second || read_vertex(&w, element);
            break;
        case LOXO_ELEMENT_FACES:
        case LOXO_ELEMENT_STRIPS:
            w.noun = element->kind == LOXO_ELEMENT_FACES ? "face" : "strip";
            is_good = read_face(&w, element);
            break;
        default:
            w.noun = element->name;
            is_good = r->is_second || skip_row(&w, element);
            break;
        }
        if (!is_good) return;
        ++w.number;
    }
}

/* The text of a row, counted over all elements. */
static const char *find_row(const reading *r, const loxo_text_chunks *chunks, int64_t number)
{
    int64_t i = 0;
    while (i + 1 < chunks->n && chunks->chunk[i + 1].first_row <= number)
        ++i;
    row w = {.r = r, .p = chunks->chunk[i].begin, .number = chunks->chunk[i].first_row};
    for (; w.p < chunks->chunk[i].end; w.p = loxo_text_next_line(r->text, w.p)) {
        w.p = loxo_text_skip(r->text, w.p);
        if (!is_row_end(&w) && w.number++ == number) break;
    }
    return w.p;
}

static loxo_status check_rows(loxo_context *ctx, const reading *r, int64_t n_rows)
{
    int64_t n_left = n_rows;
    for (int e = 0; e < r->table->n_elements; ++e) {
        const loxo_element *element = &r->table->element[e];
        if (element->n_columns == 0) continue;
        if (element->n_rows > n_left)
            return loxo_fail_at(ctx, LOXO_ERR_MALFORMED,
                                (loxo_place){.file = r->text->name,
                                             .line = loxo_text_line_number(r->text, r->text->end),
                                             .byte = -1,
                                             .element = n_left},
                                "the file ends early: %" PRId64 " rows of \"%s\" declared, %" PRId64 " found",
                                element->n_rows, element->name, n_left);
        n_left -= element->n_rows;
    }
    return LOXO_OK;
}

static void warn(loxo_context *ctx, const reading *r, const loxo_text_chunks *chunks, int64_t n_rows,
                 const loxo_face_tally *tally)
{
    const loxo_text *text = r->text;
    int64_t n_used = 0, n_nonfinite = 0, n_other = 0;
    for (int e = 0; e < r->table->n_elements; ++e)
        n_used += r->n_here[e];
    for (int64_t i = 0; i < chunks->n; ++i) {
        n_nonfinite += chunks->chunk[i].n_nonfinite;
        n_other += chunks->chunk[i].n_nonfinite_other;
    }
    if (n_rows > n_used) {
        const int64_t line = loxo_text_line_number(text, find_row(r, chunks, n_used));
        loxo_warn(ctx, "trailing", n_rows - n_used,
                  "%s: %" PRId64 " lines behind the last row are ignored (first: line %" PRId64 ")", text->name,
                  n_rows - n_used, line);
    }
    if (n_other > 0)
        loxo_warn(ctx, "value-nonfinite", n_other,
                  "%s: %" PRId64 " values that are not finite in columns that are not used", text->name, n_other);
    loxo_face_tally_warn(ctx, text->name, tally);
    loxo_soup_warn(ctx, text->name, r->soup, n_nonfinite);
}

loxo_status loxo_table_allocate_vertices(loxo_context *ctx, const loxo_table *table, int64_t n_vertices,
                                         loxo_soup *soup)
{
    const loxo_status status = loxo_soup_allocate_vertices(ctx, soup, n_vertices, table->is_float);
    if (status < 0 || table->n_fields == 0) return status;
    soup->fields = loxo_allocate_zero(ctx, table->n_fields, sizeof *soup->fields);
    if (soup->fields == NULL) return LOXO_ERR_MEMORY;
    soup->n_fields = table->n_fields;
    for (int i = 0; i < table->n_columns; ++i) {
        const loxo_column *column = &table->column[i];
        if (column->role != LOXO_ROLE_FIELD) continue;
        loxo_field *field = &soup->fields[column->field];
        snprintf(field->name, sizeof field->name, "%s", column->name);
        field->value = loxo_allocate(ctx, n_vertices, sizeof *field->value);
        if (field->value == NULL) return LOXO_ERR_MEMORY;
    }
    return LOXO_OK;
}

static loxo_status fail_row(loxo_context *ctx, const reading *r, const loxo_text_fault *fault_,
                            const loxo_face_tally *tally)
{
    int64_t index = 0;
    const char *p = fault_->at;
    const bool is_one_too_many = fault_->trouble == LOXO_TROUBLE_INDEX && !tally->has_index_0 &&
                                 loxo_scan_int64(&p, r->text->end, &index) == LOXO_SCAN_OK &&
                                 index == r->table->n_vertices;
    return loxo_text_fail(ctx, r->text, fault_, is_one_too_many ? " (are they counted from 1?)" : NULL);
}

/* Faces once more, now that the number of triangles before each chunk is known. */
static loxo_status read_polygons(loxo_context *ctx, reading *r, loxo_text_chunks *chunks, loxo_face_tally *tally)
{
    int64_t n_rows, n_faces;
    int n_threads = loxo_text_max_threads(ctx, chunks);
    loxo_status status = loxo_soup_allocate_triangles(ctx, r->soup, tally->n_triangles);
    if (status < 0) return status;
    r->is_second = true;
    r->max_corners = tally->max_corners;
    r->room_bytes = corner_bytes(r->max_corners) + (loxo_polygon_room_bytes(r->max_corners) + 63) / 64 * 64;
    if (r->room_bytes > (size_t)1 << 22) n_threads = 1; /* a giant among the polygons: its workspace only once */
    r->room = loxo_allocate(ctx, n_threads, r->room_bytes);
    if (r->room == NULL) return LOXO_ERR_MEMORY;
    status = loxo_text_parse(ctx, chunks, read_rows, r, n_threads, "parse");
    loxo_text_add_up(chunks, &n_rows, &n_faces, tally);
    loxo_release(ctx, r->room);
    return status;
}

static loxo_status read_all(loxo_context *ctx, reading *r, loxo_text_chunks *chunks)
{
    const loxo_table *table = r->table;
    const int n_threads = loxo_text_max_threads(ctx, chunks);
    loxo_face_tally tally;
    int64_t n_rows, n_faces, n_left;
    loxo_status status = loxo_text_parse(ctx, chunks, count_rows, r, n_threads, "parse");
    if (status < 0) return status;
    loxo_text_add_up(chunks, &n_rows, &n_faces, &tally);

    /* Memory follows the lines that are there; when some are missing, what is there is looked through for a fault that
     * explains it. */
    n_left = n_rows;
    for (int e = 0; e < table->n_elements; ++e) {
        const int64_t declared = table->element[e].n_columns == 0 ? 0 : table->element[e].n_rows;
        r->n_here[e] = declared < n_left ? declared : n_left;
        n_left -= r->n_here[e];
    }
    if (table->n_vertices > LOXO_INDEX_MAX && (status = check_rows(ctx, r, n_rows)) < 0) return status;
    status = loxo_table_allocate_vertices(ctx, table, r->n_here[table->vertices], r->soup);
    if (status < 0) return status;
    r->n_triangles_fit = table->faces < 0 ? 0 : r->n_here[table->faces];
    if ((status = loxo_soup_allocate_triangles(ctx, r->soup, r->n_triangles_fit)) < 0) return status;
    if ((status = loxo_text_parse(ctx, chunks, read_rows, r, n_threads, "parse")) < 0) return status;
    loxo_text_add_up(chunks, &n_rows, &n_faces, &tally);
    const loxo_text_fault *first = loxo_text_first_fault(chunks);
    if (first != NULL) return fail_row(ctx, r, first, &tally);
    if ((status = check_rows(ctx, r, n_rows)) < 0) return status;

    const bool all_triangles = table->strips < 0 && tally.n_small == 0 && tally.n_triangles == r->n_triangles_fit;
    if (!all_triangles && (status = read_polygons(ctx, r, chunks, &tally)) < 0) return status;

    int64_t n_nonfinite = 0, n_before = 0;
    for (int64_t i = 0; i < chunks->n; ++i)
        n_nonfinite += chunks->chunk[i].n_nonfinite;
    const int64_t bad = n_nonfinite == 0 ? -1 : loxo_soup_first_used_nonfinite(ctx, r->soup);
    if (bad >= 0) {
        for (int e = 0; e < table->vertices; ++e)
            n_before += r->n_here[e];
        return loxo_fail_nonfinite(
            ctx,
            (loxo_place){.file = r->text->name,
                         .line = loxo_text_line_number(r->text, find_row(r, chunks, n_before + bad)),
                         .byte = -1},
            r->soup, bad);
    }
    warn(ctx, r, chunks, n_rows, &tally);
    return LOXO_OK;
}

loxo_status loxo_table_read_text(loxo_context *ctx, const loxo_text *text, const char *from, const loxo_table *table,
                                 loxo_soup *soup)
{
    reading r = {.text = text, .table = table, .soup = soup};
    loxo_text_chunks chunks = {0};
    loxo_status status = loxo_text_split(ctx, text, from, NULL, &chunks);
    if (status >= 0) status = read_all(ctx, &r, &chunks);
    if (status < 0) loxo_failure_set_file(ctx, text->name);
    loxo_text_chunks_destroy(ctx, &chunks);
    return status;
}
