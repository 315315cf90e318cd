/* SPDX-License-Identifier: MIT
 * The bytes of a file, pipe or standard input from first to last, unpacked where gzip packed them, in memory that does
 * not grow with them. */
#ifndef LOXO_IO_FLOW_H
#define LOXO_IO_FLOW_H

#include "base/os.h"

typedef struct loxo_flow {
    loxo_context *ctx;
    const char *name; /* the path; stays the caller's */
    loxo_os_file file;
    uint8_t *buffer; /* raw bytes that came and were not used yet: buffer[at..n_buffer - 1] */
    size_t at, n_buffer;
    int64_t n_raw; /* raw bytes so far, those in the buffer included */
    bool is_packed, is_done;
    struct loxo_unpacker *unpacker;
} loxo_flow;

/* Opens path ("-": standard input). loxo_flow_close is fine after a failure too. */
loxo_status loxo_flow_open(loxo_context *ctx, const char *path, loxo_flow *flow);
void loxo_flow_close(loxo_flow *flow);

/* The next bytes: n of them, fewer only at the end.
 * returns  LOXO_OK; LOXO_ERR_READ, LOXO_ERR_MALFORMED (packed data that is cut or wrong), LOXO_ERR_UNSUPPORTED (a build
 *          without zlib), LOXO_ERR_MEMORY, LOXO_ERR_STOPPED */
loxo_status loxo_flow_read(loxo_flow *flow, uint8_t *bytes, size_t n, size_t *got);

#endif
