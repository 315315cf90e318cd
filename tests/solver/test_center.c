/* SPDX-License-Identifier: MIT
 * Moebius centring: what a known Moebius map moved comes back, the weighted mean is 0, rotations change nothing; lumped areas. */
#include "../shapes.h"
#include "kernel/ball_kernel.h"
#include "kernel/variants.h"

#include <loxo/center.h>
#include <loxo/mesh.h>

#define N_VERTICES 2000

/* A sphere mesh with areas that are not its own. */
typedef struct map {
    loxo_soup soup;
    double *area;
    int64_t n;
} map;

static map map_make(void)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    map m = {.n = 0};
    settings.shape = LOXO_SHAPE_ICOSPHERE;
    settings.n_vertices = N_VERTICES;
    CHECK_OK(loxo_generate(test_context, &settings, false, &m.soup));
    m.n = m.soup.n_vertices;
    m.area = loxo_allocate(test_context, m.n, sizeof *m.area);
    for (int64_t i = 0; i < m.n; ++i)
        m.area[i] = 1.0 + 0.9 * sin(3.0 * (double)i) + (m.soup.position[3 * i] > 0.3 ? 2.0 : 0.0);
    return m;
}

static void map_free(map *m)
{
    loxo_release(test_context, m->area);
    loxo_soup_destroy(test_context, &m->soup);
}

/* Length of the mean, summed in long doubles. */
static double mean_of(const map *m, const double *x)
{
    long double sum[4] = {0};
    for (int64_t i = 0; i < m->n; ++i) {
        for (int k = 0; k < 3; ++k)
            sum[k] += (long double)m->area[i] * (long double)x[3 * i + k];
        sum[3] += (long double)m->area[i];
    }
    return (double)(sqrtl(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) / sum[3]);
}

static double farthest(int64_t n, const double *a, const double *b)
{
    double most = 0.0;
    for (int64_t i = 0; i < 3 * n; ++i)
        most = fmax(most, fabs(a[i] - b[i]));
    return most;
}

/* Of a centred map f the map sigma_w o f has its barycenter at sigma_w(0) = -w, and sigma_(-w) brings f back. Moving there and back
 * loses eps / (1 - |w|) of a position, twice; the mean is 0 to rounding anyhow. */
TEST(what_a_known_map_moved_comes_back)
{
    static const double gaps[] = {0.7, 0.1, 1e-2, 1e-4, 1e-6};
    map m = map_make();
    double *centred = loxo_allocate(test_context, 3 * m.n, sizeof *centred);
    double *moved = loxo_allocate(test_context, 3 * m.n, sizeof *moved);
    loxo_center_info info;
    CHECK_OK(loxo_moebius_center(test_context, m.n, m.soup.position, NULL, m.area, NULL, centred, &info));
    CHECK(info.mean_before > 0.05 && info.mean_after <= 1e-15 && info.off_sphere <= 4e-16);
    CHECK_NEAR(info.mean_before, mean_of(&m, m.soup.position), 1e-15);
    CHECK(mean_of(&m, centred) <= 1e-15);
    for (int g = 0; g < 5; ++g) {
        const double gap = gaps[g], unit[3] = {0.48, -0.6, 0.64};
        double w[3];
        loxo_moebius shift;
        for (int k = 0; k < 3; ++k)
            w[k] = (1.0 - gap) * unit[k];
        CHECK_OK(loxo_moebius_set_identity(test_context, 3, &shift));
        CHECK_OK(loxo_moebius_append_shift(test_context, &shift, w, 0.0));
        CHECK_OK(loxo_moebius_map_sphere(test_context, &shift, m.n, centred, moved));
        CHECK_OK(loxo_moebius_center(test_context, m.n, moved, NULL, m.area, NULL, moved, &info)); /* in place */
        CHECK(info.barycenter.kind == LOXO_BARYCENTER_STABLE);
        CHECK_NEAR(info.barycenter.gap, gap, 1e-9 * gap + 1e-15);
        for (int k = 0; k < 3; ++k)
            CHECK_NEAR(info.barycenter.w[k], -w[k], 1e-15);
        CHECK(info.mean_after <= 1e-15 && mean_of(&m, moved) <= 1e-15);
        CHECK_NEAR(farthest(m.n, moved, centred), 0.0, 2e-15 / gap + 4e-15);
    }
    loxo_release(test_context, centred);
    loxo_release(test_context, moved);
    map_free(&m);
}

TEST(rotations_and_units_change_nothing)
{
    static const double turn[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0.0}, {0.48, 0.64, 0.6}};
    map m = map_make();
    double *centred = loxo_allocate(test_context, 3 * m.n, sizeof *centred);
    double *turned = loxo_allocate(test_context, 3 * m.n, sizeof *turned);
    CHECK_OK(loxo_moebius_center(test_context, m.n, m.soup.position, NULL, m.area, NULL, centred, NULL));
    for (int64_t i = 0; i < m.n; ++i) {
        for (int k = 0; k < 3; ++k)
            turned[3 * i + k] = turn[k][0] * m.soup.position[3 * i] + turn[k][1] * m.soup.position[3 * i + 1] +
                                turn[k][2] * m.soup.position[3 * i + 2];
        m.area[i] *= 1e9; /* another unit */
    }
    CHECK_OK(loxo_moebius_center(test_context, m.n, turned, NULL, m.area, NULL, turned, NULL));
    for (int64_t i = 0; i < m.n; ++i) {
        double back[3];
        for (int k = 0; k < 3; ++k)
            back[k] = turn[0][k] * turned[3 * i] + turn[1][k] * turned[3 * i + 1] + turn[2][k] * turned[3 * i + 2];
        CHECK_NEAR3(back, &centred[3 * i], 1e-14);
    }
    loxo_release(test_context, centred);
    loxo_release(test_context, turned);
    map_free(&m);
}

/* The kernel of many points does what one after the other does, to the bit. */
TEST(shifts_side_by_side)
{
    enum { N = 37 };
    double w[3][3] = {{0.3, -0.2, 0.1}, {0.0, 0.9, 0.3}, {-0.5, 0.5, -0.5}}, co[3], x[3 * N], want[3 * N], y[3 * N];
    for (int s = 0; s < 3; ++s)
        co[s] = 1.0 - k_ball_dot(3, w[s], w[s]);
    for (int i = 0; i < N; ++i) {
        x[3 * i] = cos(3.0 * i) * cos(i);
        x[3 * i + 1] = sin(3.0 * i) * cos(i);
        x[3 * i + 2] = sin(i);
        memcpy(want + 3 * (ptrdiff_t)i, x + 3 * (ptrdiff_t)i, 3 * sizeof *x);
        for (int s = 0; s < 3; ++s)
            k_ball_shift(3, w[s], co[s], want + 3 * (ptrdiff_t)i, want + 3 * (ptrdiff_t)i);
    }
    for (int isa = LOXO_ISA_BASELINE; isa <= (int)loxo_context_isa(test_context); ++isa) {
        memset(y, 0, sizeof y);
        k_variant_get((loxo_isa)isa)->shifts3(3, (const double(*)[3])w, co, N, x, y);
        CHECK(memcmp(y, want, sizeof y) == 0);
    }
}

TEST(floats_are_put_onto_the_sphere)
{
    map m = map_make();
    float *position = loxo_allocate(test_context, 3 * m.n, sizeof *position);
    double *centred = loxo_allocate(test_context, 3 * m.n, sizeof *centred);
    loxo_center_info info;
    for (int64_t i = 0; i < 3 * m.n; ++i)
        position[i] = (float)m.soup.position[i];
    CHECK_OK(loxo_moebius_center(test_context, m.n, NULL, position, NULL, NULL, centred, &info));
    CHECK(info.off_sphere > 1e-9 && info.off_sphere < 2e-7);
    for (int64_t i = 0; i < m.n; ++i)
        CHECK_NEAR(hypot(hypot(centred[3 * i], centred[3 * i + 1]), centred[3 * i + 2]), 1.0, 4e-16);
    CHECK(info.mean_after <= 1e-15);
    loxo_release(test_context, position);
    loxo_release(test_context, centred);
    map_free(&m);
}

TEST(a_point_with_half_of_the_area)
{
    const double x[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, -1, 0}, area[4] = {3, 1, 1, 1};
    double centred[12];
    loxo_center_info info;
    CHECK_STATUS(test_context, loxo_moebius_center(test_context, 4, x, NULL, area, NULL, centred, &info),
                 LOXO_CHECK_FAILED);
    CHECK(info.barycenter.kind == LOXO_BARYCENTER_NONE && info.barycenter.w[0] == 1.0);
    CHECK(memcmp(x, centred, sizeof x) == 0);
}

TEST(bad_input_is_named)
{
    double x[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, out[9];
    const double area[3] = {1, 1, 1}, negative[3] = {1, -1, 1}, none[3] = {0, 0, 0};
    const float x_float[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    loxo_center_settings settings = loxo_center_settings_default();
#define CENTER(n, x, f, area) loxo_moebius_center(test_context, n, x, f, area, &settings, out, NULL)
    CHECK_OK(CENTER(3, x, NULL, area));
    CHECK_STATUS(test_context, CENTER(0, x, NULL, area), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, CENTER(-1, x, NULL, area), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, CENTER(3, NULL, NULL, area), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, CENTER(3, x, x_float, area), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, CENTER(3, x, NULL, none), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, CENTER(3, x, NULL, negative), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    CHECK_STATUS(test_context, loxo_moebius_center(test_context, 3, x, NULL, area, NULL, NULL, NULL),
                 LOXO_ERR_ARGUMENT);
    static const double wrong[] = {1.1, 0.0, NAN, INFINITY, 1e200};
    for (int i = 0; i < 5; ++i) {
        x[4] = wrong[i];
        CHECK_STATUS(test_context, CENTER(3, x, NULL, area), LOXO_ERR_MESH);
        CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    }
    x[4] = 1.1;
    settings.off_sphere = 0.2;
    CHECK_OK(CENTER(3, x, NULL, area));
    settings.off_sphere = -1.0;
    CHECK_STATUS(test_context, CENTER(3, x, NULL, area), LOXO_ERR_ARGUMENT);
    settings = loxo_center_settings_default();
    settings.tolerance = NAN;
    CHECK_STATUS(test_context, CENTER(3, x, NULL, area), LOXO_ERR_ARGUMENT);
#undef CENTER
}

static loxo_status center_far(loxo_context *ctx, void *arg)
{
    const map *m = arg;
    double *out = loxo_allocate(ctx, 3 * m->n, sizeof *out), *area = loxo_allocate(ctx, m->n, sizeof *area);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&m->soup);
    loxo_status status = out == NULL || area == NULL ? LOXO_ERR_MEMORY : loxo_mesh_vertex_areas(ctx, &arrays, area);
    if (status >= 0) status = loxo_moebius_center(ctx, m->n, m->soup.position, NULL, area, NULL, out, NULL);
    loxo_release(ctx, out);
    loxo_release(ctx, area);
    return status;
}

TEST(every_allocation_may_fail)
{
    map m = map_make();
    loxo_moebius shift;
    const double w[3] = {0.0, 0.999, 0.0}; /* so near that the atoms are carried */
    CHECK_OK(loxo_moebius_set_identity(test_context, 3, &shift));
    CHECK_OK(loxo_moebius_append_shift(test_context, &shift, w, 0.0));
    CHECK_OK(loxo_moebius_map_sphere(test_context, &shift, m.n, m.soup.position, m.soup.position));
    CHECK(test_each_allocation_fails(center_far, &m) >= 5);
    map_free(&m);
}

static uint64_t hash_center(loxo_context *ctx, const void *arg)
{
    const map *m = arg;
    double *out = loxo_allocate(ctx, 3 * m->n, sizeof *out), *area = loxo_allocate(ctx, m->n, sizeof *area);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&m->soup);
    CHECK_STATUS(ctx, loxo_mesh_vertex_areas(ctx, &arrays, area), LOXO_OK);
    CHECK_STATUS(ctx, loxo_moebius_center(ctx, m->n, m->soup.position, NULL, area, NULL, out, NULL), LOXO_OK);
    const uint64_t hash = test_hash(out, (size_t)m->n * 3 * sizeof *out) ^ test_hash(area, (size_t)m->n * sizeof *area);
    loxo_release(ctx, out);
    loxo_release(ctx, area);
    return hash;
}

TEST(every_number_of_threads_gives_the_same_bits)
{
    NEEDS_IDS(60000);
    loxo_generate_settings settings = loxo_generate_settings_default();
    map m = {.n = 0};
    settings.n_vertices = 30000;
    CHECK_OK(loxo_generate(test_context, &settings, false, &m.soup));
    m.n = m.soup.n_vertices;
    test_same_for_any_threads(hash_center, &m);
    CHECK_OK(loxo_soup_shuffle(test_context, &m.soup, 5, NULL));
    test_same_for_any_threads(hash_center, &m);
    map_free(&m);
}

TEST(lumped_areas_add_up_to_the_surface)
{
    const double p[15] = {0, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0, 1, 7, 7, 7};
    const loxo_index corners[6] = {0, 1, 2, 0, 2, 3};
    loxo_index wrong[6] = {0, 1, 2, 0, 5, 3};
    double area[5], bad[15];
    loxo_mesh_arrays arrays = {.n_vertices = 5, .n_faces = 2, .position = p, .triangle = corners};
    CHECK_OK(loxo_mesh_vertex_areas(test_context, &arrays, area)); /* of areas 3 and 1 */
    CHECK_NEAR(area[0], 4.0 / 3.0, 1e-15);
    CHECK_NEAR(area[1], 1.0, 1e-15);
    CHECK_NEAR(area[2], 4.0 / 3.0, 1e-15);
    CHECK_NEAR(area[3], 1.0 / 3.0, 1e-15);
    CHECK_EQUAL(area[4], 0.0);
    arrays.triangle = wrong;
    CHECK_STATUS(test_context, loxo_mesh_vertex_areas(test_context, &arrays, area), LOXO_ERR_MALFORMED);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 1);
    wrong[4] = -1;
    CHECK_STATUS(test_context, loxo_mesh_vertex_areas(test_context, &arrays, area), LOXO_ERR_MALFORMED);
    memcpy(bad, p, sizeof bad);
    bad[9] = NAN;
    arrays.triangle = corners;
    arrays.position = bad;
    CHECK_STATUS(test_context, loxo_mesh_vertex_areas(test_context, &arrays, area), LOXO_ERR_MESH);
    CHECK_STATUS(test_context, loxo_mesh_vertex_areas(test_context, &arrays, NULL), LOXO_ERR_ARGUMENT);
    arrays.position = NULL;
    CHECK_STATUS(test_context, loxo_mesh_vertex_areas(test_context, &arrays, area), LOXO_ERR_ARGUMENT);
}
