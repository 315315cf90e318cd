/* SPDX-License-Identifier: MIT
 * NumPy's .npy, version 1.0: a dictionary padded with blanks to 64 bytes, then little-endian doubles. */
#include "io/writers.h"

#include <stdio.h>

loxo_status loxo_write_npy(loxo_stream *stream, const double *value, int64_t n)
{
    char header[128];
    memset(header, ' ', sizeof header);
    memcpy(header, "\x93NUMPY\x01\x00", 8);
    header[8] = (char)(sizeof header - 10);
    header[9] = 0;
    const int used = snprintf(header + 10, sizeof header - 10,
                              "{'descr': '<f8', 'fortran_order': False, 'shape': (%lld,), }", (long long)n);
    header[10 + used] = ' ';
    header[sizeof header - 1] = '\n';
    loxo_stream_put(stream, header, sizeof header);
    loxo_stream_put_le(stream, value, n, 8);
    return LOXO_OK;
}
