/* SPDX-License-Identifier: MIT
 * Closed forms of what a linear map does to one triangle, and of solid angles. */
#include "../test.h"
#include "kernel/conformal_kernel.h"
#include "kernel/distortion_kernel.h"
#include "unit/random_vectors.h"

#define PI 3.14159265358979323846

/* Points (x, y) of a random plane, moved. */
static void lay(uint64_t *count, double (*p)[2], loxo_vec3 out[3])
{
    loxo_vec3 x, y;
    draw_plane(count, &x, &y);
    const loxo_vec3 origin = draw_unit(count);
    for (int k = 0; k < 3; ++k)
        out[k] = v3_axpy(v3_axpy(origin, p[k][0], x), p[k][1], y);
}

TEST(a_stretched_triangle_has_its_energy_and_its_mu)
{
    uint64_t count = 0;
    for (int i = 0; i < 300; ++i) {
        double p[3][2], q[3][2];
        loxo_vec3 from[3], to[3];
        for (int k = 0; k < 6; ++k)
            p[k / 2][k % 2] = draw(&count);
        const double twice = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
        if (twice < 0.2) continue; /* counter-clockwise, no sliver */
        const double s1 = 1.0 + fabs(draw(&count)), s2 = 1.0 - 0.9 * fabs(draw(&count)), turn = PI * draw(&count);
        const double c = cos(turn), s = sin(turn);
        for (int k = 0; k < 3; ++k) { /* s1 along (c, s), s2 across */
            const double u = s1 * (c * p[k][0] + s * p[k][1]), v = s2 * (c * p[k][1] - s * p[k][0]);
            q[k][0] = c * u - s * v;
            q[k][1] = s * u + c * v;
        }
        lay(&count, p, from);
        lay(&count, q, to);
        const k_triangle face = k_triangle_of(from[0], from[1], from[2]), image = k_triangle_of(to[0], to[1], to[2]);
        const k_distortion d = k_distortion_of(&face, &image);
        const double first = atan2(p[1][1] - p[0][1], p[1][0] - p[0][0]), size = (s1 - s2) / (s1 + s2);
        /* some 50 operations on numbers near 1, angles of at least 0.02: 1e3 roundings */
        CHECK_NEAR(d.energy, 0.25 * twice * (s1 - s2) * (s1 - s2), 1e-13);
        CHECK_NEAR(d.dirichlet, 0.25 * twice * (s1 * s1 + s2 * s2), 1e-13);
        CHECK_NEAR(d.size, size, 1e-13);
        CHECK_NEAR(d.mu[0], size * cos(2.0 * (turn - first)), 1e-12);
        CHECK_NEAR(d.mu[1], size * sin(2.0 * (turn - first)), 1e-12);
        /* the mirror image has the same */
        const k_triangle turned = k_triangle_of(v3_scale(-1.0, to[0]), v3_scale(-1.0, to[1]), v3_scale(-1.0, to[2]));
        CHECK_NEAR(k_distortion_of(&face, &turned).size, size, 1e-13);
    }
}

TEST(energies_near_zero_keep_their_digits)
{
    const double e = 1e-9; /* energy 1e-18 of the area: the difference of Dirichlet energy and area is noise */
    const loxo_vec3 from[3] = {{0, 0, 0}, {1, 0, 0}, {0.3, 0.75, 0}},
                    to[3] = {{0, 0, 0}, {1.0 + e, 0, 0}, {0.3 * (1.0 + e), 0.75, 0}};
    const k_triangle face = k_triangle_of(from[0], from[1], from[2]), image = k_triangle_of(to[0], to[1], to[2]);
    const k_distortion d = k_distortion_of(&face, &image);
    CHECK_NEAR(d.energy / (0.25 * 0.75 * e * e), 1.0, 1e-6); /* 1 + e is known to 1e-16, 1e-7 of e, twice */
    CHECK_NEAR(d.size / (0.5 * e), 1.0, 1e-6);
    double sine, cosine;
    k_angle_error(&face, &image, 0, &sine, &cosine); /* atan(y / x): differs by e x y / (x^2 + y^2) */
    CHECK_NEAR(atan2(sine, cosine) / (e * 0.3 * 0.75 / (0.09 + 0.5625)), 1.0, 1e-6);
}

TEST(an_image_without_area_has_the_worst_mu)
{
    const loxo_vec3 p[3] = {{0, 0, 0}, {1, 0, 0}, {0.2, 1, 0}}, zero = {0, 0, 0};
    const k_triangle face = k_triangle_of(p[0], p[1], p[2]), point = k_triangle_of(p[1], p[1], p[1]);
    const k_triangle line = k_triangle_of(zero, p[1], v3_scale(0.25, p[1])), side = k_triangle_of(zero, zero, p[1]);
    CHECK_EQUAL(k_distortion_of(&face, &point).size, 1.0);
    CHECK_EQUAL(k_distortion_of(&face, &line).size, 1.0);
    /* a = 1, b = 0.25 - 0.2 a along one line: E_T = |T| / 2 (1 + 0.05^2) */
    CHECK_NEAR(k_distortion_of(&face, &line).energy, 0.25 * (1.0 + 0.0025), 1e-15);
    double sine, cosine;
    k_angle_error(&face, &point, 1, &sine, &cosine); /* a right angle in place of atan(1 / 0.8) */
    CHECK_NEAR(atan2(sine, cosine), 0.5 * PI - atan2(1.0, 0.8), 1e-15);
    k_angle_error(&face, &side, 2, &sine, &cosine); /* 0 beside the side without length ... */
    CHECK_NEAR(atan2(sine, cosine), PI - atan2(1.0, 0.2) - atan2(1.0, 0.8), 1e-15);
    k_angle_error(&face, &line, 2, &sine, &cosine); /* ... and pi between the ends of a line */
    CHECK_NEAR(atan2(sine, cosine), atan2(1.0, 0.2) + atan2(1.0, 0.8), 1e-15);
}

TEST(ranks_of_angles_grow_and_come_back)
{
    double before = -1.0;
    for (int i = 0; i <= 1000; ++i) {
        const double angle = PI * i / 1000.0, rank = k_angle_rank(sin(angle), cos(angle));
        CHECK(rank > before);
        CHECK_NEAR(k_angle_of_rank(rank), angle, 4e-16 * 4.0);
        before = rank;
    }
    CHECK_EQUAL(k_angle_rank(0.0, 1.0), 0.0);
    CHECK_NEAR(k_angle_of_rank(k_angle_rank(1e-200, 1.0)), 1e-200, 1e-215);
}

TEST(solid_angles_of_lunes)
{
    /* From a pole to two points near the other one: twice the angle between their meridians. Before any turn the angle is good to
     * rounding; positions turned are good to 1e-16, of 1e-8 that is 1e-8. */
    for (int i = 0; i < 2; ++i) {
        const double e = i == 0 ? 1e-10 : 1e-8, angle = 0.7;
        const loxo_vec3 top = {0, 0, 1}, b = {e, 0, -sqrt(1.0 - e * e)}, c = {e * cos(angle), e * sin(angle), b.z};
        loxo_vec3 x, y, corner[3] = {top, c, b};
        uint64_t count = 5;
        draw_plane(&count, &x, &y);
        const loxo_vec3 z = v3_cross(x, y);
        for (int k = 0; k < 3 && i == 1; ++k) {
            const loxo_vec3 p = corner[k];
            corner[k] = v3_axpy(v3_axpy(v3_scale(p.x, x), p.y, y), p.z, z);
        }
        for (int k = 0; k < 3; ++k) {
            const loxo_vec3 p = corner[k], q = corner[(k + 1) % 3], r = corner[(k + 2) % 3];
            CHECK_NEAR(k_solid_angle(p, q, r), -2.0 * angle, i == 0 ? 1e-12 : 1e-6);
            CHECK_NEAR(k_solid_angle(p, r, q), 2.0 * angle, i == 0 ? 1e-12 : 1e-6);
        }
    }
    /* an eighth of the sphere, and a small flat triangle */
    const loxo_vec3 x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1}, near = {1, 1e-9, 0}, above = {1, 0, 1e-9};
    CHECK_NEAR(k_solid_angle(x, y, z), 0.5 * PI, 1e-15);
    CHECK_NEAR(k_solid_angle(x, near, above), 0.5e-18, 1e-33);
}
