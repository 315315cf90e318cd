/* SPDX-License-Identifier: MIT
 * Fields out of bytes, one function a format. value is from loxo_allocate and untouched by a failure; the same rules as
 * for meshes (formats.h). */
#ifndef LOXO_IO_FIELD_H
#define LOXO_IO_FIELD_H

#include <loxo/io.h>

/* .npy of versions 1 to 3: booleans, integers and floats of 2, 4 and 8 bytes in either byte order; one dimension, or a
 * second one of 1. */
loxo_status loxo_read_npy(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name, double **value,
                          int64_t *n);

/* The same of rows of three numbers, in either order of an array's axes. */
loxo_status loxo_read_npy_points(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                 double **position, int64_t *n);

/* Text: one number a line, or the last of columns. Columns are cut by commas, semicolons or spaces. A first line that is
 * no number is a header, lines that begin with # are comments. The first of several columns must number the lines (from
 * 0 or 1) when there is no header or when its header is `vertex`: so a decimal comma is no column, and shuffled rows are
 * no field. */
loxo_status loxo_read_csv(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name, double **value,
                          int64_t *n);

/* Text: lines of three numbers with commas, semicolons or blanks between them, behind a header or not; # begins a comment.
 * [*n][3], finite. */
loxo_status loxo_read_csv_points(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                 double **position, int64_t *n);

/* By the content: .npy or text. */
loxo_status loxo_read_points_bytes(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                   double **position, int64_t *n);

/* Its shape alone, by the first bytes of a file. */
loxo_status loxo_read_npy_shape(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                loxo_array *array);
/* An array of one to three dimensions, as loxo_read_array. */
loxo_status loxo_read_npy_array(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                loxo_array *array);
/* By the content: .npy or text. */
loxo_status loxo_read_array_bytes(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                  loxo_array *array);

/* By the content: GIFTI, .npy or text. */
loxo_status loxo_read_field_bytes(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                                  double **value, int64_t *n);

#endif
