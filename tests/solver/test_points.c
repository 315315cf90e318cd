/* SPDX-License-Identifier: MIT
 * Sources inside faces and edges, and which source is nearest: on flat and round surfaces, where both are known. */
#include "solver/geodesic/geodesic_internal.h"
#include "surfaces.h"

#include <loxo/geodesic.h>

/* Of a face of the soup. */
static loxo_surface_point point_in(const surface *s, int64_t face, double a, double b, double c)
{
    loxo_surface_point p = {.weight = {a, b, c}};
    for (int k = 0; k < 3; ++k)
        p.vertex[k] = s->soup.triangle[3 * face + k];
    return p;
}

static void place_of(const surface *s, const loxo_surface_point *p, double x[3])
{
    for (int j = 0; j < 3; ++j) {
        x[j] = 0.0;
        for (int k = 0; k < 3; ++k)
            if (p->vertex[k] >= 0) x[j] += p->weight[k] * s->soup.position[3 * p->vertex[k] + j];
    }
}

static double straight(const surface *s, const double x[3], int64_t v)
{
    const double *y = &s->soup.position[3 * v];
    return sqrt((x[0] - y[0]) * (x[0] - y[0]) + (x[1] - y[1]) * (x[1] - y[1]) + (x[2] - y[2]) * (x[2] - y[2]));
}

/* Between directions from the origin. */
static double around_sphere(const surface *s, const double x[3], int64_t v)
{
    const double *y = &s->soup.position[3 * v], norm = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    const double cosine = (x[0] * y[0] + x[1] * y[1] + x[2] * y[2]) / norm;
    return acos(cosine > 1.0 ? 1.0 : cosine < -1.0 ? -1.0 : cosine);
}

static const double inside[5][3] = {
    {1.0, 0.0, 0.0}, {0.5, 0.5, 0.0}, {1.0 / 3.0, 1.0 / 3.0, 1.0 - 2.0 / 3.0}, {0.6, 0.3, 0.1}, {0.9, 0.05, 0.05}};

typedef double (*truth_fn)(const surface *s, const double x[3], int64_t v);

/* A source inside a face is met no worse than one at a vertex (measured: better; the ring of a vertex adds 0.27 mean edge
 * lengths to nothing, a face a third of that), and wherever in the face it is. bound: of the mean relative error beyond
 * five edge lengths; 1.3 times what is measured. */
static void check_points(loxo_shape shape, int64_t n_vertices, truth_fn truth, const double bound[2])
{
    NEEDS_IDS(6 * n_vertices);
    surface s = surface_make(test_context, shape, n_vertices, NAN);
    double *distance = surface_numbers(&s);
    for (int method = 0; method < 2; ++method) {
        loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
        loxo_geodesic *g = NULL;
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        for (int k = 0; k < 5; ++k) {
            double sum = 0.0, n = 0.0;
            for (int64_t i = 0; i < 4; ++i) {
                const loxo_surface_point p = point_in(&s, (s.soup.n_faces / 2 + 1237 * i) % s.soup.n_faces,
                                                      inside[k][0], inside[k][1], inside[k][2]);
                loxo_geodesic_info info;
                double x[3];
                place_of(&s, &p, x);
                CHECK_OK(loxo_geodesic_solve_points(g, &p, 1, distance, &info));
                CHECK_EQUAL(info.n_sources, 1);
                for (int64_t v = 0; v < s.soup.n_vertices; ++v) {
                    const double t = truth(&s, x, v);
                    if (t < 5.0 * info.mean_edge_length) continue;
                    sum += fabs(distance[v] - t) / t;
                    n += 1.0;
                }
            }
            print_message("%s, first weight %.3f: mean error %.4f %%\n", method_names[method], inside[k][0],
                          100.0 * sum / n);
            CHECK(sum / n < bound[k == 0 ? 0 : 1]);
        }
        loxo_geodesic_destroy(g);
    }
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

TEST(points_of_a_disk) { check_points(LOXO_SHAPE_DISK, 5000, straight, (const double[]){0.015, 0.0105}); }

TEST(points_of_a_sphere) { check_points(LOXO_SHAPE_ICOSPHERE, 5000, around_sphere, (const double[]){0.014, 0.0085}); }

/* Corners of the source's face start at their straight distances. */
TEST(corners_start_where_they_are)
{
    surface s = surface_make(test_context, LOXO_SHAPE_NOISY, 1000, 0.2);
    double *distance = surface_numbers(&s);
    for (int method = 0; method < 2; ++method) {
        loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
        const loxo_surface_point p = point_in(&s, 400, 0.2, 0.3, 0.5), q = point_in(&s, 400, 0.0, 0.25, 0.75);
        loxo_geodesic *g = NULL;
        double x[3];
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        place_of(&s, &p, x);
        CHECK_OK(loxo_geodesic_solve_points(g, &p, 1, distance, NULL));
        for (int k = 0; k < 3; ++k) /* a few roundings of lengths near 0.1 */
            CHECK_NEAR(distance[p.vertex[k]], straight(&s, x, p.vertex[k]), 1e-15);
        place_of(&s, &q, x);
        CHECK_OK(loxo_geodesic_solve_points(g, &q, 1, distance, NULL));
        for (int k = 1; k < 3; ++k)
            CHECK_NEAR(distance[q.vertex[k]], straight(&s, x, q.vertex[k]), 1e-15);
        loxo_geodesic_destroy(g);
    }
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

/* One point has many names: corners in any order, from either face of an edge, with unused or weightless corners. */
TEST(names_of_a_point_give_the_same_bits)
{
    surface s = surface_make(test_context, LOXO_SHAPE_TORUS, 2000, NAN);
    double *one = surface_numbers(&s), *other = surface_numbers(&s);
    const size_t n_bytes = (size_t)s.soup.n_vertices * sizeof(double);
    const loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    const loxo_surface_point p = point_in(&s, 77, 0.25, 0.5, 0.25);
    const loxo_index a = p.vertex[0], b = p.vertex[1], c = p.vertex[2];
    const loxo_surface_point turned = {{c, b, a}, {0.25, 0.5, 0.25}}, edge = {{a, b, -1}, {0.25, 0.75, NAN}},
                             back = {{b, -1, a}, {0.75, 9.0, 0.25}}, weightless = {{c, b, a}, {0.0, 0.75, 0.25}},
                             twice = {{a, b, b}, {0.25, 0.25, 0.5}}, vertex = {{-1, -1, b}, {0.0, 0.0, 1.0}},
                             nearly = {{c, -1, b}, {0.0, 0.0, 1.0 - 1e-7}};
    loxo_geodesic *g = NULL;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_solve_points(g, &p, 1, one, NULL));
    CHECK_OK(loxo_geodesic_solve_points(g, &turned, 1, other, NULL));
    CHECK(memcmp(one, other, n_bytes) == 0);
    CHECK_OK(loxo_geodesic_solve_points(g, &edge, 1, one, NULL));
    CHECK_OK(loxo_geodesic_solve_points(g, &back, 1, other, NULL));
    CHECK(memcmp(one, other, n_bytes) == 0);
    CHECK_OK(loxo_geodesic_solve_points(g, &weightless, 1, other, NULL));
    CHECK(memcmp(one, other, n_bytes) == 0);
    CHECK_OK(loxo_geodesic_solve_points(g, &twice, 1, other, NULL));
    CHECK(memcmp(one, other, n_bytes) == 0);
    CHECK_OK(loxo_geodesic_solve(g, &b, 1, one, NULL));
    CHECK_OK(loxo_geodesic_solve_points(g, &vertex, 1, other, NULL));
    CHECK(memcmp(one, other, n_bytes) == 0);
    CHECK_OK(loxo_geodesic_solve_points(g, &nearly, 1, other, NULL));
    CHECK(memcmp(one, other, n_bytes) == 0);
    const loxo_surface_point both[3] = {p, vertex, p};
    loxo_geodesic_info info;
    CHECK_OK(loxo_geodesic_solve_points(g, both, 3, other, &info));
    CHECK_EQUAL(info.n_sources, 2);
    CHECK_EQUAL(other[b], 0.0);
    loxo_geodesic_destroy(g);
    loxo_release(test_context, one);
    loxo_release(test_context, other);
    surface_destroy(&s);
}

static void check_refused(loxo_geodesic *g, loxo_surface_point p, loxo_status expected)
{
    double distance[8] = {42.0};
    const loxo_surface_point good = {{0, -1, -1}, {1.0, 0.0, 0.0}}, points[2] = {good, p};
    CHECK_STATUS(test_context, loxo_geodesic_solve_points(g, points, 2, distance, NULL), expected);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    CHECK_EQUAL(distance[0], 42.0);
}

TEST(points_that_are_none)
{
    /* two faces 0 1 2 and 1 3 2; 4 belongs to no face */
    static const double position[15] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 5.0, 5.0, 0.0};
    static const loxo_index triangle[6] = {0, 1, 2, 1, 3, 2};
    surface s = surface_small(test_context, 5, position, 2, triangle);
    loxo_geodesic *g = NULL;
    double distance[5];
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, NULL, &g));
    check_refused(g, (loxo_surface_point){{0, 1, 3}, {0.3, 0.3, 0.4}}, LOXO_ERR_ARGUMENT);
    check_refused(g, (loxo_surface_point){{0, 3, -1}, {0.5, 0.5, 0.0}}, LOXO_ERR_ARGUMENT);
    check_refused(g, (loxo_surface_point){{0, 1, 2}, {0.5, 0.6, -0.1}}, LOXO_ERR_ARGUMENT);
    check_refused(g, (loxo_surface_point){{0, 1, 2}, {0.5, 0.5, NAN}}, LOXO_ERR_ARGUMENT);
    check_refused(g, (loxo_surface_point){{0, 1, 2}, {0.5, 0.5, 1e-5}}, LOXO_ERR_ARGUMENT);
    check_refused(g, (loxo_surface_point){{-1, -1, -1}, {0.5, 0.5, 0.0}}, LOXO_ERR_ARGUMENT);
    check_refused(g, (loxo_surface_point){{0, 1, 5}, {0.5, 0.5, 0.0}}, LOXO_ERR_ARGUMENT);
    check_refused(g, (loxo_surface_point){{0, 1, -2}, {0.5, 0.5, 0.0}}, LOXO_ERR_ARGUMENT);
    check_refused(g, (loxo_surface_point){{4, -1, -1}, {1.0, 0.0, 0.0}}, LOXO_ERR_MESH);
    CHECK_STATUS(test_context, loxo_geodesic_solve_points(g, NULL, 1, distance, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context,
                 loxo_geodesic_solve_points(g, &(loxo_surface_point){{0, -1, -1}, {1.0, 0.0, 0.0}}, 0, distance, NULL),
                 LOXO_ERR_ARGUMENT);
    CHECK_STATUS(NULL, loxo_geodesic_solve_points(NULL, NULL, 1, distance, NULL), LOXO_ERR_ARGUMENT);
    loxo_geodesic_destroy(g);
    surface_destroy(&s);
}

/* Three faces at one edge: the repair cuts the surface there, and a point of that edge belongs to every piece. */
TEST(point_of_an_edge_that_was_cut)
{
    static const double position[15] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 1.0, 0.0, 0.5, -1.0, 0.0, 0.5, 0.0, 1.0};
    static const loxo_index triangle[9] = {0, 1, 2, 1, 0, 3, 0, 1, 4};
    loxo_mesh_arrays arrays = {.n_vertices = 5, .n_faces = 3, .position = position, .triangle = triangle};
    loxo_mesh_settings mesh_settings = loxo_mesh_settings_default();
    loxo_mesh *mesh = NULL;
    double distance[5];
    loxo_index nearest[5];
    mesh_settings.repair = true;
    CHECK_STATUS(test_context, loxo_mesh_create(test_context, &arrays, LOXO_COPY, &mesh_settings, NULL, &mesh),
                 LOXO_REPAIRED);
    loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    loxo_geodesic *g = NULL;
    loxo_geodesic_info info;
    const loxo_surface_point p = {{0, 1, -1}, {0.5, 0.5, 0.0}};
    settings.nearest = true;
    CHECK_OK(loxo_geodesic_create(test_context, mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_solve_points(g, &p, 1, distance, &info));
    CHECK(info.n_sources >= 2);
    CHECK_OK(loxo_geodesic_nearest(g, nearest));
    for (int v = 0; v < 5; ++v) {
        CHECK(isfinite(distance[v]));
        CHECK_EQUAL(nearest[v], 0);
    }
    CHECK_NEAR(distance[0], 0.5, 1e-15);
    CHECK_NEAR(distance[1], 0.5, 1e-15);
    loxo_geodesic_destroy(g);
    loxo_mesh_destroy(mesh);
}

static loxo_status solve_points_and_label(loxo_context *ctx, void *arg)
{
    const loxo_surface_point p[2] = {{{0, 1, 2}, {0.2, 0.3, 0.5}}, {{1, 3, -1}, {0.5, 0.5, 0.0}}};
    loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    loxo_mesh_arrays *arrays = arg;
    loxo_mesh *mesh = NULL;
    loxo_geodesic *g = NULL;
    double distance[4];
    loxo_index nearest[4];
    settings.nearest = true;
    loxo_status status = loxo_mesh_create(ctx, arrays, LOXO_BORROW, NULL, NULL, &mesh);
    if (status >= 0) status = loxo_geodesic_create(ctx, mesh, &settings, &g);
    if (status >= 0) status = loxo_geodesic_solve_points(g, p, 2, distance, NULL);
    if (status >= 0) status = loxo_geodesic_nearest(g, nearest);
    loxo_geodesic_destroy(g);
    loxo_mesh_destroy(mesh);
    return status;
}

TEST(each_allocation_of_points_fails)
{
    static const double position[12] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0};
    static const loxo_index triangle[6] = {0, 1, 2, 1, 3, 2};
    loxo_mesh_arrays arrays = {.n_vertices = 4, .n_faces = 2, .position = position, .triangle = triangle};
    CHECK(test_each_allocation_fails(solve_points_and_label, &arrays) > 10);
}

/* ---- nearest sources ---- */

#define N_SOURCES 12

static void spread_sources(const surface *s, loxo_index source[N_SOURCES])
{
    for (int64_t i = 0; i < N_SOURCES; ++i)
        source[i] = (loxo_index)((7919 * (i + 3)) % s->soup.n_vertices);
}

/* The two least of the straight distances to the sources, and whose the least is. */
static int two_nearest(const surface *s, const loxo_index *source, int64_t v, double distance[2])
{
    int best = -1;
    distance[0] = distance[1] = HUGE_VAL;
    for (int i = 0; i < N_SOURCES; ++i) {
        const double d = straight(s, &s->soup.position[3 * source[i]], v);
        if (d < distance[0]) {
            distance[1] = distance[0];
            distance[0] = d;
            best = i;
        } else if (d < distance[1])
            distance[1] = d;
    }
    return best;
}

/* Labels that are moved along true distances are true, but for ties: Voronoi cells of the plane. bound: how much farther a
 * vertex may be from the source it is given, in mean edge lengths: on a grid the rounding of what is kept in single
 * precision; on the disk measured 0.03, where a cell is a strip narrower than a face. */
static void check_cells(loxo_shape shape, int64_t n_vertices, double bound)
{
    surface s = surface_make(test_context, shape, n_vertices, NAN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    geodesic_problem problem = {.ctx = test_context, .mesh = s.mesh, .m = m};
    loxo_index source[N_SOURCES], *nearest = loxo_allocate(test_context, m.n_vertices, sizeof *nearest);
    double *distance = surface_numbers(&s);
    geodesic_seed *seeds = NULL;
    int64_t n_seeds = 0;
    const double s_edge = straight(&s, &s.soup.position[3 * s.soup.triangle[0]], s.soup.triangle[1]);
    double worst = 0.0;
    spread_sources(&s, source);
    for (int64_t v = 0; v < m.n_vertices; ++v) {
        double d[2];
        (void)two_nearest(&s, source, m.vertex_origin != NULL ? m.vertex_origin[v] : v, d);
        distance[v] = d[0];
    }
    CHECK_OK(geodesic_seeds_from_vertices(&problem, source, N_SOURCES, &seeds, &n_seeds));
    CHECK_EQUAL(n_seeds, N_SOURCES);
    CHECK_OK(geodesic_label_nearest(&problem, seeds, n_seeds, distance, nearest));
    for (int64_t v = 0; v < m.n_vertices; ++v) {
        double d[2];
        const int best = two_nearest(&s, source, m.vertex_origin != NULL ? m.vertex_origin[v] : v, d);
        if (nearest[v] != best) worst = fmax(worst, (d[1] - d[0]) / s_edge);
    }
    print_message("farther by %.4f edge lengths at most\n", worst);
    CHECK(worst <= bound);
    loxo_release(test_context, seeds);
    loxo_release(test_context, nearest);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

TEST(cells_of_a_grid)
{
    NEEDS_IDS(6 * 5000);
    check_cells(LOXO_SHAPE_GRID, 5000, 1e-5);
}

TEST(cells_of_a_disk)
{
    NEEDS_IDS(6 * 5000);
    check_cells(LOXO_SHAPE_DISK, 5000, 0.05);
}

/* A limit may cut off a piece whose distances came out short: what has a distance has a source, nothing else has. */
TEST(cells_of_islands)
{
    surface s = surface_make(test_context, LOXO_SHAPE_STRIP, 40, NAN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    geodesic_problem problem = {.ctx = test_context, .mesh = s.mesh, .m = m};
    loxo_index source = 0, *nearest = loxo_allocate(test_context, m.n_vertices, sizeof *nearest);
    double *distance = surface_numbers(&s);
    geodesic_seed *seeds = NULL;
    int64_t n_seeds = 0;
    for (int64_t v = 0; v < m.n_vertices; ++v) {
        const double x = s.soup.position[3 * (m.vertex_origin != NULL ? m.vertex_origin[v] : v)];
        distance[v] = x > 5.0 && x < 9.0 ? HUGE_VAL : x;
    }
    CHECK_OK(geodesic_seeds_from_vertices(&problem, &source, 1, &seeds, &n_seeds));
    CHECK_OK(geodesic_label_nearest(&problem, seeds, n_seeds, distance, nearest));
    for (int64_t v = 0; v < m.n_vertices; ++v)
        CHECK_EQUAL(nearest[v], distance[v] < HUGE_VAL ? 0 : -1);
    loxo_release(test_context, seeds);
    loxo_release(test_context, nearest);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

/* With the distances of a solve the lines between cells move by as much as the distances are off: no vertex is given to a
 * source that is farther than the nearest by more than six edge lengths (measured 4.0: near such lines distances of some
 * 40 edge lengths are off by up to three). */
static void check_nearest(loxo_order order, bool as_points)
{
    NEEDS_IDS(6 * 10000);
    surface s = surface_from_soup(test_context, soup_make(test_context, LOXO_SHAPE_GRID, 10000, NAN), order);
    const int64_t n = s.soup.n_vertices;
    loxo_index source[N_SOURCES], *nearest = loxo_allocate(test_context, n, sizeof *nearest);
    double *distance = surface_numbers(&s), worst = 0.0;
    int64_t n_other = 0;
    spread_sources(&s, source);
    for (int method = 0; method < 2; ++method) {
        const int64_t before = n_other;
        loxo_geodesic_settings settings = unjudged_settings((loxo_geodesic_method)method);
        loxo_geodesic *g = NULL;
        loxo_geodesic_info info;
        loxo_surface_point points[N_SOURCES];
        settings.nearest = true;
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        CHECK_STATUS(test_context, loxo_geodesic_nearest(g, nearest), LOXO_ERR_ARGUMENT);
        for (int i = 0; i < N_SOURCES; ++i)
            points[i] = (loxo_surface_point){{source[i], -1, -1}, {1.0, 0.0, 0.0}};
        if (as_points)
            CHECK_OK(loxo_geodesic_solve_points(g, points, N_SOURCES, distance, &info));
        else
            CHECK_OK(loxo_geodesic_solve(g, source, N_SOURCES, distance, &info));
        CHECK_OK(loxo_geodesic_nearest(g, nearest));
        for (int64_t v = 0; v < n; ++v) {
            double d[2];
            const int best = two_nearest(&s, source, v, d);
            CHECK(nearest[v] >= 0 && nearest[v] < N_SOURCES);
            if (nearest[v] == best) continue;
            const double excess = straight(&s, &s.soup.position[3 * source[nearest[v]]], v) - d[0];
            worst = fmax(worst, excess / info.mean_edge_length);
            n_other += excess > 1e-9;
        }
        for (int i = 0; i < N_SOURCES; ++i)
            CHECK_EQUAL(nearest[source[i]], i);
        loxo_geodesic_destroy(g);
        print_message("%s: %lld of %lld at another source\n", method_names[method], (long long)(n_other - before),
                      (long long)n);
    }
    print_message("farther by %.2f edge lengths at most\n", worst);
    CHECK(worst < 6.0 && n_other < n / 20);
    loxo_release(test_context, nearest);
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

TEST(nearest_of_a_solve) { check_nearest(LOXO_ORDER_GIVEN, false); }

TEST(nearest_in_the_order_of_the_caller) { check_nearest(LOXO_ORDER_HILBERT, true); }

TEST(nearest_where_nothing_reaches)
{
    /* two triangles that do not touch */
    static const double position[18] = {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0,
                                        5.0, 0.0, 0.0, 6.0, 0.0, 0.0, 5.0, 1.0, 0.0};
    static const loxo_index triangle[6] = {0, 1, 2, 3, 4, 5};
    surface s = surface_small(test_context, 6, position, 2, triangle);
    loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EDGE);
    loxo_geodesic *g = NULL;
    double distance[6];
    loxo_index nearest[6];
    settings.nearest = true;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_solve(g, (const loxo_index[]){1, 1, 1}, 3, distance, NULL));
    CHECK_OK(loxo_geodesic_nearest(g, nearest));
    for (int v = 0; v < 6; ++v)
        CHECK_EQUAL(nearest[v], v < 3 ? 0 : -1);
    loxo_geodesic_destroy(g);
    settings.nearest = false;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    CHECK_OK(loxo_geodesic_solve(g, (const loxo_index[]){1}, 1, distance, NULL));
    CHECK_STATUS(test_context, loxo_geodesic_nearest(g, nearest), LOXO_ERR_ARGUMENT);
    loxo_geodesic_destroy(g);
    surface_destroy(&s);
}
