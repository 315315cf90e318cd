/* SPDX-License-Identifier: MIT
 * Ways back to the sources: straight on planes, as long as the distance, always arriving. */
#include "surfaces.h"

#include <loxo/geodesic.h>

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

/* True distances on a flat disk: the way is the straight line, but for the linear interpolation of the distance, whose
 * gradient is off by O(h / r) a distance r from the source: lengths by its square. */
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
        CHECK(worst < (pass == 0 ? 0.03 : 0.01) && aside < (pass == 0 ? 0.05 : 0.015));
        loxo_polylines_destroy(test_context, &lines);
        loxo_release(test_context, distance);
        surface_destroy(&s);
    }
}

/* From every vertex of surfaces of all kinds, down the distances of solves: every way arrives, ends at a source, and is as
 * long as the distance says, within the method's error. bound: of the mean of |length / distance - 1|. */
static void check_all_ways(loxo_shape shape, int64_t n_vertices, double param, int method, int64_t n_sources,
                           double bound)
{
    NEEDS_IDS(6 * n_vertices);
    surface s = surface_make(test_context, shape, n_vertices, param);
    const int64_t n = s.soup.n_vertices;
    loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
    loxo_surface_point source[3] = {at(17), in_face(&s, s.soup.n_faces / 2, 0.0, 0.5, 0.5),
                                    in_face(&s, s.soup.n_faces / 3, 0.3, 0.3, 0.4)};
    loxo_surface_point *target = loxo_allocate(test_context, n, sizeof *target);
    double *distance = surface_numbers(&s), sum = 0.0, n_far = 0.0;
    loxo_geodesic *g = NULL;
    loxo_geodesic_info info;
    loxo_polylines lines;
    for (int64_t v = 0; v < n; ++v)
        target[v] = at((loxo_index)v);
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_STATUS(test_context, loxo_geodesic_paths(g, target, n, &lines), LOXO_ERR_ARGUMENT);
    CHECK_OK(loxo_geodesic_solve_points(g, source, n_sources, distance, &info));
    CHECK_OK(loxo_geodesic_paths(g, target, n, &lines));
    CHECK_EQUAL(lines.n_lines, n);
    for (int64_t v = 0; v < n; ++v) {
        const double *end = lines.position[lines.line_begin[v + 1] - 1];
        double nearest = 1.0, x[3];
        for (int64_t i = 0; i < n_sources; ++i) {
            place_of(&s, &source[i], x);
            nearest = fmin(nearest, away(x, end));
        }
        CHECK(nearest < 1e-14);
        CHECK_EQUAL(lines.value[v], distance[v]);
        if (distance[v] < 3.0 * info.mean_edge_length) continue;
        sum += fabs(loxo_polyline_length(&lines, v) / distance[v] - 1.0);
        n_far += 1.0;
    }
    print_message("%s, %s: lengths off by %.3f %% in the mean\n", loxo_shape_name(shape), method_names[method],
                  100.0 * sum / n_far);
    CHECK(sum / n_far < bound);
    loxo_polylines_destroy(test_context, &lines);
    loxo_geodesic_destroy(g);
    loxo_release(test_context, target);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

TEST(ways_on_a_sphere) { check_all_ways(LOXO_SHAPE_ICOSPHERE, 2500, NAN, LOXO_GEODESIC_EDGE, 1, 0.03); }

TEST(ways_on_a_noisy_sphere) { check_all_ways(LOXO_SHAPE_NOISY, 2500, 0.3, LOXO_GEODESIC_FACE, 3, 0.05); }

TEST(ways_on_a_torus) { check_all_ways(LOXO_SHAPE_TORUS, 2500, NAN, LOXO_GEODESIC_FACE, 2, 0.03); }

TEST(ways_around_a_hole) { check_all_ways(LOXO_SHAPE_ANNULUS, 2500, NAN, LOXO_GEODESIC_EDGE, 1, 0.04); }

TEST(ways_over_bumps) { check_all_ways(LOXO_SHAPE_BUMPY, 5000, NAN, LOXO_GEODESIC_EDGE, 3, 0.08); }

TEST(ways_along_a_strip) { check_all_ways(LOXO_SHAPE_STRIP, 600, NAN, LOXO_GEODESIC_EDGE, 1, 0.03); }

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

TEST(ways_that_are_none)
{
    /* two triangles that do not touch */
    static const double position[18] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0,
                                        5.0, 0.0, 0.0, 6.0, 0.0, 0.0, 5.0, 1.0, 0.0};
    static const loxo_index triangle[6] = {0, 1, 2, 3, 4, 5};
    surface s = surface_small(test_context, 6, position, 2, triangle);
    const loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    const loxo_surface_point near = at(1), far[2] = {at(2), at(4)}, wrong = {{0, 1, 4}, {0.3, 0.3, 0.4}};
    loxo_geodesic *g = NULL;
    loxo_polylines lines;
    double distance[6];
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_solve(g, (const loxo_index[]){1}, 1, distance, NULL));
    CHECK_OK(loxo_geodesic_paths(g, &near, 1, &lines)); /* from the source to itself: one point, twice */
    CHECK_EQUAL(lines.n_points, 2);
    CHECK_EQUAL(loxo_polyline_length(&lines, 0), 0.0);
    loxo_polylines_destroy(test_context, &lines);
    CHECK_STATUS(test_context, loxo_geodesic_paths(g, far, 2, &lines), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    CHECK(lines.line_begin == NULL);
    CHECK_STATUS(test_context, loxo_geodesic_paths(g, &wrong, 1, &lines), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_geodesic_paths(g, &near, 0, &lines), LOXO_ERR_ARGUMENT);
    loxo_geodesic_destroy(g);
    /* a field that is finite where no source is */
    static const double field[6] = {1.0, 0.0, 1.0, 3.0, 2.0, 3.0};
    CHECK_STATUS(test_context, loxo_geodesic_trace(test_context, s.mesh, field, &near, 1, &far[1], 1, &lines),
                 LOXO_ERR_ARGUMENT);
    surface_destroy(&s);
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
