/* SPDX-License-Identifier: MIT
 * The bytes of a file, pipe or standard input, and what gzip packed. Memory grows with the bytes that came, never with
 * what a header says of them. */
#ifndef LOXO_IO_SOURCE_H
#define LOXO_IO_SOURCE_H

#include "base/os.h"

#include <loxo/context.h>

#define LOXO_SOURCE_HEAD 65536

/* An open input with its first bytes, by which its format is told before the rest is read. */
typedef struct loxo_source {
    const char *name; /* the path; stays the caller's */
    loxo_os_file file;
    uint8_t *head; /* [n_head], all of the input when that is shorter than LOXO_SOURCE_HEAD */
    size_t n_head;
    int64_t n_bytes; /* of the whole input, -1 when only its end will tell */
} loxo_source;

/* Opens path ("-": standard input). loxo_source_close is fine after a failure too. */
loxo_status loxo_source_open(loxo_context *ctx, const char *path, loxo_source *source);
void loxo_source_close(loxo_context *ctx, loxo_source *source);

/* Reads all of it, the head included, into one block from loxo_allocate. Once only for a stream.
 *   max_bytes  most that a stream may bring; 0: what the memory limit leaves
 * returns      LOXO_OK; LOXO_ERR_READ (with the system's text, or: the file changed its size meanwhile),
 *              LOXO_ERR_LIMIT (more than max_bytes), LOXO_ERR_MEMORY, LOXO_ERR_STOPPED */
loxo_status loxo_source_read(loxo_context *ctx, loxo_source *source, size_t max_bytes, uint8_t **bytes, size_t *n);

/* Unpacks gzip that lies in memory, one member or several, or zlib's own wrapping when is_zlib. What stands behind the
 * end is a counted warning, unless it is zeros that pad.
 *   max_bytes  most that the result may be; 0: what the memory limit leaves
 * returns      LOXO_OK; LOXO_ERR_MALFORMED (cut, or a wrong checksum; byte is an offset in the packed data),
 *              LOXO_ERR_LIMIT, LOXO_ERR_UNSUPPORTED (a build without zlib), LOXO_ERR_MEMORY, LOXO_ERR_STOPPED */
loxo_status loxo_source_inflate(loxo_context *ctx, const uint8_t *packed, size_t n_packed, bool is_zlib,
                                const char *name, size_t max_bytes, uint8_t **bytes, size_t *n);

/* All of a file or stream, unpacked where it is gzip. */
loxo_status loxo_source_whole(loxo_context *ctx, const char *path, uint8_t **bytes, size_t *n);

static inline bool loxo_is_gzip(const uint8_t *bytes, size_t n)
{
    return n >= 2 && bytes[0] == 0x1f && bytes[1] == 0x8b;
}

#endif
