/* SPDX-License-Identifier: MIT
 * Rows of the heat system, made level by level as the front takes them in. The scale of a vertex is known only when it
 * is taken in, so entries towards the same level and towards the next get theirs one and two acts later. */
#include "par/range.h"
#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

#define SHARE_OF_GAIN       0.5 /* how far omega goes from 1 towards the local limit, see relaxation() */
#define MAX_GAIN            4.0
#define SETTLING_GAIN       1.6 /* for relaxing in place: more is slow on slivers */
#define MOST_OCTAVES        100
#define SAFETY_OF_SPLITTING 0.95

/* What a vertex hears of its inner neighbours. */
typedef struct inner_sum {
    double sum;  /* of weight * value, in units of 2^scale */
    double gain; /* mean of value / first estimate */
    int32_t scale;
} inner_sum;

/* Relaxation factor. Inside the front an error that is smooth outward is damped only by the coupling to the inner
 * level; over-relaxing by omega < gain, gain = 1 / (share of the value that the inner level gives), drives it outward
 * faster and stays stable; omega above gain would let it grow from level to level. Young's optimum for the row's own
 * diagonal dominance is the other bound. Measured against plain Gauss-Seidel: 9.6 instead of 15 updates a vertex on an
 * icosphere, 22 instead of 44 on an uneven scan.
 * crossing is the sum of |entries| towards other blocks of the level, over the diagonal: those are Jacobi couplings C.
 * The splitting M of such a sweep converges when M + M^T - A = D (2 / omega - 1) - C is positive definite, which
 * omega < 2 / (1 + crossing) makes it by diagonal dominance, whatever the signs of the weights. */
static double relaxation(double gain, double area, double diagonal, double crossing)
{
    const double dominance = 1.0 - area / diagonal, jacobi = dominance < 0.0      ? 0.0
                                                             : dominance > 0.9999 ? 0.9999
                                                                                  : dominance;
    const double optimum = 2.0 / (1.0 + sqrt(1.0 - jacobi * jacobi)), stable = 1.0 + SHARE_OF_GAIN * (gain - 1.0);
    const double split = crossing > 0.0 ? SAFETY_OF_SPLITTING * 2.0 / (1.0 + crossing) : 2.0;
    const double omega = stable < optimum ? stable : optimum;
    return omega < split ? omega : split;
}

/* Where ways meet that decay differently, first values can be hundreds of octaves apart, more than a float coefficient
 * holds. The larger one then overtakes the other by MOST_OCTAVES only; what lies behind gets its heat through here, all of
 * it smaller by the same power of two, and directions do not see that. */
static float scaled(float coefficient, int64_t octaves)
{
    return (float)((double)coefficient * k_power_of_two(octaves < MOST_OCTAVES ? octaves : MOST_OCTAVES));
}

/* Order in which k_relax_block updates the places of a block that begins at `begin`. */
static bool is_relaxed_before(int64_t begin, int64_t a, int64_t b)
{
    const int64_t odd_a = (a - begin) & 1, odd_b = (b - begin) & 1;
    return odd_a != odd_b ? odd_a < odd_b : a < b;
}

/* entry[k].slot holds places and kinds here, coefficient the weight; a negative weight tells nothing of the size of the
 * value and is left out. Sums are kept in units of the scale of the last neighbour that was larger. */
static inner_sum hear_inner(const parallel_heat *g, const k_entry *entry, uint32_t n, int64_t level_begin,
                            unsigned parity)
{
    inner_sum s = {.scale = INT32_MIN};
    double weight_sum = 0.0;
    for (uint32_t k = 0; k < n; ++k) {
        const int64_t q = entry[k].slot >> 1;
        if (q >= level_begin || !(entry[k].coefficient > 0.0f)) continue;
        const double weight = (double)entry[k].coefficient, value = g->value[(2 * q) ^ (int64_t)parity];
        const int32_t scale = g->scale[q];
        if (scale > s.scale) {
            s.sum *= k_power_of_two((int64_t)s.scale - scale);
            s.scale = scale;
        }
        s.sum += weight * value * k_power_of_two((int64_t)scale - s.scale);
        s.gain += weight * (value / (double)g->first[q]);
        weight_sum += weight;
    }
    s.gain = weight_sum > 0.0 ? s.gain / weight_sum : 1.0;
    if (!(s.gain >= 1.0)) s.gain = 1.0;
    if (s.gain > MAX_GAIN) s.gain = MAX_GAIN;
    return s;
}

/* First value of a vertex whose weights towards the inside are all negative or zero: that of an inner neighbour, one
 * edge further out. */
static inner_sum borrow_from_parent(const parallel_heat *g, int64_t place, unsigned parity)
{
    const int64_t q = g->parent[place];
    const double value = fabs(g->value[(2 * q) ^ (int64_t)parity]);
    return (inner_sum){.sum = value > 0.0 ? 0.25 * value : 0.25, .gain = 1.0, .scale = g->scale[q]};
}

/* What a row is made of: its weights in entries, with vertices for slots; lengths in units of the mean edge length,
 * so that t is the time factor. */
typedef struct row_terms {
    double area, time, diagonal;
} row_terms;

/* From the weights in the entries and the area. */
static row_terms make_terms(const parallel_heat *g, uint32_t n, double area, k_entry *entry)
{
    const double unit = 1.0 / (g->mean_edge_length * g->mean_edge_length);
    row_terms t = {.area = (double)(float)(unit * area), .time = g->settings.time_factor};
    double weight_sum = 0.0;
    for (uint32_t k = 0; k < n; ++k)
        weight_sum += (double)entry[k].coefficient;
    t.diagonal = t.area + t.time * weight_sum;
    if (t.diagonal > 0.0 && isfinite(t.diagonal)) return t;
    for (uint32_t k = 0; k < n; ++k) /* all faces without area: the mean of the neighbours */
        entry[k].coefficient = 1.0f;
    return (row_terms){.area = 0.0, .time = 1.0, .diagonal = (double)n};
}

/* entries hold vertices and weights. */
static void build_row(parallel_heat *g, int64_t level, int64_t place, int64_t block, bool is_plain, double ring_area,
                      k_row *row)
{
    const int64_t level_begin = g->level_begin[level], level_end = g->level_begin[level + 1];
    const int64_t block_end = block + BLOCK_ROWS < level_end ? block + BLOCK_ROWS : level_end;
    const unsigned parity = (unsigned)(level + 1) & 1u; /* of the step before the one that takes this level in */
    k_entry *entry = &g->entry[row->begin];
    const uint32_t n = row[1].begin - row[0].begin;
    const row_terms t = make_terms(g, n, ring_area, entry);
    const double area = t.area, time = t.time, diagonal = t.diagonal;
    double crossing = 0.0;
    for (uint32_t k = 0; k < n; ++k) {
        const int64_t q = g->rank[entry[k].slot];
        uint32_t kind = q < level_begin ? 0 : 1;
        if (!is_plain && q >= block && q < block_end)
            kind = is_relaxed_before(block, q, place) ? 0 : 1;
        else if (q >= level_begin && q < level_end)
            crossing += fabs((double)entry[k].coefficient);
        entry[k].slot = (uint32_t)(2 * q) | kind;
    }

    inner_sum inner = {.sum = 1.0, .gain = 1.0}; /* a source hears its own heat */
    if (g->start_heat != NULL && level == 0) inner.sum = g->start_heat[place];
    if (level > 0) {
        inner = hear_inner(g, entry, n, level_begin, parity);
        inner.sum *= time;
        if (!(inner.sum > 0.0) || !isfinite(inner.sum)) {
            inner = borrow_from_parent(g, place, parity);
            inner.sum *= diagonal;
        }
    }
    const double first = inner.sum / diagonal;
    int32_t shift = k_exponent(first);
    if (is_plain && shift < -OCTAVES_APART) shift = -OCTAVES_APART; /* see heat_sweep */
    const double omega =
        is_plain || level == 0 ? 1.0 : relaxation(inner.gain, area, diagonal, crossing * time / diagonal);
    const double mantissa = first * k_power_of_two(-(int64_t)shift); /* in [1, 2), or less */
    const double value = is_plain ? mantissa : mantissa * inner.gain;
    g->scale[place] = inner.scale + shift;
    g->first[place] = (float)mantissa; /* of a source, what its heat adds at every update */
    g->value[2 * place] = value;
    g->value[2 * place + 1] = value;
    row->weight = (float)(area / (value * value) / g->area);
    const double factor = omega * time / diagonal;
    double sum = omega * area / diagonal;
    for (uint32_t k = 0; k < n; ++k) {
        const int64_t q = entry[k].slot >> 1;
        const float c = (float)(factor * (double)entry[k].coefficient);
        sum += (double)c;
        entry[k].coefficient = q < level_begin ? scaled(c, (int64_t)g->scale[q] - g->scale[place]) : c;
    }
    row->keep = is_plain ? 0.0 : 1.0 - sum;
}

static void find_reach(parallel_heat *g, int64_t level, int64_t begin, int64_t end)
{
    const int64_t level_begin = g->level_begin[level], level_end = g->level_begin[level + 1];
    const int64_t base[3] = {level > 0 ? g->level_begin[level - 1] : 0, level_begin, level_end};
    int64_t inner_first = INT64_MAX, inner_last = -1, own_first = begin, own_last = end - 1, outer_first = INT64_MAX,
            outer_last = -1;
    const k_row *row = heat_row(g, level, begin);
    for (uint32_t k = row[0].begin; k < row[end - begin].begin; ++k) {
        const int64_t q = g->entry[k].slot >> 1;
        if (q < level_begin) {
            inner_first = q < inner_first ? q : inner_first;
            inner_last = q > inner_last ? q : inner_last;
        } else if (q >= level_end) {
            outer_first = q < outer_first ? q : outer_first;
            outer_last = q > outer_last ? q : outer_last;
        } else {
            own_first = q < own_first ? q : own_first;
            own_last = q > own_last ? q : own_last;
        }
    }
    const int64_t first[3] = {inner_first, own_first, outer_first}, last[3] = {inner_last, own_last, outer_last};
    block_reach *reach = &g->reach[heat_block(g, level, (begin - level_begin) / BLOCK_ROWS)];
    for (int side = 0; side < 3; ++side) {
        const bool is_none = last[side] < 0;
        reach->first[side] = is_none ? 0 : (int32_t)((first[side] - base[side]) / BLOCK_ROWS);
        reach->last[side] = is_none ? -1 : (int32_t)((last[side] - base[side]) / BLOCK_ROWS);
    }
}

/* Weights and vertices of a ring, into the entries of its row. */
static void write_ring(const k_rings *r, const k_spokes *s, int i, k_entry *entry)
{
    const int n = r->n_spokes[i];
    for (int k = 0; k < n; ++k) {
        entry[k].slot = (uint32_t)r->to[k][i];
        entry[k].coefficient = (float)s->weight[k][i];
    }
    if (!r->is_open[i]) entry[0].coefficient = (float)(s->weight[n][i] + s->weight[0][i]);
}

/* The spokes of rings that are all written down; how many corners the largest has. */
static int lay_spokes(const loxo_mesh_view *m, const k_rings *r, k_spokes *s)
{
    int most = 0;
    for (int i = 0; i < r->n; ++i) {
        const int n = r->n_spokes[i] + (r->is_open[i] ? 0 : 1);
        if (r->n_spokes[i] > 0 && r->n_spokes[i] <= K_RING && n > most) most = n;
    }
    for (int i = 0; i < K_BESIDE; ++i) {
        const int n = i < r->n && r->n_spokes[i] <= K_RING ? r->n_spokes[i] : 0;
        const loxo_vec3 own = n > 0 ? k_position(m, r->vertex[i]) : (loxo_vec3){0.0, 0.0, 0.0};
        for (int k = 0; k < n; ++k) {
            const loxo_vec3 e = v3_sub(k_position(m, r->to[k][i]), own);
            s->x[k][i] = e.x;
            s->y[k][i] = e.y;
            s->z[k][i] = e.z;
        }
        const bool is_closed = n > 0 && !r->is_open[i];
        for (int k = n; k < most; ++k) {
            s->x[k][i] = is_closed && k == n ? s->x[0][i] : 0.0;
            s->y[k][i] = is_closed && k == n ? s->y[0][i] : 0.0;
            s->z[k][i] = is_closed && k == n ? s->z[0][i] : 0.0;
        }
    }
    return most - 1;
}

/* Makes vertices and weights of the rows of places p, p + 1, ..., up to end, and tells their areas. */
static void make_rings(const parallel_heat *g, int64_t p, int64_t end, const k_row *row, double *area)
{
    k_rings r;
    k_spokes s;
    for (r.n = 0; r.n < K_BESIDE && p + r.n < end; ++r.n)
        r.vertex[r.n] = g->order[p + r.n];
    k_rings_walk(&g->m, &r, g->rank, sizeof *g->rank);
    if (g->m.halfedge_length == NULL) {
        for (int i = 0; i < r.n; ++i)
            for (int k = 0; k < r.n_spokes[i] && k < K_RING; ++k)
                k_prefetch_position(&g->m, r.to[k][i]);
        g->kernels->ring_weights(lay_spokes(&g->m, &r, &s), &s);
    }
    for (int i = 0; i < r.n; ++i) {
        k_entry *entry = &g->entry[row[i].begin];
        if (r.n_spokes[i] == 0) {
            area[i] = 0.0;
        } else if (g->m.halfedge_length == NULL && r.n_spokes[i] <= K_RING) {
            write_ring(&r, &s, i, entry);
            area[i] = s.twice_area[i] / 6.0;
        } else {
            area[i] = k_cotangent_row(&g->m, r.vertex[i], entry);
        }
    }
}

/* begin..end-1 are whole blocks of the level. */
void heat_build_rows(parallel_heat *g, int64_t level, int64_t begin, int64_t end, bool is_plain)
{
    for (int64_t block = begin; block < end; block += BLOCK_ROWS) {
        const int64_t block_end = block + BLOCK_ROWS < end ? block + BLOCK_ROWS : end;
        k_row *row = heat_row(g, level, block);
        double area[K_BESIDE] = {0.0};
        for (int64_t p = block; p < block_end; ++p, ++row) {
            const int64_t i = (p - block) % K_BESIDE;
            if (i == 0) make_rings(g, p, block_end, row, area);
            build_row(g, level, p, block, is_plain, area[i], row);
        }
        if (!is_plain) find_reach(g, level, block, block_end);
    }
}

/* Multiplies in the scales of the neighbours whose places are in from..to-1. */
static void link(parallel_heat *g, int64_t level, int64_t begin, int64_t end, int64_t from, int64_t to)
{
    const k_row *row = heat_row(g, level, begin);
    for (int64_t p = begin; p < end; ++p, ++row)
        for (uint32_t k = row[0].begin; k < row[1].begin; ++k) {
            const int64_t q = g->entry[k].slot >> 1;
            if (q < from || q >= to) continue;
            g->entry[k].coefficient = scaled(g->entry[k].coefficient, (int64_t)g->scale[q] - g->scale[p]);
        }
}

void heat_link_level(parallel_heat *g, int64_t level, int64_t begin, int64_t end)
{
    link(g, level, begin, end, g->level_begin[level], g->level_begin[level + 1]);
}

void heat_link_outward(parallel_heat *g, int64_t level, int64_t begin, int64_t end)
{
    link(g, level, begin, end, g->level_begin[level + 1], g->n_reached);
}

/* For relaxing in place nothing limits omega but the row's own optimum: the matrix is positive definite. */
static void make_whole_row(const parallel_heat *g, int64_t place, k_row *row, k_entry *entry)
{
    const uint32_t n = row[1].begin - row[0].begin;
    const row_terms t = make_terms(g, n, n > 0 ? k_cotangent_row(&g->m, g->order[place], entry) : 0.0, entry);
    const double omega = place < g->level_begin[1] ? 1.0 : relaxation(SETTLING_GAIN, t.area, t.diagonal, 0.0);
    const double value = g->value[2 * place];
    double sum = omega * t.area / t.diagonal;
    for (uint32_t k = 0; k < n; ++k) {
        const int64_t q = g->rank[entry[k].slot];
        const float c = (float)(omega * t.time / t.diagonal * (double)entry[k].coefficient);
        sum += (double)c;
        entry[k].slot = (uint32_t)(2 * q);
        entry[k].coefficient = scaled(c, (int64_t)g->scale[q] - g->scale[place]);
    }
    row->keep = 1.0 - sum;
    row->weight = value != 0.0 ? (float)(t.area / (value * value) / g->area) : 0.0f;
}

void heat_make_all_rows(const parallel_heat *g, k_row *row, k_entry *entry)
{
    uint32_t n_entries = 0;
    for (int64_t p = 0; p < g->n_reached; ++p) {
        row[p].begin = n_entries;
        n_entries += k_degree(&g->m, g->order[p]);
    }
    row[g->n_reached].begin = n_entries;
#pragma omp parallel num_threads(loxo_threads_for(g->ctx, g->n_reached, 100.0))
    {
        const loxo_range r = loxo_thread_range(g->n_reached);
        for (int64_t p = r.begin; p < r.end; ++p)
            make_whole_row(g, p, &row[p], &entry[row[p].begin]);
    }
}
