/* SPDX-License-Identifier: MIT
 * Shortest ways from points inside faces. Windows are gone when a solve is over, so such a point is solved from, no farther
 * than it can be from the sources: by symmetry its way is among those found. It passes through a vertex, whose way to the
 * point and own way back are put together, or it is one straight line to a source inside a face, a goal. */
#include "base/allocate.h"
#include "mesh/lines/builder.h"
#include "solver/geodesic/exact/exact_internal.h"

/* The first goal in the face, or the first after it. */
static int64_t first_goal(const exact_state *s, int64_t face)
{
    int64_t low = 0, high = s->n_goals;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (s->goals[middle].face < face)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

void exact_meet_goals(exact_state *s, loxo_index h, const k_layout *face, const exact_taken *window, int64_t n)
{
    const int64_t f = k_face_of(h);
    for (int64_t i = first_goal(s, f); i < s->n_goals && s->goals[i].face == f; ++i) {
        double px, py;
        exact_place(&s->goals[i], h, face, face->x1, &px, &py);
        for (int64_t k = 0; k < n; ++k) {
            const k_window *w = &window[k].w;
            const double below = w->y + py, sight = below > 0.0 ? w->x + (px - w->x) * (w->y / below) : px;
            const double at = sight < w->begin ? w->begin : sight > w->end ? w->end : sight;
            const double way = at == sight ? k_window_way(w, px, py)
                                           : k_window_way(w, at, 0.0) + sqrt((at - px) * (at - px) + py * py);
            if (way < s->goal_distance) {
                s->goal_distance = way;
                s->goal = i;
                s->goal_reach = (exact_reach){at, w->x, w->y, h, window[k].origin};
            }
        }
    }
}

/* Straight to the goals in the point's own face. */
static void meet_goals_beside(exact_state *s, const geodesic_seed *from)
{
    const loxo_index h = (loxo_index)(3 * (int64_t)from->face);
    double length[3], fx, fy;
    const k_layout face = k_layout_at(&s->m, h, length);
    exact_place(from, h, &face, length[0], &fx, &fy);
    for (int64_t i = first_goal(s, from->face); i < s->n_goals && s->goals[i].face == from->face; ++i) {
        double px, py;
        exact_place(&s->goals[i], h, &face, length[0], &px, &py);
        const double way = sqrt((px - fx) * (px - fx) + (py - fy) * (py - fy));
        if (way < s->goal_distance) {
            s->goal_distance = way;
            s->goal = i;
            s->goal_reach = (exact_reach){.at = -1.0, .via = h, .origin = -1};
        }
    }
}

static loxo_status make_back(exact_state *s)
{
    loxo_status status;
    void *back = NULL;
    if (s->back == NULL) {
        status = exact_create(s->problem, &back);
        if (status < 0) {
            exact_destroy(back);
            return status;
        }
        s->back = back;
    }
    return LOXO_OK;
}

static loxo_status put_stop(const exact_state *s, const exact_stop *stop, const geodesic_seed *goal,
                            line_builder *builder)
{
    const loxo_mesh_view *m = &s->m;
    if (stop->vertex >= 0) return line_add_vertex(builder, stop->vertex);
    if (stop->halfedge >= 0)
        return line_add_on_edge(builder, m->halfedge_vertex[stop->halfedge], k_head(m, stop->halfedge), stop->at);
    const geodesic_seed *seed = stop->seed >= 0 ? &s->seeds[stop->seed] : goal;
    if (seed == NULL) return loxo_fail(s->ctx, LOXO_ERR_NUMERIC, "geodesic: a way back has a stop that is nowhere");
    return line_add_in_face(builder, seed->face, seed->weight);
}

static loxo_status put_way(const exact_state *s, const exact_way *way, bool is_backwards, const geodesic_seed *goal,
                           line_builder *builder)
{
    loxo_status status = LOXO_OK;
    for (int64_t i = 0; i < way->n && status >= 0; ++i)
        status = put_stop(s, &way->stop[is_backwards ? way->n - 1 - i : i], goal, builder);
    return status;
}

/* An upper bound of the distance of a point inside a face. */
static double bound_of(const exact_state *s, const geodesic_seed *from)
{
    double bound = HUGE_VAL;
    for (int k = 0; k < 3; ++k) {
        const loxo_index h = (loxo_index)(3 * (int64_t)from->face + k);
        double length[3], x, y;
        const k_layout face = k_layout_at(&s->m, h, length);
        exact_place(from, h, &face, length[0], &x, &y);
        const double way = s->distance[s->m.halfedge_vertex[h]] + sqrt(x * x + y * y);
        if (way < bound) bound = way;
    }
    return bound;
}

static loxo_status trace_point(exact_state *s, const geodesic_seed *from, exact_way *way, line_builder *builder)
{
    bool is_stopped;
    int64_t n_inside = 0;
    loxo_status status = make_back(s);
    if (status < 0) return status;
    exact_state *back = s->back;
    while (n_inside < s->n_seeds && s->seeds[n_inside].vertex < 0)
        ++n_inside;
    back->goals = s->seeds;
    back->n_goals = n_inside;
    const double bound = bound_of(s, from);
    status = exact_run(back, from, 1, bound + K_WINDOW_SLACK * bound, &is_stopped);
    if (status < 0) return status;
    if (is_stopped) return loxo_fail(s->ctx, LOXO_ERR_STOPPED, "geodesic: stopped while ways were traced");
    meet_goals_beside(back, from);

    double best = HUGE_VAL;
    loxo_index vertex = -1;
    int64_t n;
    const loxo_index *touched = exact_touched(back, &n);
    for (int64_t i = 0; i < n; ++i) {
        const int64_t v = touched != NULL ? touched[i] : i;
        const double sum = back->distance[v] + s->distance[v];
        if (sum < best) {
            best = sum;
            vertex = (loxo_index)v;
        }
    }
    if (back->goal_distance < best && back->goal_reach.at < 0.0) {
        const exact_stop goal = {-1, -1, -1, 0.0};
        status = line_add_in_face(builder, from->face, from->weight);
        return status < 0 ? status : put_stop(s, &goal, &s->seeds[back->goal], builder);
    }
    if (back->goal_distance < best) {
        status = exact_trace_goal(back, way);
        return status < 0 ? status : put_way(back, way, true, &s->seeds[back->goal], builder);
    }
    /* From the vertex to the point, read backwards, and from the vertex on, which is not said twice. */
    status = exact_trace(back, vertex, way);
    if (status >= 0) status = put_way(back, way, true, NULL, builder);
    way->n = 0;
    if (status >= 0) status = exact_trace(s, vertex, way);
    return status < 0 ? status : put_way(s, way, false, NULL, builder);
}

loxo_status exact_trace_from(void *state, const geodesic_seed *from, line_builder *builder)
{
    exact_state *s = state;
    exact_way way = {0};
    loxo_status status;
    if (from->vertex >= 0) {
        status = exact_trace(s, from->vertex, &way);
        if (status >= 0) status = put_way(s, &way, false, NULL, builder);
    } else {
        status = trace_point(s, from, &way, builder);
    }
    exact_way_destroy(s->ctx, &way);
    return status;
}
