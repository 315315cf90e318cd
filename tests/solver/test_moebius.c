/* SPDX-License-Identifier: MIT
 * Moebius maps: what they take to the centre, inverses, compositions, cross-ratios and distances that they keep. */
#include "base/rng.h"
#include "test.h"

#include <loxo/moebius.h>

static double random_signed(uint64_t seed, uint64_t i) { return 2.0 * loxo_random_unit(seed, i) - 1.0; }

static double distance(int d, const double *a, const double *b)
{
    double square = 0.0;
    for (int k = 0; k < d; ++k)
        square += (a[k] - b[k]) * (a[k] - b[k]);
    return sqrt(square);
}

static void set_random(int d, uint64_t seed, double gap, double *w, double *unit)
{
    double square = 0.0;
    for (int k = 0; k < d; ++k) {
        unit[k] = random_signed(seed, (uint64_t)k);
        square += unit[k] * unit[k];
    }
    for (int k = 0; k < d; ++k) {
        unit[k] /= sqrt(square);
        w[k] = (1.0 - gap) * unit[k];
    }
}

TEST(a_shift_moves_its_point_to_the_centre)
{
    for (int d = 2; d <= 9; ++d)
        for (int e = 0; e <= 12; e += 4) {
            double w[9], unit[9], image[9], minus[9], co = 0.0;
            loxo_moebius map;
            const double gap = e == 0 ? 0.5 : pow(10.0, -e);
            set_random(d, (uint64_t)(31 * d + e), gap, w, unit);
            const double co_w = gap * (2.0 - gap);
            CHECK_OK(loxo_moebius_set_identity(test_context, d, &map));
            CHECK_OK(loxo_moebius_append_shift(test_context, &map, w, co_w));
            CHECK_OK(loxo_moebius_map_ball(test_context, &map, 1, w, &co_w, image, &co));
            for (int k = 0; k < d; ++k)
                CHECK_NEAR(image[k], 0.0, 1e-15);
            CHECK_NEAR(co, 1.0, 1e-15);
            /* its direction and the opposite one stay where they are */
            CHECK_OK(loxo_moebius_map_sphere(test_context, &map, 1, unit, image));
            CHECK(distance(d, image, unit) <= 4e-16 / gap);
            for (int k = 0; k < d; ++k)
                minus[k] = -unit[k];
            CHECK_OK(loxo_moebius_map_sphere(test_context, &map, 1, minus, image));
            CHECK(distance(d, image, minus) <= 4e-16);
            CHECK_NEAR(loxo_moebius_gap(co_w), gap, 4e-16 * gap);
            CHECK_NEAR(loxo_moebius_radius(co_w), log((2.0 - gap) / gap), 1e-14 * log(2.0 / gap));
        }
}

static void make_map(int d, int n_shifts, uint64_t seed, loxo_moebius *map)
{
    CHECK_OK(loxo_moebius_set_identity(test_context, d, map));
    for (int i = 0; i < n_shifts; ++i) {
        double w[LOXO_MOEBIUS_MOST_DIMENSIONS], unit[LOXO_MOEBIUS_MOST_DIMENSIONS];
        set_random(d, seed + (uint64_t)i, 0.2 + 0.7 * loxo_random_unit(seed, 900 + (uint64_t)i), w, unit);
        CHECK_OK(loxo_moebius_append_shift(test_context, map, w, 0.0));
    }
}

/* |a - c| |b - e| / (|a - e| |b - c|) of points of the sphere is kept by every map, the distance of points of the ball too. */
TEST(cross_ratios_and_distances_stay)
{
    for (int d = 2; d <= 5; ++d) {
        loxo_moebius map;
        double x[4][5], y[4][5], z[2][5], image[2][5], co[2], unit[5];
        make_map(d, 3, (uint64_t)d, &map);
        for (uint64_t i = 0; i < 4; ++i)
            set_random(d, 100 + i, 0.0, unit, x[i]);
        double packed[20], moved[20];
        for (int i = 0; i < 4; ++i)
            memcpy(packed + (ptrdiff_t)i * d, x[i], (size_t)d * sizeof(double));
        CHECK_OK(loxo_moebius_map_sphere(test_context, &map, 4, packed, moved));
        for (int i = 0; i < 4; ++i)
            memcpy(y[i], moved + (ptrdiff_t)i * d, (size_t)d * sizeof(double));
        const double before =
            distance(d, x[0], x[2]) * distance(d, x[1], x[3]) / (distance(d, x[0], x[3]) * distance(d, x[1], x[2]));
        const double after =
            distance(d, y[0], y[2]) * distance(d, y[1], y[3]) / (distance(d, y[0], y[3]) * distance(d, y[1], y[2]));
        CHECK_NEAR(after, before, 1e-13 * before);
        for (int k = 0; k < 4; ++k)
            CHECK_NEAR(distance(d, y[k], (const double[5]){0}), 1.0, 4e-16);
        set_random(d, 7, 0.3, z[0], unit);
        set_random(d, 8, 0.6, z[1], unit);
        double own[2] = {0.3 * 1.7, 0.6 * 1.4};
        for (int i = 0; i < 2; ++i)
            CHECK_OK(loxo_moebius_map_ball(test_context, &map, 1, z[i], NULL, image[i], &co[i]));
        CHECK_NEAR(distance(d, image[0], image[1]) / sqrt(co[0] * co[1]),
                   distance(d, z[0], z[1]) / sqrt(own[0] * own[1]), 1e-13);
    }
}

TEST(inverses_and_compositions)
{
    for (int d = 2; d <= 64; d += 31) {
        loxo_moebius a, b, ab, back, identity;
        double x[LOXO_MOEBIUS_MOST_DIMENSIONS], y[LOXO_MOEBIUS_MOST_DIMENSIONS], z[LOXO_MOEBIUS_MOST_DIMENSIONS],
            w[LOXO_MOEBIUS_MOST_DIMENSIONS];
        make_map(d, 3, 50, &a);
        make_map(d, 2, 70, &b);
        CHECK_OK(loxo_moebius_compose(test_context, &a, &b, &ab));
        set_random(d, 3, 0.25, w, x);
        CHECK_OK(loxo_moebius_map_sphere(test_context, &a, 1, x, y));
        CHECK_OK(loxo_moebius_map_sphere(test_context, &b, 1, y, y));
        CHECK_OK(loxo_moebius_map_sphere(test_context, &ab, 1, x, z));
        CHECK_EQUAL(distance(d, y, z), 0.0);
        CHECK_OK(loxo_moebius_invert(test_context, &ab, &back));
        CHECK_OK(loxo_moebius_map_sphere(test_context, &back, 1, z, z));
        CHECK_NEAR(distance(d, x, z), 0.0, 1e-12);
        CHECK_OK(loxo_moebius_compose(test_context, &ab, &back, &identity));
        CHECK_OK(loxo_moebius_map_ball(test_context, &identity, 1, w, NULL, z, NULL));
        CHECK_NEAR(distance(d, w, z), 0.0, 1e-12);
        /* in place */
        const loxo_moebius keep = a;
        CHECK_OK(loxo_moebius_compose(test_context, &a, &b, &b));
        CHECK(b.n_shifts == 5 && memcmp(&b.co, &ab.co, 5 * sizeof(double)) == 0);
        CHECK_OK(loxo_moebius_compose(test_context, &a, &a, &a));
        CHECK(a.n_shifts == 6 && a.co[3] == keep.co[0] && a.co[2] == keep.co[2]);
        CHECK_OK(loxo_moebius_invert(test_context, &back, &back));
        CHECK(memcmp(&back.co, &ab.co, 5 * sizeof(double)) == 0 && back.shift[4][1] == ab.shift[4][1]);
    }
}

static uint64_t hash_of_images(loxo_context *ctx, const void *arg)
{
    enum { N = 40000 };
    double *x = loxo_allocate(ctx, (int64_t)3 * N, sizeof *x), unused[3];
    for (int64_t i = 0; i < N; ++i)
        set_random(3, (uint64_t)i, 0.0, unused, x + 3 * i);
    CHECK_OK(loxo_moebius_map_sphere(ctx, arg, N, x, x));
    const uint64_t hash = test_hash(x, 3 * N * sizeof *x);
    loxo_release(ctx, x);
    return hash;
}

TEST(the_same_for_any_threads)
{
    loxo_moebius map;
    make_map(3, 2, 4, &map);
    test_same_for_any_threads(hash_of_images, &map);
}

TEST(bad_maps_and_points)
{
    loxo_moebius map, other;
    const double out[3] = {1.0, 0.1, 0.0}, nan[3] = {(double)NAN, 0.0, 0.0}, in[3] = {0.5, 0.0, 0.0};
    double image[6];
    CHECK_STATUS(test_context, loxo_moebius_set_identity(test_context, 1, &map), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_moebius_set_identity(test_context, 65, &map), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_moebius_set_identity(test_context, 3, NULL), LOXO_ERR_ARGUMENT);
    CHECK_OK(loxo_moebius_set_identity(test_context, 3, &map));
    CHECK_OK(loxo_moebius_set_identity(test_context, 2, &other));
    CHECK_STATUS(test_context, loxo_moebius_append_shift(test_context, &map, out, 0.0), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_moebius_append_shift(test_context, &map, nan, 0.0), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_moebius_append_shift(test_context, &map, in, 0.5), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_moebius_append_shift(test_context, &map, in, (double)NAN), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_moebius_append_shift(test_context, &map, in, -0.75), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(map.n_shifts, 0);
    CHECK_STATUS(test_context, loxo_moebius_compose(test_context, &map, &other, &map), LOXO_ERR_ARGUMENT);
    for (int i = 0; i < LOXO_MOEBIUS_MOST_SHIFTS; ++i)
        CHECK_OK(loxo_moebius_append_shift(test_context, &map, in, 0.75));
    CHECK_STATUS(test_context, loxo_moebius_append_shift(test_context, &map, in, 0.75), LOXO_ERR_LIMIT);
    CHECK_STATUS(test_context, loxo_moebius_compose(test_context, &map, &map, &map), LOXO_ERR_LIMIT);
    CHECK_OK(loxo_moebius_set_identity(test_context, 3, &map));
    CHECK_STATUS(test_context, loxo_moebius_map_sphere(test_context, &map, -1, in, image), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_moebius_map_sphere(test_context, &map, 1, NULL, image), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_moebius_map_sphere(test_context, NULL, 1, in, image), LOXO_ERR_ARGUMENT);
    CHECK_OK(loxo_moebius_map_sphere(test_context, &map, 0, NULL, NULL));
    CHECK_STATUS(test_context,
                 loxo_moebius_map_ball(test_context, &map, 2, (const double[]){0, 0, 0, 0, 1, 0}, NULL, image, NULL),
                 LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
}
