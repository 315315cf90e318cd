/* SPDX-License-Identifier: MIT
 * How local the numbering is that a mesh came with. */
#include "base/allocate.h"
#include "base/context.h"
#include "base/rng.h"
#include "mesh/reorder_internal.h"
#include "par/range.h"

/* A run of consecutive faces touches as many vertices as a second-level cache holds with their data. */
#define RUN_FACES 8192
#define N_RUNS    16
/* Vertices of one cache line, as doubles. */
#define LINE_SHIFT 3
#define TABLE_BITS 16
#define TABLE_SIZE (1 << TABLE_BITS) /* over twice 3 RUN_FACES lines */

/* Set of lines by open addressing; 0 is empty, so lines are kept plus one. */
typedef struct line_set {
    uint32_t *table;
} line_set;

static inline uint32_t *slot_of(const line_set *set, uint32_t line)
{
    uint32_t at = (line * 0x9e3779b1u) >> (32 - TABLE_BITS);
    while (set->table[at] != 0 && set->table[at] != line + 1)
        at = (at + 1) & (TABLE_SIZE - 1);
    return &set->table[at];
}

/* Lines that the run is first to touch and whose neighbours it has not touched either: a prefetcher that follows
 * streams does not have them. */
static int64_t count_jumps(const loxo_index *triangle, int64_t n_faces, const line_set *set)
{
    int64_t n_jumps = 0;
    for (int64_t i = 0; i < TABLE_SIZE; ++i)
        set->table[i] = 0;
    for (int64_t h = 0; h < 3 * n_faces; ++h) {
        const uint32_t line = ((uint32_t)triangle[h] >> LINE_SHIFT) + 1; /* from 1: there is a line before it */
        uint32_t *slot = slot_of(set, line);
        if (*slot != 0) continue;
        n_jumps += *slot_of(set, line - 1) == 0 && *slot_of(set, line + 1) == 0;
        *slot = line + 1;
    }
    return n_jumps;
}

loxo_status loxo_count_jumps(loxo_context *ctx, const loxo_mesh_arrays *arrays, double *jumps_a_vertex)
{
    const int64_t n = arrays->n_faces,
                  n_runs = n < (int64_t)N_RUNS * RUN_FACES ? (n + RUN_FACES - 1) / RUN_FACES : N_RUNS;
    const line_set set = {loxo_allocate(ctx, TABLE_SIZE, sizeof *set.table)};
    int64_t n_jumps = 0, n_seen = 0;
    if (set.table == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n_runs; ++i) {
        /* Anywhere in its share of the faces: meshes have seams at even distances. */
        const loxo_range share = loxo_range_of(n, i, n_runs);
        const int64_t count = share.end - share.begin < RUN_FACES ? share.end - share.begin : RUN_FACES;
        const int64_t slack = share.end - share.begin - count;
        const int64_t begin = share.begin + (int64_t)(loxo_random_unit(1, (uint64_t)i) * (double)slack);
        n_jumps += count_jumps(arrays->triangle + 3 * begin, count, &set);
        n_seen += count;
    }
    loxo_release(ctx, set.table);
    *jumps_a_vertex =
        n_seen > 0 ? 2.0 * (double)n_jumps / (double)n_seen : 0.0; /* a closed surface has two faces a vertex */
    return LOXO_OK;
}
