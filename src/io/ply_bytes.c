/* SPDX-License-Identifier: MIT */
#include "io/ply_bytes.h"

#include "base/allocate.h"
#include "base/context.h"
#include "par/range.h"

#include <inttypes.h>

#define BLOCK_BYTES ((int64_t)1 << 18)

loxo_status loxo_ply_fail_early(const loxo_ply_reading *r, const loxo_element *element, int64_t n_found)
{
    return loxo_fail_at(r->ctx, LOXO_ERR_MALFORMED,
                        (loxo_place){.file = r->name, .byte = r->n_bytes, .element = n_found},
                        "the file ends early: %" PRId64 " rows of \"%s\" declared, %" PRId64 " found", element->n_rows,
                        element->name, n_found);
}

loxo_status loxo_ply_fail_index(const loxo_ply_reading *r, const loxo_byte_fault *fault, const char *noun)
{
    const int64_t n = r->table->n_vertices;
    const loxo_place place = {.file = r->name, .byte = fault->byte, .element = fault->row};
    if (fault->trouble == LOXO_BYTE_SHORT_FILE)
        return loxo_fail_at(r->ctx, LOXO_ERR_READ, place,
                            "the file became shorter while it was read, or cannot be read");
    if (n == 0)
        return loxo_fail_at(r->ctx, LOXO_ERR_MALFORMED, place,
                            "%s %" PRId64 ": vertex index %" PRId64 ", but there are no vertices", noun, fault->row,
                            fault->value);
    return loxo_fail_at(r->ctx, LOXO_ERR_MALFORMED, place,
                        "%s %" PRId64 ": vertex index %" PRId64 " not in 0..%" PRId64, noun, fault->row, fault->value,
                        n - 1);
}

const uint8_t *loxo_ply_fetch(const loxo_ply_reading *r, int64_t at, int64_t n, uint8_t *buffer)
{
    size_t got = 0;
    if (r->bytes != NULL) return r->bytes + (at - r->first);
    if (loxo_os_read_at(NULL, &r->source->file, at, buffer, (size_t)n, &got) < 0 || got < (size_t)n) return NULL;
    return buffer;
}

loxo_status loxo_ply_load_rest(loxo_ply_reading *r, int64_t at)
{
    if (r->bytes != NULL) return LOXO_OK;
    r->owned = loxo_allocate(r->ctx, r->n_bytes - at, 1);
    if (r->owned == NULL) return LOXO_ERR_MEMORY;
    const int64_t n_blocks = (r->n_bytes - at + BLOCK_BYTES - 1) / BLOCK_BYTES;
    bool is_short = false;
#pragma omp parallel num_threads(loxo_threads_for(r->ctx, r->n_bytes - at, 0.2)) reduction(|| : is_short)
    {
        const loxo_range range = loxo_thread_range(n_blocks);
        for (int64_t i = range.begin; i < range.end; ++i) {
            const int64_t from = at + i * BLOCK_BYTES;
            const int64_t n = r->n_bytes - from < BLOCK_BYTES ? r->n_bytes - from : BLOCK_BYTES;
            is_short = is_short || loxo_ply_fetch(r, from, n, r->owned + (from - at)) == NULL;
        }
    }
    if (is_short)
        return loxo_fail_at(r->ctx, LOXO_ERR_READ, (loxo_place){.file = r->name, .byte = -1, .element = -1},
                            "the file became shorter while it was read, or cannot be read");
    r->bytes = r->owned;
    r->first = at;
    return LOXO_OK;
}

int64_t loxo_ply_row_bytes(const loxo_ply_reading *r, const loxo_element *element, int64_t n_list, bool *has_list)
{
    int64_t n = 0;
    *has_list = false;
    for (int i = 0; i < element->n_columns; ++i) {
        const loxo_column *column = &r->table->column[element->first_column + i];
        *has_list = *has_list || column->is_list;
        n += column->is_list ? loxo_scalar_bytes(column->length_type) + n_list * loxo_scalar_bytes(column->type)
                             : loxo_scalar_bytes(column->type);
    }
    return n;
}

loxo_status loxo_ply_check_room(const loxo_ply_reading *r, const loxo_element *element, int64_t at, int64_t row)
{
    size_t n_bytes;
    if (row == 0) return LOXO_OK;
    if (!loxo_mul(&n_bytes, (size_t)element->n_rows, (size_t)row))
        return loxo_fail_at(r->ctx, LOXO_ERR_LIMIT, (loxo_place){.file = r->name, .byte = at, .element = -1},
                            "%" PRId64 " rows of \"%s\" are more than any file holds", element->n_rows, element->name);
    if (element->n_rows > (r->n_bytes - at) / row) return loxo_ply_fail_early(r, element, (r->n_bytes - at) / row);
    return LOXO_OK;
}

const uint8_t *loxo_ply_walk_row(const loxo_ply_reading *r, const loxo_element *element, int64_t row, const uint8_t *p,
                                 loxo_ply_column_fn fn, void *arg, loxo_status *status)
{
    const uint8_t *end = r->bytes + (r->n_bytes - r->first);
    for (int i = 0; i < element->n_columns; ++i) {
        const loxo_column *column = &r->table->column[element->first_column + i];
        const int64_t n_value = loxo_scalar_bytes(column->type);
        const int64_t n_length = column->is_list ? loxo_scalar_bytes(column->length_type) : 0;
        const int64_t byte = r->first + (p - r->bytes);
        int64_t n = 1;
        if (end - p < n_length) {
            *status = loxo_ply_fail_early(r, element, row);
            return NULL;
        }
        if (column->is_list) n = loxo_ply_load_integer(p, column->length_type, r->swap);
        p += n_length;
        if (n < 0 || n > (end - p) / n_value) {
            if (!column->is_list)
                *status = loxo_ply_fail_early(r, element, row);
            else
                *status = loxo_fail_at(r->ctx, LOXO_ERR_MALFORMED,
                                       (loxo_place){.file = r->name, .byte = byte, .element = row},
                                       "%s %" PRId64 ": a list of %" PRId64 " entries, with %td bytes left",
                                       element->name, row, n, end - p);
            return NULL;
        }
        if (fn != NULL) fn(arg, column, p, n);
        p += n * n_value;
    }
    return p;
}
