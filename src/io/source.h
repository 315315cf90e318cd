/* SPDX-License-Identifier: MIT
 * The bytes of a file, pipe or standard input, decompressed where gzip is seen by its first bytes. */
#ifndef LOXO_IO_SOURCE_H
#define LOXO_IO_SOURCE_H

#include <loxo/context.h>

/* Reads all of path ("-": standard input) into one block.
 *   max_bytes   most that the block may become; 0: what the memory limit leaves
 *   bytes       out, from loxo_allocate; *n of them
 * returns       LOXO_OK; LOXO_ERR_READ (with the system's text), LOXO_ERR_MALFORMED (gzip cut or of wrong checksum),
 *               LOXO_ERR_UNSUPPORTED (gzip in a build without zlib), LOXO_ERR_MEMORY, LOXO_ERR_LIMIT
 * Memory grows with the bytes that came, never with what a header says. */
loxo_status loxo_source_read(loxo_context *ctx, const char *path, size_t max_bytes, uint8_t **bytes, size_t *n);

/* Decompresses gzip (or zlib's own wrapping when is_zlib) that lies in memory; in GIFTI the expected size is max_bytes.
 * Bytes behind the end are a warning. */
loxo_status loxo_source_inflate(loxo_context *ctx, const uint8_t *packed, size_t n_packed, bool is_zlib,
                                const char *name, size_t max_bytes, uint8_t **bytes, size_t *n);

#endif
