/* SPDX-License-Identifier: MIT
 * Isolines. A vertex is below the level, or not: so a face has none or two edges from below to not below, and a line goes
 * from face to face over them. It enters a face over the half-edge that goes up and leaves over the one that goes down, whose
 * twin goes up in the next face: one line through each face, with what is above on its right.
 * A point of an edge is computed from below upward, whichever face asks: neighbours get the same bits. Where the upper
 * vertex has the level exactly, the point is that vertex; a line that turns around it passes it once. */
#include "base/allocate.h"
#include "base/context.h"
#include "mesh/lines/builder.h"
#include "mesh/mesh_internal.h"

#include <inttypes.h>
#include <string.h>

#define STOP_FACES 1048576 /* between two looks at the monitor */

typedef struct tracing {
    const loxo_mesh_view *m;
    const double *field; /* caller's order */
    double level;
    uint8_t *is_done;    /* [(n_faces + 7) / 8] faces that a line of this level went through */
    loxo_index *crossed; /* [n_crossed] faces that one goes through */
    int64_t n_crossed, capacity;
    line_builder builder;
} tracing;

static double field_at(const tracing *t, loxo_index v)
{
    return t->field[t->m->vertex_origin != NULL ? t->m->vertex_origin[v] : v];
}

/* The half-edges of face f over which the line enters and leaves it; false: none goes through. */
static bool find_crossing(const tracing *t, int64_t f, loxo_index *up, loxo_index *down)
{
    const loxo_index *v = &t->m->halfedge_vertex[3 * f];
    const double d[3] = {field_at(t, v[0]), field_at(t, v[1]), field_at(t, v[2])};
    const bool below[3] = {d[0] < t->level, d[1] < t->level, d[2] < t->level};
    if (below[0] == below[1] && below[1] == below[2]) return false;
    if (!(d[0] - d[0] == 0.0 && d[1] - d[1] == 0.0 && d[2] - d[2] == 0.0)) return false; /* not finite */
    for (int k = 0; k < 3; ++k) {
        const int next = k == 2 ? 0 : k + 1;
        if (below[k] && !below[next]) *up = (loxo_index)(3 * f + k);
        if (!below[k] && below[next]) *down = (loxo_index)(3 * f + k);
    }
    return true;
}

static loxo_status add_crossing(tracing *t, loxo_index h)
{
    loxo_index below = t->m->halfedge_vertex[h], above = k_head(t->m, h);
    if (!(field_at(t, below) < t->level)) {
        const loxo_index other = below;
        below = above;
        above = other;
    }
    const double low = field_at(t, below), high = field_at(t, above);
    return line_add_on_edge(&t->builder, below, above, high == t->level ? 1.0 : (t->level - low) / (high - low));
}

static bool is_done(const tracing *t, int64_t f) { return (t->is_done[f / 8] >> (f % 8) & 1) != 0; }

/* Whether a line comes into the face from another one. */
static bool has_face_before(const tracing *t, loxo_index up)
{
    loxo_index other_up, other_down;
    const loxo_index twin = t->m->halfedge_twin[up];
    return twin >= 0 && find_crossing(t, twin / 3, &other_up, &other_down);
}

/* From face f on until there is no further face, or f again. */
static loxo_status follow(tracing *t, int64_t f)
{
    const int64_t start = f;
    loxo_index up = -1, down = -1;
    bool is_closed = false;
    (void)find_crossing(t, f, &up, &down);
    loxo_status status = add_crossing(t, up);
    while (status >= 0) {
        t->is_done[f / 8] = (uint8_t)(t->is_done[f / 8] | 1u << (f % 8));
        const loxo_index twin = t->m->halfedge_twin[down];
        is_closed = twin >= 0 && twin / 3 == start;
        if (is_closed) break;
        status = add_crossing(t, down);
        if (twin < 0 || !find_crossing(t, twin / 3, &up, &down)) break;
        f = twin / 3;
    }
    return status < 0 ? status : line_end(&t->builder, t->level, is_closed);
}

static loxo_status list_crossed(tracing *t)
{
    loxo_index up, down;
    t->n_crossed = 0;
    for (int64_t f = 0; f < t->m->n_faces; ++f) {
        if (f % STOP_FACES == 0 && loxo_stop_wanted(t->builder.ctx, "isolines", (double)f / (double)t->m->n_faces))
            return loxo_fail(t->builder.ctx, LOXO_ERR_STOPPED, "stopped while isolines were traced");
        if (!find_crossing(t, f, &up, &down)) continue;
        if (t->n_crossed == t->capacity) {
            const int64_t capacity = 2 * t->capacity + 256;
            loxo_index *larger = loxo_reallocate(t->builder.ctx, t->crossed, capacity, sizeof *larger);
            if (larger == NULL) return LOXO_ERR_MEMORY;
            t->crossed = larger;
            t->capacity = capacity;
        }
        t->crossed[t->n_crossed++] = (loxo_index)f;
    }
    return LOXO_OK;
}

/* First the lines that begin at the boundary, then the loops, by their first face. */
static loxo_status trace_level(tracing *t)
{
    loxo_status status = list_crossed(t);
    for (int64_t i = 0; i < t->n_crossed && status >= 0; ++i) {
        loxo_index up = -1, down;
        (void)find_crossing(t, t->crossed[i], &up, &down);
        if (!has_face_before(t, up)) status = follow(t, t->crossed[i]);
    }
    for (int64_t i = 0; i < t->n_crossed && status >= 0; ++i)
        if (!is_done(t, t->crossed[i])) status = follow(t, t->crossed[i]);
    for (int64_t i = 0; i < t->n_crossed; ++i)
        t->is_done[t->crossed[i] / 8] = 0;
    return status;
}

loxo_status loxo_isolines(loxo_context *ctx, const loxo_mesh *mesh, const double *field, const double *level,
                          int64_t n_levels, loxo_polylines *lines)
{
    if (ctx == NULL || lines == NULL) return LOXO_ERR_ARGUMENT;
    *lines = (loxo_polylines){0};
    if (mesh == NULL || field == NULL || n_levels < 0 || (n_levels > 0 && level == NULL))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "isolines: an array is NULL");
    if (mesh->view.halfedge_length != NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "isolines: ask the surface of an intrinsic triangulation");
    for (int64_t i = 0; i < n_levels; ++i)
        if (!isfinite(level[i]))
            return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = i},
                                "isolines: value %" PRId64 " is not finite", i);
    tracing t = {.m = &mesh->view, .field = field};
    loxo_status status = line_builder_begin(ctx, t.m, &t.builder);
    if (status < 0) return status;
    loxo_progress_begin(ctx);
    t.is_done = loxo_allocate_zero(ctx, t.m->n_faces / 8 + 1, 1);
    if (t.is_done == NULL) status = LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n_levels && status >= 0; ++i) {
        t.level = level[i];
        status = trace_level(&t);
    }
    loxo_release(ctx, t.is_done);
    loxo_release(ctx, t.crossed);
    if (status < 0)
        loxo_polylines_destroy(ctx, &t.builder.lines);
    else
        *lines = t.builder.lines;
    return status;
}
