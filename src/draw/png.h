/* SPDX-License-Identifier: MIT
 * PNG files. */
#ifndef LOXO_DRAW_PNG_H
#define LOXO_DRAW_PNG_H

#include "base/os.h"

/* LOXO_OK where this build can write PNG, else LOXO_ERR_UNSUPPORTED. */
loxo_status loxo_draw_png_available(loxo_context *ctx);
/* Writes rgb [height][width][3], sRGB, into the open output. */
loxo_status loxo_draw_png_write(loxo_context *ctx, loxo_os_output *out, const uint8_t *rgb, int width, int height);
/* Writes a picture to a file, atomically; path "-" is standard output. LOXO_ERR_WRITE, LOXO_ERR_MEMORY. */
loxo_status loxo_draw_png_save(loxo_context *ctx, const char *path, const uint8_t *rgb, int width, int height);

#endif
