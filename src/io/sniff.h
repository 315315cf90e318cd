/* SPDX-License-Identifier: MIT
 * What a file looks like, from its first bytes; the name is a hint. */
#ifndef LOXO_IO_SNIFF_H
#define LOXO_IO_SNIFF_H

#include <loxo/io.h>

/* Tells the format of a surface.
 *   head      the first n bytes (LOXO_SOURCE_HEAD, or all)
 *   n_total   bytes of the whole, -1 when unknown (a stream)
 *   wanted    LOXO_FORMAT_AUTO, or what the caller asks for; the content must not look like something else then
 *   format    out
 * returns     LOXO_OK; LOXO_ERR_MALFORMED or LOXO_ERR_UNSUPPORTED, whose text names what the content looks like:
 *             nothing at all, a web page, a pointer to a file elsewhere, UTF-16, another format than the suffix says */
loxo_status loxo_sniff(loxo_context *ctx, const uint8_t *head, size_t n, int64_t n_total, const char *name,
                       loxo_format wanted, loxo_format *format);

#endif
