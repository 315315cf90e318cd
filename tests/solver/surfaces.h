/* SPDX-License-Identifier: MIT
 * Generated surfaces with their meshes, and solves that are expected to go well. */
#ifndef LOXO_TESTS_SOLVER_SURFACES_H
#define LOXO_TESTS_SOLVER_SURFACES_H

#include "test.h"

#include <loxo/geodesic.h>
#include <loxo/mesh.h>

typedef struct surface {
    loxo_context *ctx;
    loxo_soup soup;
    loxo_mesh_arrays arrays; /* of the soup */
    loxo_mesh *mesh;
} surface;

static inline surface surface_from_soup(loxo_context *ctx, loxo_soup soup, loxo_order order)
{
    surface s = {.ctx = ctx, .soup = soup, .arrays = loxo_soup_arrays(&soup)};
    loxo_mesh_settings settings = loxo_mesh_settings_default();
    settings.order = order;
    CHECK_STATUS(ctx, loxo_mesh_create(ctx, &s.arrays, LOXO_COPY, &settings, NULL, &s.mesh), LOXO_OK);
    return s;
}

/* param: the first of the shape's; NAN its default. */
static inline loxo_soup soup_make(loxo_context *ctx, loxo_shape shape, int64_t n_vertices, double param)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_soup soup = {0};
    settings.shape = shape;
    settings.n_vertices = n_vertices;
    settings.seed = 11;
    settings.params[0] = param;
    CHECK_STATUS(ctx, loxo_generate(ctx, &settings, false, &soup), LOXO_OK);
    return soup;
}

static inline surface surface_make(loxo_context *ctx, loxo_shape shape, int64_t n_vertices, double param)
{
    return surface_from_soup(ctx, soup_make(ctx, shape, n_vertices, param), LOXO_ORDER_AUTO);
}

/* From a few vertices and faces; copied. */
static inline surface surface_small(loxo_context *ctx, int64_t n_vertices, const double *position, int64_t n_faces,
                                    const loxo_index *triangle)
{
    loxo_soup soup = {.n_vertices = n_vertices, .n_faces = n_faces};
    soup.position = loxo_allocate(ctx, 3 * n_vertices, sizeof *soup.position);
    soup.triangle = loxo_allocate(ctx, 3 * n_faces, sizeof *soup.triangle);
    memcpy(soup.position, position, (size_t)(3 * n_vertices) * sizeof *position);
    memcpy(soup.triangle, triangle, (size_t)(3 * n_faces) * sizeof *triangle);
    return surface_from_soup(ctx, soup, LOXO_ORDER_AUTO);
}

static inline void surface_destroy(surface *s)
{
    loxo_mesh_destroy(s->mesh);
    loxo_soup_destroy(s->ctx, &s->soup);
}

/* Distance on the smooth shape, where there is a closed form; of the shape's default params. */
static inline void surface_exact(const surface *s, loxo_shape shape, loxo_index source, double *distance)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    settings.shape = shape;
    settings.n_vertices = s->soup.n_vertices;
    CHECK_STATUS(s->ctx, loxo_generate_exact_distance(s->ctx, &settings, &s->soup, source, distance), LOXO_OK);
}

/* One number a vertex. */
static inline double *surface_numbers(const surface *s)
{
    return loxo_allocate(s->ctx, s->soup.n_vertices, sizeof(double));
}

/* Settings whose check lets everything pass. */
static inline loxo_geodesic_settings unjudged_settings(loxo_geodesic_method method)
{
    loxo_geodesic_settings settings = loxo_geodesic_settings_default();
    settings.method = method;
    settings.check_gradient_share = 1.0;
    settings.check_breach = 1e30;
    return settings;
}

/* As the paper recovers distances from heat. */
static inline loxo_geodesic_settings admm_settings(loxo_geodesic_method method)
{
    loxo_geodesic_settings settings = unjudged_settings(method);
    settings.recovery = LOXO_RECOVERY_ADMM;
    return settings;
}

static const char *const method_names[] = {"edge", "face"};

#endif
