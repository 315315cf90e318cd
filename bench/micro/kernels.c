/* SPDX-License-Identifier: MIT
 * Every hot kernel alone, in every instruction set of this processor, against the memory's speed. */
#include "../bench.h"
#include "base/os.h"
#include "kernel/variants.h"
#include "moments.h"
#include "sparse.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>

#define N_INNER 4 /* runs a sample: an even number, so that what is written twice ends where it began */

/* What the kernels work on: a mesh of the house and arrays as the solver lays them out. Vertices stand in the mesh's
 * order where the solver has breadth-first order. */
typedef struct subject {
    bench *b;
    loxo_soup soup;
    loxo_mesh *mesh;
    loxo_mesh_view m;
    k_row *row;
    k_entry *entry;
    double *value, *heat, *closure, *state, *potential[2], *difference, *area, *push[2];
    double (*square)[3], (*target)[2], (*gradient)[2];
    k_change *change;
    int32_t *scale;
} subject;

#define BLOCK_ROWS 64

static void diffusion(const subject *s, const k_variant *k, int64_t begin, int64_t end, int turn)
{
    const int64_t first_block = (begin + BLOCK_ROWS - 1) / BLOCK_ROWS, last_block = (end + BLOCK_ROWS - 1) / BLOCK_ROWS;
    const int64_t to = last_block * BLOCK_ROWS < s->m.n_vertices ? last_block * BLOCK_ROWS : s->m.n_vertices;
    k->relax_blocks(s->row + first_block * BLOCK_ROWS, s->entry, NULL, s->value, first_block * BLOCK_ROWS, to,
                    BLOCK_ROWS, (unsigned)turn & 1u, s->change + first_block);
}

static void differences(const subject *s, const k_variant *k, int64_t begin, int64_t end, int turn)
{
    (void)turn;
    k->face_differences(&s->m, s->heat, s->scale, begin, end, s->difference);
}

static void targets(const subject *s, const k_variant *k, int64_t begin, int64_t end, int turn)
{
    (void)turn;
    k->face_targets(&s->m, s->heat, s->scale, begin, end, s->area, s->square, s->target, s->push[0]);
}

static void admm_edge(const subject *s, const k_variant *k, int64_t begin, int64_t end, int turn)
{
    k->admm_edge(&s->m, 100.0 / 101.0, begin, end, s->closure, s->state, s->potential[turn & 1],
                 s->potential[(turn + 1) & 1]);
}

static void admm_face(const subject *s, const k_variant *k, int64_t begin, int64_t end, int turn)
{
    k->admm_face(&s->m, 100.0, begin, end, s->area, (const double(*)[3])s->square, (const double(*)[2])s->target,
                 (const double(*)[2])s->gradient, s->gradient, s->push[turn & 1], s->push[(turn + 1) & 1]);
}

/* Bytes that one run must read and write, an element; per-vertex data count half a face. Neighbours' numbers count once:
 * they stand near in a mesh in order. */
static const struct {
    const char *name, *element;
    void (*run)(const subject *s, const k_variant *k, int64_t begin, int64_t end, int turn);
    double bytes; /* with positions in double */
} kernels[] = {
    /* row 16, six entries of 8, own value read and written */
    {"diffusion, one step", "vertex", diffusion, 16 + 6 * 8 + 16},
    /* corners 12, positions 12, value 4, scale 2; three differences, or area, squares, target, push */
    {"gradient to differences", "face", differences, 12 + 12 + 4 + 2 + 24},
    {"gradient to face state", "face", targets, 12 + 12 + 4 + 2 + 8 + 24 + 16 + 24},
    /* twins 12, closure 8, state read and written 16, potential read 8 and written 8 */
    {"ADMM on edges", "face", admm_edge, 12 + 8 + 16 + 16},
    /* twins 12, area 8, squares 24, target 16, gradient read and written 32, push read 24 and written 24 */
    {"ADMM on faces", "face", admm_face, 12 + 8 + 24 + 16 + 32 + 48},
};
#define N_KERNELS ((int)(sizeof kernels / sizeof kernels[0]))

static void close_subject(subject *s)
{
    loxo_context *ctx = s->b->ctx;
    void *const arrays[] = {s->row,          s->entry,      s->value,  s->closure, s->state,   s->potential[0],
                            s->potential[1], s->difference, s->area,   s->push[0], s->push[1], s->square,
                            s->target,       s->gradient,   s->change, s->scale,   s->heat};
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; ++i)
        loxo_release(ctx, arrays[i]);
    loxo_mesh_destroy(s->mesh);
    loxo_soup_destroy(ctx, &s->soup);
}

static void *take(subject *s, int64_t count, size_t size, bool *is_good)
{
    void *block = loxo_allocate(s->b->ctx, count, size);
    *is_good = *is_good && block != NULL;
    return block;
}

/* Rows of A + h^2 C, each divided by its diagonal; keep makes up for the decay, so that nothing dies away. */
static void fill_rows(subject *s)
{
    uint32_t n = 0;
    for (int64_t v = 0; v < s->m.n_vertices; ++v) {
        k_entry *entry = s->entry + n;
        const double area = k_cotangent_row(&s->m, (loxo_index)v, entry);
        const uint32_t degree = k_degree(&s->m, (loxo_index)v);
        double diagonal = area, sum = 0.0;
        for (uint32_t k = 0; k < degree; ++k)
            diagonal += area * (double)entry[k].coefficient;
        for (uint32_t k = 0; k < degree; ++k) {
            entry[k].coefficient = (float)(area * (double)entry[k].coefficient / diagonal);
            sum += (double)entry[k].coefficient;
            const bool is_near = entry[k].slot / BLOCK_ROWS == (uint32_t)v / BLOCK_ROWS;
            entry[k].slot = 2 * entry[k].slot + (is_near ? 0 : 1); /* from other blocks, the step before */
        }
        s->row[v] = (k_row){.begin = n, .weight = 1.0f, .keep = 1.0 - sum};
        n += degree;
    }
    s->row[s->m.n_vertices] = (k_row){.begin = n};
}

static void fill(subject *s)
{
    fill_rows(s);
    for (int64_t v = 0; v < s->m.n_vertices; ++v) {
        s->value[2 * v] = s->value[2 * v + 1] = 1.0 + 0.1 * sin((double)v);
        s->scale[v] = 0;
        s->heat[v] = s->value[2 * v];
    }
    for (int64_t f = 0; f < s->m.n_faces; ++f) {
        s->closure[f] = 1e-3 * cos((double)f);
        s->state[f] = -s->closure[f];
        s->potential[0][f] = s->potential[1][f] = 0.0;
        s->area[f] = 1.0;
        for (int k = 0; k < 3; ++k) {
            s->square[f][k] = 1.0;
            s->push[0][3 * f + k] = s->push[1][3 * f + k] = s->difference[3 * f + k] = 0.0;
            if (k < 2) s->target[f][k] = s->gradient[f][k] = sin((double)(f + k));
        }
    }
}

static loxo_status open_subject(subject *s)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    bool is_good = true;
    settings.shape = LOXO_SHAPE_BUMPY;
    settings.n_vertices = s->b->settings.vertices;
    loxo_status status = loxo_generate(s->b->ctx, &settings, false, &s->soup);
    if (status < 0) return status;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&s->soup);
    if ((status = loxo_mesh_create(s->b->ctx, &arrays, LOXO_BORROW, NULL, NULL, &s->mesh)) < 0) return status;
    s->m = loxo_mesh_get_view(s->mesh);
    const int64_t n = s->m.n_vertices, n_faces = s->m.n_faces;
    s->row = take(s, n + 1, sizeof *s->row, &is_good);
    s->entry = take(s, 3 * n_faces, sizeof *s->entry, &is_good);
    s->value = take(s, 2 * n, sizeof *s->value, &is_good);
    s->change = take(s, n / BLOCK_ROWS + 1, sizeof *s->change, &is_good);
    s->scale = take(s, n, sizeof *s->scale, &is_good);
    s->heat = take(s, n, sizeof *s->heat, &is_good);
    s->closure = take(s, n_faces, sizeof *s->closure, &is_good);
    s->state = take(s, n_faces, sizeof *s->state, &is_good);
    s->area = take(s, n_faces, sizeof *s->area, &is_good);
    s->difference = take(s, 3 * n_faces, sizeof *s->difference, &is_good);
    s->square = take(s, n_faces, sizeof *s->square, &is_good);
    s->target = take(s, n_faces, sizeof *s->target, &is_good);
    s->gradient = take(s, n_faces, sizeof *s->gradient, &is_good);
    for (int i = 0; i < 2; ++i) {
        s->potential[i] = take(s, n_faces, sizeof *s->potential[i], &is_good);
        s->push[i] = take(s, 3 * n_faces, sizeof *s->push[i], &is_good);
    }
    if (!is_good) return LOXO_ERR_MEMORY;
    fill(s);
    return LOXO_OK;
}

static double run_once(const subject *s, int kernel, const k_variant *variant, int64_t n, int n_threads)
{
    const double start = loxo_os_clock_s();
    for (int turn = 0; turn < N_INNER; ++turn) {
#pragma omp parallel num_threads(n_threads)
        {
            const int64_t i = omp_get_thread_num(), of = omp_get_num_threads();
            kernels[kernel].run(s, variant, n * i / of, n * (i + 1) / of, turn);
        }
    }
    return (loxo_os_clock_s() - start) / N_INNER;
}

/* Kernel and triad in turns: a neighbour on the machine slows both. */
static void measure(const subject *s, bench_table *table, int kernel, loxo_isa isa, const bench_triad *triad)
{
    bench *b = s->b;
    const k_variant *variant = k_variant_get(isa);
    const int64_t n = kernels[kernel].element[0] == 'v' ? s->m.n_vertices : s->m.n_faces;
    double ns[BENCH_MAX_REPEATS], share[BENCH_MAX_REPEATS];
    char text[2][64];
    for (int k = -1; k < b->settings.repeats; ++k) { /* the warm-up is overwritten */
        const int at = k < 0 ? 0 : k;
        const double rate = bench_triad_run(triad);
        ns[at] = 1e9 * run_once(s, kernel, variant, n, triad->n_threads) / (double)n;
        share[at] = 100.0 * kernels[kernel].bytes / ns[at] / rate;
    }
    const bench_stat stat = bench_stat_of(b->settings.repeats, ns), of = bench_stat_of(b->settings.repeats, share);
    bench_table_row(table, "%s|%s|%d|%s|%s|%.0f|%.1f|%s", kernels[kernel].name, variant->name, triad->n_threads,
                    kernels[kernel].element, bench_stat_text(stat, 1.0, text[0], sizeof text[0]), kernels[kernel].bytes,
                    kernels[kernel].bytes / stat.median, bench_stat_text(of, 1.0, text[1], sizeof text[1]));
    bench_record(b, "kernels",
                 json_pack("{s:s, s:s, s:i, s:s, s:o, s:f, s:o}", "kernel", kernels[kernel].name, "isa", variant->name,
                           "threads", triad->n_threads, "element", kernels[kernel].element, "ns", bench_stat_json(stat),
                           "bytes", kernels[kernel].bytes, "percent_of_triad", bench_stat_json(of)));
}

loxo_status bench_micro(bench *b)
{
    static bench_table table; /* large */
    subject s = {.b = b};
    loxo_status status = open_subject(&s);
    bench_table_begin(&table, "kernel|set|threads|element|ns/element|bytes/element|GB/s|% of triad");
    for (int t = 0; t < b->n_threads && status >= 0; ++t) {
        bench_triad triad;
        if ((status = bench_triad_open(b, b->threads[t], &triad)) < 0) break;
        for (int kernel = 0; kernel < N_KERNELS; ++kernel)
            for (int isa = LOXO_ISA_BASELINE; isa <= (int)loxo_context_isa(b->ctx); ++isa)
                measure(&s, &table, kernel, (loxo_isa)isa, &triad);
        bench_triad_close(b, &triad);
    }
    if (status >= 0) status = bench_micro_sparse(b, &s.m, &table);
    if (status >= 0) {
        bench_table_print(b, &table);
        printf(
            "%lld vertices, %lld faces, positions in double. bytes/element: what must be read and written once. %% of "
            "triad: of the\ntriad with as many threads, run in turns with the kernel. A step of the diffusion stays in "
            "cache inside the solver's\nwindow, so there it is faster.\n",
            (long long)s.m.n_vertices, (long long)s.m.n_faces);
    }
    close_subject(&s);
    return status < 0 ? status : bench_micro_moments(b);
}
