/* SPDX-License-Identifier: MIT
 * The point of a surface nearest to a point of space. */
#include "base/rng.h"
#include "kernel/closest_kernel.h"
#include "shapes.h"
#include "test.h"

#include <loxo/mesh.h>

static loxo_vec3 random_point(uint64_t i, double size)
{
    return (loxo_vec3){size * (2.0 * loxo_random_unit(1, 3 * i) - 1.0),
                       size * (2.0 * loxo_random_unit(1, 3 * i + 1) - 1.0),
                       size * (2.0 * loxo_random_unit(1, 3 * i + 2) - 1.0)};
}

/* No point of the triangle is nearer than the one found, and that is where its weights say: by a grid of 60 x 60 / 2 points. */
TEST(nearest_in_a_triangle_against_many_points)
{
    for (uint64_t i = 0; i < 300; ++i) {
        const loxo_vec3 a = random_point(4 * i, 1.0), b = random_point(4 * i + 1, 1.0),
                        c = random_point(4 * i + 2, 1.0);
        const loxo_vec3 p = random_point(4 * i + 3, 1.5);
        double w[3] = {0.0, 0.0, 0.0};
        const double square = k_closest_in_triangle(p, a, b, c, w);
        CHECK(w[0] >= 0.0 && w[1] >= 0.0 && w[2] >= 0.0);
        CHECK_NEAR(w[0] + w[1] + w[2], 1.0, 1e-14);
        const loxo_vec3 x = v3_axpy(v3_axpy(v3_scale(w[0], a), w[1], b), w[2], c), way = v3_sub(p, x);
        CHECK_NEAR(v3_dot(way, way), square, 1e-12); /* of size 1, conditioned by thin triangles */
        for (int j = 0; j <= 60; ++j)
            for (int k = 0; j + k <= 60; ++k) {
                const double u = j / 60.0, v = k / 60.0;
                const loxo_vec3 y = v3_axpy(v3_axpy(v3_scale(1.0 - u - v, a), u, b), v, c), to = v3_sub(p, y);
                CHECK(v3_dot(to, to) >= square - 1e-12);
            }
    }
}

TEST(nearest_in_triangles_without_area)
{
    const loxo_vec3 a = {0.0, 0.0, 0.0}, b = {1.0, 0.0, 0.0}, c = {0.25, 0.0, 0.0}, p = {0.5, 2.0, 0.0};
    double w[3];
    CHECK_EQUAL(k_closest_in_triangle(p, a, b, c, w), 4.0);
    CHECK_NEAR(w[1] + 0.25 * w[2], 0.5, 1e-15);
    CHECK_EQUAL(k_closest_in_triangle(p, a, a, a, w), 4.25);
}

/* The same weights in any unit, to the bit, of edges of 1e-40 and of 1: only the unit of the answer changes. */
TEST(nearest_in_triangles_of_any_size)
{
    for (uint64_t i = 0; i < 200; ++i)
        for (int k = -130; k <= 130; k += 65) {
            const double size = i % 2 == 0 ? 1e-40 : 1.0, scale = ldexp(1.0, k);
            const loxo_vec3 a = random_point(4 * i, size), b = random_point(4 * i + 1, size),
                            c = random_point(4 * i + 2, size), p = random_point(4 * i + 3, 1.5 * size);
            double w[3], scaled[3];
            const double square = k_closest_in_triangle(p, a, b, c, w);
            const double square_scaled = k_closest_in_triangle(v3_scale(scale, p), v3_scale(scale, a),
                                                               v3_scale(scale, b), v3_scale(scale, c), scaled);
            CHECK(memcmp(w, scaled, sizeof w) == 0);
            CHECK_EQUAL(square_scaled, square * scale * scale);
        }
}

static loxo_mesh *grid_mesh(loxo_soup *soup, int64_t n)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_mesh_settings mesh_settings = loxo_mesh_settings_default();
    loxo_mesh *mesh = NULL;
    settings.shape = LOXO_SHAPE_GRID;
    settings.n_vertices = n;
    CHECK_OK(loxo_generate(test_context, &settings, false, soup));
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    mesh_settings.order = LOXO_ORDER_HILBERT;
    CHECK_OK(loxo_mesh_create(test_context, &arrays, LOXO_BORROW, &mesh_settings, NULL, &mesh));
    return mesh;
}

/* Over the unit square the nearest point is straight below; beside it on the rim. */
TEST(points_over_a_square)
{
    loxo_soup soup = {0};
    loxo_mesh *mesh = grid_mesh(&soup, 400);
    double position[50][3], away[50];
    loxo_surface_point point[50];
    for (uint64_t i = 0; i < 50; ++i)
        v3_store(position[i], random_point(i, 2.0));
    CHECK_OK(loxo_mesh_nearest_points(mesh, 50, (const double(*)[3])position, point, away));
    for (int i = 0; i < 50; ++i) {
        const double x = fmin(fmax(position[i][0], 0.0), 1.0), y = fmin(fmax(position[i][1], 0.0), 1.0);
        const double dx = position[i][0] - x, dy = position[i][1] - y, dz = position[i][2];
        double found[3] = {0.0, 0.0, 0.0};
        for (int k = 0; k < 3; ++k)
            for (int j = 0; j < 3 && point[i].vertex[k] >= 0; ++j)
                found[j] += point[i].weight[k] * soup.position[3 * point[i].vertex[k] + j];
        CHECK_NEAR(away[i], sqrt(dx * dx + dy * dy + dz * dz), 1e-13);
        CHECK_NEAR3(found, ((double[3]){x, y, 0.0}), 1e-13);
    }
    loxo_mesh_destroy(mesh);
    loxo_soup_destroy(test_context, &soup);
}

TEST(a_vertex_is_nearest_to_itself)
{
    loxo_soup soup = {0};
    loxo_mesh *mesh = grid_mesh(&soup, 100);
    for (int64_t v = 0; v < soup.n_vertices; ++v) {
        loxo_surface_point point;
        double away;
        CHECK_OK(
            loxo_mesh_nearest_points(mesh, 1, (const double(*)[3])(const void *)&soup.position[3 * v], &point, &away));
        CHECK_EQUAL(away, 0.0);
        for (int k = 0; k < 3; ++k)
            if (point.vertex[k] >= 0) CHECK_EQUAL(point.weight[k], point.vertex[k] == v ? 1.0 : 0.0);
    }
    loxo_mesh_destroy(mesh);
    loxo_soup_destroy(test_context, &soup);
}

/* Over a vertex of a plane several faces are as near as each other but for rounding: here at thirds, which are no numbers
 * of a computer. Which is taken must not depend on which faces a thread has seen. */
TEST(same_bits_for_any_number_of_threads)
{
    NEEDS_IDS(6 * 5000);
    static const int n_threads[4] = {1, 2, 3, 7};
    uint64_t hash[4];
    loxo_soup soup = {0};
    loxo_mesh_destroy(grid_mesh(&soup, 5000));
    const int64_t n = soup.n_vertices / 5;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    double(*position)[3] = loxo_allocate(test_context, n, sizeof *position), *away = loxo_allocate(test_context, n, 8);
    loxo_surface_point *point = loxo_allocate(test_context, n, sizeof *point);
    for (int64_t i = 0; i < 3 * soup.n_vertices; ++i)
        soup.position[i] /= 3.0;
    for (int64_t i = 0; i < n; ++i) /* over every fifth vertex */
        v3_store(position[i], (loxo_vec3){soup.position[15 * i], soup.position[15 * i + 1], 0.1 + 0.005 * (double)i});
    for (int k = 0; k < 4; ++k) {
        loxo_context *ctx = test_context_with_threads(n_threads[k]);
        loxo_mesh *mesh = NULL;
        CHECK_STATUS(ctx, loxo_mesh_create(ctx, &arrays, LOXO_BORROW, NULL, NULL, &mesh), LOXO_OK);
        CHECK_STATUS(ctx, loxo_mesh_nearest_points(mesh, n, (const double(*)[3])position, point, away), LOXO_OK);
        hash[k] = test_hash(away, (size_t)n * sizeof *away);
        for (int64_t i = 0; i < n; ++i)
            hash[k] = hash[k] * 31 + test_hash(point[i].vertex, sizeof point[i].vertex) +
                      test_hash(point[i].weight, sizeof point[i].weight);
        CHECK(hash[k] == hash[0]);
        loxo_mesh_destroy(mesh);
        loxo_context_destroy(ctx);
    }
    loxo_release(test_context, point);
    loxo_release(test_context, away);
    loxo_release(test_context, position);
    loxo_soup_destroy(test_context, &soup);
}

TEST(what_has_no_nearest_point)
{
    loxo_soup soup = {0};
    loxo_mesh *mesh = grid_mesh(&soup, 100);
    const double bad[2][3] = {{0.0, 0.0, 0.0}, {0.0, NAN, 0.0}}, far[1][3] = {{1e200, 0.0, 0.0}};
    loxo_surface_point point[2];
    CHECK_STATUS(test_context, loxo_mesh_nearest_points(mesh, 2, bad, point, NULL), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    CHECK_STATUS(test_context, loxo_mesh_nearest_points(mesh, 1, far, point, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_mesh_nearest_points(mesh, 1, NULL, point, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(NULL, loxo_mesh_nearest_points(NULL, 1, bad, point, NULL), LOXO_ERR_ARGUMENT);
    CHECK_OK(loxo_mesh_nearest_points(mesh, 0, NULL, NULL, NULL));
    loxo_mesh_destroy(mesh);
    loxo_soup_destroy(test_context, &soup);
}
