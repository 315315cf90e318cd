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

loxo_status loxo_write_npy_array(loxo_stream *stream, const double *value, int n_dimensions, const int64_t *shape)
{
    char text[80];
    int64_t n = 1;
    int used = snprintf(text, sizeof text, "(");
    for (int k = 0; k < n_dimensions; ++k) {
        const char *between = n_dimensions == 1 ? "," : k + 1 < n_dimensions ? ", " : "";
        n *= shape[k];
        used += snprintf(text + used, sizeof text - (size_t)used, "%lld%s", (long long)shape[k], between);
    }
    (void)snprintf(text + used, sizeof text - (size_t)used, ")");
    write_array(stream, value, n, text);
    return LOXO_OK;
}
