/* SPDX-License-Identifier: MIT
 * Packed data: the input as it is; and, as the checksum keeps most of that from getting far, the input packed by zlib,
 * whole, cut or with a bit turned. What comes back must be what went in, or an error. */
#include "harness.h"
#include "io/source.h"

#include <zlib.h>

#define MAX_UNPACKED ((size_t)1 << 16)

static loxo_status unpack(loxo_context *ctx, const uint8_t *packed, size_t n, bool is_zlib, uint8_t **bytes,
                          size_t *n_bytes)
{
    *bytes = NULL;
    *n_bytes = 0;
    const loxo_status status = loxo_source_inflate(ctx, packed, n, is_zlib, "input", MAX_UNPACKED, bytes, n_bytes);
    fuzz_check_status(ctx, status);
    FUZZ_CHECK(status < 0 ? *bytes == NULL : *n_bytes <= MAX_UNPACKED);
    return status;
}

/* Packs; the result is never longer than `room`. */
static size_t pack(const uint8_t *bytes, size_t n, int level, bool is_zlib, uint8_t *packed, size_t room)
{
    z_stream z = {0};
    FUZZ_CHECK(deflateInit2(&z, level, Z_DEFLATED, is_zlib ? 15 : 31, 8, Z_DEFAULT_STRATEGY) == Z_OK);
    z.next_in = (Bytef *)(uintptr_t)bytes; /* zlib's interface lacks a const */
    z.avail_in = (uInt)n;
    z.next_out = packed;
    z.avail_out = (uInt)room;
    FUZZ_CHECK(deflate(&z, Z_FINISH) == Z_STREAM_END);
    const size_t n_packed = room - z.avail_out;
    deflateEnd(&z);
    return n_packed;
}

static void fuzz_one(loxo_context *ctx, const uint8_t *bytes, size_t n)
{
    static uint8_t packed[MAX_UNPACKED + 1024];
    uint8_t *unpacked;
    size_t n_unpacked;
    if (n < 4 || n > MAX_UNPACKED) return;
    if (unpack(ctx, bytes, n, bytes[0] == 0x78, &unpacked, &n_unpacked) >= 0) loxo_release(ctx, unpacked);

    /* Four bytes steer, the rest is payload. */
    const uint8_t *payload = bytes + 4;
    const size_t n_payload = n - 4, where = (size_t)bytes[2] << 8 | bytes[3];
    const bool is_zlib = (bytes[0] & 1) != 0;
    size_t n_packed = pack(payload, n_payload, bytes[1] % 10, is_zlib, packed, sizeof packed);
    const int damage = bytes[0] >> 1 & 3;
    if (damage == 1) n_packed = where % n_packed;
    if (damage == 2) packed[where % n_packed] ^= (uint8_t)(1u << (bytes[0] >> 5));
    if (unpack(ctx, packed, n_packed, is_zlib, &unpacked, &n_unpacked) < 0) {
        FUZZ_CHECK(damage == 1 || damage == 2);
        return;
    }
    FUZZ_CHECK(damage != 1);
    FUZZ_CHECK(n_unpacked == n_payload && memcmp(unpacked, payload, n_payload) == 0);
    FUZZ_PLANT(n_unpacked >= 4 && memcmp(unpacked, "LOXO", 4) == 0);
    loxo_release(ctx, unpacked);
}
