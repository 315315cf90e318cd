/* SPDX-License-Identifier: MIT
 * Wavefront OBJ: lines `v` and `f`; all others are passed over and no other file is ever opened. Three rounds over the
 * chunks: count, put vertices and triangles in place, and where there are polygons cut them, since that needs positions.
 * source  Wavefront Technologies, Advanced Visualizer manual, appendix B1 */
#include "base/allocate.h"
#include "base/context.h"
#include "io/formats.h"
#include "io/text.h"

#include <inttypes.h>

typedef enum obj_round { ROUND_COUNT, ROUND_PUT, ROUND_CUT } obj_round;

typedef struct reading {
    const loxo_text *text;
    loxo_soup *soup;
    obj_round round;
    int64_t n_vertices;  /* of the file, from ROUND_PUT on */
    unsigned char *room; /* of ROUND_CUT: room_bytes a thread */
    size_t room_bytes, corner_bytes;
} reading;

typedef struct line {
    const reading *r;
    loxo_text_chunk *chunk;
    const char *p;
    int64_t n_vertices; /* before this line */
    int64_t face;       /* number of this line's face */
    int thread;
} line;

/* A line goes on behind a backslash at its end. */
static bool may_cut(const loxo_text *text, const char *p)
{
    const char *q = p - 1; /* the line end */
    while (q > text->begin && loxo_is_space(q[-1]) && q[-1] != text->line_end)
        --q;
    return q == text->begin || q[-1] != '\\';
}

/* Over blanks, and over line ends that a backslash takes back. */
static const char *skip(const loxo_text *text, const char *p)
{
    for (;;) {
        p = loxo_text_skip(text, p);
        if (p == text->end || *p != '\\') return p;
        const char *q = loxo_text_skip(text, p + 1);
        if (q == text->end || *q != text->line_end) return p;
        p = q + 1;
    }
}

static const char *next_line(const loxo_text *text, const char *p)
{
    do
        p = loxo_text_next_line(text, p);
    while (p < text->end && !may_cut(text, p));
    return p;
}

static bool is_line_end(const line *l) { return loxo_text_at_line_end(l->r->text, l->p) || *l->p == '#'; }

static bool fault(line *l, loxo_trouble trouble, const char *at, const char *noun, int64_t element, int64_t a,
                  int64_t b)
{
    l->chunk->fault = (loxo_text_fault){.trouble = trouble, .at = at, .noun = noun, .element = element, .a = a, .b = b};
    return false;
}

/* Three coordinates; then none, a weight, a colour, or both, which must be numbers. */
static bool put_vertex(line *l)
{
    const int64_t v = l->n_vertices;
    bool is_finite = true;
    int n = 0;
    for (l->p = skip(l->r->text, l->p); !is_line_end(l); l->p = skip(l->r->text, l->p)) {
        const char *at = l->p;
        double value = 0.0;
        if (n == 7) return fault(l, LOXO_TROUBLE_MANY, at, "vertex", v, 0, 7);
        loxo_scan scan = loxo_scan_double(&l->p, l->r->text->end, &value);
        if (scan == LOXO_SCAN_BAD && l->p > at && l->p[-1] == '\\') { /* the line goes on right behind the number */
            const char *end = l->p - 1;
            l->p = at;
            scan = loxo_scan_double(&l->p, end, &value);
        }
        if (scan == LOXO_SCAN_BAD) return fault(l, LOXO_TROUBLE_NUMBER, at, "vertex", v, 0, 0);
        if (n < 3) {
            l->r->soup->position[3 * v + n] = value;
            is_finite = is_finite && scan == LOXO_SCAN_OK;
        } else {
            l->chunk->n_nonfinite_other += scan != LOXO_SCAN_OK;
        }
        ++n;
    }
    if (n < 3) return fault(l, LOXO_TROUBLE_FEW, l->p, "vertex", v, n, 3);
    l->chunk->n_nonfinite += !is_finite;
    return true;
}

/* v, v/t, v//n or v/t/n; only v is used, and it may count back from the last vertex so far. */
static bool read_corner(line *l, loxo_index *corner)
{
    const loxo_text *text = l->r->text;
    const char *at = l->p;
    int64_t v = 0, other;
    const loxo_scan scan = loxo_scan_int64_prefix(&l->p, text->end, &v);
    if (scan == LOXO_SCAN_BAD) return fault(l, LOXO_TROUBLE_INTEGER, at, "face", l->face, 0, 0);
    for (int i = 0; i < 2 && l->p < text->end && *l->p == '/'; ++i) {
        ++l->p;
        /* Nothing between or behind the slashes is fine. */
        if (l->p == text->end || *l->p == '/' || loxo_is_space(*l->p)) continue;
        if (loxo_scan_int64_prefix(&l->p, text->end, &other) == LOXO_SCAN_BAD)
            return fault(l, LOXO_TROUBLE_INTEGER, at, "face", l->face, 0, 0);
    }
    if (l->p < text->end && !loxo_is_space(*l->p) && *l->p != '\\')
        return fault(l, LOXO_TROUBLE_INTEGER, at, "face", l->face, 0, 0);
    if (scan == LOXO_SCAN_OK && v < 0 && v >= -l->n_vertices) {
        *corner = (loxo_index)(l->n_vertices + v);
        return true;
    }
    if (v < 0) return fault(l, LOXO_TROUBLE_INDEX, at, "face", l->face, -l->n_vertices, -1);
    if (scan != LOXO_SCAN_OK || v < 1 || v > l->r->n_vertices)
        return fault(l, LOXO_TROUBLE_INDEX, at, "face", l->face, 1, l->r->n_vertices);
    *corner = (loxo_index)(v - 1);
    return true;
}

static int64_t count_corners(line *l)
{
    int64_t n = 0;
    for (l->p = skip(l->r->text, l->p); !is_line_end(l); l->p = skip(l->r->text, l->p)) {
        ++n;
        while (l->p < l->r->text->end && !loxo_is_space(*l->p) && *l->p != '\\')
            ++l->p;
        /* A backslash that ends no line would stop here for ever. */
        if (l->p < l->r->text->end && *l->p == '\\' && skip(l->r->text, l->p) == l->p) ++l->p;
    }
    return n;
}

static bool put_face(line *l)
{
    const reading *r = l->r;
    loxo_face_tally *tally = &l->chunk->tally;
    const int64_t at = l->chunk->first_triangle + tally->n_triangles;
    loxo_index few[3] = {0, 0, 0}, *corner = few;
    int64_t n = 0;
    if (r->round == ROUND_CUT) corner = (loxo_index *)(void *)(r->room + (size_t)l->thread * r->room_bytes);
    for (l->p = skip(r->text, l->p); !is_line_end(l); l->p = skip(r->text, l->p), ++n) {
        if (!read_corner(l, r->round == ROUND_CUT ? &corner[n] : &few[n < 3 ? n : 0])) return false;
    }
    if (n == 3) {
        memcpy(&r->soup->triangle[3 * at], corner, 3 * sizeof *corner);
    } else if (n > 3 && r->round == ROUND_CUT &&
               !loxo_polygon_triangulate(r->soup, corner, n, (unsigned char *)corner + r->corner_bytes,
                                         &r->soup->triangle[3 * at]) &&
               tally->n_doubtful++ == 0) {
        tally->first_doubtful = l->face;
    }
    loxo_face_count(tally, l->face, n);
    return true;
}

static bool is_known_keyword(const char *p, size_t n)
{
    static const char *const words[] = {"vt",     "vn",       "vp",       "g",          "s",         "o",     "usemtl",
                                        "mtllib", "l",        "p",        "mg",         "cstype",    "deg",   "bmat",
                                        "step",   "curv",     "surf",     "curv2",      "parm",      "end",   "trim",
                                        "hole",   "scrv",     "sp",       "con",        "bevel",     "lod",   "maplib",
                                        "usemap", "c_interp", "d_interp", "shadow_obj", "trace_obj", "ctech", "stech"};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; ++i) {
        if (strlen(words[i]) == n && memcmp(words[i], p, n) == 0) return true;
    }
    return false;
}

static void count_other(line *l, const char *word)
{
    if (is_known_keyword(word, (size_t)(l->p - word))) return;
    if (l->chunk->n_unknown++ == 0) l->chunk->first_unknown = word;
}

static void read_chunk(void *arg, loxo_text_chunk *chunk, int thread)
{
    const reading *r = arg;
    line l = {.r = r, .chunk = chunk, .p = chunk->begin, .thread = thread};
    l.n_vertices = chunk->first_row;
    l.face = chunk->first_face;
    chunk->tally = (loxo_face_tally){0};
    while (l.p < chunk->end) {
        l.p = loxo_text_skip(r->text, l.p);
        const char *word = l.p;
        if (!is_line_end(&l)) {
            l.p = loxo_token_end(l.p, r->text->end);
            if (l.p - word == 1 && *word == 'v') {
                if (r->round == ROUND_PUT && !put_vertex(&l)) return;
                ++l.n_vertices;
            } else if (l.p - word == 1 && *word == 'f') {
                if (r->round == ROUND_COUNT)
                    loxo_face_count(&chunk->tally, l.face, count_corners(&l));
                else if (!put_face(&l))
                    return;
                ++l.face;
            } else if (r->round == ROUND_COUNT) {
                count_other(&l, word);
            }
        }
        l.p = next_line(r->text, l.p);
    }
    chunk->n_rows = l.n_vertices - chunk->first_row;
    chunk->n_faces = l.face - chunk->first_face;
}

static int64_t find_vertex_line(const reading *r, const loxo_text_chunks *chunks, int64_t vertex)
{
    int64_t i = 0, n;
    const char *p;
    while (i + 1 < chunks->n && chunks->chunk[i + 1].first_row <= vertex)
        ++i;
    n = chunks->chunk[i].first_row;
    for (p = chunks->chunk[i].begin; p < chunks->chunk[i].end; p = next_line(r->text, p)) {
        p = loxo_text_skip(r->text, p);
        if (*p == 'v' && loxo_token_end(p, r->text->end) - p == 1 && n++ == vertex) break;
    }
    return loxo_text_line_number(r->text, p);
}

static loxo_status finish(loxo_context *ctx, const reading *r, const loxo_text_chunks *chunks,
                          const loxo_face_tally *tally)
{
    int64_t n_nonfinite = 0, n_other = 0, n_unknown = 0;
    const char *first_unknown = NULL;
    for (int64_t i = 0; i < chunks->n; ++i) {
        n_nonfinite += chunks->chunk[i].n_nonfinite;
        n_other += chunks->chunk[i].n_nonfinite_other;
        n_unknown += chunks->chunk[i].n_unknown;
        if (first_unknown == NULL) first_unknown = chunks->chunk[i].first_unknown;
    }
    const int64_t bad = n_nonfinite == 0 ? -1 : loxo_soup_first_used_nonfinite(ctx, r->soup);
    if (bad >= 0)
        return loxo_fail_nonfinite(
            ctx, (loxo_place){.file = r->text->name, .line = find_vertex_line(r, chunks, bad), .byte = -1}, r->soup,
            bad);
    if (n_unknown > 0) {
        const char *end = loxo_token_end(first_unknown, r->text->end);
        loxo_warn(ctx, "obj-unknown", n_unknown,
                  "%s: %" PRId64 " lines of an unknown kind are skipped (first: line %" PRId64 ", \"%.*s\")",
                  r->text->name, n_unknown, loxo_text_line_number(r->text, first_unknown),
                  end - first_unknown > 20 ? 20 : (int)(end - first_unknown), first_unknown);
    }
    if (n_other > 0)
        loxo_warn(ctx, "value-nonfinite", n_other, "%s: %" PRId64 " colours or weights that are not finite",
                  r->text->name, n_other);
    loxo_face_tally_warn(ctx, r->text->name, tally);
    loxo_soup_warn(ctx, r->text->name, r->soup, n_nonfinite);
    return LOXO_OK;
}

static loxo_status cut_polygons(loxo_context *ctx, reading *r, loxo_text_chunks *chunks, loxo_face_tally *tally)
{
    int64_t n_rows, n_faces;
    int n_threads = loxo_text_max_threads(ctx, chunks);
    r->round = ROUND_CUT;
    r->corner_bytes = ((size_t)tally->max_corners * sizeof(loxo_index) + 63) / 64 * 64;
    r->room_bytes = r->corner_bytes + (loxo_polygon_room_bytes(tally->max_corners) + 63) / 64 * 64;
    if (r->room_bytes > (size_t)1 << 22) n_threads = 1; /* a giant among the polygons: its workspace only once */
    r->room = loxo_allocate(ctx, n_threads, r->room_bytes);
    if (r->room == NULL) return LOXO_ERR_MEMORY;
    const loxo_status status = loxo_text_parse(ctx, chunks, read_chunk, r, n_threads, "parse");
    loxo_text_add_up(chunks, &n_rows, &n_faces, tally);
    loxo_release(ctx, r->room);
    return status;
}

static loxo_status read_all(loxo_context *ctx, reading *r, loxo_text_chunks *chunks)
{
    const int n_threads = loxo_text_max_threads(ctx, chunks);
    int64_t n_faces;
    loxo_face_tally tally;
    loxo_status status = loxo_text_parse(ctx, chunks, read_chunk, r, n_threads, "parse");
    if (status < 0) return status;
    loxo_text_add_up(chunks, &r->n_vertices, &n_faces, &tally);
    if (r->n_vertices == 0 && n_faces == 0)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.file = r->text->name, .byte = -1, .element = -1},
                            "no `v` and no `f` line: this is no OBJ file");
    if ((status = loxo_soup_allocate_vertices(ctx, r->soup, r->n_vertices, false)) < 0) return status;
    if ((status = loxo_soup_allocate_triangles(ctx, r->soup, tally.n_triangles)) < 0) return status;
    r->round = ROUND_PUT;
    if ((status = loxo_text_parse(ctx, chunks, read_chunk, r, n_threads, "parse")) < 0) return status;
    const loxo_text_fault *first = loxo_text_first_fault(chunks);
    if (first != NULL) return loxo_text_fail(ctx, r->text, first, NULL);
    if (tally.max_corners > 3 && (status = cut_polygons(ctx, r, chunks, &tally)) < 0) return status;
    return finish(ctx, r, chunks, &tally);
}

loxo_status loxo_read_obj(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name, loxo_soup *soup)
{
    const loxo_text text = loxo_text_of(bytes, n, name);
    reading r = {.text = &text, .soup = soup};
    loxo_text_chunks chunks = {0};
    *soup = (loxo_soup){0};
    loxo_status status = loxo_text_split(ctx, &text, text.begin, may_cut, &chunks);
    if (status >= 0) status = read_all(ctx, &r, &chunks);
    loxo_text_chunks_destroy(ctx, &chunks);
    if (status >= 0) return LOXO_OK;
    loxo_failure_set_file(ctx, name);
    loxo_soup_destroy(ctx, soup);
    return status;
}
