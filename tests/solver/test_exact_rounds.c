/* SPDX-License-Identifier: MIT
 * Exact distances on several threads, in balls, without memory and stopped: none of it leaves a trace in the next solve. */
#include "../shapes.h"
#include "base/context.h"
#include "solver/geodesic/geodesic_internal.h"
#include "stopper.h"
#include "surfaces.h"

#include <loxo/lines.h>

static loxo_geodesic_settings exact_settings(void)
{
    loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EXACT);
    settings.nearest = true;
    return settings;
}

/* A saddle: a hub among many faces, higher and lower by turns, so that ways bend there. */
static loxo_soup soup_crown(int64_t n)
{
    loxo_soup soup = shape_empty(test_context, 2 * n + 1, 3 * n);
    for (int64_t i = 0; i < n; ++i) {
        const double angle = 6.283185307179586 * (double)i / (double)n;
        loxo_index *t = &soup.triangle[9 * i];
        const loxo_index a = (loxo_index)(i + 1), b = (loxo_index)((i + 1) % n + 1);
        for (int k = 1; k <= 2; ++k) {
            double *p = &soup.position[3 * (i + 1 + (k - 1) * n)];
            p[0] = k * cos(angle), p[1] = k * sin(angle), p[2] = k * sin(5.0 * angle);
        }
        t[0] = 0, t[1] = a, t[2] = b;
        t[3] = a, t[4] = (loxo_index)(a + n), t[5] = b;
        t[6] = b, t[7] = (loxo_index)(a + n), t[8] = (loxo_index)(b + n);
    }
    soup.position[0] = soup.position[1] = soup.position[2] = 0.0;
    return soup;
}

/* The first n of some points inside faces, on edges and at vertices. */
static void points_of(const loxo_soup *soup, int64_t n, loxo_surface_point *point)
{
    static const double weight[4][3] = {{0.2, 0.3, 0.5}, {1.0, 0.0, 0.0}, {0.6, 0.4, 0.0}, {0.1, 0.1, 0.8}};
    for (int64_t i = 0; i < n; ++i) {
        const loxo_index *t = &soup->triangle[3 * ((131 + 7919 * i) % soup->n_faces)];
        point[i] = (loxo_surface_point){{t[0], t[1], t[2]}, {weight[i % 4][0], weight[i % 4][1], weight[i % 4][2]}};
    }
}

typedef struct hashed {
    const loxo_soup *soup;
    int64_t n_points;
    double limit;
} hashed;

/* Distances, nearest sources, ways and numbers of a solve. */
static uint64_t hash_on(loxo_context *ctx, const void *arg)
{
    const hashed *what = arg;
    const loxo_soup *soup = what->soup;
    loxo_soup copy = *soup;
    surface s = {.ctx = ctx, .arrays = loxo_soup_arrays(&copy), .soup = copy};
    loxo_geodesic_settings settings = exact_settings();
    loxo_geodesic *g = NULL;
    loxo_geodesic_info info;
    loxo_surface_point points[8];
    loxo_polylines lines;
    loxo_index *nearest = loxo_allocate(ctx, soup->n_vertices, sizeof *nearest);
    double *distance = surface_numbers(&s);
    settings.max_distance = what->limit;
    points_of(soup, 8, points);
    CHECK_STATUS(ctx, loxo_mesh_create(ctx, &s.arrays, LOXO_BORROW, NULL, NULL, &s.mesh), LOXO_OK);
    CHECK_STATUS(ctx, loxo_geodesic_create(ctx, s.mesh, &settings, &g), LOXO_OK);
    CHECK_STATUS(ctx, loxo_geodesic_solve_points(g, points, what->n_points, distance, &info), LOXO_OK);
    CHECK_STATUS(ctx, loxo_geodesic_nearest(g, nearest), LOXO_OK);
    uint64_t hash = test_hash(distance, (size_t)soup->n_vertices * sizeof *distance) ^
                    test_hash(nearest, (size_t)soup->n_vertices * sizeof *nearest);
    const int64_t number[5] = {info.n_evaluations, info.n_bends, info.max_windows, info.n_iterations, info.n_unreached};
    hash ^= test_hash(number, sizeof number);
    if (what->limit == HUGE_VAL) {
        CHECK_STATUS(ctx, loxo_geodesic_paths(g, points, 3, &lines), LOXO_OK);
        hash ^= test_hash(lines.position, (size_t)(3 * lines.line_begin[3]) * sizeof(double));
        loxo_polylines_destroy(ctx, &lines);
    }
    loxo_geodesic_destroy(g);
    loxo_mesh_destroy(s.mesh);
    loxo_release(ctx, distance);
    loxo_release(ctx, nearest);
    return hash;
}

static void check_threads(loxo_soup soup)
{
    for (int part = 0; part < 3; ++part)
        test_same_for_any_threads(hash_on, &(hashed){&soup, part == 0 ? 1 : 5, part == 2 ? 0.3 : HUGE_VAL});
    loxo_soup_destroy(test_context, &soup);
}

TEST(same_bits_for_any_number_of_threads)
{
    static const loxo_shape shape[3] = {LOXO_SHAPE_NOISY, LOXO_SHAPE_ANNULUS, LOXO_SHAPE_BRAIN};
    NEEDS_IDS(50000);
    for (int i = 0; i < 3; ++i)
        check_threads(soup_make(test_context, shape[i], 8000, NAN));
}

/* Its hub sends windows into thousands of faces at once. */
TEST(same_bits_where_ways_bend) { check_threads(soup_crown(3600)); }

/* A limited solve looks at the ball only, and at what lies one face beyond, and leaves nothing behind. */
TEST(balls)
{
    NEEDS_IDS(50000);
    for (int n_threads = 1; n_threads <= 2; ++n_threads) {
        loxo_context *ctx = test_context_with_threads(n_threads);
        surface s = surface_make(ctx, LOXO_SHAPE_NOISY, 8000, NAN);
        const int64_t n = s.soup.n_vertices;
        const loxo_geodesic_settings settings = exact_settings();
        loxo_geodesic *g = NULL;
        double *whole = surface_numbers(&s), *part = surface_numbers(&s);
        loxo_index *nearest = loxo_allocate(ctx, n, sizeof *nearest);
        loxo_geodesic_info info, of_part;
        CHECK_STATUS(ctx, loxo_geodesic_create(ctx, s.mesh, &settings, &g), LOXO_OK);
        for (int i = 0; i < 6; ++i) {
            const loxo_index sources[2] = {(loxo_index)(17 + 600 * i), (loxo_index)(3500 + i)};
            const double limit = i % 3 == 2 ? 0.8 : 0.08 * (1 + i % 3);
            int64_t n_touched = 0, n_inside = 0;
            CHECK_STATUS(ctx, loxo_geodesic_limit(g, HUGE_VAL), LOXO_OK);
            CHECK_STATUS(ctx, loxo_geodesic_solve(g, sources, 2, whole, &info), LOXO_OK);
            CHECK(g->engine->touched(g->state, &n_touched) == NULL);
            CHECK_STATUS(ctx, loxo_geodesic_limit(g, limit), LOXO_OK);
            for (int again = 0; again < 2; ++again) { /* after a whole solve, and after a ball */
                CHECK_STATUS(ctx, loxo_geodesic_solve(g, sources, 2, part, &of_part), LOXO_OK);
                CHECK_STATUS(ctx, loxo_geodesic_nearest(g, nearest), LOXO_OK);
                n_inside = 0;
                for (int64_t v = 0; v < n; ++v) {
                    const bool is_inside = part[v] < HUGE_VAL;
                    CHECK(is_inside == (nearest[v] >= 0));
                    if (is_inside) CHECK_NEAR(part[v], whole[v], 1e-13 * whole[v]);
                    if (!is_inside) CHECK(whole[v] > limit * (1.0 - 1e-12));
                    n_inside += is_inside;
                }
                CHECK_EQUAL(of_part.n_unreached, n - n_inside);
            }
            const loxo_index *touched = g->engine->touched(g->state, &n_touched);
            CHECK((touched == NULL) == (limit > 0.5));
            if (touched == NULL) continue;
            int64_t n_finite = 0;
            for (int64_t k = 0; k < n_touched; ++k) {
                CHECK(k == 0 || touched[k] > touched[k - 1]);
                n_finite += g->distance[touched[k]] < HUGE_VAL;
            }
            CHECK_EQUAL(n_finite, n_inside);
            /* A rim of three edges: an edge is 0.05, the ball's area pi limit^2. */
            const double rim = (limit + 0.15) / limit;
            CHECK((double)n_touched < 2.0 * rim * rim * (double)n_inside);
            CHECK((double)of_part.n_evaluations < 0.1 * (double)info.n_evaluations);
        }
        loxo_release(ctx, nearest);
        loxo_release(ctx, whole);
        loxo_release(ctx, part);
        loxo_geodesic_destroy(g);
        surface_destroy(&s);
        loxo_context_destroy(ctx);
    }
}

/* Stopped in any phase of any round: what is told has the bits of the whole solve, the rest is infinite and counted, and the
 * next solve knows nothing of it. */
static int check_stops(int n_threads, double limit)
{
    loxo_context *ctx = test_context_with_threads(n_threads);
    surface s = surface_make(ctx, LOXO_SHAPE_NOISY, 16000, NAN);
    const int64_t n = s.soup.n_vertices;
    loxo_geodesic_settings settings = exact_settings();
    double *whole = surface_numbers(&s), *distance = surface_numbers(&s);
    loxo_geodesic *g = NULL;
    const loxo_index source = 5;
    stopper w;
    int n_stopped = 0;
    int64_t most_reached = 0;
    CHECK_STATUS(ctx, loxo_geodesic_create(ctx, s.mesh, &settings, &g), LOXO_OK);
    CHECK_STATUS(ctx, loxo_geodesic_solve(g, &source, 1, whole, NULL), LOXO_OK);
    for (int k = 1; k < 2000; k += limit < HUGE_VAL ? 1 : k / 2 + 1) {
        loxo_geodesic_info info;
        int64_t n_reached = 0, n_listed = 0, n_inside = 0;
        CHECK_STATUS(ctx, loxo_geodesic_limit(g, limit), LOXO_OK);
        stopper_begin(&w, ctx, k);
        const loxo_status status = loxo_geodesic_solve(g, &source, 1, distance, &info);
        stopper_end(&w);
        CHECK(status == LOXO_OK || status == LOXO_STOPPED);
        CHECK_EQUAL(info.stop_reason, status == LOXO_STOPPED ? LOXO_STOP_MONITOR : LOXO_STOP_TOLERANCE);
        for (int64_t v = 0; v < n; ++v) {
            if (distance[v] < HUGE_VAL) CHECK(memcmp(&distance[v], &whole[v], sizeof *whole) == 0);
            n_reached += distance[v] < HUGE_VAL;
            n_inside += whole[v] <= limit;
        }
        CHECK_EQUAL(info.n_unreached, n - n_reached);
        CHECK_EQUAL(distance[source], 0.0);
        CHECK(status == LOXO_STOPPED ? n_reached <= n_inside : n_reached == n_inside);
        if (status == LOXO_STOPPED && n_reached > most_reached) most_reached = n_reached;
        n_stopped += status == LOXO_STOPPED;
        if (limit < HUGE_VAL) CHECK(g->engine->touched(g->state, &n_listed) == NULL || n_listed >= n_reached);
        CHECK_STATUS(ctx, loxo_geodesic_limit(g, HUGE_VAL), LOXO_OK);
        CHECK_STATUS(ctx, loxo_geodesic_solve(g, &source, 1, distance, NULL), LOXO_OK);
        CHECK(memcmp(distance, whole, (size_t)n * sizeof *whole) == 0);
        if (status == LOXO_OK && w.n_calls < k) break; /* it is not asked so often */
    }
    print_message("%d threads: %d stops, at most %lld vertices\n", n_threads, n_stopped, (long long)most_reached);
    if (n_threads == 1) CHECK(most_reached > (limit < HUGE_VAL ? 20 : n / 20));
    loxo_geodesic_destroy(g);
    loxo_release(ctx, whole);
    loxo_release(ctx, distance);
    surface_destroy(&s);
    loxo_context_destroy(ctx);
    return n_stopped;
}

TEST(stops)
{
    NEEDS_IDS(100000);
    int n_stopped = 0; /* with one thread always; of several, the one that asks may get no time */
    for (int n_threads = 1; n_threads <= 3; ++n_threads)
        n_stopped += check_stops(n_threads, HUGE_VAL) + check_stops(n_threads, 0.2);
    CHECK(n_stopped > 20);
}

/* A stop that is asked for in the last phase has nothing left to stop. */
TEST(a_stop_at_the_end)
{
    static const loxo_geodesic_method method[2] = {LOXO_GEODESIC_EXACT, LOXO_GEODESIC_FAST};
    for (int i = 0; i < 2; ++i) {
        surface s = surface_make(test_context, LOXO_SHAPE_GRID, 100, NAN);
        loxo_geodesic_settings settings = unjudged_settings(method[i]);
        double *distance = surface_numbers(&s);
        loxo_geodesic_info info;
        const loxo_index source = 5;
        stopper w;
        loxo_status status = LOXO_STOPPED;
        int n_stopped = 0;
        for (int k = 1; status == LOXO_STOPPED; ++k, ++n_stopped) {
            stopper_begin(&w, test_context, k);
            status = loxo_geodesic_distance(test_context, s.mesh, &settings, &source, 1, distance, &info);
            stopper_end(&w);
            CHECK_EQUAL(w.n_calls, k); /* also the last time */
        }
        CHECK_EQUAL(status, LOXO_OK);
        CHECK_EQUAL(info.n_unreached, 0);
        CHECK(n_stopped > 3);
        loxo_release(test_context, distance);
        surface_destroy(&s);
    }
}

/* Which thread runs out of what is left to chance, and how often memory is asked for, too: after each failure, wherever it
 * was, there is nothing left of the solve. */
TEST(memory_ends_while_threads_work)
{
    loxo_soup soup = soup_crown(1500);
    int n_failed = 0;
    for (int n_threads = 1; n_threads <= 2; ++n_threads) {
        test_allocator allocator = {.fail_at = -1};
        loxo_context_settings settings = loxo_context_settings_default();
        const loxo_geodesic_settings exact = exact_settings();
        loxo_context *ctx = NULL;
        loxo_mesh *mesh = NULL;
        const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
        double *expected = malloc((size_t)soup.n_vertices * sizeof *expected),
               *distance = malloc((size_t)soup.n_vertices * sizeof *distance);
        const loxo_index sources[2] = {1, 1500};
        settings.allocator = (loxo_allocator){test_allocator_allocate, test_allocator_release, &allocator};
        settings.n_threads = n_threads;
        CHECK_STATUS(NULL, loxo_context_create(&settings, &ctx), LOXO_OK);
        CHECK_STATUS(ctx, loxo_mesh_create(ctx, &arrays, LOXO_COPY, NULL, NULL, &mesh), LOXO_OK);
        CHECK_STATUS(ctx, loxo_geodesic_distance(ctx, mesh, &exact, sources, 2, expected, NULL), LOXO_OK);
        const size_t held_bytes = allocator.live_bytes;
        for (int k = 1; k < 40; ++k) {
            loxo_geodesic *g = NULL;
            CHECK_STATUS(ctx, loxo_geodesic_create(ctx, mesh, &exact, &g), LOXO_OK);
            allocator.fail_at = k;
            const loxo_status status = loxo_geodesic_solve(g, sources, 2, distance, NULL);
            allocator.fail_at = -1;
            CHECK(status == LOXO_OK || status == LOXO_ERR_MEMORY);
            n_failed += status != LOXO_OK;
            if (status != LOXO_OK) CHECK_STATUS(ctx, loxo_geodesic_solve(g, sources, 2, distance, NULL), LOXO_OK);
            CHECK(memcmp(distance, expected, (size_t)soup.n_vertices * sizeof *distance) == 0);
            loxo_geodesic_destroy(g);
            CHECK_EQUAL(allocator.live_bytes, held_bytes);
        }
        loxo_mesh_destroy(mesh);
        loxo_context_destroy(ctx);
        free(expected);
        free(distance);
    }
    CHECK(n_failed > 30);
    loxo_soup_destroy(test_context, &soup);
}
