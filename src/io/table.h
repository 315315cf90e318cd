/* SPDX-License-Identifier: MIT
 * A file as PLY sees it: elements one after the other, each of so many rows, a row of columns that are scalars or lists.
 * OFF fits the same description. The readers of text and of bytes both work from it. */
#ifndef LOXO_IO_TABLE_H
#define LOXO_IO_TABLE_H

#include "io/text.h"

#define LOXO_MAX_ELEMENTS 64
#define LOXO_MAX_COLUMNS  1024
#define LOXO_MAX_FIELDS   16

typedef enum loxo_scalar {
    LOXO_INT8,
    LOXO_UINT8,
    LOXO_INT16,
    LOXO_UINT16,
    LOXO_INT32,
    LOXO_UINT32,
    LOXO_FLOAT32,
    LOXO_FLOAT64,
} loxo_scalar;

static inline int loxo_scalar_bytes(loxo_scalar type)
{
    static const int n[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return n[type];
}

typedef enum loxo_role {
    LOXO_ROLE_SKIP,
    LOXO_ROLE_X, /* X, Y, Z follow each other */
    LOXO_ROLE_Y,
    LOXO_ROLE_Z,
    LOXO_ROLE_FIELD,
    LOXO_ROLE_CORNERS,
} loxo_role;

typedef struct loxo_column {
    char name[64];
    bool is_list;
    loxo_scalar length_type, type; /* length_type: of a list */
    loxo_role role;
    int field; /* of the soup, for LOXO_ROLE_FIELD */
} loxo_column;

typedef enum loxo_element_kind {
    LOXO_ELEMENT_SKIP,
    LOXO_ELEMENT_VERTICES,
    LOXO_ELEMENT_FACES,
    LOXO_ELEMENT_STRIPS,
} loxo_element_kind;

typedef struct loxo_element {
    char name[64];
    loxo_element_kind kind;
    int64_t n_rows;
    int first_column, n_columns;
    int min_extra, max_extra; /* numbers behind the columns that a line of text may have */
} loxo_element;

typedef struct loxo_table {
    int n_elements, n_columns;
    int vertices, faces, strips; /* their elements, -1: none */
    int64_t n_vertices;
    bool is_float; /* positions fit float exactly as the file types them */
    char comment;  /* starts a comment in text, 0: nothing does */
    int n_fields;  /* columns of LOXO_ROLE_FIELD */
    loxo_element element[LOXO_MAX_ELEMENTS];
    loxo_column column[LOXO_MAX_COLUMNS];
} loxo_table;

/* Arrays of the soup for the vertices that will be read; fields get their names. */
loxo_status loxo_table_allocate_vertices(loxo_context *ctx, const loxo_table *table, int64_t n_vertices,
                                         loxo_soup *soup);

/* Reads the rows of all elements from text, one a line, from `from` on; blank lines and comments between them are
 * passed over. Fills the soup; on failure it is left for the caller to destroy. */
loxo_status loxo_table_read_text(loxo_context *ctx, const loxo_text *text, const char *from, const loxo_table *table,
                                 loxo_soup *soup);

#endif
