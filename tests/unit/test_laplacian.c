/* SPDX-License-Identifier: MIT
 * The cotangent matrix and the lumped areas. */
#include "base/allocate.h"
#include "kernel/laplacian_kernel.h"
#include "shapes.h"
#include "solver/dense.h"
#include "unit/matrices.h"

#include <float.h>

static loxo_csr matrix_of(loxo_context *ctx, const surface *s, double *mass)
{
    const loxo_mesh_view m = loxo_mesh_get_view(s->mesh);
    loxo_csr a;
    CHECK_STATUS(ctx, loxo_laplacian_create(ctx, &m, &a, mass), LOXO_OK);
    CHECK_STATUS(ctx, loxo_csr_check(ctx, &a), LOXO_OK);
    return a;
}

TEST(entries_are_those_of_the_dense_matrix)
{
    static const loxo_shape shapes[] = {LOXO_SHAPE_BUMPY, LOXO_SHAPE_DISK, LOXO_SHAPE_ANNULUS, LOXO_SHAPE_TORUS};
    for (int k = 0; k < 4; ++k) {
        surface s = surface_from_soup(test_context, soup_make(test_context, shapes[k], 60, NAN), LOXO_ORDER_GIVEN);
        const int64_t n = s.soup.n_vertices;
        double *mass = loxo_allocate(test_context, n, sizeof *mass);
        long double *c = malloc((size_t)(n * n) * sizeof *c), *areas = malloc((size_t)(n * n) * sizeof *areas);
        loxo_csr a = matrix_of(test_context, &s, mass);
        dense_matrix(&s.arrays, 0.0L, 1.0L, c);
        dense_matrix(&s.arrays, 1.0L, 0.0L, areas);
        for (int64_t i = 0; i < n; ++i) {
            double *e = zero_vector(test_context, n), *row = zero_vector(test_context, n);
            e[i] = 1.0;
            loxo_csr_multiply(test_context, &a, e, row);
            for (int64_t j = 0; j < n;
                 ++j) /* rounding of lengths, twice a subtraction of squares: condition below 1e3 */
                CHECK_NEAR(row[j], (double)c[i * n + j], 1e-11);
            CHECK_NEAR(mass[i], (double)areas[i * n + i], 1e-13);
            loxo_release(test_context, e);
            loxo_release(test_context, row);
        }
        free(c);
        free(areas);
        loxo_csr_destroy(test_context, &a);
        loxo_release(test_context, mass);
        surface_destroy(&s);
    }
}

TEST(rows_sum_to_zero_and_areas_to_the_area)
{
    double *mass, sum = 0.0, worst = 0.0;
    loxo_csr a = matrix_of_shape(test_context, LOXO_SHAPE_ICOSPHERE, 5000, &mass);
    for (int64_t i = 0; i < a.n_rows; ++i) {
        double row = a.diagonal[i];
        for (int64_t k = a.begin[i]; k < a.begin[i + 1]; ++k)
            row += a.value[k];
        worst = fmax(worst, fabs(row));
        sum += mass[i];
    }
    CHECK(worst <= 8 * DBL_EPSILON * 4.0); /* seven additions of numbers below 4 */
    CHECK_NEAR(sum, 4.0 * 3.14159265358979, 0.02);
    loxo_csr_destroy(test_context, &a);
    loxo_release(test_context, mass);
}

/* u . C u is the integral of |grad u|^2, which for u linear on a flat mesh of area 1 is |grad u|^2. */
TEST(energy_of_a_linear_function)
{
    surface s = surface_make(test_context, LOXO_SHAPE_GRID, 900, NAN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    const int64_t n = m.n_vertices;
    loxo_csr a = matrix_of(test_context, &s, NULL);
    double *u = zero_vector(test_context, n), *cu = zero_vector(test_context, n);
    for (int64_t v = 0; v < n; ++v)
        u[v] = 2.0 * m.position[v][0] - 3.0 * m.position[v][1];
    loxo_csr_multiply(test_context, &a, u, cu);
    CHECK_NEAR(dot_product(n, u, cu), 13.0, 1e-11); /* rounding of some 1e4 operations */
    for (int64_t v = 0; v < n; ++v) {               /* linear functions are harmonic inside: linear precision */
        bool is_inside = m.halfedge_twin[m.vertex_halfedge[v]] >= 0;
        if (is_inside) CHECK_NEAR(cu[v], 0.0, 1e-12);
    }
    loxo_release(test_context, u);
    loxo_release(test_context, cu);
    loxo_csr_destroy(test_context, &a);
    surface_destroy(&s);
}

TEST(lengths_alone_give_the_same_bits)
{
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 500, NAN);
    loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    double *length = loxo_allocate(test_context, 3 * m.n_faces, sizeof *length);
    for (int64_t f = 0; f < m.n_faces; ++f)
        k_face_lengths(&m, f, length + 3 * f);
    loxo_csr a = matrix_of(test_context, &s, NULL), b;
    m.halfedge_length = length;
    m.position = NULL;
    CHECK_OK(loxo_laplacian_create(test_context, &m, &b, NULL));
    CHECK_EQUAL(a.begin[a.n_rows], b.begin[b.n_rows]);
    CHECK(memcmp(a.value, b.value, (size_t)a.begin[a.n_rows] * sizeof *a.value) == 0);
    CHECK(memcmp(a.diagonal, b.diagonal, (size_t)a.n_rows * sizeof *a.diagonal) == 0);
    loxo_csr_destroy(test_context, &a);
    loxo_csr_destroy(test_context, &b);
    loxo_release(test_context, length);
    surface_destroy(&s);
}

/* A flat torus of two unit squares in a row, each cut along a diagonal: vertices 0 and 1 are joined by two straight edges
 * of weight 1 and two diagonals of weight 0, and each to itself by one edge. */
TEST(several_edges_and_loops)
{
    const double d = sqrt(2.0);
    /* Square q has corners q and 1 - q below and above; faces (q, other, other above), (q, other above, q above). */
    const loxo_index start[12] = {0, 1, 1, 0, 1, 0, 1, 0, 0, 1, 0, 1};
    const loxo_index twin[12] = {4, 11, 3, 2, 0, 7, 10, 5, 9, 8, 6, 1};
    const double length[12] = {1, 1, d, d, 1, 1, 1, 1, d, d, 1, 1};
    const loxo_index out[2] = {0, 6};
    const loxo_mesh_view m = {.n_vertices = 2,
                              .n_faces = 4,
                              .halfedge_vertex = start,
                              .halfedge_twin = twin,
                              .vertex_halfedge = out,
                              .halfedge_length = length};
    double mass[2];
    loxo_csr a;
    CHECK_OK(loxo_laplacian_create(test_context, &m, &a, mass));
    CHECK_OK(loxo_csr_check(test_context, &a));
    CHECK_EQUAL(a.begin[2], 2);
    for (int i = 0; i < 2; ++i) {
        CHECK_EQUAL(a.column[i], 1 - i);
        CHECK_NEAR(a.value[i], -2.0, 1e-14);
        CHECK_NEAR(a.diagonal[i], 2.0, 1e-14);
        CHECK_NEAR(mass[i], 1.0, 1e-15);
    }
    loxo_csr_destroy(test_context, &a);
}

/* Needles, caps and points: weights are bounded, the energy is never negative. */
TEST(faces_without_area_stay_finite)
{
    static const double shapes[][3] = {{1, 1, 2},
                                       {1, 1, 1e-300},
                                       {0, 0, 0},
                                       {2, 1, 1 - 1e-17},
                                       {1, 1, 2 - 1e-9},
                                       {3, 1, 1},
                                       {1e-200, 1e-200, 1e-200},
                                       {1e150, 1e150, 1e130},
                                       {1, 1, 1e-12},
                                       {5e-324, 5e-324, 5e-324}};
    for (size_t k = 0; k < sizeof shapes / sizeof shapes[0]; ++k) {
        double w[3];
        const double area = k_face_weights(shapes[k], w);
        CHECK(area >= 0.0 && isfinite(area));
        for (int i = 0; i < 3; ++i)
            CHECK(fabs(w[i]) <= 0.5 / K_LEAST_FLATNESS);
        /* w0 x^2 + w1 y^2 + w2 (x + y)^2 >= 0 for all x, y: a sum >= 0 and a determinant >= 0, but for rounding. */
        const double most = fmax(fabs(w[0]), fmax(fabs(w[1]), fabs(w[2])));
        if (shapes[k][0] > 2.5) continue; /* no triangle at all, not even by rounding */
        CHECK(w[0] + w[2] >= -1e-14 * most && w[1] + w[2] >= -1e-14 * most);
        CHECK(w[0] * w[1] + w[1] * w[2] + w[2] * w[0] >= -1e-14 * most * most);
    }
}

TEST(vertices_without_faces_have_empty_rows)
{
    loxo_soup soup = shape_empty(test_context, 5, 1);
    memset(soup.position, 0, 15 * sizeof *soup.position);
    soup.position[3 * 1] = soup.position[3 * 3 + 1] = 1.0;
    soup.triangle[0] = 0;
    soup.triangle[1] = 1;
    soup.triangle[2] = 3;
    surface s = surface_from_soup(test_context, soup, LOXO_ORDER_GIVEN);
    double mass[5];
    loxo_csr a = matrix_of(test_context, &s, mass);
    CHECK_EQUAL(a.begin[3] - a.begin[2], 0);
    CHECK_EQUAL(a.diagonal[2], 0.0);
    CHECK_EQUAL(mass[4], 0.0);
    CHECK_NEAR(mass[0], 1.0 / 6.0, 1e-16);
    CHECK_NEAR(a.diagonal[0], 1.0, 1e-15);
    loxo_csr_destroy(test_context, &a);
    surface_destroy(&s);
}

static loxo_status make(loxo_context *ctx, void *arg)
{
    loxo_csr a;
    double *mass = loxo_allocate(ctx, ((loxo_mesh_view *)arg)->n_vertices, sizeof *mass);
    const loxo_status status = mass == NULL ? LOXO_ERR_MEMORY : loxo_laplacian_create(ctx, arg, &a, mass);
    if (status >= 0) loxo_csr_destroy(ctx, &a);
    loxo_release(ctx, mass);
    return status;
}

TEST(each_allocation_may_fail)
{
    surface s = surface_make(test_context, LOXO_SHAPE_DISK, 200, NAN);
    loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    CHECK(test_each_allocation_fails(make, &m) >= 7);
    surface_destroy(&s);
}

TEST(any_number_of_threads_gives_the_same_bits)
{
    static const int ladder[] = {1, 2, 3, 7};
    uint64_t hash[4];
    NEEDS_IDS(60000 * 3);
    surface s = surface_make(test_context, LOXO_SHAPE_BUMPY, 20000, NAN);
    const loxo_mesh_view m = loxo_mesh_get_view(s.mesh);
    for (int k = 0; k < 4; ++k) {
        loxo_context *ctx = test_context_with_threads(ladder[k]);
        double *x = random_vector(ctx, m.n_vertices, 4), *y = zero_vector(ctx, m.n_vertices);
        loxo_csr a;
        CHECK_STATUS(ctx, loxo_laplacian_create(ctx, &m, &a, NULL), LOXO_OK);
        loxo_csr_multiply(ctx, &a, x, y);
        hash[k] = test_hash(a.value, (size_t)a.begin[a.n_rows] * sizeof *a.value) ^
                  test_hash(y, (size_t)a.n_rows * sizeof *y);
        loxo_csr_destroy(ctx, &a);
        loxo_release(ctx, x);
        loxo_release(ctx, y);
        loxo_context_destroy(ctx);
        CHECK(hash[k] == hash[0]);
    }
    surface_destroy(&s);
}
