/* SPDX-License-Identifier: MIT
 * Exact polyhedral distances against closed forms: planes, planes with a hole, cones of any angle, a cube, a tube. Tolerances
 * are rounding errors: some 1e-16 of the distance a face that a way crosses, at random. */
#include "../shapes.h"
#include "surfaces.h"

#include <loxo/geodesic.h>

static const double pi = 3.14159265358979323846;

static double *exact_from(const surface *s, loxo_index source)
{
    const loxo_geodesic_settings settings = unjudged_settings(LOXO_GEODESIC_EXACT);
    double *distance = surface_numbers(s);
    CHECK_OK(loxo_geodesic_distance(test_context, s->mesh, &settings, &source, 1, distance, NULL));
    return distance;
}

/* On a convex plane the distance is that through the air, whatever the triangles. The long strip: 20,000 edges in a row. */
TEST(planes_are_flat)
{
    static const struct {
        loxo_shape shape;
        int64_t n_vertices;
    } cases[] = {{LOXO_SHAPE_DISK, 2000}, {LOXO_SHAPE_GRID, 2000}, {LOXO_SHAPE_STRIP, 10000}};
    NEEDS_IDS(10002);
    for (int i = 0; i < 3; ++i) {
        surface s = surface_make(test_context, cases[i].shape, cases[i].n_vertices, NAN);
        const int64_t n = s.soup.n_vertices;
        for (int k = 0; k < 3; ++k) {
            const loxo_index source = (loxo_index)(k * (n - 1) / 2);
            const double *a = &s.soup.position[3 * source];
            double *distance = exact_from(&s, source);
            for (int64_t v = 0; v < n; ++v) {
                const double *p = &s.soup.position[3 * v], d = hypot(p[0] - a[0], p[1] - a[1]);
                CHECK_NEAR(distance[v], d, 1e-12 * d);
            }
            loxo_release(test_context, distance);
        }
        surface_destroy(&s);
    }
}

/* ---- a square with a rectangular hole ---- */

#define HOLE_N 20
static const double hole[4] = {0.3, 0.6, 0.25, 0.8}; /* x from, to, y from, to: multiples of 1/20 */

/* Does the segment pass through the inside of the hole? Cut against its four sides. */
static bool crosses_hole(const double *a, const double *b)
{
    double from = 0.0, to = 1.0;
    for (int k = 0; k < 2; ++k) {
        const double d = b[k] - a[k], low = hole[2 * k] + 1e-9, high = hole[2 * k + 1] - 1e-9;
        if (fabs(d) < 1e-14) {
            if (a[k] <= low || a[k] >= high) return false;
            continue;
        }
        const double t0 = (low - a[k]) / d, t1 = (high - a[k]) / d;
        from = fmax(from, fmin(t0, t1));
        to = fmin(to, fmax(t0, t1));
    }
    return from < to;
}

static double around_hole(const double *a, const double *b)
{
    double corner[6][2], d[6][6];
    for (int i = 0; i < 4; ++i) {
        corner[i][0] = hole[i % 2];
        corner[i][1] = hole[2 + i / 2];
    }
    memcpy(corner[4], a, 2 * sizeof *a);
    memcpy(corner[5], b, 2 * sizeof *b);
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j)
            d[i][j] = crosses_hole(corner[i], corner[j])
                          ? HUGE_VAL
                          : hypot(corner[i][0] - corner[j][0], corner[i][1] - corner[j][1]);
    for (int k = 0; k < 6; ++k)
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j)
                d[i][j] = fmin(d[i][j], d[i][k] + d[k][j]);
    return d[4][5];
}

TEST(ways_bend_at_the_corners_of_a_hole)
{
    const int n = HOLE_N + 1;
    loxo_soup soup = shape_empty(test_context, (int64_t)n * n, (int64_t)2 * HOLE_N * HOLE_N);
    int64_t n_faces = 0;
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            double *p = &soup.position[3 * ((int64_t)j * n + i)];
            p[0] = i / (double)HOLE_N;
            p[1] = j / (double)HOLE_N;
            p[2] = 0.0;
            if (i == HOLE_N || j == HOLE_N) continue;
            if (p[0] > hole[0] - 1e-9 && p[0] < hole[1] - 1e-9 && p[1] > hole[2] - 1e-9 && p[1] < hole[3] - 1e-9)
                continue;
            const int a = j * n + i, quad[2][2][3] = {{{a, a + 1, a + n + 1}, {a, a + n + 1, a + n}},
                                                      {{a, a + 1, a + n}, {a + 1, a + n + 1, a + n}}};
            for (int k = 0; k < 6; ++k)
                soup.triangle[3 * n_faces + k] = (loxo_index)quad[(i * 7 + j * 3) % 2][k / 3][k % 3];
            n_faces += 2;
        }
    soup.n_faces = n_faces;
    surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
    static const int sources[4] = {0, 5 * 21 + 2, 10 * 21 + 6, 16 * 21 + 12}; /* two of them at the hole */
    for (int k = 0; k < 4; ++k) {
        double *distance = exact_from(&s, (loxo_index)sources[k]);
        for (int64_t v = 0; v < soup.n_vertices; ++v) {
            const double *p = &soup.position[3 * v];
            if (isinf(distance[v])) { /* inside the hole there are no faces */
                CHECK(p[0] > hole[0] && p[0] < hole[1] && p[1] > hole[2] && p[1] < hole[3]);
                continue;
            }
            CHECK_NEAR(distance[v], around_hole(&soup.position[3 * (int64_t)sources[k]], p), 1e-13);
        }
        loxo_release(test_context, distance);
    }
    surface_destroy(&s);
}

/* ---- cones: flat but for one vertex, whose angles sum to anything ---- */

#define CONE_RAYS  24
#define CONE_RINGS 6

/* Unit vectors around an axis, on a circle or, for more than 2 pi, up and down in turns, that are an angle apart. */
static void cone_rays(double total, double ray[CONE_RAYS][3])
{
    const double wanted = cos(total / CONE_RAYS), around = cos(2.0 * pi / CONE_RAYS);
    /* cos^2 h around +- sin^2 h = wanted */
    const double sign = total <= 2.0 * pi ? 1.0 : -1.0, square = (wanted - around) / (sign - around);
    for (int k = 0; k < CONE_RAYS; ++k) {
        const double a = 2.0 * pi * k / CONE_RAYS, flat = sqrt(1.0 - square);
        ray[k][0] = flat * cos(a);
        ray[k][1] = flat * sin(a);
        ray[k][2] = sqrt(square) * (total <= 2.0 * pi || k % 2 == 0 ? 1.0 : -1.0);
    }
}

TEST(cones_of_any_angle)
{
    static const double totals[] = {1.0, 2.5, 4.0, 6.0, 6.5, 8.0, 12.0, 20.0};
    for (int t = 0; t < 8; ++t) {
        const double total = totals[t];
        double ray[CONE_RAYS][3];
        loxo_soup soup = shape_empty(test_context, 1 + CONE_RAYS * CONE_RINGS, CONE_RAYS * (2 * CONE_RINGS - 1));
        int64_t f = 0;
        cone_rays(total, ray);
        memset(soup.position, 0, 3 * sizeof *soup.position);
        for (int j = 0; j < CONE_RINGS; ++j)
            for (int k = 0; k < CONE_RAYS; ++k) {
                const int a = 1 + j * CONE_RAYS + k, b = 1 + j * CONE_RAYS + (k + 1) % CONE_RAYS;
                for (int i = 0; i < 3; ++i)
                    soup.position[3 * a + i] = (j + 1.0) / CONE_RINGS * ray[k][i];
                const int inner[3] = {j == 0 ? 0 : a - CONE_RAYS, a, b}, outer[3] = {a - CONE_RAYS, b, b - CONE_RAYS};
                for (int i = 0; i < 3; ++i)
                    soup.triangle[3 * f + i] = (loxo_index)inner[i];
                f += 1;
                for (int i = 0; i < 3 && j > 0; ++i)
                    soup.triangle[3 * f + i] = (loxo_index)outer[i];
                f += j > 0;
            }
        surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
        for (int source = 0; source < 1 + CONE_RAYS * CONE_RINGS; source += 29) {
            double *distance = exact_from(&s, (loxo_index)source);
            for (int v = 0; v < 1 + CONE_RAYS * CONE_RINGS; ++v) {
                const double r = source == 0 ? 0.0 : ((source - 1) / CONE_RAYS + 1.0) / CONE_RINGS;
                const double q = v == 0 ? 0.0 : ((v - 1) / CONE_RAYS + 1.0) / CONE_RINGS;
                const int steps = source == 0 || v == 0 ? 0 : abs((source - 1) % CONE_RAYS - (v - 1) % CONE_RAYS);
                const double angle = total / CONE_RAYS * (steps < CONE_RAYS - steps ? steps : CONE_RAYS - steps);
                const double d = angle < pi ? sqrt((r - q) * (r - q) + 4.0 * r * q * pow(sin(0.5 * angle), 2)) : r + q;
                CHECK_NEAR(distance[v], d, 1e-13);
            }
            loxo_release(test_context, distance);
        }
        surface_destroy(&s);
    }
}

/* ---- a cube and a tube ---- */

/* From a corner, a point of a far face is reached over one of the two near faces beside it. */
TEST(cube_from_a_corner)
{
    loxo_soup soup = shape_cube(test_context);
    CHECK_OK(loxo_soup_subdivide(test_context, &soup, 3));
    surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
    double *distance = exact_from(&s, 0);
    for (int64_t v = 0; v < soup.n_vertices; ++v) {
        const double *p = &soup.position[3 * v];
        double d = HUGE_VAL;
        for (int k = 0; k < 3; ++k) {
            const double a = p[(k + 1) % 3], b = p[(k + 2) % 3];
            if (p[k] == 0.0) d = fmin(d, hypot(a, b));
            if (p[k] == 1.0) d = fmin(d, fmin(hypot(a, 1.0 + b), hypot(b, 1.0 + a)));
        }
        CHECK_NEAR(distance[v], d, 1e-14);
    }
    CHECK_NEAR(distance[6], sqrt(5.0), 1e-14); /* the corner across */
    loxo_release(test_context, distance);
    surface_destroy(&s);
}

/* A prism without ends: flat, and closed one way. */
TEST(tube_is_a_plane_that_repeats)
{
    const int around = 11, along = 14;
    const double side = 2.0 * sin(pi / around), step = 0.3;
    loxo_soup soup = shape_empty(test_context, (int64_t)around * (along + 1), (int64_t)2 * around * along);
    int64_t f = 0;
    for (int j = 0; j <= along; ++j)
        for (int i = 0; i < around; ++i) {
            const int a = j * around + i, b = j * around + (i + 1) % around;
            const int faces[2][3] = {{a, b, b + around}, {a, b + around, a + around}};
            soup.position[3 * a] = cos(2.0 * pi * i / around);
            soup.position[3 * a + 1] = sin(2.0 * pi * i / around);
            soup.position[3 * a + 2] = step * j;
            for (int k = 0; k < 6 && j < along; ++k)
                soup.triangle[3 * f + k] = (loxo_index)faces[k / 3][k % 3];
            f += j < along ? 2 : 0;
        }
    surface s = surface_from_soup(test_context, soup, LOXO_ORDER_AUTO);
    for (int source = 0; source < soup.n_vertices; source += 31) {
        double *distance = exact_from(&s, (loxo_index)source);
        for (int v = 0; v < soup.n_vertices; ++v) {
            const int steps = abs(source % around - v % around);
            const double u = side * (steps < around - steps ? steps : around - steps);
            CHECK_NEAR(distance[v], hypot(u, step * (source / around - v / around)), 1e-14 * 10.0);
        }
        loxo_release(test_context, distance);
    }
    surface_destroy(&s);
}
