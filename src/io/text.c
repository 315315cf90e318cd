/* SPDX-License-Identifier: MIT */
#include "io/text.h"

#include "base/allocate.h"
#include "base/context.h"
#include "par/range.h"

#include <inttypes.h>
#include <stdio.h>

#define CHUNK_BYTES ((int64_t)1 << 17)
#define WAVE_CHUNKS 512 /* between two looks at the monitor */
#define NS_PER_BYTE 2.0
#define MAX_QUOTED  40

loxo_text loxo_text_of(const uint8_t *bytes, size_t n, const char *name)
{
    const char *begin = (const char *)bytes, *end = begin + n;
    loxo_text text = {.begin = begin, .end = end, .name = name, .line_end = '\n'};
    if (n >= 3 && memcmp(bytes, "\xef\xbb\xbf", 3) == 0) text.begin += 3;
    for (const char *p = text.begin; p < end && *p != '\n'; ++p) {
        if (*p != '\r') continue;
        if (p + 1 == end || p[1] != '\n') text.line_end = '\r';
        break;
    }
    return text;
}

int64_t loxo_text_line_number(const loxo_text *text, const char *at)
{
    int64_t line = 1;
    for (const char *p = text->begin; p < at; ++p)
        line += *p == text->line_end;
    return line;
}

/* ---- faults -------------------------------------------------------------------------------------------------- */

loxo_status loxo_text_fail(loxo_context *ctx, const loxo_text *text, const loxo_text_fault *fault, const char *hint)
{
    const loxo_place place = {.file = text->name,
                              .line = loxo_text_line_number(text, fault->at),
                              .byte = -1,
                              .element = fault->noun != NULL ? fault->element : -1};
    const char *token_end = loxo_token_end(fault->at, text->end);
    const char *zero = memchr(fault->at, 0, (size_t)(token_end - fault->at));
    const int n = token_end - fault->at > MAX_QUOTED ? MAX_QUOTED : (int)(token_end - fault->at);
    const char *dots = token_end - fault->at > MAX_QUOTED ? "..." : "";
    char who[64] = "";
    if (fault->noun != NULL) snprintf(who, sizeof who, "%s %" PRId64 ": ", fault->noun, fault->element);
    if (hint == NULL) hint = "";
    if (zero != NULL && fault->trouble != LOXO_TROUBLE_FEW && fault->trouble != LOXO_TROUBLE_MANY)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "%sa NUL byte in text (UTF-16, or a binary file?)", who);
    switch (fault->trouble) {
    case LOXO_TROUBLE_NONE: break;
    case LOXO_TROUBLE_NUMBER:
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "%s\"%.*s%s\" is not a number%s", who, n, fault->at, dots,
                            hint);
    case LOXO_TROUBLE_INTEGER:
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "%s\"%.*s%s\" is not an integer%s", who, n, fault->at, dots,
                            hint);
    case LOXO_TROUBLE_INDEX:
        if (fault->b < fault->a)
            return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "%svertex index %.*s%s, but there are no vertices%s",
                                who, n, fault->at, dots, hint);
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "%svertex index %.*s%s not in %" PRId64 "..%" PRId64 "%s",
                            who, n, fault->at, dots, fault->a, fault->b, hint);
    case LOXO_TROUBLE_LENGTH:
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "%s\"%.*s%s\" is not the length of a list%s", who, n,
                            fault->at, dots, hint);
    case LOXO_TROUBLE_FEW:
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "%s%" PRId64 " values where %" PRId64 " are needed%s", who,
                            fault->a, fault->b, hint);
    case LOXO_TROUBLE_MANY:
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "%smore than %" PRId64 " values%s", who, fault->b, hint);
    case LOXO_TROUBLE_SYNTAX: break;
    }
    return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "%s%s%s", who, fault->what, hint);
}

/* ---- chunks -------------------------------------------------------------------------------------------------- */

/* The first place for a cut at or behind p, which is no line's first byte unless luck has it. */
static const char *next_cut(const loxo_text *text, const char *p, loxo_text_may_cut_fn may_cut)
{
    do
        p = loxo_text_next_line(text, p);
    while (p < text->end && may_cut != NULL && !may_cut(text, p));
    return p;
}

loxo_status loxo_text_split(loxo_context *ctx, const loxo_text *text, const char *from, loxo_text_may_cut_fn may_cut,
                            loxo_text_chunks *chunks)
{
    const int64_t n_bytes = text->end - from;
    chunks->n = n_bytes / CHUNK_BYTES + 1;
    chunks->chunk = loxo_allocate_zero(ctx, chunks->n, sizeof *chunks->chunk);
    if (chunks->chunk == NULL) return LOXO_ERR_MEMORY;
    /* A line over many chunks is looked through once: chunks inside it are empty. */
    const char *begin = from;
    for (int64_t i = 0; i < chunks->n; ++i) {
        const int64_t nominal = (i + 1) * CHUNK_BYTES;
        const char *end = text->end;
        if (i + 1 < chunks->n) end = from + nominal <= begin ? begin : next_cut(text, from + nominal - 1, may_cut);
        chunks->chunk[i].begin = begin;
        chunks->chunk[i].end = end;
        begin = end;
    }
    return LOXO_OK;
}

void loxo_text_chunks_destroy(loxo_context *ctx, loxo_text_chunks *chunks)
{
    loxo_release(ctx, chunks->chunk);
    *chunks = (loxo_text_chunks){0};
}

int loxo_text_max_threads(const loxo_context *ctx, const loxo_text_chunks *chunks)
{
    const int n = loxo_threads_for(ctx, chunks->n, NS_PER_BYTE * (double)CHUNK_BYTES);
    return chunks->n < n ? (int)chunks->n : n;
}

loxo_status loxo_text_parse(loxo_context *ctx, loxo_text_chunks *chunks, loxo_text_parse_fn parse, void *arg,
                            int max_threads, const char *phase)
{
    for (int64_t begin = 0; begin < chunks->n; begin += WAVE_CHUNKS) {
        const int64_t n = chunks->n - begin < WAVE_CHUNKS ? chunks->n - begin : WAVE_CHUNKS;
#pragma omp parallel num_threads(max_threads)
        {
            const int thread = loxo_thread_id();
#pragma omp for schedule(dynamic, 1)
            for (int64_t i = begin; i < begin + n; ++i)
                parse(arg, &chunks->chunk[i], thread);
        }
        if (loxo_stop_wanted(ctx, phase, (double)(begin + n) / (double)chunks->n))
            return loxo_fail(ctx, LOXO_ERR_STOPPED, "stopped while parsing");
    }
    return LOXO_OK;
}

const loxo_text_fault *loxo_text_first_fault(const loxo_text_chunks *chunks)
{
    for (int64_t i = 0; i < chunks->n; ++i) {
        if (chunks->chunk[i].fault.trouble != LOXO_TROUBLE_NONE) return &chunks->chunk[i].fault;
    }
    return NULL;
}

void loxo_text_add_up(loxo_text_chunks *chunks, int64_t *n_rows, int64_t *n_faces, loxo_face_tally *tally)
{
    *n_rows = *n_faces = 0;
    *tally = (loxo_face_tally){0};
    for (int64_t i = 0; i < chunks->n; ++i) {
        loxo_text_chunk *c = &chunks->chunk[i];
        c->first_row = *n_rows;
        c->first_face = *n_faces;
        c->first_triangle = tally->n_triangles;
        *n_rows += c->n_rows;
        *n_faces += c->n_faces;
        loxo_face_tally_add(tally, &c->tally);
    }
}
