/* SPDX-License-Identifier: MIT
 * STL, binary and text: triangles with their corners spelled out, which are joined where their bits agree.
 * source  3D Systems 1989, Stereolithography Interface Specification */
#include "base/allocate.h"
#include "base/context.h"
#include "io/bytes.h"
#include "io/formats.h"
#include "io/text.h"
#include "io/weld.h"
#include "par/range.h"

#include <inttypes.h>

#define HEADER_BYTES 84
#define FACET_BYTES  LOXO_STL_FACET_BYTES

/* ---- binary -------------------------------------------------------------------------------------------------- */

static loxo_status read_binary(loxo_context *ctx, const uint8_t *bytes, int64_t n, const char *name, loxo_soup *soup)
{
    const int64_t n_found = (n - HEADER_BYTES) / FACET_BYTES;
    const int64_t n_facets = n < HEADER_BYTES ? 0 : (int64_t)loxo_load_u32(bytes + 80, LOXO_HOST_IS_BIG);
    const loxo_place end = {.file = name, .byte = n, .element = n_found};
    int64_t bad = INT64_MAX, n_normals = 0;
    if (n < HEADER_BYTES)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.file = name, .byte = n, .element = -1},
                            "%" PRId64 " bytes are too few for a binary STL, and it is no text that begins with solid",
                            n);
    if (n_facets > n_found) {
        const int64_t swapped = (int64_t)loxo_load_u32(bytes + 80, !LOXO_HOST_IS_BIG);
        if (HEADER_BYTES + FACET_BYTES * swapped == n)
            return loxo_fail_at(ctx, LOXO_ERR_UNSUPPORTED, (loxo_place){.file = name, .byte = 80, .element = -1},
                                "a binary STL of the wrong byte order (big-endian): STL is little-endian");
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, end,
                            "the file ends early: %" PRId64 " facets declared, %" PRId64 " found (byte order?)",
                            n_facets, n_found);
    }
    const loxo_corners corners = {.facet = bytes + HEADER_BYTES, .n_facets = n_facets};
#pragma omp parallel num_threads(loxo_threads_for(ctx, n_facets, 10.0)) reduction(min : bad) reduction(+ : n_normals)
    {
        const loxo_range range = loxo_thread_range(n_facets);
        for (int64_t f = range.begin; f < range.end; ++f) {
            const uint8_t *p = bytes + HEADER_BYTES + FACET_BYTES * f;
            bool is_finite = true;
            for (int i = 0; i < 3; ++i) {
                const float x = loxo_load_float(p + (ptrdiff_t)4 * i, LOXO_HOST_IS_BIG);
                is_finite = is_finite && x - x == 0.0f;
            }
            n_normals += !is_finite;
            for (int i = 0; i < 3; ++i) {
                float q[3];
                loxo_corner_floats(&corners, 3 * f + i, q);
                is_finite = q[0] - q[0] == 0.0f && q[1] - q[1] == 0.0f && q[2] - q[2] == 0.0f;
                if (!is_finite && 3 * f + i < bad) bad = 3 * f + i;
            }
        }
    }
    if (bad != INT64_MAX)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED,
                            (loxo_place){.file = name,
                                         .byte = HEADER_BYTES + FACET_BYTES * (bad / 3) + 12 + 12 * (bad % 3),
                                         .element = bad / 3},
                            "face %" PRId64 ": corner %d has a coordinate that is not finite", bad / 3, (int)(bad % 3));
    if (HEADER_BYTES + FACET_BYTES * n_facets < n)
        loxo_warn(ctx, "trailing", n - HEADER_BYTES - FACET_BYTES * n_facets,
                  "%s: %" PRId64 " bytes behind the last facet are ignored", name,
                  n - HEADER_BYTES - FACET_BYTES * n_facets);
    if (n_normals > 0)
        loxo_warn(ctx, "value-nonfinite", n_normals, "%s: %" PRId64 " normals are not finite", name, n_normals);
    return loxo_weld(ctx, &corners, soup);
}

/* ---- text ---------------------------------------------------------------------------------------------------- */

typedef struct reading {
    const loxo_text *text;
    double *corner; /* [facets][9]; NULL: only counts */
} reading;

typedef struct facet_scan {
    const reading *r;
    loxo_text_chunk *chunk;
    const char *p;
    int64_t face;
} facet_scan;

/* Chunks begin with a facet. */
static bool may_cut(const loxo_text *text, const char *p)
{
    p = loxo_text_skip(text, p);
    return loxo_starts_with(p, text->end, "facet") && loxo_token_end(p, text->end) - p == 5;
}

static const char *next_token(const loxo_text *text, const char *p)
{
    while (p < text->end && loxo_is_space(*p))
        ++p;
    return p;
}

static bool fault(facet_scan *s, loxo_trouble trouble, const char *at, const char *what)
{
    s->chunk->fault = (loxo_text_fault){.trouble = trouble, .at = at, .noun = "face", .element = s->face, .what = what};
    return false;
}

static bool is_word(const char *p, const char *end, const char *word)
{
    return (size_t)(end - p) == strlen(word) && loxo_starts_with(p, end, word);
}

static bool take_word(facet_scan *s, const char *word, const char *what)
{
    const char *at = next_token(s->r->text, s->p);
    s->p = loxo_token_end(at, s->r->text->end);
    return is_word(at, s->p, word) || fault(s, LOXO_TROUBLE_SYNTAX, at, what);
}

static bool take_number(facet_scan *s, bool is_lenient, double *value, bool *is_finite)
{
    const char *at = next_token(s->r->text, s->p);
    s->p = at;
    if (at == s->r->text->end) return fault(s, LOXO_TROUBLE_SYNTAX, at, "the file ends inside a facet");
    if (s->r->corner == NULL) {
        s->p = loxo_token_end(at, s->r->text->end);
        return true;
    }
    const loxo_scan scan = loxo_scan_double(&s->p, s->r->text->end, value);
    *is_finite = *is_finite && scan == LOXO_SCAN_OK;
    return scan != LOXO_SCAN_BAD || is_lenient || fault(s, LOXO_TROUBLE_NUMBER, at, NULL);
}

/* Behind "facet". */
static bool take_facet(facet_scan *s)
{
    double unused, corner[9];
    bool has_normal = true;
    if (!take_word(s, "normal", "\"normal\" expected behind \"facet\"")) return false;
    for (int i = 0; i < 3; ++i) {
        if (!take_number(s, true, &unused, &has_normal)) return false;
    }
    if (!take_word(s, "outer", "\"outer loop\" expected") || !take_word(s, "loop", "\"outer loop\" expected"))
        return false;
    for (int v = 0; v < 3; ++v) {
        bool is_finite = true;
        if (!take_word(s, "vertex", "three times \"vertex\" expected in a loop")) return false;
        const char *at = next_token(s->r->text, s->p);
        for (int i = 0; i < 3; ++i) {
            if (!take_number(s, false, &corner[3 * v + i], &is_finite)) return false;
        }
        if (!is_finite) return fault(s, LOXO_TROUBLE_SYNTAX, at, "a corner has a coordinate that is not finite");
    }
    if (!take_word(s, "endloop", "\"endloop\" expected behind three vertices")) return false;
    if (!take_word(s, "endfacet", "\"endfacet\" expected")) return false;
    if (s->r->corner != NULL) memcpy(&s->r->corner[9 * s->face], corner, sizeof corner);
    s->chunk->n_nonfinite_other += !has_normal;
    return true;
}

/* Counts faces in n_faces and solids left open in n_rows, which is negative where a chunk closes one of before. */
static void read_chunk(void *arg, loxo_text_chunk *chunk, int thread)
{
    const reading *r = arg;
    facet_scan s = {.r = r, .chunk = chunk, .face = chunk->first_face};
    (void)thread;
    chunk->fault = (loxo_text_fault){.trouble = LOXO_TROUBLE_NONE};
    chunk->n_rows = 0;
    for (s.p = next_token(r->text, chunk->begin); s.p < chunk->end; s.p = next_token(r->text, s.p)) {
        const char *at = s.p;
        s.p = loxo_token_end(at, r->text->end);
        if (is_word(at, s.p, "facet")) {
            if (!take_facet(&s)) break;
            ++s.face;
        } else if (is_word(at, s.p, "solid") || is_word(at, s.p, "endsolid")) {
            chunk->n_rows += is_word(at, s.p, "solid") ? 1 : -1;
            s.p = loxo_text_next_line(r->text, s.p); /* the name may be any words */
        } else {
            fault(&s, LOXO_TROUBLE_SYNTAX, at, "\"facet\", \"solid\" or \"endsolid\" expected");
            break;
        }
    }
    chunk->n_faces = s.face - chunk->first_face;
}

/* What is wrong with the whole, and odd. */
static loxo_status judge_text(loxo_context *ctx, const loxo_text *text, const loxo_text_chunks *chunks, int64_t n_open,
                              int64_t n_faces)
{
    int64_t n_normals = 0;
    const loxo_text_fault *first = loxo_text_first_fault(chunks);
    if (first != NULL) return loxo_text_fail(ctx, text, first, NULL);
    if (n_open > 0)
        return loxo_fail_at(
            ctx, LOXO_ERR_MALFORMED,
            (loxo_place){
                .file = text->name, .line = loxo_text_line_number(text, text->end), .byte = -1, .element = n_faces},
            "the file ends early: no \"endsolid\" behind %" PRId64 " facets", n_faces);
    for (int64_t i = 0; i < chunks->n; ++i)
        n_normals += chunks->chunk[i].n_nonfinite_other;
    if (n_normals > 0)
        loxo_warn(ctx, "value-nonfinite", n_normals, "%s: %" PRId64 " normals are not finite", text->name, n_normals);
    return LOXO_OK;
}

static loxo_status read_text(loxo_context *ctx, const loxo_text *text, loxo_text_chunks *chunks, loxo_soup *soup)
{
    const int n_threads = loxo_text_max_threads(ctx, chunks);
    int64_t n_open, n_faces;
    loxo_face_tally tally;
    loxo_status status = loxo_text_parse(ctx, chunks, read_chunk, &(reading){text, NULL}, n_threads, "parse");
    if (status < 0) return status;
    loxo_text_add_up(chunks, &n_open, &n_faces, &tally);
    double *corner = loxo_allocate(ctx, n_faces, 9 * sizeof *corner);
    if (corner == NULL) return LOXO_ERR_MEMORY;
    status = loxo_text_parse(ctx, chunks, read_chunk, &(reading){text, corner}, n_threads, "parse");
    if (status >= 0) status = judge_text(ctx, text, chunks, n_open, n_faces);
    if (status >= 0) status = loxo_weld(ctx, &(loxo_corners){.position = corner, .n_facets = n_faces}, soup);
    loxo_release(ctx, corner);
    return status;
}

/* A binary file's size agrees with its count, also when its header happens to say solid. */
static bool is_text(const loxo_text *text, const uint8_t *bytes, size_t n)
{
    if (n >= HEADER_BYTES &&
        (uint64_t)n == HEADER_BYTES + (uint64_t)FACET_BYTES * loxo_load_u32(bytes + 80, LOXO_HOST_IS_BIG))
        return false;
    return loxo_starts_with(next_token(text, text->begin), text->end, "solid") &&
           memchr(bytes, 0, n < 512 ? n : 512) == NULL;
}

loxo_status loxo_read_stl(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup)
{
    const loxo_text text = loxo_text_of(bytes, n, name);
    loxo_status status;
    *soup = (loxo_soup){0};
    if (is_text(&text, bytes, n)) {
        loxo_text_chunks chunks = {0};
        status = loxo_text_split(ctx, &text, text.begin, may_cut, &chunks);
        if (status >= 0) status = read_text(ctx, &text, &chunks, soup);
        loxo_text_chunks_destroy(ctx, &chunks);
    } else {
        status = read_binary(ctx, bytes, (int64_t)n, name, soup);
    }
    if (status >= 0) {
        loxo_soup_warn(ctx, name, soup, 0);
        return LOXO_OK;
    }
    loxo_failure_set_file(ctx, name);
    loxo_soup_destroy(ctx, soup);
    return status;
}
