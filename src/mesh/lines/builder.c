/* SPDX-License-Identifier: MIT */
#include "mesh/lines/builder.h"

#include "base/allocate.h"
#include "base/context.h"

#include <float.h>

void loxo_polylines_destroy(loxo_context *ctx, loxo_polylines *lines)
{
    if (lines == NULL) return;
    loxo_release(ctx, lines->line_begin);
    loxo_release(ctx, lines->value);
    loxo_release(ctx, lines->is_closed);
    loxo_release(ctx, lines->point);
    loxo_release(ctx, lines->position);
    *lines = (loxo_polylines){0};
}

double loxo_polyline_length(const loxo_polylines *lines, int64_t line)
{
    double length = 0.0;
    for (int64_t i = lines->line_begin[line] + 1; i < lines->line_begin[line + 1]; ++i)
        length += v3_norm(v3_sub(v3_load(lines->position[i]), v3_load(lines->position[i - 1])));
    return length;
}

/* Room for one more line and its end. */
static loxo_status reserve_line(line_builder *b)
{
    loxo_polylines *l = &b->lines;
    if (l->n_lines + 2 <= b->line_capacity) return LOXO_OK;
    const int64_t capacity = 2 * b->line_capacity + 16;
    int64_t *begin = loxo_reallocate(b->ctx, l->line_begin, capacity, sizeof *begin);
    if (begin == NULL) return LOXO_ERR_MEMORY;
    l->line_begin = begin;
    double *value = loxo_reallocate(b->ctx, l->value, capacity, sizeof *value);
    if (value == NULL) return LOXO_ERR_MEMORY;
    l->value = value;
    bool *is_closed = loxo_reallocate(b->ctx, l->is_closed, capacity, sizeof *is_closed);
    if (is_closed == NULL) return LOXO_ERR_MEMORY;
    l->is_closed = is_closed;
    b->line_capacity = capacity;
    return LOXO_OK;
}

loxo_status line_builder_begin(loxo_context *ctx, const loxo_mesh_view *m, line_builder *builder)
{
    *builder = (line_builder){.ctx = ctx, .m = m};
    const loxo_status status = reserve_line(builder);
    if (status < 0)
        loxo_polylines_destroy(ctx, &builder->lines);
    else
        builder->lines.line_begin[0] = 0;
    return status;
}

int64_t line_n_points(const line_builder *b) { return b->lines.n_points - b->lines.line_begin[b->lines.n_lines]; }

static bool is_at(const loxo_polylines *l, int64_t i, loxo_vec3 x)
{
    return l->position[i][0] == x.x && l->position[i][1] == x.y && l->position[i][2] == x.z;
}

static loxo_status put(line_builder *b, const loxo_surface_point *point, loxo_vec3 position)
{
    loxo_polylines *l = &b->lines;
    if (l->n_points == b->point_capacity) {
        const int64_t capacity = 2 * b->point_capacity + 64;
        loxo_surface_point *points = loxo_reallocate(b->ctx, l->point, capacity, sizeof *points);
        if (points == NULL) return LOXO_ERR_MEMORY;
        l->point = points;
        double(*positions)[3] = loxo_reallocate(b->ctx, l->position, capacity, sizeof *positions);
        if (positions == NULL) return LOXO_ERR_MEMORY;
        l->position = positions;
        b->point_capacity = capacity;
    }
    l->point[l->n_points] = *point;
    v3_store(l->position[l->n_points++], position);
    return LOXO_OK;
}

static loxo_status append(line_builder *b, const loxo_surface_point *point, loxo_vec3 position)
{
    if (line_n_points(b) > 0 && is_at(&b->lines, b->lines.n_points - 1, position)) return LOXO_OK;
    return put(b, point, position);
}

static loxo_index caller_vertex(const line_builder *b, loxo_index v)
{
    return b->m->vertex_origin != NULL ? b->m->vertex_origin[v] : v;
}

loxo_status line_add_vertex(line_builder *b, loxo_index v)
{
    const loxo_surface_point point = {{caller_vertex(b, v), -1, -1}, {1.0, 0.0, 0.0}};
    return append(b, &point, k_position(b->m, v));
}

/* Points of all edges of a vertex that lie this near to it may be the same to the bit, and all but the first would be left
 * out, with the faces between: such a point is the vertex. */
static bool is_at_but_for_rounding(loxo_vec3 x, loxo_vec3 v)
{
    const double size = fmax(fmax(fabs(v.x), fabs(v.y)), fabs(v.z));
    const double away = fmax(fmax(fabs(x.x - v.x), fabs(x.y - v.y)), fabs(x.z - v.z));
    return away <= 4.0 * DBL_EPSILON * size;
}

loxo_status line_add_on_edge(line_builder *b, loxo_index from, loxo_index to, double t)
{
    if (!(t > 0.0)) return line_add_vertex(b, from);
    if (!(t < 1.0)) return line_add_vertex(b, to);
    const loxo_vec3 x = k_position(b->m, from), y = k_position(b->m, to), z = v3_axpy(x, t, v3_sub(y, x));
    const loxo_surface_point point = {{caller_vertex(b, from), caller_vertex(b, to), -1}, {1.0 - t, t, 0.0}};
    if (is_at_but_for_rounding(z, x)) return line_add_vertex(b, from);
    if (is_at_but_for_rounding(z, y)) return line_add_vertex(b, to);
    return append(b, &point, z);
}

loxo_status line_add_in_face(line_builder *b, int64_t f, const double weight[3])
{
    loxo_surface_point point = {.vertex = {-1, -1, -1}};
    loxo_vec3 position = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; ++k) {
        const loxo_index v = b->m->halfedge_vertex[3 * f + k];
        if (weight[k] == 1.0) return line_add_vertex(b, v);
        if (weight[k] == 0.0) continue;
        point.vertex[k] = caller_vertex(b, v);
        point.weight[k] = weight[k];
        position = v3_axpy(position, weight[k], k_position(b->m, v));
    }
    return append(b, &point, position);
}

/* There is room for it. */
static void keep_line(loxo_polylines *l, double value, bool is_closed)
{
    l->value[l->n_lines] = value;
    l->is_closed[l->n_lines] = is_closed;
    l->line_begin[++l->n_lines] = l->n_points;
}

loxo_status line_end(line_builder *b, double value, bool is_closed)
{
    loxo_polylines *l = &b->lines;
    const int64_t begin = l->line_begin[l->n_lines];
    if (line_n_points(b) < 2) {
        l->n_points = begin;
        return LOXO_OK;
    }
    const loxo_surface_point first = l->point[begin];
    loxo_status status = reserve_line(b);
    if (status >= 0 && is_closed) status = append(b, &first, v3_load(l->position[begin]));
    if (status >= 0) keep_line(l, value, is_closed);
    return status;
}

loxo_status line_end_none(line_builder *b, double value)
{
    const loxo_status status = reserve_line(b);
    b->lines.n_points = b->lines.line_begin[b->lines.n_lines];
    if (status >= 0) keep_line(&b->lines, value, false);
    return status;
}

loxo_status line_end_way(line_builder *b, double value)
{
    const loxo_polylines *l = &b->lines;
    loxo_status status = LOXO_OK;
    if (line_n_points(b) == 1) {
        const loxo_surface_point only = l->point[l->n_points - 1];
        status = put(b, &only, v3_load(l->position[l->n_points - 1]));
    }
    return status < 0 ? status : line_end(b, value, false);
}
