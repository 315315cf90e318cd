/* SPDX-License-Identifier: MIT
 * Surfaces as the methods for spherical maps take them, without loxo_sphere_create; and maps to begin with. */
#ifndef LOXO_TESTS_SOLVER_SPHERES_H
#define LOXO_TESTS_SOLVER_SPHERES_H

#include "base/allocate.h"
#include "kernel/vec3.h"
#include "operator/laplacian.h"
#include "solver/sphere/sphere_internal.h"
#include "solver/surfaces.h"

typedef struct sphere_case {
    surface s;
    sphere_problem p;
} sphere_case;

/* soup is taken over. */
static inline sphere_case sphere_case_make(loxo_context *ctx, loxo_soup soup)
{
    sphere_case c = {.s = surface_from_soup(ctx, soup, LOXO_ORDER_AUTO)};
    c.p = (sphere_problem){.ctx = ctx, .settings = loxo_sphere_settings_default()};
    c.p.m = loxo_mesh_get_view(c.s.mesh);
    const int64_t n = c.p.m.n_vertices;
    double sum = 0.0;
    c.p.area = loxo_allocate(ctx, n, sizeof *c.p.area);
    CHECK(c.p.area != NULL);
    CHECK_STATUS(ctx, loxo_laplacian_create(ctx, &c.p.m, &c.p.laplacian, c.p.area), LOXO_OK);
    for (int64_t i = 0; i < n; ++i)
        sum += c.p.area[i];
    for (int64_t i = 0; i < n; ++i)
        c.p.area[i] /= sum;
    return c;
}

static inline void sphere_case_destroy(sphere_case *c)
{
    loxo_release(c->p.ctx, c->p.area);
    loxo_csr_destroy(c->p.ctx, &c->p.laplacian);
    surface_destroy(&c->s);
}

/* An icosphere, its coordinates times these. */
static inline sphere_case sphere_case_ellipsoid(loxo_context *ctx, int64_t n_vertices, double a, double b, double c)
{
    loxo_soup soup = soup_make(ctx, LOXO_SHAPE_ICOSPHERE, n_vertices, NAN);
    for (int64_t i = 0; i < soup.n_vertices; ++i) {
        soup.position[3 * i] *= a;
        soup.position[3 * i + 1] *= b;
        soup.position[3 * i + 2] *= c;
    }
    return sphere_case_make(ctx, soup);
}

/* Seen from 0, each coordinate times a factor first: what was stretched goes back to where it was. */
static inline sphere_map sphere_case_look(const sphere_case *c, double x, double y, double z)
{
    const loxo_mesh_view *m = &c->p.m;
    sphere_map f = loxo_allocate(c->p.ctx, m->n_vertices, sizeof *f);
    CHECK(f != NULL);
    for (int64_t i = 0; i < m->n_vertices; ++i) {
        const loxo_vec3 p = k_position(m, (loxo_index)i), q = {x * p.x, y * p.y, z * p.z};
        v3_store(f[i], v3_scale(1.0 / v3_norm(q), q));
    }
    return f;
}

/* Turned by generic angles, so that no vertex is at a pole. */
static inline void sphere_case_turn(const sphere_case *c, sphere_map f)
{
    static const double r[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0.0}, {0.48, 0.64, 0.6}}; /* orthonormal */
    for (int64_t i = 0; i < c->p.m.n_vertices; ++i) {
        const loxo_vec3 x = v3_load(f[i]);
        const loxo_vec3 y = {v3_dot(v3_load(r[0]), x), v3_dot(v3_load(r[1]), x), v3_dot(v3_load(r[2]), x)};
        v3_store(f[i], v3_scale(1.0 / v3_norm(y), y));
    }
}

#endif
