/* SPDX-License-Identifier: MIT
 * What holds for exact distances on any surface, and what becomes of solves that end early. */
#include "../shapes.h"
#include "base/context.h"
#include "base/rng.h"
#include "surfaces.h"

#include <loxo/geodesic.h>
#include <loxo/lines.h>

static loxo_geodesic_settings exact_settings(void) { return unjudged_settings(LOXO_GEODESIC_EXACT); }

static loxo_soup soup_shaken(loxo_shape shape, int64_t n_vertices, double by)
{
    loxo_soup soup = soup_make(test_context, shape, n_vertices, NAN);
    for (int64_t i = 0; i < 3 * soup.n_vertices; ++i)
        soup.position[i] += by * (loxo_random_unit(3, (uint64_t)i) - 0.5);
    return soup;
}

static const struct {
    loxo_shape shape;
    double shake;
} shapes[] = {
    {LOXO_SHAPE_ICOSPHERE, 0.1}, {LOXO_SHAPE_TORUS, 0.1}, {LOXO_SHAPE_ANNULUS, 0.05}, {LOXO_SHAPE_BRAIN, 0.0}};
#define N_SHAPES 4

static loxo_geodesic *solver_of(const surface *s, const loxo_geodesic_settings *settings)
{
    loxo_geodesic *g = NULL;
    CHECK_STATUS(s->ctx, loxo_geodesic_create(s->ctx, s->mesh, settings, &g), LOXO_OK);
    return g;
}

/* Rounding: distances of some 50 faces, a few units each. */
#define ROUNDING 1e-13

TEST(a_metric)
{
    const loxo_geodesic_settings settings = exact_settings();
    for (int i = 0; i < N_SHAPES; ++i) {
        surface s =
            surface_from_soup(test_context, soup_shaken(shapes[i].shape, 300, shapes[i].shake), LOXO_ORDER_AUTO);
        const int64_t n = s.soup.n_vertices;
        loxo_geodesic *g = solver_of(&s, &settings);
        double *d = loxo_allocate(test_context, n * n, sizeof *d);
        for (int64_t v = 0; v < n; ++v) {
            const loxo_index source = (loxo_index)v;
            CHECK_OK(loxo_geodesic_solve(g, &source, 1, &d[v * n], NULL));
        }
        for (int64_t a = 0; a < n; ++a)
            for (int64_t b = 0; b < n; ++b) {
                CHECK_NEAR(d[a * n + b], d[b * n + a], ROUNDING * d[a * n + b]);
                const int64_t c = (a * 7 + b * 13) % n;
                CHECK(d[a * n + b] <= (d[a * n + c] + d[c * n + b]) * (1.0 + ROUNDING));
            }
        for (int64_t e = 0; e < 3 * s.soup.n_faces; ++e) { /* no faster along an edge than the edge is long */
            const int64_t a = s.soup.triangle[e], b = s.soup.triangle[e - e % 3 + (e + 1) % 3];
            const double *p = &s.soup.position[3 * a], *q = &s.soup.position[3 * b];
            const double length =
                sqrt((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) + (p[2] - q[2]) * (p[2] - q[2]));
            for (int64_t v = 0; v < n; v += 17)
                CHECK(fabs(d[v * n + a] - d[v * n + b]) <= length * (1.0 + 1e-12));
        }
        loxo_release(test_context, d);
        loxo_geodesic_destroy(g);
        surface_destroy(&s);
    }
}

/* Several sources give the least of what each gives, and the nearest is the one that gives it. */
TEST(several_sources_are_the_least_of_each)
{
    loxo_geodesic_settings settings = exact_settings();
    settings.nearest = true;
    for (int i = 0; i < N_SHAPES; ++i) {
        surface s =
            surface_from_soup(test_context, soup_shaken(shapes[i].shape, 600, shapes[i].shake), LOXO_ORDER_AUTO);
        const int64_t n = s.soup.n_vertices, n_faces = s.soup.n_faces;
        loxo_geodesic *g = solver_of(&s, &settings);
        double *d = loxo_allocate(test_context, 6 * n, sizeof *d);
        loxo_index *nearest = loxo_allocate(test_context, n, sizeof *nearest);
        loxo_surface_point points[5];
        for (int k = 0; k < 5; ++k) { /* inside faces, on an edge, at a vertex */
            static const double weight[5][3] = {
                {0.2, 0.3, 0.5}, {0.6, 0.4, 0.0}, {1.0, 0.0, 0.0}, {0.1, 0.1, 0.8}, {0.0, 0.0, 1.0}};
            const loxo_index *t = &s.soup.triangle[3 * ((k * n_faces) / 5)];
            points[k] = (loxo_surface_point){{t[0], t[1], t[2]}, {weight[k][0], weight[k][1], weight[k][2]}};
            CHECK_OK(loxo_geodesic_solve_points(g, &points[k], 1, &d[k * n], NULL));
        }
        CHECK_OK(loxo_geodesic_solve_points(g, points, 5, &d[5 * n], NULL));
        CHECK_OK(loxo_geodesic_nearest(g, nearest));
        for (int64_t v = 0; v < n; ++v) {
            double least = HUGE_VAL;
            for (int k = 0; k < 5; ++k)
                least = fmin(least, d[k * n + v]);
            CHECK_NEAR(d[5 * n + v], least, ROUNDING * least);
            CHECK(nearest[v] >= 0 && nearest[v] < 5);
            CHECK_NEAR(d[nearest[v] * n + v], least, ROUNDING * least);
        }
        loxo_release(test_context, nearest);
        loxo_release(test_context, d);
        loxo_geodesic_destroy(g);
        surface_destroy(&s);
    }
}

/* The surface is the same, the triangles are smaller: so are the distances, of faces, edges and numbers of any order. */
TEST(subdivision_and_order_change_nothing)
{
    const loxo_geodesic_settings settings = exact_settings();
    for (int i = 0; i < N_SHAPES; ++i) {
        loxo_soup soup = soup_shaken(shapes[i].shape, 200, shapes[i].shake);
        const int64_t n = soup.n_vertices;
        const loxo_index source = (loxo_index)(n / 2);
        double *coarse = loxo_allocate(test_context, n, sizeof *coarse);
        surface s = surface_from_soup(test_context, soup, LOXO_ORDER_GIVEN);
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, &source, 1, coarse, NULL));
        loxo_mesh_destroy(s.mesh);
        CHECK_OK(loxo_soup_subdivide(test_context, &s.soup, 2));
        s = surface_from_soup(test_context, s.soup, LOXO_ORDER_BFS);
        double *fine = surface_numbers(&s);
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, &source, 1, fine, NULL));
        for (int64_t v = 0; v < n; ++v)
            CHECK_NEAR(coarse[v], fine[v], ROUNDING * coarse[v]);
        loxo_release(test_context, coarse);
        loxo_release(test_context, fine);
        surface_destroy(&s);
    }
}

/* Puts a vertex into a face: at a corner, so that an edge has no length, or on an edge, so that a face has no height. */
static void put_into_face(loxo_soup *soup, int64_t face, const double weight[3])
{
    loxo_index *t = &soup->triangle[3 * face], *more = &soup->triangle[3 * soup->n_faces];
    const loxo_index v = (loxo_index)soup->n_vertices, corner[3] = {t[0], t[1], t[2]};
    const loxo_index faces[9] = {corner[0], corner[1], v, corner[1], corner[2], v, corner[2], corner[0], v};
    for (int j = 0; j < 3; ++j) {
        double x = 0.0;
        for (int k = 0; k < 3; ++k)
            x += weight[k] * soup->position[3 * corner[k] + j];
        soup->position[3 * v + j] = x;
    }
    memcpy(t, faces, 3 * sizeof *t);
    memcpy(more, &faces[3], 6 * sizeof *t);
    soup->n_vertices += 1;
    soup->n_faces += 2;
}

/* Ways back on such a surface are as long as the distance; where vertices lie on each other, a few are given up. */
static void check_ways(const surface *s, const loxo_geodesic_settings *settings, loxo_index source, int64_t *n_ways,
                       int64_t *n_lost)
{
    loxo_geodesic *g = solver_of(s, settings);
    double *d = surface_numbers(s);
    CHECK_OK(loxo_geodesic_solve(g, &source, 1, d, NULL));
    for (int64_t v = 0; v < s->soup.n_vertices; ++v) {
        const loxo_surface_point from = {{(loxo_index)v, -1, -1}, {1.0, 0.0, 0.0}};
        loxo_polylines lines;
        const loxo_status status = loxo_geodesic_paths(g, &from, 1, &lines);
        *n_ways += 1;
        if (status == LOXO_ERR_NUMERIC) {
            *n_lost += 1;
            continue;
        }
        CHECK_STATUS(test_context, status, LOXO_OK);
        CHECK_NEAR(loxo_polyline_length(&lines, 0), d[v], 1e-12);
        loxo_polylines_destroy(test_context, &lines);
    }
    loxo_release(test_context, d);
    loxo_geodesic_destroy(g);
}

/* Faces without area, alone and beside each other, are passed as if they were not there. The places of points on edges are
 * rounded: 1e-16 of the coordinates. */
TEST(faces_without_area_change_nothing)
{
    static const double weight[4][3] = {{1.0, 0.0, 0.0}, {0.5, 0.5, 0.0}, {0.0, 0.0, 1.0}, {0.0, 0.25, 0.75}};
    const loxo_geodesic_settings settings = exact_settings();
    int64_t n_ways = 0, n_lost = 0;
    for (int round = 0; round < 40; ++round) {
        loxo_soup soup = soup_shaken(shapes[round % N_SHAPES].shape, 150, shapes[round % N_SHAPES].shake);
        const int64_t n = soup.n_vertices, n_more = round < 20 ? 5 : 100;
        loxo_soup more = {.n_vertices = n, .n_faces = soup.n_faces};
        more.position = loxo_allocate(test_context, 3 * (n + n_more), sizeof *more.position);
        more.triangle = loxo_allocate(test_context, 3 * (soup.n_faces + 2 * n_more), sizeof *more.triangle);
        memcpy(more.position, soup.position, (size_t)(3 * n) * sizeof *more.position);
        memcpy(more.triangle, soup.triangle, (size_t)(3 * soup.n_faces) * sizeof *more.triangle);
        for (int64_t k = 0; k < n_more; ++k) {
            const uint64_t hash = loxo_random_u64((uint64_t)round, (uint64_t)k);
            put_into_face(&more, (int64_t)(hash % (uint64_t)more.n_faces), weight[(hash >> 40) % 4]);
        }
        surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
        surface t = surface_from_soup(test_context, more, LOXO_ORDER_AUTO);
        double *a = surface_numbers(&s), *b = surface_numbers(&t), worst = 0.0;
        const loxo_index source = (loxo_index)((round * 37) % n);
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, &source, 1, a, NULL));
        CHECK_OK(loxo_geodesic_distance(test_context, t.mesh, &settings, &source, 1, b, NULL));
        for (int64_t v = 0; v < n; ++v)
            if (a[v] > 0.0) worst = fmax(worst, fabs(a[v] - b[v]) / a[v]);
        if (worst > 1e-13)
            print_error("round %d, %s: %.3g\n", round, loxo_shape_name(shapes[round % N_SHAPES].shape), worst);
        CHECK(worst <= 1e-13);
        check_ways(&t, &settings, source, &n_ways, &n_lost);
        loxo_release(test_context, a);
        loxo_release(test_context, b);
        surface_destroy(&s);
        surface_destroy(&t);
    }
    print_message("%lld of %lld ways are given up\n", (long long)n_lost, (long long)n_ways);
    CHECK(n_lost * 200 < n_ways);
}

/* The faces of the intrinsic Delaunay triangulation are others, and known by rounded lengths: the surface is off by their
 * rounding errors, which flips of needles grow. */
TEST(intrinsic_triangulations_have_the_same_distances)
{
    const loxo_geodesic_settings settings = exact_settings();
    for (int i = 0; i < N_SHAPES; ++i) {
        surface s =
            surface_from_soup(test_context, soup_shaken(shapes[i].shape, 400, shapes[i].shake), LOXO_ORDER_AUTO);
        const int64_t n = s.soup.n_vertices;
        loxo_mesh *intrinsic = NULL;
        double *a = surface_numbers(&s), *b = surface_numbers(&s), worst = 0.0;
        const loxo_index source = (loxo_index)(n / 3);
        CHECK_OK(loxo_mesh_create_intrinsic(test_context, s.mesh, NULL, NULL, &intrinsic));
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, &source, 1, a, NULL));
        CHECK_OK(loxo_geodesic_distance(test_context, intrinsic, &settings, &source, 1, b, NULL));
        for (int64_t v = 0; v < n; ++v)
            if (a[v] > 0.0) worst = fmax(worst, fabs(a[v] - b[v]) / a[v]);
        print_message("%s: %.2g\n", loxo_shape_name(shapes[i].shape), worst);
        CHECK(worst < 1e-10);
        loxo_release(test_context, a);
        loxo_release(test_context, b);
        loxo_mesh_destroy(intrinsic);
        surface_destroy(&s);
    }
}

/* Inside the limit nothing changes but rounding, beyond it there is nothing; the work is that of the ball. */
TEST(limited_solves_agree_inside_the_ball)
{
    const loxo_geodesic_settings settings = exact_settings();
    surface s = surface_from_soup(test_context, soup_shaken(LOXO_SHAPE_ICOSPHERE, 4000, 0.02), LOXO_ORDER_AUTO);
    const int64_t n = s.soup.n_vertices;
    loxo_geodesic *g = solver_of(&s, &settings);
    double *all = surface_numbers(&s), *near = surface_numbers(&s);
    loxo_geodesic_info whole, part;
    const loxo_index source = 77;
    CHECK_OK(loxo_geodesic_solve(g, &source, 1, all, &whole));
    for (int i = 0; i < 7; ++i) {
        const double limit = ldexp(0.05, i);
        CHECK_OK(loxo_geodesic_limit(g, limit));
        CHECK_OK(loxo_geodesic_solve(g, &source, 1, near, &part));
        for (int64_t v = 0; v < n; ++v) {
            if (all[v] <= limit * (1.0 - 1e-12)) CHECK_NEAR(near[v], all[v], ROUNDING * all[v]);
            if (all[v] > limit * (1.0 + 1e-12)) CHECK(isinf(near[v]));
        }
        if (limit < 0.5) /* of a sphere's area a sixteenth at most, and half an edge more */
            CHECK((double)part.n_evaluations < 0.25 * (double)whole.n_evaluations);
    }
    loxo_release(test_context, all);
    loxo_release(test_context, near);
    loxo_geodesic_destroy(g);
    surface_destroy(&s);
}

/* Two pieces, one vertex without faces, a source on a boundary. */
TEST(pieces_and_lonely_vertices)
{
    const loxo_geodesic_settings settings = exact_settings();
    const double position[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                   {5, 5, 5}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
    const loxo_index triangle[9] = {0, 1, 2, 0, 2, 3, 5, 6, 7};
    const loxo_index sources[2] = {3, 6};
    surface s = surface_small(test_context, 8, position[0], 3, triangle);
    double d[8];
    CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, sources, 1, d, NULL));
    const double expected[8] = {1.0, sqrt(2.0), 1.0, 0.0, HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL};
    for (int v = 0; v < 8; ++v)
        CHECK_NEAR(d[v], expected[v], 1e-15);
    CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, sources, 2, d, NULL));
    CHECK_NEAR(d[7], sqrt(2.0), 1e-15);
    CHECK_NEAR(d[5], 1.0, 1e-15);
    CHECK(isinf(d[4]));
    surface_destroy(&s);
}

/* The bits do not depend on threads, nor on what was solved before. */
TEST(same_bits)
{
    uint64_t hash = 0;
    for (int n_threads = 1; n_threads <= 7; n_threads += n_threads < 3 ? 1 : 4) {
        loxo_context *ctx = test_context_with_threads(n_threads);
        const loxo_geodesic_settings settings = exact_settings();
        surface s = surface_make(ctx, LOXO_SHAPE_BRAIN, 3000, NAN);
        loxo_geodesic *g = solver_of(&s, &settings);
        double *d = surface_numbers(&s);
        const loxo_index sources[2] = {5, 1200};
        for (int round = 0; round < 3; ++round) {
            CHECK_STATUS(ctx, loxo_geodesic_solve(g, &sources[round % 2], 1, d, NULL), LOXO_OK);
            if (round == 1) continue;
            const uint64_t h = test_hash(d, (size_t)s.soup.n_vertices * sizeof *d);
            if (hash == 0) hash = h;
            CHECK_EQUAL(h, hash);
        }
        loxo_release(ctx, d);
        loxo_geodesic_destroy(g);
        surface_destroy(&s);
        loxo_context_destroy(ctx);
    }
}

/* ---- solves that end early ---- */

static int stop_at_once(void *user, const loxo_progress *p)
{
    int *n = user;
    if (strcmp(p->phase, "windows") != 0) return 0;
    *n += 1;
    return 1;
}

/* The monitor is asked every 20 ms at most: a surface that takes longer. What is there then is no less than the truth. */
TEST(stopped_by_the_monitor)
{
    const loxo_geodesic_settings settings = exact_settings();
    NEEDS_IDS(240000);
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 40000, NAN);
    const int64_t n = s.soup.n_vertices;
    loxo_geodesic *g = solver_of(&s, &settings);
    double *stopped = surface_numbers(&s), *all = surface_numbers(&s);
    const loxo_index source = 1;
    loxo_geodesic_info info;
    int n_asked = 0;
    loxo_context_set_monitor(test_context, stop_at_once, &n_asked);
    CHECK_STATUS(test_context, loxo_geodesic_solve(g, &source, 1, stopped, &info), LOXO_STOPPED);
    CHECK_EQUAL(n_asked, 1);
    CHECK_EQUAL(info.stop_reason, LOXO_STOP_MONITOR);
    loxo_context_set_monitor(test_context, NULL, NULL);
    CHECK_OK(loxo_geodesic_solve(g, &source, 1, all, &info));
    CHECK_EQUAL(info.stop_reason, LOXO_STOP_TOLERANCE);
    for (int64_t v = 0; v < n; ++v)
        CHECK(stopped[v] >= all[v] * (1.0 - ROUNDING));
    CHECK_EQUAL(stopped[source], 0.0);
    CHECK(info.max_windows > 0 && info.n_bends > 0 && info.n_evaluations > n);
    CHECK(info.workspace_bytes < (size_t)n * 100 + ((size_t)4 << 20));
    loxo_release(test_context, stopped);
    loxo_release(test_context, all);
    loxo_geodesic_destroy(g);
    surface_destroy(&s);
}

static loxo_status solve_and_trace(loxo_context *ctx, void *arg)
{
    const loxo_soup *soup = arg;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    const loxo_geodesic_settings settings = exact_settings();
    const loxo_surface_point points[2] = {
        {{soup->triangle[0], soup->triangle[1], soup->triangle[2]}, {0.2, 0.3, 0.5}},
        {{soup->triangle[600], soup->triangle[601], soup->triangle[602]}, {0.5, 0.1, 0.4}}};
    loxo_mesh *mesh = NULL;
    loxo_geodesic *g = NULL;
    loxo_polylines lines = {0};
    double *distance = malloc((size_t)soup->n_vertices * sizeof *distance);
    loxo_status status = loxo_mesh_create(ctx, &arrays, LOXO_COPY, NULL, NULL, &mesh);
    if (status >= 0) status = loxo_geodesic_create(ctx, mesh, &settings, &g);
    if (status >= 0) {
        status = loxo_geodesic_solve_points(g, points, 1, distance, NULL);
        if (status < 0) { /* memory is back: the object is good for another solve */
            test_allocator *allocator = ctx->settings.allocator.user;
            allocator->fail_at = -1;
            CHECK_STATUS(ctx, loxo_geodesic_solve_points(g, points, 1, distance, NULL), LOXO_OK);
        } else {
            status = loxo_geodesic_paths(g, &points[1], 1, &lines);
            if (status >= 0) loxo_polylines_destroy(ctx, &lines);
        }
    }
    loxo_geodesic_destroy(g);
    loxo_mesh_destroy(mesh);
    free(distance);
    return status;
}

TEST(each_allocation_fails)
{
    loxo_soup soup = soup_shaken(LOXO_SHAPE_TORUS, 400, 0.1);
    const int64_t n = test_each_allocation_fails(solve_and_trace, &soup);
    print_message("%lld allocations\n", (long long)n);
    CHECK(n > 15);
    loxo_soup_destroy(test_context, &soup);
}

/* The front does not fit: refused, and solved where there is room again. */
TEST(front_over_the_limit_of_memory)
{
    loxo_context *ctx = test_context_with_threads(1);
    const loxo_geodesic_settings settings = exact_settings();
    surface s = surface_make(ctx, LOXO_SHAPE_BRAIN, 3000, NAN);
    loxo_geodesic *g = solver_of(&s, &settings);
    double *d = surface_numbers(&s);
    const loxo_index source = 0;
    const size_t limit_bytes = ctx->limit_bytes;
    ctx->limit_bytes = loxo_context_memory(ctx).current_bytes + 1000;
    CHECK_STATUS(ctx, loxo_geodesic_solve(g, &source, 1, d, NULL), LOXO_ERR_MEMORY);
    ctx->limit_bytes = limit_bytes;
    CHECK_STATUS(ctx, loxo_geodesic_solve(g, &source, 1, d, NULL), LOXO_OK);
    loxo_release(ctx, d);
    loxo_geodesic_destroy(g);
    surface_destroy(&s);
    loxo_context_destroy(ctx);
}
