/* SPDX-License-Identifier: MIT
 * Positions and triangles that lie in memory as bare numbers of either byte order, with or without a file around them. */
#ifndef LOXO_IO_RAW_H
#define LOXO_IO_RAW_H

#include <loxo/mesh.h>

typedef struct loxo_raw {
    const uint8_t *bytes; /* [n_rows][3] numbers, or [3][n_rows] */
    int64_t n_rows;
    bool swap; /* not of the host's byte order */
    bool is_column_major;
    int64_t byte; /* offset of bytes in the file, -1 when they were coded there; for messages */
    int64_t line; /* 0 when unknown */
} loxo_raw;

/* float, or double when is_double, into a soup without vertices. */
loxo_status loxo_raw_positions(loxo_context *ctx, const char *name, const loxo_raw *raw, bool is_double,
                               loxo_soup *soup);
/* 32-bit ids, each of them checked, into a soup that has its vertices. */
loxo_status loxo_raw_triangles(loxo_context *ctx, const char *name, const loxo_raw *raw, loxo_soup *soup);
/* After both: the positions must be finite where a face uses them. */
loxo_status loxo_raw_finish(loxo_context *ctx, const char *name, const loxo_raw *positions, bool is_double,
                            const loxo_soup *soup);

#endif
