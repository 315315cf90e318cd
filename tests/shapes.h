/* SPDX-License-Identifier: MIT
 * Tiny shapes for tests. Each gives a soup made with the test's context; the test destroys it. */
#ifndef LOXO_TEST_SHAPES_H
#define LOXO_TEST_SHAPES_H

#include "test.h"

#include <loxo/mesh.h>

static inline loxo_soup shape_empty(loxo_context *ctx, int64_t n_vertices, int64_t n_faces)
{
    loxo_soup soup = {.n_vertices = n_vertices, .n_faces = n_faces};
    soup.position = loxo_allocate(ctx, n_vertices, 3 * sizeof *soup.position);
    soup.triangle = loxo_allocate(ctx, n_faces, 3 * sizeof *soup.triangle);
    CHECK(soup.position != NULL && soup.triangle != NULL);
    return soup;
}

static inline loxo_soup shape_of(loxo_context *ctx, int64_t n_vertices, const double (*position)[3], int64_t n_faces,
                                 const int (*triangle)[3])
{
    loxo_soup soup = shape_empty(ctx, n_vertices, n_faces);
    for (int64_t i = 0; i < 3 * n_vertices; ++i)
        soup.position[i] = position[i / 3][i % 3];
    for (int64_t i = 0; i < 3 * n_faces; ++i)
        soup.triangle[i] = (loxo_index)triangle[i / 3][i % 3];
    return soup;
}

static inline loxo_soup shape_tetrahedron(loxo_context *ctx)
{
    static const double p[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    static const int t[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    return shape_of(ctx, 4, p, 4, t);
}

static inline loxo_soup shape_cube(loxo_context *ctx)
{
    static const double p[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                   {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    static const int t[12][3] = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                                 {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
    return shape_of(ctx, 8, p, 12, t);
}

/* Two triangles that share nothing but vertex 0. */
static inline loxo_soup shape_bow_tie(loxo_context *ctx)
{
    static const double p[5][3] = {{0, 0, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}};
    static const int t[2][3] = {{0, 1, 2}, {0, 3, 4}};
    return shape_of(ctx, 5, p, 2, t);
}

/* n triangles at the edge from vertex 0 to vertex 1, all running it the same way. */
static inline loxo_soup shape_book(loxo_context *ctx, int n)
{
    loxo_soup soup = shape_empty(ctx, n + 2, n);
    const double spine[2][3] = {{0, 0, 0}, {0, 0, 1}};
    memcpy(soup.position, spine, sizeof spine);
    for (int i = 0; i < n; ++i) {
        soup.position[3 * (i + 2)] = cos(i);
        soup.position[3 * (i + 2) + 1] = sin(i);
        soup.position[3 * (i + 2) + 2] = 0.5;
        soup.triangle[3 * i] = 0;
        soup.triangle[3 * i + 1] = 1;
        soup.triangle[3 * i + 2] = (loxo_index)(i + 2);
    }
    return soup;
}

/* A band of n quads around and m across; closes across as well when is_torus, and with a half turn when twisted. */
static inline loxo_soup shape_band(loxo_context *ctx, int n, int m, bool is_torus, bool is_twisted)
{
    const int columns = is_torus ? m : m + 1;
    loxo_soup soup = shape_empty(ctx, (int64_t)n * columns, (int64_t)2 * n * m);
    loxo_index *t = soup.triangle;
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < columns; ++j) {
            const double a = 2.0 * 3.14159265358979 * i / n;
            const double b = is_torus ? 2.0 * 3.14159265358979 * j / m : is_twisted ? 0.5 * a : 0.0;
            const double w = is_torus ? 0.4 : 0.5 * (2.0 * j / m - 1.0);
            double *p = &soup.position[3 * (i * columns + j)];
            p[0] = cos(a) * (1.0 + w * cos(b));
            p[1] = sin(a) * (1.0 + w * cos(b));
            p[2] = w * sin(b);
        }
    }
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < m; ++j) {
            const int next = (i + 1) % n, right = (j + 1) % columns;
            const bool flips = is_twisted && next == 0;
            const int a = i * columns + j, b = i * columns + right;
            const int c = next * columns + (flips ? m - j : j), d = next * columns + (flips ? m - right : right);
            const int two[6] = {a, c, d, a, d, b};
            for (int k = 0; k < 6; ++k)
                *t++ = (loxo_index)two[k];
        }
    }
    return soup;
}

static inline loxo_soup shape_annulus(loxo_context *ctx, int n, int m) { return shape_band(ctx, n, m, false, false); }
static inline loxo_soup shape_torus(loxo_context *ctx, int n, int m) { return shape_band(ctx, n, m, true, false); }
static inline loxo_soup shape_moebius(loxo_context *ctx, int n) { return shape_band(ctx, n, 2, false, true); }

/* A closed double cone: apex 0 with n faces, apex 1 below, a ring of n between. */
static inline loxo_soup shape_hub(loxo_context *ctx, int n)
{
    loxo_soup soup = shape_empty(ctx, n + 2, (int64_t)2 * n);
    const double apex[2][3] = {{0, 0, 1}, {0, 0, -1}};
    memcpy(soup.position, apex, sizeof apex);
    for (int i = 0; i < n; ++i) {
        const double a = 2.0 * 3.14159265358979 * i / n;
        const int b = i + 2, c = (i + 1) % n + 2;
        const int two[6] = {0, b, c, 1, c, b};
        soup.position[3 * b] = cos(a);
        soup.position[3 * b + 1] = sin(a);
        soup.position[3 * b + 2] = 0.0;
        for (int k = 0; k < 6; ++k)
            soup.triangle[6 * i + k] = (loxo_index)two[k];
    }
    return soup;
}

static inline loxo_soup shape_genus(loxo_context *ctx, int genus, int64_t n_vertices)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_soup soup;
    settings.shape = LOXO_SHAPE_GENUS;
    settings.n_vertices = n_vertices;
    settings.params[0] = genus;
    CHECK_STATUS(ctx, loxo_generate(ctx, &settings, false, &soup), LOXO_OK);
    return soup;
}

/* Every step-th face gets a vertex off the middle of its first edge by that share of its height: a cap. */
static inline void shape_add_caps(loxo_context *ctx, loxo_soup *soup, int64_t step, double share)
{
    const int64_t n_caps = soup->n_faces / step;
    loxo_soup capped = shape_empty(ctx, soup->n_vertices + n_caps, soup->n_faces + 2 * n_caps);
    memcpy(capped.position, soup->position, (size_t)(3 * soup->n_vertices) * sizeof(double));
    memcpy(capped.triangle, soup->triangle, (size_t)(3 * soup->n_faces) * sizeof(loxo_index));
    for (int64_t i = 0; i < n_caps; ++i) {
        loxo_index *t = capped.triangle + 3 * step * i, *more = capped.triangle + 3 * (soup->n_faces + 2 * i);
        const loxo_index p = (loxo_index)(soup->n_vertices + i), v[3] = {t[0], t[1], t[2]};
        const loxo_index two[6] = {v[1], v[2], p, v[2], v[0], p};
        for (int c = 0; c < 3; ++c) {
            const double *x = capped.position;
            const double middle = 0.5 * (x[3 * v[0] + c] + x[3 * v[1] + c]);
            capped.position[3 * (int64_t)p + c] = middle + share * (x[3 * v[2] + c] - middle);
        }
        t[2] = p;
        memcpy(more, two, sizeof two);
    }
    loxo_soup_destroy(ctx, soup);
    *soup = capped;
}

/* b behind a, in a; b is gone. */
static inline void shape_append(loxo_context *ctx, loxo_soup *a, loxo_soup *b)
{
    loxo_soup both = shape_empty(ctx, a->n_vertices + b->n_vertices, a->n_faces + b->n_faces);
    memcpy(both.position, a->position, (size_t)a->n_vertices * 3 * sizeof(double));
    memcpy(both.position + 3 * a->n_vertices, b->position, (size_t)b->n_vertices * 3 * sizeof(double));
    memcpy(both.triangle, a->triangle, (size_t)a->n_faces * 3 * sizeof(loxo_index));
    for (int64_t i = 0; i < 3 * b->n_faces; ++i)
        both.triangle[3 * a->n_faces + i] = (loxo_index)(b->triangle[i] + a->n_vertices);
    loxo_soup_destroy(ctx, a);
    loxo_soup_destroy(ctx, b);
    *a = both;
}

/* A duplicate of the soup, for tests that need it twice. */
static inline loxo_soup shape_copy(loxo_context *ctx, const loxo_soup *a)
{
    loxo_soup copy = shape_empty(ctx, a->n_vertices, a->n_faces);
    memcpy(copy.position, a->position, (size_t)a->n_vertices * 3 * sizeof(double));
    memcpy(copy.triangle, a->triangle, (size_t)a->n_faces * 3 * sizeof(loxo_index));
    return copy;
}

/* A generated shape of the test's context, sheared along its second coordinate and stretched along its first. */
static inline loxo_soup shape_stretched(loxo_shape shape, int64_t n_vertices, double parameter, double stretch,
                                        double shear)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_soup soup = {0};
    settings.shape = shape;
    settings.n_vertices = n_vertices;
    settings.params[0] = parameter;
    CHECK_OK(loxo_generate(test_context, &settings, false, &soup));
    for (int64_t v = 0; v < soup.n_vertices; ++v)
        soup.position[3 * v] = stretch * soup.position[3 * v] + shear * soup.position[3 * v + 1];
    return soup;
}

#endif
