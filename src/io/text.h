/* SPDX-License-Identifier: MIT
 * Text of a file, cut at line ends into chunks that threads parse side by side. The cuts depend on the text alone, and
 * of several faults the first in the file is told, so that results and messages are the same for any thread count. */
#ifndef LOXO_IO_TEXT_H
#define LOXO_IO_TEXT_H

#include "io/faces.h"
#include "io/scan.h"

#include <loxo/context.h>

#include <string.h>

typedef struct loxo_text {
    const char *begin, *end; /* begin: line 1, behind a byte order mark */
    const char *name;
    char line_end; /* '\r' where the first line ends so, else '\n'; the other one is a blank then */
} loxo_text;

loxo_text loxo_text_of(const uint8_t *bytes, size_t n, const char *name);

/* Over blanks, within the line. */
static inline const char *loxo_text_skip(const loxo_text *text, const char *p)
{
    while (p < text->end && loxo_is_space(*p) && *p != text->line_end)
        ++p;
    return p;
}

static inline bool loxo_text_at_line_end(const loxo_text *text, const char *p)
{
    return p >= text->end || *p == text->line_end;
}

static inline const char *loxo_text_next_line(const loxo_text *text, const char *p)
{
    const char *found = p < text->end ? memchr(p, text->line_end, (size_t)(text->end - p)) : NULL;
    return found == NULL ? text->end : found + 1;
}

int64_t loxo_text_line_number(const loxo_text *text, const char *at);

/* ---- faults -------------------------------------------------------------------------------------------------- */

typedef enum loxo_trouble {
    LOXO_TROUBLE_NONE,
    LOXO_TROUBLE_NUMBER,  /* the token there is no number */
    LOXO_TROUBLE_INTEGER, /* the token there is no integer */
    LOXO_TROUBLE_INDEX,   /* the token there is a vertex index outside a..b */
    LOXO_TROUBLE_LENGTH,  /* the token there is no length of a list */
    LOXO_TROUBLE_FEW,     /* a values where b are needed */
    LOXO_TROUBLE_MANY,    /* more than b values */
    LOXO_TROUBLE_SYNTAX,  /* what says it */
} loxo_trouble;

typedef struct loxo_text_fault {
    loxo_trouble trouble;
    const char *at;   /* in the text */
    const char *noun; /* "vertex", "face", or NULL */
    int64_t element;
    int64_t a, b;
    const char *what;
} loxo_text_fault;

/* Makes the failure of a fault: line, element, one sentence. hint may be NULL. */
loxo_status loxo_text_fail(loxo_context *ctx, const loxo_text *text, const loxo_text_fault *fault, const char *hint);

/* ---- chunks -------------------------------------------------------------------------------------------------- */

typedef struct loxo_text_chunk {
    const char *begin, *end;
    int64_t n_rows, first_row;              /* lines that carry something; in OBJ: vertices */
    int64_t n_faces, first_face;            /* where the format needs them apart from rows */
    int64_t first_triangle;                 /* tally.n_triangles, added up over the chunks before */
    int64_t n_nonfinite, n_nonfinite_other; /* vertices with a coordinate, other numbers, that are no finite numbers */
    int64_t n_unknown;                      /* lines of an unknown kind */
    const char *first_unknown;
    loxo_face_tally tally;
    loxo_text_fault fault;
} loxo_text_chunk;

typedef struct loxo_text_chunks {
    loxo_text_chunk *chunk; /* [n] */
    int64_t n;
} loxo_text_chunks;

/* Where a chunk may begin: at p, which follows a line end. NULL: anywhere. */
typedef bool (*loxo_text_may_cut_fn)(const loxo_text *text, const char *p);

loxo_status loxo_text_split(loxo_context *ctx, const loxo_text *text, const char *from, loxo_text_may_cut_fn may_cut,
                            loxo_text_chunks *chunks);
void loxo_text_chunks_destroy(loxo_context *ctx, loxo_text_chunks *chunks);

/* Calls parse for every chunk, in parallel; thread is in 0..n_threads-1 of the region.
 * returns  LOXO_OK, LOXO_ERR_STOPPED. Faults stay in the chunks. */
typedef void (*loxo_text_parse_fn)(void *arg, loxo_text_chunk *chunk, int thread);
loxo_status loxo_text_parse(loxo_context *ctx, loxo_text_chunks *chunks, loxo_text_parse_fn parse, void *arg,
                            int max_threads, const char *phase);

/* Most threads that loxo_text_parse takes. */
int loxo_text_max_threads(const loxo_context *ctx, const loxo_text_chunks *chunks);

/* The first fault, NULL when there is none. */
const loxo_text_fault *loxo_text_first_fault(const loxo_text_chunks *chunks);

/* Adds up rows, faces and triangles of the chunks before each. */
void loxo_text_add_up(loxo_text_chunks *chunks, int64_t *n_rows, int64_t *n_faces, loxo_face_tally *tally);

#endif
