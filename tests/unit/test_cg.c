/* SPDX-License-Identifier: MIT
 * Sparse matrices and conjugate gradients. */
#include "algebra/cg.h"
#include "algebra/dense.h"
#include "shapes.h"
#include "unit/matrices.h"

static loxo_cg_info solve(loxo_context *ctx, const loxo_csr *a, const double *b, double *x, loxo_status expected)
{
    loxo_diagonal diagonal = {ctx, a};
    const loxo_preconditioner m = {loxo_diagonal_apply, &diagonal};
    loxo_cg_settings settings = loxo_cg_settings_default();
    loxo_cg_info info;
    loxo_cg *cg;
    settings.tolerance = 1e-12;
    CHECK_STATUS(ctx, loxo_cg_create(ctx, a, &cg), LOXO_OK);
    CHECK_STATUS(ctx, loxo_cg_solve(cg, &m, &settings, b, x, &info), expected);
    loxo_cg_destroy(cg);
    return info;
}

/* B^T B + 1 with B random: positive definite, entries of both signs. */
static void make_definite(int64_t n, uint64_t seed, double *a)
{
    for (int64_t i = 0; i < n; ++i)
        for (int64_t j = 0; j < n; ++j) {
            a[i * n + j] = i == j;
            for (int64_t k = 0; k < n; ++k)
                a[i * n + j] += (loxo_random_unit(seed, (uint64_t)(k * n + i)) - 0.5) *
                                (loxo_random_unit(seed, (uint64_t)(k * n + j)) - 0.5);
        }
}

TEST(definite_system_as_by_the_dense_factor)
{
    enum { N = 40 };
    double a[N * N], x[N] = {0}, y[N];
    make_definite(N, 3, a);
    loxo_csr sparse = matrix_of_dense(test_context, N, a);
    CHECK_OK(loxo_csr_check(test_context, &sparse));
    double *b = random_vector(test_context, N, 8);
    const loxo_cg_info info = solve(test_context, &sparse, b, x, LOXO_OK);
    CHECK(info.residual <= 1e-12 && info.n_iterations <= 2 * N && info.inconsistent == 0.0);
    memcpy(y, b, sizeof y);
    double packed[N * (N + 1) / 2];
    for (int i = 0, to = 0; i < N; ++i)
        for (int j = 0; j <= i; ++j)
            packed[to++] = a[i * N + j];
    CHECK_EQUAL(loxo_dense_factor(N, packed, 1e-12), 0);
    loxo_dense_solve(N, packed, y);
    for (int i = 0; i < N; ++i)
        CHECK_NEAR(x[i], y[i], 1e-10); /* residual 1e-12 times a condition below 100 */
    loxo_release(test_context, b);
    loxo_csr_destroy(test_context, &sparse);
}

TEST(dense_factor_grounds_one_variable_a_component)
{
    /* Paths of three and two with weights 1 and 2. */
    double a[15] = {1, -1, 3, 0, -2, 2, 0, 0, 0, 5, 0, 0, 0, -5, 5};
    double x[5] = {1, 2, -3, 1, -1};
    CHECK_EQUAL(loxo_dense_factor(5, a, 1e-12), 2);
    loxo_dense_solve(5, a, x);
    CHECK_NEAR(x[0] - x[1], 1.0, 1e-14);
    CHECK_NEAR(2.0 * (x[2] - x[1]), -3.0, 1e-14);
    CHECK_NEAR(5.0 * (x[3] - x[4]), 1.0, 1e-14);
}

/* Two spheres and a lone vertex: constants on each are free, the mean of b goes, x has mean zero on each. */
TEST(singular_components)
{
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_ICOSPHERE, 162, NAN);
    loxo_soup other = soup_make(test_context, LOXO_SHAPE_BUMPY, 162, NAN), lone = shape_empty(test_context, 1, 0);
    memset(lone.position, 0, 3 * sizeof *lone.position);
    shape_append(test_context, &soup, &other);
    shape_append(test_context, &soup, &lone);
    surface s = surface_from_soup(test_context, soup, LOXO_ORDER_GIVEN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    const int64_t n = m.n_vertices;
    loxo_csr a;
    loxo_cg *cg;
    CHECK_OK(loxo_laplacian_create(test_context, &m, &a, NULL));
    CHECK_OK(loxo_cg_create(test_context, &a, &cg));
    CHECK_EQUAL(loxo_cg_n_singular(cg), 3);
    loxo_cg_destroy(cg);
    double *b = random_vector(test_context, n, 5), *x = random_vector(test_context, n, 6), *ax;
    ax = zero_vector(test_context, n);
    const loxo_cg_info info = solve(test_context, &a, b, x, LOXO_OK);
    CHECK(info.inconsistent > 0.0 && info.inconsistent < 1.0);
    loxo_csr_multiply(test_context, &a, x, ax);
    for (int64_t part = 0; part < 2; ++part) {
        double mean_b = 0.0, mean_x = 0.0;
        for (int64_t i = 162 * part; i < 162 * (part + 1); ++i) {
            mean_b += b[i] / 162.0;
            mean_x += x[i] / 162.0;
        }
        CHECK_NEAR(mean_x, 0.0, 1e-13);
        for (int64_t i = 162 * part; i < 162 * (part + 1); ++i)
            CHECK_NEAR(ax[i], b[i] - mean_b, 1e-11); /* 1e-12 of |b|, about 5 */
    }
    CHECK_EQUAL(x[n - 1], 0.0);
    loxo_release(test_context, b);
    loxo_release(test_context, x);
    loxo_release(test_context, ax);
    loxo_csr_destroy(test_context, &a);
    surface_destroy(&s);
}

/* On a flat mesh with its rim pinned to a linear function, the harmonic function is that one. */
TEST(pinned_rim_gives_the_linear_function)
{
    surface s = surface_make(test_context, LOXO_SHAPE_DISK, 400, NAN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    const int64_t n = m.n_vertices;
    loxo_csr a;
    CHECK_OK(loxo_laplacian_create(test_context, &m, &a, NULL));
    double *known = zero_vector(test_context, n), *b = zero_vector(test_context, n), *x = zero_vector(test_context, n);
    bool *is_rim = loxo_allocate(test_context, n, sizeof *is_rim);
    for (int64_t v = 0; v < n; ++v) {
        is_rim[v] = m.halfedge_twin[m.vertex_halfedge[v]] < 0;
        if (is_rim[v]) known[v] = m.position[v][0] + 2.0 * m.position[v][1];
    }
    loxo_csr_multiply(test_context, &a, known, b);
    for (int64_t v = 0; v < n; ++v)
        b[v] = is_rim[v] ? known[v] : -b[v];
    loxo_csr_pin(test_context, &a, is_rim);
    CHECK_OK(loxo_csr_check(test_context, &a));
    solve(test_context, &a, b, x, LOXO_OK);
    for (int64_t v = 0; v < n; ++v)
        CHECK_NEAR(x[v], m.position[v][0] + 2.0 * m.position[v][1], 1e-10);
    loxo_release(test_context, known);
    loxo_release(test_context, b);
    loxo_release(test_context, x);
    loxo_release(test_context, is_rim);
    loxo_csr_destroy(test_context, &a);
    surface_destroy(&s);
}

TEST(zero_right_side_and_bad_numbers)
{
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_ICOSPHERE, 42, NULL);
    double *b = zero_vector(test_context, 42), *x = random_vector(test_context, 42, 1);
    loxo_cg_info info = solve(test_context, &a, b, x, LOXO_OK);
    CHECK_EQUAL(info.n_iterations, 0);
    CHECK_EQUAL(x[7], 0.0);
    b[3] = 1.0; /* constants alone are no right side, either */
    for (int i = 0; i < 42; ++i)
        b[i] = 1.0;
    info = solve(test_context, &a, b, x, LOXO_OK);
    CHECK_NEAR(info.inconsistent, 1.0, 1e-12);
    CHECK_NEAR(x[7], 0.0, 1e-12);
    b[3] = NAN;
    solve(test_context, &a, b, x, LOXO_ERR_NUMERIC);
    b[3] = INFINITY;
    solve(test_context, &a, b, x, LOXO_ERR_NUMERIC);
    b[3] = 2.0;
    x[5] = INFINITY;
    solve(test_context, &a, b, x, LOXO_ERR_NUMERIC);
    x[5] = 0.0;
    loxo_csr_scale_shift(test_context, &a, 0x1p-300, NULL);
    for (int i = 0; i < 42; ++i)
        b[i] = i % 2 == 0 ? 0x1p800 : -0x1p800; /* the solution is of the order of 2^1100 */
    solve(test_context, &a, b, x, LOXO_ERR_NUMERIC);
    loxo_release(test_context, b);
    loxo_release(test_context, x);
    loxo_csr_destroy(test_context, &a);
}

/* Squares of its entries overflow or vanish; a power of two changes no bit but those of exponents. */
TEST(solutions_scale_with_the_right_side)
{
    static const int exponents[] = {-900, -540, 3, 540, 900};
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_BUMPY, 642, NULL);
    const int64_t n = a.n_rows;
    double *b = random_vector(test_context, n, 4), *scaled = zero_vector(test_context, n);
    double *x = zero_vector(test_context, n), *y = zero_vector(test_context, n);
    const loxo_cg_info info = solve(test_context, &a, b, x, LOXO_OK);
    for (int k = 0; k < 5; ++k) {
        for (int64_t i = 0; i < n; ++i) {
            scaled[i] = ldexp(b[i], exponents[k]);
            y[i] = 0.0;
        }
        const loxo_cg_info other = solve(test_context, &a, scaled, y, LOXO_OK);
        CHECK_EQUAL(other.n_iterations, info.n_iterations);
        CHECK_EQUAL(other.residual, info.residual);
        CHECK_EQUAL(other.inconsistent, info.inconsistent);
        for (int64_t i = 0; i < n; ++i)
            CHECK_EQUAL(y[i], ldexp(x[i], exponents[k]));
    }
    for (int64_t i = 0; i < n; ++i) { /* near the least number of all: no digits are left, but neither does it fail */
        scaled[i] = i % 2 == 0 ? 5e-324 : -5e-324;
        y[i] = 0.0;
    }
    loxo_cg *cg;
    loxo_diagonal diagonal = {test_context, &a};
    const loxo_preconditioner m = {loxo_diagonal_apply, &diagonal};
    CHECK_OK(loxo_cg_create(test_context, &a, &cg));
    CHECK(loxo_cg_solve(cg, &m, NULL, scaled, y, NULL) >= 0);
    for (int64_t i = 0; i < n; ++i)
        CHECK(fabs(y[i]) < 1e-300);
    loxo_cg_destroy(cg);
    loxo_release(test_context, b);
    loxo_release(test_context, scaled);
    loxo_release(test_context, x);
    loxo_release(test_context, y);
    loxo_csr_destroy(test_context, &a);
}

TEST(indefinite_matrix_is_noticed)
{
    const double dense[4] = {1, 3, 3, 1}; /* eigenvalues 4 and -2 */
    const double b[2] = {1, -1};
    double x[2] = {0, 0};
    loxo_csr a = matrix_of_dense(test_context, 2, dense);
    CHECK_EQUAL(solve(test_context, &a, b, x, LOXO_NOT_CONVERGED).stop_reason, LOXO_CG_INDEFINITE);
    loxo_csr_destroy(test_context, &a);
}

TEST(bad_matrices_are_named)
{
    double dense[9] = {2, -1, 0, -1, 2, -1, 0, -1, 2};
    loxo_csr a = matrix_of_dense(test_context, 3, dense);
    CHECK_OK(loxo_csr_check(test_context, &a));
    a.value[0] = -2.0; /* not symmetric */
    CHECK_STATUS(test_context, loxo_csr_check(test_context, &a), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 0);
    a.value[0] = -1.0;
    a.column[3] = 3;
    CHECK_STATUS(test_context, loxo_csr_check(test_context, &a), LOXO_ERR_ARGUMENT);
    a.column[3] = -1;
    CHECK_STATUS(test_context, loxo_csr_check(test_context, &a), LOXO_ERR_ARGUMENT);
    a.column[3] = 1;
    a.column[1] = 2;
    a.column[2] = 0; /* descending */
    CHECK_STATUS(test_context, loxo_csr_check(test_context, &a), LOXO_ERR_ARGUMENT);
    a.column[1] = 0;
    a.column[2] = 2;
    a.diagonal[1] = -1.0;
    CHECK_STATUS(test_context, loxo_csr_check(test_context, &a), LOXO_ERR_ARGUMENT);
    a.diagonal[1] = NAN;
    CHECK_STATUS(test_context, loxo_csr_check(test_context, &a), LOXO_ERR_ARGUMENT);
    a.diagonal[1] = 2.0;
    a.begin[1] = 7;
    CHECK_STATUS(test_context, loxo_csr_check(test_context, &a), LOXO_ERR_ARGUMENT);
    a.begin[1] = 1;
    CHECK_OK(loxo_csr_check(test_context, &a));
    loxo_csr_destroy(test_context, &a);
}

static int stop_at_once(void *user, const loxo_progress *progress)
{
    (void)user;
    return progress->iteration >= 0;
}

TEST(monitor_stops_it_and_the_count_ends_it)
{
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_ICOSPHERE, 642, NULL);
    double *b = random_vector(test_context, a.n_rows, 2), *x = zero_vector(test_context, a.n_rows);
    loxo_diagonal diagonal = {test_context, &a};
    const loxo_preconditioner m = {loxo_diagonal_apply, &diagonal};
    const loxo_cg_settings settings = {.tolerance = 1e-8, .max_iterations = 3};
    loxo_cg_info info;
    loxo_cg *cg;
    CHECK_OK(loxo_cg_create(test_context, &a, &cg));
    CHECK_STATUS(test_context, loxo_cg_solve(cg, &m, &settings, b, x, &info), LOXO_NOT_CONVERGED);
    CHECK_EQUAL(info.n_iterations, 3);
    CHECK(info.stop_reason == LOXO_CG_MAX_ITERATIONS && info.residual > 1e-8 && info.residual < 10.0);
    loxo_context_set_monitor(test_context, stop_at_once, NULL);
    loxo_progress_begin(test_context);
    CHECK_STATUS(test_context, loxo_cg_solve(cg, &m, NULL, b, x, &info), LOXO_STOPPED);
    CHECK_EQUAL(info.stop_reason, LOXO_CG_MONITOR);
    loxo_context_set_monitor(test_context, NULL, NULL);
    loxo_cg_destroy(cg);
    loxo_release(test_context, b);
    loxo_release(test_context, x);
    loxo_csr_destroy(test_context, &a);
}

static loxo_status create(loxo_context *ctx, void *arg)
{
    loxo_cg *cg;
    const loxo_status status = loxo_cg_create(ctx, arg, &cg);
    loxo_cg_destroy(cg);
    return status;
}

TEST(each_allocation_may_fail)
{
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_ICOSPHERE, 162, NULL);
    CHECK(test_each_allocation_fails(create, &a) >= 6);
    loxo_csr_destroy(test_context, &a);
}
