/* SPDX-License-Identifier: MIT
 * Fronts that cross an edge, against closed forms and a slow search; corners of fans. */
#include "base/rng.h"
#include "kernel/jet_kernel.h"
#include "kernel/variants.h"
#include "test.h"

static double uniform(uint64_t *state, double low, double high)
{
    return low + (high - low) * loxo_random_unit(7, (*state)++);
}

/* The edge from (0, 0) to (length, 0), the vertex beyond at (px, py). */
static void set_place(k_jet_batch *b, int i, double length, double px, double py)
{
    b->base_square[i] = length * length;
    b->a_square[i] = px * px + py * py;
    b->b_square[i] = (px - length) * (px - length) + py * py;
}

/* All rays from one point below the edge: the arrival is its distance, the crossing that of a straight line. Coefficients are
 * doubles, so only the crossing has the rounding of floats; the arrival is flat there. */
TEST(one_point_is_exact)
{
    static k_jet_batch b;
    double truth[K_JETS], crossing[K_JETS];
    uint64_t state = 1;
    for (int round = 0; round < 200; ++round) {
        for (int i = 0; i < K_JETS; ++i) {
            const double length = uniform(&state, 0.1, 3.0), sigma = uniform(&state, 0.0, 50.0);
            const double px = uniform(&state, -0.5, 1.5) * length, py = uniform(&state, 0.2, 2.0) * length;
            const double depth = length * exp(uniform(&state, log(0.05), log(1000.0)));
            crossing[i] = uniform(&state, 0.01, 0.99); /* the point lies on the line through there */
            const double x = crossing[i] * length, scale = depth / py, sx = x + (x - px) * scale, sy = -depth;
            const double a = hypot(sx, sy), c = hypot(length - sx, sy);
            set_place(&b, i, length, px, py);
            b.d_a[i] = sigma + a;
            b.d_b[i] = sigma + c;
            b.slope_a[i] = -sx / a;
            b.slope_b[i] = -(length - sx) / c;
            b.sigma[i] = sigma;
            truth[i] = sigma + hypot(px - sx, py - sy);
        }
        k_jet_arrivals(&b);
        for (int i = 0; i < K_JETS; ++i) {
            const double length = sqrt(b.base_square[i]);
            CHECK_NEAR(b.arrival[i], truth[i], 2e-4 * length);
            CHECK_NEAR(b.crossing[i], crossing[i], 0.03);
            CHECK(b.arrival[i] >= truth[i] - 1e-9 * truth[i]); /* no way is shorter than the straight one */
            CHECK(b.doubt[i] < 1e-3 * length);
        }
    }
}

/* Smooth fronts that are no circles: the least over the edge by a fine search is what the steps find. */
TEST(steps_find_the_least)
{
    static k_jet_batch b;
    uint64_t state = 99;
    double worst = 0.0;
    for (int round = 0; round < 50; ++round) {
        for (int i = 0; i < K_JETS; ++i) {
            const double direction = uniform(&state, -0.6, 0.6), bend = uniform(&state, -0.15, 0.15);
            const double distance = uniform(&state, 3.0, 100.0);
            set_place(&b, i, 1.0, uniform(&state, 0.2, 0.8), uniform(&state, 0.5, 1.5));
            b.sigma[i] = 0.0;
            b.d_a[i] = distance;
            b.d_b[i] = distance + direction;
            b.slope_a[i] = direction + bend;
            b.slope_b[i] = -direction + bend;
        }
        k_jet_arrivals(&b);
        for (int i = 0; i < K_JETS; ++i) {
            const double q_a = b.d_a[i] * b.d_a[i], q_b = b.d_b[i] * b.d_b[i];
            const double g_a = 2.0 * b.d_a[i] * b.slope_a[i], g_b = -2.0 * b.d_b[i] * b.slope_b[i];
            const double px = 0.5 * (1.0 + b.a_square[i] - b.b_square[i]), py = sqrt(b.a_square[i] - px * px);
            double least = HUGE_VAL;
            for (int k = 0; k <= 20000; ++k) {
                const double t = (double)k / 20000.0, s = 1.0 - t;
                const double q =
                    q_a * s * s * (1.0 + 2.0 * t) + g_a * t * s * s + q_b * t * t * (3.0 - 2.0 * t) - g_b * t * t * s;
                least = fmin(least, sqrt(q) + hypot(t - px, py));
            }
            worst = fmax(worst, b.arrival[i] - least);
            CHECK_NEAR(b.arrival[i], least, 1e-5); /* what three steps leave of the crossing, squared */
        }
    }
    print_message("arrivals over the least by %.1e at most\n", worst);
}

TEST(edges_without_length_give_no_crossing)
{
    static k_jet_batch b;
    for (int i = 0; i < K_JETS; ++i) {
        set_place(&b, i, i % 2 ? 0.0 : 1.0, 0.5, i % 3 ? 0.7 : 0.0);
        b.d_a[i] = b.d_b[i] = i % 5 ? 3.0 : 0.0;
        b.slope_a[i] = b.slope_b[i] = 0.0;
        b.sigma[i] = 0.0;
    }
    k_jet_arrivals(&b);
    for (int i = 0; i < K_JETS; ++i) {
        const bool is_taken = b.crossing[i] > 0.0 && b.crossing[i] < 1.0;
        CHECK(i % 2 ? !is_taken || !isfinite(b.arrival[i]) : isfinite(b.arrival[i]));
    }
}

TEST(corners_of_a_fan)
{
    enum { N = 100 };
    double angle[N], length[N + 1], spoke[N + 1], rim[N], cosine[N], sine[N];
    uint64_t state = 5;
    for (int i = 0; i <= N; ++i) {
        length[i] = uniform(&state, 0.5, 2.0);
        spoke[i] = length[i] * length[i];
    }
    for (int i = 0; i < N; ++i) {
        angle[i] = uniform(&state, 0.01, 3.1);
        rim[i] = spoke[i] + spoke[i + 1] - 2.0 * length[i] * length[i + 1] * cos(angle[i]);
    }
    k_ring_corners(N, spoke, rim, cosine, sine);
    for (int i = 0; i < N; ++i) {
        CHECK_NEAR(spoke[i], length[i], 1e-15);
        CHECK_NEAR(cosine[i], cos(angle[i]), 2e-15);
        CHECK_NEAR(sine[i], sin(angle[i]), 1e-12); /* from the cosine: its rounding over the sine */
    }
    double none[2] = {0.0, 1.0}, across = 1.0;
    k_ring_corners(1, none, &across, cosine, sine);
    CHECK(cosine[0] == 1.0 && sine[0] == 0.0);
}

static void arrive(loxo_isa isa, void *data) { k_variant_get(isa)->jet_arrivals(data); }

TEST(same_bits_for_all_instruction_sets)
{
    static k_jet_batch in, out;
    uint64_t state = 3;
    for (int i = 0; i < K_JETS; ++i) {
        const double slope = uniform(&state, -0.9, 0.9);
        set_place(&in, i, uniform(&state, 0.1, 2.0), uniform(&state, -1.0, 2.0), uniform(&state, 0.0, 2.0));
        in.d_a[i] = uniform(&state, 1.0, 5.0);
        in.d_b[i] = in.d_a[i] + slope * sqrt(in.base_square[i]);
        in.slope_a[i] = slope + uniform(&state, -0.1, 0.1);
        in.slope_b[i] = -slope;
        in.sigma[i] = uniform(&state, 0.0, 0.5);
    }
    test_same_for_any_isa(arrive, &in, sizeof in, &out);
}
