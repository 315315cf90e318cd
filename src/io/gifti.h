/* SPDX-License-Identifier: MIT
 * The arrays of a GIFTI file, decoded. The XML is read as io/xml.h promises. */
#ifndef LOXO_IO_GIFTI_H
#define LOXO_IO_GIFTI_H

#include "io/flow.h"

#include <loxo/mesh.h>

typedef enum loxo_gifti_type {
    LOXO_GIFTI_OTHER, /* a type that no caller takes */
    LOXO_GIFTI_FLOAT32,
    LOXO_GIFTI_FLOAT64,
    LOXO_GIFTI_INT32,
} loxo_gifti_type;

typedef enum loxo_gifti_encoding { LOXO_GIFTI_ASCII, LOXO_GIFTI_BASE64, LOXO_GIFTI_GZIP } loxo_gifti_encoding;

typedef struct loxo_gifti_array {
    char intent[64]; /* as it stands there, behind NIFTI_INTENT_ */
    char name[64];   /* of its metadata; "" when it has none */
    loxo_gifti_type type;
    loxo_gifti_encoding encoding;
    int64_t n_rows, n_columns;
    bool is_column_major, swap;
    int64_t line;   /* where it begins */
    uint8_t *bytes; /* n_rows * n_columns numbers */
} loxo_gifti_array;

/* Says, before its data is taken in, whether an array is wanted; the others are skipped. Negative: refused, the failure
 * is set; 0: skipped; 1: taken. */
typedef int (*loxo_gifti_want_fn)(void *user, loxo_context *ctx, const char *name, const loxo_gifti_array *array);
/* Hands over a wanted array; bytes is then the callee's. */
typedef void (*loxo_gifti_take_fn)(void *user, const loxo_gifti_array *array);

/* A row of the table of labels; its name is cut to 63 characters. */
typedef void (*loxo_gifti_label_fn)(void *user, int64_t key, const char *label);

/* take_label may be NULL. */
loxo_status loxo_gifti_parse(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name,
                             loxo_gifti_want_fn want, loxo_gifti_take_fn take, loxo_gifti_label_fn take_label,
                             void *user);

/* The same from a flow, of which the first n bytes were taken already, up to where is_enough says so: data that nobody
 * wants is passed over, and memory does not grow with the file. */
typedef bool (*loxo_gifti_enough_fn)(const void *user);
loxo_status loxo_gifti_parse_flow(loxo_flow *flow, const uint8_t *bytes, size_t n, loxo_gifti_want_fn want,
                                  loxo_gifti_enough_fn is_enough, void *user);

/* The first array of one column of floats that is no pointset, as doubles [*n]. */
loxo_status loxo_read_gifti_field(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                  double **value, int64_t *n);

#endif
