/* SPDX-License-Identifier: MIT
 * loxo sphere: the conformal map of a closed surface to the unit sphere. */
#include "barycenter_report.h"
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "extend_ball.h"
#include "intrinsic.h"
#include "picture.h"
#include "run.h"
#include "sphere_pictures.h"
#include "sphere_report.h"

#include <math.h>

typedef struct sphere_state {
    cli_common common;
    loxo_mesh_settings mesh;
    loxo_sphere_settings sphere;
    loxo_draw_settings draw;
} sphere_state;

static void set_defaults(void *state)
{
    *(sphere_state *)state = (sphere_state){.mesh = loxo_mesh_settings_default(),
                                            .sphere = loxo_sphere_settings_default(),
                                            .draw = cli_sphere_draw_default()};
}

/* One file that receives the map: a mesh, or a table of points. */
typedef struct output {
    const char *path;
    bool is_table;
    loxo_write_settings write;
} output;

typedef struct job {
    output out[CLI_MAX_FILES];
    int n_out;
    const char *picture;
    loxo_soup surface;
    double *map;         /* [n][3] */
    double *angle_error; /* [n] degrees, for the picture; NULL: not known */
} job;

static loxo_status check_files(cli_run *run, bool is_estimate, job *j)
{
    const char *path;
    loxo_status status;
    for (int cursor = 0; (path = cli_args_next(&run->args, "output", &cursor)) != NULL;) {
        output o = {.path = path, .is_table = cli_is_table(path), .write = loxo_write_settings_default()};
        cli_kind kind = CLI_MESH;
        if (!o.is_table && (status = cli_output_format(run, path, NULL, true, &o.write.format, &kind)) < 0)
            return status;
        if ((status = cli_output(run, path)) < 0) return status; /* refuses more than fit */
        j->out[j->n_out++] = o;
    }
    j->picture = cli_args_value(&run->args, "picture", 0);
    if (j->picture != NULL && (status = cli_output(run, j->picture)) < 0) return status;
    if (j->n_out == 0 && j->picture == NULL && run->json_path == NULL && !is_estimate)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "sphere: no output; give -o FILE, --picture or --json");
    return LOXO_OK;
}

static loxo_status estimate(cli_run *run, const sphere_state *s)
{
    loxo_mesh_counts counts;
    size_t mesh_bytes = 0, build_bytes = 0, work_bytes = 0;
    loxo_status status = cli_count_mesh(run, run->args.operand[0], &counts);
    if (status >= 0)
        status =
            loxo_mesh_estimate(counts.n_vertices, counts.n_faces, counts.is_float, &s->mesh, &mesh_bytes, &build_bytes);
    if (status >= 0)
        status = loxo_sphere_estimate(run->ctx, counts.n_vertices, counts.n_faces, &s->sphere, &work_bytes);
    if (status < 0) return status;
    const size_t arrays = cli_counts_bytes(&counts), map = (size_t)counts.n_vertices * 3 * sizeof(double);
    const size_t solve = arrays + mesh_bytes + work_bytes + map, build = arrays + build_bytes;
    const size_t before = build > counts.read_bytes ? build : counts.read_bytes;
    cli_estimate_part(run, "read_bytes", counts.read_bytes);
    cli_estimate_part(run, "arrays_bytes", arrays);
    cli_estimate_part(run, "mesh_bytes", mesh_bytes);
    cli_estimate_part(run, "workspace_bytes", work_bytes);
    cli_estimate(run, solve > before ? solve : before, NAN);
    return LOXO_OK;
}

/* ---- what is told ---------------------------------------------------------------------------------------------- */

static void tell_solve(cli_run *run, const loxo_sphere_info *info)
{
    json_t *o = json_put_object(run->report.json, "solve"), *phases;
    json_put_text(o, "method", loxo_sphere_method_name(info->method));
    const bool has_start = info->start != LOXO_SPHERE_START_AUTO;
    if (has_start) json_put_text(o, "start", loxo_sphere_start_name(info->start));
    json_put_text(o, "stop", loxo_sphere_stop_name(info->stop_reason));
    json_put_integer(o, "iterations", info->n_iterations);
    json_put_integer(o, "evaluations", info->n_evaluations);
    json_put_integer(o, "linear_steps", info->n_linear_steps);
    json_put_number(o, "objective", info->objective);
    json_put_number(o, "residual", info->residual);
    if (has_start) json_put_number(o, "energy_start", info->energy_start);
    json_put_number(o, "energy", info->energy);
    json_put_number(o, "image_area", info->image_area);
    if (has_start) json_put_integer(o, "folds_start", info->n_folds_start);
    json_put_integer(o, "folds_unmended", info->n_folds_unmended);
    json_put_integer(o, "folds", info->n_folds);
    json_put_integer(o, "held", info->n_held);
    json_put_integer(o, "degree", info->degree);
    json_put_number(o, "total_s", info->total_s);
    json_put_integer(o, "workspace_bytes", (int64_t)info->workspace_bytes);
    phases = json_put_object(o, "seconds");
    for (int k = 0; k < LOXO_SPHERE_N_PHASES; ++k)
        json_put_number(phases, loxo_sphere_phase_name((loxo_sphere_phase)k), info->phase_s[k]);
    cli_put_barycenter(json_put_object(o, "center"), &info->center.barycenter, 3);
    report_row(&run->report, "method", "%s%s%s; %s after %lld steps and %lld linear ones",
               loxo_sphere_method_name(info->method), has_start ? " from " : "",
               has_start ? loxo_sphere_start_name(info->start) : "", loxo_sphere_stop_name(info->stop_reason),
               (long long)info->n_iterations, (long long)info->n_linear_steps);
    if (has_start)
        report_row(&run->report, "start", "energy %.6g, %lld triangles turned over", info->energy_start,
                   (long long)info->n_folds_start);
    report_row(&run->report, "energy", "%.6g as found, %.6g as written", info->energy, info->objective);
    report_row(&run->report, "one to one", "%lld triangles turned over, %lld before they were mended; degree %d",
               (long long)info->n_folds, (long long)info->n_folds_unmended, info->degree);
    if (info->n_held > 0)
        report_row(&run->report, "held", "%lld vertices, at triangles that the energy would turn over",
                   (long long)info->n_held);
    report_row(&run->report, "time", "%s: start %s, steps %s", text_seconds(info->total_s),
               text_seconds(info->phase_s[LOXO_SPHERE_PHASE_START]),
               text_seconds(info->phase_s[LOXO_SPHERE_PHASE_ITERATE]));
}

static loxo_status measure(cli_run *run, job *j)
{
    loxo_sphere_map_measure m;
    const loxo_mesh_arrays surface = loxo_soup_arrays(&j->surface);
    if (j->picture != NULL &&
        (j->angle_error = loxo_allocate(run->ctx, surface.n_vertices, sizeof *j->angle_error)) == NULL)
        return LOXO_ERR_MEMORY;
    const loxo_sphere_map_fields fields = {.vertex_angle_error_deg = j->angle_error};
    const loxo_status status = loxo_measure_sphere_map(run->ctx, &surface, j->map, &m, &fields);
    if (status >= 0) cli_tell_sphere_map(run, "map", "map", true, &m);
    return status;
}

/* ---- the work ---------------------------------------------------------------------------------------------------- */

/* The surface as arrays, for results, and as the mesh that is solved on. */
static loxo_status read_surface(cli_run *run, const sphere_state *s, job *j, loxo_mesh **mesh)
{
    loxo_status status = cli_read_mesh(run, run->args.operand[0], &j->surface);
    if (status < 0) return status;
    const double start_s = loxo_os_clock_s();
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&j->surface);
    status = loxo_mesh_create(run->ctx, &arrays, LOXO_BORROW, &s->mesh, NULL, mesh);
    if (status >= 0) (void)cli_seconds(run, "half-edges", start_s);
    return status;
}

static loxo_status solve(cli_run *run, const sphere_state *s, const loxo_mesh *mesh, job *j, loxo_status *found)
{
    const loxo_intrinsic_settings how = {.flip_tolerance = 1e-10, .mollify = 1e-9};
    const char *from = cli_args_value(&run->args, "from", 0);
    loxo_sphere_settings settings = s->sphere;
    loxo_mesh *intrinsic = NULL;
    loxo_sphere *sphere = NULL;
    loxo_sphere_info info;
    loxo_status status = LOXO_OK;
    if (from != NULL) {
        settings.start = LOXO_SPHERE_START_GIVEN;
        status = cli_read_sphere_map(run, from, &j->surface, true, &j->map);
    } else if ((j->map = loxo_allocate(run->ctx, 3 * j->surface.n_vertices, sizeof *j->map)) == NULL) {
        status = LOXO_ERR_MEMORY;
    }
    if (status < 0) return status;
    if (cli_args_has(&run->args, "intrinsic")) {
        status = cli_make_intrinsic(run, mesh, &how, &intrinsic);
        if (status >= 0) status = loxo_sphere_create_intrinsic(run->ctx, mesh, intrinsic, &settings, &sphere);
        loxo_mesh_destroy(intrinsic);
    } else {
        status = loxo_sphere_create(run->ctx, mesh, &settings, &sphere);
    }
    if (status >= 0) *found = loxo_sphere_solve(sphere, from != NULL ? j->map : NULL, j->map, &info);
    loxo_sphere_destroy(sphere);
    if (status < 0) return status;
    if (*found >= 0) tell_solve(run, &info);
    return cli_combine(run, *found);
}

/* Positions of the surface become those of the map. */
static void take_map(cli_run *run, job *j)
{
    loxo_release(run->ctx, j->surface.position);
    loxo_release(run->ctx, j->surface.position_float);
    j->surface.position = j->map;
    j->surface.position_float = NULL;
    j->map = NULL;
}

static loxo_status write_files(cli_run *run, const sphere_state *s, job *j)
{
    loxo_status status = cli_before_output(run);
    const double start_s = loxo_os_clock_s();
    const int64_t n = j->surface.n_vertices;
    take_map(run, j);
    for (int k = 0; k < j->n_out && status >= 0; ++k) {
        status = j->out[k].is_table ? loxo_write_matrix(run->ctx, j->out[k].path, j->surface.position, n, 3)
                                    : loxo_write_mesh(run->ctx, j->out[k].path, &j->surface, &j->out[k].write);
        if (status >= 0) cli_wrote(run, j->out[k].path);
    }
    if (status >= 0 && j->picture != NULL) {
        const loxo_mesh_arrays image = loxo_soup_arrays(&j->surface);
        loxo_draw_settings draw = s->draw;
        draw.unit = "degrees";
        status = cli_sphere_picture(run, &image, j->angle_error, "angle error", &draw, j->picture);
    }
    if (status >= 0) (void)cli_seconds(run, "write", start_s);
    return status;
}

/* Options that the method does not look at. */
static loxo_status check_options(cli_run *run, const sphere_state *s)
{
    const bool has_from = cli_args_has(&run->args, "from");
    const bool has_start = s->sphere.method == LOXO_SPHERE_NEWTON || s->sphere.method == LOXO_SPHERE_HBTR;
    if (s->sphere.start == LOXO_SPHERE_START_GIVEN && !has_from)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "sphere: --start given wants the map to begin with, --from FILE");
    if (has_from && s->sphere.start != LOXO_SPHERE_START_AUTO && s->sphere.start != LOXO_SPHERE_START_GIVEN)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "sphere: --from gives the start, --start %s another",
                        loxo_sphere_start_name(s->sphere.start));
    for (const loxo_option *o = loxo_sphere_options; o->name != NULL; ++o)
        if (cli_args_has_option(&run->args, o) && !loxo_option_is_of_method(loxo_sphere_options, o, &s->sphere))
            cli_warn(run, 1, "--%s changes nothing in method %s", o->name, loxo_sphere_method_name(s->sphere.method));
    if (has_from && !has_start)
        cli_warn(run, 1, "--from changes nothing in method %s", loxo_sphere_method_name(s->sphere.method));
    return LOXO_OK;
}

static loxo_status sphere_main(cli_run *run, void *state)
{
    sphere_state *s = state;
    job j = {.n_out = 0};
    loxo_mesh *mesh = NULL;
    loxo_status status = check_files(run, s->common.estimate, &j), found = LOXO_OK;
    if (status < 0) return status;
    if (s->common.estimate) return estimate(run, s);
    if ((status = check_options(run, s)) < 0) return status;
    status = read_surface(run, s, &j, &mesh);
    if (status >= 0) status = solve(run, s, mesh, &j, &found);
    loxo_mesh_destroy(mesh);
    if (status >= 0 && found >= 0 && found != LOXO_STOPPED) status = measure(run, &j);
    if (status >= 0) status = write_files(run, s, &j);
    loxo_release(run->ctx, j.angle_error);
    loxo_release(run->ctx, j.map);
    loxo_soup_destroy(run->ctx, &j.surface);
    return status;
}

static const cli_flag sphere_flags[] = {
    {.name = "output",
     .letter = 'o',
     .values = "FILE",
     .n_values = 1,
     .repeats = true,
     .help = "where to: a mesh, or points as .npy .csv; - is standard output"},
    {.name = "from", .values = "MAP", .n_values = 1, .reads = true, .help = "begin with this map of the surface"},
    {.name = "intrinsic",
     .help =
         "weights of the intrinsic Delaunay triangulation: never negative; the energy told is that of these weights"},
    {.name = "picture",
     .values = "FILE.png",
     .n_values = 1,
     .help = "the sphere, front and back, coloured by angle error"},
    {.name = NULL},
};
static const cli_group sphere_groups[] = {
    {"sphere", loxo_sphere_options, offsetof(sphere_state, sphere)},
    {"mesh", loxo_mesh_options, offsetof(sphere_state, mesh)},
    {"picture", loxo_draw_options, offsetof(sphere_state, draw)},
    {.title = NULL},
};
static const cli_need sphere_needs[] = {{"picture", "picture"}, {NULL, NULL}};

const cli_command command_sphere = {
    .name = "sphere",
    .operands = "SURFACE -o SPHERE [options]",
    .summary = "conformal map of a closed surface of genus 0 to the unit sphere",
    .about = "SPHERE has the surface's triangles, with its vertices on the unit sphere, where angles are changed as "
             "little as\n"
             "can be and no triangle is turned over. The surface is one closed piece without handles.\n",
    .examples = "  loxo sphere brain.ply -o sphere.ply --json -\n"
                "  loxo sphere brain.gii --method hbtr -o sphere.gii\n"
                "  loxo sphere scan.obj --intrinsic -o sphere.npy --picture sphere.png\n",
    .min_operands = 1,
    .max_operands = 1,
    .flags = sphere_flags,
    .groups = sphere_groups,
    .needs = sphere_needs,
    .state_bytes = sizeof(sphere_state),
    .defaults = set_defaults,
    .main = sphere_main,
};
