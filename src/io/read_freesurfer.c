/* SPDX-License-Identifier: MIT
 * FreeSurfer's binary triangle surface: magic FF FF FE, a line of comment and an empty one, two counts, float positions
 * and 32-bit triangles, all big endian. FreeSurfer's own tags may follow; they say nothing of the surface. */
#include "base/context.h"
#include "io/bytes.h"
#include "io/counts.h"
#include "io/formats.h"
#include "io/raw.h"

#include <inttypes.h>

#define RECORD_BYTES 12 /* of a vertex as of a face */

static loxo_status fail(loxo_context *ctx, const char *name, loxo_status status, size_t byte, const char *text)
{
    return loxo_fail_at(ctx, status, (loxo_place){.file = name, .byte = (int64_t)byte, .element = -1}, "%s", text);
}

/* The two counts at byte `at` of the first n; whether what they announce fits the n_total of the file. */
static bool read_counts(const uint8_t *bytes, size_t n, size_t n_total, size_t at, bool swap, uint32_t counts[2])
{
    if (n < at || n - at < 8) return false;
    counts[0] = loxo_load_u32(bytes + at, swap);
    counts[1] = loxo_load_u32(bytes + at + 4, swap);
    return ((uint64_t)counts[0] + counts[1]) * RECORD_BYTES <= n_total - at - 8;
}

/* Behind the comment: one line, and the end of a second one. Where the byte that seems to be that end belongs to the
 * counts (167 million vertices begin so), the counts tell. */
static loxo_status find_counts(loxo_context *ctx, const char *name, const uint8_t *bytes, size_t n, size_t n_total,
                               size_t *at, uint32_t counts[2])
{
    const bool swap = !LOXO_HOST_IS_BIG;
    const uint8_t *line_end = memchr(bytes + 3, '\n', n - 3);
    if (line_end == NULL) return fail(ctx, name, LOXO_ERR_MALFORMED, n, "the file ends within the comment line");
    *at = (size_t)(line_end - bytes) + 1;
    const bool has_second = *at < n && bytes[*at] == '\n';
    if (has_second && read_counts(bytes, n, n_total, *at + 1, swap, counts)) {
        ++*at;
        return LOXO_OK;
    }
    if (read_counts(bytes, n, n_total, *at, swap, counts)) return LOXO_OK;
    if (has_second) ++*at;
    if (n - *at < 8) return fail(ctx, name, LOXO_ERR_MALFORMED, n, "the file ends before its counts");
    const bool is_little = read_counts(bytes, n, n_total, *at, !swap, counts);
    read_counts(bytes, n, n_total, *at, swap, counts);
    return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.file = name, .byte = (int64_t)*at, .element = -1},
                        "%" PRIu32 " vertices and %" PRIu32 " faces need %" PRIu64 " bytes, %zu are left%s", counts[0],
                        counts[1], ((uint64_t)counts[0] + counts[1]) * RECORD_BYTES, n_total - *at - 8,
                        is_little ? " (byte order?)" : " (is the file cut?)");
}

/* Up to the counts. */
static loxo_status read_head(loxo_context *ctx, const uint8_t *bytes, size_t n, size_t n_total, const char *name,
                             size_t *at, uint32_t counts[2])
{
    if (n == 0) return fail(ctx, name, LOXO_ERR_MALFORMED, 0, "empty file");
    if (n < 3 || bytes[0] != 0xff || bytes[1] != 0xff)
        return fail(ctx, name, LOXO_ERR_MALFORMED, 0, "no FreeSurfer surface: its first bytes are not FF FF FE");
    if (bytes[2] == 0xff || bytes[2] == 0xfd)
        return fail(ctx, name, LOXO_ERR_UNSUPPORTED, 0,
                    "an old FreeSurfer surface of quadrangles: convert it with mris_convert");
    if (bytes[2] != 0xfe)
        return fail(ctx, name, LOXO_ERR_MALFORMED, 2, "no FreeSurfer surface: its first bytes are not FF FF FE");
    return find_counts(ctx, name, bytes, n, n_total, at, counts);
}

loxo_status loxo_freesurfer_head(loxo_context *ctx, const uint8_t *bytes, size_t n, int64_t n_total, const char *name,
                                 loxo_head *head)
{
    uint32_t counts[2] = {0, 0};
    size_t at = 0;
    const loxo_status status = read_head(ctx, bytes, n, n_total < 0 ? SIZE_MAX : (size_t)n_total, name, &at, counts);
    *head = (loxo_head){.n_vertices = counts[0], .n_faces = counts[1], .is_float = true, .n_bytes = at + 8};
    return status;
}

loxo_status loxo_read_freesurfer(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup)
{
    uint32_t counts[2] = {0, 0};
    size_t at = 0;
    loxo_status status;
    *soup = (loxo_soup){0};
    if ((status = read_head(ctx, bytes, n, n, name, &at, counts)) < 0) return status;

    const loxo_raw positions = {
        .bytes = bytes + at + 8, .n_rows = counts[0], .swap = !LOXO_HOST_IS_BIG, .byte = (int64_t)at + 8};
    const loxo_raw triangles = {.bytes = positions.bytes + (size_t)counts[0] * RECORD_BYTES,
                                .n_rows = counts[1],
                                .swap = !LOXO_HOST_IS_BIG,
                                .byte = positions.byte + (int64_t)counts[0] * RECORD_BYTES};
    if ((status = loxo_raw_positions(ctx, name, &positions, false, soup)) < 0) goto fail;
    if ((status = loxo_raw_triangles(ctx, name, &triangles, soup)) < 0) goto fail;
    if ((status = loxo_raw_finish(ctx, name, &positions, false, soup)) < 0) goto fail;
    return LOXO_OK;
fail:
    loxo_soup_destroy(ctx, soup);
    return status;
}
