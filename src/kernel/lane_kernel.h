/* SPDX-License-Identifier: MIT
 * Closing of K_WIDE polygons side by side, a polygon a lane: edges to unit vectors, the search for the barycenter, the closed polygon.
 * Polygons of the same number of edges, in the plane or in space, a few thousand edges at most so that they stay in the cache.
 * Each lane's numbers come from its own polygon alone: who stands beside it, and how wide vectors are, changes no bit.
 * source  Cantarella, Schumacher 2022; the bound of the last step is (18), the rest is derived in src/hyperbolic/README.md and
 *         src/solver/barycenter/README.md */
#ifndef LOXO_KERNEL_LANE_KERNEL_H
#define LOXO_KERNEL_LANE_KERNEL_H

#include "kernel/lanes.h"
#include "kernel/moment_kernel.h"

#include <math.h>
#include <string.h>

#if defined(__AVX__)
#include <immintrin.h>
#endif

#define K_LANE_PASSES 12  /* most looks before a lane is left to another way */
#define K_LANE_TURNED 64  /* edges, up to which vertices are mended by turns */
#define K_LANE_GROUP  4   /* edges whose sum is added to that of all with what it lost */
#define K_LANE_FETCH  192 /* numbers ahead that are asked for where they come from memory */

/* Flags tell which of many loops it is; it has to be known when they are compiled. */
#define K_LANE_INLINE static inline __attribute__((always_inline))

#define K_WIDE_STORE(p, v) (*(k_wide_anywhere *)(void *)(p) = (v))
/* Past the caches, to 64 aligned bytes; all of it is there after the end. */
#if defined(__AVX512F__)
#define K_WIDE_PUT(streams, p, v)                                                                                      \
    do {                                                                                                               \
        if (streams)                                                                                                   \
            _mm512_stream_pd((p), (__m512d)(v));                                                                       \
        else                                                                                                           \
            K_WIDE_STORE(p, v);                                                                                        \
    } while (0)
#define K_WIDE_STREAM_END() _mm_sfence()
#elif defined(__AVX__)
#define K_WIDE_PUT(streams, p, v)                                                                                      \
    do {                                                                                                               \
        if (streams)                                                                                                   \
            _mm256_stream_pd((p), (__m256d)(v));                                                                       \
        else                                                                                                           \
            K_WIDE_STORE(p, v);                                                                                        \
    } while (0)
#define K_WIDE_STREAM_END() _mm_sfence()
#else
#define K_WIDE_PUT(streams, p, v) K_WIDE_STORE(p, v)
#define K_WIDE_STREAM_END()       (void)0
#endif

static inline void k_wide_sqrt(k_wide *v)
{
#if defined(__AVX512F__)
    *v = (k_wide)_mm512_sqrt_pd((__m512d)*v);
#elif defined(__AVX__)
    *v = (k_wide)_mm256_sqrt_pd((__m256d)*v);
#else
    for (int l = 0; l < K_WIDE; ++l)
        (*v)[l] = sqrt((*v)[l]);
#endif
}

/* Rows to columns, in place. */
static inline void k_transpose(k_wide *t)
{
#if K_WIDE == 8
    k_wide u[8], v[8];
    for (int i = 0; i < 8; i += 2) {
        u[i] = __builtin_shufflevector(t[i], t[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
        u[i + 1] = __builtin_shufflevector(t[i], t[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
    }
    for (int i = 0; i < 8; i += 4)
        for (int k = 0; k < 2; ++k) {
            v[i + k] = __builtin_shufflevector(u[i + k], u[i + k + 2], 0, 1, 8, 9, 4, 5, 12, 13);
            v[i + k + 2] = __builtin_shufflevector(u[i + k], u[i + k + 2], 2, 3, 10, 11, 6, 7, 14, 15);
        }
    for (int k = 0; k < 4; ++k) {
        t[k] = __builtin_shufflevector(v[k], v[k + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        t[k + 4] = __builtin_shufflevector(v[k], v[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
#else
    const k_wide a = __builtin_shufflevector(t[0], t[1], 0, 4, 2, 6),
                 b = __builtin_shufflevector(t[0], t[1], 1, 5, 3, 7);
    const k_wide c = __builtin_shufflevector(t[2], t[3], 0, 4, 2, 6),
                 e = __builtin_shufflevector(t[2], t[3], 1, 5, 3, 7);
    t[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
    t[1] = __builtin_shufflevector(b, e, 0, 1, 4, 5);
    t[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
    t[3] = __builtin_shufflevector(b, e, 2, 3, 6, 7);
#endif
}

/* Numbers begin..begin + count - 1 of the lanes, count <= K_WIDE: t[k][lane]. */
K_LANE_INLINE void k_lanes_gather(const double *const *x, int64_t begin, int64_t count, k_wide *t)
{
    if (count == K_WIDE) {
        for (int l = 0; l < K_WIDE; ++l)
            t[l] = K_WIDE_LOAD(x[l] + begin);
        k_transpose(t);
        return;
    }
    for (int64_t k = 0; k < count; ++k)
        for (int l = 0; l < K_WIDE; ++l)
            t[k][l] = x[l][begin + k];
}

/* all: every lane is written. streams: past the caches. */
K_LANE_INLINE void k_lanes_scatter(double *const *out, bool all, bool streams, int64_t begin, int64_t count, k_wide *t)
{
    if (count == K_WIDE) {
        k_transpose(t);
        for (int l = 0; l < K_WIDE; ++l)
            if (streams || all || out[l] != NULL) K_WIDE_PUT(streams, out[l] + begin, t[l]);
        return;
    }
    for (int64_t k = 0; k < count; ++k)
        for (int l = 0; l < K_WIDE; ++l)
            if (all || out[l] != NULL) out[l][begin + k] = t[k][l];
}

/* The sums of one look: of p, p v, p v v^T; of these the last entry follows from the trace, which is that of the shifted atoms, 1. */
typedef struct k_lane_sums {
    k_wide weight, one[3], two[5]; /* xx xy xz yy yz; xx xy */
} k_lane_sums;

/* The state of the search. */
typedef struct k_lane_state {
    k_wide w[3], co, bound;
    k_wide left;                            /* least eigenvalue at w, from below; where done */
    k_wide inverse[6];                      /* of A before the last step; where done */
    k_wide_bits is_done, is_tried, is_over; /* tried: done, not yet certified; over: done, or left to another way */
} k_lane_state;

K_LANE_INLINE void k_lane_add(int d, bool has_weights, const k_wide *v, const k_wide *p, k_lane_sums *s)
{
    k_wide pv[3];
    for (int k = 0; k < d; ++k) {
        pv[k] = has_weights ? *p * v[k] : v[k];
        s->one[k] += pv[k];
    }
    s->two[0] += pv[0] * v[0];
    s->two[1] += pv[0] * v[1];
    if (d == 3) {
        s->two[2] += pv[0] * v[2];
        s->two[3] += pv[1] * v[1];
        s->two[4] += pv[1] * v[2];
    }
}

/* What the first look carries from atom to atom. */
typedef struct k_lane_reader {
    k_wide before[3]; /* the last vertex */
    k_wide worst;     /* most that a direction's square is off 1 */
} k_lane_reader;

/* Atoms begin..begin + count - 1, count <= K_WIDE, of the first look: from the centre, where atoms are what they are. Makes unit vectors
 * and lengths and keeps them in the buffer. */
K_LANE_INLINE void k_lanes_read(const k_lanes *job, const double *const *x, int d, k_lane_form form, bool has_weights,
                                int64_t begin, int64_t count, double *restrict at, k_lane_reader *reader,
                                k_lane_sums *s)
{
    const int64_t numbers = count * d, first = (begin + (form == K_LANE_VERTICES ? 1 : 0)) * d;
    const k_wide ones = (k_wide){0} + 1.0;
    k_wide t[3 * K_WIDE], lengths[K_WIDE];
    for (int c = 0; c < d; ++c) {
        const int64_t left = numbers - (int64_t)c * K_WIDE;
        for (int l = 0; job->is_far && l < K_WIDE; ++l)
            __builtin_prefetch(x[l] + first + (int64_t)c * K_WIDE + K_LANE_FETCH);
        if (left > 0)
            k_lanes_gather(x, first + (int64_t)c * K_WIDE, left < K_WIDE ? left : K_WIDE, t + (ptrdiff_t)c * K_WIDE);
    }
    if (form == K_LANE_DIRECTIONS && has_weights) k_lanes_gather(job->length + (x - job->x), begin, count, lengths);
    for (int64_t j = 0; j < count; ++j) {
        k_wide e[3], square = ones, p = ones;
        for (int k = 0; k < d; ++k) {
            e[k] = t[j * d + k];
            if (form == K_LANE_VERTICES) {
                const k_wide here = e[k];
                e[k] -= reader->before[k];
                reader->before[k] = here;
            }
            square = k == 0 ? e[k] * e[k] : square + e[k] * e[k];
        }
        if (form == K_LANE_DIRECTIONS) {
            /* two steps of Newton for the inverse root, from 1 */
            const k_wide off = square - 1.0, size = off * off;
            k_wide f = 1.5 - 0.5 * square;
            f *= 1.5 - 0.5 * square * f * f;
            for (int k = 0; k < d; ++k)
                e[k] *= f;
            reader->worst = K_WIDE_CHOOSE(size <= reader->worst, reader->worst, size); /* NaN stays once it is there */
            if (has_weights) p = lengths[j];
        } else {
            p = square;
            k_wide_sqrt(&p);
            const k_wide_bits none = p <= 0.0;
            const k_wide inverse = 1.0 / K_WIDE_CHOOSE(none, ones, p);
            for (int k = 0; k < d; ++k)
                e[k] *= inverse;
            e[0] = K_WIDE_CHOOSE(none, ones, e[0]); /* an edge of no length: any direction */
        }
        for (int k = 0; k < d; ++k, at += K_WIDE)
            K_WIDE_STORE(at, e[k]);
        if (has_weights) {
            K_WIDE_STORE(at, p);
            at += K_WIDE;
            s->weight += p;
        }
        k_lane_add(d, has_weights, e, &p, s);
    }
}

/* bad: lanes whose directions are none. */
K_LANE_INLINE void k_lanes_begin(const k_lanes *job, int half, int d, k_lane_form form, bool has_weights,
                                 double *restrict buffer, k_lane_sums *sums, k_wide_bits *bad)
{
    const double *const *x = job->x + (ptrdiff_t)half * K_WIDE;
    const int64_t n = job->n, whole = n - n % K_WIDE, row = (int64_t)(d + (has_weights ? 1 : 0)) * K_WIDE;
    k_lane_reader reader = {0};
    k_lane_sums s = {0};
    for (int k = 0; form == K_LANE_VERTICES && k < d; ++k) {
        double vertex[K_WIDE];
        for (int l = 0; l < K_WIDE; ++l)
            vertex[l] = x[l][k];
        reader.before[k] = K_WIDE_LOAD(vertex);
    }
    for (int64_t i = 0; i < whole; i += K_WIDE)
        k_lanes_read(job, x, d, form, has_weights, i, K_WIDE, buffer + i * row, &reader, &s);
    if (whole < n) k_lanes_read(job, x, d, form, has_weights, whole, n - whole, buffer + whole * row, &reader, &s);
    if (!has_weights) s.weight += (double)n;
    *sums = s;
    *bad = ~(reader.worst <= 4e-12);
}

/* A look from w. */
K_LANE_INLINE void k_lanes_look(int64_t n, int d, bool has_weights, const double *restrict buffer,
                                const k_lane_state *state, k_lane_sums *s)
{
    const int64_t row = (int64_t)(d + (has_weights ? 1 : 0)) * K_WIDE;
    const k_wide co = state->co;
    k_wide w[3];
    for (int k = 0; k < d; ++k)
        w[k] = state->w[k];
    const k_wide weight = s->weight;
    memset(s, 0, sizeof *s);
    for (int64_t i = 0; i < n; ++i, buffer += row) {
        k_wide v[3], square = co, p = co;
        for (int k = 0; k < d; ++k) {
            v[k] = K_WIDE_LOAD(buffer + (ptrdiff_t)k * K_WIDE) - w[k];
            square = k == 0 ? v[k] * v[k] : square + v[k] * v[k];
        }
        if (has_weights) p = K_WIDE_LOAD(buffer + (ptrdiff_t)d * K_WIDE);
        const k_wide f = co / square;
        for (int k = 0; k < d; ++k)
            v[k] *= f;
        k_lane_add(d, has_weights, v, &p, s);
    }
    s->weight = weight;
}

#define K_LANE_EPS   2.3e-16
#define K_LANE_NEAR  0.1 /* 1 - |w|^2 below which a lane is left to the way that carries atoms */
#define K_LANE_AHEAD 8.0 /* a bound so many times the tolerance is tried: what is written is mostly better, and tells */
#define K_LANE_FLAT  1e-5 /* and so for the least eigenvalue */

/* y = a x of a symmetric matrix, xx xy xz yy yz zz; xx xy yy. */
static inline void k_lanes_times(int d, const k_wide *a, const k_wide *x, k_wide *y)
{
    if (d == 2) {
        y[0] = a[0] * x[0] + a[1] * x[1];
        y[1] = a[1] * x[0] + a[2] * x[1];
        return;
    }
    y[0] = a[0] * x[0] + a[1] * x[1] + a[2] * x[2];
    y[1] = a[1] * x[0] + a[3] * x[1] + a[4] * x[2];
    y[2] = a[2] * x[0] + a[4] * x[1] + a[5] * x[2];
}

static inline void k_lanes_dot(int d, const k_wide *a, const k_wide *b, k_wide *sum)
{
    *sum = a[0] * b[0] + a[1] * b[1];
    if (d == 3) *sum += a[2] * b[2];
}

static inline void k_lanes_length(int d, const k_wide *a, k_wide *length)
{
    k_lanes_dot(d, a, a, length);
    k_wide_sqrt(length);
}

/* A step from what was seen: direction by the adjugate, the least eigenvalue from below by one step of Laguerre's, damped or full as (17) says.
 * A lane whose next point is certified, or nearly (ahead times the tolerance), is done. */
static inline void k_lanes_step(int d, double tolerance, double ahead, const k_lane_sums *s, k_lane_state *state)
{
    const k_wide inverse = 1.0 / s->weight, none = (k_wide){0};
    const k_wide *w = state->w;
    k_wide m[3], a[6], c[6], u[3], det, low; /* a: A = 1 - M; c: its adjugate */
    for (int k = 0; k < d; ++k)
        m[k] = s->one[k] * inverse - w[k];
    const k_wide xx = s->two[0] * inverse - 2.0 * m[0] * w[0] - w[0] * w[0];
    const k_wide xy = s->two[1] * inverse - m[0] * w[1] - w[0] * m[1] - w[0] * w[1];
    if (d == 2) {
        a[0] = 1.0 - xx;
        a[1] = -xy;
        a[2] = xx;
        c[0] = a[2];
        c[1] = -a[1];
        c[2] = a[0];
        det = a[0] * a[2] - a[1] * a[1];
        k_wide root = 1.0 - 4.0 * det;
        root = K_WIDE_CHOOSE(root > 0.0, root, none);
        k_wide_sqrt(&root);
        low = 2.0 * det / (1.0 + root);
    } else {
        const k_wide xz = s->two[2] * inverse - m[0] * w[2] - w[0] * m[2] - w[0] * w[2];
        const k_wide yy = s->two[3] * inverse - 2.0 * m[1] * w[1] - w[1] * w[1];
        const k_wide yz = s->two[4] * inverse - m[1] * w[2] - w[1] * m[2] - w[1] * w[2];
        a[0] = 1.0 - xx;
        a[1] = -xy;
        a[2] = -xz;
        a[3] = 1.0 - yy;
        a[4] = -yz;
        a[5] = xx + yy;
        c[0] = a[3] * a[5] - a[4] * a[4];
        c[1] = a[2] * a[4] - a[1] * a[5];
        c[2] = a[1] * a[4] - a[2] * a[3];
        c[3] = a[0] * a[5] - a[2] * a[2];
        c[4] = a[1] * a[2] - a[0] * a[4];
        c[5] = a[0] * a[3] - a[1] * a[1];
        det = a[0] * c[0] + a[1] * c[1] + a[2] * c[2];
        const k_wide minors = c[0] + c[3] + c[5];
        k_wide root = minors * minors - 6.0 * det;
        root = K_WIDE_CHOOSE(root > 0.0, root, none);
        k_wide_sqrt(&root);
        low = 3.0 * det / (minors + 2.0 * root);
    }
    low -= 16.0 * K_LANE_EPS;
    const k_wide over_det = 1.0 / det;
    for (int k = 0; k < (d == 3 ? 6 : 3); ++k)
        c[k] *= over_det;
    k_lanes_times(d, c, m, u);
    for (int k = 0; k < d; ++k)
        u[k] *= 0.5;
    k_wide square;
    k_lanes_dot(d, u, u, &square);
    k_wide length = square;
    k_wide_sqrt(&length);

    /* L = 2 |u|. After a full step |F|_g <= L^2 / 2, and the least eigenvalue is at least low - L: the certificate there, before it is seen */
    const k_wide full_length = 2.0 * length, left = low - full_length;
    const k_wide share = full_length * full_length / left, noise = 16.0 * K_LANE_EPS / state->co;
    const k_wide_bits is_full = full_length <= 0.5;
    const k_wide_bits is_certain = is_full & (left > 0.0) & (share < 0.5);
    const k_wide to_come = 0.5 * share / (1.0 - share);
    /* full: tanh(t) / t by Pade, to 1e-19 for t <= 1/8, 1e-13 for t <= 1/4; damped: see src/hyperbolic/README.md */
    k_wide root = 1.0 + 4.0 * length;
    k_wide_sqrt(&root);
    const k_wide damped = 4.0 / ((root + 1.0) * (root + 1.0));
    const k_wide full = (945.0 + square * (105.0 + square)) / (945.0 + square * (420.0 + 15.0 * square));
    const k_wide factor = K_WIDE_CHOOSE(is_full, full, damped);
    const k_wide r = factor * length, co_z = K_WIDE_CHOOSE(is_full, (1.0 - r) * (1.0 + r), damped * root);
    /* composition, as k_ball_compose, as a difference: ((n + co) w + co z) over - w with co_z = 1 - r^2; so small steps leave w's rounding alone */
    k_wide z[3], sum = none;
    for (int k = 0; k < d; ++k) {
        z[k] = factor * u[k];
        sum += (w[k] + z[k]) * (w[k] + z[k]);
    }
    const k_wide over = 1.0 / (sum + state->co * co_z), co = state->co * co_z * over;
    const k_wide bound = to_come + noise / left + 16.0 * K_LANE_EPS / co;

    k_wide_bits is_good = (low > K_LANE_FLAT) & (co > K_LANE_NEAR) & (length >= 0.0); /* false for NaN */
    is_good &= (s->weight > 1e-100) & (s->weight < 1e100);
    const k_wide_bits now =
        is_good & is_certain & ((to_come <= K_LANE_EPS) | (bound <= ahead * tolerance)) & ~state->is_over;
    const k_wide_bits moves = is_good & ~state->is_over;
    for (int k = 0; k < d; ++k) {
        const k_wide next = w[k] + state->co * (r * r * w[k] + z[k]) * over;
        z[k] = K_WIDE_CHOOSE(moves, next, w[k]);
    }
    for (int k = 0; k < d; ++k)
        state->w[k] = z[k];
    state->co = K_WIDE_CHOOSE(moves, co, state->co);
    state->bound = K_WIDE_CHOOSE(now, bound, state->bound);
    state->left = K_WIDE_CHOOSE(now, left, state->left);
    for (int k = 0; k < (d == 3 ? 6 : 3); ++k)
        state->inverse[k] = K_WIDE_CHOOSE(now, c[k], state->inverse[k]);
    state->is_tried = (state->is_tried & ~now) | (now & (to_come > K_LANE_EPS) & (bound > tolerance));
    state->is_done |= now;
    state->is_over |= now | ~is_good;
}

/* What the writing carries from atom to atom. */
typedef struct k_lane_writer {
    k_wide w[3], co, sum[3], lost[3], product, exponent;
    k_wide turn[3]; /* added to directions, the part across them */
    k_wide fix[3];  /* taken off the sums with each unit of length */
    double *out[K_WIDE];
} k_lane_writer;

/* What is written, and how. */
typedef struct k_lane_task {
    bool writes;      /* else edges are added up only */
    bool as_edges;    /* else vertices */
    bool turns;       /* with k_lane_writer.turn */
    bool fixes;       /* with k_lane_writer.fix */
    bool log_stretch; /* is wanted */
    bool all;         /* every lane is written */
    bool streams;     /* past the caches */
} k_lane_task;

/* Atoms begin..begin + count - 1 of the closed polygon: shifted, put back on the sphere by one step of Newton for the inverse root, times
 * their lengths, added up: a few one by one, and what they make to the sum of all with what that loses (Knuth's exact addition). */
K_LANE_INLINE void k_lanes_put(k_lane_writer *r, int d, bool has_weights, k_lane_task task, int64_t begin,
                               int64_t count, const double *restrict at)
{
    const int64_t numbers = count * d;
    k_wide t[3 * K_WIDE];
    for (int64_t group = 0; group < count; group += K_LANE_GROUP) {
        const int64_t end = count - group < K_LANE_GROUP ? count : group + K_LANE_GROUP;
        k_wide base[3], part[3] = {{0}}, weight = {0};
        for (int k = 0; k < d; ++k)
            base[k] = r->sum[k] + r->lost[k];
        for (int64_t j = group; j < end; ++j) {
            k_wide y[3], square = r->co, norm = r->co;
            for (int k = 0; k < d; ++k, at += K_WIDE) {
                y[k] = K_WIDE_LOAD(at) - r->w[k];
                square = k == 0 ? y[k] * y[k] : square + y[k] * y[k];
            }
            const k_wide f = r->co / square;
            for (int k = 0; k < d; ++k)
                y[k] = f * y[k] - r->w[k];
            if (task.turns) {
                k_wide along;
                k_lanes_dot(d, r->turn, y, &along);
                for (int k = 0; k < d; ++k)
                    y[k] += r->turn[k] - along * y[k];
            }
            for (int k = 0; k < d; ++k)
                norm = k == 0 ? y[k] * y[k] : norm + y[k] * y[k];
            /* what is left to the sphere is small, and added apart: its rounding does not touch the lengths */
            const k_wide off = 0.5 - 0.5 * norm;
            k_wide length = off;
            if (has_weights) {
                length = K_WIDE_LOAD(at);
                at += K_WIDE;
                weight += length;
            }
            if (task.log_stretch) r->product *= square;
            for (int k = 0; k < d; ++k) {
                const k_wide whole = has_weights ? length * y[k] : y[k];
                const k_wide e = whole + whole * off;
                if (task.writes) t[j * d + k] = task.as_edges ? e : base[k] + part[k];
                part[k] += e;
            }
        }
        if (!has_weights) weight += (double)(end - group);
        for (int k = 0; k < d; ++k) {
            const k_wide next = r->sum[k] + part[k], gained = next - r->sum[k];
            r->lost[k] += (r->sum[k] - (next - gained)) + (part[k] - gained);
            if (task.fixes) r->lost[k] -= r->fix[k] * weight;
            r->sum[k] = next;
        }
    }
    if (task.log_stretch) { /* factors are in 2e-3 to 4: K_WIDE of them, and the exponent is taken off */
        const k_wide_bits bits = (k_wide_bits)r->product;
        for (int l = 0; l < K_WIDE; ++l)
            r->exponent[l] += (double)((bits[l] >> 52) - 1023);
        r->product = (k_wide)((bits & 0xfffffffffffff) | 0x3ff0000000000000);
    }
    for (int c = 0; task.writes && c < d; ++c) {
        const int64_t left = numbers - (int64_t)c * K_WIDE;
        if (left > 0)
            k_lanes_scatter(r->out, task.all, task.streams, begin * d + (int64_t)c * K_WIDE,
                            left < K_WIDE ? left : K_WIDE, t + (ptrdiff_t)c * K_WIDE);
    }
}

/* sum: of the edges. turn, fix: see k_lane_writer. */
K_LANE_INLINE void k_lanes_write_as(k_lanes *job, int half, int d, bool has_weights, k_lane_task task,
                                    const double *restrict buffer, const k_lane_state *state, const k_wide *turn,
                                    const k_wide *fix, k_wide *sum)
{
    const int64_t n = job->n, whole = n - n % K_WIDE, row = (int64_t)(d + (has_weights ? 1 : 0)) * K_WIDE;
    k_lane_writer r = {.co = state->co};
    k_wide start[3];
    double vertex[K_WIDE];
    r.product += 1.0;
    for (int l = 0; l < K_WIDE; ++l)
        r.out[l] = state->is_done[l] ? job->out[half * K_WIDE + l] : NULL;
    for (int k = 0; k < d; ++k) {
        r.w[k] = state->w[k];
        if (task.turns) r.turn[k] = turn[k];
        if (task.fixes) r.fix[k] = fix[k];
        for (int l = 0; l < K_WIDE; ++l)
            vertex[l] = job->start[half * K_WIDE + l][k];
        r.sum[k] = start[k] = K_WIDE_LOAD(vertex);
    }
    for (int64_t i = 0; i < whole; i += K_WIDE)
        k_lanes_put(&r, d, has_weights, task, i, K_WIDE, buffer + i * row);
    if (whole < n) k_lanes_put(&r, d, has_weights, task, whole, n - whole, buffer + whole * row);
    for (int k = 0; k < d; ++k)
        sum[k] = (r.sum[k] - start[k]) + r.lost[k];
    for (int l = 0; task.log_stretch && l < K_WIDE; ++l)
        job->stretch[half * K_WIDE + l] = log(r.product[l]) + r.exponent[l] * 0.6931471805599453;
}

/* The same; what is frequent is compiled apart. */
static inline void k_lanes_write(k_lanes *job, int half, int d, bool has_weights, k_lane_task task,
                                 const double *restrict buffer, const k_lane_state *state, const k_wide *turn,
                                 const k_wide *fix, k_wide *sum)
{
    static const k_lane_task add = {.all = true}, edges = {.writes = true, .as_edges = true, .all = true};
    static const k_lane_task vertices = {.writes = true, .all = true}, add_turned = {.turns = true, .all = true},
                             turned = {.writes = true, .turns = true, .fixes = true, .all = true},
                             fixed = {.writes = true, .fixes = true, .all = true};
    const bool is_plain = !task.log_stretch && !task.streams && task.all;
#define K_LANES_WRITE_AS(how) k_lanes_write_as(job, half, d, has_weights, how, buffer, state, turn, fix, sum)
    if (is_plain && !task.writes && task.turns)
        K_LANES_WRITE_AS(add_turned);
    else if (is_plain && !task.writes)
        K_LANES_WRITE_AS(add);
    else if (is_plain && task.as_edges)
        K_LANES_WRITE_AS(edges);
    else if (is_plain && task.turns)
        K_LANES_WRITE_AS(turned);
    else if (is_plain && task.fixes)
        K_LANES_WRITE_AS(fixed);
    else if (is_plain)
        K_LANES_WRITE_AS(vertices);
    else
        K_LANES_WRITE_AS(task);
#undef K_LANES_WRITE_AS
    if (task.streams) K_WIDE_STREAM_END();
}

static inline bool k_lanes_any(const k_wide_bits *mask)
{
    int64_t any = 0;
    for (int l = 0; l < K_WIDE; ++l)
        any |= (*mask)[l];
    return any != 0;
}

/* Writes the lanes that are done, and looks at what was written: its edges' sum is the residual at the last point, and certifies it where
 * the step before it did not; where it does not either, the lane goes on.
 *
 * Without a tolerance edges are added up before vertices are written: what their sum is, from rounding that all of them share, of w and of the
 * last look, goes away. Few edges are turned for it, which changes no length, and added up again; what is left then, or of many from the
 * beginning, is spread over the vertices: less than an ulp of these to each edge. */
static inline void k_lanes_finish(k_lanes *job, int half, int d, bool has_weights, k_lane_state *state,
                                  const k_wide *total)
{
    const bool is_mended = !(job->tolerance > 0.0) && !job->as_edges;
    bool any = false;
    k_lane_task task = {.writes = true,
                        .as_edges = job->as_edges,
                        .turns = is_mended && job->n <= K_LANE_TURNED,
                        .fixes = is_mended,
                        .log_stretch = job->log_stretch,
                        .all = true};
    k_wide sum[3] = {{0}}, turn[3] = {{0}}, fix[3] = {{0}}, gap = *total;
    for (int l = 0; l < K_WIDE; ++l) {
        const bool writes = state->is_done[l] != 0 && job->out[half * K_WIDE + l] != NULL;
        task.all = task.all && writes;
        any = any || writes;
    }
    if (!any) return;
    task.streams = task.all && job->streams;
    if (is_mended) {
        k_lanes_write(job, half, d, has_weights, (k_lane_task){.all = true}, job->buffer, state, turn, fix, sum);
        k_lanes_length(d, sum, &gap);
    }
    if (task.turns) {
        k_lanes_times(d, state->inverse, sum, turn);
        for (int k = 0; k < d; ++k)
            turn[k] = -turn[k] / *total;
        k_lanes_write(job, half, d, has_weights, (k_lane_task){.turns = true, .all = true}, job->buffer, state, turn,
                      fix, sum);
    }
    for (int k = 0; k < d && is_mended; ++k)
        fix[k] = sum[k] / *total;
    k_wide residual = gap;
    k_lanes_write(job, half, d, has_weights, task, job->buffer, state, turn, fix, sum);
    k_lanes_length(d, sum, &gap);
    residual = (is_mended ? residual : gap) / *total;
    for (int l = 0; l < K_WIDE; ++l)
        job->gap[half * K_WIDE + l] = gap[l];
    const k_wide share = 2.0 * (residual + 8.0 * K_LANE_EPS / state->co) / state->left;
    const k_wide bound = 0.5 * share / (1.0 - share) + 16.0 * K_LANE_EPS / state->co;
    const k_wide_bits better = (share < 0.5) & (bound < state->bound);
    state->bound = K_WIDE_CHOOSE(better, bound, state->bound);
    const k_wide_bits again = state->is_done & state->is_tried & (state->bound > job->tolerance);
    state->is_done &= ~again;
    state->is_over &= ~again;
}

/* One vector of polygons, with what the compiler is to know inserted. */
K_LANE_INLINE void k_lanes_half(k_lanes *job, int half, int d, k_lane_form form, bool has_weights)
{
    double *buffer = job->buffer;
    k_lane_state state = {0};
    k_lane_sums sums;
    k_wide_bits bad;
    bool writes = false;
    double ahead = 1.0;
    int n_passes = 1;
    for (int l = 0; l < K_WIDE; ++l)
        writes = writes || job->out[half * K_WIDE + l] != NULL;
    if (writes) ahead = K_LANE_AHEAD;
    state.co += 1.0;
    k_lanes_begin(job, half, d, form, has_weights, buffer, &sums, &bad);
    state.is_over = bad;
    k_lanes_step(d, job->tolerance, ahead, &sums, &state);
    for (;;) {
        k_wide_bits is_open = ~state.is_over;
        while (n_passes < K_LANE_PASSES && k_lanes_any(&is_open)) {
            k_lanes_look(job->n, d, has_weights, buffer, &state, &sums);
            k_lanes_step(d, job->tolerance, ahead, &sums, &state);
            ++n_passes;
            is_open = ~state.is_over;
        }
        k_lanes_finish(job, half, d, has_weights, &state, &sums.weight);
        is_open = ~state.is_over;
        if (!k_lanes_any(&is_open) || n_passes == K_LANE_PASSES) break;
        ahead = 1.0;
    }
    for (int l = 0; l < K_WIDE; ++l) {
        const int lane = half * K_WIDE + l;
        job->is_done[lane] = state.is_done[l] != 0;
        job->co[lane] = state.co[l];
        job->bound[lane] = state.bound[l];
        job->total[lane] = sums.weight[l];
        for (int k = 0; k < d; ++k)
            job->w[lane][k] = state.w[k][l];
    }
    if (n_passes > job->n_passes) job->n_passes = n_passes;
}

static inline void k_lanes_run(k_lanes *job)
{
    job->n_passes = 0;
    for (int half = 0; half < K_HALVES; ++half) {
        if (job->d == 3) {
            if (job->form == K_LANE_VERTICES)
                k_lanes_half(job, half, 3, K_LANE_VERTICES, true);
            else if (job->form == K_LANE_EDGES)
                k_lanes_half(job, half, 3, K_LANE_EDGES, true);
            else if (job->length[0] != NULL)
                k_lanes_half(job, half, 3, K_LANE_DIRECTIONS, true);
            else
                k_lanes_half(job, half, 3, K_LANE_DIRECTIONS, false);
        } else {
            if (job->form == K_LANE_VERTICES)
                k_lanes_half(job, half, 2, K_LANE_VERTICES, true);
            else if (job->form == K_LANE_EDGES)
                k_lanes_half(job, half, 2, K_LANE_EDGES, true);
            else if (job->length[0] != NULL)
                k_lanes_half(job, half, 2, K_LANE_DIRECTIONS, true);
            else
                k_lanes_half(job, half, 2, K_LANE_DIRECTIONS, false);
        }
    }
}

/* ---- one polygon, pieces of it in the lanes ------------------------------------------------------------------------ */

static inline double *k_lanes_buffer(const k_lanes *job, int half)
{
    return job->buffer + (int64_t)half * K_WIDE * job->n * (job->d + 1);
}

static inline bool k_lanes_weighted(const k_lanes *job)
{
    return job->form != K_LANE_DIRECTIONS || job->length[0] != NULL;
}

static inline void k_lanes_store(const k_lane_sums *s, int half, k_lane_table table)
{
    for (int l = 0; l < K_WIDE; ++l) {
        const int lane = half * K_WIDE + l;
        table[0][lane] = s->weight[l];
        for (int k = 0; k < 3; ++k)
            table[1 + k][lane] = s->one[k][l];
        for (int k = 0; k < 5; ++k)
            table[4 + k][lane] = s->two[k][l];
    }
}

/* The first look, as k_lanes_begin. Returns whether all directions are such. */
static inline bool k_lanes_first(const k_lanes *job, k_lane_table table)
{
    bool good = true;
    for (int half = 0; half < K_HALVES; ++half) {
        k_lane_sums s;
        k_wide_bits bad;
        double *buffer = k_lanes_buffer(job, half);
        if (job->d == 3 && job->form == K_LANE_VERTICES)
            k_lanes_begin(job, half, 3, K_LANE_VERTICES, true, buffer, &s, &bad);
        else if (job->d == 3 && job->form == K_LANE_EDGES)
            k_lanes_begin(job, half, 3, K_LANE_EDGES, true, buffer, &s, &bad);
        else if (job->d == 3 && job->length[0] != NULL)
            k_lanes_begin(job, half, 3, K_LANE_DIRECTIONS, true, buffer, &s, &bad);
        else if (job->d == 3)
            k_lanes_begin(job, half, 3, K_LANE_DIRECTIONS, false, buffer, &s, &bad);
        else if (job->form == K_LANE_VERTICES)
            k_lanes_begin(job, half, 2, K_LANE_VERTICES, true, buffer, &s, &bad);
        else if (job->form == K_LANE_EDGES)
            k_lanes_begin(job, half, 2, K_LANE_EDGES, true, buffer, &s, &bad);
        else if (job->length[0] != NULL)
            k_lanes_begin(job, half, 2, K_LANE_DIRECTIONS, true, buffer, &s, &bad);
        else
            k_lanes_begin(job, half, 2, K_LANE_DIRECTIONS, false, buffer, &s, &bad);
        k_lanes_store(&s, half, table);
        good = good && !k_lanes_any(&bad);
    }
    return good;
}

static inline void k_lanes_set(k_lane_state *state, int d, const double *w, double co)
{
    *state = (k_lane_state){0};
    for (int k = 0; k < d; ++k)
        state->w[k] += w[k];
    state->co += co;
    state->is_done = ~state->is_done;
}

/* A look from w, as k_lanes_look; the weights' sums are those of the first look. */
static inline void k_lanes_again(const k_lanes *job, const double *w, double co, k_lane_table table)
{
    for (int half = 0; half < K_HALVES; ++half) {
        const double *buffer = k_lanes_buffer(job, half);
        k_lane_sums s = {0};
        k_lane_state state;
        k_lanes_set(&state, job->d, w, co);
        for (int l = 0; l < K_WIDE; ++l)
            s.weight[l] = table[0][half * K_WIDE + l];
        if (job->d == 3 && k_lanes_weighted(job))
            k_lanes_look(job->n, 3, true, buffer, &state, &s);
        else if (job->d == 3)
            k_lanes_look(job->n, 3, false, buffer, &state, &s);
        else if (k_lanes_weighted(job))
            k_lanes_look(job->n, 2, true, buffer, &state, &s);
        else
            k_lanes_look(job->n, 2, false, buffer, &state, &s);
        k_lanes_store(&s, half, table);
    }
}

/* Adds up each lane's edges from w, and writes them if that is wanted: job->sum, and job->stretch unless vertices are written, these with
 * job->fix if that is wanted. */
static inline void k_lanes_last(k_lanes *job, const double *w, double co, bool fixes, bool writes)
{
    const k_lane_task task = {.writes = writes,
                              .as_edges = job->as_edges,
                              .fixes = fixes,
                              .log_stretch = job->log_stretch && (!writes || job->as_edges),
                              .all = true,
                              .streams = writes && job->streams};
    for (int half = 0; half < K_HALVES; ++half) {
        const double *buffer = k_lanes_buffer(job, half);
        k_wide sum[3] = {{0}}, fix[3] = {{0}};
        k_lane_state state;
        k_lanes_set(&state, job->d, w, co);
        for (int k = 0; k < job->d; ++k)
            fix[k] = (k_wide){0} + job->fix[k];
        if (job->d == 3 && k_lanes_weighted(job))
            k_lanes_write(job, half, 3, true, task, buffer, &state, NULL, fix, sum);
        else if (job->d == 3)
            k_lanes_write(job, half, 3, false, task, buffer, &state, NULL, fix, sum);
        else if (k_lanes_weighted(job))
            k_lanes_write(job, half, 2, true, task, buffer, &state, NULL, fix, sum);
        else
            k_lanes_write(job, half, 2, false, task, buffer, &state, NULL, fix, sum);
        for (int l = 0; l < K_WIDE; ++l)
            for (int k = 0; k < job->d; ++k)
                job->sum[half * K_WIDE + l][k] = sum[k][l];
    }
}

/* k_lanes_step of one polygon; sums in the order of k_lane_table. */
static inline void k_lanes_one_step(int d, double tolerance, double ahead, const double sums[9], k_lane_point *point)
{
    k_lane_sums s = {0};
    k_lane_state state;
    k_lanes_set(&state, d, point->w, point->co);
    state.is_done = ~state.is_done;
    s.weight += sums[0];
    for (int k = 0; k < 3; ++k)
        s.one[k] += sums[1 + k];
    for (int k = 0; k < 5; ++k)
        s.two[k] += sums[4 + k];
    if (d == 3)
        k_lanes_step(3, tolerance, ahead, &s, &state);
    else
        k_lanes_step(2, tolerance, ahead, &s, &state);
    for (int k = 0; k < d; ++k)
        point->w[k] = state.w[k][0];
    point->co = state.co[0];
    point->bound = state.bound[0];
    point->left = state.left[0];
    point->is_done = state.is_done[0] != 0;
    point->is_tried = state.is_tried[0] != 0;
    point->is_over = state.is_over[0] != 0;
}

#endif
