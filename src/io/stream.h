/* SPDX-License-Identifier: MIT
 * A file being written through one buffer of fixed size. The first failure sticks: everything after it does nothing, so
 * writers put their bytes without looking and close tells how it went. */
#ifndef LOXO_IO_STREAM_H
#define LOXO_IO_STREAM_H

#include "base/os.h"

#include <string.h>

#define LOXO_STREAM_BYTES ((size_t)1 << 18)
#define LOXO_STREAM_ROOM  ((size_t)4096) /* most that loxo_stream_room gives at once */

typedef struct loxo_stream {
    loxo_context *ctx;
    loxo_status status; /* of the first failure */
    unsigned char *buffer;
    size_t used;
    loxo_os_output output;
} loxo_stream;

/* On failure there is nothing to close. */
loxo_status loxo_stream_open(loxo_context *ctx, loxo_stream *stream, const char *path);
/* Puts the file in place when everything went well and removes it otherwise. */
loxo_status loxo_stream_close(loxo_stream *stream);

void loxo_stream_flush(loxo_stream *stream);
void loxo_stream_put(loxo_stream *stream, const void *bytes, size_t n);
void loxo_stream_text(loxo_stream *stream, const char *text);
/* At most LOXO_STREAM_ROOM bytes; for integers and strings only, which no locale changes. */
void loxo_stream_format(loxo_stream *stream, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* count elements of width 1, 2, 4 or 8 bytes, little endian. */
void loxo_stream_put_le(loxo_stream *stream, const void *elements, int64_t count, size_t width);
/* Text on one line: control characters become spaces. */
void loxo_stream_line(loxo_stream *stream, const char *text);
/* The same with the five characters that XML minds as entities. */
void loxo_stream_xml(loxo_stream *stream, const char *text);

/* Room for n <= LOXO_STREAM_ROOM bytes; the caller adds what it took to stream->used. */
static inline unsigned char *loxo_stream_room(loxo_stream *stream, size_t n)
{
    if (stream->used + n > LOXO_STREAM_BYTES) loxo_stream_flush(stream);
    return stream->buffer + stream->used;
}

/* Stores little endian, whatever the machine is. */
static inline void loxo_store_u32(unsigned char *p, uint32_t v)
{
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
    v = __builtin_bswap32(v);
#endif
    memcpy(p, &v, sizeof v);
}

static inline void loxo_store_u64(unsigned char *p, uint64_t v)
{
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
    v = __builtin_bswap64(v);
#endif
    memcpy(p, &v, sizeof v);
}

static inline void loxo_store_f32(unsigned char *p, float v)
{
    uint32_t u;
    memcpy(&u, &v, sizeof u);
    loxo_store_u32(p, u);
}

static inline void loxo_store_f64(unsigned char *p, double v)
{
    uint64_t u;
    memcpy(&u, &v, sizeof u);
    loxo_store_u64(p, u);
}

#endif
