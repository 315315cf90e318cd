/* SPDX-License-Identifier: MIT */
#include "../test.h"
#include "kernel/gradient_kernel.h"

#include <loxo/loxo.h>

TEST(gradient_of_a_linear_function_is_its_slope)
{
    /* u = a . x + 5 on a triangle: the gradient is a less its part along the normal. */
    const double p[9] = {0.3, -1.0, 0.2, 1.5, 0.1, -0.4, -0.2, 0.9, 1.1}, a[3] = {2.0, -3.0, 0.5};
    double u[3], gradient[3], normal[3], unused[3], expected[3];
    for (int64_t c = 0; c < 3; ++c)
        u[c] = a[0] * p[3 * c] + a[1] * p[3 * c + 1] + a[2] * p[3 * c + 2] + 5.0;
    const double double_area = k_triangle_gradient(p, u, gradient);
    k_gradient_parts(p, u, normal, unused);
    const double along = (a[0] * normal[0] + a[1] * normal[1] + a[2] * normal[2]) / (double_area * double_area);
    for (int k = 0; k < 3; ++k)
        expected[k] = a[k] - along * normal[k];
    CHECK_NEAR3(gradient, expected, 1e-14); /* rounding of some 20 operations on numbers near 1 */
    CHECK_NEAR(k_triangle_area(p), 0.5 * double_area, 0.0);
    const double flat[9] = {0, 0, 0, 1, 1, 1, 2, 2, 2};
    CHECK_EQUAL(k_triangle_gradient(flat, u, gradient), 0.0);
    CHECK_NEAR3(gradient, ((double[3]){0, 0, 0}), 0.0);
}

TEST(heat_falls_in_the_same_direction_at_every_magnitude)
{
    const double value[3] = {0.9, 0.31, 0.47};
    const int32_t none[3] = {0, 0, 0};
    double h[3], scaled_h[3];
    for (int i = -3; i <= 3; ++i) { /* lengths of 1e-60 to 1e60: their fifth powers leave the doubles */
        const double size = pow(10.0, 20.0 * i);
        const double p[9] = {0, 0, 0, size, 0, 0, 0.3 * size, 0.8 * size, 0};
        const int32_t deep[3] = {-2000000000, -2000000000, -2000000001};
        const double same[3] = {0.9, 0.31, 0.94};
        CHECK(k_heat_direction(p, value, none, h));
        CHECK_NEAR(h[0] * h[0] + h[1] * h[1] + h[2] * h[2], 1.0, 1e-15);
        CHECK(h[0] > 0.0); /* warmer at corner 0: heat falls towards +x */
        CHECK(k_heat_direction(p, same, deep, scaled_h));
        CHECK_NEAR3(h, scaled_h, 0.0);
    }
    const double p[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const int32_t apart[3] = {0, -100000, INT32_MIN}, ends[3] = {INT32_MAX, INT32_MIN, INT32_MIN};
    CHECK(k_heat_direction(p, value, apart, h)); /* as if the other two were 0 */
    CHECK_NEAR3(h, ((double[3]){sqrt(0.5), sqrt(0.5), 0}), 1e-15);
    CHECK(k_heat_direction(p, value, ends, h));
    CHECK_NEAR3(h, ((double[3]){sqrt(0.5), sqrt(0.5), 0}), 1e-15);
    const double equal[3] = {0.5, 0.5, 0.5}, cold[3] = {0, 0, 0}, bad[3] = {0.5, (double)NAN, 0.1};
    CHECK(!k_heat_direction(p, equal, none, h));
    CHECK(!k_heat_direction(p, cold, none, h));
    CHECK(!k_heat_direction(p, bad, none, h));
    CHECK_NEAR3(h, ((double[3]){0, 0, 0}), 0.0);
}

TEST(distance_errors_by_hand)
{
    const double reference[8] = {0.0, 1.0, 2.0, 4.0, INFINITY, INFINITY, 1.0, 2.0};
    const double distance[8] = {0.0, 1.1, 1.8, 4.0, INFINITY, 3.0, (double)NAN, 2.5};
    loxo_distance_error e;
    CHECK_OK(loxo_measure_distance_error(test_context, distance, reference, 8, &e));
    CHECK_EQUAL(e.n_compared, 5);
    CHECK_EQUAL(e.n_mismatched, 2);
    CHECK_NEAR(e.mean_relative, (0.0 + 0.1 + 0.1 + 0.0 + 0.25) / 5.0, 1e-15);
    CHECK_NEAR(e.max_relative, 0.25, 1e-15);
    CHECK_NEAR(e.max_absolute, 0.5, 1e-15);
    CHECK_OK(loxo_measure_distance_error(test_context, NULL, NULL, 0, &e));
    CHECK_EQUAL(e.n_compared, 0);
    CHECK_EQUAL(e.mean_relative, 0.0);
    CHECK_STATUS(test_context, loxo_measure_distance_error(test_context, NULL, reference, 8, &e), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_measure_distance_error(test_context, distance, reference, 8, NULL),
                 LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_measure_distance_error(test_context, distance, reference, -1, &e),
                 LOXO_ERR_ARGUMENT);
}

/* A flat grid of n by n cells. */
static loxo_mesh_arrays make_grid(int n, double **positions, loxo_index **triangles)
{
    double *position = malloc((size_t)(n + 1) * (size_t)(n + 1) * 24);
    loxo_index *triangle = malloc((size_t)n * (size_t)n * 6 * sizeof *triangle);
    CHECK(position != NULL && triangle != NULL);
    for (int64_t i = 0; i <= n; ++i)
        for (int64_t j = 0; j <= n; ++j)
            memcpy(&position[3 * (i * (n + 1) + j)], (double[3]){(double)j / n, (double)i / n, 0.0}, 24);
    *positions = position, *triangles = triangle;
    int64_t f = 0;
    for (int64_t i = 0; i < n; ++i)
        for (int64_t j = 0; j < n; ++j) {
            const loxo_index a = (loxo_index)(i * (n + 1) + j), b = (loxo_index)(a + 1), c = (loxo_index)(a + n + 1);
            const loxo_index both[6] = {a, b, (loxo_index)(c + 1), a, (loxo_index)(c + 1), c};
            memcpy(&triangle[6 * f++], both, sizeof both);
        }
    return (loxo_mesh_arrays){.n_vertices = (int64_t)(n + 1) * (n + 1),
                              .n_faces = (int64_t)2 * n * n,
                              .position = position,
                              .triangle = triangle};
}

TEST(directions_that_differ_by_an_angle_have_that_chord)
{
    double *positions;
    loxo_index *triangles;
    const loxo_mesh_arrays grid = make_grid(100, &positions, &triangles);
    double *a = malloc((size_t)grid.n_vertices * 8), *b = malloc((size_t)grid.n_vertices * 8);
    int32_t *scale = malloc((size_t)grid.n_vertices * 4);
    double error, one_thread = -1.0;
    const double angle = 0.3;
    for (int64_t v = 0; v < grid.n_vertices; ++v) {
        const double *p = &grid.position[3 * v];
        a[v] = 3.0 - p[0];
        b[v] = 7.0 - 2.0 * (cos(angle) * p[0] + sin(angle) * p[1]);
        scale[v] = -5000;
    }
    CHECK_OK(loxo_measure_direction_error(test_context, &grid, a, NULL, a, NULL, &error));
    CHECK_EQUAL(error, 0.0);
    CHECK_OK(loxo_measure_direction_error(test_context, &grid, a, scale, a, NULL, &error)); /* less heat, same way */
    CHECK_EQUAL(error, 0.0);
    const int ladder[4] = {1, 2, 3, 7};
    for (int i = 0; i < 4; ++i) {
        loxo_context *ctx = test_context_with_threads(ladder[i]);
        CHECK_STATUS(ctx, loxo_measure_direction_error(ctx, &grid, a, NULL, b, NULL, &error), LOXO_OK);
        CHECK_NEAR(error, 2.0 * sin(0.5 * angle), 1e-10); /* differences of 0.01 in numbers near 7 */
        CHECK(i == 0 || error == one_thread);
        one_thread = error;
        loxo_context_destroy(ctx);
    }
    for (int64_t v = 0; v < grid.n_vertices; ++v)
        b[v] = -a[v];
    CHECK_OK(loxo_measure_direction_error(test_context, &grid, a, NULL, b, NULL, &error));
    CHECK_NEAR(error, 2.0, 1e-14);                /* opposite */
    for (int64_t v = 0; v < grid.n_vertices; ++v) /* unreached on the right half: no direction there */
        b[v] = grid.position[3 * v] > 0.505 ? (double)INFINITY : a[v];
    CHECK_OK(loxo_measure_direction_error(test_context, &grid, a, NULL, b, NULL, &error));
    CHECK_NEAR(error, sqrt(0.5), 1e-12); /* columns 50 to 99 of 100 have a corner beyond */
    free(a), free(b), free(scale);
    free(positions), free(triangles);
}

TEST(bad_meshes_are_refused)
{
    const double position[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, huge[9] = {0, 0, 0, 1e200, 0, 0, 0, 1e200, 0};
    const double value[3] = {1.0, 0.5, 0.2};
    loxo_index triangle[3] = {0, 1, 2};
    loxo_mesh_arrays mesh = {.n_vertices = 3, .n_faces = 1, .position = position, .triangle = triangle};
    double error = -1.0;
    CHECK_OK(loxo_measure_direction_error(test_context, &mesh, value, NULL, value, NULL, &error));
    CHECK_STATUS(test_context, loxo_measure_direction_error(test_context, &mesh, NULL, NULL, value, NULL, &error),
                 LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_measure_direction_error(test_context, NULL, value, NULL, value, NULL, &error),
                 LOXO_ERR_ARGUMENT);
    triangle[1] = 3;
    CHECK_STATUS(test_context, loxo_measure_direction_error(test_context, &mesh, value, NULL, value, NULL, &error),
                 LOXO_ERR_MALFORMED);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 0);
    triangle[1] = 1;
    mesh.position = huge;
    CHECK_STATUS(test_context, loxo_measure_direction_error(test_context, &mesh, value, NULL, value, NULL, &error),
                 LOXO_ERR_NUMERIC);
    mesh.n_faces = 0;
    CHECK_OK(loxo_measure_direction_error(test_context, &mesh, NULL, NULL, NULL, NULL, &error));
    CHECK_EQUAL(error, 0.0);
}
