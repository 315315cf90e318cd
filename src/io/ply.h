/* SPDX-License-Identifier: MIT
 * Header of a PLY file. */
#ifndef LOXO_IO_PLY_H
#define LOXO_IO_PLY_H

#include "io/source.h"
#include "io/table.h"

typedef struct loxo_ply_header {
    bool is_text, is_big; /* is_big: big-endian, when it is not text */
    size_t n_bytes;       /* of the header: where the data begin */
    loxo_table table;
} loxo_ply_header;

/* bytes: the first n of the file, enough to hold the header (LOXO_SOURCE_HEAD always are). */
loxo_status loxo_ply_header_read(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name,
                                 loxo_ply_header *header);

/* Reads a regular file that is open, without having it in memory as a whole when it is binary and of triangles. */
loxo_status loxo_read_ply_source(loxo_context *ctx, loxo_source *source, loxo_soup *soup);

#endif
