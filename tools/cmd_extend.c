/* SPDX-License-Identifier: MIT
 * loxo extend: Douady and Earle's extension of a closed curve on the sphere to the disk: as a mesh, a picture, or at points. */
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "extend_ball.h"
#include "picture.h"
#include "run.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define PI      3.14159265358979323846
#define RINGS   8.0 /* of the polar grid in pictures */
#define SECTORS 24.0

typedef struct extend_settings {
    int64_t n_points;
    int by; /* what the samples' places on the circle go by */
    bool normalize;
    double piece;
} extend_settings;

enum { BY_INDEX, BY_LENGTH };
static const char *const by_names[] = {"index", "length", NULL};

static const loxo_option extend_options[] = {
    {.name = "points",
     .type = LOXO_OPTION_INT64,
     .offset = offsetof(extend_settings, n_points),
     .min = 7,
     .max = 1e9,
     .help = "vertices of the disk, about"},
    {.name = "by",
     .type = LOXO_OPTION_CHOICE,
     .offset = offsetof(extend_settings, by),
     .choices = by_names,
     .help = "samples stand on the circle evenly, or as far apart as on the curve"},
    {.name = "normalize",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(extend_settings, normalize),
     .max = 1,
     .help = "samples are directions of any length but 0"},
    {.name = "piece",
     .type = LOXO_OPTION_DOUBLE,
     .offset = offsetof(extend_settings, piece),
     .min = 1e-3,
     .max = 4.0,
     .help = "with --map: longest side of a piece of a face over its distance from the point"},
    {.name = NULL},
};

typedef struct extend_state {
    cli_common common;
    extend_settings extend;
    loxo_extension_settings extension;
    loxo_draw_settings draw;
} extend_state;

static void set_defaults(void *state)
{
    extend_state *s = state;
    *s = (extend_state){
        .extend = {.n_points = 20000, .by = BY_INDEX, .piece = loxo_sphere_extension_settings_default().piece},
        .extension = loxo_extension_settings_default(),
        .draw = loxo_draw_settings_default()};
    s->draw.scale_bar = false;
    s->draw.n_isolines = 2;
}

/* A run's arrays. */
typedef struct extend_job {
    double *x, *angle; /* samples; angle NULL: even */
    loxo_curve curve;
    loxo_soup disk;
    int64_t n;
    double *z, *co; /* co NULL: from z */
    loxo_extension_values values;
} extend_job;

static void release(cli_run *run, extend_job *j)
{
    loxo_release(run->ctx, j->x);
    loxo_release(run->ctx, j->angle);
    loxo_soup_destroy(run->ctx, &j->disk);
    loxo_release(run->ctx, j->z);
    loxo_release(run->ctx, j->co);
    cli_values_destroy(run, &j->values);
}

/* ---- what comes in --------------------------------------------------------------------------------------------- */

/* One column: angles of a map of the circle to itself. */
static loxo_status take_angles(cli_run *run, const loxo_array *array, extend_job *j)
{
    const int64_t n = array->shape[0];
    if ((j->x = loxo_allocate(run->ctx, 2 * n, sizeof *j->x)) == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < n; ++i) {
        if (!(fabs(array->value[i]) <= 1e6))
            return cli_fail_at(run, LOXO_ERR_MALFORMED, run->input, 0, "angle %lld is not within a million",
                               (long long)i);
        j->x[2 * i] = cos(array->value[i]);
        j->x[2 * i + 1] = sin(array->value[i]);
    }
    j->curve = (loxo_curve){.n = n, .d = 2, .x = j->x};
    return LOXO_OK;
}

static loxo_status take_samples(cli_run *run, const extend_settings *s, loxo_array *array, extend_job *j)
{
    const int64_t n = array->shape[0], d = array->shape[1];
    if (array->n_dimensions != 2 || d > LOXO_MOEBIUS_MOST_DIMENSIONS)
        return cli_fail_at(run, LOXO_ERR_UNSUPPORTED, run->input, 0,
                           "a curve is rows of 2 to %d coordinates, or one column of angles",
                           LOXO_MOEBIUS_MOST_DIMENSIONS);
    j->x = array->value;
    array->value = NULL;
    for (int64_t i = 0; i < n && s->normalize; ++i) {
        double most = 0.0, square = 0.0;
        for (int64_t k = 0; k < d; ++k)
            most = fmax(most, fabs(j->x[i * d + k]));
        for (int64_t k = 0; k < d && most > 0.0; ++k)
            square += (j->x[i * d + k] / most) * (j->x[i * d + k] / most);
        for (int64_t k = 0; k < d; ++k)
            j->x[i * d + k] = most > 0.0 ? j->x[i * d + k] / most / sqrt(square) : 0.0;
    }
    j->curve = (loxo_curve){.n = n, .d = (int)d, .x = j->x};
    return LOXO_OK;
}

/* Places on the circle as far apart as samples are on the sphere; of samples at one point all but the first are dropped. */
static loxo_status place_by_length(cli_run *run, extend_job *j)
{
    const int d = j->curve.d;
    double *angle = loxo_allocate(run->ctx, j->curve.n, sizeof *angle), sum = 0.0;
    int64_t n = 0;
    if ((j->angle = angle) == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i <= j->curve.n; ++i) {
        const double *p = j->x + (i < j->curve.n ? i : 0) * d, *last = j->x + (n > 0 ? n - 1 : 0) * d;
        double square = 0.0;
        for (int k = 0; k < d; ++k)
            square += (p[k] - last[k]) * (p[k] - last[k]);
        if (i > 0 && !(square > 0.0)) continue; /* the first again, at the end, closes the curve */
        sum += i > 0 ? 2.0 * asin(fmin(0.5 * sqrt(square), 1.0)) : 0.0;
        if (i == j->curve.n) break;
        memmove(j->x + n * d, p, (size_t)d * sizeof *p);
        angle[n++] = sum;
    }
    j->curve.n = n;
    for (int64_t i = 0; i < n; ++i)
        angle[i] *= 2.0 * PI / sum;
    j->curve.angle = angle;
    return LOXO_OK;
}

static loxo_status read_curve(cli_run *run, const extend_settings *s, extend_job *j)
{
    loxo_array array = {.value = NULL};
    const double start_s = loxo_os_clock_s();
    run->input = run->args.operand[0];
    json_put_text(run->report.json, "input", run->input);
    loxo_status status = loxo_read_array(run->ctx, run->input, &array);
    if (status >= 0 && (array.n_dimensions == 1 || (array.n_dimensions == 2 && array.shape[1] == 1)))
        status = take_angles(run, &array, j);
    else if (status >= 0)
        status = take_samples(run, s, &array, j);
    loxo_array_destroy(run->ctx, &array);
    if (status >= 0 && s->by == BY_LENGTH) status = place_by_length(run, j);
    if (status < 0) return status;
    (void)cli_seconds(run, "read", start_s);
    report_row(&run->report, "input", "%s  %s samples in %d dimensions", text_path(run->input), text_count(j->curve.n),
               j->curve.d);
    return LOXO_OK;
}

static loxo_status make_disk(cli_run *run, int64_t n_points, extend_job *j)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    settings.shape = LOXO_SHAPE_DISK;
    settings.n_vertices = n_points;
    const loxo_status status = loxo_generate(run->ctx, &settings, false, &j->disk);
    if (status < 0) return status;
    j->n = j->disk.n_vertices;
    if ((j->z = loxo_allocate(run->ctx, 2 * j->n, sizeof *j->z)) == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < 2 * j->n; ++i)
        j->z[i] = j->disk.position[3 * (i / 2) + i % 2];
    return LOXO_OK;
}

/* ---- work ------------------------------------------------------------------------------------------------------ */

static void tell(cli_run *run, const loxo_extension_info *info)
{
    json_t *o = json_put_object(run->report.json, "extension");
    json_put_integer(o, "n_points", info->n_points);
    json_put_integer(o, "n_fixed", info->n_fixed);
    json_put_integer(o, "n_moving", info->n_moving);
    json_put_integer(o, "n_near", info->n_near);
    json_put_integer(o, "n_curve", info->n_curve);
    json_put_integer(o, "n_resting", info->n_resting);
    json_put_integer(o, "n_open", info->n_open);
    json_put_integer(o, "n_passes", info->n_passes);
    json_put_integer(o, "n_coarse_passes", info->n_coarse_passes);
    json_put_number(o, "bound_max", info->bound_max);
    json_put_number(o, "error_max", info->error_max);
    json_put_number(o, "total_s", info->total_s);
    report_row(&run->report, "points", "%s: nodes fixed at %s, moving at %s, on the circle %s, resting %s",
               text_count(info->n_points), text_count(info->n_fixed), text_count(info->n_moving + info->n_near),
               text_count(info->n_curve), text_count(info->n_resting));
    report_row(&run->report, "extend",
               "%s, %.2f passes a point; within %.1e of the nodes' barycenters, nodes good to %.1e",
               text_seconds(info->total_s), (double)info->n_passes / fmax((double)info->n_points, 1.0), info->bound_max,
               info->error_max);
    if (info->n_open > 0)
        cli_warn(run, info->n_open, "at %lld points the search did not end within the tolerance",
                 (long long)info->n_open);
}

static loxo_status solve(cli_run *run, const loxo_extension_settings *settings, extend_job *j)
{
    loxo_extension *extension = NULL;
    loxo_extension_info info = {.n_points = 0};
    const char *at = cli_args_value(&run->args, "at", 0);
    loxo_status status = cli_values_create(run, j->n, j->curve.d, &j->values);
    if (status >= 0)
        status = cli_blame(run, loxo_extension_create(run->ctx, &j->curve, settings, &extension), run->input);
    if (status >= 0) status = loxo_extension_evaluate(extension, j->n, j->z, j->co, &j->values, &info);
    if (at != NULL) status = cli_blame(run, status, at);
    loxo_extension_destroy(extension);
    if (status < 0) return status;
    tell(run, &info);
    return cli_combine(run, status);
}

/* ---- what goes out --------------------------------------------------------------------------------------------- */

/* Vertices of the disk move to the values; z and the error become fields. */
static loxo_status move_disk(cli_run *run, extend_job *j)
{
    static const char *const names[3] = {"z_1", "z_2", "error"};
    loxo_field *fields = loxo_allocate(run->ctx, 3, sizeof *fields);
    if (fields == NULL) return LOXO_ERR_MEMORY;
    j->disk.fields = fields;
    for (int f = 0; f < 3; ++f) {
        double *value = loxo_allocate(run->ctx, j->n, sizeof *value);
        if (value == NULL) return LOXO_ERR_MEMORY;
        for (int64_t i = 0; i < j->n; ++i)
            value[i] = f < 2 ? j->z[2 * i + f] : j->values.error[i];
        fields[f] = (loxo_field){.value = value};
        (void)snprintf(fields[f].name, sizeof fields[f].name, "%s", names[f]);
        j->disk.n_fields = f + 1;
    }
    for (int64_t i = 0; i < j->n; ++i)
        for (int k = 0; k < 3; ++k)
            j->disk.position[3 * i + k] = k < j->curve.d ? j->values.w[i * j->curve.d + k] : 0.0;
    return LOXO_OK;
}

/* A polar grid of the disk as a field: its sign alternates from cell to cell, and 0, where a line is drawn, is on the grid. */
static loxo_status draw(cli_run *run, const extend_state *s, const char *path, const extend_job *j)
{
    loxo_draw_settings settings = s->draw;
    double *value = loxo_allocate(run->ctx, j->n, sizeof *value);
    if (value == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < j->n; ++i) {
        const double r = hypot(j->z[2 * i], j->z[2 * i + 1]), t = atan2(j->z[2 * i + 1], j->z[2 * i]);
        value[i] = 0.99 * tanh(3.0 * sin(RINGS * PI * r) * sin(0.5 * SECTORS * t));
    }
    settings.value_min = -1.0;
    settings.value_max = 1.0;
    if (j->curve.d == 2 && !cli_args_has_option(&run->args, loxo_options_find(loxo_draw_options, "azimuth")) &&
        !cli_args_has_option(&run->args, loxo_options_find(loxo_draw_options, "elevation"))) {
        /* from above, the first axis to the right */
        settings.elevation_deg = 90.0;
        settings.azimuth_deg = -90.0;
    }
    const loxo_status status = cli_picture(run, &j->disk, value, &settings, path);
    loxo_release(run->ctx, value);
    return status;
}

static loxo_status write_files(cli_run *run, const extend_state *s, extend_job *j)
{
    const char *path, *picture = cli_args_value(&run->args, "picture", 0);
    loxo_status status = cli_before_output(run);
    if (status >= 0) status = cli_write_values(run, j->n, 2, j->z, j->curve.d, &j->values);
    if (status < 0 || j->disk.n_vertices == 0) return status;
    status = move_disk(run, j);
    const double start_s = loxo_os_clock_s();
    for (int cursor = 0; status >= 0 && (path = cli_args_next(&run->args, "output", &cursor)) != NULL;) {
        loxo_write_settings write = loxo_write_settings_default();
        cli_kind kind = CLI_MESH;
        if (cli_is_table(path)) continue;
        status = cli_output_format(run, path, NULL, true, &write.format, &kind);
        if (status >= 0) status = loxo_write_mesh(run->ctx, path, &j->disk, &write);
        if (status >= 0) cli_wrote(run, path);
    }
    (void)cli_seconds(run, "write", start_s);
    if (status >= 0 && picture != NULL) status = draw(run, s, picture, j);
    return status;
}

/* Before anything is read. */
static loxo_status check(cli_run *run, bool is_at)
{
    const char *path, *picture = cli_args_value(&run->args, "picture", 0);
    loxo_status status = LOXO_OK;
    if (!cli_args_has(&run->args, "output") && picture == NULL && run->json_path == NULL && !run->common->estimate)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "extend: no output; give -o FILE, --picture or --json");
    if (is_at && picture != NULL)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "extend: a picture is one of the disk; it has no points of --at");
    for (int cursor = 0; status >= 0 && (path = cli_args_next(&run->args, "output", &cursor)) != NULL;) {
        loxo_format format;
        cli_kind kind = CLI_MESH;
        if (!cli_is_table(path) && is_at)
            return cli_fail(run, LOXO_ERR_UNSUPPORTED, "extend: values at points go to .csv or .npy, not '%s'", path);
        if (!cli_is_table(path)) status = cli_output_format(run, path, NULL, true, &format, &kind);
        if (status >= 0) status = cli_output(run, path);
    }
    return status >= 0 && picture != NULL ? cli_output(run, picture) : status;
}

static void estimate(cli_run *run, const extend_state *s, const extend_job *j)
{
    const size_t n = (size_t)s->extend.n_points, d = (size_t)j->curve.d;
    const size_t disk = n * (24 + 24) + n * 3 * 8, values = n * (8 * (d + 2 + 3) + 1);
    const size_t work = (size_t)run->common->n_threads * (size_t)s->extension.n_nodes * 8 * (d + 3);
    cli_estimate_part(run, "disk_bytes", disk);
    cli_estimate_part(run, "values_bytes", values);
    cli_estimate_part(run, "curve_bytes", (size_t)j->curve.n * 8 * (5 * d + 3));
    cli_estimate(run, disk + values + work + (size_t)j->curve.n * 8 * (5 * d + 3), NAN);
}

static loxo_status extend_main(cli_run *run, void *state)
{
    extend_state *s = state;
    extend_job j = {.n = 0};
    const char *at = cli_args_value(&run->args, "at", 0), *path;
    const bool is_ball = cli_args_has(&run->args, "map");
    loxo_status status = check(run, at != NULL || is_ball);
    if (status >= 0 && is_ball) {
        const loxo_sphere_extension_settings ball = {.piece = s->extend.piece,
                                                     .tolerance = s->extension.tolerance,
                                                     .max_iterations = s->extension.max_iterations};
        return cli_extend_ball(run, &ball);
    }
    if (status >= 0) status = read_curve(run, &s->extend, &j);
    if (status < 0) goto done;
    bool needs_mesh = cli_args_has(&run->args, "picture");
    for (int cursor = 0; (path = cli_args_next(&run->args, "output", &cursor)) != NULL;)
        needs_mesh = needs_mesh || !cli_is_table(path);
    if (needs_mesh && j.curve.d > 3) {
        status = cli_fail(run, LOXO_ERR_UNSUPPORTED,
                          "extend: a disk in %d dimensions is no surface: -o FILE.csv or .npy", j.curve.d);
        goto done;
    }
    if (s->common.estimate) {
        estimate(run, s, &j);
        goto done;
    }
    status = at != NULL ? cli_read_places(run, at, 2, &j.z, &j.co, &j.n) : make_disk(run, s->extend.n_points, &j);
    if (status >= 0 && (status = solve(run, &s->extension, &j)) >= 0) status = write_files(run, s, &j);
done:
    release(run, &j);
    return status;
}

static const cli_flag extend_flags[] = {
    {.name = "at",
     .values = "FILE",
     .n_values = 1,
     .reads = true,
     .help = "points of the disk: rows z_1,z_2 or z_1,z_2,1-|z|^2"},
    {.name = "map",
     .values = "MESH",
     .n_values = 1,
     .reads = true,
     .help = "CURVE is a triangulated sphere, and this its image: values at points of the ball"},
    {.name = "output",
     .letter = 'o',
     .values = "FILE",
     .n_values = 1,
     .repeats = true,
     .help = "the disk as .ply .obj .off .vtp .gii, or rows z, w, 1-|w|^2, bound, error, kind: .csv .npy"},
    {.name = "picture", .values = "FILE.png", .n_values = 1, .help = "the disk with a polar grid on it"},
    {.name = NULL},
};
static const cli_group extend_groups[] = {
    {"extend", extend_options, offsetof(extend_state, extend)},
    {"extension", loxo_extension_options, offsetof(extend_state, extension)},
    {"picture", loxo_draw_options, offsetof(extend_state, draw)},
    {.title = NULL},
};

const cli_command command_extend = {
    .name = "extend",
    .operands = "CURVE -o FILE [options]",
    .summary = "Douady and Earle's extension of a closed curve to the disk",
    .about = "CURVE has a sample of a closed curve on the unit sphere a row, .npy or text: 2 to 64 coordinates; or one "
             "column, angles of a\n"
             "map of the circle to itself. Each point of the disk gets the conformal barycenter of the curve as seen "
             "from it.\n"
             "kind is 0 inside, 1 on the circle, 2 where the curve rests for half of the measure, 3 where the search "
             "did not end.\n",
    .examples = "  loxo extend curve.npy -o disk.ply --picture disk.png --points 64309\n"
                "  loxo extend angles.csv --at points.csv -o values.csv\n"
                "  loxo extend sphere.ply --map image.ply --at points.csv -o values.csv\n",
    .min_operands = 1,
    .max_operands = 1,
    .flags = extend_flags,
    .groups = extend_groups,
    .state_bytes = sizeof(extend_state),
    .defaults = set_defaults,
    .main = extend_main,
};
