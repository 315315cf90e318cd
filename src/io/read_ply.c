/* SPDX-License-Identifier: MIT
 * PLY. Text goes to table.c. Of binary files whose rows are of one size -- vertices nearly always, faces when all are
 * triangles -- blocks are read straight from the file by all threads and put in place; else the rest of the file comes
 * into memory and is walked.
 * source  Turk 1994, The PLY Polygon File Format */
#include "base/allocate.h"
#include "base/context.h"
#include "io/formats.h"
#include "io/ply_bytes.h"
#include "par/range.h"

#include <inttypes.h>

#define BLOCK_BYTES ((int64_t)1 << 18) /* fits the second cache with what is made of it */
#define WAVE_BYTES  ((int64_t)1 << 26) /* between two looks at the monitor */
#define MARK_ROWS   4096

static loxo_status skip_element(loxo_ply_reading *r, const loxo_element *element, int64_t *at)
{
    bool has_list;
    const int64_t row = loxo_ply_row_bytes(r, element, 0, &has_list);
    loxo_status status = loxo_ply_check_room(r, element, *at, row);
    if (status < 0) return status;
    if (!has_list) {
        *at += element->n_rows * row;
        return LOXO_OK;
    }
    if ((status = loxo_ply_load_rest(r, *at)) < 0) return status;
    const uint8_t *p = r->bytes + (*at - r->first);
    for (int64_t i = 0; i < element->n_rows; ++i) {
        p = loxo_ply_walk_row(r, element, i, p, NULL, NULL, &status);
        if (p == NULL) return status;
    }
    *at = r->first + (p - r->bytes);
    return LOXO_OK;
}

/* ---- vertices ------------------------------------------------------------------------------------------------ */

typedef struct vertex_put {
    const loxo_ply_reading *r;
    int64_t row;
} vertex_put;

static void put_vertex_column(void *arg, const loxo_column *column, const uint8_t *p, int64_t n)
{
    const vertex_put *put = arg;
    loxo_soup *soup = put->r->soup;
    if (column->is_list || column->role == LOXO_ROLE_SKIP || n != 1) return;
    const double value = loxo_ply_load_value(p, column->type, put->r->swap);
    const int64_t at = 3 * put->row + (int)column->role - (int)LOXO_ROLE_X;
    if (column->role == LOXO_ROLE_FIELD)
        soup->fields[column->field].value[put->row] = value;
    else if (soup->position_float != NULL)
        soup->position_float[at] = (float)value;
    else
        soup->position[at] = value;
}

/* Rows that are just x, y, z as the soup holds them. */
static bool is_plain(const loxo_ply_reading *r, const loxo_element *element)
{
    const loxo_column *column = &r->table->column[element->first_column];
    const loxo_scalar type = r->table->is_float ? LOXO_FLOAT32 : LOXO_FLOAT64;
    if (r->swap || element->n_columns != 3) return false;
    for (int i = 0; i < 3; ++i) {
        if (column[i].role != (loxo_role)((int)LOXO_ROLE_X + i) || column[i].type != type) return false;
    }
    return true;
}

/* Puts n rows of one size, from `row` on, from p; returns how many have a coordinate that is not finite. */
static int64_t put_vertices(const loxo_ply_reading *r, const loxo_element *element, int64_t row, int64_t n,
                            const uint8_t *p)
{
    int64_t n_nonfinite = 0, offset = 0;
    for (int i = 0; i < element->n_columns; ++i) {
        const loxo_column *column = &r->table->column[element->first_column + i];
        const uint8_t *q = p + offset;
        const int64_t step = r->vertex_row_bytes;
        offset += loxo_scalar_bytes(column->type);
        if (column->role == LOXO_ROLE_SKIP) continue;
        const int64_t axis = (int)column->role - (int)LOXO_ROLE_X;
        if (column->role <= LOXO_ROLE_Z && column->type == LOXO_FLOAT32 && r->soup->position_float != NULL) {
            float *out = &r->soup->position_float[3 * row + axis];
            for (int64_t k = 0; k < n; ++k)
                out[3 * k] = loxo_load_float(q + k * step, r->swap);
        } else if (column->role <= LOXO_ROLE_Z && column->type == LOXO_FLOAT64) {
            double *out = &r->soup->position[3 * row + axis];
            for (int64_t k = 0; k < n; ++k)
                out[3 * k] = loxo_load_double(q + k * step, r->swap);
        } else {
            for (int64_t k = 0; k < n; ++k)
                put_vertex_column(&(vertex_put){r, row + k}, column, q + k * step, 1);
        }
    }
    for (int64_t k = row; k < row + n; ++k)
        n_nonfinite += !loxo_is_finite3(r->soup, k);
    return n_nonfinite;
}

static loxo_status read_vertices_of_one_size(loxo_ply_reading *r, const loxo_element *element, int64_t at)
{
    const int64_t row = r->vertex_row_bytes, n_rows = element->n_rows;
    /* The header has x, y and z. NOLINTNEXTLINE(clang-analyzer-core.DivideZero) */
    const int64_t block_rows = BLOCK_BYTES / row + 1, wave_rows = WAVE_BYTES / row + 1;
    const bool plain = is_plain(r, element);
    unsigned char *target =
        r->soup->position_float != NULL ? (unsigned char *)r->soup->position_float : (unsigned char *)r->soup->position;
    const int max_threads = loxo_threads_for(r->ctx, n_rows, 4.0);
    uint8_t *buffers = NULL;
    bool is_short = false;
    int64_t n_nonfinite = 0;
    if (r->bytes == NULL && !plain) {
        buffers = loxo_allocate(r->ctx, max_threads * block_rows, (size_t)row);
        if (buffers == NULL) return LOXO_ERR_MEMORY;
    }
    for (int64_t begin = 0; begin < n_rows && !is_short; begin += wave_rows) {
        const int64_t n = n_rows - begin < wave_rows ? n_rows - begin : wave_rows;
        const int64_t n_blocks = (n + block_rows - 1) / block_rows;
#pragma omp parallel num_threads(max_threads) reduction(|| : is_short) reduction(+ : n_nonfinite)
        {
            uint8_t *buffer = buffers == NULL ? NULL : buffers + loxo_thread_id() * block_rows * row;
            const loxo_range range = loxo_thread_range(n_blocks);
            for (int64_t b = range.begin; b < range.end; ++b) {
                const int64_t k = begin + b * block_rows;
                const int64_t n_here = begin + n - k < block_rows ? begin + n - k : block_rows;
                uint8_t *into = plain ? target + k * row : buffer;
                const uint8_t *p = loxo_ply_fetch(r, at + k * row, n_here * row, into);
                if (p == NULL) {
                    is_short = true;
                } else if (plain) {
                    if (p != into) memcpy(into, p, (size_t)(n_here * row));
                    for (int64_t i = k; i < k + n_here; ++i)
                        n_nonfinite += !loxo_is_finite3(r->soup, i);
                } else {
                    n_nonfinite += put_vertices(r, element, k, n_here, p);
                }
            }
        }
        if (loxo_stop_wanted(r->ctx, "read", (double)(at + (begin + n) * row) / (double)r->n_bytes)) {
            loxo_release(r->ctx, buffers);
            return loxo_fail(r->ctx, LOXO_ERR_STOPPED, "stopped while reading");
        }
    }
    loxo_release(r->ctx, buffers);
    r->n_nonfinite = n_nonfinite;
    if (is_short)
        return loxo_ply_fail_index(r, &(loxo_byte_fault){.trouble = LOXO_BYTE_SHORT_FILE, .byte = -1, .row = -1},
                                   element->name);
    return LOXO_OK;
}

static loxo_status read_vertices(loxo_ply_reading *r, const loxo_element *element, int64_t *at)
{
    bool has_list;
    const int64_t row = loxo_ply_row_bytes(r, element, 0, &has_list);
    loxo_status status = loxo_ply_check_room(r, element, *at, row);
    if (status < 0) return status;
    if ((status = loxo_table_allocate_vertices(r->ctx, r->table, element->n_rows, r->soup)) < 0) return status;
    r->vertex_at = *at;
    if (!has_list) {
        r->vertex_row_bytes = row;
        *at += element->n_rows * row;
        return element->n_rows == 0 ? LOXO_OK : read_vertices_of_one_size(r, element, r->vertex_at);
    }
    if ((status = loxo_ply_load_rest(r, *at)) < 0) return status;
    const uint8_t *p = r->bytes + (*at - r->first);
    for (int64_t i = 0; i < element->n_rows; ++i) {
        p = loxo_ply_walk_row(r, element, i, p, put_vertex_column, &(vertex_put){r, i}, &status);
        if (p == NULL) return status;
        r->n_nonfinite += !loxo_is_finite3(r->soup, i);
    }
    *at = r->first + (p - r->bytes);
    return LOXO_OK;
}

/* ---- faces, all triangles ------------------------------------------------------------------------------------ */

/* Where the list of corners is in a row when there is no other list. */
typedef struct triangle_rows {
    int64_t row_bytes, length_at, corner_at;
    loxo_scalar length_type, type;
} triangle_rows;

static bool are_triangles_possible(const loxo_ply_reading *r, const loxo_element *element, triangle_rows *rows)
{
    int64_t at = 0;
    int n_lists = 0;
    for (int i = 0; i < element->n_columns; ++i) {
        const loxo_column *column = &r->table->column[element->first_column + i];
        if (column->is_list) {
            ++n_lists;
            rows->length_at = at;
            rows->length_type = column->length_type;
            rows->type = column->type;
            at += loxo_scalar_bytes(column->length_type);
            rows->corner_at = at;
            at += (int64_t)3 * loxo_scalar_bytes(column->type);
        } else {
            at += loxo_scalar_bytes(column->type);
        }
    }
    rows->row_bytes = at;
    return n_lists == 1;
}

/* n rows from p into triangle. false when a row is no triangle. A fault ends it too, with true. */
static bool put_triangles(const loxo_ply_reading *r, const triangle_rows *rows, int64_t face, int64_t n,
                          const uint8_t *p, loxo_byte_fault *fault)
{
    loxo_index *out = &r->soup->triangle[3 * face];
    const int64_t n_vertices = r->table->n_vertices, n_corner = loxo_scalar_bytes(rows->type);
    const bool is_byte_length = loxo_scalar_bytes(rows->length_type) == 1;
    const bool is_32 = n_corner == 4 && n_vertices <= LOXO_INDEX_MAX;
    for (int64_t k = 0; k < n; ++k, p += rows->row_bytes, out += 3) {
        const uint8_t *q = p + rows->corner_at;
        if (is_byte_length ? p[rows->length_at] != 3
                           : loxo_ply_load_integer(p + rows->length_at, rows->length_type, r->swap) != 3)
            return false;
        if (is_32) {
            /* A negative int is a large unsigned. */
            const uint32_t a = loxo_load_u32(q, r->swap), b = loxo_load_u32(q + 4, r->swap),
                           c = loxo_load_u32(q + 8, r->swap), limit = (uint32_t)n_vertices;
            out[0] = (loxo_index)a;
            out[1] = (loxo_index)b;
            out[2] = (loxo_index)c;
            if (a < limit && b < limit && c < limit) continue;
        }
        for (int i = 0; i < 3; ++i) {
            const int64_t index = loxo_ply_load_integer(q + i * n_corner, rows->type, r->swap);
            out[i] = (loxo_index)index;
            if (index >= 0 && index < n_vertices) continue;
            *fault = (loxo_byte_fault){LOXO_BYTE_INDEX, face + k, (q + i * n_corner) - p, index};
            return true;
        }
    }
    return true;
}

/* Reads faces as if all were triangles; *done false when one is not. */
static loxo_status read_triangles(loxo_ply_reading *r, const loxo_element *element, const triangle_rows *rows,
                                  int64_t at, bool *done)
{
    const int64_t row = rows->row_bytes, n_rows = element->n_rows;
    const int64_t block_rows = BLOCK_BYTES / row + 1, wave_rows = WAVE_BYTES / row + 1;
    const int max_threads = loxo_threads_for(r->ctx, n_rows, 3.0);
    uint8_t *buffers = NULL;
    loxo_byte_fault first = {.row = INT64_MAX};
    bool is_other = false;
    loxo_status status = loxo_soup_allocate_triangles(r->ctx, r->soup, n_rows);
    if (status < 0) return status;
    if (r->bytes == NULL) {
        buffers = loxo_allocate(r->ctx, max_threads * block_rows, (size_t)row);
        if (buffers == NULL) return LOXO_ERR_MEMORY;
    }
    for (int64_t begin = 0; begin < n_rows && !is_other && first.trouble == LOXO_BYTE_GOOD; begin += wave_rows) {
        const int64_t n = n_rows - begin < wave_rows ? n_rows - begin : wave_rows;
        const int64_t n_blocks = (n + block_rows - 1) / block_rows;
#pragma omp parallel num_threads(max_threads) reduction(|| : is_other)
        {
            uint8_t *buffer = buffers == NULL ? NULL : buffers + loxo_thread_id() * block_rows * row;
            const loxo_range range = loxo_thread_range(n_blocks);
            loxo_byte_fault fault = {LOXO_BYTE_GOOD, 0, 0, 0};
            for (int64_t b = range.begin; b < range.end && !is_other && fault.trouble == LOXO_BYTE_GOOD; ++b) {
                const int64_t k = begin + b * block_rows;
                const int64_t n_here = begin + n - k < block_rows ? begin + n - k : block_rows;
                const uint8_t *p = loxo_ply_fetch(r, at + k * row, n_here * row, buffer);
                if (p == NULL)
                    fault = (loxo_byte_fault){LOXO_BYTE_SHORT_FILE, k, -1, 0};
                else
                    is_other = !put_triangles(r, rows, k, n_here, p, &fault);
            }
#pragma omp critical(loxo_ply_fault)
            if (fault.trouble != LOXO_BYTE_GOOD && fault.row < first.row) first = fault;
        }
        if (loxo_stop_wanted(r->ctx, "read", (double)(at + (begin + n) * row) / (double)r->n_bytes)) {
            loxo_release(r->ctx, buffers);
            return loxo_fail(r->ctx, LOXO_ERR_STOPPED, "stopped while reading");
        }
    }
    loxo_release(r->ctx, buffers);
    *done = !is_other;
    if (is_other || first.trouble == LOXO_BYTE_GOOD) return LOXO_OK;
    if (first.trouble == LOXO_BYTE_INDEX) first.byte += at + first.row * row;
    return loxo_ply_fail_index(r, &first, "face");
}

/* ---- faces of any kind, and strips --------------------------------------------------------------------------- */

/* Faces in memory, with every MARK_ROWS-th row's place. */
typedef struct polygons {
    const loxo_element *element;
    int64_t n_marks;
    const uint8_t **mark;
    int64_t *mark_triangle; /* triangles before it */
    loxo_face_tally tally;
} polygons;

typedef struct corners {
    const uint8_t *p;
    int64_t n;
    const loxo_column *column;
} corners;

static void note_corners(void *arg, const loxo_column *column, const uint8_t *p, int64_t n)
{
    if (column->role == LOXO_ROLE_CORNERS) *(corners *)arg = (corners){p, n, column};
}

static loxo_status walk_faces(loxo_ply_reading *r, polygons *faces, int64_t *at)
{
    bool has_list;
    const loxo_element *element = faces->element;
    loxo_status status = loxo_ply_check_room(r, element, *at, loxo_ply_row_bytes(r, element, 0, &has_list));
    if (status < 0) return status;
    if ((status = loxo_ply_load_rest(r, *at)) < 0) return status;
    faces->n_marks = (element->n_rows + MARK_ROWS - 1) / MARK_ROWS;
    faces->mark = loxo_allocate(r->ctx, faces->n_marks, sizeof *faces->mark);
    faces->mark_triangle = loxo_allocate(r->ctx, faces->n_marks, sizeof *faces->mark_triangle);
    if (faces->mark == NULL || faces->mark_triangle == NULL) return LOXO_ERR_MEMORY;
    const uint8_t *p = r->bytes + (*at - r->first);
    for (int64_t i = 0; i < element->n_rows; ++i) {
        corners found = {NULL, 0, NULL};
        if (i % MARK_ROWS == 0) {
            faces->mark[i / MARK_ROWS] = p;
            faces->mark_triangle[i / MARK_ROWS] = faces->tally.n_triangles;
        }
        p = loxo_ply_walk_row(r, element, i, p, note_corners, &found, &status);
        if (p == NULL) return status;
        loxo_face_count(&faces->tally, i, found.n);
    }
    *at = r->first + (p - r->bytes);
    return LOXO_OK;
}

static bool load_corners(const loxo_ply_reading *r, const corners *found, int64_t face, loxo_index *corner,
                         loxo_byte_fault *fault)
{
    const int64_t step = loxo_scalar_bytes(found->column->type);
    for (int64_t i = 0; i < found->n; ++i) {
        const uint8_t *p = found->p + i * step;
        const int64_t index = loxo_ply_load_integer(p, found->column->type, r->swap);
        if (index < 0 || index >= r->table->n_vertices) {
            *fault = (loxo_byte_fault){LOXO_BYTE_INDEX, face, r->first + (p - r->bytes), index};
            return false;
        }
        corner[i] = (loxo_index)index;
    }
    return true;
}

/* The rows behind one mark; the walk was good before, so it cannot fail now. */
static void put_polygons(const loxo_ply_reading *r, const polygons *faces, int64_t mark, loxo_index *corner, void *room,
                         loxo_face_tally *tally, loxo_byte_fault *fault)
{
    const int64_t begin = mark * MARK_ROWS, n_rows = faces->element->n_rows;
    const int64_t end = n_rows - begin < MARK_ROWS ? n_rows : begin + MARK_ROWS;
    loxo_index *triangle = &r->soup->triangle[3 * faces->mark_triangle[mark]];
    const uint8_t *p = faces->mark[mark];
    loxo_status status = LOXO_OK;
    for (int64_t i = begin; i < end; ++i) {
        corners found = {NULL, 0, NULL};
        p = loxo_ply_walk_row(r, faces->element, i, p, note_corners, &found, &status);
        if (!load_corners(r, &found, i, corner, fault)) return;
        if (found.n < 3) continue;
        if (!loxo_polygon_triangulate(r->soup, corner, found.n, room, triangle) && tally->n_doubtful++ == 0)
            tally->first_doubtful = i;
        triangle += 3 * loxo_face_n_triangles(found.n);
    }
}

static loxo_status read_polygons(loxo_ply_reading *r, polygons *faces)
{
    const size_t n_corner = ((size_t)faces->tally.max_corners * sizeof(loxo_index) + 63) / 64 * 64;
    const size_t n_room = n_corner + (loxo_polygon_room_bytes(faces->tally.max_corners) + 63) / 64 * 64;
    const int max_threads = n_room > (size_t)1 << 22 ? 1 : loxo_threads_for(r->ctx, faces->element->n_rows, 20.0);
    loxo_byte_fault first = {.row = INT64_MAX};
    loxo_face_tally doubtful = {.first_doubtful = INT64_MAX};
    uint8_t *rooms = loxo_allocate(r->ctx, max_threads, n_room);
    if (rooms == NULL) return LOXO_ERR_MEMORY;
#pragma omp parallel num_threads(max_threads)
    {
        uint8_t *room = rooms + (size_t)loxo_thread_id() * n_room;
        const loxo_range range = loxo_thread_range(faces->n_marks);
        loxo_byte_fault fault = {LOXO_BYTE_GOOD, 0, 0, 0};
        loxo_face_tally tally = {0};
        for (int64_t m = range.begin; m < range.end && fault.trouble == LOXO_BYTE_GOOD; ++m)
            put_polygons(r, faces, m, (loxo_index *)(void *)room, room + n_corner, &tally, &fault);
#pragma omp critical(loxo_ply_fault)
        {
            if (fault.trouble != LOXO_BYTE_GOOD && fault.row < first.row) first = fault;
            doubtful.n_doubtful += tally.n_doubtful;
            if (tally.n_doubtful > 0 && tally.first_doubtful < doubtful.first_doubtful)
                doubtful.first_doubtful = tally.first_doubtful;
        }
    }
    loxo_release(r->ctx, rooms);
    loxo_face_tally_add(&faces->tally, &doubtful);
    return first.trouble == LOXO_BYTE_GOOD ? LOXO_OK : loxo_ply_fail_index(r, &first, "face");
}

/* Strips are few and long: one thread. triangle NULL counts. */
static loxo_status read_strips(loxo_ply_reading *r, const loxo_element *element, int64_t *at, loxo_index *triangle,
                               int64_t *n)
{
    bool has_list;
    loxo_status status = loxo_ply_check_room(r, element, *at, loxo_ply_row_bytes(r, element, 0, &has_list));
    if (status < 0) return status;
    if ((status = loxo_ply_load_rest(r, *at)) < 0) return status;
    const uint8_t *p = r->bytes + (*at - r->first);
    *n = 0;
    for (int64_t i = 0; i < element->n_rows; ++i) {
        corners found = {NULL, 0, NULL};
        loxo_strip strip = {0};
        p = loxo_ply_walk_row(r, element, i, p, note_corners, &found, &status);
        if (p == NULL) return status;
        for (int64_t k = 0; k < found.n; ++k) {
            const uint8_t *q = found.p + k * loxo_scalar_bytes(found.column->type);
            const int64_t index = loxo_ply_load_integer(q, found.column->type, r->swap);
            loxo_index made[3];
            if (index < -1 || index >= r->table->n_vertices)
                return loxo_ply_fail_index(r, &(loxo_byte_fault){LOXO_BYTE_INDEX, i, r->first + (q - r->bytes), index},
                                           "strip");
            if (!loxo_strip_next(&strip, (loxo_index)index, made)) continue;
            if (triangle != NULL) memcpy(&triangle[3 * *n], made, sizeof made);
            ++*n;
        }
    }
    *at = r->first + (p - r->bytes);
    return LOXO_OK;
}

/* ---- the whole ----------------------------------------------------------------------------------------------- */

static loxo_status finish(loxo_ply_reading *r, const loxo_face_tally *tally, int64_t at)
{
    const int64_t bad = r->n_nonfinite == 0 ? -1 : loxo_soup_first_used_nonfinite(r->ctx, r->soup);
    if (bad >= 0)
        return loxo_fail_nonfinite(
            r->ctx,
            (loxo_place){.file = r->name,
                         .byte = r->vertex_row_bytes == 0 ? -1 : r->vertex_at + bad * r->vertex_row_bytes},
            r->soup, bad);
    if (at < r->n_bytes)
        loxo_warn(r->ctx, "trailing", r->n_bytes - at, "%s: %" PRId64 " bytes behind the last row are ignored", r->name,
                  r->n_bytes - at);
    loxo_face_tally_warn(r->ctx, r->name, tally);
    loxo_soup_warn(r->ctx, r->name, r->soup, r->n_nonfinite);
    return LOXO_OK;
}

/* Elements in the file's order; polygons and strips when all are found, since cutting them needs the positions. */
static loxo_status read_elements(loxo_ply_reading *r, int64_t at, polygons *faces)
{
    const loxo_table *table = r->table;
    int64_t strips_at = 0, n_strip = 0;
    triangle_rows rows = {0};
    bool all_triangles = true;
    loxo_status status = LOXO_OK;
    for (int e = 0; e < table->n_elements && status >= 0; ++e) {
        const loxo_element *element = &table->element[e];
        switch (element->kind) {
        case LOXO_ELEMENT_SKIP: status = skip_element(r, element, &at); break;
        case LOXO_ELEMENT_VERTICES: status = read_vertices(r, element, &at); break;
        case LOXO_ELEMENT_FACES:
            faces->element = element;
            all_triangles = element->n_rows == 0;
            if (!all_triangles && are_triangles_possible(r, element, &rows) &&
                element->n_rows <= (r->n_bytes - at) / rows.row_bytes)
                status = read_triangles(r, element, &rows, at, &all_triangles);
            if (status >= 0 && all_triangles)
                at += element->n_rows * rows.row_bytes;
            else if (status >= 0)
                status = walk_faces(r, faces, &at);
            break;
        case LOXO_ELEMENT_STRIPS:
            strips_at = at;
            status = read_strips(r, element, &at, NULL, &n_strip);
            break;
        }
    }
    if (status < 0) return status;

    const int64_t n_face = all_triangles ? r->soup->n_faces : faces->tally.n_triangles;
    if (!all_triangles || n_strip > 0) {
        loxo_index *grown = loxo_reallocate(r->ctx, r->soup->triangle, n_face + n_strip, 3 * sizeof *grown);
        if (grown == NULL) return LOXO_ERR_MEMORY;
        r->soup->triangle = grown;
        r->soup->n_faces = n_face + n_strip;
    }
    if (!all_triangles && (status = read_polygons(r, faces)) < 0) return status;
    if (n_strip > 0) {
        status = read_strips(r, &table->element[table->strips], &strips_at, &r->soup->triangle[3 * n_face], &n_strip);
        if (status < 0) return status;
    }
    return finish(r, &faces->tally, at);
}

static loxo_status read_binary(loxo_context *ctx, const uint8_t *bytes, int64_t n_bytes, loxo_source *source,
                               const char *name, const loxo_ply_header *header, loxo_soup *soup)
{
    loxo_ply_reading r = {.ctx = ctx,
                          .name = name,
                          .table = &header->table,
                          .soup = soup,
                          .swap = header->is_big != LOXO_HOST_IS_BIG,
                          .n_bytes = n_bytes,
                          .bytes = bytes,
                          .source = source};
    polygons faces = {0};
    const loxo_status status = read_elements(&r, (int64_t)header->n_bytes, &faces);
    loxo_release(ctx, faces.mark);
    loxo_release(ctx, faces.mark_triangle);
    loxo_release(ctx, r.owned);
    return status;
}

static loxo_status finish_soup(loxo_context *ctx, loxo_status status, const char *name, loxo_soup *soup)
{
    if (status >= 0) return LOXO_OK;
    loxo_failure_set_file(ctx, name);
    loxo_soup_destroy(ctx, soup);
    return status;
}

loxo_status loxo_read_ply(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup)
{
    const loxo_text text = loxo_text_of(bytes, n, name);
    loxo_ply_header *header = loxo_allocate(ctx, 1, sizeof *header);
    *soup = (loxo_soup){0};
    if (header == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_ply_header_read(ctx, bytes, n < LOXO_SOURCE_HEAD ? n : LOXO_SOURCE_HEAD, name, header);
    if (status >= 0 && header->is_text)
        status = loxo_table_read_text(ctx, &text, (const char *)bytes + header->n_bytes, &header->table, soup);
    else if (status >= 0)
        status = read_binary(ctx, bytes, (int64_t)n, NULL, name, header, soup);
    loxo_release(ctx, header);
    return finish_soup(ctx, status, name, soup);
}

loxo_status loxo_read_ply_source(loxo_context *ctx, loxo_source *source, loxo_soup *soup)
{
    loxo_ply_header *header = loxo_allocate(ctx, 1, sizeof *header);
    uint8_t *bytes = NULL;
    size_t n = 0;
    *soup = (loxo_soup){0};
    if (header == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_ply_header_read(ctx, source->head, source->n_head, source->name, header);
    if (status >= 0 && !header->is_text) {
        status = read_binary(ctx, NULL, source->n_bytes, source, source->name, header, soup);
    } else if (status >= 0 && (status = loxo_source_read(ctx, source, 0, &bytes, &n)) >= 0) {
        const loxo_text text = loxo_text_of(bytes, n, source->name);
        if (header->n_bytes > n)
            status = loxo_fail(ctx, LOXO_ERR_READ, "the file became shorter while it was read");
        else
            status = loxo_table_read_text(ctx, &text, (const char *)bytes + header->n_bytes, &header->table, soup);
        loxo_release(ctx, bytes);
    }
    loxo_release(ctx, header);
    return finish_soup(ctx, status, source->name, soup);
}
