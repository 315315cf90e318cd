/* SPDX-License-Identifier: MIT
 * NumPy's .npy, version 1.0: a dictionary padded with blanks to 64 bytes, then little-endian doubles. */
#include "io/writers.h"

#include <stdio.h>

/* shape: as "(4, 3)". */
static void write_array(loxo_stream *stream, const double *value, int64_t n, const char *shape)
{
    char header[128];
    memset(header, ' ', sizeof header);
    memcpy(header, "\x93NUMPY\x01\x00", 8);
    header[8] = (char)(sizeof header - 10);
    header[9] = 0;
    const int used =
        snprintf(header + 10, sizeof header - 10, "{'descr': '<f8', 'fortran_order': False, 'shape': %s, }", shape);
    header[10 + used] = ' ';
    header[sizeof header - 1] = '\n';
    loxo_stream_put(stream, header, sizeof header);
    loxo_stream_put_le(stream, value, n, 8);
}

loxo_status loxo_write_npy(loxo_stream *stream, const double *value, int64_t n)
{
    char shape[32];
    (void)snprintf(shape, sizeof shape, "(%lld,)", (long long)n);
    write_array(stream, value, n, shape);
    return LOXO_OK;
}

loxo_status loxo_write_npy_rows(loxo_stream *stream, const double *value, int64_t n_rows, int64_t n_columns)
{
    char shape[64];
    (void)snprintf(shape, sizeof shape, "(%lld, %lld)", (long long)n_rows, (long long)n_columns);
    write_array(stream, value, n_rows * n_columns, shape);
    return LOXO_OK;
}
