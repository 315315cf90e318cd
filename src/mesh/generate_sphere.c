/* SPDX-License-Identifier: MIT
 * Spheres: the icosphere of any frequency and what is made of it by moving its vertices, and the lat-long sphere.
 *
 * Icosphere of frequency n. The icosahedron is ten rhombi of two faces each, in five pairs: A_k from the north pole N
 * over U_k and U_k+1 of the upper ring to L_k of the lower, B_k from U_k+1 over L_k and L_k+1 to the south pole S. A
 * rhombus is a lattice (i, j), 0 <= i, j <= n, with corners
 *     (0,0)   A: N      B: U_k+1        (n,0)   A: U_k    B: L_k
 *     (0,n)   A: U_k+1  B: L_k+1        (n,n)   A: L_k    B: S
 * and owns i >= 1, j < n: n^2 vertices in rows, so that neighbours are near in number. With N first and S last that is
 * 10 n^2 + 2. A vertex lies on the flat triangle at its lattice place, normalised. */
#include "base/rng.h"
#include "mesh/generate_internal.h"

#include <math.h>

/* Of the icosahedron with vertices (+-s, +-c, 0) and cyclic, s^2 + c^2 = 1, c / s the golden ratio. */
#define S_ 0.52573111211913360602566908484787661
#define C_ 0.85065080835203993218154049706301107

static const double north[3] = {0, S_, C_};
static const double upper[5][3] = {{0, -S_, C_}, {C_, 0, S_}, {S_, C_, 0}, {-S_, C_, 0}, {-C_, 0, S_}};

/* Corner 0..3 of rhombus r = 2 k + (0: A, 1: B): (0,0), (n,0), (n,n), (0,n). L_k is opposite to U_k+3. */
static void rhombus_corner(int64_t r, int corner, double p[3])
{
    const int64_t k = r / 2;
    const double *from;
    double sign = 1.0;
    if (r % 2 == 0) {
        from = corner == 0 ? north : corner == 1 ? upper[k] : corner == 3 ? upper[(k + 1) % 5] : upper[(k + 3) % 5];
        if (corner == 2) sign = -1.0;
    } else {
        from = corner == 0   ? upper[(k + 1) % 5]
               : corner == 1 ? upper[(k + 3) % 5]
               : corner == 3 ? upper[(k + 4) % 5]
                             : north;
        if (corner != 0) sign = -1.0;
    }
    for (int c = 0; c < 3; ++c)
        p[c] = sign * from[c];
}

static inline int64_t owned(int64_t r, int64_t n, int64_t i, int64_t j) { return 1 + (r * n + i - 1) * n + j; }

/* Vertex at (i, j) of rhombus r, on the rhombus that owns it. */
static inline int64_t icosphere_vertex(int64_t r, int64_t n, int64_t i, int64_t j)
{
    if (i >= 1 && j < n) return owned(r, n, i, j);
    const int64_t next = (r + 2) % 10; /* the same kind, one further east */
    if (r % 2 == 0) {
        if (i == 0) return j == 0 ? 0 : owned(next, n, j, 0);
        return owned(r + 1, n, i, 0);
    }
    if (i == 0) return j < n ? owned((r + 1) % 10, n, n, j) : owned(next, n, n, 0);
    return i < n ? owned(next, n, n, i) : 10 * n * n + 1;
}

static void icosphere_faces(const loxo_generator *g, int64_t begin, int64_t end, loxo_index (*triangle)[3])
{
    const int64_t n = g->n_u;
    for (int64_t f = begin; f < end; ++f) {
        const int64_t r = f / (2 * n * n), cell = f % (2 * n * n) / 2, i = cell / n, j = cell % n;
        loxo_index *t = triangle[f - begin];
        if (f % 2 == 0)
            t[0] = (loxo_index)icosphere_vertex(r, n, i, j);
        else
            t[0] = (loxo_index)icosphere_vertex(r, n, i + 1, j + 1);
        t[1 + f % 2] = (loxo_index)icosphere_vertex(r, n, i + 1, j);
        t[2 - f % 2] = (loxo_index)icosphere_vertex(r, n, i, j + 1);
    }
}

/* Points of the unit sphere. */
static void icosphere_positions(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3])
{
    const int64_t n = g->n_u;
    double corner[4][3] = {{0.0}};
    int64_t have = -1;
    for (int64_t v = begin; v < end; ++v) {
        double *p = position[v - begin];
        if (v == 0 || v == 10 * n * n + 1) {
            for (int c = 0; c < 3; ++c)
                p[c] = v == 0 ? north[c] : -north[c];
            continue;
        }
        const int64_t r = (v - 1) / (n * n), i = (v - 1) % (n * n) / n + 1, j = (v - 1) % n;
        if (r != have) {
            for (int c = 0; c < 4; ++c)
                rhombus_corner(r, c, corner[c]);
            have = r;
        }
        const bool near_half = i + j <= n; /* the face at corner (0,0), else that at (n,n) */
        const double *o = corner[near_half ? 0 : 2];
        const double a = (double)(near_half ? i : n - j) / (double)n;
        const double b = (double)(near_half ? j : n - i) / (double)n;
        for (int c = 0; c < 3; ++c)
            p[c] = (1.0 - a - b) * o[c] + a * corner[1][c] + b * corner[3][c];
        const double scale = 1.0 / sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        for (int c = 0; c < 3; ++c)
            p[c] *= scale;
    }
}

static void ellipsoid_positions(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3])
{
    icosphere_positions(g, begin, end, position);
    for (int64_t i = 0; i < end - begin; ++i)
        for (int c = 0; c < 3; ++c)
            position[i][c] *= g->params[c];
}

static void bumpy_positions(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3])
{
    icosphere_positions(g, begin, end, position);
    for (int64_t i = 0; i < end - begin; ++i) {
        double *p = position[i];
        const double x = p[0], y = p[1], z = p[2];
        const double r = 1.0 + 0.12 * (sin(7 * x + 1) * sin(9 * y + 2) * sin(8 * z + 3) +
                                       0.35 * sin(23 * x) * sin(29 * y + 1) * sin(31 * z + 2) +
                                       0.1 * sin(83 * x) * sin(89 * y + 1) * sin(97 * z + 2));
        for (int c = 0; c < 3; ++c)
            p[c] *= r;
    }
}

/* Each vertex moves by a vector drawn from the ball of radius params[0] mean edge lengths. */
static void noisy_positions(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3])
{
    icosphere_positions(g, begin, end, position);
    for (int64_t v = begin; v < end; ++v) {
        const uint64_t draw = 3 * (uint64_t)v;
        const double z = 2.0 * loxo_random_unit(g->seed, draw) - 1.0;
        const double angle = 6.283185307179586 * loxo_random_unit(g->seed, draw + 1);
        const double length = g->scale * cbrt(loxo_random_unit(g->seed, draw + 2)), ring = sqrt(1.0 - z * z);
        position[v - begin][0] += length * ring * cos(angle);
        position[v - begin][1] += length * ring * sin(angle);
        position[v - begin][2] += length * z;
    }
}

/* A sum of plane waves of one wavelength in random directions has zero lines that wind like the furrows of a brain; the
 * radius falls by params[0] along them and along the plane x = 0. Star-shaped, so it cannot cut itself. */
static void brain_positions(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3])
{
    const double furrow_width = 0.4, fissure_width = 0.07;
    icosphere_positions(g, begin, end, position);
    for (int64_t i = 0; i < end - begin; ++i) {
        double *p = position[i], sum = 0.0;
        for (int w = 0; w < LOXO_N_WAVES; ++w)
            sum += cos(g->wave[w][0] * p[0] + g->wave[w][1] * p[1] + g->wave[w][2] * p[2] + g->wave[w][3]);
        const double furrow = sum / (sqrt(0.5 * LOXO_N_WAVES) * furrow_width), fissure = p[0] / fissure_width;
        const double high = (1.0 - exp(-furrow * furrow)) * (1.0 - exp(-fissure * fissure));
        const double r = 1.0 - g->params[0] * (1.0 - high);
        p[0] *= 0.8 * r;
        p[1] *= r;
        p[2] *= 0.75 * r;
    }
}

static void make_waves(loxo_generator *g)
{
    for (int w = 0; w < LOXO_N_WAVES; ++w) {
        const uint64_t draw = 3 * (uint64_t)w;
        const double z = 2.0 * loxo_random_unit(g->seed, draw) - 1.0, ring = sqrt(1.0 - z * z);
        const double angle = 6.283185307179586 * loxo_random_unit(g->seed, draw + 1);
        g->wave[w][0] = g->params[1] * ring * cos(angle);
        g->wave[w][1] = g->params[1] * ring * sin(angle);
        g->wave[w][2] = g->params[1] * z;
        g->wave[w][3] = 6.283185307179586 * loxo_random_unit(g->seed, draw + 2);
    }
}

void loxo_make_icosphere(loxo_generator *g)
{
    const int64_t wanted = g->n_vertices;
    int64_t n = (int64_t)sqrt((double)(wanted < 12 ? 10 : wanted - 2) / 10.0);
    if (n < 1) n = 1;
    if (10 * (n + 1) * (n + 1) + 2 - wanted < wanted - (10 * n * n + 2)) ++n;
    g->n_u = n;
    g->n_vertices = 10 * n * n + 2;
    g->n_faces = 20 * n * n;
    g->smallest = 12;
    g->faces = icosphere_faces;
    switch (g->shape) {
    case LOXO_SHAPE_ELLIPSOID: g->positions = ellipsoid_positions; break;
    case LOXO_SHAPE_BUMPY: g->positions = bumpy_positions; break;
    case LOXO_SHAPE_NOISY:
        g->positions = noisy_positions;
        /* Edge of an equilateral triangle of the mean area: sqrt(4 / sqrt(3) * 4 pi / n_faces). */
        g->scale = g->params[0] * sqrt(16.0 * 3.141592653589793 / (sqrt(3.0) * (double)g->n_faces));
        break;
    case LOXO_SHAPE_BRAIN:
        g->positions = brain_positions;
        make_waves(g);
        break;
    default: g->positions = icosphere_positions; break;
    }
}

/* Lat-long sphere: the north pole, n_v parallels of n_u vertices from north to south, the south pole. */
static void latlong_positions(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3])
{
    for (int64_t v = begin; v < end; ++v) {
        double *p = position[v - begin];
        if (v == 0 || v == g->n_vertices - 1) {
            p[0] = p[1] = 0.0;
            p[2] = v == 0 ? 1.0 : -1.0;
            continue;
        }
        const int64_t parallel = (v - 1) / g->n_u + 1, meridian = (v - 1) % g->n_u;
        const double polar = 3.141592653589793 * (double)parallel / (double)(g->n_v + 1);
        const double azimuth = 6.283185307179586 * (double)meridian / (double)g->n_u;
        p[0] = sin(polar) * cos(azimuth);
        p[1] = sin(polar) * sin(azimuth);
        p[2] = cos(polar);
    }
}

static void latlong_faces(const loxo_generator *g, int64_t begin, int64_t end, loxo_index (*triangle)[3])
{
    const int64_t m = g->n_u, last = g->n_vertices - 1;
    for (int64_t f = begin; f < end; ++f) {
        loxo_index *t = triangle[f - begin];
        if (f < m || f >= g->n_faces - m) { /* the fans at the poles */
            const bool is_north = f < m;
            const int64_t i = is_north ? f : f - (g->n_faces - m), j = (i + 1) % m;
            const int64_t row = is_north ? 1 : last - m;
            t[0] = (loxo_index)(is_north ? 0 : last);
            t[1] = (loxo_index)(row + (is_north ? i : j));
            t[2] = (loxo_index)(row + (is_north ? j : i));
            continue;
        }
        const int64_t cell = (f - m) / 2, i = cell % m, j = (i + 1) % m, row = 1 + cell / m * m;
        const bool is_first = (f - m) % 2 == 0;
        t[0] = (loxo_index)(is_first ? row + i : row + m + j);
        t[1] = (loxo_index)(is_first ? row + m + i : row + j);
        t[2] = (loxo_index)(is_first ? row + j : row + m + i);
    }
}

void loxo_make_latlong(loxo_generator *g)
{
    const double inner = (double)(g->n_vertices < 5 ? 3 : g->n_vertices - 2);
    g->n_u = llround(sqrt(2.0 * inner)); /* the equator is twice as long as a meridian */
    if (g->n_u < 3) g->n_u = 3;
    g->n_v = llround(inner / (double)g->n_u);
    if (g->n_v < 1) g->n_v = 1;
    g->n_vertices = 2 + g->n_u * g->n_v;
    g->n_faces = 2 * g->n_u * g->n_v;
    g->smallest = 5;
    g->positions = latlong_positions;
    g->faces = latlong_faces;
}
