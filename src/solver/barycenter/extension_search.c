/* SPDX-License-Identifier: MIT
 * The barycenter of some hundred atoms that lie in the cache, without allocation: as hyperbolic/barycenter.c searches, but on an
 * eighth of the atoms first, and the last step is certified before it is made. */
#include "hyperbolic/hyperbolic.h"
#include "kernel/ball_kernel.h"
#include "solver/barycenter/extension_internal.h"

#include <string.h>

#define EPS           2.3e-16
#define NOISE         (4.0 * EPS)  /* of a mean of unit vectors, as it is computed */
#define NEAR_SPHERE   (16.0 * EPS) /* co, in all, below which a point is as good as on the sphere */
#define COARSE_STEP   1e-3 /* hyperbolic length of a step on an eighth of the atoms that leaves the rest to all of them */
#define COARSE_PASSES 12
#define LEAST_GAIN    (1.0 / 64.0) /* of a doubling of the nodes; more is not believed */
#define CAUTION       4.0
#define MOST_SUMS     (1 + EXTENSION_MOST_D + EXTENSION_MOST_D * (EXTENSION_MOST_D + 1) / 2)

/* What a pass tells of the present point. */
typedef struct view {
    double mean[EXTENSION_MOST_D], u[EXTENSION_MOST_D]; /* u: Newton's direction, A^-1 m / 2 */
    double residual, noise, lambda, length; /* lambda: at most the least eigenvalue of A; length: of u, Euclidean */
} view;

static int count_sums(int d) { return 1 + d + d * (d + 1) / 2; }

static int triangle(int d, int i, int j) { return i * d - i * (i - 1) / 2 + (j - i); }

/* A root from below of lambda^3 - 2 lambda^2 + c lambda - det: the cubic is concave up to its least root, so Newton's steps from 0 stay below
 * it. With the trace 1 the quadratic does the same for d = 2. */
static double least_root(double square, double c, double det)
{
    double x = det / c;
    for (int i = 0; i < 4; ++i) {
        const double value = ((x - square) * x + c) * x - det, slope = (3.0 * x - 2.0 * square) * x + c;
        if (!(slope > 0.0)) break;
        x -= value / slope;
    }
    return x;
}

/* u and lambda for d = 3 by the adjugate; false where the matrix is too near to singular for that. */
static bool solve3(const double *a, const double *m, view *v)
{
    const double c00 = a[3] * a[5] - a[4] * a[4], c01 = a[2] * a[4] - a[1] * a[5], c02 = a[1] * a[4] - a[2] * a[3];
    const double c11 = a[0] * a[5] - a[2] * a[2], c12 = a[1] * a[2] - a[0] * a[4], c22 = a[0] * a[3] - a[1] * a[1];
    const double det = a[0] * c00 + a[1] * c01 + a[2] * c02, minors = c00 + c11 + c22;
    if (!(det > 1e-7 * minors)) return false;
    const double half = 0.5 / det;
    v->u[0] = half * (c00 * m[0] + c01 * m[1] + c02 * m[2]);
    v->u[1] = half * (c01 * m[0] + c11 * m[1] + c12 * m[2]);
    v->u[2] = half * (c02 * m[0] + c12 * m[1] + c22 * m[2]);
    v->lambda = least_root(a[0] + a[3] + a[5], minors, det) * (1.0 - 1e-12);
    return true;
}

static bool solve2(const double *a, const double *m, view *v)
{
    const double det = a[0] * a[2] - a[1] * a[1], half = 0.5 / det;
    if (!(det > 1e-7)) return false;
    v->u[0] = half * (a[2] * m[0] - a[1] * m[1]);
    v->u[1] = half * (a[0] * m[1] - a[1] * m[0]);
    v->lambda = 2.0 * det / (a[0] + a[2] + sqrt((a[0] - a[2]) * (a[0] - a[2]) + 4.0 * a[1] * a[1])) * (1.0 - 1e-12);
    return true;
}

static void solve_any(int d, const double *upper, const double *m, view *v)
{
    double a[EXTENSION_MOST_D * EXTENSION_MOST_D], vector[EXTENSION_MOST_D * EXTENSION_MOST_D], value[EXTENSION_MOST_D];
    for (int i = 0; i < d; ++i)
        for (int j = i; j < d; ++j)
            a[i * d + j] = a[j * d + i] = upper[triangle(d, i, j)];
    hyper_eigen(d, a, value, vector);
    memset(v->u, 0, (size_t)d * sizeof *v->u);
    for (int i = 0; i < d; ++i) {
        const double *e = vector + (ptrdiff_t)i * d, c = 0.5 * k_ball_dot(d, e, m) / (value[i] > EPS ? value[i] : EPS);
        for (int k = 0; k < d; ++k)
            v->u[k] += c * e[k];
    }
    v->lambda = value[0];
}

/* Mean and A = 1 - M of the atoms shifted by w, from the sums of v = y + w. */
static void find_view(int d, const double *w, double co, const double *sums, view *v)
{
    double a[EXTENSION_MOST_D * (EXTENSION_MOST_D + 1) / 2];
    const double inverse = 1.0 / sums[0], *one = sums + 1, *two = one + d;
    for (int i = 0; i < d; ++i)
        v->mean[i] = one[i] * inverse - w[i];
    for (int i = 0, k = 0; i < d; ++i)
        for (int j = i; j < d; ++j, ++k)
            a[k] = (i == j ? 1.0 : 0.0) - (two[k] * inverse - v->mean[i] * w[j] - w[i] * v->mean[j] - w[i] * w[j]);
    v->residual = sqrt(k_ball_dot(d, v->mean, v->mean));
    v->noise = NOISE / k_ball_gap(co);
    if (!(d == 3 ? solve3(a, v->mean, v) : d == 2 && solve2(a, v->mean, v))) solve_any(d, a, v->mean, v);
    v->length = sqrt(k_ball_dot(d, v->u, v->u));
}

static void add_moments(const extension_search *s, int64_t begin, int64_t end, const double *w, double co, double *sums)
{
    const double *atom = s->atom + begin * s->d, *weight = s->weight == NULL ? NULL : s->weight + begin;
    if (s->d == 3)
        s->kernels->moments3(atom, weight, end - begin, w, co, sums);
    else if (s->d == 2)
        s->kernels->moments2(atom, weight, end - begin, w, co, sums);
    else
        hyper_add_moments(s->d, atom, weight, end - begin, w, co, sums);
}

/* One step: the damped one, which always descends, or the full one. w, co: the present point, moved on. */
static void step(int d, const view *v, bool is_full, double *w, double *co)
{
    double z[EXTENSION_MOST_D], r, co_z;
    if (is_full) {
        const double c = cosh(v->length);
        r = tanh(v->length);
        co_z = 1.0 / (c * c);
    } else {
        const double root = sqrt(1.0 + 4.0 * v->length), more = (root + 1.0) * (root + 1.0);
        r = 4.0 * v->length / more;
        co_z = 4.0 * root / more;
    }
    if (!(v->length > 0.0)) return;
    for (int k = 0; k < d; ++k)
        z[k] = v->u[k] * (r / v->length);
    *co = k_ball_compose(d, w, *co, z, co_z, w);
}

static bool is_certain(const view *v) { return 4.0 * v->residual < v->lambda * v->lambda; }

/* EXTENSION.md, «The last step»: certified distance after a full step from here. */
static double bound_after(const view *v)
{
    const double far = 2.0 * v->length;
    return hyper_certificate(0.5 * far * far + 2.0 * v->noise, v->lambda - far - 8.0 * EPS);
}

/* Shifts the atoms so that the present point is the centre; false: not once more. */
static bool turn(extension_search *s, double *w, double *co)
{
    if (s->n_turns == EXTENSION_MOST_TURNS) return false;
    for (int64_t i = 0; i < s->n; ++i)
        k_ball_shift(s->d, w, *co, s->atom + i * s->d, s->own + i * s->d);
    s->atom = s->own;
    memcpy(s->turn[s->n_turns], w, (size_t)s->d * sizeof *w);
    s->turn_co[s->n_turns++] = *co;
    memset(w, 0, (size_t)s->d * sizeof *w);
    *co = 1.0;
    return true;
}

/* 1 - |w| below which atoms are shifted: noise shall be well below the tolerance. */
static double nearest_to_sphere(double tolerance) { return tolerance > 2e-11 ? fmax(1e-12 / tolerance, 1e-6) : 0.05; }

/* From w to within the quadrature error of an eighth of the atoms. An eighth may have no barycenter where all of them have one: then
 * from the beginning. */
static void search_coarse(extension_search *s, double *w, double *co)
{
    const double nearest = nearest_to_sphere(s->tolerance);
    double sums[MOST_SUMS];
    view v;
    for (int i = 0; i < COARSE_PASSES; ++i) {
        memset(sums, 0, (size_t)count_sums(s->d) * sizeof *sums);
        add_moments(s, 0, s->n / 8, w, *co, sums);
        ++s->n_coarse_passes;
        find_view(s->d, w, *co, sums, &v);
        if (!(v.lambda > 1e-9)) break;
        step(s->d, &v, is_certain(&v), w, co);
        if (k_ball_gap(*co) < nearest && !turn(s, w, co)) break;
        if (2.0 * v.length < COARSE_STEP) return;
    }
    memset(w, 0, (size_t)s->d * sizeof *w);
    *co = 1.0;
}

/* Length of the difference of two means, of sums a and b. */
static double mean_apart(int d, const double *a, const double *b)
{
    double square = 0.0;
    for (int k = 1; k <= d; ++k) {
        const double e = a[k] / a[0] - b[k] / b[0];
        square += e * e;
    }
    return sqrt(square);
}

/* What a doubling of the nodes changes over what the one before did. */
static double share_of(double after, double before) { return after < before ? fmax(after / before, LEAST_GAIN) : 1.0; }

/* One pass over all atoms: an eighth, the rest of the first quarter, of the first half, and the other half apart. EXTENSION.md, «The error»: twice as
 * many nodes would change the mean by what the last doubling did, times what that was of the doubling before, or that one of its own if it is more. */
static void look(extension_search *s, const double *w, double co, view *v)
{
    double sums[4][MOST_SUMS]; /* of an eighth, a quarter, a half, all */
    const int n = count_sums(s->d);
    int64_t begin = 0;
    for (int part = 0; part < 4; ++part) {
        const int64_t end = s->n / (8 >> part);
        memset(sums[part], 0, (size_t)n * sizeof *sums[part]);
        add_moments(s, begin, end, w, co, sums[part]);
        for (int k = 0; k < n && part > 0; ++k)
            sums[part][k] += sums[part - 1][k];
        begin = end;
    }
    ++s->n_passes;
    find_view(s->d, w, co, sums[3], v);
    const double before = mean_apart(s->d, sums[1], sums[2]),
                 share = share_of(before, mean_apart(s->d, sums[0], sums[1]));
    const double last =
        fmax(mean_apart(s->d, sums[2], sums[3]), before * share * share); /* it may be small by chance */
    s->error = hyper_certificate(CAUTION * last * fmax(share, share_of(last, before)), v->lambda);
}

/* Where w is seen from outside. */
static void see_from_outside(extension_search *s, const double *w, double co)
{
    memcpy(s->w, w, (size_t)s->d * sizeof *w);
    s->co = co;
    for (int i = s->n_turns; i-- > 0;)
        s->co = k_ball_compose(s->d, s->turn[i], s->turn_co[i], s->w, s->co, s->w);
}

static void search_all(extension_search *s, double least, double *w, double *co)
{
    const double nearest = nearest_to_sphere(s->tolerance);
    double previous = HUGE_VAL;
    view v;
    while (s->n_passes < s->max_passes) {
        look(s, w, *co, &v);
        s->bound = hyper_certificate(v.residual + v.noise, v.lambda - 8.0 * EPS);
        if (s->bound <= s->tolerance) {
            s->is_done = true;
            return;
        }
        if (v.residual <= 2.0 * v.noise ||
            (s->bound < 0.5 && v.residual > 0.5 * previous && v.residual <= 64.0 * v.noise)) {
            s->is_done = s->tolerance == 0.0;
            return;
        }
        previous = v.residual;
        const bool is_full = is_certain(&v);
        step(s->d, &v, is_full, w, co);
        if (is_full && s->tolerance > 0.0 && bound_after(&v) <= s->tolerance) {
            s->bound = bound_after(&v);
            s->is_done = true;
            return;
        }
        see_from_outside(s, w, *co);
        if (s->co < least) return;
        if (k_ball_gap(*co) < nearest && !turn(s, w, co)) return;
    }
}

void extension_search_run(extension_search *s)
{
    double w[EXTENSION_MOST_D] = {0.0}, co = 1.0;
    const double least = NEAR_SPHERE * (s->n_turns > 0 ? s->turn_co[0] : 1.0);
    s->n_passes = s->n_coarse_passes = 0;
    s->bound = s->error = HUGE_VAL;
    s->is_done = false;
    search_coarse(s, w, &co);
    search_all(s, least, w, &co);
    see_from_outside(s, w, co);
}
