/* SPDX-License-Identifier: MIT
 * Nodes of the quadrature: those that stay, those that move with z, and those that move very near to the circle. */
#include "base/allocate.h"
#include "kernel/ball_kernel.h"
#include "kernel/extension_kernel.h"
#include "solver/barycenter/extension_internal.h"

#include <string.h>

#define PI 3.14159265358979323846

/* Where node k of n stands: every eighth together, those that make every fourth and every second of them first. */
static int64_t node_place(int64_t n, int64_t k)
{
    static const int64_t part[8] = {0, 4, 2, 5, 1, 6, 3, 7};
    return part[k % 8] * (n / 8) + k / 8;
}

/* Fixed node k of n, at 2 pi k / n: of even samples the place among them is exact. */
static void set_fixed(const extension_curve *c, int64_t n, int64_t k, double direction[2], double *x)
{
    const double angle = 2.0 * PI * (double)k / (double)n;
    direction[0] = cos(angle);
    direction[1] = sin(angle);
    if (c->is_even && (k * c->n) % n == 0) {
        const int64_t j = k * c->n / n;
        memcpy(direction, c->on_circle + 2 * j, 2 * sizeof *direction);
        memcpy(x, c->sample + j * c->d, (size_t)c->d * sizeof *x);
        return;
    }
    extension_curve_at(c, direction, x);
}

/* By how much the curve's velocity changes at sample j, in the sphere. */
static void find_kink(const extension_curve *c, int64_t j, double *kink)
{
    const double *x = c->sample + j * c->d, *ahead = c->row + 2 * j * c->stride;
    const double *behind = c->row + 2 * (j > 0 ? j - 1 : c->n - 1) * c->stride;
    const double side[2] = {-c->on_circle[2 * j + 1], c->on_circle[2 * j]};
    for (int k = 0; k < c->d; ++k)
        kink[k] = side[0] * (ahead[k] - behind[k]) + side[1] * (ahead[c->stride + k] - behind[c->stride + k]);
    const double along = k_ball_dot(c->d, kink, x);
    for (int k = 0; k < c->d; ++k)
        kink[k] -= along * x[k];
}

/* EXTENSION.md, «Kinks»: what the trapezoidal rule misses at a kink is made good, to the first order, by moving the nodes on both sides. */
static void mend_kinks(const extension_curve *c, int64_t n, double *move)
{
    const double h = 2.0 * PI / (double)n;
    double kink[EXTENSION_MOST_D];
    for (int64_t j = 0; j < c->n; ++j) {
        double place = fmod(c->angle[j] / h, (double)n);
        place = place < 0.0 ? place + (double)n : place;
        const int64_t low = (int64_t)place < n ? (int64_t)place : n - 1, high = low + 1 < n ? low + 1 : 0;
        const double s = place - (double)low, size = 0.5 * h * (s * s - s + 1.0 / 6.0);
        find_kink(c, j, kink);
        for (int k = 0; k < c->d; ++k) {
            move[low * c->d + k] += (1.0 - s) * size * kink[k];
            move[high * c->d + k] += s * size * kink[k];
        }
    }
}

static void add_and_project(int d, const double *move, double *x)
{
    double square = 0.0;
    for (int k = 0; k < d; ++k) {
        x[k] += move[k];
        square += x[k] * x[k];
    }
    for (int k = 0; k < d; ++k)
        x[k] /= sqrt(square);
}

loxo_status extension_nodes_create(loxo_context *ctx, const extension_curve *curve, int64_t n, extension_nodes *nodes)
{
    *nodes = (extension_nodes){.n = n};
    nodes->cosine = loxo_allocate(ctx, n, sizeof(double));
    nodes->sine = loxo_allocate(ctx, n, sizeof(double));
    nodes->x = loxo_allocate(ctx, n, sizeof(double));
    nodes->y = loxo_allocate(ctx, n, sizeof(double));
    nodes->atom = loxo_allocate(ctx, n * curve->d, sizeof(double));
    if (nodes->cosine == NULL || nodes->sine == NULL || nodes->x == NULL || nodes->y == NULL || nodes->atom == NULL)
        return LOXO_ERR_MEMORY;
    double *move = loxo_allocate_zero(ctx, n * curve->d, sizeof *move);
    if (move == NULL) return LOXO_ERR_MEMORY;
    mend_kinks(curve, n, move);
    for (int64_t k = 0; k < n; ++k) {
        const int64_t i = node_place(n, k);
        const double half = PI * ((double)k + 0.5 - 0.5 * (double)n) / (double)n;
        double direction[2];
        nodes->cosine[i] = cos(half);
        nodes->sine[i] = sin(half);
        set_fixed(curve, n, k, direction, nodes->atom + i * curve->d);
        add_and_project(curve->d, move + k * curve->d, nodes->atom + i * curve->d);
        nodes->x[i] = direction[0];
        nodes->y[i] = direction[1];
    }
    loxo_release(ctx, move);
    return LOXO_OK;
}

void extension_nodes_destroy(loxo_context *ctx, extension_nodes *nodes)
{
    loxo_release(ctx, nodes->cosine);
    loxo_release(ctx, nodes->sine);
    loxo_release(ctx, nodes->x);
    loxo_release(ctx, nodes->y);
    loxo_release(ctx, nodes->atom);
}

/* ---- graded nodes: EXTENSION.md, «Graded nodes» ---- */

/* Jacobi's sn, cn, dn. */
typedef struct jacobi {
    double sn, cn, dn;
} jacobi;

/* Of u, 0 <= u <= K / 2, for the complementary modulus k' by the arithmetic-geometric mean; returns K. u is given over K. */
static double jacobi_of(double u_over_k, double complement, jacobi *out)
{
    double a[16], c[16], b = complement;
    int i = 0;
    a[0] = 1.0;
    while (a[i] - b > 1e-15 * a[i] && i < 15) {
        c[i + 1] = 0.5 * (a[i] - b);
        a[i + 1] = 0.5 * (a[i] + b);
        b = sqrt(a[i] * b);
        ++i;
    }
    const double whole = 0.5 * PI / a[i];
    double phi = ldexp(a[i] * u_over_k * whole, i);
    for (; i > 0; --i)
        phi = 0.5 * (phi + asin(c[i] / a[i] * sin(phi)));
    out->sn = sin(phi);
    out->cn = cos(phi);
    out->dn = sqrt(out->cn * out->cn + complement * complement * out->sn * out->sn);
    return whole;
}

/* The addition theorem. */
static jacobi jacobi_sum(jacobi a, jacobi b, double square)
{
    const double inverse = 1.0 / (1.0 - square * (a.sn * a.sn) * (b.sn * b.sn));
    return (jacobi){(a.sn * b.cn * b.dn + b.sn * a.cn * a.dn) * inverse,
                    (a.cn * b.cn - a.sn * a.dn * b.sn * b.dn) * inverse,
                    (a.dn * b.dn - square * a.sn * a.cn * b.sn * b.cn) * inverse};
}

static void put_node(int64_t n, int64_t k, double sine, double cosine, double weight, const extension_graded *out)
{
    const int64_t i = node_place(n, k);
    out->sine[i] = sine;
    out->cosine[i] = cosine;
    out->weight[i] = weight;
}

void extension_grade_nodes(int64_t n, double complement, const extension_graded *out)
{
    const double square = (1.0 - complement) * (1.0 + complement);
    jacobi first, step, at[4], jump;
    (void)jacobi_of(1.0 / (double)n, complement, &first); /* u = h / 2, h = 2 K / n */
    step = jacobi_sum(first, first, square);
    at[0] = first;
    for (int l = 1; l < 4; ++l)
        at[l] = jacobi_sum(at[l - 1], step, square);
    jump = jacobi_sum(step, step, square);
    jump = jacobi_sum(jump, jump, square);
    for (int64_t m = 0; m < n / 4; m += 4) /* 0 < u < K / 2; what is beyond, by K - u, and on the other side */
        for (int l = 0; l < 4; ++l) {
            const double sn = at[l].sn, cn = at[l].cn, dn = at[l].dn, inverse = 1.0 / dn;
            const int64_t low = m + l, high = n / 2 - 1 - low;
            for (int side = -1; side <= 1; side += 2) {
                put_node(n, side > 0 ? n / 2 + low : n / 2 - 1 - low, side * sn, cn, dn, out);
                put_node(n, side > 0 ? n / 2 + high : n / 2 - 1 - high, side * cn * inverse, complement * sn * inverse,
                         complement * inverse, out);
            }
            at[l] = jacobi_sum(at[l], jump, square);
        }
}

/* ---- moved nodes ---- */

/* Without the kernels: any d, any segments. */
static void move_any(const extension_curve *c, const extension_seen *nodes, const double direction[2], double beta,
                     double *atom)
{
    for (int64_t i = 0; i < nodes->n; ++i) {
        const double cosine = nodes->cosine[i], b = beta * nodes->sine[i];
        const double re = cosine * cosine - b * b, im = 2.0 * cosine * b, inverse = 1.0 / (cosine * cosine + b * b);
        const double at[2] = {(direction[0] * re - direction[1] * im) * inverse,
                              (direction[1] * re + direction[0] * im) * inverse};
        extension_curve_at(c, at, atom + i * c->d);
    }
}

void extension_move_nodes(const k_variant *kernels, const extension_curve *c, const extension_seen *nodes,
                          const double direction[2], double beta, double *atom)
{
    if (!c->is_even || c->d > 3) {
        move_any(c, nodes, direction, beta, atom);
        return;
    }
    const int64_t j = extension_segment_at(c, direction);
    const double *own = c->on_circle + 2 * j;
    const double rest =
        atan2(own[0] * direction[1] - own[1] * direction[0], own[0] * direction[0] + own[1] * direction[1]);
    k_moved moved = {.n = nodes->n,
                     .cosine = nodes->cosine,
                     .sine = nodes->sine,
                     .beta = beta,
                     .direction = {direction[0], direction[1]},
                     .per_radian = (double)c->n / PI,
                     .n_segments = c->n,
                     .row = c->row};
    moved.place = (double)j + 0.5 * rest * moved.per_radian;
    (c->d == 3 ? kernels->moved3 : kernels->moved2)(&moved, atom);
}

/* ---- near the circle: differences ---- */

/* What a segment's part from a point p = X / |X| to X + D makes of the curve: their difference, without loss where D is small. */
static void add_difference(int d, const double *point, const double *step, double *e)
{
    const double square = k_ball_dot(d, point, point);
    const double eta = (k_ball_dot(d, point, step) + 0.5 * k_ball_dot(d, step, step)) / square;
    const double root = sqrt(1.0 + 2.0 * eta), more = 2.0 * eta / (1.0 + root), inverse = 1.0 / (sqrt(square) * root);
    for (int k = 0; k < d; ++k)
        e[k] += (step[k] - more * point[k]) * inverse;
}

/* The segments around the direction of z: from sample `at[0]` to the next one. */
typedef struct neighbourhood {
    const extension_curve *curve;
    double direction[2];
    int64_t own, after, before;
    double to_begin, to_end;        /* angles from the direction to the ends of the own segment: <= 0, >= 0 */
    double point[EXTENSION_MOST_D]; /* the own segment's map of the direction */
    double p[EXTENSION_MOST_D];     /* the curve's point */
    double begin[EXTENSION_MOST_D], end[EXTENSION_MOST_D]; /* differences from it at these ends */
} neighbourhood;

/* M (x - a) for the point x at an angle tau from the point a of the circle. */
static void map_step(const extension_curve *c, int64_t segment, const double a[2], double tau, double *step)
{
    const double *row = c->row + 2 * segment * c->stride;
    const double half = sin(0.5 * tau), along = -2.0 * half * half, across = sin(tau);
    const double x = along * a[0] - across * a[1], y = along * a[1] + across * a[0];
    for (int k = 0; k < c->d; ++k)
        step[k] = x * row[k] + y * row[c->stride + k];
}

static double angle_between(const double a[2], const double b[2])
{
    return atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]);
}

static void look_around(const extension_curve *c, const double direction[2], neighbourhood *h)
{
    const int64_t n = c->n, j = extension_segment_at(c, direction);
    const double *row = c->row + 2 * j * c->stride;
    double step[EXTENSION_MOST_D], square = 0.0;
    *h = (neighbourhood){.curve = c,
                         .direction = {direction[0], direction[1]},
                         .own = j,
                         .after = j + 1 < n ? j + 1 : 0,
                         .before = j > 0 ? j - 1 : n - 1};
    h->to_begin = fmin(angle_between(direction, c->on_circle + 2 * j), 0.0);
    h->to_end = fmax(angle_between(direction, c->on_circle + 2 * h->after), 0.0);
    for (int k = 0; k < c->d; ++k) {
        h->point[k] = direction[0] * row[k] + direction[1] * row[c->stride + k];
        square += h->point[k] * h->point[k];
    }
    for (int k = 0; k < c->d; ++k)
        h->p[k] = h->point[k] / sqrt(square);
    map_step(c, j, direction, h->to_begin, step);
    add_difference(c->d, h->point, step, h->begin);
    map_step(c, j, direction, h->to_end, step);
    add_difference(c->d, h->point, step, h->end);
}

/* e = curve at the angle tau from the direction, less p. */
static void find_difference(const neighbourhood *h, double tau, double *e)
{
    const extension_curve *c = h->curve;
    const int64_t n = c->n;
    const size_t row = (size_t)c->d * sizeof *e;
    double step[EXTENSION_MOST_D];
    const double beyond = tau - h->to_end, ahead = tau - h->to_begin;
    const int64_t second = h->after + 1 < n ? h->after + 1 : 0;
    if (ahead >= 0.0 && beyond <= 0.0) {
        memset(e, 0, row);
        map_step(c, h->own, h->direction, tau, step);
        add_difference(c->d, h->point, step, e);
    } else if (beyond > 0.0 && beyond <= angle_between(c->on_circle + 2 * h->after, c->on_circle + 2 * second)) {
        memcpy(e, h->end, row);
        map_step(c, h->after, c->on_circle + 2 * h->after, beyond, step);
        add_difference(c->d, c->sample + h->after * c->d, step, e);
    } else if (ahead < 0.0 && ahead >= -angle_between(c->on_circle + 2 * h->before, c->on_circle + 2 * h->own)) {
        memcpy(e, h->begin, row);
        map_step(c, h->before, c->on_circle + 2 * h->own, ahead, step);
        add_difference(c->d, c->sample + h->own * c->d, step, e);
    } else {
        const double cosine = cos(tau), sine = sin(tau);
        const double at[2] = {h->direction[0] * cosine - h->direction[1] * sine,
                              h->direction[1] * cosine + h->direction[0] * sine};
        extension_curve_at(c, at, e);
        for (int k = 0; k < c->d; ++k)
            e[k] -= h->p[k];
    }
}

/* Without underflow of the squares. */
static double length_of(int d, const double *e)
{
    double most = 0.0, square = 0.0;
    for (int k = 0; k < d; ++k)
        most = fmax(most, fabs(e[k]));
    for (int k = 0; k < d && most > 0.0; ++k)
        square += (e[k] / most) * (e[k] / most);
    return most * sqrt(square);
}

double extension_move_nodes_near(const extension_curve *c, const extension_seen *nodes, const double direction[2],
                                 double beta, double *atom, double *w)
{
    const int d = c->d;
    double e[EXTENSION_MOST_D], size = 0.0, farthest = 0.0;
    neighbourhood h;
    look_around(c, direction, &h);
    /* as far from the sphere as the curve is long over the middle half of the measure */
    for (int side = -1; side <= 1; side += 2) {
        find_difference(&h, 2.0 * atan2(side * beta, 1.0), e);
        size += 0.5 * length_of(d, e);
    }
    for (int64_t i = 0; i < nodes->n; ++i) {
        find_difference(&h, 2.0 * atan2(beta * nodes->sine[i], nodes->cosine[i]), atom + i * d);
        farthest = fmax(farthest, length_of(d, atom + i * d));
    }
    size = size > 0.0 ? size : farthest; /* the curve may rest there */
    const double gap = size < 1.0 ? size : 1.0, co = gap * (2.0 - gap);
    for (int k = 0; k < d; ++k)
        w[k] = (1.0 - gap) * h.p[k];
    for (int64_t i = 0; i < nodes->n && gap > 0.0;
         ++i) { /* sigma_w by differences: x - w = e + gap p, co = gap (2 - gap) */
        double *y = atom + i * d, square = 0.0, norm = 0.0;
        for (int k = 0; k < d; ++k) {
            y[k] = y[k] / gap + h.p[k];
            square += y[k] * y[k];
        }
        for (int k = 0; k < d; ++k) {
            y[k] = (2.0 - gap) / square * y[k] - w[k];
            norm += y[k] * y[k];
        }
        for (int k = 0; k < d; ++k)
            y[k] /= sqrt(norm);
    }
    return co;
}
