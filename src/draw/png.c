/* SPDX-License-Identifier: MIT
 * libpng reports errors by a jump. It never leaves write_rows, which has nothing to free: all that is allocated belongs
 * to its caller. */
#include "draw/png.h"

#include "base/context.h"
#include "loxo_config.h"

#if defined(LOXO_WITH_PNG)

#include <png.h>

typedef struct sink {
    loxo_context *ctx;
    loxo_os_output *out;
    loxo_status status; /* the first failure; its message stands in the context */
} sink;

static void fail(png_structp png, png_const_charp text)
{
    sink *s = png_get_error_ptr(png);
    if (s->status == LOXO_OK) s->status = loxo_fail(s->ctx, LOXO_ERR_WRITE, "libpng: %s", text);
    png_longjmp(png, 1);
}

static void ignore(png_structp png, png_const_charp text) { (void)png, (void)text; }

static void write_bytes(png_structp png, png_bytep bytes, png_size_t n)
{
    sink *s = png_get_io_ptr(png);
    const loxo_status status = loxo_os_output_write(s->ctx, s->out, bytes, n);
    if (status >= 0) return;
    s->status = status;
    png_error(png, "output");
}

static void flush(png_structp png) { (void)png; }

static png_voidp allocate(png_structp png, png_alloc_size_t n)
{
    sink *s = png_get_mem_ptr(png);
    void *block = n > INT64_MAX ? NULL : loxo_allocate(s->ctx, (int64_t)n, 1);
    if (block == NULL) s->status = LOXO_ERR_MEMORY; /* loxo_allocate has left the message */
    return block;
}

static void release(png_structp png, png_voidp block)
{
    const sink *s = png_get_mem_ptr(png);
    loxo_release(s->ctx, block);
}

static void write_rows(png_structp png, png_infop info, const uint8_t *rgb, int width, int height)
{
    static char key[] = "Software", text[] = "loxo";
    png_text note = {
        .compression = PNG_TEXT_COMPRESSION_NONE, .key = key, .text = text, .text_length = sizeof text - 1};
    if (setjmp(png_jmpbuf(png)) != 0) return; /* fail() has set the status */
    png_set_user_limits(png, (png_uint_32)width, (png_uint_32)height);
    png_set_compression_buffer_size(png, (size_t)1 << 16);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_set_text(png, info, &note, 1);
    png_write_info(png, info);
    for (int row = 0; row < height; ++row)
        png_write_row(png, &rgb[(int64_t)3 * width * row]);
    png_write_end(png, info);
}

loxo_status loxo_draw_png_available(loxo_context *ctx)
{
    (void)ctx;
    return LOXO_OK;
}

loxo_status loxo_draw_png_write(loxo_context *ctx, loxo_os_output *out, const uint8_t *rgb, int width, int height)
{
    sink s = {ctx, out, LOXO_OK};
    png_structp png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, &s, fail, ignore, &s, allocate, release);
    if (png == NULL)
        return s.status < 0 ? s.status
                            : loxo_fail(ctx, LOXO_ERR_UNSUPPORTED, "libpng %s does not start", png_libpng_ver);
    png_infop info = png_create_info_struct(png);
    if (info != NULL) {
        png_set_write_fn(png, &s, write_bytes, flush);
        write_rows(png, info, rgb, width, height);
    }
    png_destroy_write_struct(&png, &info);
    return s.status;
}

#else

loxo_status loxo_draw_png_available(loxo_context *ctx)
{
    return loxo_fail(ctx, LOXO_ERR_UNSUPPORTED, "this build has no PNG: libpng was off or not found");
}

loxo_status loxo_draw_png_write(loxo_context *ctx, loxo_os_output *out, const uint8_t *rgb, int width, int height)
{
    (void)out, (void)rgb, (void)width, (void)height;
    return loxo_draw_png_available(ctx);
}

#endif

loxo_status loxo_draw_png_save(loxo_context *ctx, const char *path, const uint8_t *rgb, int width, int height)
{
    loxo_os_output out = {.fd = -1, .directory_fd = -1};
    loxo_status status = loxo_os_output_create(ctx, path, &out);
    if (status >= 0) status = loxo_draw_png_write(ctx, &out, rgb, width, height);
    if (status >= 0) return loxo_os_output_commit(ctx, &out);
    loxo_os_output_abandon(&out);
    return status;
}
