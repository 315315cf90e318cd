/* SPDX-License-Identifier: MIT
 * Borders of Connectome Workbench, version 3: BorderFile > Class > Border > BorderPart > Vertices, Weights. */
#include "base/allocate.h"
#include "io/landmarks.h"
#include "io/scan.h"
#include "io/xml.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

#ifdef LOXO_WITH_EXPAT

/* Text of an element. */
typedef struct list {
    char *text;
    int64_t n, capacity;
    int64_t line; /* where it begins */
    bool is_there;
} list;

typedef struct parsing {
    loxo_xml xml;
    int64_t n_vertices, first_point;
    loxo_landmarks *landmarks;
    bool in_border, in_part;
    bool is_closed;
    char name[64]; /* of the border */
    list vertices, weights;
    list *filling; /* NULL: text is passed over */
} parsing;

static loxo_status fail_at_token(const parsing *p, const list *from, const char *token, const char *what)
{
    const char *end = loxo_token_end(token, from->text + from->n);
    loxo_place place = {
        .file = p->xml.name, .line = from->line, .byte = -1, .element = p->landmarks->n_points - p->first_point};
    for (const char *c = from->text; c < token; ++c)
        place.line += *c == '\n';
    if (token == end) return loxo_fail_at(p->xml.ctx, LOXO_ERR_MALFORMED, place, "border \"%s\": %s", p->name, what);
    return loxo_fail_at(p->xml.ctx, LOXO_ERR_MALFORMED, place, "border \"%s\": \"%.*s\" %s", p->name,
                        end - token < 40 ? (int)(end - token) : 40, token, what);
}

static const char *skip_blanks(const char *at, const char *end)
{
    while (at < end && loxo_is_space(*at))
        ++at;
    return at;
}

static loxo_status read_vertex(const parsing *p, const char **at, const char *end, loxo_index *vertex)
{
    const char *token = *at;
    int64_t number = 0;
    if (token == end) return fail_at_token(p, &p->vertices, token, "fewer than three vertices for a point");
    const loxo_scan scan = loxo_scan_int64(at, end, &number);
    if (scan == LOXO_SCAN_BAD) return fail_at_token(p, &p->vertices, token, "is not a vertex number");
    if (scan == LOXO_SCAN_OVERFLOW || number < 0 || number >= p->n_vertices)
        return fail_at_token(p, &p->vertices, token, "is no vertex of the mesh");
    *vertex = (loxo_index)number;
    *at = skip_blanks(*at, end);
    return LOXO_OK;
}

static loxo_status read_weight(const parsing *p, const char **at, const char *end, double *weight)
{
    const char *token = *at;
    if (token == end) return fail_at_token(p, &p->weights, token, "fewer weights than vertices");
    if (loxo_scan_double(at, end, weight) != LOXO_SCAN_OK)
        return fail_at_token(p, &p->weights, token, "is not a finite number");
    *at = skip_blanks(*at, end);
    return LOXO_OK;
}

static loxo_status read_points(const parsing *p)
{
    const char *vertex = p->vertices.text, *vertex_end = vertex + p->vertices.n;
    const char *weight = p->weights.text, *weight_end = weight + p->weights.n;
    loxo_status status = LOXO_OK;
    vertex = skip_blanks(vertex, vertex_end);
    weight = skip_blanks(weight, weight_end);
    if (vertex == vertex_end) return fail_at_token(p, &p->vertices, vertex, "a part without points");
    while (vertex < vertex_end) {
        loxo_surface_point point;
        const char *first_weight = weight;
        for (int k = 0; k < 3 && status >= 0; ++k)
            if ((status = read_vertex(p, &vertex, vertex_end, &point.vertex[k])) >= 0)
                status = read_weight(p, &weight, weight_end, &point.weight[k]);
        if (status < 0) return status;
        if (!loxo_landmark_normalise(point.weight))
            return fail_at_token(p, &p->weights, first_weight, "begins weights that are negative or all 0");
        if ((status = loxo_landmarks_add_point(p->xml.ctx, p->landmarks, &point, NULL)) < 0) return status;
    }
    return weight < weight_end ? fail_at_token(p, &p->weights, weight, "is one weight too many") : LOXO_OK;
}

static loxo_status end_part(const parsing *p)
{
    const loxo_status status =
        loxo_landmarks_add_curve(p->xml.ctx, p->landmarks, p->name, strlen(p->name), p->is_closed);
    return status < 0 ? status : read_points(p);
}

/* ---- what expat calls ---------------------------------------------------------------------------------------- */

static void begin_file(parsing *p, const char *element, const char **attributes)
{
    const char *version = loxo_xml_attribute(attributes, "Version");
    const char *n_text = loxo_xml_attribute(attributes, "SurfaceNumberOfVertices");
    int64_t n = 0;
    if (strcmp(element, "BorderFile") != 0) {
        loxo_xml_stop_malformed(&p->xml, "XML, but no borders: the outermost element is not BorderFile");
    } else if (version == NULL || strcmp(version, "3") != 0) {
        loxo_xml_stop(&p->xml,
                      loxo_fail_at(p->xml.ctx, LOXO_ERR_UNSUPPORTED, loxo_xml_here(&p->xml),
                                   "borders of version \"%.20s\"; version 3 is read", version == NULL ? "" : version));
    } else if (n_text != NULL && (!loxo_xml_integer(n_text, &n) || n != p->n_vertices)) {
        loxo_xml_stop(&p->xml, loxo_fail_at(p->xml.ctx, LOXO_ERR_MALFORMED, loxo_xml_here(&p->xml),
                                            "borders on a surface of %.20s vertices, the mesh has %" PRId64, n_text,
                                            p->n_vertices));
    }
}

static void begin_border(parsing *p, const char **attributes)
{
    const char *name = loxo_xml_attribute(attributes, "Name");
    const size_t n = name == NULL ? 0 : strlen(name), n_kept = n < sizeof p->name - 1 ? n : sizeof p->name - 1;
    if (p->in_border) {
        loxo_xml_stop_malformed(&p->xml, "a Border inside a Border");
        return;
    }
    if (n == 0) {
        loxo_xml_stop_malformed(&p->xml, "a Border without a Name");
        return;
    }
    memcpy(p->name, name, n_kept);
    p->name[n_kept] = '\0';
    p->in_border = true;
}

static void begin_part(parsing *p, const char **attributes)
{
    const char *closed = loxo_xml_attribute(attributes, "Closed");
    if (p->in_part) {
        loxo_xml_stop_malformed(&p->xml, "a BorderPart inside a BorderPart");
        return;
    }
    p->in_part = true;
    p->is_closed = closed != NULL && (strcmp(closed, "True") == 0 || strcmp(closed, "true") == 0);
    p->vertices = (list){.text = p->vertices.text, .capacity = p->vertices.capacity};
    p->weights = (list){.text = p->weights.text, .capacity = p->weights.capacity};
}

static void begin_list(parsing *p, list *l)
{
    if (l->is_there) loxo_xml_stop_malformed(&p->xml, "a second list of the same kind in a BorderPart");
    l->is_there = true;
    l->line = (int64_t)XML_GetCurrentLineNumber(p->xml.parser);
    p->filling = l;
}

static void XMLCALL on_start(void *user, const char *element, const char **attributes)
{
    parsing *p = user;
    if (!loxo_xml_enter(&p->xml)) return;
    if (p->filling != NULL)
        loxo_xml_stop_malformed(&p->xml, "an element inside Vertices or Weights");
    else if (p->xml.depth == 1)
        begin_file(p, element, attributes);
    else if (strcmp(element, "Border") == 0)
        begin_border(p, attributes);
    else if (p->in_border && strcmp(element, "BorderPart") == 0)
        begin_part(p, attributes);
    else if (p->in_part && strcmp(element, "Vertices") == 0)
        begin_list(p, &p->vertices);
    else if (p->in_part && strcmp(element, "Weights") == 0)
        begin_list(p, &p->weights);
}

static void XMLCALL on_end(void *user, const char *element)
{
    parsing *p = user;
    if (p->xml.status < 0) return;
    p->filling = NULL;
    if (p->in_part && strcmp(element, "BorderPart") == 0) {
        p->in_part = false;
        if (p->vertices.n == 0 || p->weights.n == 0) {
            loxo_xml_stop_malformed(&p->xml, "a BorderPart without Vertices or without Weights");
        } else {
            const loxo_status status = end_part(p);
            if (status < 0) loxo_xml_stop(&p->xml, status);
        }
    } else if (p->in_border && strcmp(element, "Border") == 0) {
        p->in_border = false;
    }
    loxo_xml_leave(&p->xml);
}

static void XMLCALL on_text(void *user, const char *text, int n)
{
    parsing *p = user;
    list *l = p->filling;
    if (p->xml.status < 0 || l == NULL) return;
    if (l->n == 0) l->line = (int64_t)XML_GetCurrentLineNumber(p->xml.parser);
    if (l->n + n > l->capacity) {
        const int64_t capacity = 2 * l->capacity + n + 1024;
        char *larger = loxo_reallocate(p->xml.ctx, l->text, capacity, 1);
        if (larger == NULL) {
            loxo_xml_stop(&p->xml, LOXO_ERR_MEMORY);
            return;
        }
        l->text = larger;
        l->capacity = capacity;
    }
    memcpy(l->text + l->n, text, (size_t)n);
    l->n += n;
}

loxo_status loxo_read_border(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                             int64_t n_vertices, loxo_landmarks *landmarks)
{
    parsing p = {.xml = {.ctx = ctx, .name = name, .kind = "borders"},
                 .n_vertices = n_vertices,
                 .landmarks = landmarks,
                 .first_point = landmarks->n_points};
    loxo_status status = loxo_xml_begin(&p.xml, on_start, on_end, on_text);
    if (status < 0) return status;
    status = loxo_xml_feed(&p.xml, bytes, n_bytes);
    loxo_xml_end(&p.xml);
    loxo_release(ctx, p.vertices.text);
    loxo_release(ctx, p.weights.text);
    return status;
}

#else

loxo_status loxo_read_border(loxo_context *ctx, const uint8_t *bytes, size_t n_bytes, const char *name,
                             int64_t n_vertices, loxo_landmarks *landmarks)
{
    (void)bytes, (void)n_bytes, (void)n_vertices, (void)landmarks;
    return loxo_fail_at(ctx, LOXO_ERR_UNSUPPORTED, (loxo_place){.file = name, .byte = -1, .element = -1},
                        "borders need expat, which this build lacks");
}

#endif
