/* SPDX-License-Identifier: MIT
 * What the first bytes of a file tell of the surface in it. */
#ifndef LOXO_IO_COUNTS_H
#define LOXO_IO_COUNTS_H

#include "io/flow.h"

typedef struct loxo_head {
    int64_t n_vertices, n_faces; /* -1: not told; n_faces: triangles, where larger polygons are not told at least */
    int n_fields;
    bool is_float;
    bool is_text;          /* one row a line */
    char comment;          /* starts a comment in text, 0: nothing does */
    int64_t n_rows_before; /* lines of text before the first face, -1 when faces do not begin with their length */
    size_t n_bytes;        /* of the header */
    size_t n_loaded;       /* bytes of the file that reading has in memory at once; 0: all */
} loxo_head;

/* One a format. bytes: the first n of the file, LOXO_SOURCE_HEAD or all; n_total: of the file, -1 when not known. */
loxo_status loxo_off_head(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_head *head);
loxo_status loxo_freesurfer_head(loxo_context *ctx, const uint8_t *bytes, size_t n, int64_t n_total, const char *name,
                                 loxo_head *head);
/* Passes over the file to where its second array begins; bytes are what was taken from the flow already. */
loxo_status loxo_gifti_head(loxo_flow *flow, const uint8_t *bytes, size_t n, loxo_head *head);

#endif
