/* SPDX-License-Identifier: MIT
 * Lattices of quads, cut in two: square, strip, cylinder, torus; and concentric rings: disk and annulus. */
#include "mesh/generate_internal.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.141592653589793

/* ---- lattices: vertex (u, v) is v n_u + u; the cylinder closes in u, the torus in both ------------------------- */

static void grid_positions(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3])
{
    for (int64_t i = begin; i < end; ++i) {
        const int64_t u = i % g->n_u, v = i / g->n_u;
        position[i - begin][0] = (double)u / (double)(g->n_u - 1);
        position[i - begin][1] = (double)v / (double)(g->n_v - 1);
        position[i - begin][2] = 0.0;
    }
}

/* Runs along x in v, two vertices a column. */
static void strip_positions(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3])
{
    (void)g;
    for (int64_t i = begin; i < end; ++i) {
        const int64_t column = i / 2;
        position[i - begin][0] = (double)column;
        position[i - begin][1] = i % 2 == 0 ? 1.0 : 0.0;
        position[i - begin][2] = 0.0;
    }
}

static void cylinder_positions(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3])
{
    for (int64_t i = begin; i < end; ++i) {
        const int64_t u = i % g->n_u, v = i / g->n_u;
        const double angle = 2.0 * PI * (double)u / (double)g->n_u;
        position[i - begin][0] = g->params[0] * cos(angle);
        position[i - begin][1] = g->params[0] * sin(angle);
        position[i - begin][2] = g->params[1] * (double)v / (double)(g->n_v - 1);
    }
}

/* u goes round the tube, v along the ring. */
static void torus_positions(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3])
{
    for (int64_t i = begin; i < end; ++i) {
        const int64_t u = i % g->n_u, v = i / g->n_u;
        const double tube = -2.0 * PI * (double)u / (double)g->n_u;
        const double ring = 2.0 * PI * (double)v / (double)g->n_v;
        const double r = g->params[0] + g->params[1] * cos(tube);
        position[i - begin][0] = r * cos(ring);
        position[i - begin][1] = r * sin(ring);
        position[i - begin][2] = g->params[1] * sin(tube);
    }
}

static void lattice_faces(const loxo_generator *g, int64_t begin, int64_t end, loxo_index (*triangle)[3])
{
    const bool is_closed_u = g->shape == LOXO_SHAPE_CYLINDER || g->shape == LOXO_SHAPE_TORUS;
    const int64_t cells_u = is_closed_u ? g->n_u : g->n_u - 1;
    for (int64_t f = begin; f < end; ++f) {
        const int64_t u = f / 2 % cells_u, v = f / 2 / cells_u;
        const int64_t next_u = u + 1 < g->n_u ? u + 1 : 0, next_v = v + 1 < g->n_v ? v + 1 : 0;
        const bool is_first = f % 2 == 0;
        loxo_index *t = triangle[f - begin];
        t[0] = (loxo_index)(is_first ? v * g->n_u + u : next_v * g->n_u + next_u);
        t[1] = (loxo_index)(is_first ? v * g->n_u + next_u : next_v * g->n_u + u);
        t[2] = (loxo_index)(is_first ? next_v * g->n_u + u : v * g->n_u + next_u);
    }
}

/* Sizes of a lattice of about n vertices whose cells are as long in u as in v when its sides are. */
static void lattice_sizes(loxo_generator *g, double length_u, double length_v, int64_t least_u, int64_t least_v)
{
    const double n = (double)g->n_vertices;
    const double u = fmin(sqrt(n * length_u / length_v), n / (double)least_v);
    g->n_u = llround(fmax(u, (double)least_u));
    g->n_v = llround(n / (double)g->n_u);
    if (g->n_v < least_v) g->n_v = least_v;
    g->smallest = least_u * least_v;
}

void loxo_make_lattice(loxo_generator *g)
{
    int64_t cells_u, cells_v;
    g->faces = lattice_faces;
    switch (g->shape) {
    case LOXO_SHAPE_STRIP:
        g->positions = strip_positions;
        g->n_u = 2;
        g->n_v = g->n_vertices / 2 < 2 ? 2 : g->n_vertices / 2;
        g->smallest = 4;
        break;
    case LOXO_SHAPE_CYLINDER:
        g->positions = cylinder_positions;
        lattice_sizes(g, 2.0 * PI * g->params[0], g->params[1], 3, 2);
        break;
    case LOXO_SHAPE_TORUS:
        g->positions = torus_positions;
        lattice_sizes(g, g->params[1], g->params[0], 3, 3);
        break;
    default:
        g->positions = grid_positions;
        lattice_sizes(g, 1.0, 1.0, 2, 2);
        break;
    }
    cells_u = g->shape == LOXO_SHAPE_CYLINDER || g->shape == LOXO_SHAPE_TORUS ? g->n_u : g->n_u - 1;
    cells_v = g->shape == LOXO_SHAPE_TORUS ? g->n_v : g->n_v - 1;
    g->n_vertices = g->n_u * g->n_v;
    g->n_faces = 2 * cells_u * cells_v;
}

/* ---- rings: ring k has 6 k vertices, so ring k and those inside it have 1 + 3 k (k + 1), and the triangles inside
 * ring k are 6 k^2; n_u is the first ring (0: the centre), n_v the last ------------------------------------------ */

static int64_t before_ring(const loxo_generator *g, int64_t k)
{
    if (g->n_u == 0) return k == 0 ? 0 : 1 + 3 * k * (k - 1);
    return 3 * (k * (k - 1) - g->n_u * (g->n_u - 1));
}

static void ring_positions(const loxo_generator *g, int64_t begin, int64_t end, double (*position)[3])
{
    const double inner = g->n_u == 0 ? 0.0 : g->params[0], outer = g->n_u == 0 ? 1.0 : g->params[1];
    int64_t k = g->n_u;
    if (begin > 0) { /* ring of the first vertex: 3 k (k - 1) = its number among all rings, solved and then mended */
        const double m = (double)(begin + (g->n_u == 0 ? -1 : 3 * g->n_u * (g->n_u - 1)));
        k = (int64_t)(0.5 + sqrt(0.25 + m / 3.0));
        while (k > g->n_u && before_ring(g, k) > begin)
            --k;
    }
    for (int64_t v = begin; v < end; ++v) {
        while (before_ring(g, k + 1) <= v)
            ++k;
        const double r = inner + (outer - inner) * (double)(k - g->n_u) / (double)(g->n_v - g->n_u);
        const double angle = k == 0 ? 0.0 : PI * (double)(v - before_ring(g, k)) / (double)(3 * k);
        position[v - begin][0] = r * cos(angle);
        position[v - begin][1] = r * sin(angle);
        position[v - begin][2] = 0.0;
    }
}

/* Between ring k - 1 and k, each of six sectors holds k triangles that stand on the outer ring and k - 1 that hang from
 * the inner, in turn. */
static void ring_faces(const loxo_generator *g, int64_t begin, int64_t end, loxo_index (*triangle)[3])
{
    const int64_t hole = 6 * g->n_u * g->n_u;
    int64_t k = (int64_t)sqrt((double)(begin + hole) / 6.0);
    while (k > g->n_u && 6 * k * k > begin + hole)
        --k;
    for (int64_t f = begin; f < end; ++f) {
        while (6 * k * k <= f + hole)
            ++k;
        const int64_t in_ring = f + hole - 6 * (k - 1) * (k - 1);
        const int64_t sector = in_ring / (2 * k - 1), place = in_ring % (2 * k - 1), a = place / 2;
        const int64_t outer = before_ring(g, k), inner = before_ring(g, k - 1);
        /* k is 1 or more here. NOLINTNEXTLINE(clang-analyzer-core.DivideZero) */
        const int64_t outer_next = outer + (sector * k + a + 1) % (6 * k);
        const int64_t inner_here = k == 1 ? inner : inner + (sector * (k - 1) + a) % (6 * (k - 1));
        loxo_index *t = triangle[f - begin];
        t[0] = (loxo_index)inner_here;
        if (place % 2 == 0) {
            t[1] = (loxo_index)(outer + sector * k + a);
            t[2] = (loxo_index)outer_next;
        } else {
            t[1] = (loxo_index)outer_next;
            t[2] = (loxo_index)(inner + (sector * (k - 1) + a + 1) % (6 * (k - 1)));
        }
    }
}

/* First ring of an annulus whose last is m. */
static int64_t first_ring(const loxo_generator *g, int64_t m)
{
    const int64_t k = llround((double)m * g->params[0] / g->params[1]);
    return k < 1 ? 1 : k < m ? k : m - 1;
}

static int64_t annulus_size(const loxo_generator *g, int64_t m)
{
    const int64_t k = first_ring(g, m);
    return 3 * (m * (m + 1) - k * (k - 1));
}

void loxo_make_rings(loxo_generator *g)
{
    const int64_t wanted = g->n_vertices;
    int64_t m;
    if (g->shape == LOXO_SHAPE_DISK) {
        m = (int64_t)sqrt((double)wanted / 3.0); /* at most one too many: 1 + 3 m (m + 1) > 3 m^2 */
        while (m > 1 && 1 + 3 * m * (m + 1) > wanted)
            --m;
        if (m < 1) m = 1;
        if (1 + 3 * (m + 1) * (m + 2) - wanted < wanted - (1 + 3 * m * (m + 1))) ++m;
        g->n_u = 0;
        g->n_vertices = 1 + 3 * m * (m + 1);
        g->smallest = 7;
    } else {
        int64_t low = 2, high = wanted / 6 + 3; /* size over last ring rises, but for steps of the first ring */
        while (low < high) {
            const int64_t middle = low + (high - low) / 2;
            if (annulus_size(g, middle) < wanted)
                low = middle + 1;
            else
                high = middle;
        }
        m = low < 2 ? 2 : low;
        for (int64_t other = m > 4 ? m - 2 : 2; other <= low + 2; ++other)
            if (llabs(annulus_size(g, other) - wanted) < llabs(annulus_size(g, m) - wanted)) m = other;
        g->n_u = first_ring(g, m);
        g->n_vertices = annulus_size(g, m);
        g->smallest = 18;
    }
    g->n_v = m;
    g->n_faces = 6 * (m * m - g->n_u * g->n_u);
    g->positions = ring_positions;
    g->faces = ring_faces;
}
