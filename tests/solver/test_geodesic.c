/* SPDX-License-Identifier: MIT
 * Distances where the truth is known. The errors are recorded as numbers: one that changes by more than a twentieth,
 * either way, is worth knowing of. */
#include "surfaces.h"

#include <loxo/geodesic.h>
#include <loxo/measure.h>

#define RECORDED_WITHIN 0.05
#define ROUNDED         1e-5 /* what is recorded has five digits */

/* The heat methods: edge, edge with ADMM, face. */
#define N_WAYS 3
static const char *const way_names[N_WAYS] = {"edge", "edge, ADMM", "face"};

static loxo_geodesic_settings settings_of_way(int way)
{
    loxo_geodesic_settings settings = loxo_geodesic_settings_default();
    settings.method = way < 2 ? LOXO_GEODESIC_EDGE : LOXO_GEODESIC_FACE;
    if (way == 1) settings.recovery = LOXO_RECOVERY_ADMM;
    return settings;
}

/* Eq. (29) where the truth is known; it is negative elsewhere. */
static loxo_distance_error error_of(const surface *s, const double *distance, const double *truth)
{
    double *d = surface_numbers(s), *t = surface_numbers(s);
    loxo_distance_error error;
    int64_t n = 0;
    for (int64_t v = 0; v < s->soup.n_vertices; ++v)
        if (truth[v] >= 0.0) d[n] = distance[v], t[n] = truth[v], ++n;
    CHECK_OK(loxo_measure_distance_error(test_context, d, t, n, &error));
    CHECK_EQUAL(error.n_compared, n);
    loxo_release(test_context, d);
    loxo_release(test_context, t);
    return error;
}

/* With settings as they come. */
static void check_recorded(const char *name, const surface *s, const double *truth, loxo_index source,
                           const double recorded[N_WAYS])
{
    double *distance = surface_numbers(s);
    for (int way = 0; way < N_WAYS; ++way) {
        const loxo_geodesic_settings settings = settings_of_way(way);
        loxo_geodesic_info info;
        CHECK_OK(loxo_geodesic_distance(test_context, s->mesh, &settings, &source, 1, distance, &info));
        const loxo_distance_error error = error_of(s, distance, truth);
        print_message("%s, %s: mean relative error %.5f, max %.4f; gradient share %.3f, breach %.3f\n", name,
                      way_names[way], error.mean_relative, error.max_relative, info.gradient_share,
                      info.breach_percentile_99);
        if (getenv("REC") == NULL)
            CHECK_NEAR(error.mean_relative, recorded[way], RECORDED_WITHIN * recorded[way] + ROUNDED);
        CHECK_EQUAL(distance[source], 0.0);
        CHECK(info.check_passed);
        CHECK_EQUAL(info.n_unreached, 0);
        CHECK_EQUAL(info.n_sources, 1);
    }
    loxo_release(test_context, distance);
}

static void check_shape(loxo_shape shape, int64_t n_vertices, loxo_index source, double edge, double admm, double face)
{
    NEEDS_IDS(6 * n_vertices);
    surface s = surface_make(test_context, shape, n_vertices, NAN);
    double *truth = surface_numbers(&s);
    surface_exact(&s, shape, source, truth);
    check_recorded(loxo_shape_name(shape), &s, truth, source, (const double[]){edge, admm, face});
    loxo_release(test_context, truth);
    surface_destroy(&s);
}

TEST(sphere) { check_shape(LOXO_SHAPE_ICOSPHERE, 10242, 0, 0.00149, 0.00384, 0.00494); }

TEST(sphere_of_meridians) { check_shape(LOXO_SHAPE_LATLONG, 5000, 1500, 0.00272, 0.02442, 0.01972); }

TEST(disk_from_its_centre) { check_shape(LOXO_SHAPE_DISK, 5000, 0, 0.00000, 0.00156, 0.00183); }

TEST(disk_from_near_its_rim) { check_shape(LOXO_SHAPE_DISK, 5000, 4500, 0.00000, 0.00875, 0.00945); }

TEST(square) { check_shape(LOXO_SHAPE_GRID, 5000, 0, 0.00000, 0.00767, 0.00879); }

TEST(cylinder) { check_shape(LOXO_SHAPE_CYLINDER, 5000, 2500, 0.00008, 0.01557, 0.01230); }

TEST(annulus) { check_shape(LOXO_SHAPE_ANNULUS, 5000, 4000, 0.00105, 0.02003, 0.01725); }

/* Around the tube runs a geodesic; its vertices stand for all. */
TEST(torus)
{
    NEEDS_IDS(6 * 5000);
    surface s = surface_make(test_context, LOXO_SHAPE_TORUS, 5000, NAN);
    double *truth = surface_numbers(&s);
    loxo_index source = 0;
    int64_t n_known = 0;
    for (int64_t v = 0; v < s.soup.n_vertices; ++v)
        if (s.soup.position[3 * v] > s.soup.position[3 * (int64_t)source]) source = (loxo_index)v;
    CHECK_NEAR(s.soup.position[3 * (int64_t)source + 1], 0.0, 1e-12);
    for (int64_t v = 0; v < s.soup.n_vertices; ++v) {
        const double *x = s.soup.position + 3 * v;
        const bool is_known = fabs(x[1]) < 1e-12 && x[0] > 0.0;
        truth[v] = is_known ? 0.4 * fabs(atan2(x[2], x[0] - 1.0)) : -1.0;
        n_known += is_known ? 1 : 0;
    }
    CHECK(n_known > 20);
    check_recorded("torus", &s, truth, source, (const double[]){0.00082, 0.04337, 0.00823});
    loxo_release(test_context, truth);
    surface_destroy(&s);
}

/* Of the two sources the nearer one counts. */
TEST(two_sources_of_a_sphere)
{
    NEEDS_IDS(6 * 10242);
    static const double recorded[N_WAYS] = {0.00073, 0.00370, 0.00465};
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 10242, NAN);
    const loxo_index sources[] = {0, (loxo_index)(s.soup.n_vertices - 100)};
    double *truth = surface_numbers(&s), *second = surface_numbers(&s), *distance = surface_numbers(&s);
    surface_exact(&s, LOXO_SHAPE_ICOSPHERE, sources[0], truth);
    surface_exact(&s, LOXO_SHAPE_ICOSPHERE, sources[1], second);
    for (int64_t v = 0; v < s.soup.n_vertices; ++v)
        truth[v] = fmin(truth[v], second[v]);
    for (int way = 0; way < N_WAYS; ++way) {
        const loxo_geodesic_settings settings = settings_of_way(way);
        loxo_distance_error error;
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, sources, 2, distance, NULL));
        CHECK_OK(loxo_measure_distance_error(test_context, distance, truth, s.soup.n_vertices, &error));
        print_message("two sources, %s: mean relative error %.5f, max %.4f\n", way_names[way], error.mean_relative,
                      error.max_relative);
        if (getenv("REC") == NULL)
            CHECK_NEAR(error.mean_relative, recorded[way], RECORDED_WITHIN * recorded[way] + ROUNDED);
        CHECK_EQUAL(distance[sources[0]], 0.0);
        CHECK_EQUAL(distance[sources[1]], 0.0);
    }
    loxo_release(test_context, truth);
    loxo_release(test_context, second);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

/* The finer the mesh, the nearer the truth, once ADMM is given its time: the more faces, the more iterations. */
TEST(error_falls_with_the_mesh)
{
    NEEDS_IDS(6 * 10242);
    double before[N_WAYS] = {1.0, 1.0, 1.0};
    for (int64_t n = 162; n < 20000; n *= 4) {
        surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, n, NAN);
        double *truth = surface_numbers(&s), *distance = surface_numbers(&s);
        surface_exact(&s, LOXO_SHAPE_ICOSPHERE, 0, truth);
        for (int way = 0; way < N_WAYS; ++way) {
            loxo_geodesic_settings settings = settings_of_way(way);
            loxo_distance_error error;
            if (way > 0 && n > 5000) continue; /* ADMM would need more iterations */
            if (way == 0) settings.recovery = LOXO_RECOVERY_UNFOLD;
            settings.penalty = 10.0;
            settings.n_iterations = 1000;
            CHECK_OK(
                loxo_geodesic_distance(test_context, s.mesh, &settings, (const loxo_index[]){0}, 1, distance, NULL));
            CHECK_OK(loxo_measure_distance_error(test_context, distance, truth, s.soup.n_vertices, &error));
            print_message("%lld vertices, %s: %.5f\n", (long long)s.soup.n_vertices, way_names[way],
                          error.mean_relative);
            CHECK(error.mean_relative < (way == 0 ? 0.6 : 1.0) * before[way]);
            before[way] = error.mean_relative;
        }
        loxo_release(test_context, truth);
        loxo_release(test_context, distance);
        surface_destroy(&s);
    }
}
