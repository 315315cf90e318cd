/* SPDX-License-Identifier: MIT
 * Vertices and triangles of a file without its surface in memory: out of its head, or by passing over its text. */
#include "io/counts.h"

#include "base/context.h"
#include "io/ply.h"
#include "io/sniff.h"
#include "io/source.h"
#include "io/weld.h"

#include <loxo/io.h>

#include <string.h>

#define STL_HEADER_BYTES 84
#define PASS_BYTES       LOXO_SOURCE_HEAD

/* ---- text, passed over ----------------------------------------------------------------------------------------- */

typedef enum pass_kind {
    PASS_OBJ,  /* v lines, and f lines with their corners */
    PASS_STL,  /* the word facet */
    PASS_ROWS, /* lines of faces that begin with their number of corners, behind others */
} pass_kind;

/* Words as they go by; the text is cut anywhere. */
typedef struct pass {
    pass_kind kind;
    char comment;
    int64_t n_skip, n_rows; /* of PASS_ROWS: lines still to come */
    int64_t n_vertices, n_triangles, n_facets;
    /* the line and the word that are being read */
    int64_t n_words, number;
    char word[9]; /* its first letters */
    size_t n_word;
    bool in_word, in_comment, is_face, is_backslash;
} pass;

static bool word_is(const pass *p, const char *text)
{
    if (p->n_word != strlen(text)) return false;
    if (p->kind == PASS_STL) return loxo_starts_with(p->word, p->word + p->n_word, text); /* in any case */
    return memcmp(p->word, text, p->n_word) == 0;
}

static void end_word(pass *p)
{
    if (!p->in_word) return;
    p->in_word = false;
    if (p->kind == PASS_STL) {
        p->n_facets += word_is(p, "facet") ? 1 : 0;
        if (p->n_words == 1) p->in_comment = word_is(p, "solid") || word_is(p, "endsolid"); /* a name follows */
    } else if (p->kind == PASS_OBJ && p->n_words == 1) {
        p->n_vertices += word_is(p, "v") ? 1 : 0;
        p->is_face = word_is(p, "f");
    } else if (p->kind == PASS_OBJ && word_is(p, "\\")) {
        --p->n_words;
    }
}

static void end_line(pass *p)
{
    end_word(p);
    if (p->kind == PASS_OBJ && p->is_backslash) return; /* the line goes on */
    p->in_comment = false;
    if (p->is_face && p->n_words > 3) p->n_triangles += p->n_words - 3;
    if (p->kind == PASS_ROWS && p->n_words > 0) {
        if (p->n_skip > 0) {
            --p->n_skip;
        } else if (p->n_rows > 0) {
            --p->n_rows;
            p->n_triangles += p->number > 2 ? p->number - 2 : 0;
        }
    }
    p->n_words = p->number = 0;
    p->is_face = false;
}

static void begin_word(pass *p, char c)
{
    if (c == p->comment && p->comment != 0) {
        p->in_comment = true;
        return;
    }
    p->in_word = true;
    p->n_word = 0;
    ++p->n_words;
}

static void pass_over(pass *p, const uint8_t *bytes, size_t n)
{
    for (size_t i = 0; i < n; ++i) {
        const char c = (char)bytes[i];
        if (c == '\n' || c == '\r') {
            end_line(p);
            if (c == '\n') p->is_backslash = false;
            continue;
        }
        if (loxo_is_space(c)) {
            end_word(p);
            continue;
        }
        if (!p->in_word && !p->in_comment) begin_word(p, c);
        p->is_backslash = c == '\\';
        if (p->in_comment) continue;
        if (p->n_words == 1 && c >= '0' && c <= '9' && p->number < LOXO_INDEX_MAX)
            p->number = 10 * p->number + (c - '0');
        if (p->n_word < sizeof p->word) p->word[p->n_word++] = c;
    }
}

/* ---- one file ---------------------------------------------------------------------------------------------------- */

typedef struct looking {
    loxo_flow flow;
    uint8_t *bytes; /* [PASS_BYTES] the head first */
    size_t n;
    int64_t n_total; /* bytes of the file, unpacked; -1: not known */
} looking;

static loxo_status pass_all(looking *l, size_t from, pass *p)
{
    int64_t n_total = (int64_t)l->n;
    size_t n = l->n - from;
    pass_over(p, l->bytes + from, n);
    for (;;) {
        const loxo_status status = loxo_flow_read(&l->flow, l->bytes, PASS_BYTES, &n);
        if (status < 0) return status;
        if (n == 0) break;
        n_total += (int64_t)n;
        pass_over(p, l->bytes, n);
        const double share = l->n_total > 0 ? (double)n_total / (double)l->n_total : -1.0;
        if (loxo_stop_wanted(l->flow.ctx, "count", share))
            return loxo_fail(l->flow.ctx, LOXO_ERR_STOPPED, "stopped while counting");
    }
    end_line(p);
    l->n_total = n_total;
    return LOXO_OK;
}

/* Bytes of all lists of corners, when no other column is a list, so that they are what is left; -1 when one is. */
static int64_t list_bytes(const loxo_ply_header *header, int64_t n_total)
{
    const loxo_table *t = &header->table;
    double left = (double)n_total - (double)header->n_bytes;
    int n_lists = 0;
    for (int e = 0; e < t->n_elements; ++e) {
        int64_t row = 0;
        for (int i = 0; i < t->element[e].n_columns; ++i) {
            const loxo_column *column = &t->column[t->element[e].first_column + i];
            if (column->is_list && t->element[e].n_rows > 0) ++n_lists;
            if (column->is_list && column->role != LOXO_ROLE_CORNERS && t->element[e].n_rows > 0) return -1;
            row += loxo_scalar_bytes(column->is_list ? column->length_type : column->type);
        }
        left -= (double)row * (double)t->element[e].n_rows;
    }
    return n_lists == 1 && left > 0 ? (int64_t)left : -1;
}

static const loxo_column *corner_column(const loxo_table *t, int element)
{
    for (int i = 0; i < t->element[element].n_columns; ++i) {
        const loxo_column *column = &t->column[t->element[element].first_column + i];
        if (column->role == LOXO_ROLE_CORNERS) return column;
    }
    return NULL;
}

/* Triangles, where the bytes tell; else as many as there are rows. */
static int64_t ply_triangles(const loxo_ply_header *header, int64_t n_total)
{
    const loxo_table *t = &header->table;
    const int64_t n_rows =
        (t->faces >= 0 ? t->element[t->faces].n_rows : 0) + (t->strips >= 0 ? t->element[t->strips].n_rows : 0);
    const int element = t->faces >= 0 && t->element[t->faces].n_rows > 0 ? t->faces : t->strips;
    const int64_t n_bytes = header->is_text || n_total < 0 || element < 0 ? -1 : list_bytes(header, n_total);
    const loxo_column *corners = n_bytes >= 0 ? corner_column(t, element) : NULL;
    if (corners == NULL) return n_rows;
    const int64_t n = n_bytes / loxo_scalar_bytes(corners->type) - 2 * n_rows;
    return n > n_rows ? n : n_rows;
}

/* Lines before the first face, when faces stand alone in lines that begin with their length; else -1. */
static int64_t rows_before_faces(const loxo_table *t)
{
    int64_t n = 0;
    if (t->faces < 0 || t->strips >= 0) return -1;
    if (t->column[t->element[t->faces].first_column].role != LOXO_ROLE_CORNERS) return -1;
    for (int e = 0; e < t->faces; ++e)
        n += t->element[e].n_columns > 0 ? t->element[e].n_rows : 0;
    return n;
}

static loxo_status ply_head(looking *l, loxo_head *head)
{
    loxo_context *ctx = l->flow.ctx;
    loxo_ply_header *header = loxo_allocate(ctx, 1, sizeof *header);
    if (header == NULL) return LOXO_ERR_MEMORY;
    const loxo_status status = loxo_ply_header_read(ctx, l->bytes, l->n, l->flow.name, header);
    if (status >= 0) {
        const loxo_table *t = &header->table;
        *head = (loxo_head){.n_vertices = t->n_vertices,
                            .n_faces = ply_triangles(header, l->n_total),
                            .n_fields = t->n_fields,
                            .is_float = t->is_float,
                            .is_text = header->is_text,
                            .n_rows_before = rows_before_faces(t),
                            .n_bytes = header->n_bytes};
        /* Triangles are read from a file block by block. */
        if (!header->is_text && l->flow.file.is_regular && !l->flow.is_packed && t->faces >= 0 &&
            head->n_faces == t->element[t->faces].n_rows)
            head->n_loaded = PASS_BYTES;
    }
    loxo_release(ctx, header);
    return status;
}

/* Text whose head tells the rows but not their corners. */
static loxo_status pass_rows(looking *l, loxo_head *head)
{
    pass p = {.kind = PASS_ROWS, .comment = head->comment, .n_skip = head->n_rows_before, .n_rows = head->n_faces};
    const loxo_status status = pass_all(l, head->n_bytes, &p);
    head->n_faces = p.n_skip == 0 && p.n_rows == 0 ? p.n_triangles : -1; /* not all there */
    return status;
}

static loxo_status pass_words(looking *l, pass_kind kind, loxo_head *head)
{
    pass p = {.kind = kind, .comment = kind == PASS_OBJ ? '#' : 0};
    const bool has_mark = l->n >= 3 && memcmp(l->bytes, "\xef\xbb\xbf", 3) == 0;
    const loxo_status status = pass_all(l, has_mark ? 3 : 0, &p);
    head->n_vertices = kind == PASS_OBJ ? p.n_vertices : p.n_facets / 2 + 2;
    head->n_faces = kind == PASS_OBJ ? p.n_triangles : p.n_facets;
    return status;
}

/* Size and first zero byte tell binary from text as the reader does. */
static loxo_status stl_head(looking *l, bool is_thorough, loxo_head *head)
{
    const uint8_t *b = l->bytes;
    const int64_t n_facets =
        l->n < STL_HEADER_BYTES
            ? 0
            : (int64_t)((uint32_t)b[80] | (uint32_t)b[81] << 8 | (uint32_t)b[82] << 16 | (uint32_t)b[83] << 24);
    const bool is_sized = l->n_total == STL_HEADER_BYTES + LOXO_STL_FACET_BYTES * n_facets;
    const bool is_text = !is_sized && memchr(b, 0, l->n < 512 ? l->n : 512) == NULL;
    if (is_text && is_thorough) return pass_words(l, PASS_STL, head);
    if (is_text || l->n < STL_HEADER_BYTES) return LOXO_OK;
    head->n_vertices = n_facets / 2 + 2;
    head->n_faces = n_facets;
    head->is_float = true;
    return LOXO_OK;
}

static loxo_status look(looking *l, loxo_format format, bool is_thorough, loxo_head *head)
{
    loxo_status status = LOXO_OK;
    switch (format) {
    case LOXO_FORMAT_PLY: status = ply_head(l, head); break;
    case LOXO_FORMAT_OFF: status = loxo_off_head(l->flow.ctx, l->bytes, l->n, l->flow.name, head); break;
    case LOXO_FORMAT_STL: return stl_head(l, is_thorough, head);
    case LOXO_FORMAT_GIFTI: return loxo_gifti_head(&l->flow, l->bytes, l->n, head);
    case LOXO_FORMAT_FREESURFER:
        return loxo_freesurfer_head(l->flow.ctx, l->bytes, l->n, l->n_total, l->flow.name, head);
    case LOXO_FORMAT_OBJ: return is_thorough ? pass_words(l, PASS_OBJ, head) : LOXO_OK;
    default: return LOXO_OK;
    }
    if (status >= 0 && head->is_text && head->n_rows_before >= 0 && is_thorough) status = pass_rows(l, head);
    return status;
}

/* The arrays; and what else readers hold at the same time. */
static size_t bytes_to_read(const looking *l, loxo_format format, const loxo_head *head)
{
    const double n_vertices = (double)head->n_vertices, n_faces = (double)head->n_faces;
    const double soup = n_vertices * ((head->is_float ? 12.0 : 24.0) + 8.0 * head->n_fields) +
                        n_faces * 3.0 * (double)sizeof(loxo_index);
    const double packed =
        l->flow.is_packed ? (double)(l->flow.file.n_bytes > 0 ? l->flow.file.n_bytes : l->flow.n_raw) : 0.0;
    double whole = l->n_total >= 0 ? (double)l->n_total : soup;
    if (l->n_total < 0 && packed > 0.0) whole = 3.0 * packed; /* what the reader expects, too */
    if (head->n_loaded > 0) whole = (double)head->n_loaded;
    double more = 0.0;
    if (format == LOXO_FORMAT_STL) more = 3.0 * n_faces * (4.0 + (head->is_float ? 0.0 : 24.0)); /* weld.c */
    if (format == LOXO_FORMAT_GIFTI) more = soup; /* arrays as the file has them */
    const double sum = soup + whole + packed + more;
    return sum < 0x1p62 ? (size_t)sum : SIZE_MAX / 2;
}

static loxo_status look_into(looking *l, loxo_format wanted, bool is_thorough, loxo_mesh_counts *counts)
{
    loxo_head head = {.n_vertices = -1, .n_faces = -1};
    loxo_status status = loxo_flow_read(&l->flow, l->bytes, LOXO_SOURCE_HEAD, &l->n);
    if (status < 0) return status;
    if (l->n < LOXO_SOURCE_HEAD)
        l->n_total = (int64_t)l->n;
    else if (!l->flow.is_packed && l->flow.file.is_regular)
        l->n_total = l->flow.file.n_bytes;
    status = loxo_sniff(l->flow.ctx, l->bytes, l->n, l->n_total, l->flow.name, wanted, &counts->format);
    if (status >= 0) status = look(l, counts->format, is_thorough, &head);
    if (status < 0) return status;
    if (head.n_vertices < 0 || head.n_faces < 0) return LOXO_OK;
    /* What cannot be there is no count; the reader says what is wrong. */
    if (l->n_total >= 0 && (head.n_vertices > l->n_total / 3 || head.n_faces > l->n_total)) return LOXO_OK;
    counts->n_vertices = head.n_vertices;
    counts->n_faces = head.n_faces;
    counts->n_fields = head.n_fields;
    counts->is_float = head.is_float;
    counts->read_bytes = bytes_to_read(l, counts->format, &head);
    return LOXO_OK;
}

loxo_status loxo_read_counts(loxo_context *ctx, const char *path, const loxo_read_settings *settings, bool is_thorough,
                             loxo_mesh_counts *counts)
{
    const loxo_format wanted = settings != NULL ? settings->format : LOXO_FORMAT_AUTO;
    looking l = {.n_total = -1};
    if (path == NULL || counts == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "counting needs an input and a place for the counts");
    if ((int)wanted < 0 || wanted > LOXO_FORMAT_CSV)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "reading: no such format: %d", (int)wanted);
    *counts = (loxo_mesh_counts){.n_vertices = -1, .n_faces = -1};
    loxo_progress_begin(ctx);
    loxo_status status = loxo_flow_open(ctx, path, &l.flow);
    if (status >= 0) {
        l.bytes = loxo_allocate(ctx, PASS_BYTES, 1);
        status = l.bytes != NULL ? look_into(&l, wanted, is_thorough, counts) : LOXO_ERR_MEMORY;
    }
    if (status < 0) loxo_failure_set_file(ctx, path);
    loxo_release(ctx, l.bytes);
    loxo_flow_close(&l.flow);
    return status;
}
