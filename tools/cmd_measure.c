/* SPDX-License-Identifier: MIT
 * loxo measure: how far distances are from a reference, and a map to the sphere from a conformal one. */
#include "barycenter_report.h"
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "measure_rows.h"
#include "run.h"
#include "sphere_pictures.h"
#include "sphere_report.h"

#include <math.h>
#include <stdio.h>

enum { FIELD_ANGLE_ERROR, FIELD_BELTRAMI, FIELD_CURVATURE, N_FIELDS };
static const char *const field_options[] = {"angle-error", "beltrami", "curvature", NULL};
static const char *const field_names[N_FIELDS] = {"angle_error", "beltrami", "curvature"};
static const char *const field_titles[N_FIELDS] = {"angle error", "|mu|", "curvature"};
static const char *const field_units[N_FIELDS] = {"degrees", NULL, "radians"};

typedef struct map_settings {
    bool normalize;
    int field;
} map_settings;

static const loxo_option map_options[] = {
    {.name = "normalize",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(map_settings, normalize),
     .max = 1,
     .help = "the map's points are directions of any length but 0"},
    {.name = "field",
     .type = LOXO_OPTION_CHOICE,
     .offset = offsetof(map_settings, field),
     .choices = field_options,
     .help = "what the picture shows around each vertex: angle-error, beltrami or curvature"},
    {.name = NULL},
};

typedef struct measure_state {
    cli_common common;
    map_settings map;
    loxo_draw_settings draw;
} measure_state;

static void set_defaults(void *state) { *(measure_state *)state = (measure_state){.draw = cli_sphere_draw_default()}; }

/* ---- distances -------------------------------------------------------------------------------------------------- */

static void report_error(cli_run *run, const loxo_distance_error *e)
{
    json_t *error = json_put_object(run->report.json, "error");
    json_put_number(error, "mean_relative", e->mean_relative);
    json_put_number(error, "max_relative", e->max_relative);
    json_put_number(error, "max_absolute", e->max_absolute);
    json_put_integer(error, "n_compared", e->n_compared);
    json_put_integer(error, "n_mismatched", e->n_mismatched);
    report_row(&run->report, "true error", "mean %.4f %% (eq. 29), max %.4f %%, max absolute %.6g, %s compared",
               100.0 * e->mean_relative, 100.0 * e->max_relative, e->max_absolute, text_count(e->n_compared));
    if (e->n_mismatched > 0)
        cli_warn(run, e->n_mismatched, "%lld vertices are finite in one of the two fields only",
                 (long long)e->n_mismatched);
}

loxo_status cli_measure_against(cli_run *run, const char *path, const double *distance, int64_t n)
{
    double *reference = NULL;
    int64_t n_reference = 0;
    loxo_distance_error error = {0};
    loxo_status status = loxo_read_field(run->ctx, path, &reference, &n_reference);
    if (status < 0) return status;
    if (n_reference != n)
        status = cli_fail_at(run, LOXO_ERR_ARGUMENT, path, 0, "holds %lld values, not %lld", (long long)n_reference,
                             (long long)n);
    else
        status = loxo_measure_distance_error(run->ctx, distance, reference, n, &error);
    if (status >= 0) report_error(run, &error);
    loxo_release(run->ctx, reference);
    return status;
}

static loxo_status measure_distances(cli_run *run)
{
    double *distance = NULL;
    int64_t n = 0;
    const double start_s = loxo_os_clock_s();
    run->input = run->args.operand[0];
    json_put_text(run->report.json, "input", run->args.operand[0]);
    json_put_text(run->report.json, "reference", run->args.operand[1]);
    loxo_status status = loxo_read_field(run->ctx, run->args.operand[0], &distance, &n);
    if (status < 0) return status;
    if (run->common->estimate)
        cli_estimate(run, 2 * sizeof(double) * (size_t)n, NAN);
    else
        status = cli_measure_against(run, run->args.operand[1], distance, n);
    (void)cli_seconds(run, "measure", start_s);
    loxo_release(run->ctx, distance);
    return status;
}

/* ---- maps to the sphere ------------------------------------------------------------------------------------------ */

/* A run's arrays. */
typedef struct map_job {
    loxo_soup surface;
    double *map, *centred, *area;
    double *field[N_FIELDS]; /* [n_vertices] each */
    double *corner_error, *mu;
    loxo_sphere_map_measure measure;
} map_job;

static void release(cli_run *run, map_job *j)
{
    double *const arrays[] = {j->map, j->centred, j->area, j->corner_error, j->mu};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; ++i)
        loxo_release(run->ctx, arrays[i]);
    for (int i = 0; i < N_FIELDS; ++i)
        loxo_release(run->ctx, j->field[i]);
    loxo_soup_destroy(run->ctx, &j->surface);
}

/* Before anything is read. */
static loxo_status announce(cli_run *run)
{
    static const char *const flags[] = {"picture", "histogram"};
    const char *path = cli_args_value(&run->args, "output", 0);
    loxo_status status = LOXO_OK;
    if (path != NULL) {
        loxo_format format;
        cli_kind kind = CLI_MESH;
        status = cli_output_format(run, path, NULL, true, &format, &kind);
        if (status >= 0) status = cli_output(run, path);
    }
    for (int i = 0; i < 2 && status >= 0; ++i)
        if ((path = cli_args_value(&run->args, flags[i], 0)) != NULL) status = cli_output(run, path);
    return status;
}

static loxo_status estimate_map(cli_run *run, const loxo_draw_settings *draw)
{
    loxo_mesh_counts counts;
    const loxo_status status = cli_count_mesh(run, run->args.operand[0], &counts);
    if (status < 0) return status;
    const bool has_fields = cli_args_has(&run->args, "output") || cli_args_has(&run->args, "picture");
    const size_t n = (size_t)counts.n_vertices, samples = (size_t)draw->supersample * (size_t)draw->supersample;
    const size_t arrays = cli_counts_bytes(&counts), maps = n * (3 + 3 + 1) * sizeof(double);
    const size_t fields = n * (has_fields ? N_FIELDS * sizeof(double) + sizeof(int32_t) : 0);
    const size_t faces = cli_args_has(&run->args, "histogram") ? (size_t)counts.n_faces * 5 * sizeof(double) : 0;
    const size_t repair = 60 * n + arrays;
    const size_t picture = cli_args_has(&run->args, "picture")
                               ? (size_t)draw->width * (size_t)draw->height * (6 + 16 * samples) + 20 * n
                               : 0;
    const size_t work = arrays + maps + fields + faces + picture;
    cli_estimate_part(run, "read_bytes", counts.read_bytes);
    cli_estimate_part(run, "arrays_bytes", arrays + maps);
    cli_estimate_part(run, "results_bytes", fields + faces);
    cli_estimate(run, work > repair + counts.read_bytes ? work : repair + counts.read_bytes, NAN);
    return status;
}

/* The surface as `loxo sphere` sees it: faces with a vertex repeated are dropped, those that are turned against their neighbours
 * turned, both with a warning. */
static loxo_status read_files(cli_run *run, const map_settings *s, map_job *j)
{
    const loxo_repair_settings harmless = {.weld = false};
    const char *path = cli_args_value(&run->args, "sphere", 0);
    loxo_status status = cli_read_mesh(run, run->args.operand[0], &j->surface);
    if (status < 0) return status;
    json_put_text(run->report.json, "sphere", path);
    const double start_s = loxo_os_clock_s();
    status = cli_read_sphere_map(run, path, &j->surface, s->normalize, &j->map);
    if (status < 0) return status;
    (void)cli_seconds(run, "read_map", start_s);
    status = loxo_soup_repair(run->ctx, &j->surface, &harmless, NULL, NULL);
    return status < 0 ? status : LOXO_OK;
}

static loxo_status reserve(cli_run *run, map_job *j)
{
    const int64_t n = j->surface.n_vertices, n_faces = j->surface.n_faces;
    if (cli_args_has(&run->args, "output") || cli_args_has(&run->args, "picture"))
        for (int i = 0; i < N_FIELDS; ++i)
            if ((j->field[i] = loxo_allocate(run->ctx, n, sizeof(double))) == NULL) return LOXO_ERR_MEMORY;
    if (!cli_args_has(&run->args, "histogram")) return LOXO_OK;
    if ((j->corner_error = loxo_allocate(run->ctx, 3 * n_faces, sizeof(double))) == NULL) return LOXO_ERR_MEMORY;
    if ((j->mu = loxo_allocate(run->ctx, 2 * n_faces, sizeof(double))) == NULL) return LOXO_ERR_MEMORY;
    return LOXO_OK;
}

/* The same map after Moebius centring, so that methods can be compared. */
static loxo_status measure_centred(cli_run *run, const loxo_mesh_arrays *surface, map_job *j)
{
    const int64_t n = surface->n_vertices;
    loxo_center_info info;
    loxo_sphere_map_measure measure;
    j->area = loxo_allocate(run->ctx, n, sizeof *j->area);
    j->centred = loxo_allocate(run->ctx, 3 * n, sizeof *j->centred);
    if (j->area == NULL || j->centred == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_mesh_vertex_areas(run->ctx, surface, j->area);
    if (status >= 0) status = loxo_moebius_center(run->ctx, n, j->map, NULL, j->area, NULL, j->centred, &info);
    if (status < 0) return status;
    cli_put_barycenter(json_put_object(run->report.json, "center"), &info.barycenter, 3);
    if (info.barycenter.kind != LOXO_BARYCENTER_STABLE) {
        cli_warn(run, 1, "the map has no centre: half of the area or more stands at one point of the sphere");
        return LOXO_OK;
    }
    (void)cli_combine(run, status);
    status = loxo_measure_sphere_map(run->ctx, surface, j->centred, &measure, NULL);
    if (status >= 0) cli_tell_sphere_map(run, "centred", "centred", true, &measure);
    return status;
}

static loxo_status solve(cli_run *run, map_job *j)
{
    const loxo_mesh_arrays surface = loxo_soup_arrays(&j->surface);
    const loxo_sphere_map_fields fields = {
        .corner_angle_error_deg = j->corner_error,
        .face_beltrami = j->mu,
        .vertex_angle_error_deg = j->field[FIELD_ANGLE_ERROR],
        .vertex_beltrami = j->field[FIELD_BELTRAMI],
        .vertex_curvature_rad = j->field[FIELD_CURVATURE],
    };
    const double start_s = loxo_os_clock_s();
    loxo_status status = loxo_measure_sphere_map(run->ctx, &surface, j->map, &j->measure, &fields);
    if (status < 0) return status;
    cli_tell_sphere_map(run, "map", "map", false, &j->measure);
    status = measure_centred(run, &surface, j);
    (void)cli_seconds(run, "measure", start_s);
    return status;
}

/* The surface with the fields, in place of those it came with. */
static loxo_status write_fields(cli_run *run, const char *path, map_job *j)
{
    const double start_s = loxo_os_clock_s();
    loxo_field fields[N_FIELDS] = {{.value = NULL}};
    loxo_write_settings write = loxo_write_settings_default();
    loxo_soup with = j->surface;
    cli_kind kind = CLI_MESH;
    loxo_status status = cli_output_format(run, path, NULL, true, &write.format, &kind);
    for (int i = 0; i < N_FIELDS; ++i) {
        fields[i].value = j->field[i];
        (void)snprintf(fields[i].name, sizeof fields[i].name, "%s", field_names[i]);
    }
    with.fields = fields;
    with.n_fields = N_FIELDS;
    if (status >= 0) status = loxo_write_mesh(run->ctx, path, &with, &write);
    if (status < 0) return status;
    (void)cli_seconds(run, "write", start_s);
    cli_wrote(run, path);
    return LOXO_OK;
}

/* The colours end at the 99th percentile, as a few corners would take them all. */
static loxo_status draw(cli_run *run, const measure_state *s, const char *path, const map_job *j)
{
    const loxo_mesh_arrays image = {.n_vertices = j->surface.n_vertices,
                                    .n_faces = j->surface.n_faces,
                                    .position = j->map,
                                    .triangle = j->surface.triangle};
    loxo_draw_settings settings = s->draw;
    const int field = s->map.field;
    settings.unit = field_units[field];
    if (field != FIELD_CURVATURE) {
        const loxo_distribution *d = field == FIELD_BELTRAMI ? &j->measure.beltrami : &j->measure.angle_error_deg;
        if (!isfinite(settings.value_min)) settings.value_min = 0.0;
        if (!isfinite(settings.value_max) && d->percentile_99 > settings.value_min)
            settings.value_max = d->percentile_99;
    }
    return cli_sphere_picture(run, &image, j->field[field], field_titles[field], &settings, path);
}

static loxo_status write_files(cli_run *run, const measure_state *s, map_job *j)
{
    const char *output = cli_args_value(&run->args, "output", 0), *picture = cli_args_value(&run->args, "picture", 0);
    const char *histogram = cli_args_value(&run->args, "histogram", 0);
    if (output == NULL && picture == NULL && histogram == NULL) return LOXO_OK;
    loxo_status status = cli_before_output(run);
    if (status >= 0 && output != NULL) status = write_fields(run, output, j);
    if (status >= 0 && picture != NULL) status = draw(run, s, picture, j);
    if (status >= 0 && histogram != NULL)
        status = cli_sphere_histograms(run, j->surface.n_faces, j->corner_error, j->mu, &j->measure, histogram);
    return status;
}

static loxo_status measure_map(cli_run *run, const measure_state *s)
{
    map_job j = {.map = NULL};
    loxo_status status = announce(run);
    if (status < 0) return status;
    if (s->common.estimate) return estimate_map(run, &s->draw);
    status = read_files(run, &s->map, &j);
    if (status >= 0) status = reserve(run, &j);
    if (status >= 0) status = solve(run, &j);
    if (status >= 0) status = write_files(run, s, &j);
    release(run, &j);
    return status;
}

static loxo_status measure_main(cli_run *run, void *state)
{
    static const char *const of_maps[] = {"output", "picture", "histogram"};
    const bool is_map = cli_args_has(&run->args, "sphere");
    if (is_map && run->args.n_operands > 1)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "measure: with --sphere there is one operand, the surface");
    if (is_map) return measure_map(run, state);
    if (run->args.n_operands < 2)
        return cli_fail(run, LOXO_ERR_ARGUMENT,
                        "measure: too few operands: DISTANCES REFERENCE, or SURFACE --sphere MAP");
    for (size_t i = 0; i < sizeof of_maps / sizeof *of_maps; ++i)
        if (cli_args_has(&run->args, of_maps[i]))
            return cli_fail(run, LOXO_ERR_ARGUMENT, "measure: --%s is of maps: SURFACE --sphere MAP", of_maps[i]);
    return measure_distances(run);
}

static const cli_flag measure_flags[] = {
    {.name = "sphere",
     .values = "MAP",
     .n_values = 1,
     .reads = true,
     .help = "measure a map to the unit sphere: a mesh, or points as .npy .csv .txt"},
    {.name = "output",
     .letter = 'o',
     .values = "FILE",
     .n_values = 1,
     .help = "the surface with angle_error (degrees), beltrami and curvature (radians) around each vertex"},
    {.name = "picture", .values = "FILE.png", .n_values = 1, .help = "the sphere with a field, front and back"},
    {.name = "histogram", .values = "FILE.png", .n_values = 1, .help = "of angle errors and of |mu|"},
    {.name = NULL},
};
static const cli_group measure_groups[] = {
    {"map", map_options, offsetof(measure_state, map)},
    {"picture", loxo_draw_options, offsetof(measure_state, draw)},
    {.title = NULL},
};
static const cli_need measure_needs[] = {
    {"normalize", "sphere"}, {"field", "picture"}, {"picture", "picture"}, {NULL, NULL}};

const cli_command command_measure = {
    .name = "measure",
    .operands = "DISTANCES REFERENCE | SURFACE --sphere MAP [options]",
    .summary = "errors of distances against a reference, or of a map to the sphere",
    .about =
        "Distances are one number a vertex: .npy, .csv, .txt, .gii, or mesh.ply:property. The mean relative error is "
        "that of\n"
        "eq. (29) of the parallel heat paper.\n"
        "A map to the sphere has a point of the unit sphere for each vertex of the surface. Told are its conformal "
        "energy E_C,\n"
        "errors of angles in degrees, the Beltrami coefficient |mu|, how areas are out of proportion, triangles "
        "turned over\n"
        "and how often the sphere is covered; energy and angles again after Moebius centring.\n",
    .examples = "  loxo measure d.npy exact.npy\n  loxo measure d.ply:distance exact.npy --json -\n"
                "  loxo measure brain.ply --sphere sphere.ply --histogram errors.png --picture sphere.png\n",
    .min_operands = 1,
    .max_operands = 2,
    .flags = measure_flags,
    .groups = measure_groups,
    .needs = measure_needs,
    .state_bytes = sizeof(measure_state),
    .defaults = set_defaults,
    .main = measure_main,
};
