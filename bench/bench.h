/* SPDX-License-Identifier: MIT
 * What the files of loxo-bench share: settings, cases, samples, tables, child processes, peers. */
#ifndef LOXO_BENCH_BENCH_H
#define LOXO_BENCH_BENCH_H

#include <loxo/loxo.h>

#include <jansson.h>
#include <stdio.h>

#define BENCH_MAX_REPEATS 101
#define BENCH_MAX_THREADS 16
#define BENCH_MAX_PEERS   16
#define BENCH_MAX_SWEEPS  16
#define BENCH_MAX_METHODS 16
#define BENCH_PATH        4096

typedef struct bench_settings {
    int repeats;           /* measured rounds; a warm-up round goes before */
    int64_t vertices;      /* of the generated meshes of `time`, `build`, and the smaller of `scale` */
    int64_t largest;       /* vertices of the larger mesh of `scale` */
    int64_t source;        /* vertex from which `time` and `scale` solve; errors are known from vertex 0 only */
    double share;          /* paper: sizes of meshes, in those of the paper */
    size_t max_memory;     /* bytes that solves may take; 0: what the machine grants */
    double search_seconds; /* paper: of the search of the best m, each method on each mesh */
    double
        solve_seconds; /* paper: methods of which one solve is predicted to take longer are not run; rounds end after it */
} bench_settings;

/* Somebody else's program: a shell command with {mesh} {sources} {out} {threads} {method} in it. It prints `seconds X`
 * (time without reading; also, if it likes, `phase NAME X` and `bytes X`, its peak) and writes the distances to {out},
 * raw float64 or .npy. */
typedef struct bench_peer {
    char name[32];
    const char *command;
} bench_peer;

typedef struct bench {
    loxo_context *ctx;
    bench_settings settings;
    int n_threads, threads[BENCH_MAX_THREADS]; /* thread counts to measure, ascending */
    int n_peers;
    bench_peer peers[BENCH_MAX_PEERS];
    int n_methods;
    const char *methods[BENCH_MAX_METHODS]; /* names of loxo/geodesic.h; --method, else what the command is for */
    int n_sweeps;
    int64_t sweeps[BENCH_MAX_SWEEPS]; /* sweep counts of the paper's diffusion that `accuracy` shows too */
    const char *case_filter;          /* part of a case's name; NULL: all */
    const char *mesh, *exact;         /* a case of the user's own */
    const char *json_path;            /* NULL: no JSON */
    const char *out;                  /* paper: folder of tables, JSON and plots; NULL: none */
    const char *figure;               /* paper: name of the table or figure that is being made */
    FILE *text;                       /* receives what is printed, too; NULL: nothing does */
    char shared[BENCH_PATH];          /* folder of the meshes; "" when there is none */
    char work[BENCH_PATH];            /* folder for generated meshes and results */
    bool keep_work;                   /* it was given, so what is in it stays */
    char self[BENCH_PATH];            /* this program, to run as a child */
    int child_exit;                   /* exit code of the last worker */
    json_t *report;                   /* what --json writes */
    char message[2 * BENCH_PATH];     /* why the last bench_fail failed; "" when the context knows */
} bench;

/* Keeps the message and returns status. */
loxo_status bench_fail(bench *b, loxo_status status, const char *format, ...) __attribute__((format(printf, 3, 4)));
/* The reason of the last failure, the bench's own or the library's. */
const char *bench_message(const bench *b);

/* Finds the folder of the test meshes where --shared does not say it: $LOXO_SHARED/meshes, ../shared/meshes, and shared/meshes
 * beside each folder that this program lies in. */
void bench_find_shared(bench *b);
/* Says which it is, or where it was looked for. */
void bench_tell_shared(const bench *b);

/* Whether --method, or the command's own list, has it. */
bool bench_has_method(const bench *b, const char *name);
/* Whether it is the paper's: it diffuses heat that can be looked at and given. */
bool bench_is_parallel_heat(const char *name);

/* ---- samples and tables (report.c) --------------------------------------------------------------------------- */

typedef struct bench_stat {
    double median, min, max;
    int n;
} bench_stat;

bench_stat bench_stat_of(int n, const double *sample); /* n >= 1 */
/* "0.412 [0.405..0.431]", in the given unit's scale: 1e3 for ms. */
const char *bench_stat_text(bench_stat stat, double scale, char *text, size_t n);
json_t *bench_stat_json(bench_stat stat);

#define BENCH_MAX_COLUMNS 18
#define BENCH_MAX_ROWS    400
#define BENCH_CELL        64

typedef struct bench_table {
    int n_columns, n_rows;
    const struct bench *live; /* its rows are printed as they come; NULL: all at the end */
    int width[BENCH_MAX_COLUMNS];
    char cell[BENCH_MAX_ROWS][BENCH_MAX_COLUMNS][BENCH_CELL]; /* row 0: heads */
} bench_table;

/* heads and rows are given as "a|b|c"; cells beyond the table's size are dropped. */
void bench_table_begin(bench_table *table, const char *heads);
/* Of a table that takes long: each row is printed, and in the file, once it is there. Widths of the columns as they are
 * expected; a wider cell moves the rest of its row. */
void bench_table_begin_live(const bench *b, bench_table *table, const char *heads, const int *width);
void bench_table_row(bench_table *table, const char *format, ...) __attribute__((format(printf, 2, 3)));
void bench_table_print(const bench *b, const bench_table *table);
/* printf for everything that people read: standard output, and b->text. */
void bench_say(const bench *b, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Prints what the numbers were measured on and puts it into the report; triad for every thread count. */
loxo_status bench_machine(bench *b);
/* Appends to the list of that name in the report; takes over row. */
void bench_record(bench *b, const char *list, json_t *row);
loxo_status bench_report_write(bench *b);

/* ---- cases (case.c) ------------------------------------------------------------------------------------------ */

typedef enum bench_use { BENCH_ACCURACY = 1, BENCH_TIME = 2 } bench_use;

typedef struct bench_case {
    const char *name;
    unsigned use;      /* bench_use, or-ed */
    const char *file;  /* under the folder of the meshes; NULL: generated */
    const char *exact; /* distances from vertex 0, under that folder; NULL: none, or a closed form */
    loxo_shape shape;  /* when generated */
    int divisor;       /* of settings.vertices, when generated */
    bool has_closed_form;
} bench_case;

int bench_n_cases(const bench *b);
/* Case i; the last one is the user's own when --mesh was given. */
bench_case bench_case_get(const bench *b, int i);
bool bench_case_wanted(const bench *b, const bench_case *c, bench_use use);
/* Whether its files are there. */
bool bench_case_present(const bench *b, const bench_case *c);
/* Its mesh as a file that anybody can read: the file itself, or a PLY generated into the work folder by a child. */
loxo_status bench_case_path(bench *b, const bench_case *c, char path[BENCH_PATH]);
/* Reads it; exact (may be NULL) receives the true distances from vertex 0, or NULL where none are known. */
loxo_status bench_case_load(bench *b, const bench_case *c, loxo_soup *soup, double **exact);
loxo_status bench_generate(bench *b, loxo_shape shape, int64_t n_vertices, char path[BENCH_PATH]);

/* ---- children (process.c, worker.c) -------------------------------------------------------------------------- */

typedef struct bench_child {
    char *text; /* its standard output, ends with 0; from loxo_allocate */
    int exit_code;
    double wall_s;
    size_t peak_bytes; /* most resident bytes; not less than this process's when it was started */
} bench_child;

/* Runs a program (argv ends with NULL; found in PATH) with its output caught and its errors let through. */
loxo_status bench_child_run(loxo_context *ctx, const char *const *argv, bench_child *child);
bool bench_self_path(char path[BENCH_PATH]);
bool bench_make_folder(char path[BENCH_PATH]); /* a new one of our own under TMPDIR */
void bench_remove_folder(const char *path);    /* with the files in it */

/* A measurement in a process of its own, so that its peak is its own: `loxo-bench worker TASK ...`. */
loxo_status bench_worker(bench *b, int argc, char **argv);
/* Runs one and parses the JSON it prints; the caller releases *result with json_decref. Failing leaves the exit code in
 * b->child_exit.
 *   generate SHAPE N FILE         subdivide FILE TIMES OUT      shuffle FILE OUT
 *   closed-form SHAPE N OUT       distances from vertex 0
 *   build FILE N                  half-edges, N times
 *   order FILE ORDER N METHOD     half-edges and solves in an order, N times
 *   solve FILE METHOD N OUT       N solves; METHOD is a name and settings, as "edge,time-factor=2"
 *   error CASE FILE               mean relative error of distances
 *   compare TRUTH FILE            the same, over as many vertices as TRUTH has
 *   search FILE METHOD TRUTH START   the best time factor m, looked for from START on */
loxo_status bench_worker_run(bench *b, int n_threads, const char *const *task, json_t **result);
/* "edge,time-factor=2" into settings. */
loxo_status bench_method_settings(bench *b, const char *method, loxo_geodesic_settings *settings);
double bench_number(const json_t *object, const char *key); /* NaN when absent */

/* ---- peers (peer.c) ------------------------------------------------------------------------------------------ */

typedef struct bench_peer_result {
    double seconds;
    double diffusion_s; /* NaN when it did not say */
    size_t peak_bytes;
    bool has_written; /* its file of distances is there */
} bench_peer_result;

/* Runs a peer on a mesh; its distances are then in the file out, if it wrote any. Failing is told on stderr and is LOXO_ERR_UNSUPPORTED. */
loxo_status bench_peer_run(bench *b, const bench_peer *peer, const char *mesh, const char *out, int n_threads,
                           const char *method, bench_peer_result *result);
/* Distances from a file: .npy, or raw float64 of n values. */
loxo_status bench_read_distances(bench *b, const char *path, int64_t n, double **distance);

/* ---- commands ------------------------------------------------------------------------------------------------ */

/* STREAM triad a[i] = b[i] + s c[i], 24 bytes an element, arrays far larger than the caches. */
typedef struct bench_triad {
    int n_threads;
    int64_t n;
    double *array[3];
} bench_triad;

loxo_status bench_triad_open(bench *b, int n_threads, bench_triad *t);
double bench_triad_run(const bench_triad *t); /* GB/s of one pass; 0 when the result was wrong */
void bench_triad_close(bench *b, bench_triad *t);

loxo_status bench_list(bench *b);
loxo_status bench_micro(bench *b);
loxo_status bench_accuracy(bench *b);
loxo_status bench_time(bench *b);
loxo_status bench_scale(bench *b);
loxo_status bench_build(bench *b);
loxo_status bench_orders(bench *b);
loxo_status bench_laplace(bench *b);
loxo_status bench_estimate(bench *b);
loxo_status bench_barycenter(bench *b);
loxo_status bench_paper_list(bench *b);
loxo_status bench_paper(bench *b, int n_names, char **names);

#endif
