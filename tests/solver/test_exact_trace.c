/* SPDX-License-Identifier: MIT
 * Ways back of the exact method: they are on the surface, lead to a source, and are as long as the distance says. */
#include "base/rng.h"
#include "solver/geodesic/exact/exact_internal.h"
#include "solver/geodesic/geodesic_internal.h"
#include "surfaces.h"

#include <loxo/lines.h>

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

/* A point of a face made a vertex: the surface stays what it is. */
static loxo_soup with_point(const loxo_soup *soup, int64_t face, const double weight[3])
{
    loxo_soup more = {.n_vertices = soup->n_vertices + 1, .n_faces = soup->n_faces + 2};
    const loxo_index *t = &soup->triangle[3 * face];
    const loxo_index v = (loxo_index)soup->n_vertices;
    const loxo_index faces[3][3] = {{t[0], t[1], v}, {t[1], t[2], v}, {t[2], t[0], v}};
    more.position = loxo_allocate(test_context, 3 * more.n_vertices, sizeof *more.position);
    more.triangle = loxo_allocate(test_context, 3 * more.n_faces, sizeof *more.triangle);
    memcpy(more.position, soup->position, (size_t)(3 * soup->n_vertices) * sizeof *more.position);
    memcpy(more.triangle, soup->triangle, (size_t)(3 * soup->n_faces) * sizeof *more.triangle);
    for (int j = 0; j < 3; ++j) {
        more.position[3 * soup->n_vertices + j] = 0.0;
        for (int k = 0; k < 3; ++k)
            more.position[3 * soup->n_vertices + j] += weight[k] * soup->position[3 * t[k] + j];
    }
    memcpy(&more.triangle[3 * face], faces[0], sizeof faces[0]);
    memcpy(&more.triangle[3 * soup->n_faces], faces[1], 2 * sizeof faces[0]);
    return more;
}

/* Ways from points inside faces, to sources at vertices and inside faces: as long as the distance of the same point where it
 * is a vertex of a finer mesh of the same surface. Places of points are rounded: 1e-16 of the coordinates. */
TEST(ways_from_points_inside_faces)
{
    static const double inside[3] = {0.5, 0.2, 0.3}, source_inside[3] = {0.3, 0.3, 0.4};
    for (int round = 0; round < 24; ++round) {
        loxo_soup soup = soup_make(test_context, round % 2 == 0 ? LOXO_SHAPE_TORUS : LOXO_SHAPE_GRID, 150, NAN);
        for (int64_t k = 0; k < 3 * soup.n_vertices; ++k)
            soup.position[k] += 0.1 * (loxo_random_unit((uint64_t)round, (uint64_t)k) - 0.5);
        const int64_t from = (37 * (int64_t)round + 5) % soup.n_faces;
        /* Far, near, in the same face. */
        const int64_t to = round % 3 == 0   ? (from + soup.n_faces / 2) % soup.n_faces
                           : round % 3 == 1 ? from
                                            : (from + 2) % soup.n_faces;
        const loxo_index *t = &soup.triangle[3 * to], *f = &soup.triangle[3 * from];
        const loxo_surface_point source[2] = {
            {{t[0], t[1], t[2]}, {source_inside[0], source_inside[1], source_inside[2]}},
            {{t[0], -1, -1}, {1.0, 0.0, 0.0}}};
        const loxo_surface_point target = {{f[0], f[1], f[2]}, {inside[0], inside[1], inside[2]}};
        loxo_soup more = with_point(&soup, from, inside);
        surface fine = surface_from_soup(test_context, more, LOXO_ORDER_GIVEN);
        surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
        double *distance = surface_numbers(&fine);
        for (int kind = 0; kind < 2; ++kind) {
            loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EXACT);
            loxo_geodesic *g = NULL;
            loxo_polylines lines;
            double expected;
            if (kind == 0 && to == from) {
                const double w[3] = {source_inside[0] - inside[0], source_inside[1] - inside[1],
                                     source_inside[2] - inside[2]};
                double x[3] = {0.0, 0.0, 0.0};
                for (int j = 0; j < 3; ++j)
                    for (int k = 0; k < 3; ++k)
                        x[j] += w[k] * soup.position[3 * t[k] + j];
                expected = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
            } else {
                CHECK_OK(loxo_geodesic_create(test_context, fine.mesh, &settings, &g));
                CHECK_OK(loxo_geodesic_solve_points(g, &source[kind], 1, distance, NULL));
                expected = distance[soup.n_vertices];
                loxo_geodesic_destroy(g);
            }
            CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
            CHECK_OK(loxo_geodesic_solve_points(g, &source[kind], 1, distance, NULL));
            CHECK_OK(loxo_geodesic_paths(g, &target, 1, &lines));
            CHECK_NEAR(loxo_polyline_length(&lines, 0), expected, 1e-13);
            loxo_polylines_destroy(test_context, &lines);
            loxo_geodesic_destroy(g);
        }
        loxo_release(test_context, distance);
        surface_destroy(&s);
        surface_destroy(&fine);
    }
}
