/* SPDX-License-Identifier: MIT
 * Ways back of the exact method: they are on the surface, lead to a source, and are as long as the distance says. */
#include "base/rng.h"
#include "solver/geodesic/exact/exact_internal.h"
#include "solver/geodesic/geodesic_internal.h"
#include "surfaces.h"

static void place_of(const exact_state *s, const exact_stop *stop, double x[3])
{
    const loxo_mesh_view *m = &s->m;
    double weight[3] = {1.0, 0.0, 0.0};
    loxo_index corner[3] = {stop->vertex, stop->vertex, stop->vertex};
    if (stop->seed >= 0) {
        const geodesic_seed *seed = &s->seeds[stop->seed];
        for (int k = 0; k < 3; ++k) {
            weight[k] = seed->weight[k];
            corner[k] = m->halfedge_vertex[3 * (int64_t)seed->face + k];
        }
    } else if (stop->halfedge >= 0) {
        corner[0] = m->halfedge_vertex[stop->halfedge];
        corner[1] = k_head(m, stop->halfedge);
        weight[0] = 1.0 - stop->at;
        weight[1] = stop->at;
    }
    for (int j = 0; j < 3; ++j) {
        x[j] = 0.0;
        for (int k = 0; k < 3; ++k)
            x[j] += weight[k] * m->position[corner[k]][j];
    }
}

/* Traces all vertices; the largest relative difference of length and distance. */
static double check_ways(const exact_state *s, int64_t every, int64_t *n_stops)
{
    double worst = 0.0;
    exact_way way = {0};
    for (int64_t v = 0; v < s->m.n_vertices; v += every) {
        double length = 0.0, last[3] = {0.0, 0.0, 0.0};
        if (isinf(s->distance[v])) continue;
        way.n = 0;
        CHECK_STATUS(s->ctx, exact_trace(s, (loxo_index)v, &way), LOXO_OK);
        for (int64_t i = 0; i < way.n; ++i) {
            double x[3];
            place_of(s, &way.stop[i], x);
            if (i > 0)
                length += sqrt((x[0] - last[0]) * (x[0] - last[0]) + (x[1] - last[1]) * (x[1] - last[1]) +
                               (x[2] - last[2]) * (x[2] - last[2]));
            memcpy(last, x, sizeof x);
        }
        CHECK_EQUAL(way.stop[0].vertex, v);
        CHECK(way.stop[way.n - 1].seed >= 0 || s->distance[way.stop[way.n - 1].vertex] == 0.0);
        const double d = s->distance[v], e = fabs(length - d) / (d > 0.0 ? d : 1.0);
        if (e > worst) worst = e;
        *n_stops += way.n;
    }
    exact_way_destroy(s->ctx, &way);
    return worst;
}

static const struct {
    loxo_shape shape;
    int n_vertices;
    double shake, per_unit; /* per_unit > 0: vertices of a lattice */
} cases[] = {
    {LOXO_SHAPE_ICOSPHERE, 1000, 0.0, 0.0}, {LOXO_SHAPE_ICOSPHERE, 1000, 0.05, 0.0},
    {LOXO_SHAPE_TORUS, 1000, 0.03, 0.0},    {LOXO_SHAPE_GRID, 900, 0.0, 0.0},
    {LOXO_SHAPE_GRID, 900, 0.03, 0.0},      {LOXO_SHAPE_ANNULUS, 900, 0.0, 0.0},
    {LOXO_SHAPE_CYLINDER, 900, 0.05, 0.0},  {LOXO_SHAPE_GENUS, 2000, 0.0, 0.0},
    {LOXO_SHAPE_BRAIN, 2000, 0.0, 0.0},     {LOXO_SHAPE_TORUS, 1000, 0.2, 16.0},
    {LOXO_SHAPE_STRIP, 2000, 0.0, 0.0},
};

/* Rounding errors of an unfolding through some 1e3 faces, and 1e-13 from vertices that are passed. */
TEST(ways_are_as_long_as_the_distance)
{
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        loxo_soup soup = soup_make(test_context, cases[i].shape, cases[i].n_vertices, NAN);
        int64_t n_stops = 0;
        for (int64_t k = 0; k < 3 * soup.n_vertices; ++k) {
            soup.position[k] += cases[i].shake * (loxo_random_unit(i, (uint64_t)k) - 0.5);
            if (cases[i].per_unit > 0.0)
                soup.position[k] = round(cases[i].per_unit * soup.position[k]) / cases[i].per_unit;
        }
        surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
        double *distance = surface_numbers(&s);
        loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EXACT);
        loxo_geodesic *g = NULL;
        CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
        const loxo_surface_point points[3] = {
            {{0, 0, 0}, {1.0, 0.0, 0.0}},
            {{soup.triangle[300], soup.triangle[301], soup.triangle[302]}, {0.2, 0.3, 0.5}},
            {{soup.triangle[1200], soup.triangle[1201], soup.triangle[1202]}, {0.25, 0.75, 0.0}}};
        for (int n = 1; n <= 3; n += 2) {
            CHECK_OK(loxo_geodesic_solve_points(g, points, n, distance, NULL));
            const double worst = check_ways(g->state, 1, &n_stops);
            print_message("%s, %d sources: %.2g\n", loxo_shape_name(cases[i].shape), n, worst);
            CHECK(worst < 1e-12);
        }
        loxo_geodesic_destroy(g);
        loxo_release(test_context, distance);
        surface_destroy(&s);
    }
}
