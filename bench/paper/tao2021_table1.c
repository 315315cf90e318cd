/* SPDX-License-Identifier: MIT
 * Table 1: time, memory, mean relative error, updates of the diffusion and smoothing factor of all methods.
 * source  Tao et al. 2021, Parallel and Scalable Heat Methods, Table 1 */
#include "paper.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* One cell group of the paper: seconds, MB, error in percent, sweeps, m. */
typedef struct printed {
    double precompute_s, time_s, ram_mb, error_percent, sweeps, m;
} printed;

#define NONE ((double)NAN)

enum { VTP, HM, VHM, FACE, EDGE, N_COLUMNS };

/* The paper's columns under our methods' names. */
static const char *const column_method[N_COLUMNS] = {"exact", "heat,factor=cholesky", "variational,factor=cholesky",
                                                     "face", "edge,recovery=admm"};
static const char *const column_name[N_COLUMNS] = {"VTP", "HM", "Variational-HM", "Ours (Face)", "Ours (Edge)"};

/* clang-format off */
static const struct {
    const char *model;    /* the paper's */
    double n_vertices;
    const char *own;      /* ours of that size */
    printed column[N_COLUMNS];
} rows[] = {
    {"Triomphe", 997635, "bumpy", {{0, 17.66, 1218, 0, NONE, NONE}, {10.22, 0.69, 2951, 0.31, NONE, 1.0},
        {11.7, 5.55, 3265, 0.44, NONE, 1.0}, {0, 3.44, 1071, 0.48, 300, 1.0}, {0, 2.06, 543, 0.77, 200, 1.0}}},
    {"Connector", 2002322, "igea", {{0, 224.82, 2502, 0, NONE, NONE}, {26.17, 1.54, 6160, 0.15, NONE, 2.3},
        {29.34, 11.69, 6805, 0.14, NONE, 2.3}, {0, 11.29, 1974, 0.59, 800, 1.0}, {0, 5.60, 983, 0.81, 400, 1.0}}},
    {"ChineseLion", 3979442, "brain", {{0, 235.78, 4849, 0, NONE, NONE}, {54.69, 3.07, 12207, 0.73, NONE, 3.1},
        {61.31, 23.78, 13426, 0.52, NONE, 3.4}, {0, 20.29, 3828, 0.46, 800, 1.0}, {0, 10.13, 1942, 0.96, 400, 1.0}}},
    {"Tricep", 7744320, "igea", {{0, 178.41, 9664, 0, NONE, NONE}, {115.97, 5.71, 23945, 0.84, NONE, 12.6},
        {129.07, 48.61, 26377, 0.59, NONE, 13.4}, {0, 50.24, 7417, 0.50, 1000, 1.0}, {0, 33.37, 3777, 0.84, 700, 1.0}}},
    {"WelshDragon", 9884764, "kitten", {{0, 568.54, 12394, 0, NONE, NONE}, {153.34, 7.24, 30677, 1.21, NONE, 11.1},
        {171.24, 63.67, 33720, 0.91, NONE, 11.8}, {0, 65.20, 9420, 0.50, 1200, 1.0}, {0, 37.32, 4819, 1.00, 700, 1.0}}},
    {"Lucy", 16092674, "bumpy250k", {{0, 1320.15, 18670, 0, NONE, NONE}, {281.97, 12.69, 51144, 0.46, NONE, 13.0},
        {310.01, 113.99, 56186, 0.29, NONE, 13.9}, {0, 148.65, 15370, 0.50, 1500, 1.0}, {0, 80.15, 7872, 0.86, 800, 1.0}}},
    {"HappyGargoyle", 19860482, "horse", {{0, 5060.72, 23464, 0, NONE, NONE}, {388.87, 16.46, 65545, 0.29, NONE, 15.7},
        {424.81, 149.45, 71644, 0.21, NONE, 16.6}, {0, 171.73, 18957, 0.55, 2000, 1.0}, {0, 87.86, 9704, 1.05, 1000, 1.0}}},
    {"Cyvasse", 39920642, "kitten", {{0, 12363.21, 46976, 0, NONE, NONE}, {NONE, NONE, NONE, NONE, NONE, NONE},
        {NONE, NONE, NONE, NONE, NONE, NONE}, {0, 355.42, 38027, 0.86, 2000, 1.0}, {0, 311.33, 19476, 0.93, 1900, 1.0}}},
    {"TwoHeadedBunny", 40103938, "bunny", {{0, 16681.46, 47258, 0, NONE, NONE}, {NONE, NONE, NONE, NONE, NONE, NONE},
        {NONE, NONE, NONE, NONE, NONE, NONE}, {0, 343.07, 38202, 0.83, 2000, 1.0}, {0, 298.25, 19566, 0.94, 1800, 1.0}}},
    {"MalteseFalcon", 79899650, "horse", {{0, 28309.32, 93127, 0, NONE, NONE}, {NONE, NONE, NONE, NONE, NONE, NONE},
        {NONE, NONE, NONE, NONE, NONE, NONE}, {0, 834.52, 76106, 0.82, 2000, 1.0}, {0, 1283.56, 38933, 0.94, 4000, 10.0}}},
    {"ThunderCrab", 98527234, "bimba", {{0, 22298.76, 114610, 0, NONE, NONE}, {NONE, NONE, NONE, NONE, NONE, NONE},
        {NONE, NONE, NONE, NONE, NONE, NONE}, {0, 1174.45, 93850, 1.24, 2000, 1.0}, {0, 1657.98, 48009, 1.41, 4000, 10.0}}},
};
/* clang-format on */
#define N_ROWS (sizeof rows / sizeof rows[0])

static int column_of(const char *method)
{
    for (int c = 0; c < N_COLUMNS; ++c)
        if (strcmp(column_method[c], method) == 0) return c;
    return -1;
}

static void show_printed(bench_table *table, size_t row)
{
    for (int c = 0; c < N_COLUMNS; ++c) {
        const printed *p = &rows[row].column[c];
        char text[6][32];
        const bool is_out = isnan(p->time_s);
        bench_table_row(
            table, "paper: %s|%.0f|%s|%s|%s|%s|%s|%s||%s|%s", rows[row].model, rows[row].n_vertices, column_name[c],
            is_out                  ? "out of memory"
            : p->precompute_s > 0.0 ? paper_number(p->precompute_s, text[0], sizeof text[0])
                                    : "-",
            paper_number(p->time_s, text[1], sizeof text[1]), paper_number(p->ram_mb, text[2], sizeof text[2]),
            paper_number(1e6 * p->ram_mb / rows[row].n_vertices, text[5], sizeof text[5]),
            is_out     ? "-"
            : c == VTP ? "truth"
                       : paper_percent(p->error_percent / 100.0, (char[32]){0}, 32),
            paper_number(p->m, text[3], sizeof text[3]), paper_number(p->sweeps, text[4], sizeof text[4]));
    }
}

static void show_ours(bench *b, bench_table *table, const paper_mesh *mesh, const paper_job *job, size_t row,
                      const paper_search *search)
{
    char text[4][64], error[2][32], number[2][32], name[64], notes[3 * BENCH_CELL];
    const bool ran = job->failure[0] == '\0';
    snprintf(name, sizeof name, mesh->n_subdivisions > 0 ? "%s, subdivided %d times" : "%s", mesh->model->name,
             mesh->n_subdivisions);
    snprintf(notes, sizeof notes, "%s%s%s", ran ? job->note : job->failure,
             job->note[0] != '\0' && ran && search->how[0] != '\0' ? "; " : "", ran ? search->how : "");
    if (!ran) {
        bench_table_row(table, "%s|%lld|%s|-|-|-|-|-|-|-|-|%s", name, (long long)mesh->n_vertices, job->method, notes);
    } else {
        const double mb = 1e-6 * job->peak_bytes.median;
        bench_table_row(
            table, "%s|%lld|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s", name, (long long)mesh->n_vertices, job->method,
            bench_stat_text(job->create_s, 1.0, text[0], sizeof text[0]),
            bench_stat_text(job->solve_s, 1.0, text[1], sizeof text[1]), paper_number(mb, text[2], sizeof text[2]),
            paper_number(1e6 * mb / (double)mesh->n_vertices, text[3], sizeof text[3]),
            paper_percent(job->error, error[0], sizeof error[0]),
            paper_percent(search->error_at_one, error[1], sizeof error[1]), paper_number(search->m, number[0], 32),
            job->updates > 0.0 && paper_is_heat(job->method) ? paper_number(job->updates, number[1], 32) : "-", notes);
    }
    bench_record(b, "table1",
                 json_pack("{s:s, s:s, s:I, s:s, s:s, s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "paper_model",
                           rows[row].model, "mesh", name, "n_vertices", (json_int_t)mesh->n_vertices, "method",
                           job->method, "failure", job->failure, "note", notes, "create_s",
                           bench_stat_json(job->create_s), "solve_s", bench_stat_json(job->solve_s), "peak_bytes",
                           bench_stat_json(job->peak_bytes), "mean_relative", paper_json(job->error),
                           "mean_relative_m1", paper_json(search->error_at_one), "m", paper_json(search->m), "updates",
                           paper_json(job->updates), "predicted_s", paper_json(job->predicted_s)));
    if (job->peer != NULL && ran) {
        char ratio[64];
        bench_say(b, "%s: %s takes %s times the time of the first method here, round by round\n", name, job->method,
                  bench_stat_text(job->ratio, 1.0, ratio, sizeof ratio));
    }
}

/* Time over size of each method, ours and the paper's. */
typedef struct curves {
    double n[PAPER_MAX_METHODS][N_ROWS], time[PAPER_MAX_METHODS][N_ROWS], bytes[PAPER_MAX_METHODS][N_ROWS];
} curves;

static loxo_status plot(bench *b, const curves *c, bool is_bytes)
{
    static double size[N_ROWS], value[N_COLUMNS][N_ROWS];
    char names[N_COLUMNS][48];
    const char *methods[PAPER_MAX_METHODS];
    const int n_methods = paper_columns(b, methods);
    loxo_plot_series series[PAPER_MAX_METHODS + N_COLUMNS];
    loxo_plot p = loxo_plot_default();
    int n = 0;
    for (int i = 0; i < n_methods; ++i)
        series[n++] = (loxo_plot_series){.name = methods[i],
                                         .style = LOXO_PLOT_POINTS, /* other meshes, no curve */
                                         .color = i + 1,
                                         .n = N_ROWS,
                                         .x = c->n[i],
                                         .y = is_bytes ? c->bytes[i] : c->time[i]};
    for (int k = 0; k < N_COLUMNS; ++k) {
        for (size_t r = 0; r < N_ROWS; ++r) {
            const printed *x = &rows[r].column[k];
            size[r] = rows[r].n_vertices;
            value[k][r] = is_bytes ? x->ram_mb : x->precompute_s + x->time_s;
        }
        snprintf(names[k], sizeof names[k], "paper: %s", column_name[k]);
        int color = n_methods + 1 + k;
        for (int i = 0; i < n_methods; ++i)
            if (column_of(methods[i]) == k) color = i + 1;
        series[n++] = (loxo_plot_series){
            .name = names[k], .is_dashed = true, .color = color, .n = N_ROWS, .x = size, .y = value[k]};
    }
    p.title = is_bytes ? "Table 1: peak memory of the process" : "Table 1: preparation and one solve";
    p.x_title = "vertices";
    p.y_title = is_bytes ? "memory, MB" : "time, s";
    p.x_scale = p.y_scale = LOXO_PLOT_LOG;
    p.n_series = n;
    p.series = series;
    return paper_plot(b, is_bytes ? "memory" : "time", &p);
}

/* All methods on one mesh, heat-type ones at their best m, and the peers, in turns. */
static loxo_status measure(bench *b, size_t row, bench_table *table, curves *c)
{
    static paper_job jobs[PAPER_MAX_JOBS]; /* large */
    static paper_search search[PAPER_MAX_JOBS];
    const int n_threads = b->threads[b->n_threads - 1];
    const char *methods[PAPER_MAX_METHODS];
    const int n_methods = paper_columns(b, methods);
    paper_mesh mesh;
    int n = 0;
    loxo_status status =
        paper_mesh_make(b, paper_model_find(rows[row].own), b->settings.share * rows[row].n_vertices, true, &mesh);
    if (status == LOXO_ERR_UNSUPPORTED) {
        bench_table_row(table, "%s|%.0f|-|-|-|-|-|-|-|-|-|%s", rows[row].own, rows[row].n_vertices, bench_message(b));
        return LOXO_OK;
    }
    if (status < 0) return status;
    memset(jobs, 0, sizeof jobs);
    for (int i = 0; i < PAPER_MAX_JOBS; ++i)
        search[i] = (paper_search){.m = (double)NAN, .error_at_one = (double)NAN};
    for (int i = 0; i < n_methods; ++i, ++n) {
        jobs[n].n_threads = n_threads;
        snprintf(jobs[n].method, sizeof jobs[n].method, "%s", methods[i]);
        if (!paper_is_heat(methods[i])) continue;
        if (strstr(methods[i], "recovery=unfold") !=
            NULL) { /* takes the order of the vertices only, and that is the same */
            search[n].m = 1.0;
            snprintf(search[n].how, sizeof search[n].how, "m not searched");
            continue;
        }
        paper_search_m(b, &mesh, methods[i], n_threads, &search[n]);
        jobs[n].predicted_s = search[n].predicted_s;
        if (!isnan(search[n].m))
            snprintf(jobs[n].method, sizeof jobs[n].method, "%s,time-factor=%.3g", methods[i], search[n].m);
    }
    const int n_own = n;
    n = paper_add_peers(b, n_threads, n, jobs);
    if ((status = paper_rounds(b, &mesh, n, jobs)) < 0) return status;
    for (int i = 0; i < n; ++i) {
        if (i < n_own) snprintf(jobs[i].method, sizeof jobs[i].method, "%s", methods[i]);
        show_ours(b, table, &mesh, &jobs[i], row, &search[i]);
        if (i >= n_own) continue;
        const bool ran = jobs[i].failure[0] == '\0';
        c->n[i][row] = (double)mesh.n_vertices;
        c->time[i][row] = ran ? jobs[i].total_s.median : (double)NAN;
        c->bytes[i][row] = ran ? 1e-6 * jobs[i].peak_bytes.median : (double)NAN;
    }
    return LOXO_OK;
}

loxo_status paper_tao2021_table1(bench *b)
{
    static bench_table table; /* large */
    static curves c;
    static const int width[] = {27, 9, 28, 20, 20, 7, 8, 13, 9, 7, 17, 40};
    bench_table_begin_live(b, &table,
                           "model|vertices|method|create, s|solve, s|RAM, MB|B/vertex|error, eq. 29|at m = 1|m|"
                           "sweeps or updates|notes",
                           width);
    for (size_t r = 0; r < N_ROWS; ++r) {
        for (int i = 0; i < PAPER_MAX_METHODS; ++i)
            c.n[i][r] = c.time[i][r] = c.bytes[i][r] = (double)NAN;
        if (!paper_wants(b, rows[r].own)) continue;
        if (b->settings.share * rows[r].n_vertices > (double)b->settings.largest) {
            bench_table_row(&table, "%s|%.0f|-|-|-|-|-|-|-|-|-|not run: over --largest", rows[r].own,
                            b->settings.share * rows[r].n_vertices);
        } else {
            const loxo_status status = measure(b, r, &table, &c);
            if (status < 0) return status;
        }
        show_printed(&table, r);
        const loxo_status kept = paper_keep(b);
        if (kept < 0) return kept;
    }
    bench_say(b, "\n");
    bench_say(
        b,
        "Paper: 8 threads of an 8-core processor at 3.6 GHz, 128 GB; ours: %d threads of the machine above.\n"
        "create: preparation that all sources share (the paper's pre-computation; - where it gives one time).\n"
        "solve: one source. RAM: peak of the process, reading included. sweeps or updates: the paper's sweeps over\n"
        "all vertices; ours counts updates a vertex of the marching window.\n"
        "m: searched on a mesh of the same surface of about 250 thousand vertices, then around that m on the mesh "
        "itself\n"
        "(notes: how many solves of each), for %g s each at most (--search-seconds). A method whose one solve is\n"
        "predicted to take over %g s (--solve-seconds) is not run; rounds of a method end after that time.\n"
        "What differs: the paper's models are not at hand; ours are generated or scans that are subdivided to a like\n"
        "size, from whose own vertices the error is taken (true distances do not change). The paper searches m for\n"
        "the heat method and its variational sister only; here every method that takes directions from the heat is\n"
        "searched alike; unfolding takes but the order of the vertices, at m = 1.\n",
        b->threads[b->n_threads - 1], b->settings.search_seconds, b->settings.solve_seconds);
    const loxo_status status = plot(b, &c, false);
    return status < 0 ? status : plot(b, &c, true);
}
