/* SPDX-License-Identifier: MIT */
#include "queries.h"

#include "base/os.h"

#include <math.h>
#include <string.h>

#define MOST_LEVELS   10000
#define N_DEFAULT     10 /* lines where no level is given */
#define MOST_TOLD     4  /* paths, for people; all of them stand in the JSON */
#define MOST_FIELDS_N 3

static bool ends_in(const char *path, const char *suffix)
{
    const size_t n = strlen(path), n_suffix = strlen(suffix);
    return n >= n_suffix && strcmp(path + n - n_suffix, suffix) == 0;
}

/* One of the suffixes, or standard output. */
static loxo_status check_file(cli_run *run, const char *flag, const char *const suffix[MOST_FIELDS_N],
                              const char **path)
{
    *path = cli_args_value(&run->args, flag, 0);
    if (*path == NULL) return LOXO_OK;
    bool is_known = strcmp(*path, "-") == 0;
    for (int i = 0; i < MOST_FIELDS_N && suffix[i] != NULL; ++i)
        is_known = is_known || ends_in(*path, suffix[i]);
    if (!is_known)
        return cli_fail(run, LOXO_ERR_UNSUPPORTED, "geodesic: --%s writes %s, %s%s%s, not '%s'", flag, suffix[0],
                        suffix[1], suffix[2] != NULL ? ", " : "", suffix[2] != NULL ? suffix[2] : "", *path);
    return cli_output(run, *path);
}

/* A target: one whole number, or three numbers. */
static int parse_target(const char *text, int64_t *vertex, double position[3])
{
    if (cli_parse_integer(text, strlen(text), vertex)) return 1;
    return cli_parse_numbers(text, position, 3) == 3 ? 3 : 0;
}

/* All values of --level into level [MOST_LEVELS]; how many, or -1 and the failure. */
static int64_t parse_levels(cli_run *run, double *level)
{
    const char *text;
    int64_t n = 0;
    for (int cursor = 0; (text = cli_args_next(&run->args, "level", &cursor)) != NULL;) {
        const int n_more = cli_parse_numbers(text, level + n, (int)(MOST_LEVELS - n));
        bool is_good = n_more > 0;
        for (int i = 0; i < n_more; ++i)
            is_good = is_good && level[n + i] >= 0.0;
        if (!is_good) {
            (void)cli_fail(run, LOXO_ERR_ARGUMENT,
                           "geodesic: --level takes distances from 0 on with commas, %d at most, not '%.60s'",
                           MOST_LEVELS, text);
            return -1;
        }
        n += n_more;
    }
    return n;
}

static loxo_status check_levels(cli_run *run)
{
    double *level = loxo_allocate(run->ctx, MOST_LEVELS, sizeof *level);
    if (level == NULL) return LOXO_ERR_MEMORY;
    const int64_t n = parse_levels(run, level);
    loxo_release(run->ctx, level);
    return n < 0 ? LOXO_ERR_ARGUMENT : LOXO_OK;
}

loxo_status cli_queries_check(cli_run *run, cli_queries *queries)
{
    static const char *const fields[MOST_FIELDS_N] = {".npy", ".csv", ".gii"};
    static const char *const lines[MOST_FIELDS_N] = {".obj", ".vtp", ".csv"};
    static const char *const matrices[MOST_FIELDS_N] = {".npy", ".csv", NULL};
    const cli_args *args = &run->args;
    const char *text;
    double number[3];
    int64_t vertex;
    loxo_status status;
    if ((status = check_file(run, "nearest-output", fields, &queries->nearest_path)) < 0) return status;
    if ((status = check_file(run, "lines-output", lines, &queries->lines_path)) < 0) return status;
    if ((status = check_file(run, "path-output", lines, &queries->path_path)) < 0) return status;
    if ((status = check_file(run, "matrix", matrices, &queries->matrix_path)) < 0) return status;
    if ((status = check_levels(run)) < 0) return status;
    if (cli_args_has(args, "level") && queries->lines_path == NULL)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "geodesic: --level is for --lines-output");
    for (int cursor = 0; (text = cli_args_next(args, "path", &cursor)) != NULL;)
        if (parse_target(text, &vertex, number) == 0)
            return cli_fail(run, LOXO_ERR_ARGUMENT, "geodesic: --path takes a vertex number or x,y,z, not '%s'", text);
    if (queries->path_path != NULL && !cli_args_has(args, "path"))
        return cli_fail(run, LOXO_ERR_ARGUMENT, "geodesic: --path-output needs a --path");
    return LOXO_OK;
}

bool cli_queries_any(const cli_run *run)
{
    static const char *const flags[] = {"nearest-output", "lines-output", "path", "matrix"};
    for (int i = 0; i < 4; ++i)
        if (cli_args_has(&run->args, flags[i])) return true;
    return false;
}

/* ---- before the solve ---------------------------------------------------------------------------------------- */

static loxo_status list_levels(cli_run *run, cli_queries *queries)
{
    queries->level = loxo_allocate(run->ctx, MOST_LEVELS, sizeof *queries->level);
    if (queries->level == NULL) return LOXO_ERR_MEMORY;
    queries->n_levels = parse_levels(run, queries->level);
    return queries->n_levels < 0 ? LOXO_ERR_ARGUMENT : LOXO_OK;
}

static loxo_status list_targets(cli_run *run, const loxo_mesh *surface, cli_queries *queries)
{
    const int64_t n_vertices = loxo_mesh_n_vertices(surface);
    const char *text;
    int64_t n = 0;
    for (int cursor = 0; cli_args_next(&run->args, "path", &cursor) != NULL;)
        ++n;
    if (n == 0) return LOXO_OK;
    queries->target = loxo_allocate(run->ctx, n, sizeof *queries->target);
    if (queries->target == NULL) return LOXO_ERR_MEMORY;
    for (int cursor = 0; (text = cli_args_next(&run->args, "path", &cursor)) != NULL;) {
        loxo_surface_point *target = &queries->target[queries->n_targets++];
        double position[1][3];
        int64_t vertex = -1;
        loxo_status status = LOXO_OK;
        if (parse_target(text, &vertex, position[0]) == 3)
            status = loxo_mesh_nearest_points(surface, 1, (const double(*)[3])position, target, NULL);
        else if (vertex < 0 || vertex >= n_vertices)
            status = cli_fail(run, LOXO_ERR_ARGUMENT, "geodesic: --path %s is not in 0..%lld", text,
                              (long long)n_vertices - 1);
        else
            *target = (loxo_surface_point){{(loxo_index)vertex, -1, -1}, {1.0, 0.0, 0.0}};
        if (status < 0) return status;
    }
    return LOXO_OK;
}

loxo_status cli_queries_prepare(cli_run *run, const loxo_mesh *surface, const cli_sources *sources,
                                cli_queries *queries)
{
    loxo_status status = queries->lines_path != NULL ? list_levels(run, queries) : LOXO_OK;
    if (status >= 0) status = list_targets(run, surface, queries);
    if (status < 0 || queries->matrix_path == NULL) return status;
    queries->n_matrix = sources->n;
    queries->matrix = loxo_allocate(run->ctx, sources->n * sources->n, sizeof *queries->matrix);
    return queries->matrix != NULL ? LOXO_OK : LOXO_ERR_MEMORY;
}

/* ---- nearest sources ----------------------------------------------------------------------------------------- */

static loxo_status ask_nearest(cli_run *run, const loxo_geodesic *geodesic, int64_t n, cli_queries *queries)
{
    loxo_index *source = loxo_allocate(run->ctx, n, sizeof *source);
    queries->nearest = loxo_allocate(run->ctx, n, sizeof *queries->nearest);
    loxo_status status = source == NULL || queries->nearest == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    if (status >= 0) status = loxo_geodesic_nearest(geodesic, source);
    for (int64_t v = 0; v < n && status >= 0; ++v)
        queries->nearest[v] = (double)source[v];
    loxo_release(run->ctx, source);
    return status;
}

/* ---- isolines ------------------------------------------------------------------------------------------------ */

/* Levels that cut no face make no line: where they were asked for, that is worth a warning. */
static void warn_of_empty_levels(cli_run *run, const cli_queries *queries)
{
    int64_t n_empty = 0;
    for (int64_t i = 0; i < queries->n_levels; ++i) {
        bool is_cut = false;
        for (int64_t k = 0; k < queries->isolines.n_lines && !is_cut; ++k)
            is_cut = queries->isolines.value[k] == queries->level[i];
        n_empty += !is_cut;
    }
    if (n_empty > 0)
        cli_warn(run, n_empty, "%lld of %lld levels meet no face", (long long)n_empty, (long long)queries->n_levels);
}

static loxo_status ask_isolines(cli_run *run, const loxo_mesh *surface, const double *distance, double farthest,
                                cli_queries *queries)
{
    const bool is_given = queries->n_levels > 0;
    double length = 0.0;
    int64_t n_closed = 0;
    for (; !is_given && queries->n_levels < N_DEFAULT;
         ++queries->n_levels) /* they cut the way to the farthest evenly */
        queries->level[queries->n_levels] = farthest * (double)(queries->n_levels + 1) / (double)(N_DEFAULT + 1);
    const int64_t n = queries->n_levels;
    const loxo_status status = loxo_isolines(run->ctx, surface, distance, queries->level, n, &queries->isolines);
    if (status < 0) return status;
    if (is_given) warn_of_empty_levels(run, queries);
    json_t *list = json_put_array(run->report.json, "isolines");
    for (int64_t i = 0; i < queries->isolines.n_lines; ++i) {
        const double own = loxo_polyline_length(&queries->isolines, i);
        json_t *entry = json_object();
        json_put_number(entry, "level", queries->isolines.value[i]);
        json_put_number(entry, "length", own);
        json_put_bool(entry, "is_closed", queries->isolines.is_closed[i]);
        json_append(list, entry);
        length += own;
        n_closed += queries->isolines.is_closed[i];
    }
    report_row(&run->report, "isolines", "%s at %s levels, %s closed, %.6g long together",
               text_count(queries->isolines.n_lines), text_count(n), text_count(n_closed), length);
    return LOXO_OK;
}

/* ---- paths --------------------------------------------------------------------------------------------------- */

/* Why a target has no way. */
typedef enum missing_way { IS_REACHED, IS_ELSEWHERE, IS_BEYOND, HAS_NO_FACE, N_MISSING } missing_way;

static const char *const missing_text[N_MISSING] = {
    [IS_REACHED] = "",
    [IS_ELSEWHERE] = "on another piece of the surface than every source",
    [IS_BEYOND] = "beyond --max-distance",
    [HAS_NO_FACE] = "in no face",
};

static bool has_way(const loxo_polylines *paths, int64_t i) { return paths->line_begin[i + 1] > paths->line_begin[i]; }

static loxo_index component_of(const loxo_index *component, const loxo_surface_point *point)
{
    for (int k = 0; k < 3; ++k)
        if (point->vertex[k] >= 0) return component[point->vertex[k]];
    return -1;
}

static missing_way why_missing(const cli_run *run, const loxo_index *component, const loxo_surface_point *target,
                               const cli_sources *sources)
{
    const loxo_index own = component_of(component, target);
    if (own < 0) return HAS_NO_FACE;
    if (!cli_args_has_option(&run->args, loxo_options_find(loxo_geodesic_options, "max-distance"))) return IS_ELSEWHERE;
    for (int64_t i = 0; i < sources->n; ++i)
        if (component_of(component, &sources->point[i]) == own) return IS_BEYOND;
    return IS_ELSEWHERE;
}

/* why [n_targets] out. Pieces of the surface are looked for only where a way is missing. */
static loxo_status explain_missing(cli_run *run, const loxo_mesh *surface, const cli_sources *sources,
                                   const cli_queries *queries, missing_way *why)
{
    loxo_index *component = NULL;
    loxo_status status = LOXO_OK;
    for (int64_t i = 0; i < queries->n_targets && status >= 0; ++i) {
        why[i] = IS_REACHED;
        if (has_way(&queries->paths, i)) continue;
        if (component == NULL) {
            component = loxo_allocate(run->ctx, loxo_mesh_n_vertices(surface), sizeof *component);
            status = component != NULL ? loxo_mesh_components(surface, component, NULL) : LOXO_ERR_MEMORY;
        }
        if (status >= 0) why[i] = why_missing(run, component, &queries->target[i], sources);
    }
    loxo_release(run->ctx, component);
    return status;
}

/* One warning a reason, with the first target that it holds for. */
static void warn_of_missing(cli_run *run, int64_t n_targets, const missing_way *why)
{
    const char *text, *first[N_MISSING] = {NULL};
    int64_t count[N_MISSING] = {0}, i = 0;
    for (int cursor = 0; i < n_targets && (text = cli_args_next(&run->args, "path", &cursor)) != NULL; ++i)
        if (count[why[i]]++ == 0) first[why[i]] = text;
    for (int k = IS_REACHED + 1; k < N_MISSING; ++k)
        if (count[k] == 1)
            cli_warn(run, 1, "--path %s is not reached: it is %s", first[k], missing_text[k]);
        else if (count[k] > 1)
            cli_warn(run, count[k], "--path %s and %lld more are not reached: they are %s", first[k],
                     (long long)count[k] - 1, missing_text[k]);
}

static void tell_paths(cli_run *run, const loxo_polylines *paths, const missing_way *why)
{
    json_t *list = json_put_array(run->report.json, "paths");
    const char *text;
    int64_t i = 0;
    for (int cursor = 0; (text = cli_args_next(&run->args, "path", &cursor)) != NULL; ++i) {
        const bool is_there = why[i] == IS_REACHED;
        const double length = is_there ? loxo_polyline_length(paths, i) : (double)INFINITY;
        json_t *entry = json_object();
        json_put_text(entry, "from", text);
        json_put_bool(entry, "is_reached", is_there);
        if (!is_there) json_put_text(entry, "reason", missing_text[why[i]]);
        json_put_number(entry, "length", length);
        json_put_number(entry, "distance", paths->value[i]);
        json_put_integer(entry, "n_points", paths->line_begin[i + 1] - paths->line_begin[i]);
        json_append(list, entry);
        if (i < MOST_TOLD && is_there)
            report_row(&run->report, "path", "from %s: %.6g long, distance %.6g", text, length, paths->value[i]);
        else if (i < MOST_TOLD)
            report_row(&run->report, "path", "from %s: none, it is %s", text, missing_text[why[i]]);
    }
}

static loxo_status ask_paths(cli_run *run, loxo_geodesic *geodesic, const loxo_mesh *surface,
                             const cli_sources *sources, const double *distance, cli_queries *queries)
{
    const loxo_surface_point *target = queries->target;
    const int64_t n = queries->n_targets;
    missing_way *why = loxo_allocate(run->ctx, n, sizeof *why);
    if (why == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_geodesic_paths(geodesic, target, n, &queries->paths);
    if (status == LOXO_ERR_UNSUPPORTED) /* of an intrinsic triangulation */
        status =
            loxo_geodesic_trace(run->ctx, surface, distance, sources->point, sources->n, target, n, &queries->paths);
    if (status >= 0) status = explain_missing(run, surface, sources, queries, why);
    if (status >= 0) {
        warn_of_missing(run, n, why);
        tell_paths(run, &queries->paths, why);
    }
    loxo_release(run->ctx, why);
    return status;
}

/* ---- matrices ------------------------------------------------------------------------------------------------ */

static loxo_status ask_matrix(cli_run *run, loxo_geodesic *geodesic, const cli_sources *sources, cli_queries *queries)
{
    const int64_t n = queries->n_matrix;
    const double start_s = loxo_os_clock_s();
    double asymmetry = 0.0, largest = 0.0;
    const loxo_status status = loxo_geodesic_matrix(geodesic, sources->point, n, queries->matrix);
    if (status < 0) return status;
    queries->is_matrix_there = true;
    for (int64_t i = 0; i < n; ++i)
        for (int64_t j = 0; j < i; ++j) {
            const double a = queries->matrix[i * n + j], b = queries->matrix[j * n + i];
            if (!isfinite(a) || !isfinite(b)) continue;
            asymmetry = fmax(asymmetry, fabs(a - b));
            largest = fmax(largest, fmax(a, b));
        }
    json_t *entry = json_object();
    json_put_integer(entry, "n", n);
    json_put_number(entry, "largest", largest);
    json_put_number(entry, "asymmetry", asymmetry);
    json_object_set_new(run->report.json, "matrix", entry);
    report_row(&run->report, "matrix", "%s solves, largest %.6g, asymmetric by %.3g at most", text_count(n), largest,
               asymmetry);
    (void)cli_seconds(run, "matrix", start_s);
    return cli_combine(run, status);
}

/* ---- together ------------------------------------------------------------------------------------------------ */

loxo_status cli_queries_ask(cli_run *run, loxo_geodesic *geodesic, const loxo_mesh *surface, const cli_sources *sources,
                            const double *distance, double farthest, cli_queries *queries)
{
    loxo_status status = LOXO_OK;
    if (queries->nearest_path != NULL) status = ask_nearest(run, geodesic, loxo_mesh_n_vertices(surface), queries);
    if (status >= 0 && queries->lines_path != NULL) status = ask_isolines(run, surface, distance, farthest, queries);
    if (status >= 0 && cli_args_has(&run->args, "path"))
        status = ask_paths(run, geodesic, surface, sources, distance, queries);
    if (status >= 0 && queries->matrix_path != NULL) status = ask_matrix(run, geodesic, sources, queries);
    return status;
}

loxo_status cli_queries_write(cli_run *run, const loxo_mesh *surface, const cli_queries *queries)
{
    loxo_status status = LOXO_OK;
    if (queries->nearest != NULL) {
        status = loxo_write_field(run->ctx, queries->nearest_path, "nearest", queries->nearest,
                                  loxo_mesh_n_vertices(surface), NULL);
        if (status >= 0) cli_wrote(run, queries->nearest_path);
    }
    if (status >= 0 && queries->isolines.line_begin != NULL) {
        status = loxo_write_polylines(run->ctx, queries->lines_path, &queries->isolines);
        if (status >= 0) cli_wrote(run, queries->lines_path);
    }
    if (status >= 0 && queries->path_path != NULL && queries->paths.line_begin != NULL) {
        status = loxo_write_polylines(run->ctx, queries->path_path, &queries->paths);
        if (status >= 0) cli_wrote(run, queries->path_path);
    }
    if (status >= 0 && queries->is_matrix_there) {
        status =
            loxo_write_matrix(run->ctx, queries->matrix_path, queries->matrix, queries->n_matrix, queries->n_matrix);
        if (status >= 0) cli_wrote(run, queries->matrix_path);
    }
    return status;
}

void cli_queries_destroy(cli_run *run, cli_queries *queries)
{
    loxo_release(run->ctx, queries->nearest);
    loxo_release(run->ctx, queries->matrix);
    loxo_release(run->ctx, queries->level);
    loxo_release(run->ctx, queries->target);
    loxo_polylines_destroy(run->ctx, &queries->isolines);
    loxo_polylines_destroy(run->ctx, &queries->paths);
    *queries = (cli_queries){0};
}
