/* SPDX-License-Identifier: MIT */
#include "io/flow.h"

#include "base/context.h"
#include "io/source.h"
#include "loxo_config.h"

#include <string.h>

#ifdef LOXO_WITH_ZLIB
#include <zlib.h>
#endif

#define BUFFER_BYTES LOXO_SOURCE_HEAD

static loxo_status refill(loxo_flow *flow)
{
    const size_t kept = flow->n_buffer - flow->at;
    size_t got = 0;
    memmove(flow->buffer, flow->buffer + flow->at, kept);
    flow->at = 0;
    const loxo_status status = loxo_os_read(flow->ctx, &flow->file, flow->buffer + kept, BUFFER_BYTES - kept, &got);
    flow->n_buffer = kept + got;
    flow->n_raw += (int64_t)got;
    if (status < 0) loxo_failure_set_file(flow->ctx, flow->name);
    return status;
}

#ifdef LOXO_WITH_ZLIB

struct loxo_unpacker {
    z_stream z;
    bool in_member;
};

static voidpf zlib_allocate(voidpf ctx, uInt count, uInt size) { return loxo_allocate(ctx, (int64_t)count, size); }
static void zlib_release(voidpf ctx, voidpf block) { loxo_release(ctx, block); }

static loxo_status fail(const loxo_flow *flow, loxo_status status, const char *text)
{
    const int64_t byte = flow->n_raw - (int64_t)(flow->n_buffer - flow->at);
    return loxo_fail_at(flow->ctx, status, (loxo_place){.file = flow->name, .byte = byte, .element = -1},
                        "compressed data: %s", text);
}

static loxo_status start_unpacking(loxo_flow *flow)
{
    flow->unpacker = loxo_allocate(flow->ctx, 1, sizeof *flow->unpacker);
    if (flow->unpacker == NULL) return LOXO_ERR_MEMORY;
    *flow->unpacker = (struct loxo_unpacker){.z = {.zalloc = zlib_allocate, .zfree = zlib_release, .opaque = flow->ctx},
                                             .in_member = true};
    if (inflateInit2(&flow->unpacker->z, 15 + 16) == Z_OK) return LOXO_OK;
    loxo_release(flow->ctx, flow->unpacker);
    flow->unpacker = NULL;
    return fail(flow, LOXO_ERR_MEMORY, "zlib does not start");
}

static void end_unpacking(loxo_flow *flow)
{
    if (flow->unpacker == NULL) return;
    inflateEnd(&flow->unpacker->z);
    loxo_release(flow->ctx, flow->unpacker);
    flow->unpacker = NULL;
}

static loxo_status read_packed(loxo_flow *flow, uint8_t *bytes, size_t n, size_t *got)
{
    struct loxo_unpacker *u = flow->unpacker;
    while (*got < n && !flow->is_done) {
        loxo_status status = LOXO_OK;
        if (flow->n_buffer - flow->at < 2 && (status = refill(flow)) < 0) return status;
        if (!u->in_member) { /* another member may follow */
            flow->is_done = !loxo_is_gzip(flow->buffer + flow->at, flow->n_buffer - flow->at);
            if (flow->is_done) break;
            inflateReset(&u->z);
            u->in_member = true;
        }
        const size_t feed = flow->n_buffer - flow->at, room = n - *got < BUFFER_BYTES ? n - *got : BUFFER_BYTES;
        u->z.next_in = flow->buffer + flow->at;
        u->z.avail_in = (uInt)feed;
        u->z.next_out = bytes + *got;
        u->z.avail_out = (uInt)room;
        const int result = inflate(&u->z, Z_NO_FLUSH);
        const size_t taken = feed - u->z.avail_in, made = room - u->z.avail_out;
        flow->at += taken;
        *got += made;
        if (result == Z_MEM_ERROR) return LOXO_ERR_MEMORY; /* loxo_allocate has left the message */
        if (result == Z_NEED_DICT) return fail(flow, LOXO_ERR_UNSUPPORTED, "needs a preset dictionary");
        if (result == Z_STREAM_END)
            u->in_member = false;
        else if (result != Z_OK && result != Z_BUF_ERROR)
            return fail(flow, LOXO_ERR_MALFORMED, u->z.msg != NULL ? u->z.msg : "not valid");
        else if (taken == 0 && made == 0)
            return fail(flow, LOXO_ERR_MALFORMED, "ends early (is the file cut?)");
    }
    return LOXO_OK;
}

#else

static loxo_status start_unpacking(loxo_flow *flow)
{
    return loxo_fail_at(flow->ctx, LOXO_ERR_UNSUPPORTED, (loxo_place){.file = flow->name, .byte = -1, .element = -1},
                        "compressed data, but this build has no zlib: unpack the file first");
}

static void end_unpacking(loxo_flow *flow) { (void)flow; }

static loxo_status read_packed(loxo_flow *flow, uint8_t *bytes, size_t n, size_t *got)
{
    (void)flow, (void)bytes, (void)n, (void)got;
    return LOXO_ERR_UNSUPPORTED;
}

#endif

loxo_status loxo_flow_open(loxo_context *ctx, const char *path, loxo_flow *flow)
{
    loxo_status status;
    *flow = (loxo_flow){.ctx = ctx, .name = path, .file = {.fd = -1}};
    if ((status = loxo_os_open(ctx, path, &flow->file)) < 0) return status;
    flow->buffer = loxo_allocate(ctx, BUFFER_BYTES, 1);
    if (flow->buffer == NULL) return LOXO_ERR_MEMORY;
    if ((status = refill(flow)) < 0) return status;
    flow->is_packed = loxo_is_gzip(flow->buffer, flow->n_buffer);
    return flow->is_packed ? start_unpacking(flow) : LOXO_OK;
}

void loxo_flow_close(loxo_flow *flow)
{
    loxo_os_close(&flow->file);
    end_unpacking(flow);
    loxo_release(flow->ctx, flow->buffer);
    flow->buffer = NULL;
}

loxo_status loxo_flow_read(loxo_flow *flow, uint8_t *bytes, size_t n, size_t *got)
{
    loxo_status status = LOXO_OK;
    *got = 0;
    if (flow->is_packed) return read_packed(flow, bytes, n, got);
    while (*got < n) {
        if (flow->at == flow->n_buffer && (status = refill(flow)) < 0) return status;
        const size_t have = flow->n_buffer - flow->at, take = have < n - *got ? have : n - *got;
        if (take == 0) break;
        memcpy(bytes + *got, flow->buffer + flow->at, take);
        flow->at += take;
        *got += take;
    }
    return LOXO_OK;
}
