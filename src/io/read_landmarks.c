/* SPDX-License-Identifier: MIT
 * Landmarks: which reader, and those of text. */
#include "base/allocate.h"
#include "base/context.h"
#include "io/landmarks.h"
#include "io/source.h"
#include "io/text.h"

#include <loxo/io.h>

#include <inttypes.h>
#include <math.h>
#include <string.h>

#define STOP_ROWS 65536 /* between two looks at the monitor */
#define MAX_CELLS 8

/* ---- putting them together ----------------------------------------------------------------------------------- */

/* Room for one more than n items: blocks are doubled when n is a power of two, so that no capacity need be kept. */
static bool grow(loxo_context *ctx, void **block, int64_t n, size_t size)
{
    if (*block != NULL && (n & (n - 1)) != 0) return true;
    void *larger = loxo_reallocate(ctx, *block, n == 0 ? 1 : 2 * n, size);
    if (larger == NULL) return false;
    *block = larger;
    return true;
}

loxo_status loxo_landmarks_add_curve(loxo_context *ctx, loxo_landmarks *landmarks, const char *name, size_t n_name,
                                     bool is_closed)
{
    loxo_landmarks *l = landmarks;
    const int64_t n = l->n_curves;
    void *names = l->name, *closed = l->is_closed, *begins = l->curve_begin;
    const bool has_room = grow(ctx, &names, n, sizeof *l->name) && grow(ctx, &closed, n, sizeof *l->is_closed) &&
                          grow(ctx, &begins, n + 1, sizeof *l->curve_begin);
    l->name = names;
    l->is_closed = closed;
    l->curve_begin = begins;
    if (!has_room) return LOXO_ERR_MEMORY;
    if (n_name > sizeof *l->name - 1) n_name = sizeof *l->name - 1;
    memset(l->name[n], 0, sizeof *l->name);
    memcpy(l->name[n], name, n_name);
    l->is_closed[n] = is_closed;
    l->curve_begin[0] = 0;
    l->curve_begin[n + 1] = l->n_points;
    l->n_curves = n + 1;
    return LOXO_OK;
}

loxo_status loxo_landmarks_add_point(loxo_context *ctx, loxo_landmarks *landmarks, const loxo_surface_point *point,
                                     const double *position)
{
    loxo_landmarks *l = landmarks;
    const int64_t n = l->n_points;
    void *points = l->point, *positions = l->position;
    const bool has_room = grow(ctx, &points, n, sizeof *l->point) && grow(ctx, &positions, n, sizeof *l->position);
    l->point = points;
    l->position = positions;
    if (!has_room) return LOXO_ERR_MEMORY;
    l->point[n] = *point;
    for (int k = 0; k < 3; ++k)
        l->position[n][k] = position != NULL ? position[k] : 0.0;
    l->n_points = n + 1;
    l->curve_begin[l->n_curves] = l->n_points;
    return LOXO_OK;
}

bool loxo_landmark_normalise(double weight[3])
{
    const double sum = weight[0] + weight[1] + weight[2];
    if (!(weight[0] >= 0.0 && weight[1] >= 0.0 && weight[2] >= 0.0 && sum > 0.0 && isfinite(sum))) return false;
    for (int k = 0; k < 3; ++k)
        weight[k] /= sum;
    return true;
}

/* ---- lines of text ------------------------------------------------------------------------------------------- */

typedef struct cell {
    const char *begin, *end;
} cell;

typedef struct reading {
    loxo_context *ctx;
    loxo_text text;
    int64_t n_vertices, line;
    int n_columns; /* 0: no line yet */
    loxo_landmarks *landmarks;
    int64_t first_curve, first_point; /* of this file */
} reading;

static bool is_comma(char c) { return c == ',' || c == ';'; }

/* Cells of a line without the blanks around them; more than MAX_CELLS are counted only. */
static int cut(const char *p, const char *end, cell *cells)
{
    int n = 0;
    for (;; ++n) {
        const char *stop = p;
        while (stop < end && !is_comma(*stop))
            ++stop;
        if (n < MAX_CELLS) {
            cell *c = &cells[n];
            *c = (cell){p, stop};
            while (c->begin < c->end && loxo_is_space(*c->begin))
                ++c->begin;
            while (c->end > c->begin && loxo_is_space(c->end[-1]))
                --c->end;
        }
        if (stop == end) return n + 1;
        p = stop + 1;
    }
}

static loxo_status fail_row(const reading *r, loxo_status status, const cell *c, const char *what)
{
    const loxo_place place = {
        .file = r->text.name, .line = r->line, .byte = -1, .element = r->landmarks->n_points - r->first_point};
    const int n = c->end - c->begin < 40 ? (int)(c->end - c->begin) : 40;
    if (memchr(c->begin, 0, (size_t)(c->end - c->begin)) != NULL)
        return loxo_fail_at(r->ctx, LOXO_ERR_MALFORMED, place, "a NUL byte in text (UTF-16, or a binary file?)");
    return loxo_fail_at(r->ctx, status, place, "\"%.*s\" %s", n, c->begin, what);
}

static loxo_status read_vertex(const reading *r, const cell *c, loxo_index *vertex)
{
    const char *p = c->begin;
    int64_t number = 0;
    const loxo_scan scan = loxo_scan_int64(&p, c->end, &number);
    if (scan == LOXO_SCAN_BAD || p != c->end) return fail_row(r, LOXO_ERR_MALFORMED, c, "is not a vertex number");
    if (scan == LOXO_SCAN_OVERFLOW || number < 0 || number >= r->n_vertices)
        return fail_row(r, LOXO_ERR_MALFORMED, c, "is no vertex of the mesh");
    *vertex = (loxo_index)number;
    return LOXO_OK;
}

static loxo_status read_number(const reading *r, const cell *c, double *number)
{
    const char *p = c->begin;
    const loxo_scan scan = loxo_scan_double(&p, c->end, number);
    if (scan != LOXO_SCAN_OK || p != c->end) return fail_row(r, LOXO_ERR_MALFORMED, c, "is not a finite number");
    return LOXO_OK;
}

static bool is_same_name(const reading *r, const cell *c)
{
    const loxo_landmarks *l = r->landmarks;
    const size_t n =
        (size_t)(c->end - c->begin) < sizeof *l->name - 1 ? (size_t)(c->end - c->begin) : sizeof *l->name - 1;
    if (l->n_curves == r->first_curve) return false;
    const char *last = l->name[l->n_curves - 1];
    return strlen(last) == n && memcmp(last, c->begin, n) == 0;
}

static loxo_status read_row(reading *r, const cell *cells)
{
    loxo_surface_point point = {.vertex = {-1, -1, -1}};
    double position[3];
    const bool has_position = r->n_columns == 4;
    loxo_status status = LOXO_OK;
    if (cells[0].begin == cells[0].end) return fail_row(r, LOXO_ERR_MALFORMED, &cells[0], "is no name");
    if (memchr(cells[0].begin, 0, (size_t)(cells[0].end - cells[0].begin)) != NULL)
        return fail_row(r, LOXO_ERR_MALFORMED, &cells[0], "");
    if (r->n_columns == 2) {
        status = read_vertex(r, &cells[1], &point.vertex[0]);
        point.weight[0] = 1.0;
    }
    for (int k = 0; k < 3 && r->n_columns > 2 && status >= 0; ++k) {
        status = has_position ? read_number(r, &cells[1 + k], &position[k])
                              : read_vertex(r, &cells[1 + k], &point.vertex[k]);
        if (status >= 0 && !has_position) status = read_number(r, &cells[4 + k], &point.weight[k]);
    }
    if (status < 0) return status;
    if (r->n_columns == 7 && !loxo_landmark_normalise(point.weight))
        return fail_row(r, LOXO_ERR_MALFORMED, &cells[0], "has weights that are negative or all 0");
    if (!is_same_name(r, &cells[0]))
        status = loxo_landmarks_add_curve(r->ctx, r->landmarks, cells[0].begin, (size_t)(cells[0].end - cells[0].begin),
                                          false);
    return status < 0 ? status : loxo_landmarks_add_point(r->ctx, r->landmarks, &point, has_position ? position : NULL);
}

/* The first line decides how many columns there are, and may be a header. */
static loxo_status take_line(reading *r, const char *p, const char *end)
{
    cell cells[MAX_CELLS];
    const int n = cut(p, end, cells);
    const loxo_place place = {
        .file = r->text.name, .line = r->line, .byte = -1, .element = r->landmarks->n_points - r->first_point};
    if (r->n_columns == 0) {
        if (n != 2 && n != 4 && n != 7)
            return loxo_fail_at(
                r->ctx, LOXO_ERR_MALFORMED, place,
                "%d columns; a landmark has 2 (name, vertex), 4 (name, x, y, z) or 7 (name, three vertices, "
                "three weights)",
                n);
        r->n_columns = n;
        const bool is_number_like = cells[1].begin == cells[1].end || loxo_is_digit(*cells[1].begin) ||
                                    memchr("+-.", *cells[1].begin, 3) != NULL;
        if (!is_number_like) return LOXO_OK;
    }
    if (n != r->n_columns)
        return loxo_fail_at(r->ctx, LOXO_ERR_MALFORMED, place, "%d columns where the lines before have %d", n,
                            r->n_columns);
    return read_row(r, cells);
}

static bool is_same_point(const loxo_landmarks *l, int64_t i, int64_t j)
{
    const loxo_surface_point *a = &l->point[i], *b = &l->point[j];
    bool is_same = true;
    for (int k = 0; k < 3; ++k)
        is_same = is_same && a->vertex[k] == b->vertex[k] && a->weight[k] == b->weight[k] &&
                  l->position[i][k] == l->position[j][k];
    return is_same;
}

/* Curves whose last point is their first lose it. */
static void close_curves(loxo_landmarks *l, int64_t first_curve)
{
    int64_t n_kept = l->curve_begin[first_curve];
    for (int64_t c = first_curve; c < l->n_curves; ++c) {
        const int64_t begin = l->curve_begin[c], end = l->curve_begin[c + 1];
        l->is_closed[c] = end - begin > 3 && is_same_point(l, begin, end - 1);
        const int64_t n = end - begin - l->is_closed[c];
        memmove(&l->point[n_kept], &l->point[begin], (size_t)n * sizeof *l->point);
        memmove(&l->position[n_kept], &l->position[begin], (size_t)n * sizeof *l->position);
        l->curve_begin[c] = n_kept;
        n_kept += n;
    }
    l->curve_begin[l->n_curves] = l->n_points = n_kept;
}

loxo_status loxo_read_landmark_rows(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                    int64_t n_vertices, loxo_landmarks *landmarks)
{
    reading r = {.ctx = ctx,
                 .text = loxo_text_of(bytes, n_bytes, name),
                 .n_vertices = n_vertices,
                 .landmarks = landmarks,
                 .first_curve = landmarks->n_curves,
                 .first_point = landmarks->n_points};
    const loxo_place place = {.file = name, .byte = -1, .element = -1};
    loxo_status status = LOXO_OK;
    if (n_bytes >= 2 && ((bytes[0] == 0xff && bytes[1] == 0xfe) || (bytes[0] == 0xfe && bytes[1] == 0xff)))
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "text in UTF-16: save it as UTF-8");
    for (const char *at = r.text.begin; at < r.text.end && status >= 0;) {
        const char *next = loxo_text_next_line(&r.text, at), *p = at, *end = next;
        ++r.line;
        while (p < end && loxo_is_space(*p))
            ++p;
        while (end > p && loxo_is_space(end[-1]))
            --end;
        at = next;
        if (p < end && *p != '#') status = take_line(&r, p, end);
        if (status >= 0 && r.line % STOP_ROWS == 0 &&
            loxo_stop_wanted(ctx, "read", (double)(at - r.text.begin) / (double)n_bytes))
            status = loxo_fail_at(ctx, LOXO_ERR_STOPPED, place, "stopped while reading");
    }
    if (status >= 0 && landmarks->n_curves > r.first_curve) close_curves(landmarks, r.first_curve);
    return status;
}

/* ---- which reader -------------------------------------------------------------------------------------------- */

static bool begins_with(const char *p, const char *end, const char *word)
{
    const size_t n = strlen(word);
    return (size_t)(end - p) >= n && memcmp(p, word, n) == 0;
}

loxo_status loxo_read_landmarks_bytes(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                      int64_t n_vertices, loxo_landmarks *landmarks)
{
    const loxo_text text = loxo_text_of(bytes, n_bytes, name);
    const loxo_place place = {.file = name, .byte = n_bytes == 0 ? 0 : -1, .element = -1};
    const int64_t n_curves = landmarks->n_curves, n_points = landmarks->n_points;
    const size_t n_name = strlen(name);
    const bool is_border = begins_with(text.begin, text.end, "<?xml") ||
                           begins_with(text.begin, text.end, "<BorderFile") ||
                           (n_name >= 7 && strcmp(name + n_name - 7, ".border") == 0);
    if (n_bytes == 0) return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "empty file");
    loxo_status status =
        (is_border ? loxo_read_border : loxo_read_landmark_rows)(ctx, bytes, n_bytes, name, n_vertices, landmarks);
    if (status >= 0 && landmarks->n_curves == n_curves)
        status = loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "no landmark in it");
    if (status >= 0) return status;
    landmarks->n_curves = n_curves;
    landmarks->n_points = n_points;
    if (n_curves == 0)
        loxo_landmarks_destroy(ctx, landmarks);
    else
        landmarks->curve_begin[n_curves] = n_points;
    return status;
}

loxo_status loxo_read_landmarks(loxo_context *ctx, const char *path, int64_t n_vertices, loxo_landmarks *landmarks)
{
    uint8_t *bytes = NULL;
    size_t n_bytes = 0;
    if (ctx == NULL || path == NULL || landmarks == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "reading landmarks needs a path and a place for them");
    loxo_progress_begin(ctx);
    loxo_status status = loxo_source_whole(ctx, path, &bytes, &n_bytes);
    if (status >= 0) status = loxo_read_landmarks_bytes(ctx, bytes, n_bytes, path, n_vertices, landmarks);
    loxo_release(ctx, bytes);
    if (status < 0) loxo_failure_set_file(ctx, path);
    return status;
}
