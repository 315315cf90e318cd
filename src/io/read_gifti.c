/* SPDX-License-Identifier: MIT
 * Surfaces and fields out of a GIFTI file. Coordinates stay as they are stored: a transform that the file carries leads
 * to another space (of a scanner, of an atlas), which nobody asked for. */
#include "base/context.h"
#include "io/bytes.h"
#include "io/counts.h"
#include "io/faces.h"
#include "io/formats.h"
#include "io/gifti.h"
#include "io/raw.h"
#include "io/scan.h"
#include "io/vertices.h"

#include <inttypes.h>

typedef struct surface {
    loxo_gifti_array points, triangles, field; /* line is 0 while there is none */
} surface;

static loxo_status refuse(loxo_context *ctx, const char *name, const loxo_gifti_array *array, loxo_status status,
                          const char *text)
{
    return loxo_fail_at(ctx, status, (loxo_place){.file = name, .line = array->line, .byte = -1, .element = -1},
                        "DataArray: %s", text);
}

static bool is_float(const loxo_gifti_array *array)
{
    return array->type == LOXO_GIFTI_FLOAT32 || array->type == LOXO_GIFTI_FLOAT64;
}

/* One pointset, one array of triangles, and the first field of floats. */
static int want_surface(void *user, loxo_context *ctx, const char *name, const loxo_gifti_array *array)
{
    surface *s = user;
    if (strcmp(array->intent, "POINTSET") == 0) {
        if (s->points.line != 0) return refuse(ctx, name, array, LOXO_ERR_UNSUPPORTED, "a second pointset");
        if (!is_float(array))
            return refuse(ctx, name, array, LOXO_ERR_UNSUPPORTED, "a pointset of another type than FLOAT32 or FLOAT64");
        if (array->n_columns != 3) return refuse(ctx, name, array, LOXO_ERR_MALFORMED, "a pointset without 3 columns");
        s->points = *array;
        return 1;
    }
    if (strcmp(array->intent, "TRIANGLE") == 0) {
        if (s->triangles.line != 0) return refuse(ctx, name, array, LOXO_ERR_UNSUPPORTED, "triangles a second time");
        if (array->type != LOXO_GIFTI_INT32)
            return refuse(ctx, name, array, LOXO_ERR_UNSUPPORTED, "triangles of another type than INT32");
        if (array->n_columns != 3) return refuse(ctx, name, array, LOXO_ERR_MALFORMED, "triangles without 3 columns");
        s->triangles = *array;
        return 1;
    }
    if (s->field.line != 0 || !is_float(array) || array->n_columns != 1) return 0;
    s->field = *array;
    return 1;
}

static void take_surface(void *user, const loxo_gifti_array *array)
{
    surface *s = user;
    if (strcmp(array->intent, "POINTSET") == 0) {
        s->points = *array;
    } else if (strcmp(array->intent, "TRIANGLE") == 0) {
        s->triangles = *array;
    } else {
        s->field = *array;
    }
}

static void release_surface(loxo_context *ctx, surface *s)
{
    loxo_release(ctx, s->points.bytes);
    loxo_release(ctx, s->triangles.bytes);
    loxo_release(ctx, s->field.bytes);
}

static loxo_raw raw_of(const loxo_gifti_array *array)
{
    return (loxo_raw){.bytes = array->bytes,
                      .n_rows = array->n_rows,
                      .swap = array->swap,
                      .is_column_major = array->is_column_major,
                      .byte = -1,
                      .line = array->line};
}

static void widen(const loxo_gifti_array *array, double *value)
{
    for (int64_t i = 0; i < array->n_rows; ++i)
        value[i] = array->type == LOXO_GIFTI_FLOAT64 ? loxo_load_double(array->bytes + 8 * i, array->swap)
                                                     : (double)loxo_load_float(array->bytes + 4 * i, array->swap);
}

static loxo_status make_field(loxo_context *ctx, const char *name, const loxo_gifti_array *array, loxo_soup *soup)
{
    if (array->n_rows != soup->n_vertices) {
        loxo_warn(ctx, "gifti-field", 1, "%s: an array of %" PRId64 " values is no field on %" PRId64 " vertices", name,
                  array->n_rows, soup->n_vertices);
        return LOXO_OK;
    }
    soup->fields = loxo_allocate(ctx, 1, sizeof *soup->fields);
    if (soup->fields == NULL) return LOXO_ERR_MEMORY;
    soup->fields[0].value = loxo_allocate(ctx, soup->n_vertices, sizeof(double));
    soup->n_fields = 1;
    if (soup->fields[0].value == NULL) return LOXO_ERR_MEMORY;
    memcpy(soup->fields[0].name, array->name, sizeof array->name);
    if (array->name[0] == '\0') memcpy(soup->fields[0].name, "value", sizeof "value");
    widen(array, soup->fields[0].value);
    return LOXO_OK;
}

static loxo_status make_soup(loxo_context *ctx, const char *name, const surface *s, loxo_soup *soup)
{
    const loxo_place place = {.file = name, .byte = -1, .element = -1};
    const loxo_raw points = raw_of(&s->points), triangles = raw_of(&s->triangles);
    const bool is_double = s->points.type == LOXO_GIFTI_FLOAT64;
    loxo_status status;
    if (s->points.line == 0) return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "GIFTI without a pointset");
    if (s->triangles.line == 0) return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "GIFTI without triangles");
    if ((status = loxo_raw_positions(ctx, name, &points, is_double, soup)) < 0) return status;
    if ((status = loxo_raw_triangles(ctx, name, &triangles, soup)) < 0) return status;
    if ((status = loxo_raw_finish(ctx, name, &points, is_double, soup)) < 0) return status;
    return s->field.line != 0 ? make_field(ctx, name, &s->field, soup) : LOXO_OK;
}

loxo_status loxo_read_gifti(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup)
{
    surface s = {0};
    *soup = (loxo_soup){0};
    loxo_status status = loxo_gifti_parse(ctx, bytes, n, name, want_surface, take_surface, NULL, &s);
    if (status >= 0) status = make_soup(ctx, name, &s, soup);
    release_surface(ctx, &s);
    if (status < 0) {
        loxo_failure_set_file(ctx, name);
        loxo_soup_destroy(ctx, soup);
    }
    return status;
}

/* Looks as want_surface does, and takes nothing. */
static int note_surface(void *user, loxo_context *ctx, const char *name, const loxo_gifti_array *array)
{
    const int wanted = want_surface(user, ctx, name, array);
    return wanted > 0 ? 0 : wanted;
}

static bool has_counts(const void *user)
{
    const surface *s = user;
    return s->points.line != 0 && s->triangles.line != 0;
}

loxo_status loxo_gifti_head(loxo_flow *flow, const uint8_t *bytes, size_t n, loxo_head *head)
{
    surface s = {0};
    const loxo_status status = loxo_gifti_parse_flow(flow, bytes, n, note_surface, has_counts, &s);
    if (status < 0) return status;
    *head = (loxo_head){.n_vertices = s.points.line != 0 ? s.points.n_rows : -1,
                        .n_faces = s.triangles.line != 0 ? s.triangles.n_rows : -1,
                        .is_float = s.points.type == LOXO_GIFTI_FLOAT32};
    return LOXO_OK;
}

static int want_field(void *user, loxo_context *ctx, const char *name, const loxo_gifti_array *array)
{
    loxo_gifti_array *field = user;
    (void)ctx, (void)name;
    if (field->line != 0 || !is_float(array) || array->n_columns != 1 || strcmp(array->intent, "POINTSET") == 0)
        return 0;
    *field = *array;
    return 1;
}

static void take_field(void *user, const loxo_gifti_array *array) { *(loxo_gifti_array *)user = *array; }

loxo_status loxo_read_gifti_field(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                  double **value, int64_t *n)
{
    loxo_gifti_array field = {0};
    *value = NULL;
    *n = 0;
    loxo_status status = loxo_gifti_parse(ctx, bytes, n_bytes, name, want_field, take_field, NULL, &field);
    if (status >= 0 && field.line == 0)
        status = loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.file = name, .byte = -1, .element = -1},
                              "GIFTI without an array of one column of floats");
    if (status >= 0) {
        *value = loxo_allocate(ctx, field.n_rows, sizeof **value);
        if (*value == NULL) status = LOXO_ERR_MEMORY;
    }
    if (status >= 0) {
        *n = field.n_rows;
        widen(&field, *value);
    }
    loxo_release(ctx, field.bytes);
    return status;
}

/* ---- regions ------------------------------------------------------------------------------------------------- */

typedef struct region {
    loxo_gifti_array array;
    const char *key; /* NULL: what is not zero */
    double number;   /* of the key */
    bool is_known;
} region;

static int want_region(void *user, loxo_context *ctx, const char *name, const loxo_gifti_array *array)
{
    region *r = user;
    (void)ctx, (void)name;
    if (r->array.line != 0 || (!is_float(array) && array->type != LOXO_GIFTI_INT32) || array->n_columns != 1 ||
        strcmp(array->intent, "POINTSET") == 0)
        return 0;
    r->array = *array;
    return 1;
}

static void take_region(void *user, const loxo_gifti_array *array) { ((region *)user)->array = *array; }

/* Blanks around a label's name are the XML's, not its own. */
static void take_label(void *user, int64_t key, const char *label)
{
    region *r = user;
    size_t n = strlen(label);
    while (loxo_is_space(*label)) {
        ++label;
        --n;
    }
    while (n > 0 && loxo_is_space(label[n - 1]))
        --n;
    if (r->is_known || r->key == NULL || strlen(r->key) != n || memcmp(r->key, label, n) != 0) return;
    r->number = (double)key;
    r->is_known = true;
}

static double number_of(const loxo_gifti_array *array, int64_t i)
{
    if (array->type == LOXO_GIFTI_FLOAT64) return loxo_load_double(array->bytes + 8 * i, array->swap);
    if (array->type == LOXO_GIFTI_FLOAT32) return (double)loxo_load_float(array->bytes + 4 * i, array->swap);
    return (double)(int32_t)loxo_load_u32(array->bytes + 4 * i, array->swap);
}

static loxo_status list_region(loxo_context *ctx, const char *name, const region *r, int64_t n_vertices,
                               loxo_index **vertex, int64_t *n)
{
    const loxo_gifti_array *array = &r->array;
    const loxo_place place = {.file = name, .line = array->line, .byte = -1, .element = -1};
    if (array->line == 0)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "GIFTI without an array of one number a vertex");
    if (array->n_rows != n_vertices)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place,
                            "DataArray: %" PRId64 " values for %" PRId64 " vertices of the mesh", array->n_rows,
                            n_vertices);
    if (r->key != NULL && !r->is_known)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.file = name, .byte = -1, .element = -1},
                            "there is no label called '%.60s'", r->key);
    loxo_index *list = loxo_allocate(ctx, n_vertices, sizeof *list);
    int64_t n_found = 0;
    if (list == NULL) return LOXO_ERR_MEMORY;
    for (int64_t v = 0; v < n_vertices; ++v) {
        const double number = number_of(array, v);
        if (r->key != NULL ? number == r->number : number < 0.0 || number > 0.0) list[n_found++] = (loxo_index)v;
    }
    *vertex = list;
    *n = n_found;
    return LOXO_OK;
}

loxo_status loxo_read_gifti_region(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                   const char *key, int64_t n_vertices, loxo_index **vertex, int64_t *n)
{
    region r = {.key = key};
    *vertex = NULL;
    *n = 0;
    if (key != NULL) {
        const char *at = key, *end = key + strlen(key);
        r.is_known = loxo_scan_double(&at, end, &r.number) == LOXO_SCAN_OK && at == end;
    }
    loxo_status status = loxo_gifti_parse(ctx, bytes, n_bytes, name, want_region, take_region, take_label, &r);
    if (status >= 0) status = list_region(ctx, name, &r, n_vertices, vertex, n);
    loxo_release(ctx, r.array.bytes);
    return status;
}
