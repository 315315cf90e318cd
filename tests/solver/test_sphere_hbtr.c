/* SPDX-License-Identifier: MIT
 * The paper's method: the Hessian in the chart by Theorems 1 to 4, and what the steps lead to. */
#include "algebra/cholesky.h"
#include "base/rng.h"
#include "solver/sphere/hbtr_internal.h"
#include "solver/spheres.h"
#include "solver/stopper.h"

#include <loxo/io.h>

typedef long double real;

static void needs_cholmod(void)
{
    if (!loxo_cholesky_is_there()) SKIP();
}

/* E_C in long double, from angles. */
static real find_energy(const sphere_problem *p, const real *x)
{
    const int64_t n = p->m.n_vertices;
    real(*f)[3] = malloc((size_t)n * sizeof *f), sum = 0.0L;
    CHECK(f != NULL);
    for (int64_t i = 0; i < n; ++i) {
        f[i][0] = cosl(x[2 * i]) * sinl(x[2 * i + 1]);
        f[i][1] = sinl(x[2 * i]) * sinl(x[2 * i + 1]);
        f[i][2] = cosl(x[2 * i + 1]);
    }
    for (int64_t i = 0; i < n; ++i)
        for (int64_t e = p->laplacian.begin[i]; e < p->laplacian.begin[i + 1]; ++e)
            for (int k = 0; k < 3; ++k) {
                const real d = f[p->laplacian.column[e]][k] - f[i][k];
                sum -= 0.25L * (real)p->laplacian.value[e] * d * d;
            }
    for (int64_t t = 0; t < p->m.n_faces; ++t) {
        const loxo_index *v = p->m.halfedge_vertex + 3 * t;
        real normal[3], side = 0.0L, square = 0.0L;
        for (int k = 0; k < 3; ++k) {
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            normal[k] = (f[v[1]][a] - f[v[0]][a]) * (f[v[2]][b] - f[v[0]][b]) -
                        (f[v[1]][b] - f[v[0]][b]) * (f[v[2]][a] - f[v[0]][a]);
            side += normal[k] * (f[v[0]][k] + f[v[1]][k] + f[v[2]][k]);
            square += normal[k] * normal[k];
        }
        sum -= copysignl(0.5L * sqrtl(square), side);
    }
    free(f);
    return sum;
}

/* A small ellipsoid, seen from its middle and turned: a map that is no critical point. */
static sphere_case small_case(int64_t n_wanted, sphere_map *f, double **x)
{
    sphere_case c = sphere_case_ellipsoid(test_context, n_wanted, 1.3, 1.0, 0.7);
    *f = sphere_case_look(&c, 1.0, 1.0, 1.0);
    sphere_case_turn(&c, *f);
    *x = loxo_allocate(test_context, 2 * c.p.m.n_vertices, sizeof **x);
    for (int64_t i = 0; i < c.p.m.n_vertices; ++i)
        k_chart_angles(v3_load((*f)[i]), &(*x)[2 * i], &(*x)[2 * i + 1]);
    return c;
}

typedef struct chart_case {
    sphere_case c;
    sphere_map f;
    double *x, *g;
    k_chart_frame *frame;
    loxo_csr h;
} chart_case;

static chart_case chart_case_make(int64_t n_wanted)
{
    chart_case t;
    t.c = small_case(n_wanted, &t.f, &t.x);
    const int64_t n = t.c.p.m.n_vertices;
    t.g = loxo_allocate(test_context, 2 * n, sizeof *t.g);
    t.frame = loxo_allocate(test_context, n, sizeof *t.frame);
    CHECK(t.g != NULL && t.frame != NULL);
    CHECK_OK(hbtr_create_pattern(&t.c.p, &t.h));
    hbtr_find_frames(&t.c.p, t.x, t.frame);
    hbtr_fill(&t.c.p, t.frame, t.g, &t.h);
    return t;
}

static void chart_case_destroy(chart_case *t)
{
    loxo_csr_destroy(test_context, &t->h);
    loxo_release(test_context, t->frame);
    loxo_release(test_context, t->g);
    loxo_release(test_context, t->x);
    loxo_release(test_context, t->f);
    sphere_case_destroy(&t->c);
}

static double entry_of(const loxo_csr *h, int64_t i, int64_t j)
{
    if (i == j) return h->diagonal[i];
    for (int64_t e = h->begin[i]; e < h->begin[i + 1]; ++e)
        if (h->column[e] == j) return h->value[e];
    return 0.0;
}

/* Fourth order; steps of 1e-3 leave 1e-12 of the sixth derivatives, and rounding of 1e-19 / 1e-6. Where H has no entry, Theorem 1 asks
 * the differences to vanish. */
TEST(every_entry_of_the_hessian_agrees_with_differences)
{
    static const real at[4] = {-2.0L, -1.0L, 1.0L, 2.0L};
    static const real share[4] = {1.0L / 12.0L, -2.0L / 3.0L, 2.0L / 3.0L, -1.0L / 12.0L};
    const real step = 1e-3L;
    chart_case t = chart_case_make(42);
    const int64_t n = t.h.n_rows;
    real *y = malloc((size_t)n * sizeof *y);
    double most = 0.0;
    CHECK(y != NULL);
    for (int64_t i = 0; i < n; ++i) {
        most = fmax(most, fabs(t.h.diagonal[i]));
        y[i] = (real)t.x[i];
    }
    for (int64_t i = 0; i < n; ++i) {
        real sum = 0.0L;
        for (int k = 0; k < 4; ++k) {
            const real before = y[i];
            y[i] += at[k] * step;
            sum += share[k] * find_energy(&t.c.p, y);
            y[i] = before;
        }
        CHECK_NEAR(t.g[i], (double)(sum / step), 1e-10);
        for (int64_t j = 0; j <= i; ++j) {
            sum = 0.0L;
            for (int k = 0; k < 4; ++k)
                for (int l = 0; l < 4; ++l) {
                    const real before_i = y[i], before_j = y[j];
                    y[i] += at[k] * step;
                    y[j] += at[l] * step;
                    sum += share[k] * share[l] * find_energy(&t.c.p, y);
                    y[i] = before_i;
                    y[j] = before_j;
                }
            CHECK_NEAR(entry_of(&t.h, i, j), (double)(sum / (step * step)), 1e-8 * most);
        }
    }
    free(y);
    chart_case_destroy(&t);
}

TEST(theorem_1_blocks_where_the_matrix_has_entries)
{
    chart_case t = chart_case_make(162);
    const loxo_csr *l = &t.c.p.laplacian, *h = &t.h;
    for (int64_t i = 0; i < l->n_rows; ++i)
        for (int a = 0; a < 2; ++a) {
            const int64_t row = 2 * i + a;
            CHECK_EQUAL(h->begin[row + 1] - h->begin[row], 2 * (l->begin[i + 1] - l->begin[i]) + 1);
            for (int64_t e = h->begin[row]; e < h->begin[row + 1]; ++e) {
                const int64_t j = h->column[e] / 2;
                if (e > h->begin[row]) CHECK(h->column[e - 1] < h->column[e]);
                if (j != i) CHECK(entry_of(l, i, j) != 0.0);
                CHECK(entry_of(h, h->column[e], row) == h->value[e]); /* symmetric to the bit */
            }
        }
    chart_case_destroy(&t);
}

/* L1 - L2, the second derivative in Cartesian coordinates, applied to moves v of the vertices. */
static void multiply_cartesian(const sphere_problem *p, sphere_const_map f, const double (*v)[3], double (*out)[3])
{
    const loxo_csr *l = &p->laplacian;
    for (int64_t i = 0; i < l->n_rows; ++i) {
        loxo_vec3 sum = {0.0, 0.0, 0.0};
        for (int64_t e = l->begin[i]; e < l->begin[i + 1]; ++e)
            sum = v3_axpy(sum, l->value[e], v3_sub(v3_load(v[l->column[e]]), v3_load(v[i])));
        v3_store(out[i], sum);
    }
    for (int64_t t = 0; t < p->m.n_faces; ++t) {
        const loxo_index *c = p->m.halfedge_vertex + 3 * t;
        const k_image_face face = k_image_face_of(v3_load(f[c[0]]), v3_load(f[c[1]]), v3_load(f[c[2]]));
        const loxo_vec3 move[3] = {v3_load(v[c[0]]), v3_load(v[c[1]]), v3_load(v[c[2]])};
        for (int k = 0; k < 3; ++k)
            v3_store(out[c[k]], v3_sub(v3_load(out[c[k]]), k_image_area_hessian(&face, k, move)));
    }
}

TEST(theorem_2_the_cartesian_hessian_is_symmetric_and_kills_constants)
{
    chart_case t = chart_case_make(162);
    const int64_t n = t.c.p.m.n_vertices;
    double(*v)[3] = malloc((size_t)n * sizeof *v), (*w)[3] = malloc((size_t)n * sizeof *w);
    double(*hv)[3] = malloc((size_t)n * sizeof *hv), (*hw)[3] = malloc((size_t)n * sizeof *hw);
    double left = 0.0, right = 0.0, size = 0.0;
    CHECK(v != NULL && w != NULL && hv != NULL && hw != NULL);
    for (int k = 0; k < 3; ++k) {
        for (int64_t i = 0; i < 3 * n; ++i)
            v[i / 3][i % 3] = i % 3 == k ? 1.0 : 0.0;
        multiply_cartesian(&t.c.p, (sphere_const_map)t.f, (const double(*)[3])v, hv);
        for (int64_t i = 0; i < 3 * n; ++i)
            CHECK_NEAR(hv[i / 3][i % 3], 0.0, 1e-13); /* rounding of a few dozen terms of size 1 */
    }
    for (int64_t i = 0; i < 3 * n; ++i) {
        v[i / 3][i % 3] = loxo_random_unit(1, (uint64_t)i) - 0.5;
        w[i / 3][i % 3] = loxo_random_unit(2, (uint64_t)i) - 0.5;
    }
    multiply_cartesian(&t.c.p, (sphere_const_map)t.f, (const double(*)[3])v, hv);
    multiply_cartesian(&t.c.p, (sphere_const_map)t.f, (const double(*)[3])w, hw);
    for (int64_t i = 0; i < 3 * n; ++i) {
        left += w[i / 3][i % 3] * hv[i / 3][i % 3];
        right += v[i / 3][i % 3] * hw[i / 3][i % 3];
        size += fabs(hv[i / 3][i % 3]);
    }
    CHECK_NEAR(left, right, 1e-15 * size);
    free(v);
    free(w);
    free(hv);
    free(hw);
    chart_case_destroy(&t);
}

TEST(theorem_4_turning_about_the_axis_is_in_the_null_space)
{
    chart_case t = chart_case_make(642);
    const int64_t n = t.h.n_rows;
    double *v = malloc((size_t)n * sizeof *v), *hv = malloc((size_t)n * sizeof *hv);
    CHECK(v != NULL && hv != NULL);
    for (int64_t i = 0; i < n; ++i)
        v[i] = i % 2 == 0 ? 1.0 : 0.0;
    loxo_csr_multiply(test_context, &t.h, v, hv);
    for (int64_t i = 0; i < n; ++i) {
        double size = fabs(t.h.diagonal[i]);
        for (int64_t e = t.h.begin[i]; e < t.h.begin[i + 1]; ++e)
            size += fabs(t.h.value[e]);
        CHECK_NEAR(hv[i], 0.0, 1e-14 * (1.0 + size)); /* each entry is a sum of terms of size 1 */
    }
    free(v);
    free(hv);
    chart_case_destroy(&t);
}

TEST(rotations_are_found)
{
    for (uint64_t seed = 0; seed < 100; ++seed) {
        double q[4], square = 0.0, r[3][3], m[3][3] = {{0.0}}, found[3][3];
        for (uint64_t k = 0; k < 4; ++k) {
            q[k] = loxo_random_unit(seed, k) - 0.5;
            square += q[k] * q[k];
        }
        for (int k = 0; k < 4; ++k)
            q[k] /= sqrt(square);
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            r[i][i] = 1.0 - 2.0 * (q[j + 1] * q[j + 1] + q[k + 1] * q[k + 1]);
            r[i][j] = 2.0 * (q[i + 1] * q[j + 1] - q[0] * q[k + 1]);
            r[i][k] = 2.0 * (q[i + 1] * q[k + 1] + q[0] * q[j + 1]);
        }
        /* Points along the axes, of weights 3, 2, 1: m = r diag(9, 4, 1), and with seed odd a plane of points. */
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k)
                m[i][k] = r[i][k] * (k == 0 ? 9.0 : k == 1 ? 4.0 : seed % 2 == 0 ? 1.0 : 0.0);
        sphere_find_rotation((const double(*)[3])m, found);
        for (int i = 0; i < 3; ++i)
            CHECK_NEAR3(found[i], r[i], 1e-14);
    }
}

/* Of what no rotation reaches a proper one still comes. */
TEST(a_reflection_gives_a_rotation)
{
    static const double mirrors[3][3][3] = {
        {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {{5, 0, 0}, {0, 3, 0}, {0, 0, -2}}, {{0}}};
    for (int k = 0; k < 3; ++k) {
        double r[3][3];
        sphere_find_rotation(mirrors[k], r);
        const double det = r[0][0] * (r[1][1] * r[2][2] - r[1][2] * r[2][1]) -
                           r[0][1] * (r[1][0] * r[2][2] - r[1][2] * r[2][0]) +
                           r[0][2] * (r[1][0] * r[2][1] - r[1][1] * r[2][0]);
        CHECK_NEAR(det, 1.0, 1e-14);
    }
    double r[3][3];
    sphere_find_rotation(mirrors[1], r);
    for (int i = 0; i < 3; ++i) /* the best of 5, 3, -2 is to leave all as it is */
        CHECK_NEAR3(r[i], ((double[3]){i == 0, i == 1, i == 2}), 1e-14);
}

static loxo_status map_it(const sphere_case *c, sphere_map f, loxo_sphere_info *info)
{
    *info = (loxo_sphere_info){0};
    return sphere_map_hbtr(&c->p, f, info);
}

TEST(a_sphere_stays_what_it_is)
{
    needs_cholmod();
    sphere_case c = sphere_case_ellipsoid(test_context, 642, 1.0, 1.0, 1.0);
    sphere_map f = sphere_case_look(&c, 1.0, 1.0, 1.0), before = sphere_case_look(&c, 1.0, 1.0, 1.0);
    loxo_sphere_info info;
    double move;
    sphere_case_turn(&c, f);
    CHECK_STATUS(test_context, map_it(&c, f, &info), LOXO_OK);
    CHECK_NEAR(info.objective, 0.0, 1e-13); /* the difference of two areas of 12.5 */
    CHECK_OK(sphere_find_move(test_context, c.p.m.n_vertices, (sphere_const_map)before, (sphere_const_map)f, &move));
    CHECK(move < 1e-12);
    loxo_release(test_context, f);
    loxo_release(test_context, before);
    sphere_case_destroy(&c);
}

/* What the monitor heard. */
typedef struct curve {
    int n;
    double energy[64], gradient[64], move[64];
} curve;

static int note(void *user, const loxo_progress *p)
{
    curve *c = user;
    CHECK(c->n < 64 && p->radius > 0.0);
    c->energy[c->n] = p->objective;
    c->gradient[c->n] = p->gradient_norm;
    c->move[c->n++] = p->residual;
    return 0;
}

TEST(an_ellipsoid_converges_and_the_last_steps_quadratically)
{
    needs_cholmod();
    sphere_case c = sphere_case_ellipsoid(test_context, 642, 1.1, 1.0, 0.9);
    sphere_map f = sphere_case_look(&c, 1.0, 1.0, 1.0);
    loxo_sphere_info info;
    curve heard = {0};
    sphere_folds folds;
    sphere_energy energy;
    sphere_case_turn(&c, f);
    loxo_context_set_monitor(test_context, note, &heard);
    CHECK_STATUS(test_context, map_it(&c, f, &info), LOXO_OK);
    loxo_context_set_monitor(test_context, NULL, NULL);
    CHECK_EQUAL(info.stop_reason, LOXO_SPHERE_STOP_TOLERANCE);
    CHECK(info.residual <= c.p.settings.tolerance);
    CHECK_OK(sphere_find_folds(&c.p, (sphere_const_map)f, NULL, &folds));
    CHECK_EQUAL(folds.n, 0);
    CHECK_EQUAL(folds.degree, 1);
    CHECK_OK(sphere_find_energy(&c.p, (sphere_const_map)f, &energy));
    CHECK_NEAR(energy.energy, info.objective, 1e-13);
    const int last = heard.n - 1;
    for (int k = 1; k <= last; ++k)
        CHECK(heard.energy[k] <= heard.energy[k - 1] + 1e-13);
    CHECK(heard.gradient[last] < 1e-8);
    CHECK(heard.gradient[last] < 1e-2 * heard.gradient[0]);
    loxo_release(test_context, f);
    sphere_case_destroy(&c);
}

/* As in the paper: from SCEM's map to a critical point of the chart below it, which the true minimum lies below in turn. */
TEST(a_scan_from_the_map_of_scem)
{
    needs_cholmod();
    const char *path = test_shared("meshes/surfaces/spot3k.obj.gz");
    loxo_soup soup;
    if (path == NULL) SKIP();
    if (loxo_read_mesh(test_context, path, NULL, &soup) == LOXO_ERR_UNSUPPORTED) SKIP(); /* no zlib */
    sphere_case c = sphere_case_make(test_context, soup);
    sphere_map f = sphere_case_look(&c, 1.0, 1.0, 1.0);
    loxo_sphere_info info = {0};
    sphere_energy before, after;
    sphere_folds folds;
    CHECK(sphere_map_scem(&c.p, f, &info) >= 0);
    CHECK_OK(sphere_find_energy(&c.p, (sphere_const_map)f, &before));
    CHECK_STATUS(test_context, map_it(&c, f, &info), LOXO_OK);
    CHECK_OK(sphere_find_energy(&c.p, (sphere_const_map)f, &after));
    CHECK_OK(sphere_find_folds(&c.p, (sphere_const_map)f, NULL, &folds));
    CHECK(after.energy < before.energy);
    CHECK_EQUAL(folds.n, 0);
    CHECK(info.workspace_bytes > (size_t)c.p.m.n_vertices * 500); /* the Hessian alone has 700 */
    loxo_release(test_context, f);
    sphere_case_destroy(&c);
}

TEST(steps_that_are_not_enough_are_told)
{
    needs_cholmod();
    sphere_case c = sphere_case_ellipsoid(test_context, 162, 1.3, 1.0, 0.7);
    sphere_map f = sphere_case_look(&c, 1.0, 1.0, 1.0);
    loxo_sphere_info info;
    sphere_energy before, after;
    CHECK_OK(sphere_find_energy(&c.p, (sphere_const_map)f, &before));
    c.p.settings.max_iterations = 2;
    CHECK_STATUS(test_context, map_it(&c, f, &info), LOXO_NOT_CONVERGED);
    CHECK_EQUAL(info.stop_reason, LOXO_SPHERE_STOP_MAX_ITERATIONS);
    CHECK_EQUAL(info.n_iterations, 2);
    CHECK_OK(sphere_find_energy(&c.p, (sphere_const_map)f, &after));
    CHECK(after.energy <= before.energy);
    /* No tolerance: until rounding. */
    c.p.settings.max_iterations = 500;
    c.p.settings.tolerance = 0.0;
    CHECK_STATUS(test_context, map_it(&c, f, &info), LOXO_OK);
    CHECK(info.stop_reason == LOXO_SPHERE_STOP_ROUNDING || info.residual == 0.0);
    loxo_release(test_context, f);
    sphere_case_destroy(&c);
}

/* The longitude of a pole is of no use; the step there has no pivot. */
TEST(a_vertex_at_a_pole_does_no_harm)
{
    needs_cholmod();
    sphere_case c = sphere_case_make(test_context, soup_make(test_context, LOXO_SHAPE_LATLONG, 300, NAN));
    sphere_map f = sphere_case_look(&c, 1.0, 1.0, 0.7);
    loxo_sphere_info info;
    sphere_energy before;
    CHECK_OK(sphere_find_energy(&c.p, (sphere_const_map)f, &before));
    const loxo_status status = map_it(&c, f, &info);
    CHECK(status >= 0);
    CHECK(info.objective < before.energy);
    for (int64_t i = 0; i < 3 * c.p.m.n_vertices; ++i)
        CHECK(isfinite(f[i / 3][i % 3]));
    loxo_release(test_context, f);
    sphere_case_destroy(&c);
}

static uint64_t hash_map(loxo_context *ctx, const void *arg)
{
    (void)arg;
    sphere_case c = sphere_case_ellipsoid(ctx, 2562, 1.2, 1.0, 0.8);
    sphere_map f = sphere_case_look(&c, 1.0, 1.0, 1.0);
    loxo_sphere_info info;
    sphere_case_turn(&c, f);
    CHECK_STATUS(ctx, map_it(&c, f, &info), LOXO_OK);
    const uint64_t hash = test_hash(f, (size_t)c.p.m.n_vertices * sizeof *f);
    loxo_release(ctx, f);
    sphere_case_destroy(&c);
    return hash;
}

TEST(any_number_of_threads_gives_the_same_bits)
{
    needs_cholmod();
    test_same_for_any_threads(hash_map, NULL);
}

TEST(the_monitor_stops_it)
{
    needs_cholmod();
    sphere_case c = sphere_case_ellipsoid(test_context, 162, 1.3, 1.0, 0.7);
    sphere_map f = sphere_case_look(&c, 1.0, 1.0, 1.0);
    loxo_sphere_info info;
    for (int at = 1; at <= 3; ++at) {
        stopper w;
        stopper_begin(&w, test_context, at);
        CHECK_STATUS(test_context, map_it(&c, f, &info), LOXO_STOPPED);
        stopper_end(&w);
        CHECK_EQUAL(info.stop_reason, LOXO_SPHERE_STOP_MONITOR);
        CHECK_EQUAL(w.n_calls, at);
        for (int64_t i = 0; i < c.p.m.n_vertices; ++i)
            CHECK_NEAR(v3_norm(v3_load(f[i])), 1.0, 1e-15);
    }
    loxo_release(test_context, f);
    sphere_case_destroy(&c);
}

/* In a context of which allocations fail; the rest belongs to another. */
typedef struct failing_call {
    sphere_case *c;
    sphere_map f;
} failing_call;

static loxo_status call_with(loxo_context *ctx, void *arg)
{
    failing_call *call = arg;
    loxo_sphere_info info = {0};
    sphere_problem p = call->c->p;
    p.ctx = ctx;
    p.settings.max_iterations = 2;
    const int64_t n = p.m.n_vertices;
    sphere_map f = malloc((size_t)n * sizeof *f);
    CHECK(f != NULL);
    memcpy(f, call->f, (size_t)n * sizeof *f);
    const loxo_status status = sphere_map_hbtr(&p, f, &info);
    free(f);
    return status;
}

TEST(each_allocation_may_fail)
{
    needs_cholmod();
    sphere_case c = sphere_case_ellipsoid(test_context, 162, 1.3, 1.0, 0.7);
    failing_call call = {.c = &c, .f = sphere_case_look(&c, 1.0, 1.0, 1.0)};
    CHECK(test_each_allocation_fails(call_with, &call) >= 10);
    loxo_release(test_context, call.f);
    sphere_case_destroy(&c);
}

TEST(without_cholmod_it_says_so)
{
    if (loxo_cholesky_is_there()) SKIP();
    sphere_case c = sphere_case_ellipsoid(test_context, 42, 1.0, 1.0, 1.0);
    sphere_map f = sphere_case_look(&c, 1.0, 1.0, 1.0);
    loxo_sphere_info info;
    CHECK_STATUS(test_context, map_it(&c, f, &info), LOXO_ERR_UNSUPPORTED);
    loxo_release(test_context, f);
    sphere_case_destroy(&c);
}

/* Weights of another triangulation of the same vertices: H has its entries and those of the mesh's edges. */
TEST(weights_of_another_triangulation_widen_the_pattern)
{
    needs_cholmod();
    loxo_soup soup = soup_make(test_context, LOXO_SHAPE_ICOSPHERE, 162, NAN);
    for (int64_t i = 0; i < soup.n_vertices; ++i)
        soup.position[3 * i] *= 3.0; /* long triangles, whose edges flip */
    sphere_case c = sphere_case_make(test_context, soup);
    loxo_mesh *intrinsic;
    CHECK_OK(loxo_mesh_create_intrinsic(test_context, c.s.mesh, NULL, NULL, &intrinsic));
    const loxo_mesh_view m = loxo_mesh_get_view(intrinsic);
    loxo_csr_destroy(test_context, &c.p.laplacian);
    CHECK_OK(loxo_laplacian_create(test_context, &m, &c.p.laplacian, NULL));
    loxo_csr h;
    CHECK_OK(hbtr_create_pattern(&c.p, &h));
    int64_t n_wider = 0;
    for (int64_t i = 0; i < c.p.m.n_vertices; ++i)
        n_wider += h.begin[2 * i + 1] - h.begin[2 * i] > 2 * (c.p.laplacian.begin[i + 1] - c.p.laplacian.begin[i]) + 1;
    CHECK(n_wider > 0);
    for (int64_t t = 0; t < 3 * c.p.m.n_faces; ++t) {
        const int64_t i = c.p.m.halfedge_vertex[t], j = k_head(&c.p.m, (loxo_index)t);
        bool is_there = false;
        for (int64_t e = h.begin[2 * i]; e < h.begin[2 * i + 1]; ++e)
            is_there = is_there || h.column[e] == 2 * j;
        CHECK(is_there);
    }
    loxo_csr_destroy(test_context, &h);
    sphere_map f = sphere_case_look(&c, 1.0, 1.0, 1.0);
    loxo_sphere_info info;
    sphere_energy before;
    CHECK_OK(sphere_find_energy(&c.p, (sphere_const_map)f, &before));
    sphere_case_turn(&c, f);
    CHECK(map_it(&c, f, &info) >= 0);
    CHECK(info.objective < before.energy);
    loxo_release(test_context, f);
    loxo_mesh_destroy(intrinsic);
    sphere_case_destroy(&c);
}
