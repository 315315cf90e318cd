/* SPDX-License-Identifier: MIT
 * Ways back to the sources: straight on planes, as long as the distance, always arriving. */
#include "../shapes.h"
#include "base/rng.h"
#include "mesh/lines/descent.h"
#include "surfaces.h"

#include <loxo/geodesic.h>
#include <loxo/io.h>

static loxo_surface_point at(loxo_index v) { return (loxo_surface_point){{v, -1, -1}, {1.0, 0.0, 0.0}}; }

static loxo_surface_point in_face(const surface *s, int64_t f, double a, double b, double c)
{
    return (loxo_surface_point){{s->soup.triangle[3 * f], s->soup.triangle[3 * f + 1], s->soup.triangle[3 * f + 2]},
                                {a, b, c}};
}

static void place_of(const surface *s, const loxo_surface_point *p, double x[3])
{
    for (int j = 0; j < 3; ++j) {
        x[j] = 0.0;
        for (int k = 0; k < 3; ++k)
            if (p->vertex[k] >= 0) x[j] += p->weight[k] * s->soup.position[3 * p->vertex[k] + j];
    }
}

static double away(const double *a, const double *b)
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

static void check_ends(const surface *s, const loxo_polylines *l, int64_t i, const loxo_surface_point *from,
                       const loxo_surface_point *to)
{
    double x[3];
    place_of(s, from, x);
    CHECK_NEAR3(l->position[l->line_begin[i]], x, 1e-14);
    place_of(s, to, x);
    CHECK_NEAR3(l->position[l->line_begin[i + 1] - 1], x, 1e-14);
}

/* True distances on a flat disk: the way is the straight line. */
TEST(straight_ways_on_a_plane)
{
    NEEDS_IDS(6 * 20000);
    for (int pass = 0; pass < 2; ++pass) {
        surface s = surface_make(test_context, LOXO_SHAPE_DISK, pass == 0 ? 2000 : 20000, NAN);
        double *distance = surface_numbers(&s), worst = 0.0, aside = 0.0;
        const loxo_surface_point source = in_face(&s, 700, 0.2, 0.3, 0.5);
        double x[3], y[3];
        loxo_surface_point target[40];
        loxo_polylines lines;
        place_of(&s, &source, x);
        for (int64_t v = 0; v < s.soup.n_vertices; ++v)
            distance[v] = away(x, &s.soup.position[3 * v]);
        for (int64_t i = 0; i < 40; ++i)
            target[i] = i % 2 == 0 ? at((loxo_index)((i * 7919) % s.soup.n_vertices))
                                   : in_face(&s, (i * 104729) % s.soup.n_faces, 0.1, 0.7, 0.2);
        CHECK_OK(loxo_geodesic_trace(test_context, s.mesh, distance, &source, 1, target, 40, &lines));
        CHECK_EQUAL(lines.n_lines, 40);
        for (int i = 0; i < 40; ++i) {
            check_ends(&s, &lines, i, &target[i], &source);
            place_of(&s, &target[i], y);
            const double straight = away(x, y), length = loxo_polyline_length(&lines, i);
            CHECK(length >= straight * (1.0 - 1e-12));
            worst = fmax(worst, length / straight - 1.0);
            for (int64_t p = lines.line_begin[i]; p < lines.line_begin[i + 1]; ++p) {
                const double *z = lines.position[p];
                const double off = (y[0] - x[0]) * (z[1] - x[1]) - (y[1] - x[1]) * (z[0] - x[0]);
                aside = fmax(aside, fabs(off) / straight);
            }
        }
        print_message("%lld vertices: longer by %.2e, aside by %.4f\n", (long long)s.soup.n_vertices, worst, aside);
        CHECK(worst < 1e-13 && aside < 1e-9); /* crossings are put on vertices within 1e-10 of an edge */
        loxo_polylines_destroy(test_context, &lines);
        loxo_release(test_context, distance);
        surface_destroy(&s);
    }
}

/* From every vertex of surfaces of all kinds, down the distances of solves: every way arrives at a source and is a geodesic,
 * so it is no shorter than the exact distance, and no longer either, unless another geodesic leads there, too. share: of the
 * ways that may be such others; excess: how much longer they are, in the mean of all. Both are recorded, half more allowed. */
static void check_all_ways(loxo_shape shape, int64_t n_vertices, double param, loxo_geodesic_method method,
                           int64_t n_sources, double share, double excess)
{
    NEEDS_IDS(6 * n_vertices);
    surface s = surface_make(test_context, shape, n_vertices, param);
    const int64_t n = s.soup.n_vertices;
    const loxo_geodesic_settings settings = unjudged_settings(method), exact = unjudged_settings(LOXO_GEODESIC_EXACT);
    loxo_surface_point source[3] = {at(17), in_face(&s, s.soup.n_faces / 2, 0.0, 0.5, 0.5),
                                    in_face(&s, s.soup.n_faces / 3, 0.3, 0.3, 0.4)};
    loxo_surface_point *target = loxo_allocate(test_context, n, sizeof *target);
    double *distance = surface_numbers(&s), *truth = surface_numbers(&s), sum = 0.0, n_longer = 0.0;
    loxo_geodesic *g = NULL;
    loxo_polylines lines;
    for (int64_t v = 0; v < n; ++v)
        target[v] = at((loxo_index)v);
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &exact, &g));
    CHECK_OK(loxo_geodesic_solve_points(g, source, n_sources, truth, NULL));
    loxo_geodesic_destroy(g);
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_STATUS(test_context, loxo_geodesic_paths(g, target, n, &lines), LOXO_ERR_ARGUMENT);
    CHECK_OK(loxo_geodesic_solve_points(g, source, n_sources, distance, NULL));
    CHECK_OK(loxo_geodesic_paths(g, target, n, &lines));
    CHECK_EQUAL(lines.n_lines, n);
    for (int64_t v = 0; v < n; ++v) {
        const double *end = lines.position[lines.line_begin[v + 1] - 1];
        const double length = loxo_polyline_length(&lines, v);
        double nearest = 1.0, x[3];
        for (int64_t i = 0; i < n_sources; ++i) {
            place_of(&s, &source[i], x);
            nearest = fmin(nearest, away(x, end));
        }
        CHECK(nearest < 1e-14);
        CHECK_EQUAL(lines.value[v], distance[v]);
        CHECK(length >= truth[v] * (1.0 - 1e-12)); /* rounding of some 100 faces unfolded */
        if (truth[v] > 0.0) sum += length / truth[v] - 1.0;
        n_longer += length > truth[v] * (1.0 + 1e-9);
    }
    print_message("%s, %s: %.4f %% longer than the shortest, by %.5f %% in the mean\n", loxo_shape_name(shape),
                  loxo_geodesic_method_name(method), 100.0 * n_longer / (double)n, 100.0 * sum / (double)n);
    CHECK(n_longer <= 1.5 * share * (double)n && sum <= (1.5 * excess + 1e-12) * (double)n);
    loxo_polylines_destroy(test_context, &lines);
    loxo_geodesic_destroy(g);
    loxo_release(test_context, target);
    loxo_release(test_context, distance);
    loxo_release(test_context, truth);
    surface_destroy(&s);
}

#define EDGE LOXO_GEODESIC_EDGE
#define FACE LOXO_GEODESIC_FACE
#define FAST LOXO_GEODESIC_FAST
#define HEAT LOXO_GEODESIC_HEAT

TEST(ways_on_a_sphere)
{
    check_all_ways(LOXO_SHAPE_ICOSPHERE, 2500, NAN, EDGE, 1, 0.07, 1.3e-6);
    check_all_ways(LOXO_SHAPE_ICOSPHERE, 2500, NAN, FAST, 1, 0.063, 4.5e-7);
    check_all_ways(LOXO_SHAPE_ICOSPHERE, 2500, NAN, HEAT, 1, 0.063, 5e-7);
}

TEST(ways_on_a_noisy_sphere)
{
    check_all_ways(LOXO_SHAPE_NOISY, 2500, 0.3, FACE, 3, 0.14, 6.3e-4);
    check_all_ways(LOXO_SHAPE_NOISY, 2500, 0.3, FAST, 3, 0.081, 5.6e-5);
}

TEST(ways_on_a_torus)
{
    check_all_ways(LOXO_SHAPE_TORUS, 2500, NAN, FACE, 2, 0.023, 5.3e-4);
    check_all_ways(LOXO_SHAPE_TORUS, 2500, NAN, FAST, 2, 0.0049, 1.1e-5);
}

TEST(ways_around_a_hole)
{
    check_all_ways(LOXO_SHAPE_ANNULUS, 2500, NAN, EDGE, 1, 0.0, 0.0);
    check_all_ways(LOXO_SHAPE_ANNULUS, 2500, NAN, FAST, 1, 0.0, 0.0);
}

TEST(ways_over_bumps)
{
    check_all_ways(LOXO_SHAPE_BUMPY, 5000, NAN, EDGE, 3, 0.23, 5.8e-4);
    check_all_ways(LOXO_SHAPE_BUMPY, 5000, NAN, FAST, 3, 0.17, 3.7e-4);
}

TEST(ways_along_a_strip)
{
    check_all_ways(LOXO_SHAPE_STRIP, 600, NAN, EDGE, 1, 0.0, 0.0);
    check_all_ways(LOXO_SHAPE_STRIP, 600, NAN, FAST, 1, 0.0, 0.0);
}

/* Distances of an intrinsic triangulation, ways on its surface: as long as the exact distance, and as the solve's own within its
 * error, which is the method's on good triangles; recorded, half more allowed. Triangles are stretched by ten. */
TEST(ways_from_an_intrinsic_triangulation)
{
    NEEDS_IDS(6 * 3000);
    surface s =
        surface_from_soup(test_context, shape_stretched(LOXO_SHAPE_NOISY, 3000, 0.3, 10.0, 0.5), LOXO_ORDER_AUTO);
    const int64_t n = s.soup.n_vertices;
    const loxo_geodesic_settings exact = unjudged_settings(LOXO_GEODESIC_EXACT);
    const loxo_geodesic_method methods[2] = {LOXO_GEODESIC_FAST, LOXO_GEODESIC_EDGE};
    double *distance = surface_numbers(&s), *truth = surface_numbers(&s);
    loxo_surface_point source = at(5), *target = loxo_allocate(test_context, n, sizeof *target);
    loxo_mesh *intrinsic = NULL;
    for (int64_t v = 0; v < n; ++v)
        target[v] = at((loxo_index)v);
    CHECK_OK(loxo_mesh_create_intrinsic(test_context, s.mesh, NULL, NULL, &intrinsic));
    CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &exact, &source.vertex[0], 1, truth, NULL));
    for (int i = 0; i < 2; ++i) {
        const loxo_geodesic_settings settings = unjudged_settings(methods[i]);
        double of_exact = 0.0, of_own = 0.0;
        loxo_polylines lines;
        CHECK_OK(loxo_geodesic_distance(test_context, intrinsic, &settings, &source.vertex[0], 1, distance, NULL));
        CHECK_OK(loxo_geodesic_trace(test_context, s.mesh, distance, &source, 1, target, n, &lines));
        for (int64_t v = 0; v < n; ++v) {
            const double length = loxo_polyline_length(&lines, v);
            CHECK(length >= truth[v] * (1.0 - 1e-12));
            if (v == source.vertex[0]) continue;
            of_exact += (length / truth[v] - 1.0) / (double)n;
            of_own += fabs(length / distance[v] - 1.0) / (double)n;
        }
        print_message("%s: lengths are %.4f %% above the exact distances, %.3f %% off the solve's\n",
                      loxo_geodesic_method_name(methods[i]), 100.0 * of_exact, 100.0 * of_own);
        CHECK(of_exact < (i == 0 ? 2.5e-5 : 5e-5) && of_own < (i == 0 ? 1.6e-3 : 4.5e-3));
        loxo_polylines_destroy(test_context, &lines);
    }
    loxo_mesh_destroy(intrinsic);
    loxo_release(test_context, target);
    loxo_release(test_context, distance);
    loxo_release(test_context, truth);
    surface_destroy(&s);
}

/* Any field at all has an end to every way from it: no loops, whatever the low points. */
TEST(ways_down_nonsense)
{
    surface s = surface_make(test_context, LOXO_SHAPE_NOISY, 600, 0.3);
    double *field = surface_numbers(&s);
    loxo_surface_point source[2] = {at(5), in_face(&s, 100, 0.2, 0.2, 0.6)};
    for (int seed = 0; seed < 10; ++seed) {
        loxo_polylines lines;
        for (int64_t v = 0; v < s.soup.n_vertices; ++v)
            field[v] = (double)(((uint64_t)v + 7u * (uint64_t)seed) * 2654435761u % 97) - (seed % 2 == 0 ? 0.0 : 50.0);
        for (int64_t v = 0; v < s.soup.n_vertices; ++v) {
            const loxo_surface_point target = at((loxo_index)v);
            CHECK_OK(loxo_geodesic_trace(test_context, s.mesh, field, &source[seed % 2], 1, &target, 1, &lines));
            check_ends(&s, &lines, 0, &target, &source[seed % 2]);
            loxo_polylines_destroy(test_context, &lines);
        }
    }
    loxo_release(test_context, field);
    surface_destroy(&s);
}

/* The value of a place: of an edge the interpolation, which is between both ends also when rounded. */
static double value_of(const loxo_mesh_view *m, const double *field, const line_place *p)
{
    if (p->vertex >= 0) return field[p->vertex];
    const double a = field[m->halfedge_vertex[p->halfedge]], b = field[k_head(m, p->halfedge)];
    return fmin(fmax(a + p->t * (b - a), fmin(a, b)), fmax(a, b));
}

/* On fields that differ by units in the last place, rounding would lead up: every step from an edge ends no higher, and from a
 * vertex lower; but along edges out of low points. */
TEST(ways_go_down)
{
    surface s = surface_make(test_context, LOXO_SHAPE_NOISY, 300, 0.3);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    const line_goal goal = {.vertex = 7, .face = (loxo_index)(m.vertex_halfedge[7] / 3)};
    double *field = surface_numbers(&s);
    int64_t n_steps = 0;
    for (uint64_t seed = 0; seed < 60; ++seed) {
        line_descent *descent = NULL;
        line_way way = {.ctx = test_context};
        for (int64_t v = 0; v < m.n_vertices; ++v)
            field[v] = 1.0 + floor(6.0 * loxo_random_unit(seed, (uint64_t)v)) * (seed % 2 == 0 ? 0x1p-52 : 0x1p-51);
        CHECK_OK(line_descent_begin(test_context, &m, field, &goal, 1, &descent));
        for (loxo_index v = 0; v < m.n_vertices; ++v) {
            line_goal from = {.vertex = v, .face = (loxo_index)(m.vertex_halfedge[v] / 3)};
            if (v % 2 == 1) from = (line_goal){.vertex = -1, .face = from.face, .weight = {0.3, 0.3, 0.4}};
            CHECK_OK(line_descend(descent, &from, &way));
            for (int64_t i = 1; i + 1 < way.n; ++i) {
                const line_place *now = &way.place[i - 1], *next = &way.place[i];
                if (now->face >= 0 || (now->vertex >= 0 && next->vertex >= 0)) continue;
                const double before = value_of(&m, field, now), after = value_of(&m, field, next);
                CHECK(next->vertex >= 0 ? after <= before : after < before);
                ++n_steps;
            }
        }
        line_descent_end(descent);
        line_way_destroy(&way);
    }
    print_message("%lld steps\n", (long long)n_steps);
    CHECK(n_steps > 1000);
    loxo_release(test_context, field);
    surface_destroy(&s);
}

TEST(ways_that_are_none)
{
    /* two triangles that do not touch */
    static const double position[21] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 0.0,
                                        0.0, 6.0, 0.0, 0.0, 5.0, 1.0, 0.0, 9.0, 9.0, 9.0};
    static const loxo_index triangle[6] = {0, 1, 2, 3, 4, 5};
    surface s = surface_small(test_context, 7, position, 2, triangle);
    const loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    const loxo_surface_point near = at(1), far[4] = {at(2), at(4), at(6), at(0)}, wrong = {{0, 1, 4}, {0.3, 0.3, 0.4}};
    loxo_geodesic *g = NULL;
    loxo_polylines lines;
    double distance[7];
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_solve(g, (const loxo_index[]){1}, 1, distance, NULL));
    CHECK_OK(loxo_geodesic_paths(g, &near, 1, &lines)); /* from the source to itself: one point, twice */
    CHECK_EQUAL(lines.n_points, 2);
    CHECK_EQUAL(loxo_polyline_length(&lines, 0), 0.0);
    loxo_polylines_destroy(test_context, &lines);
    CHECK_OK(loxo_geodesic_paths(g, far, 4, &lines)); /* the others have theirs */
    CHECK_EQUAL(lines.n_lines, 4);
    CHECK_EQUAL(loxo_polyline_length(&lines, 0), sqrt(2.0));
    CHECK_EQUAL(lines.line_begin[1], lines.line_begin[3]); /* the other triangle; no face */
    CHECK(lines.value[1] == HUGE_VAL && lines.value[2] == HUGE_VAL);
    CHECK_EQUAL(lines.line_begin[4], lines.n_points);
    CHECK_NEAR(loxo_polyline_length(&lines, 3), 1.0, 1e-15);
    CHECK_OK(loxo_write_polylines(test_context, test_scratch("w.vtp"), &lines));
    CHECK_OK(loxo_write_polylines(test_context, test_scratch("w.csv"), &lines));
    loxo_polylines_destroy(test_context, &lines);
    CHECK_STATUS(test_context, loxo_geodesic_paths(g, &wrong, 1, &lines), LOXO_ERR_ARGUMENT);
    CHECK(lines.line_begin == NULL);
    CHECK_STATUS(test_context, loxo_geodesic_paths(g, &near, 0, &lines), LOXO_ERR_ARGUMENT);
    loxo_geodesic_destroy(g);
    /* a field that is finite where no source is */
    static const double field[7] = {1.0, 0.0, 1.0, 3.0, 2.0, 3.0, 4.0};
    CHECK_STATUS(test_context, loxo_geodesic_trace(test_context, s.mesh, field, &near, 1, &far[1], 1, &lines),
                 LOXO_ERR_ARGUMENT);
    surface_destroy(&s);
}

/* A call that is refused leaves what the solve before has found, its sources too. */
TEST(ways_after_a_refused_solve)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 100, NAN);
    double *distance = surface_numbers(&s), *heat = surface_numbers(&s);
    const loxo_index source = 0, bad = (loxo_index)s.soup.n_vertices;
    const loxo_surface_point target = at(77);
    for (int64_t v = 0; v < s.soup.n_vertices; ++v)
        heat[v] = v == 5 ? (double)NAN : 1.0;
    for (int method = 0; method < LOXO_GEODESIC_N_METHODS; ++method) {
        const loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
        loxo_geodesic *g = NULL;
        loxo_polylines before, after;
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        CHECK_OK(loxo_geodesic_solve(g, &source, 1, distance, NULL));
        CHECK_OK(loxo_geodesic_paths(g, &target, 1, &before));
        CHECK_STATUS(test_context, loxo_geodesic_solve(g, &bad, 1, distance, NULL), LOXO_ERR_ARGUMENT);
        CHECK_STATUS(test_context,
                     loxo_geodesic_solve_from_heat(g, (const loxo_index[]){9}, 1, heat, NULL, distance, NULL),
                     LOXO_ERR_ARGUMENT);
        CHECK_OK(loxo_geodesic_paths(g, &target, 1, &after));
        CHECK_EQUAL(after.n_points, before.n_points);
        CHECK(memcmp(after.position, before.position, (size_t)after.n_points * sizeof *after.position) == 0);
        loxo_polylines_destroy(test_context, &before);
        loxo_polylines_destroy(test_context, &after);
        loxo_geodesic_destroy(g);
    }
    loxo_release(test_context, heat);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

/* Two squares that touch in vertex 0, which a repair splits: whichever of them the source is in, a way from there is found. */
TEST(ways_from_a_vertex_that_was_split)
{
    static const double position[21] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, -1, 0, 0, -1, -1, 0, 0, -1, 0};
    static const loxo_index triangle[12] = {0, 1, 2, 0, 2, 3, 0, 4, 5, 0, 5, 6};
    const loxo_mesh_arrays arrays = {.n_vertices = 7, .n_faces = 4, .position = position, .triangle = triangle};
    loxo_mesh_settings settings = loxo_mesh_settings_default();
    loxo_mesh *mesh = NULL;
    settings.repair = true;
    CHECK_STATUS(test_context, loxo_mesh_create(test_context, &arrays, LOXO_COPY, &settings, NULL, &mesh),
                 LOXO_REPAIRED);
    for (int k = 0; k < 2; ++k) {
        const loxo_surface_point source = at(k == 0 ? 2 : 5), target = at(0);
        double distance[7];
        loxo_polylines lines;
        for (int v = 0; v < 7; ++v)
            distance[v] = v == 0 || (v < 4) == (k == 0) ? away(&position[3 * v], &position[k == 0 ? 6 : 15]) : HUGE_VAL;
        CHECK_OK(loxo_geodesic_trace(test_context, mesh, distance, &source, 1, &target, 1, &lines));
        CHECK_NEAR(loxo_polyline_length(&lines, 0), sqrt(2.0), 1e-15);
        loxo_polylines_destroy(test_context, &lines);
    }
    loxo_mesh_destroy(mesh);
}

static loxo_status find_ways(loxo_context *ctx, void *arg)
{
    const surface *s = arg;
    static const double field[6] = {0.0, 1.0, 1.0, 2.0, 0.5, 3.0};
    const loxo_surface_point source = in_face(s, 0, 0.3, 0.3, 0.4);
    loxo_mesh *mesh = NULL;
    loxo_polylines lines = {0};
    loxo_status status = loxo_mesh_create(ctx, &s->arrays, LOXO_BORROW, NULL, NULL, &mesh);
    for (loxo_index v = 0; v < 6 && status >= 0; ++v) {
        const loxo_surface_point target = at(v);
        status = loxo_geodesic_trace(ctx, mesh, field, &source, 1, &target, 1, &lines);
        loxo_polylines_destroy(ctx, &lines);
    }
    loxo_mesh_destroy(mesh);
    return status;
}

TEST(each_allocation_fails)
{
    /* a strip with a low point at its far end */
    static const double position[18] = {0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0,
                                        1.0, 1.0, 0.0, 2.0, 0.0, 0.0, 2.0, 1.0, 0.0};
    static const loxo_index triangle[12] = {0, 2, 1, 1, 2, 3, 2, 4, 3, 3, 4, 5};
    surface s = surface_small(test_context, 6, position, 4, triangle);
    CHECK(test_each_allocation_fails(find_ways, &s) > 20);
    surface_destroy(&s);
}
