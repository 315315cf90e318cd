/* SPDX-License-Identifier: MIT */
#include "sources.h"

#include <math.h>
#include <string.h>

#define MOST_SHOWN 1024 /* of the sources in the report */
#define MOST_ROWS  4    /* for people, of the points */

static loxo_surface_point at_vertex(loxo_index vertex)
{
    return (loxo_surface_point){{vertex, -1, -1}, {1.0, 0.0, 0.0}};
}

static loxo_status make_room(cli_run *run, cli_sources *sources, int64_t n_more)
{
    if (sources->n + n_more <= sources->capacity) return LOXO_OK;
    const int64_t capacity = 2 * (sources->n + n_more) + 16;
    loxo_surface_point *bigger = loxo_allocate(run->ctx, capacity, sizeof *bigger);
    if (bigger == NULL) return LOXO_ERR_MEMORY;
    if (sources->n > 0) memcpy(bigger, sources->point, (size_t)sources->n * sizeof *bigger);
    loxo_release(run->ctx, sources->point);
    sources->point = bigger;
    sources->capacity = capacity;
    return LOXO_OK;
}

/* Numbers of one -s: commas between them, nothing else; cli_sources_check has seen that they are numbers. */
static loxo_status add_list(cli_run *run, cli_sources *sources, const char *text)
{
    for (;; ++text) {
        int64_t vertex = -1;
        const size_t n = strcspn(text, ",");
        (void)cli_parse_integer(text, n, &vertex);
        if (vertex < 0 || vertex >= sources->n_vertices)
            return cli_fail(run, LOXO_ERR_ARGUMENT, "source %.*s is not in 0..%lld", (int)(n < 60 ? n : 60), text,
                            (long long)sources->n_vertices - 1);
        if (make_room(run, sources, 1) < 0) return LOXO_ERR_MEMORY;
        sources->point[sources->n++] = at_vertex((loxo_index)vertex);
        text += n;
        if (*text == '\0') return LOXO_OK;
    }
}

static loxo_status add_file(cli_run *run, cli_sources *sources, const char *path)
{
    loxo_index *vertex = NULL;
    int64_t n = 0;
    loxo_status status = loxo_read_vertices(run->ctx, path, sources->n_vertices, &vertex, &n);
    if (status >= 0) status = make_room(run, sources, n);
    for (int64_t i = 0; i < n && status >= 0; ++i)
        sources->point[sources->n++] = at_vertex(vertex[i]);
    loxo_release(run->ctx, vertex);
    return status;
}

loxo_status cli_sources_check(cli_run *run)
{
    const cli_args *args = &run->args;
    const char *text;
    int64_t vertex;
    double point[3];
    if (!cli_args_has(args, "source") && !cli_args_has(args, "sources") && !cli_args_has(args, "source-point") &&
        !cli_args_has(args, "source-points"))
        return cli_fail(run, LOXO_ERR_ARGUMENT,
                        "geodesic: no source; give -s, --sources, --source-point or --source-points");
    for (int cursor = 0; (text = cli_args_next(args, "source", &cursor)) != NULL;) {
        for (const char *at = text;; ++at) {
            const size_t n = strcspn(at, ",");
            if (!cli_parse_integer(at, n, &vertex))
                return cli_fail(run, LOXO_ERR_ARGUMENT, "geodesic: -s takes vertex numbers with commas, not '%s'",
                                text);
            at += n;
            if (*at == '\0') break;
        }
    }
    for (int cursor = 0; (text = cli_args_next(args, "source-point", &cursor)) != NULL;)
        if (cli_parse_numbers(text, point, 3) != 3)
            return cli_fail(run, LOXO_ERR_ARGUMENT, "geodesic: --source-point takes x,y,z, not '%s'", text);
    return LOXO_OK;
}

loxo_status cli_sources_read(cli_run *run, cli_sources *sources)
{
    const char *text;
    int cursor = 0;
    loxo_status status = LOXO_OK;
    while (status >= 0 && (text = cli_args_next(&run->args, "source", &cursor)) != NULL)
        status = add_list(run, sources, text);
    cursor = 0;
    while (status >= 0 && (text = cli_args_next(&run->args, "sources", &cursor)) != NULL)
        status = add_file(run, sources, text);
    return status;
}

/* ---- positions ----------------------------------------------------------------------------------------------- */

static loxo_surface_point heaviest_corner(const loxo_surface_point *point)
{
    int best = 0;
    for (int k = 1; k < 3; ++k)
        if (point->vertex[k] >= 0 && (point->vertex[best] < 0 || point->weight[k] > point->weight[best])) best = k;
    return at_vertex(point->vertex[best]);
}

static int corners_of(const loxo_surface_point *point)
{
    return (point->vertex[0] >= 0) + (point->vertex[1] >= 0) + (point->vertex[2] >= 0);
}

static json_t *point_to_json(const loxo_surface_point *point)
{
    json_t *entry = json_object(), *vertex = json_put_array(entry, "vertex"), *weight = json_put_array(entry, "weight");
    for (int k = 0; k < 3; ++k) {
        if (point->vertex[k] < 0) continue;
        json_append(vertex, json_integer(point->vertex[k]));
        json_append(weight, json_real(point->weight[k]));
    }
    return entry;
}

static void tell_point(cli_run *run, const double position[3], const loxo_surface_point *point, double away, int64_t i,
                       json_t *list)
{
    static const char *const kinds[] = {"", "vertex ", "on edge ", "in face "};
    char corners[96] = "";
    size_t used = 0;
    for (int k = 0; k < 3; ++k)
        if (point->vertex[k] >= 0 && used < sizeof corners)
            used += (size_t)snprintf(corners + used, sizeof corners - used, "%s%lld", used > 0 ? " " : "",
                                     (long long)point->vertex[k]);
    if (i < MOST_ROWS)
        report_row(&run->report, "nearest", "%s%s to %.6g,%.6g,%.6g, %.6g away", kinds[corners_of(point)], corners,
                   position[0], position[1], position[2], away);
    if (i >= MOST_SHOWN) return;
    json_t *entry = point_to_json(point);
    json_put_number(entry, "away", away);
    json_append(list, entry);
}

/* Finds and tells; position [n][3]. */
static loxo_status locate(cli_run *run, const loxo_mesh *mesh, cli_sources *sources, int64_t n,
                          const double (*position)[3], json_t *list)
{
    double *away = loxo_allocate(run->ctx, n, sizeof *away), largest = 0.0;
    loxo_status status = away == NULL ? LOXO_ERR_MEMORY : make_room(run, sources, n);
    loxo_surface_point *point = status >= 0 ? &sources->point[sources->n] : NULL;
    if (status >= 0) status = loxo_mesh_nearest_points(mesh, n, position, point, away);
    for (int64_t i = 0; i < n && status >= 0; ++i) {
        largest = fmax(largest, away[i]);
        tell_point(run, position[i], &point[i], away[i], i, list);
    }
    if (status >= 0) sources->n += n;
    if (status >= 0 && n > MOST_ROWS)
        report_row(&run->report, "nearest", "%s points, %.6g away at most", text_count(n), largest);
    loxo_release(run->ctx, away);
    return status;
}

static loxo_status locate_file(cli_run *run, const loxo_mesh *mesh, cli_sources *sources, const char *path,
                               json_t *list)
{
    double *position = NULL;
    int64_t n = 0;
    loxo_status status = loxo_read_points(run->ctx, path, &position, &n);
    if (status >= 0) status = locate(run, mesh, sources, n, (const double(*)[3])(const void *)position, list);
    loxo_release(run->ctx, position);
    return status;
}

loxo_status cli_sources_locate(cli_run *run, const loxo_mesh *mesh, cli_sources *sources)
{
    const cli_args *args = &run->args;
    const bool has_positions = cli_args_has(args, "source-point") || cli_args_has(args, "source-points");
    json_t *found = has_positions ? json_put_array(run->report.json, "source_points") : NULL;
    const char *text;
    int cursor = 0;
    loxo_status status = LOXO_OK;
    while (status >= 0 && (text = cli_args_next(args, "source-point", &cursor)) != NULL) {
        double position[1][3];
        (void)cli_parse_numbers(text, position[0], 3); /* cli_sources_check has seen that they are three */
        status = locate(run, mesh, sources, 1, (const double(*)[3])position, found);
    }
    cursor = 0;
    while (status >= 0 && (text = cli_args_next(args, "source-points", &cursor)) != NULL)
        status = locate_file(run, mesh, sources, text, found);
    if (status < 0) return status;
    json_t *list = json_put_array(run->report.json, "sources");
    sources->at_vertices = true;
    for (int64_t i = 0; i < sources->n; ++i) {
        const loxo_surface_point *p = &sources->point[i];
        const int n_corners = corners_of(p);
        sources->at_vertices = sources->at_vertices && n_corners == 1;
        if (i < MOST_SHOWN)
            json_append(list, n_corners > 1 ? point_to_json(p) : json_integer(heaviest_corner(p).vertex[0]));
    }
    return LOXO_OK;
}

loxo_status cli_sources_solve(cli_run *run, const cli_sources *sources, loxo_geodesic *geodesic, double *distance,
                              loxo_geodesic_info *info)
{
    if (!sources->at_vertices) return loxo_geodesic_solve_points(geodesic, sources->point, sources->n, distance, info);
    loxo_index *vertex = loxo_allocate(run->ctx, sources->n, sizeof *vertex);
    if (vertex == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < sources->n; ++i)
        vertex[i] = heaviest_corner(&sources->point[i]).vertex[0];
    const loxo_status status = loxo_geodesic_solve(geodesic, vertex, sources->n, distance, info);
    loxo_release(run->ctx, vertex);
    return status;
}

void cli_sources_destroy(cli_run *run, cli_sources *sources)
{
    loxo_release(run->ctx, sources->point);
    *sources = (cli_sources){0};
}
