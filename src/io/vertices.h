/* SPDX-License-Identifier: MIT
 * Vertices that a file names, out of its bytes, one function a format. vertex is from loxo_allocate, numbers are in
 * 0..n_vertices-1 in the order of the file, repeats stay; a failure leaves NULL. The rules are those of formats.h. */
#ifndef LOXO_IO_VERTICES_H
#define LOXO_IO_VERTICES_H

#include <loxo/context.h>

/* Numbers with blanks, commas or lines between them; # begins a comment. */
loxo_status loxo_read_vertex_list(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                  int64_t n_vertices, loxo_index **vertex, int64_t *n);

/* FreeSurfer's text: a line that begins with #, the number of entries, and as many lines `vertex x y z value`. An entry of
 * vertex -1 has coordinates only: refused, as they are not on the surface. */
loxo_status loxo_read_label(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                            int64_t n_vertices, loxo_index **vertex, int64_t *n);

/* GIFTI: of the first array of one number a vertex those that are not zero (NaN counts as zero); with a key, those that
 * are that number, or have the number of the label of that name. */
loxo_status loxo_read_gifti_region(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                   const char *key, int64_t n_vertices, loxo_index **vertex, int64_t *n);

/* By the content: GIFTI, .label or a list. key NULL: none. */
loxo_status loxo_read_vertices_bytes(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                     const char *key, int64_t n_vertices, loxo_index **vertex, int64_t *n);

#endif
