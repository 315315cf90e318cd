/* SPDX-License-Identifier: MIT */
#include "io/source.h"

#include "base/allocate.h"
#include "base/context.h"
#include "loxo_config.h"
#include "par/range.h"

#include <string.h>

#ifdef LOXO_WITH_ZLIB
#include <zlib.h>
#endif

#define SLICE_BYTES  ((int64_t)1 << 20) /* what a thread reads at once */
#define WAVE_SLICES  64                 /* between two looks at the monitor */
#define STREAM_BYTES ((size_t)1 << 20)
#define UNPACK_BYTES ((size_t)1 << 24)

static loxo_place place_in(const char *name) { return (loxo_place){.file = name, .byte = -1, .element = -1}; }

loxo_status loxo_source_open(loxo_context *ctx, const char *path, loxo_source *source)
{
    loxo_status status;
    *source = (loxo_source){.name = path, .file = {.fd = -1}, .n_bytes = -1};
    if ((status = loxo_os_open(ctx, path, &source->file)) < 0) return status;
    source->head = loxo_allocate(ctx, LOXO_SOURCE_HEAD, 1);
    if (source->head == NULL) return LOXO_ERR_MEMORY;
    /* Kernel files call themselves regular and empty: their end must be read to be known. */
    if (source->file.is_regular && source->file.n_bytes > 0) {
        source->n_bytes = source->file.n_bytes;
        status = loxo_os_read_at(ctx, &source->file, 0, source->head, LOXO_SOURCE_HEAD, &source->n_head);
        if (status >= 0 && source->n_head < LOXO_SOURCE_HEAD && source->n_head != (size_t)source->n_bytes)
            status = loxo_fail(ctx, LOXO_ERR_READ, "the file changed its size while it was read");
    } else {
        status = loxo_os_read(ctx, &source->file, source->head, LOXO_SOURCE_HEAD, &source->n_head);
        if (source->n_head < LOXO_SOURCE_HEAD) source->n_bytes = (int64_t)source->n_head;
    }
    if (status < 0) loxo_failure_set_file(ctx, path);
    return status;
}

void loxo_source_close(loxo_context *ctx, loxo_source *source)
{
    loxo_os_close(&source->file);
    loxo_release(ctx, source->head);
    source->head = NULL;
}

/* One wave of slices of a regular file, in parallel. */
static loxo_status read_wave(loxo_context *ctx, const loxo_source *source, int64_t begin, int64_t end, uint8_t *bytes)
{
    const int64_t n_slices = (end - begin + SLICE_BYTES - 1) / SLICE_BYTES;
    bool failed = false, is_short = false;
#pragma omp parallel num_threads(loxo_threads_for(ctx, end - begin, 0.2)) reduction(|| : failed, is_short)
    {
        const loxo_range range = loxo_thread_range(n_slices);
        for (int64_t i = range.begin; i < range.end; ++i) {
            const int64_t from = begin + i * SLICE_BYTES, to = from + SLICE_BYTES < end ? from + SLICE_BYTES : end;
            size_t got = 0;
            failed = failed || loxo_os_read_at(NULL, &source->file, from, bytes + from, (size_t)(to - from), &got) < 0;
            is_short = is_short || got < (size_t)(to - from);
        }
    }
    if (failed) { /* once more from this thread, for the system's text */
        size_t got;
        const loxo_status status =
            loxo_os_read_at(ctx, &source->file, begin, bytes + begin, (size_t)(end - begin), &got);
        if (status < 0) {
            loxo_failure_set_file(ctx, source->name);
            return status;
        }
        is_short = got < (size_t)(end - begin);
    }
    if (is_short)
        return loxo_fail_at(ctx, LOXO_ERR_READ, place_in(source->name), "the file became shorter while it was read");
    return LOXO_OK;
}

static loxo_status read_regular(loxo_context *ctx, const loxo_source *source, uint8_t *bytes)
{
    const int64_t n = source->n_bytes;
    size_t got = 0;
    uint8_t extra;
    for (int64_t begin = 0; begin < n; begin += WAVE_SLICES * SLICE_BYTES) {
        const int64_t end = n - begin < WAVE_SLICES * SLICE_BYTES ? n : begin + WAVE_SLICES * SLICE_BYTES;
        const loxo_status status = read_wave(ctx, source, begin, end, bytes);
        if (status < 0) return status;
        if (loxo_stop_wanted(ctx, "read", (double)end / (double)n))
            return loxo_fail_at(ctx, LOXO_ERR_STOPPED, place_in(source->name), "stopped while reading");
    }
    if (loxo_os_read_at(NULL, &source->file, n, &extra, 1, &got) >= 0 && got > 0)
        return loxo_fail_at(ctx, LOXO_ERR_READ, place_in(source->name), "the file became longer while it was read");
    return LOXO_OK;
}

/* Room for at least n_more bytes in a block that grows by half, up to max bytes and one, so that too many are seen. */
static loxo_status grow(loxo_context *ctx, uint8_t **bytes, size_t *capacity, size_t n, size_t n_more, size_t max)
{
    size_t wanted = *capacity + *capacity / 2;
    uint8_t *grown;
    if (*capacity - n >= n_more) return LOXO_OK;
    if (wanted < n + n_more) wanted = n + n_more;
    if (max < SIZE_MAX && wanted > max + 1) wanted = max + 1;
    if (wanted == *capacity) return LOXO_OK;
    grown = loxo_reallocate(ctx, *bytes, (int64_t)wanted, 1);
    if (grown == NULL) return LOXO_ERR_MEMORY;
    *bytes = grown;
    *capacity = wanted;
    return LOXO_OK;
}

static loxo_status read_stream(loxo_context *ctx, const loxo_source *source, size_t max, uint8_t **bytes, size_t *n)
{
    size_t capacity = 0, got = 1;
    loxo_status status = grow(ctx, bytes, &capacity, 0, source->n_head + 1, SIZE_MAX);
    if (status < 0 || *bytes == NULL) return status;
    memcpy(*bytes, source->head, source->n_head);
    *n = source->n_head;
    if (source->n_bytes >= 0) return LOXO_OK;
    while (got > 0 && *n <= max) {
        if ((status = grow(ctx, bytes, &capacity, *n, STREAM_BYTES, max)) < 0) break;
        status = loxo_os_read(ctx, &source->file, *bytes + *n,
                              capacity - *n < STREAM_BYTES ? capacity - *n : STREAM_BYTES, &got);
        if (status < 0) break;
        *n += got;
        if (loxo_stop_wanted(ctx, "read", -1.0)) return loxo_fail(ctx, LOXO_ERR_STOPPED, "stopped while reading");
    }
    if (status >= 0 && *n > max)
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "the stream brings more than %zu bytes (max_bytes)", max);
    return status;
}

loxo_status loxo_source_read(loxo_context *ctx, loxo_source *source, size_t max_bytes, uint8_t **bytes, size_t *n)
{
    loxo_status status;
    *bytes = NULL;
    *n = 0;
    if (source->file.is_regular && source->n_bytes > LOXO_SOURCE_HEAD) {
        *n = (size_t)source->n_bytes;
        *bytes = loxo_allocate(ctx, source->n_bytes, 1);
        status = *bytes == NULL ? LOXO_ERR_MEMORY : read_regular(ctx, source, *bytes);
    } else {
        status = read_stream(ctx, source, max_bytes == 0 ? SIZE_MAX : max_bytes, bytes, n);
    }
    if (status >= 0) return LOXO_OK;
    loxo_failure_set_file(ctx, source->name);
    loxo_release(ctx, *bytes);
    *bytes = NULL;
    *n = 0;
    return status;
}

#ifdef LOXO_WITH_ZLIB

static voidpf zlib_allocate(voidpf ctx, uInt count, uInt size) { return loxo_allocate(ctx, (int64_t)count, size); }
static void zlib_release(voidpf ctx, voidpf block) { loxo_release(ctx, block); }

typedef struct unpacking {
    loxo_context *ctx;
    const uint8_t *packed;
    size_t n_packed, at; /* at: taken in so far */
    const char *name;
    bool is_zlib;
    uint8_t *bytes;
    size_t n, capacity, max;
} unpacking;

static loxo_status fail_unpacking(const unpacking *u, loxo_status status, const char *text)
{
    return loxo_fail_at(u->ctx, status, (loxo_place){.file = u->name, .byte = (int64_t)u->at, .element = -1},
                        "compressed data: %s", text);
}

/* One member: up to the end that its checksum confirms. */
static loxo_status unpack_member(unpacking *u, z_stream *z)
{
    for (;;) {
        loxo_status status = grow(u->ctx, &u->bytes, &u->capacity, u->n, 1, u->max);
        if (status < 0) return status;
        const size_t room = u->capacity - u->n < UNPACK_BYTES ? u->capacity - u->n : UNPACK_BYTES;
        const size_t feed = u->n_packed - u->at < UNPACK_BYTES ? u->n_packed - u->at : UNPACK_BYTES;
        /* zlib's interface lacks a const; it does not write there. */
        union {
            const uint8_t *in;
            Bytef *out;
        } next = {.in = u->packed + u->at};
        z->next_in = next.out;
        z->avail_in = (uInt)feed;
        z->next_out = u->bytes + u->n;
        z->avail_out = (uInt)room;
        const int result = inflate(z, Z_NO_FLUSH);
        const size_t made = room - z->avail_out, taken = feed - z->avail_in;
        u->at += taken;
        u->n += made;
        if (u->n > u->max) {
            return loxo_fail_at(u->ctx, LOXO_ERR_LIMIT, place_in(u->name), "unpacks to more than %zu bytes", u->max);
        }
        if (result == Z_STREAM_END) return LOXO_OK;
        if (result == Z_MEM_ERROR) return LOXO_ERR_MEMORY; /* loxo_allocate has left the message */
        if (result == Z_NEED_DICT) return fail_unpacking(u, LOXO_ERR_UNSUPPORTED, "needs a preset dictionary");
        if (result != Z_OK && result != Z_BUF_ERROR)
            return fail_unpacking(u, LOXO_ERR_MALFORMED, z->msg != NULL ? z->msg : "not valid");
        if (made == 0 && taken == 0 && u->at == u->n_packed)
            return fail_unpacking(u, LOXO_ERR_MALFORMED, "ends early (is the file cut?)");
        if (loxo_stop_wanted(u->ctx, "unpack", (double)u->at / (double)u->n_packed))
            return fail_unpacking(u, LOXO_ERR_STOPPED, "stopped while unpacking");
    }
}

static loxo_status unpack(unpacking *u)
{
    z_stream z = {.zalloc = zlib_allocate, .zfree = zlib_release, .opaque = u->ctx};
    loxo_status status;
    const int result = inflateInit2(&z, u->is_zlib ? 15 : 15 + 16);
    if (result == Z_MEM_ERROR) return LOXO_ERR_MEMORY;
    if (result != Z_OK) return fail_unpacking(u, LOXO_ERR_UNSUPPORTED, "zlib does not start");
    do {
        inflateReset(&z);
        status = unpack_member(u, &z);
    } while (status >= 0 && !u->is_zlib && loxo_is_gzip(u->packed + u->at, u->n_packed - u->at));
    inflateEnd(&z);
    if (status < 0) return status;
    for (size_t i = u->at; i < u->n_packed; ++i) {
        if (u->packed[i] == 0) continue;
        loxo_warn(u->ctx, "packed-trailing", (int64_t)(u->n_packed - u->at),
                  "%s: %zu bytes behind the end of the compressed data are ignored", u->name, u->n_packed - u->at);
        break;
    }
    return LOXO_OK;
}

loxo_status loxo_source_inflate(loxo_context *ctx, const uint8_t *packed, size_t n_packed, bool is_zlib,
                                const char *name, size_t max_bytes, uint8_t **bytes, size_t *n)
{
    unpacking u = {.ctx = ctx,
                   .packed = packed,
                   .n_packed = n_packed,
                   .name = name,
                   .is_zlib = is_zlib,
                   .max = max_bytes == 0 ? SIZE_MAX : max_bytes};
    size_t first;
    *bytes = NULL;
    *n = 0;
    /* Text packs to about a third. */
    if (!loxo_mul(&first, n_packed, 3) || !loxo_add(&first, first, 1024)) first = n_packed;
    loxo_status status = grow(ctx, &u.bytes, &u.capacity, 0, first < u.max ? first : u.max, u.max);
    if (status >= 0) status = unpack(&u);
    if (status < 0) {
        loxo_failure_set_file(ctx, name);
        loxo_release(ctx, u.bytes);
        return status;
    }
    *bytes = u.bytes;
    *n = u.n;
    return LOXO_OK;
}

#else

loxo_status loxo_source_inflate(loxo_context *ctx, const uint8_t *packed, size_t n_packed, bool is_zlib,
                                const char *name, size_t max_bytes, uint8_t **bytes, size_t *n)
{
    (void)packed, (void)n_packed, (void)is_zlib, (void)max_bytes;
    *bytes = NULL;
    *n = 0;
    return loxo_fail_at(ctx, LOXO_ERR_UNSUPPORTED, place_in(name),
                        "compressed data, but this build has no zlib: unpack the file first");
}

#endif

loxo_status loxo_source_whole(loxo_context *ctx, const char *path, uint8_t **bytes, size_t *n)
{
    loxo_source source;
    loxo_status status = loxo_source_open(ctx, path, &source);
    *bytes = NULL;
    *n = 0;
    if (status >= 0) status = loxo_source_read(ctx, &source, 0, bytes, n);
    loxo_source_close(ctx, &source);
    if (status < 0 || !loxo_is_gzip(*bytes, *n)) return status;
    uint8_t *packed = *bytes;
    *bytes = NULL;
    status = loxo_source_inflate(ctx, packed, *n, false, path, 0, bytes, n);
    loxo_release(ctx, packed);
    return status;
}
