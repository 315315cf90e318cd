/* SPDX-License-Identifier: MIT
 * Seconds of a job on this machine, in its present state. What a vertex costs is not looked up but measured: the same job,
 * with the same settings, on a small generated mesh, which takes some hundredths of a second. The library then says how
 * that grows with the mesh. So the processor, the compiler, the instruction set, the settings and whoever else is at work
 * are all in it; what is not is the mesh itself: bad triangles need more of the diffusion, and folded ones more windows.
 *
 * Memory is the exception: a machine that is not its own master (a virtual one whose host takes back what lies idle) gives
 * the first gigabytes at a fraction of the speed at which it gives again what was free a moment ago, and that a small job
 * gets. So pages are asked for beside it, and timed. */
#define _POSIX_C_SOURCE 200809L /* stat */

#include "base/os.h"
#include "estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define MOST_VERTICES  40000
#define LEAST_VERTICES 2500
#define WANTED_S       0.03 /* of one round */
#define N_ROUNDS       5
/* Loading the program, asking the machine for its caches. */
#define START_S 0.009
/* Nanoseconds a byte of reading and a value of writing, and a vertex of building half-edges, on the machine where the first
 * two were measured (AMD EPYC, 35 GB/s): how fast this one is at the third says what they are here. */
#define READ_BINARY_NS    0.35
#define READ_TEXT_NS      4.0
#define READ_GIFTI_NS     10.0
#define READ_PACKED_NS    25.0
#define WRITE_NS          8.0
#define REFERENCE_MESH_NS 90.0
/* Of what a job will need, so much is asked for, and not for longer. */
#define PAGES_SHARE  16
#define MOST_PAGES   ((size_t)512 << 20)
#define LEAST_PAGES  ((size_t)16 << 20) /* a job that needs less is over before that matters */
#define PAGES_WITHIN 0.5                /* seconds */
#define PAGE         4096
/* As the library has it for solves. */
#define GAIN_OF_A_THREAD 0.5

typedef struct speed {
    double mesh_ns, job_ns; /* a vertex of the small mesh, one thread: half-edges; create and a solve */
    int64_t n_vertices, n_faces;
} speed;

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *sample)
{
    qsort(sample, N_ROUNDS, sizeof *sample, compare_doubles);
    return sample[N_ROUNDS / 2];
}

static loxo_status run_once(loxo_context *ctx, const loxo_mesh_arrays *arrays, const loxo_mesh_settings *mesh_settings,
                            const loxo_geodesic_settings *settings, double *distance, double *mesh_s, double *job_s)
{
    const loxo_index source = 0;
    loxo_mesh *mesh = NULL;
    const double start = loxo_os_clock_s();
    loxo_status status = loxo_mesh_create(ctx, arrays, LOXO_BORROW, mesh_settings, NULL, &mesh);
    *mesh_s = loxo_os_clock_s() - start;
    if (status >= 0) status = loxo_geodesic_distance(ctx, mesh, settings, &source, 1, distance, NULL);
    *job_s = loxo_os_clock_s() - start - *mesh_s;
    loxo_mesh_destroy(mesh);
    return status;
}

/* On one thread: how several would share so small a mesh says nothing of a large one. */
static loxo_status measure(loxo_context *ctx, const loxo_mesh_settings *mesh_settings,
                           const loxo_geodesic_settings *settings, speed *s)
{
    loxo_generate_settings generate = loxo_generate_settings_default();
    loxo_mesh_settings small = *mesh_settings;
    loxo_soup soup = {0};
    double mesh_s[N_ROUNDS], job_s[N_ROUNDS], expected_s = 0.0, *distance = NULL;
    generate.shape = LOXO_SHAPE_BUMPY;
    generate.n_vertices = MOST_VERTICES;
    for (;; generate.n_vertices /= 2) {
        if (6 * generate.n_vertices > LOXO_INDEX_MAX) continue; /* ids of 16 bits */
        const loxo_status known =
            loxo_geodesic_estimate(ctx, generate.n_vertices, 2 * generate.n_vertices, settings, NULL, &expected_s);
        if (known < 0) return known;
        if (expected_s <= WANTED_S || generate.n_vertices <= LEAST_VERTICES) break;
    }
    small.part_bytes = (size_t)1 << 19; /* not asked of the machine, which takes as long as the rest */
    small.repair = false;
    loxo_status status = loxo_generate(ctx, &generate, false, &soup);
    if (status < 0) return status;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    if ((distance = loxo_allocate(ctx, soup.n_vertices, sizeof *distance)) == NULL) status = LOXO_ERR_MEMORY;
    for (int k = -1; k < N_ROUNDS && status >= 0; ++k) /* the first wakes everything up */
        status = run_once(ctx, &arrays, &small, settings, distance, &mesh_s[k < 0 ? 0 : k], &job_s[k < 0 ? 0 : k]);
    if (status >= 0) {
        s->n_vertices = soup.n_vertices;
        s->n_faces = soup.n_faces;
        s->mesh_ns = 1e9 * median(mesh_s) / (double)soup.n_vertices;
        s->job_ns = 1e9 * median(job_s) / (double)soup.n_vertices;
    }
    loxo_release(ctx, distance);
    loxo_soup_destroy(ctx, &soup);
    return status;
}

/* Seconds a byte of memory that nobody has touched yet, for a job of n_bytes. */
static double first_touch(size_t n_bytes, size_t limit)
{
    size_t n = (n_bytes < limit ? n_bytes : limit) / PAGES_SHARE;
    n = n < MOST_PAGES ? n : MOST_PAGES;
    volatile unsigned char *block = n < LEAST_PAGES ? NULL : loxo_os_map(n);
    if (block == NULL) return 0.0;
    const double start_s = loxo_os_clock_s();
    double seconds = 0.0;
    size_t at = 0;
    while (at < n && seconds < PAGES_WITHIN) {
        for (const size_t end = n - at < LEAST_PAGES ? n : at + LEAST_PAGES; at < end; at += PAGE)
            block[at] = 1;
        seconds = loxo_os_clock_s() - start_s;
    }
    loxo_os_unmap((void *)block, n);
    return seconds / (double)at;
}

/* Nanoseconds of reading, were the machine the one of the constants above. */
static double reading_ns(const char *path, const loxo_mesh_counts *counts)
{
    const double arrays = (double)cli_counts_bytes(counts);
    struct stat file;
    if (strcmp(path, "-") == 0 || stat(path, &file) != 0 || !S_ISREG(file.st_mode)) return READ_BINARY_NS * arrays;
    const double bytes = (double)file.st_size;
    const size_t length = strlen(path);
    if (counts->format == LOXO_FORMAT_GIFTI) return READ_GIFTI_NS * bytes;
    if (length > 3 && strcmp(path + length - 3, ".gz") == 0) return READ_PACKED_NS * bytes;
    /* Binary files hold little but the numbers: a PLY one byte a face more, an STL three times the positions. */
    const bool is_binary = counts->format == LOXO_FORMAT_STL
                               ? bytes < 51.0 * (double)counts->n_faces
                               : bytes < 1.1 * (arrays + 2.0 * (double)counts->n_faces) &&
                                     counts->format != LOXO_FORMAT_OFF && counts->format != LOXO_FORMAT_OBJ;
    return (is_binary ? READ_BINARY_NS : READ_TEXT_NS) * bytes;
}

double cli_estimate_seconds(cli_run *run, const char *path, const loxo_mesh_counts *counts,
                            const loxo_mesh_settings *mesh, const loxo_geodesic_settings *geodesic, size_t peak_bytes)
{
    loxo_context_settings settings = loxo_context_settings_default();
    loxo_geodesic_settings unlimited = *geodesic; /* a length of the caller's mesh says nothing here */
    loxo_context *ctx = NULL;
    speed s = {0};
    double small_s = 0.0, large_s = 0.0;
    const double touch_s =
        first_touch(peak_bytes, run->limit_bytes) * (double)peak_bytes; /* before the small job frees any */
    const double n = (double)counts->n_vertices, n_threads = (double)loxo_context_n_threads(run->ctx);
    unlimited.max_distance = loxo_geodesic_settings_default().max_distance;
    settings.n_threads = 1;
    settings.isa = loxo_context_isa(run->ctx);
    if (loxo_context_create(&settings, &ctx) < 0) return (double)NAN;
    loxo_status status = measure(ctx, mesh, &unlimited, &s);
    if (status >= 0) status = loxo_geodesic_estimate(ctx, s.n_vertices, s.n_faces, &unlimited, NULL, &small_s);
    if (status >= 0)
        status = loxo_geodesic_estimate(run->ctx, counts->n_vertices, counts->n_faces, &unlimited, NULL, &large_s);
    loxo_context_destroy(ctx);
    if (status < 0 || !(small_s > 0.0)) return (double)NAN;
    const double share = 1.0 / (1.0 + GAIN_OF_A_THREAD * (n_threads - 1.0)); /* of one thread's time */
    const double solve_s = large_s * 1e-9 * s.job_ns * (double)s.n_vertices / small_s;
    const double mesh_s = 1e-9 * s.mesh_ns * n * share;
    const double pace = s.mesh_ns / REFERENCE_MESH_NS;
    return START_S * pace + 1e-9 * pace * (reading_ns(path, counts) + WRITE_NS * n) + mesh_s + solve_s +
           touch_s * share;
}
