/* SPDX-License-Identifier: MIT */
#include "extend_ball.h"

#include "base/os.h"
#include "estimate.h"

#include <math.h>
#include <string.h>

#define PIECES_AROUND 80.0 /* pieces of length 1 of the sphere around its centre */
#define PIECES_NEAR                                                                                                    \
    24.0 /* more for each halving of the distance to it; both measured on meshes of 12 and 2892 vertices */
#define LEAST_GAP 1e-16 /* 1 - |z| */

bool cli_is_table(const char *path)
{
    const size_t n = strlen(path);
    return n >= 4 && (strcmp(path + n - 4, ".csv") == 0 || strcmp(path + n - 4, ".npy") == 0);
}

loxo_status cli_values_create(cli_run *run, int64_t n, int d, loxo_extension_values *v)
{
    v->w = loxo_allocate(run->ctx, n * d, sizeof *v->w);
    v->co = loxo_allocate(run->ctx, n, sizeof *v->co);
    v->bound = loxo_allocate(run->ctx, n, sizeof *v->bound);
    v->error = loxo_allocate(run->ctx, n, sizeof *v->error);
    v->kind = loxo_allocate(run->ctx, n, sizeof *v->kind);
    return v->w == NULL || v->co == NULL || v->bound == NULL || v->error == NULL || v->kind == NULL ? LOXO_ERR_MEMORY
                                                                                                    : LOXO_OK;
}

void cli_values_destroy(cli_run *run, loxo_extension_values *v)
{
    loxo_release(run->ctx, v->w);
    loxo_release(run->ctx, v->co);
    loxo_release(run->ctx, v->bound);
    loxo_release(run->ctx, v->error);
    loxo_release(run->ctx, v->kind);
}

loxo_status cli_write_values(cli_run *run, int64_t n, int n_z, const double *z, int d, const loxo_extension_values *v)
{
    const char *path;
    const int64_t columns = n_z + d + 4;
    loxo_status status = LOXO_OK;
    double *table = loxo_allocate(run->ctx, n * columns, sizeof *table);
    if (table == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n; ++i) {
        double *row = table + i * columns, *more = row + n_z + d;
        for (int k = 0; k < n_z; ++k)
            row[k] = z[i * n_z + k];
        for (int k = 0; k < d; ++k)
            row[n_z + k] = v->w[i * d + k];
        more[0] = v->co[i];
        more[1] = v->bound[i];
        more[2] = v->error[i];
        more[3] = (double)v->kind[i];
    }
    for (int cursor = 0; status >= 0 && (path = cli_args_next(&run->args, "output", &cursor)) != NULL;) {
        if (!cli_is_table(path)) continue;
        status = loxo_write_matrix(run->ctx, path, table, n, columns);
        if (status >= 0) cli_wrote(run, path);
    }
    loxo_release(run->ctx, table);
    return status;
}

loxo_status cli_read_places(cli_run *run, const char *path, int n_z, double **z, double **co, int64_t *n)
{
    loxo_array array;
    loxo_status status = loxo_read_array(run->ctx, path, &array);
    if (status < 0) return status;
    const int64_t columns = array.n_dimensions == 2 ? array.shape[1] : 0, rows = array.shape[0];
    *n = rows;
    if (columns != n_z && columns != n_z + 1) {
        (void)cli_fail_at(run, LOXO_ERR_UNSUPPORTED, path, 0, "points are rows of %d numbers, or %d with 1 - |z|^2",
                          n_z, n_z + 1);
        status = LOXO_ERR_UNSUPPORTED;
        goto done;
    }
    *z = loxo_allocate(run->ctx, rows * n_z, sizeof **z);
    *co = columns > n_z ? loxo_allocate(run->ctx, rows, sizeof **co) : NULL;
    if (*z == NULL || (columns > n_z && *co == NULL)) status = LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < rows && status >= 0; ++i) {
        memcpy(*z + i * n_z, array.value + i * columns, (size_t)n_z * sizeof **z);
        if (columns > n_z) (*co)[i] = array.value[i * columns + n_z];
    }
done:
    loxo_array_destroy(run->ctx, &array);
    return status;
}

/* Positions as doubles; soup keeps its own. */
static loxo_status take_positions(cli_run *run, loxo_soup *soup, double **x)
{
    *x = soup->position;
    if (*x != NULL) {
        soup->position = NULL;
        return LOXO_OK;
    }
    if ((*x = loxo_allocate(run->ctx, 3 * soup->n_vertices, sizeof **x)) == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < 3 * soup->n_vertices; ++i)
        (*x)[i] = (double)soup->position_float[i];
    return LOXO_OK;
}

static void tell(cli_run *run, const loxo_sphere_extension_info *info)
{
    json_t *o = json_put_object(run->report.json, "extension");
    json_put_integer(o, "n_points", info->n_points);
    json_put_integer(o, "n_on_sphere", info->n_on_sphere);
    json_put_integer(o, "n_resting", info->n_resting);
    json_put_integer(o, "n_open", info->n_open);
    json_put_integer(o, "n_nodes", info->n_nodes);
    json_put_integer(o, "n_iterations", info->n_iterations);
    json_put_number(o, "bound_max", info->bound_max);
    json_put_number(o, "total_s", info->total_s);
    report_row(&run->report, "points", "%s, on the sphere %s, resting %s", text_count(info->n_points),
               text_count(info->n_on_sphere), text_count(info->n_resting));
    report_row(&run->report, "extend", "%s, %.0f nodes a point; within %.1e of the nodes' barycenters",
               text_seconds(info->total_s), (double)info->n_nodes / fmax((double)info->n_points, 1.0), info->bound_max);
    if (info->n_open > 0)
        cli_warn(run, info->n_open, "at %lld points the search did not end within the tolerance",
                 (long long)info->n_open);
}

static loxo_status solve(cli_run *run, const loxo_sphere_extension_settings *settings, const loxo_sphere_map *map,
                         const char *at)
{
    loxo_extension_values values = {.w = NULL};
    loxo_sphere_extension_info info;
    double *z = NULL, *co = NULL;
    int64_t n = 0;
    loxo_status status = cli_read_places(run, at, 3, &z, &co, &n);
    if (status >= 0) status = cli_values_create(run, n, 3, &values);
    if (status >= 0)
        status = cli_blame(run, loxo_sphere_extension(run->ctx, map, settings, n, z, co, &values, &info), at);
    if (status >= 0) {
        tell(run, &info);
        (void)cli_combine(run, status);
        status = cli_before_output(run);
    }
    if (status >= 0) status = cli_write_values(run, n, 3, z, 3, &values);
    loxo_release(run->ctx, z);
    loxo_release(run->ctx, co);
    cli_values_destroy(run, &values);
    return status;
}

/* Pieces of the faces for one point: at least one a face. */
static double count_pieces(const loxo_sphere_extension_settings *settings, int64_t n_faces, double gap)
{
    const double halvings = log2(1.0 / fmax(gap, LEAST_GAP));
    return (double)n_faces + (PIECES_AROUND + PIECES_NEAR * halvings) / (settings->piece * settings->piece);
}

/* Both meshes, the points and their values, and the nodes of the point that has most of them. */
static loxo_status estimate(cli_run *run, const loxo_sphere_extension_settings *settings, const char *image,
                            const char *at)
{
    loxo_mesh_counts from, to;
    double *z = NULL, *co = NULL, gap = 1.0;
    int64_t n = 0;
    loxo_status status = cli_count_mesh(run, image, &to);
    if (status >= 0) status = cli_count_mesh(run, run->args.operand[0], &from);
    if (status >= 0) status = cli_read_places(run, at, 3, &z, &co, &n);
    for (int64_t i = 0; i < n && status >= 0; ++i) {
        const double radius = sqrt(z[3 * i] * z[3 * i] + z[3 * i + 1] * z[3 * i + 1] + z[3 * i + 2] * z[3 * i + 2]);
        const double own = co != NULL ? 0.5 * co[i] : 1.0 - radius;
        if (own > 0.0) gap = fmin(gap, own); /* on the sphere there are no nodes */
    }
    loxo_release(run->ctx, z);
    loxo_release(run->ctx, co);
    if (status < 0) return status;
    const size_t arrays = cli_counts_bytes(&from) + cli_counts_bytes(&to);
    const size_t meshes =
        arrays + (size_t)from.n_vertices * 6 * sizeof(double) + (size_t)from.n_faces * sizeof(int64_t);
    const size_t points = (size_t)n * (3 + 1 + 3 + 3) * sizeof(double) + (size_t)n;
    /* room for a quarter more, and the atoms once more where the search has to shift them */
    const double n_nodes = 6.0 * count_pieces(settings, from.n_faces, gap);
    const size_t nodes = (size_t)(n_nodes * (1.25 * 4.0 + 3.0)) * sizeof(double) + CLI_ESTIMATE_FIXED;
    const size_t read_bytes = from.read_bytes > to.read_bytes + cli_counts_bytes(&from)
                                  ? from.read_bytes
                                  : to.read_bytes + cli_counts_bytes(&from);
    cli_estimate_part(run, "read_bytes", read_bytes);
    cli_estimate_part(run, "meshes_bytes", meshes);
    cli_estimate_part(run, "points_bytes", points);
    cli_estimate_part(run, "nodes_bytes", nodes);
    cli_estimate(run, meshes + points + nodes > read_bytes ? meshes + points + nodes : read_bytes, NAN);
    return LOXO_OK;
}

loxo_status cli_extend_ball(cli_run *run, const loxo_sphere_extension_settings *settings)
{
    const char *image = cli_args_value(&run->args, "map", 0), *at = cli_args_value(&run->args, "at", 0);
    loxo_soup from = {0}, to = {0};
    double *x = NULL, *y = NULL;
    if (at == NULL) return cli_fail(run, LOXO_ERR_ARGUMENT, "extend: give points of the ball, --at FILE");
    if (run->common->estimate) return estimate(run, settings, image, at);
    loxo_status status = cli_read_mesh(run, run->args.operand[0], &from);
    json_put_text(run->report.json, "map", image);
    if (status >= 0) status = loxo_read_mesh(run->ctx, image, NULL, &to);
    if (status >= 0 && (from.n_vertices != to.n_vertices || from.n_faces != to.n_faces ||
                        (from.n_faces > 0 &&
                         memcmp(from.triangle, to.triangle, (size_t)from.n_faces * 3 * sizeof *from.triangle) != 0)))
        status = cli_fail_at(run, LOXO_ERR_MESH, image, 0, "does not have the vertices and faces of the sphere");
    if (status >= 0) status = take_positions(run, &from, &x);
    if (status >= 0) status = take_positions(run, &to, &y);
    const loxo_sphere_map map = {
        .n_vertices = from.n_vertices, .n_faces = from.n_faces, .d = 3, .x = x, .y = y, .triangle = from.triangle};
    if (status >= 0) status = solve(run, settings, &map, at);
    loxo_release(run->ctx, x);
    loxo_release(run->ctx, y);
    loxo_soup_destroy(run->ctx, &from);
    loxo_soup_destroy(run->ctx, &to);
    return status;
}
