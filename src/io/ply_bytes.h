/* SPDX-License-Identifier: MIT
 * Binary PLY in the making: where its bytes are, what a row is. */
#ifndef LOXO_IO_PLY_BYTES_H
#define LOXO_IO_PLY_BYTES_H

#include "io/bytes.h"
#include "io/ply.h"

typedef struct loxo_ply_reading {
    loxo_context *ctx;
    const char *name;
    const loxo_table *table;
    loxo_soup *soup;
    bool swap;
    int64_t n_bytes;      /* of the file */
    const uint8_t *bytes; /* bytes[0] is the file's byte `first`; NULL: still only in the file */
    int64_t first;
    uint8_t *owned;                      /* what bytes points to, when it was read here */
    loxo_source *source;                 /* the file, or NULL */
    int64_t vertex_at, vertex_row_bytes; /* for messages; 0: rows differ in size */
    int64_t n_nonfinite;
} loxo_ply_reading;

/* A fault in a row, as threads leave it. */
typedef struct loxo_byte_fault {
    enum { LOXO_BYTE_GOOD, LOXO_BYTE_INDEX, LOXO_BYTE_SHORT_FILE } trouble;
    int64_t row, byte, value;
} loxo_byte_fault;

static inline double loxo_ply_load_value(const uint8_t *p, loxo_scalar type, bool swap)
{
    switch (type) {
    case LOXO_INT8: return (double)(int8_t)p[0];
    case LOXO_UINT8: return (double)p[0];
    case LOXO_INT16: return (double)(int16_t)loxo_load_u16(p, swap);
    case LOXO_UINT16: return (double)loxo_load_u16(p, swap);
    case LOXO_INT32: return (double)(int32_t)loxo_load_u32(p, swap);
    case LOXO_UINT32: return (double)loxo_load_u32(p, swap);
    case LOXO_FLOAT32: return (double)loxo_load_float(p, swap);
    case LOXO_FLOAT64: break;
    }
    return loxo_load_double(p, swap);
}

static inline int64_t loxo_ply_load_integer(const uint8_t *p, loxo_scalar type, bool swap)
{
    switch (type) {
    case LOXO_INT8: return (int8_t)p[0];
    case LOXO_UINT8: return p[0];
    case LOXO_INT16: return (int16_t)loxo_load_u16(p, swap);
    case LOXO_UINT16: return loxo_load_u16(p, swap);
    case LOXO_INT32: return (int32_t)loxo_load_u32(p, swap);
    default: return loxo_load_u32(p, swap);
    }
}

/* What a walk does with a list or scalar. */
typedef void (*loxo_ply_column_fn)(void *arg, const loxo_column *column, const uint8_t *p, int64_t n);

/* n bytes of the file from `at` on: where they lie, or read into buffer. NULL when the file no longer has them. */
const uint8_t *loxo_ply_fetch(const loxo_ply_reading *r, int64_t at, int64_t n, uint8_t *buffer);
/* From `at` on, all of the file into memory. */
loxo_status loxo_ply_load_rest(loxo_ply_reading *r, int64_t at);
/* Bytes of a row when lists are of n_list entries; *has_list says whether there are any. */
int64_t loxo_ply_row_bytes(const loxo_ply_reading *r, const loxo_element *element, int64_t n_list, bool *has_list);
/* Checks that n_rows of at least `row` bytes each can be in what is left. */
loxo_status loxo_ply_check_room(const loxo_ply_reading *r, const loxo_element *element, int64_t at, int64_t row);
/* Over one row in memory, calling fn (unless NULL) for each column; NULL and a failure when the row is cut or a length is
 * negative. */
const uint8_t *loxo_ply_walk_row(const loxo_ply_reading *r, const loxo_element *element, int64_t row, const uint8_t *p,
                                 loxo_ply_column_fn fn, void *arg, loxo_status *status);

loxo_status loxo_ply_fail_early(const loxo_ply_reading *r, const loxo_element *element, int64_t n_found);
loxo_status loxo_ply_fail_index(const loxo_ply_reading *r, const loxo_byte_fault *fault, const char *noun);

#endif
