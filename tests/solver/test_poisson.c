/* SPDX-License-Identifier: MIT
 * The heat method and the variational method. */
#include "algebra/cholesky.h"
#include "base/allocate.h"
#include "shapes.h"
#include "solver/dense.h"
#include "solver/surfaces.h"

#include <loxo/io.h>

#include <time.h>

static loxo_geodesic_settings settings_of(loxo_geodesic_method method, loxo_geodesic_factor factor)
{
    loxo_geodesic_settings settings = loxo_geodesic_settings_default();
    settings.method = method;
    settings.factor = factor;
    settings.check_gradient_share = 1.0;
    settings.check_breach = 1e30;
    return settings;
}

static loxo_geodesic_info solve(const surface *s, const loxo_geodesic_settings *settings, const loxo_index *sources,
                                int64_t n_sources, double *d, loxo_status expected)
{
    loxo_geodesic_info info;
    CHECK_STATUS(s->ctx, loxo_geodesic_distance(s->ctx, s->mesh, settings, sources, n_sources, d, &info), expected);
    return info;
}

/* By the formulas of the paper, dense, vectors in three dimensions: heat, X = -grad u / |grad u|, div, C d = div with d = 0
 * at all sources. */
static void dense_heat_method(const surface *s, const bool *is_rim, const loxo_index *sources, int64_t n_sources,
                              double *d)
{
    const loxo_mesh_arrays *m = &s->arrays;
    const int64_t n = m->n_vertices;
    long double *a = malloc((size_t)(n * n) * sizeof *a), *u = calloc((size_t)n, sizeof *u);
    long double *w = calloc((size_t)n, sizeof *w), *b = calloc((size_t)n, sizeof *b);
    const long double h = dense_mean_edge(s->mesh);
    bool has_rim = false;
    for (int64_t k = 0; k < n_sources; ++k)
        u[sources[k]] = w[sources[k]] = 1.0L;
    dense_matrix(m, 1.0L, h * h, a);
    dense_solve(n, a, u);
    dense_matrix(m, 1.0L, h * h, a);
    for (int64_t v = 0; v < n; ++v) {
        const loxo_index id = (loxo_index)v;
        if (is_rim[v]) dense_ground(n, &id, 1, a, w);
        has_rim = has_rim || is_rim[v];
    }
    dense_solve(n, a, w);
    for (int64_t v = 0; v < n && has_rim; ++v)
        u[v] = (u[v] + w[v]) / 2.0L;
    for (int64_t f = 0; f < m->n_faces; ++f) {
        const loxo_index *t = &m->triangle[3 * f];
        const dense_vector ab = dense_edge(m, t[0], t[1]), ac = dense_edge(m, t[0], t[2]), k = dense_cross(ab, ac);
        const long double p = u[t[1]] - u[t[0]], q = u[t[2]] - u[t[0]];
        const dense_vector r = {p * ac.x - q * ab.x, p * ac.y - q * ab.y, p * ac.z - q * ab.z};
        dense_vector x = dense_cross(k, r); /* along -grad u */
        const long double size = dense_norm(x), twice_area = dense_norm(k);
        x = (dense_vector){x.x / size, x.y / size, x.z / size};
        for (int c = 0; c < 3; ++c) { /* cot at the other two corners times the edges to them */
            const int64_t i = t[c], j = t[(c + 1) % 3], o = t[(c + 2) % 3];
            const dense_vector ij = dense_edge(m, i, j), io = dense_edge(m, i, o), jo = dense_edge(m, j, o);
            const long double cot_o = dense_dot(io, jo) / twice_area, cot_j = -dense_dot(ij, jo) / twice_area;
            b[i] -= (cot_o * dense_dot(ij, x) + cot_j * dense_dot(io, x)) / 2.0L; /* C is minus the Laplacian */
        }
    }
    dense_matrix(m, 0.0L, 1.0L, a);
    dense_ground(n, sources, n_sources, a, b);
    dense_solve(n, a, b);
    for (int64_t v = 0; v < n; ++v)
        d[v] = (double)b[v];
    free(a);
    free(u);
    free(w);
    free(b);
}

/* A bumpy sphere, a disk, and two spheres. */
static surface paper_surface(int k)
{
    loxo_soup soup = soup_make(test_context, k == 1 ? LOXO_SHAPE_DISK : LOXO_SHAPE_BUMPY, 90, NAN), other;
    if (k == 2) {
        other = soup_make(test_context, LOXO_SHAPE_ICOSPHERE, 162, NAN);
        shape_append(test_context, &soup, &other);
    }
    return surface_from_soup(test_context, soup, LOXO_ORDER_GIVEN);
}

/* Closed, and with boundary: there the heat is the mean of free and of zero heat at the boundary. */
TEST(factors_give_the_papers_formulas)
{
    if (!loxo_cholesky_is_there()) SKIP();
    for (int k = 0; k < 2; ++k) {
        surface s = paper_surface(k);
        const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
        const loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_HEAT, LOXO_FACTOR_CHOLESKY);
        double *d = surface_numbers(&s), *expected = surface_numbers(&s);
        bool *is_rim = calloc((size_t)m.n_vertices, sizeof *is_rim);
        const loxo_index source = 5;
        for (int64_t v = 0; v < m.n_vertices; ++v)
            is_rim[v] = m.halfedge_twin[m.vertex_halfedge[v]] < 0;
        solve(&s, &settings, &source, 1, d, LOXO_OK);
        dense_heat_method(&s, is_rim, &source, 1, expected);
        for (int64_t v = 0; v < m.n_vertices; ++v) /* rounding; conditions of some 1e3, heat of 1e-6 normalised */
            CHECK_NEAR(d[v], expected[v], 1e-9);
        free(is_rim);
        loxo_release(test_context, d);
        loxo_release(test_context, expected);
        surface_destroy(&s);
    }
}

/* Few sources by ties to one factor, the ground of a component among them and neighbours; many by a factor of their own; and
 * a few again by that one. */
TEST(several_sources_give_the_papers_formulas)
{
    static const int64_t numbers[] = {2, 4, 20, 160, 20, 160, 4};
    if (!loxo_cholesky_is_there()) SKIP();
    for (int k = 0; k < 3; ++k) {
        surface s = paper_surface(k);
        const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
        const loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_HEAT, LOXO_FACTOR_CHOLESKY);
        double *d = surface_numbers(&s), *expected = surface_numbers(&s);
        bool *is_rim = calloc((size_t)m.n_vertices, sizeof *is_rim);
        loxo_index source[160];
        loxo_geodesic *g;
        for (int64_t v = 0; v < m.n_vertices; ++v)
            is_rim[v] = m.halfedge_twin[m.vertex_halfedge[v]] < 0;
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        for (int turn = 0; turn < 7; ++turn) {
            const int64_t n = numbers[turn] < m.n_vertices / 2 || k == 2 ? numbers[turn] : 40;
            for (int64_t i = 0; i < n; ++i) /* 0, 1, and on; of two spheres by turns */
                source[i] = (loxo_index)(i % 2 == 1 && k == 2 ? m.n_vertices - 1 - i / 2 : i / (k == 2 ? 2 : 1));
            CHECK_OK(loxo_geodesic_solve(g, source, n, d, NULL));
            dense_heat_method(&s, is_rim, source, n, expected);
            for (int64_t v = 0; v < m.n_vertices; ++v) /* as with one */
                CHECK_NEAR(d[v], expected[v], 1e-9);
        }
        loxo_geodesic_destroy(g);
        free(is_rim);
        loxo_release(test_context, d);
        loxo_release(test_context, expected);
        surface_destroy(&s);
    }
}

static double time_of_solve(loxo_geodesic *g, const loxo_index *sources, int64_t n_sources, double *d)
{
    const clock_t start = clock();
    CHECK_OK(loxo_geodesic_solve(g, sources, n_sources, d, NULL));
    return (double)(clock() - start) / CLOCKS_PER_SEC;
}

/* A set of sources costs two solves in place of one, and no factor: far less than create, which makes those. */
TEST(one_factor_serves_all_sets_of_sources)
{
    if (!loxo_cholesky_is_there()) SKIP();
    NEEDS_IDS(40000 * 6);
    loxo_context *alone = test_context_with_threads(1); /* processor time: others spin */
    surface s = surface_make(alone, LOXO_SHAPE_BUMPY, 40000, NAN);
    double *d = surface_numbers(&s), three = HUGE_VAL;
    loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_HEAT, LOXO_FACTOR_CHOLESKY);
    loxo_geodesic *g;
    settings.time_factor = 4.0;
    const clock_t start = clock();
    CHECK_OK(loxo_geodesic_create(alone, s.mesh, &settings, &g));
    const double factors = (double)(clock() - start) / CLOCKS_PER_SEC;
    for (loxo_index k = 0; k < 5; ++k) {
        const loxo_index sources[3] = {k, 1000 + k, 30000};
        three = fmin(three, time_of_solve(g, sources, 3, d));
    }
    print_message("create %.4f, three sources %.4f s\n", factors, three);
    CHECK(three < 0.5 * factors);
    loxo_geodesic_destroy(g);
    loxo_release(alone, d);
    surface_destroy(&s);
    loxo_context_destroy(alone);
}

/* The two ways differ by the diffusion's tolerance only, 1e-3 of the directions: on a closed surface. */
TEST(multigrid_and_factors_agree)
{
    static const loxo_geodesic_method methods[] = {LOXO_GEODESIC_HEAT, LOXO_GEODESIC_VARIATIONAL};
    if (!loxo_cholesky_is_there()) SKIP();
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 5000, NAN);
    double *a = surface_numbers(&s), *b = surface_numbers(&s);
    const loxo_index source = 17;
    for (int k = 0; k < 2; ++k) {
        const loxo_geodesic_settings one = settings_of(methods[k], LOXO_FACTOR_CHOLESKY);
        const loxo_geodesic_settings other = settings_of(methods[k], LOXO_FACTOR_MULTIGRID);
        double apart = 0.0, most = 0.0;
        solve(&s, &one, &source, 1, a, LOXO_OK);
        const loxo_geodesic_info info = solve(&s, &other, &source, 1, b, LOXO_OK);
        CHECK(info.n_poisson_steps > 0 && info.poisson_residual <= 1e-8 && info.diffusion_converged);
        for (int64_t v = 0; v < s.soup.n_vertices; ++v) {
            apart = fmax(apart, fabs(a[v] - b[v]));
            most = fmax(most, a[v]);
        }
        CHECK(apart < 1e-3 * most);
    }
    loxo_release(test_context, a);
    loxo_release(test_context, b);
    surface_destroy(&s);
}

static double mean_error(const double *d, const double *exact, int64_t n)
{
    double sum = 0.0, count = 0.0;
    for (int64_t v = 0; v < n; ++v) {
        if (!(exact[v] > 0.0)) continue;
        sum += fabs(d[v] - exact[v]) / exact[v];
        count += 1.0;
    }
    return sum / count;
}

/* Measured 0.8 % and 0.9 %; parallel heat has 0.9 % there. */
TEST(near_the_exact_distances_of_the_sphere)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 5000, NAN);
    double *d = surface_numbers(&s), *exact = surface_numbers(&s);
    const loxo_index source = 0;
    surface_exact(&s, LOXO_SHAPE_ICOSPHERE, source, exact);
    for (int method = LOXO_GEODESIC_HEAT; method <= LOXO_GEODESIC_VARIATIONAL; ++method) {
        const loxo_geodesic_settings settings = settings_of((loxo_geodesic_method)method, LOXO_FACTOR_MULTIGRID);
        const loxo_geodesic_info info = solve(&s, &settings, &source, 1, d, LOXO_OK);
        CHECK(mean_error(d, exact, s.soup.n_vertices) < 0.015);
        CHECK_EQUAL(d[source], 0.0);
        CHECK_EQUAL(info.n_lost_heat, 0);
    }
    loxo_release(test_context, d);
    loxo_release(test_context, exact);
    surface_destroy(&s);
}

/* All sources are at 0, and d is what the least of single ones is, within the methods' own errors, 0.8 to 0.9 % there. */
TEST(several_sources_are_the_least_of_single_ones)
{
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 5000, NAN);
    const int64_t n = s.soup.n_vertices;
    double *d = surface_numbers(&s), *one = surface_numbers(&s), *least = surface_numbers(&s);
    const loxo_index sources[4] = {0, 700, 703, 4000};
    for (int method = LOXO_GEODESIC_HEAT; method <= LOXO_GEODESIC_VARIATIONAL; ++method)
        for (int factor = LOXO_FACTOR_MULTIGRID; factor <= LOXO_FACTOR_CHOLESKY; ++factor) {
            if (factor == LOXO_FACTOR_CHOLESKY && !loxo_cholesky_is_there()) continue;
            const loxo_geodesic_settings settings =
                settings_of((loxo_geodesic_method)method, (loxo_geodesic_factor)factor);
            for (int64_t v = 0; v < n; ++v)
                least[v] = HUGE_VAL;
            for (int k = 0; k < 4; ++k) {
                solve(&s, &settings, &sources[k], 1, one, LOXO_OK);
                for (int64_t v = 0; v < n; ++v)
                    least[v] = fmin(least[v], one[v]);
            }
            solve(&s, &settings, sources, 4, d, LOXO_OK);
            CHECK(mean_error(d, least, n) < 0.02); /* the two kinds of errors together */
            for (int k = 0; k < 4; ++k)
                CHECK_EQUAL(d[sources[k]], 0.0);
        }
    loxo_release(test_context, d);
    loxo_release(test_context, one);
    loxo_release(test_context, least);
    surface_destroy(&s);
}

/* Corners of their faces stand at their straight distances. */
TEST(several_points_inside_faces)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 2500, NAN);
    double *d = surface_numbers(&s), worst = 0.0;
    const int64_t faces[2] = {s.soup.n_faces / 5, s.soup.n_faces / 2};
    loxo_surface_point point[2] = {{.weight = {0.5, 0.3, 0.2}}, {.weight = {0.1, 0.1, 0.8}}};
    double p[2][3] = {{0.0}};
    for (int i = 0; i < 2; ++i)
        for (int k = 0; k < 3; ++k) {
            point[i].vertex[k] = s.soup.triangle[3 * faces[i] + k];
            for (int c = 0; c < 3; ++c)
                p[i][c] += point[i].weight[k] * s.soup.position[3 * (int64_t)point[i].vertex[k] + c];
        }
    for (int factor = LOXO_FACTOR_MULTIGRID; factor <= LOXO_FACTOR_CHOLESKY; ++factor) {
        if (factor == LOXO_FACTOR_CHOLESKY && !loxo_cholesky_is_there()) continue;
        const loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_VARIATIONAL, (loxo_geodesic_factor)factor);
        loxo_geodesic *g;
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        CHECK_OK(loxo_geodesic_solve_points(g, point, 2, d, NULL));
        for (int64_t v = 0; v < s.soup.n_vertices; ++v) {
            const double *x = &s.soup.position[3 * v];
            const double apart[2] = {hypot(x[0] - p[0][0], x[1] - p[0][1]), hypot(x[0] - p[1][0], x[1] - p[1][1])};
            worst = fmax(worst, fabs(d[v] - fmin(apart[0], apart[1])));
        }
        for (int i = 0; i < 2; ++i)
            for (int k = 0; k < 3; ++k) {
                const double *x = &s.soup.position[3 * (int64_t)point[i].vertex[k]];
                CHECK_NEAR(d[point[i].vertex[k]], hypot(x[0] - p[i][0], x[1] - p[i][1]), 1e-12);
            }
        loxo_geodesic_destroy(g);
    }
    CHECK(worst < 0.05); /* 2.5 edges */
    loxo_release(test_context, d);
    surface_destroy(&s);
}

TEST(variational_lowers_its_energy)
{
    surface s = surface_make(test_context, LOXO_SHAPE_TORUS, 3000, NAN);
    double *d = surface_numbers(&s);
    loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_VARIATIONAL, LOXO_FACTOR_MULTIGRID);
    const loxo_index source = 3;
    double last = HUGE_VAL;
    for (int64_t n = 0; n <= 20; n += 10) {
        settings.n_iterations = n;
        const loxo_geodesic_info info = solve(&s, &settings, &source, 1, d, LOXO_OK);
        CHECK(info.objective < 0.8 * last);
        CHECK_EQUAL(info.n_iterations, n);
        last = info.objective;
    }
    loxo_release(test_context, d);
    surface_destroy(&s);
}

TEST(components_without_sources_are_infinitely_far)
{
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_ICOSPHERE, 642, NAN);
    loxo_soup other = soup_make(test_context, LOXO_SHAPE_ICOSPHERE, 642, NAN), lone = shape_empty(test_context, 1, 0);
    memset(lone.position, 0, 3 * sizeof *lone.position);
    shape_append(test_context, &soup, &other);
    shape_append(test_context, &soup, &lone);
    surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
    double *d = surface_numbers(&s);
    const loxo_index sources[2] = {3, 642 + 3};
    for (int factor = LOXO_FACTOR_MULTIGRID; factor <= LOXO_FACTOR_CHOLESKY; ++factor) {
        if (factor == LOXO_FACTOR_CHOLESKY && !loxo_cholesky_is_there()) continue;
        const loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_HEAT, (loxo_geodesic_factor)factor);
        loxo_geodesic_info info = solve(&s, &settings, sources, 1, d, LOXO_OK);
        CHECK_EQUAL(info.n_unreached, 643);
        CHECK(d[642] == HUGE_VAL && d[1284] == HUGE_VAL && d[100] < 4.0);
        info = solve(&s, &settings, sources, 2, d, LOXO_OK);
        CHECK_EQUAL(info.n_unreached, 1);
        for (int v = 0; v < 642; ++v) /* the diffusion's tolerance: levels of the two are one */
            CHECK_NEAR(d[v], d[642 + v], 2e-3);
    }
    loxo_release(test_context, d);
    surface_destroy(&s);
}

/* Heat falls by a constant factor an edge, and is below 1e-308 after some 700: factors notice, marching does not mind. */
TEST(lost_heat_is_told)
{
    surface s = surface_make(test_context, LOXO_SHAPE_STRIP, 4000, NAN);
    double *d = surface_numbers(&s), *exact = surface_numbers(&s);
    const loxo_index source = 0;
    surface_exact(&s, LOXO_SHAPE_STRIP, source, exact);
    loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_HEAT, LOXO_FACTOR_MULTIGRID);
    CHECK_EQUAL(solve(&s, &settings, &source, 1, d, LOXO_OK).n_lost_heat, 0);
    CHECK(mean_error(d, exact, s.soup.n_vertices) < 0.01);
    if (loxo_cholesky_is_there()) {
        settings.factor = LOXO_FACTOR_CHOLESKY;
        const loxo_geodesic_info info = solve(&s, &settings, &source, 1, d, LOXO_CHECK_FAILED);
        CHECK(info.n_lost_heat > 1000 && info.n_lost_heat < 4000);
    }
    loxo_release(test_context, d);
    loxo_release(test_context, exact);
    surface_destroy(&s);
}

/* A mesh 2^k times as large has distances 2^k times as large: in all that is computed only exponents change. */
TEST(powers_of_two_scale_everything)
{
    static const int exponents[] = {-100, -60, 60, 100};
    static const loxo_shape shapes[] = {LOXO_SHAPE_BUMPY, LOXO_SHAPE_DISK};
    const loxo_index sources[3] = {9, 300, 301};
    for (int c = 0; c < 16; ++c) { /* methods, factors, sources, shapes */
        const loxo_geodesic_factor factor = (c & 2) != 0 ? LOXO_FACTOR_CHOLESKY : LOXO_FACTOR_MULTIGRID;
        const loxo_geodesic_method method = (c & 1) != 0 ? LOXO_GEODESIC_VARIATIONAL : LOXO_GEODESIC_HEAT;
        const loxo_geodesic_settings settings = settings_of(method, factor);
        const int64_t n_sources = (c & 4) != 0 ? 3 : 1;
        if (factor == LOXO_FACTOR_CHOLESKY && !loxo_cholesky_is_there()) continue;
        surface s = surface_make(test_context, shapes[c / 8], 642, NAN);
        double *d = surface_numbers(&s), *scaled = surface_numbers(&s);
        const loxo_geodesic_info info = solve(&s, &settings, sources, n_sources, d, LOXO_OK);
        for (int k = 0; k < 4; ++k) {
            loxo_soup soup = shape_copy(test_context, &s.soup);
            for (int64_t i = 0; i < 3 * soup.n_vertices; ++i)
                soup.position[i] = ldexp(soup.position[i], exponents[k]);
            surface other = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
            const loxo_geodesic_info of_other = solve(&other, &settings, sources, n_sources, scaled, LOXO_OK);
            CHECK_EQUAL(of_other.n_poisson_steps, info.n_poisson_steps);
            CHECK_EQUAL(of_other.poisson_residual, info.poisson_residual);
            for (int64_t v = 0; v < s.soup.n_vertices; ++v)
                CHECK_EQUAL(scaled[v], ldexp(d[v], exponents[k]));
            surface_destroy(&other);
        }
        loxo_release(test_context, d);
        loxo_release(test_context, scaled);
        surface_destroy(&s);
    }
}

/* What is lost does not depend on the unit of length. */
TEST(lost_heat_does_not_depend_on_the_unit)
{
    if (!loxo_cholesky_is_there()) SKIP();
    const loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_HEAT, LOXO_FACTOR_CHOLESKY);
    const loxo_index source = 0;
    int64_t n_lost[3];
    for (int k = 0; k < 3; ++k) {
        loxo_soup soup = soup_make(test_context, LOXO_SHAPE_STRIP, 4000, NAN);
        for (int64_t i = 0; i < 3 * soup.n_vertices; ++i)
            soup.position[i] = ldexp(soup.position[i], 100 * (k - 1));
        surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
        double *d = surface_numbers(&s);
        n_lost[k] = solve(&s, &settings, &source, 1, d, LOXO_CHECK_FAILED).n_lost_heat;
        CHECK_EQUAL(n_lost[k], n_lost[0]);
        loxo_release(test_context, d);
        surface_destroy(&s);
    }
}

TEST(points_inside_faces)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 2500, NAN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    double *d = surface_numbers(&s);
    const int64_t f = m.n_faces / 3;
    const double weight[3] = {0.5, 0.3, 0.2};
    loxo_surface_point point = {.weight = {0.5, 0.3, 0.2}};
    double p[3] = {0.0, 0.0, 0.0}, worst = 0.0;
    for (int k = 0; k < 3; ++k) {
        const loxo_index v = m.halfedge_vertex[3 * f + k];
        point.vertex[k] = m.vertex_origin != NULL ? m.vertex_origin[v] : v;
        for (int c = 0; c < 3; ++c)
            p[c] += weight[k] * m.position[v][c];
    }
    for (int factor = LOXO_FACTOR_MULTIGRID; factor <= LOXO_FACTOR_CHOLESKY; ++factor) {
        if (factor == LOXO_FACTOR_CHOLESKY && !loxo_cholesky_is_there()) continue;
        const loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_HEAT, (loxo_geodesic_factor)factor);
        loxo_geodesic *g;
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        CHECK_OK(loxo_geodesic_solve_points(g, &point, 1, d, NULL));
        for (int64_t v = 0; v < s.soup.n_vertices; ++v) {
            const double *x = &s.soup.position[3 * v];
            worst = fmax(worst, fabs(d[v] - hypot(x[0] - p[0], x[1] - p[1])));
        }
        loxo_geodesic_destroy(g);
    }
    CHECK(worst < 0.05); /* 2.5 edges */
    loxo_release(test_context, d);
    surface_destroy(&s);
}

TEST(one_solver_serves_many_sources)
{
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 2562, NAN);
    double *a = surface_numbers(&s), *b = surface_numbers(&s);
    for (int factor = LOXO_FACTOR_MULTIGRID; factor <= LOXO_FACTOR_CHOLESKY; ++factor) {
        if (factor == LOXO_FACTOR_CHOLESKY && !loxo_cholesky_is_there()) continue;
        const loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_VARIATIONAL, (loxo_geodesic_factor)factor);
        const loxo_index sources[2] = {5, 1000};
        loxo_geodesic *g;
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        CHECK_OK(loxo_geodesic_solve(g, &sources[0], 1, a, NULL));
        CHECK_OK(loxo_geodesic_solve(g, sources, 2, b, NULL));
        CHECK_OK(loxo_geodesic_solve(g, &sources[0], 1, b, NULL));
        CHECK(memcmp(a, b, (size_t)s.soup.n_vertices * sizeof *a) == 0);
        loxo_geodesic_destroy(g);
    }
    loxo_release(test_context, a);
    loxo_release(test_context, b);
    surface_destroy(&s);
}

TEST(without_cholmod_factors_are_refused)
{
    if (loxo_cholesky_is_there()) SKIP();
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 42, NAN);
    const loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_HEAT, LOXO_FACTOR_CHOLESKY);
    loxo_geodesic *g;
    CHECK_STATUS(test_context, loxo_geodesic_create(test_context, s.mesh, &settings, &g), LOXO_ERR_UNSUPPORTED);
    surface_destroy(&s);
}

static int stop_in(void *user, const loxo_progress *progress) { return strcmp(progress->phase, user) == 0; }

TEST(monitor_stops_it)
{
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 2562, NAN);
    const loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_HEAT, LOXO_FACTOR_MULTIGRID);
    double *d = surface_numbers(&s);
    const loxo_index source = 0;
    loxo_context_set_monitor(test_context, stop_in, "conjugate gradients");
    solve(&s, &settings, &source, 1, d, LOXO_ERR_STOPPED);
    loxo_context_set_monitor(test_context, NULL, NULL);
    loxo_release(test_context, d);
    surface_destroy(&s);
}

/* The estimate is what is taken at most, with several sources too, and not much more. */
static void check_estimate(loxo_context *ctx, loxo_soup soup)
{
    surface s = surface_from_soup(ctx, soup, LOXO_ORDER_AUTO);
    double *d = surface_numbers(&s);
    const loxo_index sources[2] = {0, (loxo_index)(s.soup.n_vertices / 2)};
    for (int method = LOXO_GEODESIC_HEAT; method <= LOXO_GEODESIC_VARIATIONAL; ++method) {
        loxo_geodesic_settings settings = settings_of((loxo_geodesic_method)method, LOXO_FACTOR_MULTIGRID);
        loxo_geodesic_info info;
        loxo_geodesic *g;
        size_t bytes;
        settings.n_iterations = 0;
        settings.diffusion = LOXO_DIFFUSION_SWEEPS; /* what is computed does not matter here */
        settings.n_sweeps = 1;
        CHECK_STATUS(ctx, loxo_geodesic_estimate(ctx, s.soup.n_vertices, s.soup.n_faces, &settings, &bytes, NULL),
                     LOXO_OK);
        const size_t before = loxo_context_memory(ctx).current_bytes;
        CHECK_STATUS(ctx, loxo_geodesic_create(ctx, s.mesh, &settings, &g), LOXO_OK);
        for (int64_t n = 1; n <= 2; ++n) {
            CHECK(loxo_geodesic_solve(g, sources, n, d, &info) >= 0);
            const size_t held = loxo_context_memory(ctx).current_bytes - before;
            if (held > bytes) print_error("%zu bytes are held, %zu were estimated\n", held, bytes);
            CHECK(info.workspace_bytes <= bytes && held <= bytes);
        }
        CHECK((double)bytes <= 1.25 * (double)info.workspace_bytes + 200000.0);
        loxo_geodesic_destroy(g);
    }
    loxo_release(ctx, d);
    surface_destroy(&s);
}

TEST(estimates_are_not_below_what_is_taken)
{
    static const char *const files[] = {"meshes/surfaces/moai48k-slivers.ply", "meshes/surfaces/homer6k.obj.gz"};
    NEEDS_IDS(50000 * 6);
    for (int shape = 0; shape < LOXO_N_SHAPES; ++shape)
        for (int64_t n = 300; n <= 3000; n *= 10)
            check_estimate(test_context, soup_make(test_context, (loxo_shape)shape, n, NAN));
    loxo_soup capped = soup_make(test_context, LOXO_SHAPE_ICOSPHERE, 2562, NAN);
    shape_add_caps(test_context, &capped, 28, 1e-5);
    check_estimate(test_context, capped);
    for (int k = 0; k < 2; ++k) {
        loxo_soup soup = {0};
        if (test_shared(files[k]) == NULL) SKIP();
        CHECK_OK(loxo_read_mesh(test_context, test_shared(files[k]), NULL, &soup));
        check_estimate(test_context, soup);
    }
}

typedef struct ladder_call {
    surface s;
    loxo_geodesic_settings settings;
} ladder_call;

static loxo_status solve_once(loxo_context *ctx, void *arg)
{
    const ladder_call *c = arg;
    const loxo_mesh_arrays arrays = c->s.arrays;
    const loxo_index sources[2] = {1, 300};
    loxo_mesh *mesh = NULL;
    double *d = loxo_allocate(ctx, arrays.n_vertices, sizeof *d);
    loxo_status status = d == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    if (status >= 0) status = loxo_mesh_create(ctx, &arrays, LOXO_BORROW, NULL, NULL, &mesh);
    if (status >= 0) status = loxo_geodesic_distance(ctx, mesh, &c->settings, sources, 2, d, NULL);
    loxo_mesh_destroy(mesh);
    loxo_release(ctx, d);
    return status;
}

TEST(each_allocation_may_fail)
{
    ladder_call call = {surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 642, NAN), {0}};
    for (int factor = LOXO_FACTOR_MULTIGRID; factor <= LOXO_FACTOR_CHOLESKY; ++factor) {
        if (factor == LOXO_FACTOR_CHOLESKY && !loxo_cholesky_is_there()) continue;
        call.settings = settings_of(LOXO_GEODESIC_VARIATIONAL, (loxo_geodesic_factor)factor);
        call.settings.n_iterations = 1;
        CHECK(test_each_allocation_fails(solve_once, &call) > 20);
    }
    surface_destroy(&call.s);
}

static uint64_t hash_on(loxo_context *ctx, const void *soup)
{
    surface s = surface_from_soup(ctx, shape_copy(ctx, soup), LOXO_ORDER_AUTO);
    const loxo_geodesic_settings settings = settings_of(LOXO_GEODESIC_VARIATIONAL, LOXO_FACTOR_MULTIGRID);
    double *d = surface_numbers(&s);
    const loxo_index sources[2] = {9, 4000};
    solve(&s, &settings, sources, 2, d, LOXO_OK);
    const uint64_t hash = test_hash(d, (size_t)s.soup.n_vertices * sizeof *d);
    loxo_release(ctx, d);
    surface_destroy(&s);
    return hash;
}

TEST(any_number_of_threads_gives_the_same_bits)
{
    NEEDS_IDS(60000 * 3);
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_BUMPY, 20000, NAN);
    test_same_for_any_threads(hash_on, &soup);
    loxo_soup_destroy(test_context, &soup);
}

/* What the info tells is what the meter sees held, for one source and for several, which are held in another matrix: but for the
 * solver's own record and its list of seeds. Factors are CHOLMOD's, and come on top. */
TEST(workspace_is_what_is_held)
{
    static const loxo_index sources[3] = {0, 100, 500};
    surface s = surface_make(test_context, LOXO_SHAPE_ICOSPHERE, 2500, NAN);
    double *distance = surface_numbers(&s);
    for (int k = 0; k < 4; ++k) {
        loxo_geodesic_settings settings =
            unjudged_settings(k % 2 == 0 ? LOXO_GEODESIC_HEAT : LOXO_GEODESIC_VARIATIONAL);
        if (k >= 2) settings.factor = LOXO_FACTOR_CHOLESKY;
        const size_t before = loxo_context_memory(test_context).current_bytes;
        loxo_geodesic *g = NULL;
        loxo_geodesic_info info;
        const loxo_status created = loxo_geodesic_create(test_context, s.mesh, &settings, &g);
        if (created == LOXO_ERR_UNSUPPORTED) continue; /* no CHOLMOD */
        CHECK_STATUS(test_context, created, LOXO_OK);
        for (int n = 1; n <= 5; ++n) {
            CHECK(loxo_geodesic_solve(g, sources, n % 2 == 1 ? 1 : 3, distance, &info) >= 0);
            const double held = (double)(loxo_context_memory(test_context).current_bytes - before);
            if (k < 2) CHECK_NEAR((double)info.workspace_bytes, held, 2048.0);
            if (k >= 2) CHECK((double)info.workspace_bytes > held + 100.0 * (double)s.soup.n_vertices);
        }
        loxo_geodesic_destroy(g);
    }
    loxo_release(test_context, distance);
    surface_destroy(&s);
}
