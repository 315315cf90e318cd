/* SPDX-License-Identifier: MIT
 * One reader a format: bytes in, soup out. name stands in messages only. Each reader checks counts against the bytes that
 * are there before it allocates, leaves the failure in ctx (file, line or byte, element) and an empty soup when it fails. */
#ifndef LOXO_IO_FORMATS_H
#define LOXO_IO_FORMATS_H

#include <loxo/io.h>

loxo_status loxo_read_ply(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup);
loxo_status loxo_read_obj(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup);
loxo_status loxo_read_off(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup);
loxo_status loxo_read_stl(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup);
loxo_status loxo_read_gifti(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup);
loxo_status loxo_read_freesurfer(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup);

#endif
