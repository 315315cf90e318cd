/* SPDX-License-Identifier: MIT
 * Space-filling curves: a key for each vertex, then a stable radix sort.
 *
 * The cube around the used vertices is cut into 2^18 cells an axis: 18 times finer than the edges of an even surface of
 * 200 million vertices, and with the mark of unused vertices just five passes of the sort. Vertices of one cell keep
 * the order they had. */
#include "base/allocate.h"
#include "base/context.h"
#include "mesh/reorder_internal.h"
#include "par/range.h"

#include <math.h>

#define AXIS_BITS 18
#define KEY_BITS  (3 * AXIS_BITS)

static inline void load_point(const loxo_mesh_arrays *arrays, int64_t v, double p[3])
{
    for (int64_t c = 0; c < 3; ++c)
        p[c] = arrays->position != NULL ? arrays->position[3 * v + c] : (double)arrays->position_float[3 * v + c];
}

/* ---- the box --------------------------------------------------------------------------------------------------- */

typedef struct cube {
    double half_low[3]; /* halves, so that no difference overflows */
    double scale;       /* from halves to cells */
} cube;

static cube cube_around(loxo_context *ctx, const loxo_mesh_arrays *arrays, const unsigned char *is_used)
{
    const int n_threads = loxo_threads_for(ctx, arrays->n_vertices, 3.0);
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, width = 0.0;
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(arrays->n_vertices);
        double l[3] = {INFINITY, INFINITY, INFINITY}, h[3] = {-INFINITY, -INFINITY, -INFINITY};
        for (int64_t v = r.begin; v < r.end; ++v) {
            double p[3];
            if (!is_used[v]) continue;
            load_point(arrays, v, p);
            for (int c = 0; c < 3; ++c) {
                if (!isfinite(p[c])) continue;
                l[c] = p[c] < l[c] ? p[c] : l[c];
                h[c] = p[c] > h[c] ? p[c] : h[c];
            }
        }
#pragma omp critical(loxo_cube)
        for (int c = 0; c < 3; ++c) {
            low[c] = fmin(low[c], l[c]);
            high[c] = fmax(high[c], h[c]);
        }
    }
    for (int c = 0; c < 3; ++c)
        width = fmax(width, 0.5 * high[c] - 0.5 * low[c]); /* -inf where nothing is finite */
    return (cube){.half_low = {0.5 * low[0], 0.5 * low[1], 0.5 * low[2]},
                  .scale = width > 0.0 ? (double)((1 << AXIS_BITS) - 1) / width : 0.0};
}

static inline void cell_of(const cube *box, const double p[3], uint32_t cell[3])
{
    const double last = (double)((1 << AXIS_BITS) - 1);
    for (int c = 0; c < 3; ++c) {
        const double x = (0.5 * p[c] - box->half_low[c]) * box->scale;
        cell[c] = x > 0.0 ? x < last ? (uint32_t)x : (uint32_t)last : 0; /* NaN: 0 */
    }
}

/* ---- keys ------------------------------------------------------------------------------------------------------ */

/* Bit i to bit 3 i. */
static inline uint64_t spread(uint64_t x)
{
    x &= 0x1fffff;
    x = (x | x << 32) & 0x1f00000000ffffu;
    x = (x | x << 16) & 0x1f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    x = (x | x << 2) & 0x1249249249249249u;
    return x;
}

static inline uint64_t morton_key(const uint32_t cell[3])
{
    return spread(cell[2]) << 2 | spread(cell[1]) << 1 | spread(cell[0]);
}

/* Hilbert's curve as an automaton that reads the Morton key from the top, two octal digits at a time. A state is the
 * corner where the curve enters the cube (entry, 3 bits) and the axis along which it leaves (direction); of a state and
 * two digits, step holds the two digits of the Hilbert key and the next state.
 * source  Hamilton 2006, Compact Hilbert Indices, section 2 */
#define N_STATES 24

typedef struct hilbert_table {
    uint16_t step[N_STATES][64]; /* next state << 6 | two digits */
} hilbert_table;

static inline unsigned rotate_right(unsigned x, unsigned n) { return (x >> n | x << (3 - n)) & 7; }
static inline unsigned rotate_left(unsigned x, unsigned n) { return (x << n | x >> (3 - n)) & 7; }
static inline unsigned gray(unsigned i) { return i ^ i >> 1; }

/* One digit. e(i), d(i): entry and direction of the i-th of eight sub-cubes, for a cube entered at 0 along axis 0. */
static unsigned hilbert_digit(unsigned state, unsigned digit, unsigned *next)
{
    static const unsigned direction_of[8] = {0, 1, 1, 2, 2, 1, 1, 0}; /* trailing ones, modulo 3 */
    const unsigned entry = state / 3, direction = state % 3;
    const unsigned turned = rotate_right(digit ^ entry, (direction + 1) % 3);
    const unsigned i = turned ^ turned >> 1 ^ turned >> 2; /* gray(i) == turned */
    const unsigned sub_entry = i == 0 ? 0 : gray((i - 1) & ~1u);
    *next = (entry ^ rotate_left(sub_entry, (direction + 1) % 3)) * 3 + (direction + direction_of[i] + 1) % 3;
    return i;
}

static void hilbert_table_fill(hilbert_table *table)
{
    for (unsigned state = 0; state < N_STATES; ++state) {
        for (unsigned digits = 0; digits < 64; ++digits) {
            unsigned middle, last;
            const unsigned high = hilbert_digit(state, digits >> 3, &middle);
            const unsigned low = hilbert_digit(middle, digits & 7, &last);
            table->step[state][digits] = (uint16_t)(last << 6 | high << 3 | low);
        }
    }
}

static inline uint64_t hilbert_key(const hilbert_table *table, uint64_t morton)
{
    uint64_t key = 0;
    unsigned state = 0;
    for (int shift = KEY_BITS - 6; shift >= 0; shift -= 6) {
        const unsigned step = table->step[state][morton >> shift & 63];
        key = key << 6 | (step & 63);
        state = step >> 6;
    }
    return key;
}

loxo_status loxo_order_curve(loxo_context *ctx, const loxo_mesh_arrays *arrays, const unsigned char *is_used,
                             bool is_hilbert, loxo_index *new_to_old)
{
    const int64_t n = arrays->n_vertices;
    const int n_threads = loxo_threads_for(ctx, n, 30.0);
    const cube box = cube_around(ctx, arrays, is_used);
    uint64_t *key = loxo_allocate(ctx, n, sizeof *key);
    uint32_t *vertex = loxo_allocate(ctx, n, sizeof *vertex);
    loxo_status status = LOXO_ERR_MEMORY;
    hilbert_table table;
    if (key == NULL || vertex == NULL) goto done;
    hilbert_table_fill(&table);
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v) {
            double p[3];
            uint32_t cell[3];
            vertex[v] = (uint32_t)v;
            key[v] = (uint64_t)1 << KEY_BITS;
            if (!is_used[v]) continue;
            load_point(arrays, v, p);
            cell_of(&box, p, cell);
            key[v] = morton_key(cell);
            if (is_hilbert) key[v] = hilbert_key(&table, key[v]);
        }
    }
    if ((status = loxo_sort_u64(ctx, n, key, vertex, KEY_BITS + 1)) < 0) goto done;
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v)
            new_to_old[v] = (loxo_index)vertex[v];
    }
done:
    loxo_release(ctx, vertex);
    loxo_release(ctx, key);
    return status;
}
