/* SPDX-License-Identifier: MIT */
#include "sources.h"

#include "base/os.h"

#include <math.h>
#include <string.h>

static const char blanks[] = ", \t\r\n";

/* Where a number stands, for messages. */
typedef struct place {
    const char *file; /* NULL: the command line */
    int64_t line;
} place;

static loxo_status grow(cli_run *run, cli_sources *sources)
{
    if (sources->n < sources->capacity) return LOXO_OK;
    const int64_t capacity = sources->capacity > 0 ? 2 * sources->capacity : 64;
    loxo_index *bigger = loxo_allocate(run->ctx, capacity, sizeof *bigger);
    if (bigger == NULL) return LOXO_ERR_MEMORY;
    if (sources->n > 0) memcpy(bigger, sources->vertex, (size_t)sources->n * sizeof *bigger);
    loxo_release(run->ctx, sources->vertex);
    sources->vertex = bigger;
    sources->capacity = capacity;
    return LOXO_OK;
}

static loxo_status add(cli_run *run, cli_sources *sources, const char *word, size_t n_word, place at)
{
    int64_t vertex = -1;
    const int shown = n_word < 60 ? (int)n_word : 60;
    const char *file = at.file != NULL ? at.file : "";
    /* A wrong word on the command line is wrong usage; in a file it is malformed input. */
    const loxo_status status = at.file != NULL ? LOXO_ERR_MALFORMED : LOXO_ERR_ARGUMENT;
    if (!cli_parse_integer(word, n_word, &vertex))
        return cli_fail_at(run, status, file, at.line, "source '%.*s' is not a vertex number", shown, word);
    if (vertex < 0 || vertex >= sources->n_vertices)
        return cli_fail_at(run, LOXO_ERR_ARGUMENT, file, at.line, "source %lld is not in 0..%lld", (long long)vertex,
                           (long long)sources->n_vertices - 1);
    if (grow(run, sources) < 0) return LOXO_ERR_MEMORY;
    sources->vertex[sources->n++] = (loxo_index)vertex;
    return LOXO_OK;
}

/* Numbers of one -s: commas between them, nothing else. */
static loxo_status add_list(cli_run *run, cli_sources *sources, const char *text)
{
    for (;; ++text) {
        const size_t n = strcspn(text, ",");
        const loxo_status status = add(run, sources, text, n, (place){0});
        if (status < 0) return status;
        text += n;
        if (*text == '\0') return LOXO_OK;
    }
}

/* Numbers of a file: blanks, commas or lines between them, comments from # to the end of the line. */
static loxo_status add_text(cli_run *run, cli_sources *sources, const char *file, const char *text, size_t n_text)
{
    place at = {file, 1};
    for (size_t i = 0; i < n_text;) {
        if (text[i] == '#') {
            while (i < n_text && text[i] != '\n')
                ++i;
        } else if (memchr(blanks, text[i], sizeof blanks - 1) != NULL) {
            at.line += text[i++] == '\n';
        } else {
            const size_t begin = i;
            while (i < n_text && text[i] != '#' && memchr(blanks, text[i], sizeof blanks - 1) == NULL)
                ++i;
            const loxo_status status = add(run, sources, text + begin, i - begin, at);
            if (status < 0) return status;
        }
    }
    return LOXO_OK;
}

/* Everything that a file or stream has; *text comes from loxo_allocate. */
static loxo_status read_all(cli_run *run, const char *path, char **text, size_t *n_text)
{
    loxo_os_file file;
    size_t capacity = (size_t)1 << 16, got = 0;
    loxo_status status = loxo_os_open(run->ctx, path, &file);
    *text = NULL;
    *n_text = 0;
    if (status < 0) return status;
    do {
        char *bigger = loxo_allocate(run->ctx, (int64_t)capacity, 1);
        status = bigger != NULL ? LOXO_OK : LOXO_ERR_MEMORY;
        if (status < 0) break;
        if (*n_text > 0) memcpy(bigger, *text, *n_text);
        loxo_release(run->ctx, *text);
        *text = bigger;
        status = loxo_os_read(run->ctx, &file, *text + *n_text, capacity - *n_text, &got);
        *n_text += got;
        capacity *= 2;
    } while (status >= 0 && *n_text == capacity / 2);
    loxo_os_close(&file);
    return status;
}

static loxo_status add_file(cli_run *run, cli_sources *sources, const char *path)
{
    char *text = NULL;
    size_t n_text = 0;
    const int64_t before = sources->n;
    loxo_status status = read_all(run, path, &text, &n_text);
    if (status >= 0) status = add_text(run, sources, path, text, n_text);
    if (status >= 0 && sources->n == before) status = cli_fail_at(run, LOXO_ERR_MALFORMED, path, 0, "no source in it");
    loxo_release(run->ctx, text);
    return status;
}

loxo_status cli_sources_check(cli_run *run)
{
    const cli_args *args = &run->args;
    const char *text;
    int64_t vertex;
    double point[3];
    if (!cli_args_has(args, "source") && !cli_args_has(args, "sources") && !cli_args_has(args, "source-point"))
        return cli_fail(run, LOXO_ERR_ARGUMENT, "geodesic: no source; give -s, --sources or --source-point");
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

static double distance_squared(const loxo_mesh_view *mesh, int64_t v, const double *point)
{
    double sum = 0.0;
    for (int k = 0; k < 3; ++k) {
        const double x = mesh->position != NULL ? mesh->position[v][k] : (double)mesh->position_float[v][k];
        sum += (x - point[k]) * (x - point[k]);
    }
    return sum;
}

static int64_t origin_of(const loxo_mesh_view *mesh, int64_t v)
{
    return mesh->vertex_origin != NULL ? mesh->vertex_origin[v] : v;
}

/* Of equally near ones the caller's lowest number, whatever order the mesh took. */
static int64_t nearest_vertex(const loxo_mesh_view *mesh, const double *point)
{
    int64_t best = -1;
    double best_squared = INFINITY; /* so far off that the square overflows: no answer */
    for (int64_t v = 0; v < mesh->n_vertices; ++v) {
        if (mesh->vertex_halfedge[v] < 0) continue;
        const double squared = distance_squared(mesh, v, point);
        const bool ties = best >= 0 && squared == best_squared && origin_of(mesh, v) < origin_of(mesh, best);
        if (!(squared < best_squared) && !ties) continue;
        best = v;
        best_squared = squared;
    }
    return best;
}

loxo_status cli_sources_nearest(cli_run *run, const loxo_mesh_view *mesh, cli_sources *sources)
{
    const char *text;
    int cursor = 0;
    json_t *found = NULL;
    while ((text = cli_args_next(&run->args, "source-point", &cursor)) != NULL) {
        double point[3];
        (void)cli_parse_numbers(text, point, 3); /* cli_sources_check has seen that they are three */
        const int64_t v = nearest_vertex(mesh, point);
        if (v < 0) return cli_fail(run, LOXO_ERR_MESH, "no vertex with a face is near %s", text);
        if (grow(run, sources) < 0) return LOXO_ERR_MEMORY;
        const int64_t vertex = origin_of(mesh, v);
        const double away = sqrt(distance_squared(mesh, v, point));
        sources->vertex[sources->n++] = (loxo_index)vertex;
        report_row(&run->report, "nearest", "vertex %s to %s, %.6g away", text_count(vertex), text, away);
        if (found == NULL) found = json_put_array(run->report.json, "source_points");
        json_t *entry = json_object();
        json_put_integer(entry, "vertex", vertex);
        json_put_number(entry, "away", away);
        json_append(found, entry);
    }
    return LOXO_OK;
}

void cli_sources_destroy(cli_run *run, cli_sources *sources)
{
    loxo_release(run->ctx, sources->vertex);
    *sources = (cli_sources){0};
}
