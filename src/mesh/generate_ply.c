/* SPDX-License-Identifier: MIT
 * A generated mesh written as binary PLY while it is made: two blocks of memory, whatever its size. Numbers are written
 * as they stand in memory, and the header names this machine's byte order. */
#include "base/allocate.h"
#include "base/context.h"
#include "base/os.h"
#include "mesh/generate_internal.h"
#include "par/range.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
#define BYTE_ORDER_NAME "big"
#else
#define BYTE_ORDER_NAME "little"
#endif

/* Elements a block: 6 MB of positions, 3.3 MB of faces, enough for the threads and small for a cache. */
#define BLOCK ((int64_t)1 << 18)
/* uchar 3 and three ints. */
#define FACE_BYTES 13

typedef struct ply_stream {
    loxo_context *ctx;
    const loxo_generator *g;
    bool is_float;
    loxo_os_output output;
    loxo_index (*triangle)[3]; /* [BLOCK] */
    unsigned char *bytes;      /* [BLOCK] of the larger record */
} ply_stream;

static loxo_status write_header(ply_stream *s)
{
    char text[512];
    const char *type = s->is_float ? "float" : "double";
    const int n = snprintf(text, sizeof text,
                           "ply\nformat binary_" BYTE_ORDER_NAME "_endian 1.0\ncomment loxo %s\n"
                           "element vertex %" PRId64 "\nproperty %s x\nproperty %s y\nproperty %s z\n"
                           "element face %" PRId64 "\nproperty list uchar int vertex_indices\nend_header\n",
                           loxo_shape_name(s->g->shape), s->g->n_vertices, type, type, type, s->g->n_faces);
    return loxo_os_output_write(s->ctx, &s->output, text, (size_t)n);
}

static bool stop_wanted(const ply_stream *s, int64_t n_done)
{
    return loxo_stop_wanted(s->ctx, "generate", (double)n_done / (double)(s->g->n_vertices + s->g->n_faces));
}

static loxo_status write_vertices(ply_stream *s)
{
    const int64_t n = s->g->n_vertices;
    const size_t n_row = 3 * (s->is_float ? sizeof(float) : sizeof(double));
    for (int64_t begin = 0; begin < n; begin += BLOCK) {
        const int64_t end = begin + BLOCK < n ? begin + BLOCK : n;
        if (stop_wanted(s, begin)) return loxo_fail(s->ctx, LOXO_ERR_STOPPED, "generate: stopped");
        if (s->is_float)
            loxo_generator_float_positions(s->ctx, s->g, begin, end, (float(*)[3])(void *)s->bytes);
        else
            loxo_generator_positions(s->ctx, s->g, begin, end, (double(*)[3])(void *)s->bytes);
        const loxo_status status = loxo_os_output_write(s->ctx, &s->output, s->bytes, (size_t)(end - begin) * n_row);
        if (status < 0) return status;
    }
    return LOXO_OK;
}

static loxo_status write_faces(ply_stream *s)
{
    const int64_t n = s->g->n_faces;
    for (int64_t begin = 0; begin < n; begin += BLOCK) {
        const int64_t count = begin + BLOCK < n ? BLOCK : n - begin;
        const int n_threads = loxo_threads_for(s->ctx, count, 2.0);
        if (stop_wanted(s, s->g->n_vertices + begin)) return loxo_fail(s->ctx, LOXO_ERR_STOPPED, "generate: stopped");
        loxo_generator_faces(s->ctx, s->g, begin, begin + count, s->triangle);
#pragma omp parallel num_threads(n_threads)
        {
            const loxo_range r = loxo_thread_range(count);
            for (int64_t f = r.begin; f < r.end; ++f) {
                const int32_t corner[3] = {s->triangle[f][0], s->triangle[f][1], s->triangle[f][2]};
                s->bytes[FACE_BYTES * f] = 3;
                memcpy(s->bytes + FACE_BYTES * f + 1, corner, sizeof corner);
            }
        }
        const loxo_status status = loxo_os_output_write(s->ctx, &s->output, s->bytes, (size_t)count * FACE_BYTES);
        if (status < 0) return status;
    }
    return LOXO_OK;
}

loxo_status loxo_generate_to_ply(loxo_context *ctx, const loxo_generate_settings *settings, bool is_float,
                                 const char *path, int64_t *n_vertices, int64_t *n_faces)
{
    loxo_generator g;
    ply_stream s = {.ctx = ctx, .g = &g, .is_float = is_float};
    loxo_status status;
    if (settings == NULL || path == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "generate: NULL argument");
    if ((status = loxo_generator_make(ctx, settings, &g)) < 0) return status;
    loxo_progress_begin(ctx);
    s.triangle = loxo_allocate(ctx, BLOCK, sizeof *s.triangle);
    s.bytes = loxo_allocate(ctx, BLOCK, 3 * sizeof(double));
    if (s.triangle == NULL || s.bytes == NULL) {
        status = LOXO_ERR_MEMORY;
        goto done;
    }
    if ((status = loxo_os_output_create(ctx, path, &s.output)) < 0) goto done;
    status = write_header(&s);
    if (status >= 0) status = write_vertices(&s);
    if (status >= 0) status = write_faces(&s);
    if (status >= 0) status = loxo_os_output_commit(ctx, &s.output);
    loxo_os_output_abandon(&s.output);
    if (status >= 0 && n_vertices != NULL) *n_vertices = g.n_vertices;
    if (status >= 0 && n_faces != NULL) *n_faces = g.n_faces;
done:
    loxo_release(ctx, s.bytes);
    loxo_release(ctx, s.triangle);
    return status;
}
