/* SPDX-License-Identifier: MIT
 * One writer a format. Each puts a whole file into the stream; arguments were checked before (write.c). The stream
 * remembers what failed; the status returned is for what the stream does not know. */
#ifndef LOXO_IO_WRITERS_H
#define LOXO_IO_WRITERS_H

#include "io/stream.h"

#include <loxo/io.h>

loxo_status loxo_write_ply(loxo_stream *stream, const loxo_soup *soup, const char *comment);
loxo_status loxo_write_obj(loxo_stream *stream, const loxo_soup *soup, const char *comment);
loxo_status loxo_write_off(loxo_stream *stream, const loxo_soup *soup, const char *comment);
loxo_status loxo_write_vtp(loxo_stream *stream, const loxo_soup *soup, const char *comment);
loxo_status loxo_write_gifti(loxo_stream *stream, const loxo_soup *soup, const char *comment);

loxo_status loxo_write_npy(loxo_stream *stream, const double *value, int64_t n);
loxo_status loxo_write_npy_array(loxo_stream *stream, const double *value, int n_dimensions, const int64_t *shape);
loxo_status loxo_write_csv(loxo_stream *stream, const char *name, const double *value, int64_t n);
loxo_status loxo_write_gifti_field(loxo_stream *stream, const char *name, const double *value, int64_t n,
                                   const char *comment);

#endif
