/* SPDX-License-Identifier: MIT
 * Ways drawn tight: whatever they were, what comes out is straight on every edge and has pi or more on both sides of every
 * vertex that it passes. */
#include "../shapes.h"
#include "../solver/stopper.h"
#include "../solver/surfaces.h"
#include "base/rng.h"
#include "mesh/lines/straighten.h"

#define PI 3.14159265358979323846

typedef struct walker {
    const loxo_mesh_view *m;
    uint64_t seed, n_drawn;
} walker;

static int64_t draw(walker *w, int64_t n) { return (int64_t)(loxo_random_unit(w->seed, w->n_drawn++) * (double)n) % n; }

static line_place at_vertex(loxo_index v) { return (line_place){.vertex = v, .halfedge = -1, .face = -1}; }

/* Some face that a place is in. */
static int64_t face_at(walker *w, const line_place *p)
{
    if (p->face >= 0) return p->face;
    if (p->halfedge >= 0) {
        const loxo_index twin = w->m->halfedge_twin[p->halfedge];
        return (twin >= 0 && draw(w, 2) == 0 ? twin : p->halfedge) / 3;
    }
    const loxo_index start = w->m->vertex_halfedge[p->vertex];
    loxo_index h = start;
    for (int64_t i = draw(w, 12); i > 0; --i) {
        const loxo_index next = line_turn(w->m, h, true);
        h = next < 0 ? start : next;
    }
    return h / 3;
}

/* Somewhere on the rim of a face, or inside. */
static line_place place_at(walker *w, int64_t f, bool is_end)
{
    const int64_t kind = draw(w, is_end ? 3 : 2);
    const loxo_index h = (loxo_index)(3 * f + draw(w, 3));
    if (kind == 0) return at_vertex(w->m->halfedge_vertex[h]);
    if (kind == 1)
        return (line_place){
            .vertex = -1, .halfedge = h, .face = -1, .t = 0.05 + 0.9 * loxo_random_unit(w->seed, w->n_drawn++)};
    return (line_place){.vertex = -1, .halfedge = -1, .face = (loxo_index)f, .weight = {0.25, 0.25, 0.5}};
}

static void walk(walker *w, int64_t n_steps, line_way *way)
{
    way->n = 0;
    line_place now = place_at(w, draw(w, w->m->n_faces), true);
    CHECK_OK(line_way_add(way, &now));
    for (int64_t i = 0; i < n_steps; ++i) {
        now = place_at(w, face_at(w, &now), i + 1 == n_steps);
        CHECK_OK(line_way_add(way, &now));
    }
}

static bool is_in_face(const loxo_mesh_view *m, const loxo_surface_point *p, int64_t f)
{
    for (int k = 0; k < 3; ++k) {
        bool found = p->vertex[k] < 0;
        for (int j = 0; j < 3 && !found; ++j)
            found = m->halfedge_vertex[3 * f + j] == p->vertex[k];
        if (!found) return false;
    }
    return true;
}

static loxo_vec3 at(const loxo_polylines *l, int64_t i) { return v3_load(l->position[i]); }

static double angle(loxo_vec3 a, loxo_vec3 b) { return atan2(v3_norm(v3_cross(a, b)), v3_dot(a, b)); }

/* Where in the fan of vertex v a point of one of its faces lies, as an angle; the fan's sum. */
static double angle_in_fan(const loxo_mesh_view *m, loxo_index v, const loxo_polylines *l, int64_t i, double *sum)
{
    const loxo_index start = m->vertex_halfedge[v];
    double found = -1.0;
    *sum = 0.0;
    for (loxo_index h = start; h >= 0;) {
        const loxo_vec3 x = k_position(m, v), side = v3_sub(k_position(m, k_head(m, h)), x);
        if (found < 0.0 && is_in_face(m, &l->point[i], h / 3)) found = *sum + angle(side, v3_sub(at(l, i), x));
        *sum += line_corner_angle(m, h);
        h = line_turn(m, h, true);
        if (h == start) break;
    }
    CHECK(found >= 0.0);
    return found;
}

/* Angles are known to rounding errors over the length of a leg, and crossings to 1e-10 of an edge. */
static void check_point(const loxo_mesh_view *m, const loxo_polylines *l, int64_t i)
{
    const loxo_surface_point *p = &l->point[i];
    const loxo_vec3 in = v3_sub(at(l, i - 1), at(l, i)), out = v3_sub(at(l, i + 1), at(l, i));
    const double tolerance = 1e-6;
    if (v3_norm(in) < 1e-5 || v3_norm(out) < 1e-5) return;
    if (p->vertex[1] >= 0) { /* first variation: moving along the edge gains nothing */
        const loxo_vec3 edge = v3_sub(k_position(m, p->vertex[1]), k_position(m, p->vertex[0]));
        CHECK(p->vertex[2] < 0);
        CHECK_NEAR(v3_dot(in, edge) / (v3_norm(in) * v3_norm(edge)),
                   -v3_dot(out, edge) / (v3_norm(out) * v3_norm(edge)), tolerance);
        return;
    }
    const loxo_index v = p->vertex[0];
    double sum;
    const double from = angle_in_fan(m, v, l, i - 1, &sum), to = angle_in_fan(m, v, l, i + 1, &sum);
    const double side = fabs(to - from);
    CHECK(side >= PI - tolerance);
    CHECK(m->halfedge_twin[m->vertex_halfedge[v]] < 0 || sum - side >= PI - tolerance);
}

/* One way: its ends stay, neighbours lie in one face, it is no longer, and it is geodesic. */
static double check_way(line_straightener *s, const line_way *way, bool is_sound)
{
    const loxo_mesh_view *m = s->m;
    line_builder builder, given;
    CHECK_STATUS(s->ctx, line_builder_begin(s->ctx, m, &given), LOXO_OK);
    CHECK_STATUS(s->ctx, line_way_build(way, &given), LOXO_OK);
    CHECK_STATUS(s->ctx, line_end_way(&given, 0.0), LOXO_OK);
    CHECK_STATUS(s->ctx, line_builder_begin(s->ctx, m, &builder), LOXO_OK);
    CHECK_STATUS(s->ctx, line_straighten(s, way, &builder), LOXO_OK);
    CHECK_STATUS(s->ctx, line_end_way(&builder, 0.0), LOXO_OK);
    const loxo_polylines *l = &builder.lines, *g = &given.lines;
    const double length = loxo_polyline_length(l, 0);
    CHECK_NEAR3(l->position[0], g->position[0], 0.0);
    CHECK_NEAR3(l->position[l->n_points - 1], g->position[g->n_points - 1], 1e-15);
    CHECK(length <= loxo_polyline_length(g, 0) * (1.0 + 1e-8));
    for (int64_t i = 1; i < l->n_points; ++i) {
        bool found = false;
        for (int64_t f = 0; f < m->n_faces && !found; ++f)
            found = is_in_face(m, &l->point[i - 1], f) && is_in_face(m, &l->point[i], f);
        CHECK(found || !is_sound);
        if (i + 1 < l->n_points && is_sound) check_point(m, l, i);
    }
    loxo_polylines_destroy(s->ctx, &builder.lines);
    loxo_polylines_destroy(s->ctx, &given.lines);
    return length;
}

static void check_walks(loxo_soup soup, int n_walks, int64_t longest, bool is_sound)
{
    surface s = surface_from_soup(test_context, soup, LOXO_ORDER_GIVEN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    line_way way = {.ctx = test_context};
    line_straightener straightener;
    line_straightener_begin(test_context, &m, &straightener);
    for (int i = 0; i < n_walks; ++i) {
        walker w = {.m = &m, .seed = (uint64_t)i};
        walk(&w, 1 + draw(&w, longest), &way);
        (void)check_way(&straightener, &way, is_sound);
    }
    line_straightener_end(&straightener);
    line_way_destroy(&way);
    surface_destroy(&s);
}

TEST(any_walk_becomes_a_geodesic)
{
    check_walks(soup_make(test_context, LOXO_SHAPE_ICOSPHERE, 162, NAN), 300, 60, true);
    check_walks(soup_make(test_context, LOXO_SHAPE_NOISY, 300, 0.3), 300, 60, true);
    check_walks(soup_make(test_context, LOXO_SHAPE_TORUS, 200, NAN), 300, 60, true);
    check_walks(soup_make(test_context, LOXO_SHAPE_BRAIN, 400, NAN), 300, 60, true);
    check_walks(shape_genus(test_context, 2, 300), 200, 60, true);
}

TEST(at_boundaries_too)
{
    check_walks(soup_make(test_context, LOXO_SHAPE_DISK, 100, NAN), 300, 40, true);
    check_walks(soup_make(test_context, LOXO_SHAPE_ANNULUS, 200, NAN), 300, 60, true);
    check_walks(soup_make(test_context, LOXO_SHAPE_STRIP, 60, NAN), 100, 60, true);
}

TEST(on_a_few_faces)
{
    check_walks(shape_tetrahedron(test_context), 500, 30, true);
    check_walks(shape_cube(test_context), 500, 30, true);
    check_walks(shape_hub(test_context, 50), 300, 60, true);
    check_walks(shape_torus(test_context, 3, 3), 300, 30, true);
}

/* A sphere flattened to a ten-thousandth of its height. */
TEST(on_needles)
{
    loxo_soup needles = soup_make(test_context, LOXO_SHAPE_NOISY, 300, 0.3);
    for (int64_t v = 0; v < needles.n_vertices; ++v)
        needles.position[3 * v + 2] *= 1e-4;
    check_walks(needles, 200, 60, true);
}

/* Where angles mean nothing, and vertices lie on each other: an end, and no longer than before. */
TEST(on_faces_without_area)
{
    loxo_soup lattice = soup_make(test_context, LOXO_SHAPE_NOISY, 300, 0.3);
    for (int64_t i = 0; i < 3 * lattice.n_vertices; ++i)
        lattice.position[i] = round(4.0 * lattice.position[i]) / 4.0;
    check_walks(lattice, 200, 60, false);
}

/* There ways turn to and fro without becoming shorter. That ends after some rounds, not after four for each face: the monitor is
 * asked in one round of 64. */
TEST(nothing_falls_where_edges_have_no_length)
{
    loxo_soup lattice = soup_make(test_context, LOXO_SHAPE_NOISY, 300, 0.3);
    for (int64_t i = 0; i < 3 * lattice.n_vertices; ++i)
        lattice.position[i] = round(2.0 * lattice.position[i]) / 2.0;
    surface s = surface_from_soup(test_context, lattice, LOXO_ORDER_GIVEN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    line_way way = {.ctx = test_context};
    line_straightener straightener;
    stopper asked;
    stopper_begin(&asked, test_context, -1);
    line_straightener_begin(test_context, &m, &straightener);
    for (int i = 0; i < 20; ++i) {
        walker w = {.m = &m, .seed = (uint64_t)i};
        walk(&w, 1500, &way);
        (void)check_way(&straightener, &way, false);
    }
    line_straightener_end(&straightener);
    stopper_end(&asked);
    print_message("asked %d times\n", asked.n_calls);
    CHECK(asked.n_calls < 40);
    line_way_destroy(&way);
    surface_destroy(&s);
}

/* A way along the x axis. Both ends of a gate on one side of it by rounding: the one nearer to the way is where it touches. Gates
 * on the way: never back, never beyond its end. */
TEST(gates_along_the_way)
{
    static const k_spot p = {0.0, 0.0}, q = {1.0, 0.0};
    double along = 0.0;
    CHECK_EQUAL(spot_gate(p, q, (k_spot){0.25, -1.0}, (k_spot){0.25, 3.0}, &along), 0.25);
    CHECK_EQUAL(along, 0.25);
    CHECK_EQUAL(spot_gate(p, q, (k_spot){0.3, 1e-17}, (k_spot){0.6, 0.5e-17}, &along), 0.0); /* both left of it */
    along = 0.25;
    CHECK_EQUAL(spot_gate(p, q, (k_spot){0.3, -0.5e-17}, (k_spot){0.6, -1e-17}, &along), 1.0); /* both right of it */
    along = 0.25;
    CHECK_EQUAL(spot_gate(p, q, (k_spot){0.3, 0.0}, (k_spot){0.6, 0.0}, &along), 0.0);
    CHECK_EQUAL(along, 0.3);
    CHECK_NEAR(spot_gate(p, q, (k_spot){0.6, 0.0}, (k_spot){0.2, 0.0}, &along), 0.75, 1e-15); /* not back to 0.2 */
    CHECK_NEAR(spot_gate(p, q, (k_spot){0.1, -1e-17}, (k_spot){0.9, 1e-15}, &along), 0.25, 1e-15);
    along = 0.3;
    CHECK_NEAR(spot_gate(p, q, (k_spot){0.9, -1e-15}, (k_spot){1.3, 1e-17}, &along), 0.25, 1e-15); /* not beyond q */
    CHECK_EQUAL(spot_gate(p, q, (k_spot){0.5, 0.0}, (k_spot){0.5, 0.0}, &along), 0.0);
    CHECK_EQUAL(spot_gate(p, p, (k_spot){0.5, -1.0}, (k_spot){0.5, 1.0}, &along), 0.0);
}

/* From a corner of the unit cube to the opposite one by three edges: over two faces it is sqrt(5). */
TEST(across_a_cube)
{
    surface s = surface_from_soup(test_context, shape_cube(test_context), LOXO_ORDER_GIVEN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    line_way way = {.ctx = test_context};
    line_straightener straightener;
    int n_found = 0;
    line_straightener_begin(test_context, &m, &straightener);
    for (loxo_index h = 0; h < 3 * m.n_faces; ++h) { /* two half-edges one after the other, then a third */
        for (int turns = 0; turns < 6; ++turns) {
            loxo_index third = m.halfedge_twin[k_next(h)];
            for (int i = 0; i < turns; ++i)
                third = line_turn(&m, third, true);
            const line_place place[4] = {at_vertex(m.halfedge_vertex[h]), at_vertex(k_head(&m, h)),
                                         at_vertex(k_head(&m, k_next(h))), at_vertex(k_head(&m, third))};
            const double straight = v3_norm(v3_sub(k_position(&m, place[0].vertex), k_position(&m, place[3].vertex)));
            if (fabs(straight - sqrt(3.0)) > 1e-9) continue;
            way.n = 0;
            for (int i = 0; i < 4; ++i)
                CHECK_OK(line_way_add(&way, &place[i]));
            CHECK_NEAR(check_way(&straightener, &way, true), sqrt(5.0), 1e-14);
            ++n_found;
        }
    }
    CHECK(n_found > 10);
    line_straightener_end(&straightener);
    line_way_destroy(&way);
    surface_destroy(&s);
}

/* A place in one of the faces around a vertex. */
static line_place place_near(const loxo_mesh_view *m, loxo_index v, loxo_vec3 x)
{
    loxo_index h = m->vertex_halfedge[v];
    for (int i = 0; i < 20; ++i, h = line_turn(m, h, true)) {
        const loxo_index *corner = &m->halfedge_vertex[h - h % 3];
        const loxo_vec3 a = k_position(m, corner[0]), b = k_position(m, corner[1]), c = k_position(m, corner[2]);
        const loxo_vec3 normal = v3_cross(v3_sub(b, a), v3_sub(c, a));
        const double area = v3_dot(normal, normal);
        const double weight[3] = {v3_dot(normal, v3_cross(v3_sub(c, b), v3_sub(x, b))) / area,
                                  v3_dot(normal, v3_cross(v3_sub(a, c), v3_sub(x, c))) / area,
                                  v3_dot(normal, v3_cross(v3_sub(b, a), v3_sub(x, a))) / area};
        if (fabs(v3_dot(normal, v3_sub(x, a))) < 1e-12 && weight[0] >= 0.0 && weight[1] >= 0.0 && weight[2] >= 0.0)
            return line_place_in_face(m, h / 3, weight);
    }
    CHECK(false);
    return at_vertex(v);
}

/* Around a corner of the unit cube, where three squares meet, from the middle of an edge. First over two squares to the middle
 * of the third edge: the corner sees both ends under pi, and over the third square under pi / 2. Then to (0.3, 0.6) of the second
 * square, on the far side of its diagonal: the corner sees them under pi - 0.46, so that is a geodesic, but over the third square
 * under pi / 2 + 0.46, which is another and shorter. Lengths by the cosine rule: sqrt(1/2), and 1/4 + 0.45 + 0.3 = 1. */
TEST(around_a_corner_of_a_cube)
{
    surface s = surface_from_soup(test_context, shape_cube(test_context), LOXO_ORDER_GIVEN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    line_way way = {.ctx = test_context};
    line_straightener straightener;
    line_straightener_begin(test_context, &m, &straightener);
    for (loxo_index corner = 0; corner < 8; ++corner) {
        loxo_index along[8], n = 0; /* edges of length 1 at the corner, in turn */
        const loxo_index first = m.vertex_halfedge[corner];
        const loxo_vec3 x = k_position(&m, corner);
        loxo_index h = first;
        do {
            if (v3_norm(v3_sub(k_position(&m, k_head(&m, h)), x)) < 1.2) along[n++] = h;
            h = line_turn(&m, h, true);
        } while (h != first);
        CHECK_EQUAL(n, 3);
        for (int i = 0; i < 6; ++i) {
            const loxo_index second = along[(i + 1) % 3], last = along[(i + 2) % 3];
            const loxo_vec3 e = v3_sub(k_position(&m, k_head(&m, second)), x);
            const loxo_vec3 f = v3_sub(k_position(&m, k_head(&m, last)), x);
            const line_place on_last = {.vertex = -1, .halfedge = last, .face = -1, .t = 0.5};
            const line_place inside = place_near(&m, corner, v3_axpy(v3_axpy(x, 0.3, e), 0.6, f));
            const line_place end = i < 3 ? on_last : inside;
            way.n = 0;
            for (h = along[i % 3];; h = line_turn(&m, h, true)) { /* over diagonals, too */
                const line_place place = {.vertex = -1, .halfedge = h, .face = -1, .t = h == along[i % 3] ? 0.5 : 0.1};
                CHECK(h != last);
                CHECK_OK(line_way_add(&way, &place));
                if ((h == second || way.n > 2) && line_place_is_in(&m, &end, h / 3)) break;
            }
            CHECK_OK(line_way_add(&way, &end));
            CHECK_NEAR(check_way(&straightener, &way, true), i < 3 ? sqrt(0.5) : 1.0, 1e-14);
        }
    }
    line_straightener_end(&straightener);
    line_way_destroy(&way);
    surface_destroy(&s);
}

/* A way around a hole stays on its side, however much shorter the other one is: it goes along the rim's polygon. */
TEST(a_way_does_not_jump_over_a_hole)
{
    enum { N = 32 };
    surface s = surface_from_soup(test_context, shape_annulus(test_context, N, 4), LOXO_ORDER_GIVEN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    line_way way = {.ctx = test_context};
    line_straightener straightener;
    double length[2];
    line_straightener_begin(test_context, &m, &straightener);
    for (int side = 0; side < 2; ++side) { /* along one rim, 10 edges this way or N - 10 the other */
        loxo_index h = 0, v;
        while (m.halfedge_twin[h] >= 0)
            ++h;
        way.n = 0;
        const line_place start = at_vertex(m.halfedge_vertex[h]);
        CHECK_OK(line_way_add(&way, &start));
        v = start.vertex;
        for (int i = 0; i < (side == 0 ? 10 : N - 10); ++i) {
            loxo_index next = m.vertex_halfedge[v]; /* the half-edge at the boundary, where there is one */
            if (side == 0) {
                while (m.halfedge_twin[next] >= 0)
                    next = line_turn(&m, next, false);
                v = k_head(&m, next);
            } else {
                while (line_turn(&m, next, true) >= 0)
                    next = line_turn(&m, next, true);
                v = m.halfedge_vertex[k_previous(next)];
            }
            const line_place place = at_vertex(v);
            CHECK_OK(line_way_add(&way, &place));
        }
        length[side] = check_way(&straightener, &way, true);
    }
    print_message("%.4f this way, %.4f the other\n", length[0], length[1]);
    CHECK(length[1] > 1.2 * length[0]);
    line_straightener_end(&straightener);
    line_way_destroy(&way);
    surface_destroy(&s);
}

static loxo_status straighten_walks(loxo_context *ctx, void *arg)
{
    loxo_mesh *mesh = NULL;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(arg);
    loxo_status status = loxo_mesh_create(ctx, &arrays, LOXO_BORROW, NULL, NULL, &mesh);
    if (status < 0) return status;
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    line_way way = {.ctx = ctx};
    line_builder builder = {0};
    line_straightener straightener;
    line_straightener_begin(ctx, &m, &straightener);
    status = line_builder_begin(ctx, &m, &builder);
    for (loxo_index v = 0; v < 200 && status >= 0; ++v) { /* there and back along edges, which is long */
        const line_place place = at_vertex(k_head(&m, m.vertex_halfedge[v % 5]));
        const line_place back = at_vertex(v % 5);
        status = line_way_add(&way, &place);
        if (status >= 0) status = line_way_add(&way, &back);
        if (status >= 0 && v % 5 == 4) {
            status = line_straighten(&straightener, &way, &builder);
            way.n = 0;
        }
    }
    line_straightener_end(&straightener);
    line_way_destroy(&way);
    loxo_polylines_destroy(ctx, &builder.lines);
    loxo_mesh_destroy(mesh);
    return status;
}

TEST(each_allocation_fails)
{
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_ICOSPHERE, 162, NAN);
    CHECK(test_each_allocation_fails(straighten_walks, &soup) > 10);
    loxo_soup_destroy(test_context, &soup);
}
