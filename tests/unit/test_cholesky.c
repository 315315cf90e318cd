/* SPDX-License-Identifier: MIT
 * Sparse Cholesky factors; skipped where the build has no CHOLMOD. */
#include "algebra/cg.h"
#include "algebra/cholesky.h"
#include "algebra/multigrid.h"
#include "unit/matrices.h"

static void needs_cholmod(void)
{
    const double one[1] = {1.0};
    loxo_cholesky *c;
    if (loxo_cholesky_is_there()) return;
    loxo_csr a = matrix_of_dense(test_context, 1, one);
    CHECK_STATUS(test_context, loxo_cholesky_create(test_context, &a, NULL, &c), LOXO_ERR_UNSUPPORTED);
    CHECK(c == NULL);
    loxo_cholesky_destroy(c);
    loxo_csr_destroy(test_context, &a);
    SKIP();
}

TEST(agrees_with_conjugate_gradients)
{
    double *mass;
    needs_cholmod();
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_BUMPY, 5000, &mass);
    loxo_csr_scale_shift(test_context, &a, 1.0, mass);
    const int64_t n = a.n_rows;
    double *b = random_vector(test_context, n, 9), *x = zero_vector(test_context, n), *y = zero_vector(test_context, n);
    loxo_cholesky_info info;
    loxo_cholesky *c;
    CHECK_OK(loxo_cholesky_create(test_context, &a, &info, &c));
    CHECK(info.n_entries > 3.0 * (double)n && info.factor_bytes > 8 * (size_t)info.n_entries && info.n_flops > 0.0);
    CHECK_OK(loxo_cholesky_factor(c, &a));
    CHECK_OK(loxo_cholesky_solve(c, b, x));
    loxo_multigrid *mg;
    loxo_cg *cg;
    loxo_cg_settings settings = loxo_cg_settings_default();
    settings.tolerance = 1e-13;
    CHECK_OK(loxo_multigrid_create(test_context, &a, NULL, &mg));
    CHECK_OK(loxo_cg_create(test_context, &a, &cg));
    const loxo_preconditioner m = {loxo_multigrid_apply, mg};
    CHECK_OK(loxo_cg_solve(cg, &m, &settings, b, y, NULL));
    double most = 0.0, apart = 0.0;
    for (int64_t i = 0; i < n; ++i) {
        most = fmax(most, fabs(x[i]));
        apart = fmax(apart, fabs(x[i] - y[i]));
    }
    CHECK(apart <= 1e-10 * most); /* residual 1e-13 times a condition of some 1e3 */
    /* Again with other values of the same entries; in place. */
    loxo_csr_scale_shift(test_context, &a, 2.0, NULL);
    CHECK_OK(loxo_cholesky_factor(c, &a));
    CHECK_OK(loxo_cholesky_solve(c, b, b));
    for (int64_t i = 0; i < n; ++i)
        CHECK_NEAR(b[i], 0.5 * x[i], 1e-11 * most);
    loxo_cg_destroy(cg);
    loxo_multigrid_destroy(mg);
    loxo_cholesky_destroy(c);
    loxo_release(test_context, b);
    loxo_release(test_context, x);
    loxo_release(test_context, y);
    loxo_release(test_context, mass);
    loxo_csr_destroy(test_context, &a);
}

/* Of a small matrix, which gets columns one by one, and of one with supernodes. */
TEST(entries_of_the_inverse)
{
    static const int64_t sizes[] = {60, 40000};
    needs_cholmod();
    for (int k = 0; k < 2; ++k) {
        double *mass;
        NEEDS_IDS(6 * sizes[k]);
        loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_BUMPY, sizes[k], &mass);
        loxo_csr_scale_shift(test_context, &a, 1.0, mass);
        const int64_t n = a.n_rows;
        const loxo_index variable[5] = {3, 0, (loxo_index)(n - 1), 17, 18};
        const int64_t begin[3] = {0, 4, 5}; /* four together, and one */
        double *x = zero_vector(test_context, n), inverse[11];
        loxo_cholesky *c;
        CHECK_OK(loxo_cholesky_create(test_context, &a, NULL, &c));
        CHECK_OK(loxo_cholesky_factor(c, &a));
        CHECK_OK(loxo_cholesky_inverse(c, 2, begin, variable, inverse));
        const double *from = inverse;
        for (int64_t i = 0; i < 5; ++i) {
            memset(x, 0, (size_t)n * sizeof *x);
            x[variable[i]] = 1.0;
            CHECK_OK(loxo_cholesky_solve(c, x, x));
            for (int64_t j = i < 4 ? 0 : 4; j <= i; ++j) /* rounding, of numbers up to 1 */
                CHECK_NEAR(*from++, x[variable[j]], 1e-13);
        }
        loxo_cholesky_destroy(c);
        loxo_release(test_context, x);
        loxo_release(test_context, mass);
        loxo_csr_destroy(test_context, &a);
    }
}

TEST(what_is_not_definite_is_refused)
{
    needs_cholmod();
    const double dense[9] = {1, 3, 0, 3, 1, 0, 0, 0, 0}; /* eigenvalues 4 and -2, and a variable that is not there */
    const double good[9] = {4, 3, 0, 3, 4, 0, 0, 0, 0};
    loxo_csr a = matrix_of_dense(test_context, 3, dense), b = matrix_of_dense(test_context, 3, good);
    double x[3] = {7, 7, 0};
    loxo_cholesky *c;
    CHECK_OK(loxo_cholesky_create(test_context, &a, NULL, &c));
    CHECK_STATUS(test_context, loxo_cholesky_factor(c, &a), LOXO_ERR_NUMERIC);
    CHECK(loxo_context_failure(test_context)->element >= 0 && loxo_context_failure(test_context)->element < 2);
    CHECK_OK(loxo_cholesky_factor(c, &b));
    CHECK_OK(loxo_cholesky_solve(c, x, x));
    CHECK_NEAR(x[0], 1.0, 1e-14);
    CHECK_NEAR(x[1], 1.0, 1e-14);
    CHECK_EQUAL(x[2], 0.0);
    loxo_cholesky_destroy(c);
    loxo_csr_destroy(test_context, &a);
    loxo_csr_destroy(test_context, &b);
}

TEST(indefinite_matrices_have_pivots_of_both_signs)
{
    needs_cholmod();
    const double dense[16] = {1, 3, 0, 0, 3, 1, 2, 0, 0, 2, -5, 0, 0, 0, 0, 0}; /* the last variable is not there */
    loxo_csr a = matrix_of_dense(test_context, 4, dense);
    const double b[4] = {1.0, -2.0, 3.0, 0.0};
    double x[4], y[4];
    loxo_cholesky *c;
    CHECK_OK(loxo_cholesky_create_indefinite(test_context, &a, -1, NULL, &c));
    for (int round = 0; round < 2; ++round) { /* again with the same object */
        CHECK_OK(loxo_cholesky_factor(c, &a));
        CHECK_OK(loxo_cholesky_solve(c, b, x));
        for (int i = 0; i < 3; ++i) {
            y[i] = 0.0;
            for (int j = 0; j < 3; ++j)
                y[i] += dense[4 * i + j] * x[j];
            CHECK_NEAR(y[i], b[i], 1e-14);
        }
        CHECK_EQUAL(x[3], 0.0);
    }
    loxo_cholesky_destroy(c);
    /* The first variable is known: its row and column do not count. */
    CHECK_OK(loxo_cholesky_create_indefinite(test_context, &a, 0, NULL, &c));
    CHECK_OK(loxo_cholesky_factor(c, &a));
    CHECK_OK(loxo_cholesky_solve(c, b, x));
    CHECK_NEAR(x[0], 1.0, 1e-15);
    CHECK_NEAR(x[1] + 2.0 * x[2], -2.0, 1e-14);
    CHECK_NEAR(2.0 * x[1] - 5.0 * x[2], 3.0, 1e-14);
    loxo_cholesky_destroy(c);
    loxo_csr_destroy(test_context, &a);
}

/* A sphere's Laplacian less a multiple of its masses: eigenvalues k (k + 1) - 25 on both sides of 0, none near it. */
TEST(an_indefinite_matrix_of_a_mesh)
{
    double *mass;
    needs_cholmod();
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_ICOSPHERE, 5000, &mass);
    const int64_t n = a.n_rows;
    for (int64_t i = 0; i < n; ++i)
        mass[i] *= -25.0;
    loxo_csr_scale_shift(test_context, &a, 1.0, mass);
    double *b = random_vector(test_context, n, 9), *x = zero_vector(test_context, n), *y = zero_vector(test_context, n);
    double most = 0.0;
    loxo_cholesky *c;
    CHECK_OK(loxo_cholesky_create_indefinite(test_context, &a, -1, NULL, &c));
    CHECK_OK(loxo_cholesky_factor(c, &a));
    CHECK_OK(loxo_cholesky_solve(c, b, x));
    loxo_csr_multiply(test_context, &a, x, y);
    for (int64_t i = 0; i < n; ++i)
        most = fmax(most, fabs(x[i]));
    for (int64_t i = 0; i < n; ++i)
        CHECK_NEAR(y[i], b[i], 1e-10 * most); /* rounding times what pivots that are small let grow */
    loxo_cholesky_destroy(c);
    CHECK_OK(loxo_cholesky_create(test_context, &a, NULL, &c));
    CHECK_STATUS(test_context, loxo_cholesky_factor(c, &a), LOXO_ERR_NUMERIC); /* as a definite one it is none */
    loxo_cholesky_destroy(c);
    loxo_release(test_context, b);
    loxo_release(test_context, x);
    loxo_release(test_context, y);
    loxo_release(test_context, mass);
    loxo_csr_destroy(test_context, &a);
}

TEST(a_pivot_of_zero_is_told)
{
    needs_cholmod();
    const double dense[4] = {1, 1, 1, 1};
    loxo_csr a = matrix_of_dense(test_context, 2, dense);
    loxo_cholesky *c;
    CHECK_OK(loxo_cholesky_create_indefinite(test_context, &a, -1, NULL, &c));
    CHECK_STATUS(test_context, loxo_cholesky_factor(c, &a), LOXO_ERR_NUMERIC);
    CHECK(strstr(loxo_context_failure(test_context)->text, "singular") != NULL);
    loxo_cholesky_destroy(c);
    loxo_csr_destroy(test_context, &a);
}

TEST(a_factor_over_the_limit_is_refused_before_it_is_made)
{
    needs_cholmod();
    loxo_context_settings settings = loxo_context_settings_default();
    loxo_context *ctx;
    loxo_cholesky_info info;
    loxo_cholesky *c;
    settings.memory_limit_bytes = 2000000;
    CHECK_OK(loxo_context_create(&settings, &ctx));
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_BUMPY, 5000, NULL);
    CHECK_STATUS(ctx, loxo_cholesky_create(ctx, &a, &info, &c), LOXO_ERR_MEMORY);
    CHECK(c == NULL && info.factor_bytes > settings.memory_limit_bytes);
    CHECK_EQUAL(loxo_context_memory(ctx).current_bytes, 0);
    loxo_csr_destroy(test_context, &a);
    loxo_context_destroy(ctx);
}
