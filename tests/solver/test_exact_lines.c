/* SPDX-License-Identifier: MIT
 * Exact distances against a second family of algorithms, which shares no code: all straight lines, then Dijkstra. */
#include "base/rng.h"
#include "straight_lines.h"
#include "surfaces.h"

/* Numbers from 0 to 1, one after another. */
typedef struct dice {
    uint64_t seed, n;
} dice;

static double roll(dice *d) { return loxo_random_unit(d->seed, d->n++); }

static int pick(dice *d, int64_t n) { return (int)(roll(d) * (double)n); }

/* Moves vertices at random, by up to so much of the shape's size; flat shapes get heights, too. */
static void shake(loxo_soup *soup, dice *d, double by)
{
    for (int64_t i = 0; i < 3 * soup->n_vertices; ++i)
        soup->position[i] += by * (roll(d) - 0.5);
}

/* Takes faces away, as long as no vertex is left where two fans meet: a face goes with all that touch one of its vertices. */
static void punch(loxo_soup *soup, int vertex)
{
    int64_t n = 0;
    for (int64_t f = 0; f < soup->n_faces; ++f) {
        const loxo_index *t = &soup->triangle[3 * f];
        if (t[0] == vertex || t[1] == vertex || t[2] == vertex) continue;
        for (int k = 0; k < 3; ++k)
            soup->triangle[3 * n + k] = t[k];
        n += 1;
    }
    soup->n_faces = n;
}

static const struct {
    loxo_shape shape;
    int n_vertices;
    double shake;
    bool punch;
} recipes[] = {
    {LOXO_SHAPE_ICOSPHERE, 42, 0.3, false}, {LOXO_SHAPE_ICOSPHERE, 92, 0.25, true},
    {LOXO_SHAPE_TORUS, 60, 0.2, false},     {LOXO_SHAPE_TORUS, 80, 0.15, true},
    {LOXO_SHAPE_GRID, 64, 0.15, false},     {LOXO_SHAPE_GRID, 81, 0.1, true},
    {LOXO_SHAPE_DISK, 61, 0.25, false},     {LOXO_SHAPE_ANNULUS, 60, 0.2, false},
    {LOXO_SHAPE_CYLINDER, 60, 0.3, true},   {LOXO_SHAPE_STRIP, 60, 0.4, false},
};
#define N_RECIPES ((int)(sizeof recipes / sizeof recipes[0]))

/* Moves vertices to a lattice: faces get flat, ways go through vertices and meet in many equal ones. false: an edge has
 * lost its length, which the other family cannot do without. */
static bool snap(loxo_soup *soup, double per_unit)
{
    for (int64_t i = 0; i < 3 * soup->n_vertices; ++i)
        soup->position[i] = round(per_unit * soup->position[i]) / per_unit;
    for (int64_t e = 0; e < 3 * soup->n_faces; ++e) {
        const double *a = &soup->position[3 * soup->triangle[e]];
        const double *b = &soup->position[3 * soup->triangle[e - e % 3 + (e + 1) % 3]];
        if (memcmp(a, b, 3 * sizeof *a) == 0) return false;
    }
    return true;
}

/* per_unit > 0: on a lattice. Negative where there is nothing to compare. */
static double compare_one(int round, double per_unit, int64_t *n_cones)
{
    dice d = {.seed = (uint64_t)round + 1000};
    const int recipe = round % N_RECIPES;
    loxo_soup soup = soup_make(test_context, recipes[recipe].shape, recipes[recipe].n_vertices, NAN);
    shake(&soup, &d, recipes[recipe].shake);
    if (recipes[recipe].punch) punch(&soup, pick(&d, soup.n_vertices));
    if (per_unit > 0.0 && !snap(&soup, per_unit)) {
        loxo_soup_destroy(test_context, &soup);
        return -1.0;
    }
    surface s = surface_from_soup(test_context, soup, round % 2 == 0 ? LOXO_ORDER_GIVEN : LOXO_ORDER_HILBERT);
    lines_surface lines = lines_surface_make(&soup);
    double *distance = surface_numbers(&s), *other = surface_numbers(&s), worst = 0.0;
    loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EXACT);
    loxo_geodesic *g = NULL;
    CHECK_OK(loxo_geodesic_create(test_context, s.mesh, &settings, &g));
    for (int solve = 0; solve < 3; ++solve) {
        /* One vertex; one point of a face, an edge in every other round; several of both. */
        const int n = solve < 2 ? 1 : 4;
        lines_source from[4];
        loxo_surface_point points[4];
        for (int i = 0; i < n; ++i) {
            const int face = pick(&d, soup.n_faces), corner = pick(&d, 3);
            const loxo_index *t = &soup.triangle[3 * face];
            double a = roll(&d), b = roll(&d);
            if (a + b > 1.0) a = 1.0 - a, b = 1.0 - b;
            if (round % 2 == 1) b = 0.0;
            const double weight[3] = {1.0 - a - b, a, b};
            const bool is_vertex = solve == 0 || (solve == 2 && i % 2 == 0);
            from[i] = (lines_source){.vertex = t[corner], .face = is_vertex ? -1 : face};
            points[i] = (loxo_surface_point){.vertex = {t[0], t[1], t[2]}};
            for (int k = 0; k < 3; ++k) {
                from[i].weight[k] = weight[k];
                points[i].weight[k] = is_vertex ? (k == corner ? 1.0 : 0.0) : weight[k];
            }
        }
        CHECK_OK(loxo_geodesic_solve_points(g, points, n, distance, NULL));
        *n_cones += straight_line_distances(&lines, from, n, other);
        for (int64_t v = 0; v < soup.n_vertices; ++v) {
            if (isinf(other[v])) {
                CHECK(isinf(distance[v]));
                continue;
            }
            const double e = fabs(distance[v] - other[v]) / (other[v] > 0.0 ? other[v] : 1.0);
            if (e > worst) worst = e;
            if (e > 1e-11)
                print_error("round %d, recipe %d, solve %d, vertex %lld: %.17g, other way %.17g\n", round, recipe,
                            solve, (long long)v, distance[v], other[v]);
        }
    }
    loxo_geodesic_destroy(g);
    loxo_release(test_context, distance);
    loxo_release(test_context, other);
    lines_surface_destroy(&lines);
    surface_destroy(&s);
    return worst;
}

/* 300 solves on 100 surfaces with boundaries, saddles and handles. Rounding errors of some 30 unfoldings are 1e-14; the
 * second family works in long double. */
TEST(two_families_agree)
{
    double worst = 0.0;
    int64_t n_cones = 0;
    for (int round = 0; round < 100; ++round) {
        const double e = compare_one(round, 0.0, &n_cones);
        if (e > worst) worst = e;
    }
    print_message("largest relative difference %.2g; %lld cones\n", worst, (long long)n_cones);
    CHECK(worst < 1e-12);
}

TEST(two_families_agree_on_lattices)
{
    double worst = 0.0;
    int64_t n_cones = 0, n_surfaces = 0;
    for (int round = 0; round < 150; ++round) {
        const double e = compare_one(round, round % 2 == 0 ? 4.0 : 8.0, &n_cones);
        if (e >= 0.0) n_surfaces += 1;
        if (e > worst) worst = e;
    }
    print_message("largest relative difference %.2g; %lld surfaces, %lld cones\n", worst, (long long)n_surfaces,
                  (long long)n_cones);
    CHECK(n_surfaces >= 50);
    CHECK(worst < 1e-12);
}
