/* SPDX-License-Identifier: MIT */
#include "mesh/lines/way.h"

#include "base/allocate.h"

static int before(int k) { return k == 0 ? 2 : k - 1; }

static int after(int k) { return k == 2 ? 0 : k + 1; }

line_place line_place_in_face(const loxo_mesh_view *m, int64_t f, const double weight[3])
{
    for (int k = 0; k < 3; ++k)
        if (weight[after(k)] == 0.0 && weight[before(k)] == 0.0)
            return (line_place){.vertex = m->halfedge_vertex[3 * f + k], .halfedge = -1, .face = -1};
    for (int k = 0; k < 3; ++k)
        if (weight[before(k)] == 0.0)
            return (line_place){.vertex = -1, .halfedge = (loxo_index)(3 * f + k), .face = -1, .t = weight[after(k)]};
    return (line_place){
        .vertex = -1, .halfedge = -1, .face = (loxo_index)f, .weight = {weight[0], weight[1], weight[2]}};
}

bool line_place_is_in(const loxo_mesh_view *m, const line_place *place, int64_t f)
{
    const loxo_index *v = &m->halfedge_vertex[3 * f];
    if (place->vertex >= 0) return v[0] == place->vertex || v[1] == place->vertex || v[2] == place->vertex;
    if (place->halfedge < 0) return place->face == f;
    const loxo_index twin = m->halfedge_twin[place->halfedge];
    return place->halfedge / 3 == f || (twin >= 0 && twin / 3 == f);
}

void line_place_weights(const loxo_mesh_view *m, const line_place *place, int64_t f, double weight[3])
{
    for (int k = 0; k < 3; ++k) {
        weight[k] = 0.0;
        if (place->vertex >= 0) weight[k] = m->halfedge_vertex[3 * f + k] == place->vertex ? 1.0 : 0.0;
        if (place->face >= 0) weight[k] = place->weight[k];
    }
    if (place->halfedge < 0) return;
    const bool is_own = place->halfedge / 3 == f;
    const int k = (int)((is_own ? place->halfedge : m->halfedge_twin[place->halfedge]) % 3);
    weight[k] = is_own ? 1.0 - place->t : place->t;
    weight[after(k)] = is_own ? place->t : 1.0 - place->t;
}

loxo_status line_way_add(line_way *way, const line_place *place)
{
    if (way->n == way->room) {
        const int64_t room = 2 * way->room + 64;
        line_place *more = loxo_reallocate(way->ctx, way->place, room, sizeof *more);
        if (more == NULL) return LOXO_ERR_MEMORY;
        way->place = more;
        way->room = room;
    }
    way->place[way->n++] = *place;
    return LOXO_OK;
}

static loxo_vec3 position_of(const loxo_mesh_view *m, const line_place *place)
{
    if (place->vertex >= 0) return k_position(m, place->vertex);
    loxo_vec3 x = {0.0, 0.0, 0.0};
    if (place->halfedge >= 0) {
        x = k_position(m, m->halfedge_vertex[place->halfedge]);
        return v3_axpy(x, place->t, v3_sub(k_position(m, k_head(m, place->halfedge)), x));
    }
    for (int k = 0; k < 3; ++k)
        x = v3_axpy(x, place->weight[k], k_position(m, m->halfedge_vertex[(int64_t)3 * place->face + k]));
    return x;
}

double line_way_length(const line_way *way, const loxo_mesh_view *m)
{
    double length = 0.0;
    for (int64_t i = 1; i < way->n; ++i)
        length += v3_norm(v3_sub(position_of(m, &way->place[i]), position_of(m, &way->place[i - 1])));
    return length;
}

loxo_status line_place_build(const line_place *place, line_builder *builder)
{
    const loxo_mesh_view *m = builder->m;
    if (place->vertex >= 0) return line_add_vertex(builder, place->vertex);
    if (place->halfedge < 0) return line_add_in_face(builder, place->face, place->weight);
    return line_add_on_edge(builder, m->halfedge_vertex[place->halfedge], k_head(m, place->halfedge), place->t);
}

loxo_status line_way_build(const line_way *way, line_builder *builder)
{
    loxo_status status = LOXO_OK;
    for (int64_t i = 0; i < way->n && status >= 0; ++i)
        status = line_place_build(&way->place[i], builder);
    return status;
}

void line_way_destroy(line_way *way)
{
    loxo_release(way->ctx, way->place);
    way->place = NULL;
    way->n = way->room = 0;
}
