/* SPDX-License-Identifier: MIT
 * loxo center: the Moebius centring of a spherical map. */
#include "barycenter_report.h"
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "run.h"

#include <math.h>
#include <string.h>

typedef struct center_state {
    cli_common common;
    loxo_center_settings center;
} center_state;

static void set_defaults(void *state)
{
    *(center_state *)state = (center_state){.center = loxo_center_settings_default()};
}

static loxo_status estimate(cli_run *run)
{
    loxo_mesh_counts counts;
    const loxo_status status = cli_count_mesh(run, run->args.operand[0], &counts);
    if (status < 0) return status;
    const size_t arrays = cli_counts_bytes(&counts);
    const size_t work = 2 * arrays + (size_t)counts.n_vertices * (1 + 3 + 3) * sizeof(double);
    cli_estimate_part(run, "read_bytes", counts.read_bytes);
    cli_estimate_part(run, "arrays_bytes", 2 * arrays);
    cli_estimate(run, work > counts.read_bytes + arrays ? work : counts.read_bytes + arrays, NAN);
    return LOXO_OK;
}

/* Whether the map belongs to the surface: as many vertices and faces, and the same corners. */
static loxo_status compare(cli_run *run, const char *path, const loxo_soup *map, const loxo_soup *surface)
{
    int64_t n_other = 0;
    if (map->n_vertices != surface->n_vertices || map->n_faces != surface->n_faces)
        return cli_fail_at(run, LOXO_ERR_MESH, path, 0,
                           "has %lld vertices and %lld faces, the map on the sphere %lld and %lld",
                           (long long)surface->n_vertices, (long long)surface->n_faces, (long long)map->n_vertices,
                           (long long)map->n_faces);
    for (int64_t f = 0; f < map->n_faces; ++f)
        n_other += memcmp(map->triangle + 3 * f, surface->triangle + 3 * f, 3 * sizeof *map->triangle) != 0;
    if (n_other > 0)
        cli_warn(run, n_other, "%lld faces have other corners than those of the surface: is this a map of it?",
                 (long long)n_other);
    return LOXO_OK;
}

/* Reads the surface and lets it go again; its areas stay. */
static loxo_status read_areas(cli_run *run, const char *path, const loxo_soup *map, double **area)
{
    loxo_soup surface = {0};
    loxo_status status = loxo_read_mesh(run->ctx, path, NULL, &surface);
    if (status < 0) return status;
    status = compare(run, path, map, &surface);
    if (status >= 0 && (*area = loxo_allocate(run->ctx, map->n_vertices, sizeof **area)) == NULL)
        status = LOXO_ERR_MEMORY;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&surface);
    if (status >= 0 && (status = loxo_mesh_vertex_areas(run->ctx, &arrays, *area)) < 0) run->input = path;
    loxo_soup_destroy(run->ctx, &surface);
    return status;
}

static void tell(cli_run *run, const loxo_center_info *info)
{
    const loxo_barycenter_info *b = &info->barycenter;
    json_t *center = json_put_object(run->report.json, "center");
    cli_put_barycenter(center, b, 3);
    json_put_number(center, "off_sphere", info->off_sphere);
    json_put_number(center, "mean_before", info->mean_before);
    json_put_number(center, "mean_after", info->mean_after);
    json_put_number(center, "total_s", info->total_s);
    report_row(&run->report, "barycenter", "%.6g %.6g %.6g, 1 - |w| %.4g, within %.1e", b->w[0], b->w[1], b->w[2],
               b->gap, b->bound);
    report_row(&run->report, "mean", "%.3e before, %.1e after, %lld steps, %s", info->mean_before, info->mean_after,
               (long long)b->n_iterations, text_seconds(info->total_s));
    if (b->kind != LOXO_BARYCENTER_STABLE)
        cli_warn(run, 1,
                 "half of the area or more stands at one point of the sphere: there is no centre; written as it was");
}

/* Positions of the map become the centred ones. */
static loxo_status solve(cli_run *run, const center_state *s, const double *area, loxo_soup *map)
{
    loxo_center_info info;
    double *centred = loxo_allocate(run->ctx, 3 * map->n_vertices, sizeof *centred);
    if (centred == NULL) return LOXO_ERR_MEMORY;
    const loxo_status status = loxo_moebius_center(run->ctx, map->n_vertices, map->position, map->position_float, area,
                                                   &s->center, centred, &info);
    if (status < 0) {
        loxo_release(run->ctx, centred);
        return status;
    }
    loxo_release(run->ctx, map->position);
    loxo_release(run->ctx, map->position_float);
    map->position = centred;
    map->position_float = NULL;
    tell(run, &info);
    return cli_combine(run, status);
}

static loxo_status center_main(cli_run *run, void *state)
{
    const center_state *s = state;
    const char *path = cli_args_value(&run->args, "output", 0), *surface = cli_args_value(&run->args, "mesh", 0);
    loxo_write_settings write = loxo_write_settings_default();
    cli_kind kind = CLI_MESH;
    loxo_soup map = {0};
    double *area = NULL;
    loxo_status status;
    if (path == NULL && run->json_path == NULL && !s->common.estimate)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "center: no output; give -o FILE or --json");
    if (surface == NULL && !s->common.estimate)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "center: give the surface that was mapped, --mesh FILE");
    if (path != NULL) {
        if ((status = cli_output_format(run, path, NULL, true, &write.format, &kind)) < 0) return status;
        if ((status = cli_output(run, path)) < 0) return status;
    }
    if (s->common.estimate) return estimate(run);
    if ((status = cli_read_mesh(run, run->args.operand[0], &map)) < 0) return status;
    json_put_text(run->report.json, "surface", surface);
    const double start_s = loxo_os_clock_s();
    if (map.n_vertices == 0)
        status = cli_fail(run, LOXO_ERR_MESH, "center: the mesh has no vertices");
    else
        status = read_areas(run, surface, &map, &area);
    if (status < 0) goto done;
    (void)cli_seconds(run, "areas", start_s);
    if ((status = solve(run, s, area, &map)) < 0 || path == NULL) goto done;
    if ((status = cli_before_output(run)) < 0) goto done;
    const double write_s = loxo_os_clock_s();
    if ((status = loxo_write_mesh(run->ctx, path, &map, &write)) < 0) goto done;
    (void)cli_seconds(run, "write", write_s);
    cli_wrote(run, path);
done:
    loxo_release(run->ctx, area);
    loxo_soup_destroy(run->ctx, &map);
    return status;
}

static const cli_flag center_flags[] = {
    {.name = "mesh", .values = "FILE", .n_values = 1, .reads = true, .help = "the surface that was mapped"},
    {.name = "output", .letter = 'o', .values = "FILE", .n_values = 1, .help = "where to; - is standard output"},
    {.name = NULL},
};
static const cli_group center_groups[] = {
    {"center", loxo_center_options, offsetof(center_state, center)},
    {.title = NULL},
};

const cli_command command_center = {
    .name = "center",
    .operands = "SPHERE --mesh SURFACE -o OUT [options]",
    .summary = "Moebius centring of a map to the sphere",
    .about = "SPHERE has the surface's vertices and faces, with its vertices on the unit sphere. They are moved by the "
             "Moebius\n"
             "map after which the mean of the sphere's points over the surface's area is the centre.\n",
    .examples = "  loxo center sphere.ply --mesh brain.ply -o centred.ply\n"
                "  loxo center sphere.ply --mesh brain.ply --json - --quiet\n",
    .min_operands = 1,
    .max_operands = 1,
    .flags = center_flags,
    .groups = center_groups,
    .state_bytes = sizeof(center_state),
    .defaults = set_defaults,
    .main = center_main,
};
