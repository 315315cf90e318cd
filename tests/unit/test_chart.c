/* SPDX-License-Identifier: MIT
 * The sphere's angles as coordinates of maps: derivatives of a triangle's area by differences, and against the entries that the paper prints. */
#include "base/rng.h"
#include "kernel/chart_kernel.h"
#include "test.h"

typedef long double real;

static double random_in(uint64_t seed, uint64_t i, double low, double high)
{
    return low + (high - low) * loxo_random_unit(seed, i);
}

/* Three points, not too near each other or the poles; some triangles are turned over. */
static void make_angles(uint64_t seed, double x[6])
{
    for (uint64_t i = 0; i < 3; ++i) {
        x[2 * i] = random_in(seed, 2 * i, -3.0, 3.0);
        x[2 * i + 1] = random_in(seed, 2 * i + 1, 0.3, 2.8);
    }
}

/* The signed area, in long double, from angles. */
static real find_area(const real x[6])
{
    real f[3][3], u[2][3], n[3], side = 0.0L;
    for (int i = 0; i < 3; ++i) {
        f[i][0] = cosl(x[2 * i]) * sinl(x[2 * i + 1]);
        f[i][1] = sinl(x[2 * i]) * sinl(x[2 * i + 1]);
        f[i][2] = cosl(x[2 * i + 1]);
    }
    for (int k = 0; k < 3; ++k) {
        u[0][k] = f[1][k] - f[0][k];
        u[1][k] = f[2][k] - f[0][k];
    }
    for (int k = 0; k < 3; ++k) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        n[k] = u[0][a] * u[1][b] - u[0][b] * u[1][a];
        side += n[k] * (f[0][k] + f[1][k] + f[2][k]);
    }
    return copysignl(0.5L * sqrtl(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]), side);
}

/* Differences of fourth order; with steps of 1e-3 their error is 1e-12 of the sixth derivatives', and rounding 1e-19 / 1e-6. */
#define STEP 1e-3L
static const real at[4] = {-2.0L, -1.0L, 1.0L, 2.0L},
                  share[4] = {1.0L / 12.0L, -2.0L / 3.0L, 2.0L / 3.0L, -1.0L / 12.0L};

static real first_difference(const double x[6], int i)
{
    real sum = 0.0L;
    for (int k = 0; k < 4; ++k) {
        real y[6];
        for (int j = 0; j < 6; ++j)
            y[j] = (real)x[j];
        y[i] += at[k] * STEP;
        sum += share[k] * find_area(y);
    }
    return sum / STEP;
}

static real second_difference(const double x[6], int i, int j)
{
    real sum = 0.0L;
    for (int k = 0; k < 4; ++k)
        for (int l = 0; l < 4; ++l) {
            real y[6];
            for (int m = 0; m < 6; ++m)
                y[m] = (real)x[m];
            y[i] += at[k] * STEP;
            y[j] += at[l] * STEP;
            sum += share[k] * share[l] * find_area(y);
        }
    return sum / (STEP * STEP);
}

typedef struct triangle {
    k_chart_frame frame[3];
    k_image_face face;
} triangle;

static triangle triangle_of(const double x[6])
{
    triangle t;
    for (int i = 0; i < 3; ++i)
        t.frame[i] = k_chart_frame_of(x[2 * i], x[2 * i + 1]);
    t.face = k_image_face_of(t.frame[0].f, t.frame[1].f, t.frame[2].f);
    return t;
}

/* Minus the area's Hessian, as it stands in that of the energy: with the chart's bending on the diagonal. */
static void find_block(const triangle *t, int i, int j, double block[4])
{
    double bending[4];
    memset(block, 0, 4 * sizeof *block);
    k_chart_add_area(&t->face, i, &t->frame[i], j, &t->frame[j], block);
    if (i != j) return;
    k_chart_bending(&t->frame[i], v3_scale(-1.0, k_image_area_gradient(&t->face, i)), bending);
    for (int k = 0; k < 4; ++k)
        block[k] -= bending[k];
}

TEST(angles_and_points_are_inverse)
{
    for (uint64_t seed = 0; seed < 100; ++seed) {
        const double theta = random_in(seed, 0, -3.14, 3.14), phi = random_in(seed, 1, 0.0, 3.14159);
        double back[2];
        k_chart_angles(k_chart_frame_of(theta, phi).f, &back[0], &back[1]);
        CHECK_NEAR(back[0], theta, 1e-15 / sin(phi));
        CHECK_NEAR(back[1], phi, 2e-15);
    }
    double north[2];
    k_chart_angles((loxo_vec3){0.0, 0.0, 1.0}, &north[0], &north[1]);
    CHECK_EQUAL(north[0], 0.0);
    CHECK_EQUAL(north[1], 0.0);
}

TEST(derivatives_of_the_area_agree_with_differences)
{
    for (uint64_t seed = 0; seed < 60; ++seed) {
        double x[6];
        make_angles(seed, x);
        const triangle t = triangle_of(x);
        /* Nearly flat triangles have derivatives without bound: differences do not see these. */
        if (fabs(t.face.area) < 0.05) continue;
        for (int i = 0; i < 3; ++i) {
            double g[2];
            k_chart_gradient(&t.frame[i], k_image_area_gradient(&t.face, i), g);
            for (int a = 0; a < 2; ++a)
                CHECK_NEAR(g[a], (double)first_difference(x, 2 * i + a), 1e-9);
            for (int j = 0; j < 3; ++j) {
                double block[4];
                find_block(&t, i, j, block);
                for (int a = 0; a < 2; ++a)
                    for (int b = 0; b < 2; ++b) {
                        const double expected = -(double)second_difference(x, 2 * i + a, 2 * j + b);
                        CHECK_NEAR(block[2 * a + b], expected, 1e-8 * fmax(1.0, fabs(expected)));
                    }
            }
        }
    }
}

/* Entries of (3.32), as the paper writes them, of one triangle (i, j, k) in turn. Its areas have no sign. */
static void find_printed(const triangle *t, int i, int j, double block[4])
{
    const int third = 3 - i - j;
    loxo_vec3 f[3], frame[3][2], area_gradient[3];
    double cotangent[3]; /* at each corner */
    for (int k = 0; k < 3; ++k) {
        f[k] = t->frame[k].f;
        frame[k][0] = t->frame[k].theta;
        frame[k][1] = t->frame[k].phi;
    }
    const double area = 0.5 * v3_norm(v3_cross(v3_sub(f[1], f[0]), v3_sub(f[2], f[0])));
    for (int k = 0; k < 3; ++k)
        cotangent[k] = v3_dot(v3_sub(f[(k + 1) % 3], f[k]), v3_sub(f[(k + 2) % 3], f[k])) / (2.0 * area);
    for (int k = 0; k < 3; ++k) { /* (3.26) */
        const int l = (k + 1) % 3, m = (k + 2) % 3;
        area_gradient[k] = v3_scale(
            0.5, v3_sub(v3_scale(cotangent[m], v3_sub(f[k], f[l])), v3_scale(cotangent[l], v3_sub(f[m], f[k]))));
    }
    for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b) {
            const double both = 4.0 * v3_dot(frame[i][a], area_gradient[i]) * v3_dot(frame[j][b], area_gradient[j]);
            double *to = &block[2 * a + b];
            if (i == j) {
                const int l = (i + 1) % 3, m = (i + 2) % 3;
                const loxo_vec3 across = v3_sub(f[l], f[m]), own = f[i];
                *to = (both + v3_dot(frame[i][a], across) * v3_dot(frame[i][b], across)) / (4.0 * area);
                for (int n = 0; n < 2; ++n) { /* sum of -w_ij(f) times what stands beside it */
                    const int other = n == 0 ? l : m;
                    const double w = 0.5 * cotangent[3 - i - other];
                    const loxo_vec3 o = f[other];
                    const double beside = a == 0 && b == 0   ? own.x * o.x + own.y * o.y
                                          : a == 1 && b == 1 ? v3_dot(own, o)
                                                             : t->frame[i].phi.y * o.x - t->frame[i].phi.x * o.y;
                    *to -= w * beside;
                }
                continue;
            }
            const loxo_vec3 ki = v3_sub(f[third], f[i]), jk = v3_sub(f[j], f[third]);
            *to = (both + 2.0 * v3_dot(frame[i][a], ki) * v3_dot(frame[j][b], jk) -
                   v3_dot(frame[i][a], jk) * v3_dot(frame[j][b], ki)) /
                  (4.0 * area);
            *to += 0.5 * cotangent[third] * v3_dot(frame[i][a], frame[j][b]);
        }
}

TEST(blocks_are_those_of_theorem_3)
{
    int n_turned = 0;
    for (uint64_t seed = 0; seed < 200; ++seed) {
        double x[6];
        make_angles(seed, x);
        triangle t = triangle_of(x);
        t.face = k_chart_face_of(t.frame[0].f, t.frame[1].f, t.frame[2].f); /* the paper's areas have no sign */
        if (t.face.area < 1e-3) continue;
        n_turned += triangle_of(x).face.area < 0.0;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                double block[4], printed[4];
                find_block(&t, i, j, block);
                find_printed(&t, i, j, printed);
                /* Rounding of terms of the size 1 / area. */
                for (int k = 0; k < 4; ++k)
                    CHECK_NEAR(block[k], printed[k], 1e-14 / t.face.area);
            }
    }
    CHECK(n_turned > 50); /* half of random triangles look inward */
}

TEST(blocks_are_symmetric_to_the_bit)
{
    for (uint64_t seed = 0; seed < 50; ++seed) {
        double x[6];
        make_angles(seed, x);
        const triangle t = triangle_of(x);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                double block[4], mirrored[4];
                find_block(&t, i, j, block);
                find_block(&t, j, i, mirrored);
                CHECK(block[1] == mirrored[2] && block[2] == mirrored[1]);
                CHECK(block[0] == mirrored[0] && block[3] == mirrored[3]);
            }
    }
}

TEST(turning_about_the_axis_changes_no_area)
{
    for (uint64_t seed = 0; seed < 50; ++seed) {
        double x[6];
        make_angles(seed, x);
        const triangle t = triangle_of(x);
        for (int i = 0; i < 3; ++i) {
            double sum[2] = {0.0, 0.0}, size = 0.0;
            for (int j = 0; j < 3; ++j) {
                double block[4];
                find_block(&t, i, j, block);
                sum[0] += block[0];
                sum[1] += block[2];
                size += fabs(block[0]) + fabs(block[2]);
            }
            CHECK_NEAR(sum[0], 0.0, 1e-14 * (1.0 + size / fabs(t.face.area)));
            CHECK_NEAR(sum[1], 0.0, 1e-14 * (1.0 + size / fabs(t.face.area)));
        }
    }
}
