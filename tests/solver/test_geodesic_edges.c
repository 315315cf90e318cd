/* SPDX-License-Identifier: MIT
 * The edges of what can be asked: sources, tiny and bad meshes, several pieces, settings out of range. Each has a
 * defined answer or a clear error. */
#include "base/options.h"
#include "surfaces.h"

#include <loxo/geodesic.h>

static loxo_geodesic_settings settings_of(int method)
{
    loxo_geodesic_settings settings = loxo_geodesic_settings_default();
    settings.method = (loxo_geodesic_method)method;
    return settings;
}

static const loxo_failure *failure(void) { return loxo_context_failure(test_context); }

TEST(sources_that_are_none)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 162, NAN);
    const loxo_index n = (loxo_index)s.soup.n_vertices, below[] = {3, -1}, above[] = {n};
    double *distance = surface_numbers(&s);
    loxo_geodesic_info info;
    loxo_geodesic *g;
    distance[0] = -7.0;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, NULL, &g));
    CHECK_STATUS(test_context, loxo_geodesic_solve(g, below, 0, distance, &info), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_geodesic_solve(g, NULL, 1, distance, &info), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_geodesic_solve(g, below, -1, distance, &info), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_geodesic_solve(g, below, 2, distance, &info), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(failure()->element, -1);
    CHECK(strstr(failure()->text, "source -1 is not in 0..161") != NULL);
    CHECK_STATUS(test_context, loxo_geodesic_solve(g, above, 1, distance, &info), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(failure()->element, n);
    CHECK_STATUS(test_context, loxo_geodesic_solve(g, below, 1, NULL, &info), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_geodesic_solve(NULL, below, 1, distance, &info), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(distance[0], -7.0);                             /* untouched */
    CHECK_OK(loxo_geodesic_solve(g, below, 1, distance, NULL)); /* and the object still works */
    CHECK_EQUAL(distance[3], 0.0);
    loxo_geodesic_destroy(g);
    loxo_geodesic_destroy(NULL);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

/* A seed keeps the number of its source as an id: only ids of 16 bits run out here. */
TEST(more_sources_than_ids)
{
    if (test_ids_fit(40000)) SKIP();
    enum { N = 40000 };
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 162, NAN);
    loxo_index *many = loxo_allocate(test_context, N, sizeof *many);
    double *distance = surface_numbers(&s);
    loxo_geodesic *g = NULL;
    for (int i = 0; i < N; ++i)
        many[i] = 7;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, NULL, &g));
    CHECK_STATUS(test_context, loxo_geodesic_solve(g, many, N, distance, NULL), LOXO_ERR_LIMIT);
    CHECK_OK(loxo_geodesic_solve(g, many, LOXO_INDEX_MAX, distance, NULL));
    loxo_geodesic_destroy(g);
    loxo_release(test_context, many);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

TEST(repeated_and_shuffled_sources_are_a_set)
{
    static const loxo_index as_set[] = {5, 100, 161}, as_given[] = {161, 5, 5, 100, 161, 5};
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 162, NAN);
    double *distance = surface_numbers(&s), *other = surface_numbers(&s);
    for (int method = 0; method < 2; ++method) {
        const loxo_geodesic_settings settings = settings_of(method);
        loxo_geodesic_info info;
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, as_set, 3, distance, NULL));
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, as_given, 6, other, &info));
        CHECK_EQUAL(info.n_sources, 3);
        CHECK(memcmp(distance, other, (size_t)s.soup.n_vertices * sizeof *distance) == 0);
    }
    loxo_release(test_context, distance);
    loxo_release(test_context, other);
    surface_destroy(&s);
}

TEST(a_thousand_sources_and_all_vertices)
{
    surface s = surface_make(test_context, LOXO_SHAPE_TORUS, 4000, NAN);
    const int64_t n = s.soup.n_vertices;
    double *distance = surface_numbers(&s);
    loxo_index *sources = loxo_allocate(test_context, n, sizeof *sources);
    for (int method = 0; method < 2; ++method) {
        const loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
        loxo_geodesic_info info;
        for (int64_t i = 0; i < 1000; ++i)
            sources[i] = (loxo_index)(i * (n / 1000));
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, sources, 1000, distance, &info));
        CHECK_EQUAL(info.n_sources, 1000);
        for (int64_t i = 0; i < 1000; ++i)
            CHECK_EQUAL(distance[sources[i]], 0.0);
        for (int64_t v = 0; v < n; ++v)
            CHECK(isfinite(distance[v]) && distance[v] < 4.0 * info.mean_edge_length);
        for (int64_t v = 0; v < n; ++v)
            sources[v] = (loxo_index)v;
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, sources, n, distance, &info));
        CHECK_EQUAL(info.n_levels, 1);
        for (int64_t v = 0; v < n; ++v)
            CHECK_EQUAL(distance[v], 0.0);
    }
    loxo_release(test_context, distance);
    loxo_release(test_context, sources);
    surface_destroy(&s);
}

/* Two tetrahedra and a vertex of neither. */
TEST(other_pieces_are_infinitely_far)
{
    static const double position[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 9, 9, 9, 5, 0, 0, 6, 0, 0, 5, 1, 0, 5, 0, 1};
    static const loxo_index triangle[] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3, 5, 7, 6, 5, 6, 8, 5, 8, 7, 6, 7, 8};
    surface s = surface_small(test_context, 9, position, 8, triangle);
    double distance[9];
    for (int method = 0; method < 2; ++method) {
        const loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
        static const loxo_index one[] = {0}, two[] = {0, 6}, loose[] = {1, 4};
        loxo_geodesic_info info;
        loxo_context_clear(test_context);
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, one, 1, distance, &info));
        for (int v = 0; v < 9; ++v)
            CHECK(v < 4 ? isfinite(distance[v]) : distance[v] == HUGE_VAL);
        CHECK_EQUAL(info.n_unreached, 5);
        CHECK_EQUAL(loxo_context_n_warnings(test_context), 1);
        CHECK_EQUAL(loxo_context_warning(test_context, 0)->count, 5);
        CHECK(strstr(loxo_context_warning(test_context, 0)->text, "5 vertices cannot be reached") != NULL);

        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, two, 2, distance, &info));
        CHECK_EQUAL(info.n_unreached, 1);
        for (int v = 0; v < 9; ++v)
            CHECK(v != 4 ? isfinite(distance[v]) : distance[v] == HUGE_VAL);
        CHECK_EQUAL(distance[0], 0.0);
        CHECK_EQUAL(distance[6], 0.0);

        distance[0] = -7.0;
        CHECK_STATUS(test_context, loxo_geodesic_distance(test_context, s.mesh, &settings, loose, 2, distance, &info),
                     LOXO_ERR_MESH);
        CHECK_EQUAL(failure()->element, 4);
        CHECK_EQUAL(distance[0], -7.0);
    }
    surface_destroy(&s);
}

/* Distances from vertex 0 are finite, 0 there, and as expected, edge- and face-based, where something is. */
static void check_small(const char *name, int64_t n_vertices, const double *position, int64_t n_faces,
                        const loxo_index *triangle, const double *edge, const double *face, double tolerance)
{
    surface s = surface_small(test_context, n_vertices, position, n_faces, triangle);
    double *distance = surface_numbers(&s);
    for (int method = 0; method < 2; ++method) {
        const double *expected = method == 0 ? edge : face;
        loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
        loxo_status status;
        if (method == 1) settings.n_iterations = 500;
        status = loxo_geodesic_distance(test_context, s.mesh, &settings, (const loxo_index[]){0}, 1, distance, NULL);
        if (expected != NULL) CHECK_STATUS(test_context, status, LOXO_OK);
        if (status != LOXO_OK) CHECK_STATUS(test_context, status, LOXO_NOT_CONVERGED); /* said, not hidden */
        for (int64_t v = 0; v < n_vertices; ++v) {
            print_message("%s, %s, %s: vertex %lld at %.4f\n", name, method_names[method], loxo_status_name(status),
                          (long long)v, distance[v]);
            CHECK(isfinite(distance[v]));
            if (expected != NULL) CHECK_NEAR(distance[v], expected[v], tolerance);
        }
        CHECK_EQUAL(distance[0], 0.0);
    }
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

TEST(single_triangle)
{
    static const double position[] = {0, 0, 0, 1, 0, 0, 0.5, 0.8660254037844386, 0}, sides[] = {0, 1, 1};
    check_small("triangle", 3, position, 1, (const loxo_index[]){0, 1, 2}, sides, sides, 1e-12);
}

TEST(two_triangles)
{
    static const double position[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
    static const double truth[] = {0, 1, 1, 1.41421356237309505};
    static const double face[] = {0, 1, 1, 1.7071}; /* in the second face the heat has one direction, the diagonal */
    const loxo_index triangle[] = {0, 1, 2, 2, 1, 3};
    check_small("square", 4, position, 2, triangle, truth, NULL, 1e-12);
    check_small("square", 4, position, 2, triangle, NULL, face, 1e-3);
}

TEST(faces_without_area_among_good_ones)
{
    /* A square whose side 0-2 has a vertex 4 on it, joined by a face on a line. */
    static const double position[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0.5, 0};
    static const loxo_index triangle[] = {0, 1, 2, 2, 1, 3, 0, 2, 4};
    static const double edge[] = {0, 1, 1, 1.4142, 0.5}, face[] = {0, 1, 1, 1.7071, 0.5}; /* as if it were not there */
    check_small("flat face", 5, position, 3, triangle, edge, face, 1e-3);
    /* Two of them, so that one has only the other as a neighbour. */
    static const double more[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0.5, 0, 0, 0.25, 0};
    static const double at[] = {0, 1, 1, 1.4142, 0.5, 0.25}, faces[] = {0, 1, 1, 1.7071, 0.5, 0.25};
    check_small("flat faces", 6, more, 4, (const loxo_index[]){0, 1, 2, 2, 1, 3, 0, 2, 4, 0, 4, 5}, at, faces, 1e-3);
    /* Two vertices at one place. */
    static const double twice[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 1, 0};
    check_small("double vertex", 5, twice, 3, (const loxo_index[]){0, 1, 2, 4, 2, 1, 4, 1, 3}, NULL, NULL, 0.0);
    /* A source of flat faces alone. */
    static const double line[] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 1, 1, 0};
    check_small("flat source", 4, line, 2, (const loxo_index[]){0, 1, 2, 2, 1, 3}, NULL, NULL, 0.0);
}

TEST(degenerate_face_and_a_good_one)
{
    static const double position[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    check_small("degenerate", 3, position, 2, (const loxo_index[]){0, 1, 2, 1, 1, 2}, NULL, NULL, 0.0);
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 1);
}

TEST(slivers)
{
    static const double heights[] = {1e-3, 1e-6, 1e-9, 1e-12};
    for (int i = 0; i < 4; ++i) {
        const double position[] = {0, 0, 0, 1, heights[i], 0, 2, 0, 0, 1, -heights[i], 0, 1, 1, 0, 1, -1, 0};
        static const loxo_index triangle[] = {0, 3, 1, 1, 3, 2, 0, 1, 4, 1, 2, 4, 3, 0, 5, 2, 3, 5};
        check_small("sliver", 6, position, 6, triangle, NULL, NULL, 0.0);
    }
}

TEST(meshes_without_anything_to_walk_on)
{
    static const double same[] = {1, 2, 3, 1, 2, 3, 1, 2, 3}, tiny[] = {0, 0, 0, 1e-200, 0, 0, 0, 1e-200, 0},
                        huge[] = {0, 0, 0, 1e200, 0, 0, 0, 1e200, 0};
    static const double *const positions[] = {same, tiny, huge};
    loxo_geodesic *g;
    for (int i = 0; i < 3; ++i) {
        surface s = surface_small(test_context, 3, positions[i], 1, (const loxo_index[]){0, 1, 2});
        CHECK_STATUS(test_context, loxo_geodesic_create(test_context, s.mesh, NULL, &g), LOXO_ERR_MESH);
        CHECK(g == NULL);
        surface_destroy(&s);
    }
    surface s = surface_small(test_context, 3, same, 0, (const loxo_index[]){0});
    CHECK_STATUS(test_context, loxo_geodesic_create(test_context, s.mesh, NULL, &g), LOXO_ERR_MESH);
    CHECK(strstr(failure()->text, "no faces") != NULL);
    CHECK_STATUS(test_context, loxo_geodesic_create(test_context, NULL, NULL, &g), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_geodesic_create(test_context, s.mesh, NULL, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(NULL, loxo_geodesic_create(NULL, s.mesh, NULL, &g), LOXO_ERR_ARGUMENT);
    surface_destroy(&s);
}

static void check_refused(const surface *s, const loxo_geodesic_settings *settings, const char *name)
{
    loxo_geodesic *g;
    loxo_context_clear(test_context);
    CHECK_STATUS(test_context, loxo_geodesic_create(test_context, s->mesh, settings, &g), LOXO_ERR_ARGUMENT);
    CHECK(g == NULL);
    if (strstr(failure()->text, name) == NULL) print_error("%s is not named: %s\n", name, failure()->text);
    CHECK(strstr(failure()->text, name) != NULL);
    CHECK_STATUS(test_context, loxo_geodesic_estimate(test_context, 100, 200, settings, NULL, NULL), LOXO_ERR_ARGUMENT);
}

#define CHECK_REFUSED(field, value, name)                                                                              \
    do {                                                                                                               \
        loxo_geodesic_settings settings = loxo_geodesic_settings_default();                                            \
        settings.field = (value);                                                                                      \
        check_refused(&s, &settings, name);                                                                            \
    } while (0)

TEST(settings_out_of_range_are_named)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 42, NAN);
    CHECK_REFUSED(method, LOXO_GEODESIC_N_METHODS, "method");
    CHECK_REFUSED(diffusion, (loxo_geodesic_diffusion)7, "diffusion");
    CHECK_REFUSED(time_factor, 0.0, "time-factor");
    CHECK_REFUSED(time_factor, -1.0, "time-factor");
    CHECK_REFUSED(time_factor, nan(""), "time-factor");
    CHECK_REFUSED(time_factor, HUGE_VAL, "time-factor");
    CHECK_REFUSED(diffusion_tolerance, 0.0, "diffusion-tolerance");
    CHECK_REFUSED(diffusion_tolerance, 2.0, "diffusion-tolerance");
    CHECK_REFUSED(n_sweeps, 0, "sweeps");
    CHECK_REFUSED(penalty, 0.0, "penalty");
    CHECK_REFUSED(n_iterations, -1, "iterations");
    CHECK_REFUSED(primal_tolerance, -1e-9, "primal-tolerance");
    CHECK_REFUSED(dual_tolerance, nan(""), "dual-tolerance");
    CHECK_REFUSED(check_gradient_share, 1.5, "check-gradient-share");
    CHECK_REFUSED(check_breach, -1.0, "check-breach");
    CHECK_REFUSED(check_estimate, -1.0, "check-estimate");
    surface_destroy(&s);
}

TEST(an_answer_that_breaks_its_check_is_not_silent)
{
    surface s = surface_make(test_context, LOXO_SHAPE_NOISY, 642, NAN);
    double *distance = surface_numbers(&s);
    for (int method = 0; method < 2; ++method) {
        loxo_geodesic_settings settings = settings_of(method);
        loxo_geodesic_info info;
        settings.check_gradient_share = 0.0;
        distance[9] = -7.0;
        CHECK_STATUS(
            test_context,
            loxo_geodesic_distance(test_context, s.mesh, &settings, (const loxo_index[]){3}, 1, distance, &info),
            LOXO_CHECK_FAILED);
        CHECK(!info.check_passed);
        CHECK(info.gradient_share > 0.0);
        CHECK(distance[9] > 0.0); /* it is given all the same */
        CHECK(strstr(failure()->text, "check") != NULL);
    }
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

/* Each of the two thresholds by itself, right below and right above what was found. */
TEST(each_threshold_of_the_check_is_looked_at)
{
    surface s = surface_make(test_context, LOXO_SHAPE_NOISY, 642, NAN);
    double *distance = surface_numbers(&s);
    for (int method = 0; method < 2; ++method) {
        const loxo_index source = 3;
        loxo_geodesic_settings settings = admm_settings((loxo_geodesic_method)method);
        loxo_geodesic_info found, info;
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, &source, 1, distance, &found));
        CHECK(found.gradient_share > 0.0 && found.gradient_share < 1.0 && found.breach_percentile_99 > 0.0);
        for (int i = 0; i < 4; ++i) {
            const double factor = i % 2 == 0 ? 0.999 : 1.001;
            settings = admm_settings((loxo_geodesic_method)method);
            if (i < 2)
                settings.check_gradient_share = factor * found.gradient_share;
            else
                settings.check_breach = factor * found.breach_percentile_99;
            CHECK_STATUS(test_context,
                         loxo_geodesic_distance(test_context, s.mesh, &settings, &source, 1, distance, &info),
                         i % 2 == 0 ? LOXO_CHECK_FAILED : LOXO_OK);
            CHECK_EQUAL(info.check_passed, i % 2 == 1);
            CHECK_EQUAL(info.gradient_share, found.gradient_share);
            CHECK_EQUAL(info.breach_percentile_99, found.breach_percentile_99);
        }
    }
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

/* What is meant to be solved as it comes passes as it comes. */
TEST(generated_shapes_pass_their_check_by_default)
{
    static const loxo_shape shapes[] = {LOXO_SHAPE_ICOSPHERE, LOXO_SHAPE_ELLIPSOID, LOXO_SHAPE_TORUS, LOXO_SHAPE_GENUS,
                                        LOXO_SHAPE_BUMPY,     LOXO_SHAPE_NOISY,     LOXO_SHAPE_DISK,  LOXO_SHAPE_BRAIN};
    NEEDS_IDS(6 * 5000);
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; ++i) {
        surface s = surface_make(test_context, shapes[i], 5000, NAN);
        double *distance = surface_numbers(&s);
        for (int method = 0; method < 2; ++method) {
            const loxo_geodesic_settings settings = settings_of(method);
            for (loxo_index source = 0; source < 4000; source += 1777) {
                const loxo_status status =
                    loxo_geodesic_distance(test_context, s.mesh, &settings, &source, 1, distance, NULL);
                if (status != LOXO_OK)
                    print_error("%s, %s, from %d:\n", loxo_shape_name(shapes[i]), method_names[method], (int)source);
                CHECK_OK(status);
            }
        }
        loxo_release(test_context, distance);
        surface_destroy(&s);
    }
}

TEST(no_iterations_give_the_directions_as_they_are)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 642, NAN);
    double *distance = surface_numbers(&s);
    for (int method = 0; method < 2; ++method) {
        loxo_geodesic_settings settings = admm_settings((loxo_geodesic_method)method);
        loxo_geodesic_info info;
        settings.n_iterations = 0;
        CHECK_OK(loxo_geodesic_distance(test_context, s.mesh, &settings, (const loxo_index[]){3}, 1, distance, &info));
        CHECK_EQUAL(info.n_iterations, 0);
        CHECK_NEAR(info.distance_max, 3.14159, 0.2);
    }
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

/* The constant, the choice of the command line and the one line of help come from one list. */
TEST(methods_have_names)
{
    CHECK_TEXT(loxo_geodesic_method_name(LOXO_GEODESIC_EDGE), "edge");
    CHECK_TEXT(loxo_geodesic_method_name(LOXO_GEODESIC_FACE), "face");
    for (int method = 0; method < LOXO_GEODESIC_N_METHODS; ++method) {
        loxo_geodesic_settings settings = loxo_geodesic_settings_default();
        size_t bytes = 0;
        double seconds = 0.0;
        CHECK_OK(loxo_options_set(test_context, "geodesic", loxo_geodesic_options, &settings, "method",
                                  loxo_geodesic_method_name((loxo_geodesic_method)method)));
        CHECK_EQUAL(settings.method, method);
        CHECK(strlen(loxo_geodesic_method_help(settings.method)) > 10);
        CHECK_OK(loxo_geodesic_estimate(test_context, 1000, 2000, &settings, &bytes, &seconds));
        CHECK(bytes >= 8 * 1000 && seconds > 0.0);
    }
    CHECK_TEXT(loxo_geodesic_method_name(LOXO_GEODESIC_N_METHODS), "unknown");
    CHECK_TEXT(loxo_geodesic_method_help((loxo_geodesic_method)-1), "unknown");
}
