/* SPDX-License-Identifier: MIT
 * loxo sample: vertices spread over a surface, each the farthest from those before. */
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "method.h"
#include "run.h"
#include "sources.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MOST_SHOWN 1024 /* of the points in the report */

typedef struct sample_state {
    cli_common common;
    loxo_mesh_settings mesh;
    loxo_geodesic_settings geodesic;
} sample_state;

static void set_defaults(void *state)
{
    *(sample_state *)state =
        (sample_state){.mesh = loxo_mesh_settings_default(), .geodesic = loxo_geodesic_settings_default()};
}

/* What was sampled. */
typedef struct samples {
    int64_t n;
    loxo_index *vertex;
    double *radius, (*position)[3];
} samples;

static bool is_list(const char *path)
{
    const size_t n = strlen(path);
    return n >= 4 && strcmp(path + n - 4, ".txt") == 0;
}

static bool is_table(const char *path)
{
    const size_t n = strlen(path);
    return strcmp(path, "-") == 0 ||
           (n >= 4 && (strcmp(path + n - 4, ".csv") == 0 || strcmp(path + n - 4, ".npy") == 0));
}

static loxo_status check(cli_run *run, int64_t *count)
{
    const char *text = cli_args_value(&run->args, "count", 0), *path;
    loxo_status status;
    if (text == NULL || !cli_parse_integer(text, strlen(text), count) || *count < 1)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "sample: give --count N, a whole number from 1 on");
    if (!cli_args_has(&run->args, "output") && run->json_path == NULL && !run->common->estimate)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "sample: no output; give -o FILE or --json");
    for (int cursor = 0; (path = cli_args_next(&run->args, "output", &cursor)) != NULL;) {
        if (!is_list(path) && !is_table(path))
            return cli_fail(run, LOXO_ERR_UNSUPPORTED, "sample: -o writes .csv, .npy or .txt, not '%s'", path);
        if ((status = cli_output(run, path)) < 0) return status;
    }
    if ((cli_args_has(&run->args, "source") || cli_args_has(&run->args, "sources")) &&
        (status = cli_sources_check(run)) < 0)
        return status;
    return LOXO_OK;
}

/* Whole solves that so many limited ones take together. */
static int64_t whole_solves(int64_t count) { return 1 + (int64_t)log2((double)count); }

static loxo_status estimate(cli_run *run, sample_state *s, int64_t count)
{
    loxo_mesh_counts counts;
    size_t mesh_bytes = 0, build_bytes = 0, work_bytes = 0;
    loxo_status status = cli_count_mesh(run, run->args.operand[0], &counts);
    if (status < 0) return status;
    const int64_t n = counts.n_vertices;
    if ((status = loxo_geodesic_resolve(run->ctx, n, whole_solves(count), &s->geodesic)) < 0) return status;
    status = loxo_mesh_estimate(n, counts.n_faces, counts.is_float, &s->mesh, &mesh_bytes, &build_bytes);
    if (status >= 0) status = loxo_geodesic_estimate(run->ctx, n, counts.n_faces, &s->geodesic, &work_bytes, NULL);
    if (status < 0) return status;
    const size_t solve_bytes = mesh_bytes + work_bytes + sizeof(double) * (size_t)n;
    size_t peak_bytes = counts.read_bytes > build_bytes ? counts.read_bytes : build_bytes;
    if (solve_bytes > peak_bytes) peak_bytes = solve_bytes;
    cli_estimate_part(run, "read_bytes", counts.read_bytes);
    cli_estimate_part(run, "build_bytes", build_bytes);
    cli_estimate_part(run, "mesh_bytes", mesh_bytes);
    cli_estimate_part(run, "workspace_bytes", work_bytes);
    cli_estimate(run, peak_bytes, NAN);
    return LOXO_OK;
}

/* Positions of the caller's vertices, while the arrays of the file are there. */
static void take_positions(const loxo_soup *soup, samples *p)
{
    for (int64_t i = 0; i < p->n; ++i)
        for (int k = 0; k < 3; ++k) {
            const int64_t at = 3 * (int64_t)p->vertex[i] + k;
            p->position[i][k] = soup->position != NULL ? soup->position[at] : (double)soup->position_float[at];
        }
}

/* Each vertex once, in the order of the words; vertex 0 where none was named. */
static loxo_status list_starts(cli_run *run, const cli_sources *starts, loxo_index **start, int64_t *n)
{
    bool *is_there = loxo_allocate(run->ctx, starts->n_vertices, sizeof *is_there);
    *n = 0;
    *start = loxo_allocate(run->ctx, starts->n + 1, sizeof **start);
    if (is_there != NULL && *start != NULL) {
        memset(is_there, 0, (size_t)starts->n_vertices * sizeof *is_there);
        for (int64_t i = 0; i < starts->n; ++i) {
            const loxo_index v = starts->point[i].vertex[0];
            if (!is_there[v]) (*start)[(*n)++] = v;
            is_there[v] = true;
        }
        if (*n == 0) (*start)[(*n)++] = 0;
    }
    loxo_release(run->ctx, is_there);
    return *n > 0 ? LOXO_OK : LOXO_ERR_MEMORY;
}

static loxo_status solve(cli_run *run, const sample_state *s, const loxo_mesh *mesh, const cli_sources *starts,
                         samples *p)
{
    loxo_geodesic *geodesic = NULL;
    const double start_s = loxo_os_clock_s();
    int64_t n_start = 0;
    loxo_index *start = NULL;
    loxo_status status = list_starts(run, starts, &start, &n_start);
    if (status >= 0) status = loxo_geodesic_create(run->ctx, mesh, &s->geodesic, &geodesic);
    if (status >= 0) status = loxo_geodesic_farthest_points(geodesic, start, n_start, p->n, p->vertex, p->radius, NULL);
    loxo_geodesic_destroy(geodesic);
    loxo_release(run->ctx, start);
    if (status < 0) return status;
    (void)cli_seconds(run, "sample", start_s);
    return cli_combine(run, status);
}

static void tell(cli_run *run, const samples *p)
{
    json_t *vertex = json_put_array(run->report.json, "points"), *radius = json_put_array(run->report.json, "radius");
    for (int64_t i = 0; i < p->n && i < MOST_SHOWN; ++i) {
        json_append(vertex, json_integer(p->vertex[i]));
        json_append(radius, isfinite(p->radius[i]) ? json_real(p->radius[i]) : json_null());
    }
    report_row(&run->report, "points", "%s, every vertex within %.6g of one", text_count(p->n), p->radius[p->n - 1]);
}

static loxo_status write_list(cli_run *run, const char *path, const samples *p)
{
    enum { LONGEST = 24 };
    char *text = loxo_allocate(run->ctx, p->n, LONGEST);
    size_t used = 0;
    if (text == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < p->n; ++i)
        used += (size_t)snprintf(text + used, LONGEST, "%lld\n", (long long)p->vertex[i]);
    const loxo_status status = loxo_write_bytes(run->ctx, path, text, used);
    loxo_release(run->ctx, text);
    return status;
}

static loxo_status write_files(cli_run *run, const samples *p)
{
    const char *path;
    loxo_status status = cli_before_output(run);
    for (int cursor = 0; status >= 0 && (path = cli_args_next(&run->args, "output", &cursor)) != NULL;) {
        status = is_list(path) ? write_list(run, path, p)
                               : loxo_write_matrix(run->ctx, path, (const double *)p->position, p->n, 3);
        if (status >= 0) cli_wrote(run, path);
    }
    return status;
}

static loxo_status sample_main(cli_run *run, void *state)
{
    sample_state *s = state;
    cli_sources starts = {0};
    samples p = {0};
    loxo_soup soup = {0};
    loxo_mesh *mesh = NULL;
    loxo_mesh_info info = {0};
    cli_method method;
    int64_t count = 0;
    loxo_status status = check(run, &count);
    if (status >= 0) status = cli_method_by_options(run, &s->geodesic, &method);
    if (status < 0) return status;
    if (s->common.estimate) return estimate(run, s, count);
    if ((status = cli_read_mesh(run, run->args.operand[0], &soup)) < 0) return status;
    starts.n_vertices = soup.n_vertices;
    if ((status = cli_sources_read(run, &starts)) < 0) goto done;
    p.n = count;
    if (count > soup.n_vertices) {
        status = cli_fail(run, LOXO_ERR_ARGUMENT, "sample: %lld points of %lld vertices", (long long)count,
                          (long long)soup.n_vertices);
        goto done;
    }
    p.vertex = loxo_allocate(run->ctx, count, sizeof *p.vertex);
    p.radius = loxo_allocate(run->ctx, count, sizeof *p.radius);
    p.position = loxo_allocate(run->ctx, count, sizeof *p.position);
    status = LOXO_ERR_MEMORY;
    if (p.vertex == NULL || p.radius == NULL || p.position == NULL) goto done;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    if ((status = loxo_mesh_create(run->ctx, &arrays, LOXO_BORROW, &s->mesh, &info, &mesh)) < 0) goto done;
    (void)cli_combine(run, status);
    status = cli_method_by_mesh(run, &method, mesh, whole_solves(count), &s->geodesic, NULL, NULL);
    if (status < 0 || (status = solve(run, s, mesh, &starts, &p)) < 0) goto done;
    take_positions(&soup, &p);
    tell(run, &p);
    status = write_files(run, &p);
done:
    cli_sources_destroy(run, &starts);
    loxo_release(run->ctx, p.vertex);
    loxo_release(run->ctx, p.radius);
    loxo_release(run->ctx, p.position);
    loxo_mesh_destroy(mesh);
    loxo_soup_destroy(run->ctx, &soup);
    return status;
}

static const cli_flag sample_flags[] = {
    {.name = "count", .letter = 'n', .values = "N", .n_values = 1, .help = "points, those to start from included"},
    {.name = "source",
     .letter = 's',
     .values = "V,..",
     .n_values = 1,
     .repeats = true,
     .help = "vertices to start from, from 0 [0]"},
    {.name = "sources",
     .values = "FILE",
     .n_values = 1,
     .repeats = true,
     .reads = true,
     .help = "the same from a file"},
    {.name = "output",
     .letter = 'o',
     .values = "FILE",
     .n_values = 1,
     .repeats = true,
     .help = "x,y,z a row: .csv .npy; vertex numbers: .txt"},
    {.name = NULL},
};
static const cli_group sample_groups[] = {
    {"geodesic", loxo_geodesic_options, offsetof(sample_state, geodesic)},
    {"mesh", loxo_mesh_options, offsetof(sample_state, mesh)},
    {.title = NULL},
};

static const cli_need sample_needs[] = {
    {"nearest", NULL}, {"check-gradient-share", NULL}, {"check-breach", NULL}, {"check-estimate", NULL}, {NULL, NULL}};

const cli_command command_sample = {
    .name = "sample",
    .operands = "MESH --count N -o FILE [options]",
    .summary = "vertices spread evenly over the surface, each the farthest from those before",
    .about =
        "Farthest point sampling by geodesic distance. What is written can be read as sources of `loxo geodesic`:\n"
        "--sources FILE.txt or --source-points FILE.csv.\n",
    .examples = "  loxo sample bunny.off --count 100 -o points.csv\n"
                "  loxo sample bunny.off --count 100 -s 17 -o vertices.txt --json report.json\n",
    .min_operands = 1,
    .max_operands = 1,
    .flags = sample_flags,
    .groups = sample_groups,
    .needs = sample_needs,
    .state_bytes = sizeof(sample_state),
    .defaults = set_defaults,
    .main = sample_main,
};
