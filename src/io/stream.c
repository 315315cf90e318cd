/* SPDX-License-Identifier: MIT */
#include "io/stream.h"

#include "base/context.h"

#include <stdarg.h>
#include <stdio.h>

loxo_status loxo_stream_open(loxo_context *ctx, loxo_stream *stream, const char *path)
{
    stream->ctx = ctx;
    stream->status = LOXO_OK;
    stream->used = 0;
    stream->buffer = loxo_allocate(ctx, (int64_t)LOXO_STREAM_BYTES, 1);
    if (stream->buffer == NULL) return LOXO_ERR_MEMORY;
    stream->status = loxo_os_output_create(ctx, path, &stream->output);
    if (stream->status < 0) loxo_release(ctx, stream->buffer);
    return stream->status;
}

loxo_status loxo_stream_close(loxo_stream *stream)
{
    loxo_stream_flush(stream);
    if (stream->status >= 0) stream->status = loxo_os_output_commit(stream->ctx, &stream->output);
    if (stream->status < 0) loxo_os_output_abandon(&stream->output);
    loxo_release(stream->ctx, stream->buffer);
    stream->buffer = NULL;
    return stream->status;
}

void loxo_stream_flush(loxo_stream *stream)
{
    if (stream->status >= 0 && stream->used > 0)
        stream->status = loxo_os_output_write(stream->ctx, &stream->output, stream->buffer, stream->used);
    stream->used = 0;
}

void loxo_stream_put(loxo_stream *stream, const void *bytes, size_t n)
{
    if (n > LOXO_STREAM_BYTES - stream->used) {
        loxo_stream_flush(stream);
        if (n >= LOXO_STREAM_BYTES) {
            if (stream->status >= 0) stream->status = loxo_os_output_write(stream->ctx, &stream->output, bytes, n);
            return;
        }
    }
    if (n > 0) memcpy(stream->buffer + stream->used, bytes, n);
    stream->used += n;
}

void loxo_stream_text(loxo_stream *stream, const char *text) { loxo_stream_put(stream, text, strlen(text)); }

void loxo_stream_format(loxo_stream *stream, const char *format, ...)
{
    char *room = (char *)loxo_stream_room(stream, LOXO_STREAM_ROOM);
    va_list args;
    va_start(args, format);
    const int n = vsnprintf(room, LOXO_STREAM_ROOM, format, args);
    va_end(args);
    if (n > 0) stream->used += (size_t)n < LOXO_STREAM_ROOM ? (size_t)n : LOXO_STREAM_ROOM - 1;
}

void loxo_stream_put_le(loxo_stream *stream, const void *elements, int64_t count, size_t width)
{
    const unsigned char *from = elements;
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
    for (int64_t i = 0; i < count; ++i, from += width) {
        unsigned char *to = loxo_stream_room(stream, width);
        for (size_t k = 0; k < width; ++k)
            to[k] = from[width - 1 - k];
        stream->used += width;
    }
#else
    loxo_stream_put(stream, from, (size_t)count * width);
#endif
}

static char printable(char c) { return (char)((unsigned char)c < 0x20 || c == 0x7f ? ' ' : c); }

void loxo_stream_line(loxo_stream *stream, const char *text)
{
    for (; *text != '\0'; ++text) {
        *loxo_stream_room(stream, 1) = (unsigned char)printable(*text);
        ++stream->used;
    }
}

void loxo_stream_xml(loxo_stream *stream, const char *text)
{
    for (; *text != '\0'; ++text) {
        switch (*text) {
        case '<': loxo_stream_text(stream, "&lt;"); break;
        case '>': loxo_stream_text(stream, "&gt;"); break;
        case '&': loxo_stream_text(stream, "&amp;"); break;
        case '"': loxo_stream_text(stream, "&quot;"); break;
        case '\'': loxo_stream_text(stream, "&apos;"); break;
        default:
            *loxo_stream_room(stream, 1) = (unsigned char)printable(*text);
            ++stream->used;
            break;
        }
    }
}
