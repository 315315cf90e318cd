/* SPDX-License-Identifier: MIT
 * source  Turk 1994, The PLY Polygon File Format */
#include "base/context.h"
#include "io/ply.h"

#include <inttypes.h>
#include <stdio.h>

#define MAX_WORDS 6

typedef struct word {
    const char *p;
    size_t n;
} word;

typedef struct parsing {
    loxo_context *ctx;
    const char *name;
    const char *p, *end;
    int64_t line;
    word words[MAX_WORDS];
    int n_words;
    bool has_format;
    int n_skipped_columns;
    loxo_ply_header *header;
} parsing;

static loxo_place here(const parsing *s)
{
    return (loxo_place){.file = s->name, .line = s->line, .byte = -1, .element = -1};
}

static bool is(word w, const char *text) { return w.n == strlen(text) && memcmp(w.p, text, w.n) == 0; }

/* For "%.*s". */
static int shown(word w) { return w.n > 60 ? 60 : (int)w.n; }

/* Splits the next line into words. Its end may be LF, CR LF or, in files that start so, CR alone: data may begin with
 * either byte, so exactly the line's end is taken. */
static loxo_status next_line(parsing *s, bool cr_only)
{
    const char *p = s->p;
    ++s->line;
    s->n_words = 0;
    while (p < s->end && *p != '\n' && !(*p == '\r' && cr_only))
        ++p;
    if (p == s->end)
        return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "no end_header in the first %td bytes", s->end - s->p);
    for (const char *q = s->p; q < p;) {
        const char *begin = q;
        if (loxo_is_space(*q)) {
            ++q;
            continue;
        }
        q = loxo_token_end(q, p);
        if (s->n_words < MAX_WORDS) s->words[s->n_words] = (word){begin, (size_t)(q - begin)};
        ++s->n_words;
    }
    s->p = p + 1;
    return LOXO_OK;
}

static bool find_type(word w, loxo_scalar *type)
{
    static const struct {
        const char *name;
        loxo_scalar type;
    } names[] = {
        {"char", LOXO_INT8},     {"int8", LOXO_INT8},       {"uchar", LOXO_UINT8},    {"uint8", LOXO_UINT8},
        {"short", LOXO_INT16},   {"int16", LOXO_INT16},     {"ushort", LOXO_UINT16},  {"uint16", LOXO_UINT16},
        {"int", LOXO_INT32},     {"int32", LOXO_INT32},     {"uint", LOXO_UINT32},    {"uint32", LOXO_UINT32},
        {"float", LOXO_FLOAT32}, {"float32", LOXO_FLOAT32}, {"double", LOXO_FLOAT64}, {"float64", LOXO_FLOAT64}};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        if (!is(w, names[i].name)) continue;
        *type = names[i].type;
        return true;
    }
    return false;
}

static loxo_status read_format(parsing *s)
{
    if (s->has_format || s->n_words != 3)
        return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), s->has_format ? "a second format" : "bad format line");
    if (is(s->words[1], "ascii"))
        s->header->is_text = true;
    else if (is(s->words[1], "binary_big_endian"))
        s->header->is_big = true;
    else if (!is(s->words[1], "binary_little_endian"))
        return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "unknown format \"%.*s\"", shown(s->words[1]),
                            s->words[1].p);
    if (!is(s->words[2], "1.0"))
        return loxo_fail_at(s->ctx, LOXO_ERR_UNSUPPORTED, here(s), "PLY version \"%.*s\", not 1.0", shown(s->words[2]),
                            s->words[2].p);
    s->has_format = true;
    return LOXO_OK;
}

static loxo_status read_element(parsing *s)
{
    loxo_table *table = &s->header->table;
    int64_t n_rows = 0;
    const word name = s->words[1], count = s->words[2];
    const char *p = count.p;
    if (s->n_words != 3) return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "bad element line");
    const loxo_scan scan = loxo_scan_int64(&p, count.p + count.n, &n_rows);
    if (scan == LOXO_SCAN_OVERFLOW && count.p[0] != '-')
        return loxo_fail_at(s->ctx, LOXO_ERR_LIMIT, here(s), "%.*s rows of \"%.*s\" are more than any file holds",
                            shown(count), count.p, shown(name), name.p);
    if (scan != LOXO_SCAN_OK || n_rows < 0)
        return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "\"%.*s\" is not a number of rows", shown(count),
                            count.p);
    if (table->n_elements == LOXO_MAX_ELEMENTS)
        return loxo_fail_at(s->ctx, LOXO_ERR_UNSUPPORTED, here(s), "more than %d elements", LOXO_MAX_ELEMENTS);
    for (int e = 0; e < table->n_elements; ++e) {
        if (is(name, table->element[e].name))
            return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "element \"%.*s\" twice", shown(name), name.p);
    }
    loxo_element *element = &table->element[table->n_elements];
    *element = (loxo_element){.n_rows = n_rows, .first_column = table->n_columns};
    snprintf(element->name, sizeof element->name, "%.*s", shown(name), name.p);
    if (is(name, "vertex")) {
        element->kind = LOXO_ELEMENT_VERTICES;
        table->vertices = table->n_elements;
        table->n_vertices = n_rows;
    } else if (is(name, "face")) {
        element->kind = LOXO_ELEMENT_FACES;
        table->faces = table->n_elements;
    } else if (is(name, "tristrips")) {
        element->kind = LOXO_ELEMENT_STRIPS;
        table->strips = table->n_elements;
    } else if (n_rows > 0) {
        loxo_warn(s->ctx, "ply-element", n_rows, "%s: element \"%s\" is skipped", s->name, element->name);
    }
    ++table->n_elements;
    return LOXO_OK;
}

/* Scalars of a vertex that have their own meaning and are not offered as fields. */
static bool is_known_and_skipped(word name)
{
    static const char *const names[] = {"nx", "ny", "nz", "red", "green",     "blue",     "alpha",
                                        "s",  "t",  "u",  "v",   "texture_u", "texture_v"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        if (is(name, names[i])) return true;
    }
    return false;
}

static void give_role(parsing *s, const loxo_element *element, loxo_column *column, word name)
{
    loxo_table *table = &s->header->table;
    const bool is_corners = column->is_list && (is(name, "vertex_indices") || is(name, "vertex_index"));
    if (element->kind == LOXO_ELEMENT_VERTICES && !column->is_list) {
        if (name.n == 1 && name.p[0] >= 'x' && name.p[0] <= 'z') {
            column->role = (loxo_role)((int)LOXO_ROLE_X + (name.p[0] - 'x'));
        } else if (is_known_and_skipped(name)) {
            column->role = LOXO_ROLE_SKIP;
        } else if (column->type >= LOXO_FLOAT32 && table->n_fields < LOXO_MAX_FIELDS) {
            column->role = LOXO_ROLE_FIELD;
            column->field = table->n_fields++;
        } else {
            ++s->n_skipped_columns;
        }
    } else if (is_corners && (element->kind == LOXO_ELEMENT_FACES || element->kind == LOXO_ELEMENT_STRIPS)) {
        column->role = LOXO_ROLE_CORNERS;
    }
}

static loxo_status read_property(parsing *s)
{
    loxo_table *table = &s->header->table;
    const bool is_list = s->n_words == 5 && is(s->words[1], "list");
    const word name = s->words[is_list ? 4 : 2];
    if (s->n_words != (is_list ? 5 : 3)) return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "bad property line");
    if (table->n_elements == 0)
        return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "a property before the first element");
    if (table->n_columns == LOXO_MAX_COLUMNS)
        return loxo_fail_at(s->ctx, LOXO_ERR_UNSUPPORTED, here(s), "more than %d properties", LOXO_MAX_COLUMNS);
    loxo_element *element = &table->element[table->n_elements - 1];
    loxo_column *column = &table->column[table->n_columns];
    *column = (loxo_column){.is_list = is_list};
    for (int i = is_list ? 2 : 1; i < s->n_words - 1; ++i) {
        loxo_scalar *type = is_list && i == 2 ? &column->length_type : &column->type;
        if (!find_type(s->words[i], type))
            return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "unknown type \"%.*s\"", shown(s->words[i]),
                                s->words[i].p);
    }
    if (is_list && column->length_type >= LOXO_FLOAT32)
        return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "the length of a list must be of an integer type");
    snprintf(column->name, sizeof column->name, "%.*s", shown(name), name.p);
    for (int i = 0; i < element->n_columns; ++i) {
        if (strcmp(table->column[element->first_column + i].name, column->name) == 0)
            return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "property \"%s\" twice", column->name);
    }
    give_role(s, element, column, name);
    if (column->role == LOXO_ROLE_CORNERS && column->type >= LOXO_FLOAT32)
        return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "vertex indices must be of an integer type");
    ++element->n_columns;
    ++table->n_columns;
    return LOXO_OK;
}

static int find_role(const loxo_table *table, int e, loxo_role role)
{
    for (int i = 0; i < table->element[e].n_columns; ++i) {
        if (table->column[table->element[e].first_column + i].role == role) return table->element[e].first_column + i;
    }
    return -1;
}

/* What must be there. */
static loxo_status check(parsing *s)
{
    loxo_table *table = &s->header->table;
    if (!s->has_format) return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "no format line in the header");
    if (table->vertices < 0) return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "no element \"vertex\"");
    table->is_float = true;
    for (int i = 0; i < 3; ++i) {
        const int c = find_role(table, table->vertices, (loxo_role)((int)LOXO_ROLE_X + i));
        if (c < 0)
            return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "vertices have no property \"%c\"", 'x' + i);
        const loxo_scalar type = table->column[c].type;
        if (type == LOXO_INT32 || type == LOXO_UINT32 || type == LOXO_FLOAT64) table->is_float = false;
    }
    for (int e = 0; e < table->n_elements; ++e) {
        const loxo_element_kind kind = table->element[e].kind;
        if ((kind == LOXO_ELEMENT_FACES || kind == LOXO_ELEMENT_STRIPS) && table->element[e].n_rows > 0 &&
            find_role(table, e, LOXO_ROLE_CORNERS) < 0)
            return loxo_fail_at(s->ctx, LOXO_ERR_MALFORMED, here(s), "element \"%s\" has no list \"vertex_indices\"",
                                table->element[e].name);
    }
    if (s->n_skipped_columns > 0)
        loxo_warn(s->ctx, "ply-property", s->n_skipped_columns, "%s: %d properties of the vertices are skipped",
                  s->name, s->n_skipped_columns);
    return LOXO_OK;
}

loxo_status loxo_ply_header_read(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name,
                                 loxo_ply_header *header)
{
    const loxo_text text = loxo_text_of(bytes, n, name);
    parsing s = {.ctx = ctx, .name = name, .p = text.begin, .end = text.end, .header = header};
    *header = (loxo_ply_header){.table = {.vertices = -1, .faces = -1, .strips = -1}};
    loxo_status status = next_line(&s, text.line_end == '\r');
    if (status < 0) return status;
    if (s.n_words != 1 || !is(s.words[0], "ply"))
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, here(&s), "the first line is not \"ply\"");
    for (;;) {
        if ((status = next_line(&s, text.line_end == '\r')) < 0) return status;
        const word key = s.n_words > 0 ? s.words[0] : (word){"", 0};
        if (is(key, "end_header") && s.n_words == 1) break;
        if (is(key, "format"))
            status = read_format(&s);
        else if (is(key, "element"))
            status = read_element(&s);
        else if (is(key, "property"))
            status = read_property(&s);
        else if (!is(key, "comment") && !is(key, "obj_info"))
            status = loxo_fail_at(ctx, LOXO_ERR_MALFORMED, here(&s), "unknown line in the header: \"%.*s\"", shown(key),
                                  key.p);
        if (status < 0) return status;
    }
    header->n_bytes = (size_t)(s.p - (const char *)bytes);
    return check(&s);
}
