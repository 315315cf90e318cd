/* SPDX-License-Identifier: MIT
 * loxo register: a moving surface onto a fixed one, such that landmarks meet. */
#include "base/os.h"
#include "commands.h"
#include "register_picture.h"
#include "run.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct register_state {
    cli_common common;
    loxo_register_settings settings;
    loxo_draw_settings draw;
} register_state;

static void set_defaults(void *state)
{
    register_state *s = state;
    *s = (register_state){.settings = loxo_register_settings_default(), .draw = loxo_draw_settings_default()};
    s->draw.scale_bar = false;
    s->draw.n_isolines = 0;
    s->draw.width = 1500;
    s->draw.height = 500;
}

/* ---- what comes in --------------------------------------------------------------------------------------------- */

/* Landmarks of a surface: those of its own flag, and those for both. */
static loxo_status read_landmarks(cli_run *run, const char *flag, const char *surface, cli_surface *side)
{
    const char *const flags[] = {"landmarks", flag};
    const char *path;
    loxo_status status = LOXO_OK;
    for (int i = 0; i < 2; ++i)
        for (int cursor = 0; status >= 0 && (path = cli_args_next(&run->args, flags[i], &cursor)) != NULL;)
            status = loxo_read_landmarks(run->ctx, path, side->soup.n_vertices, &side->landmarks);
    if (status < 0) return status;
    double away = 0.0;
    run->input = surface;
    status = loxo_landmarks_locate(side->mesh, &side->landmarks, &away);
    if (status < 0) return status;
    report_row(&run->report, "landmarks", "%s points on %s%s in %s%s", text_count(side->landmarks.n_points),
               text_count(side->landmarks.n_curves), side->landmarks.n_curves == 1 ? " curve" : " curves",
               text_path(surface), away > 0.0 ? ", brought onto it" : "");
    return status;
}

static loxo_status read_side(cli_run *run, int operand, const char *flag, cli_surface *side)
{
    const char *path = run->args.operand[operand];
    loxo_status status;
    run->input = path;
    if (operand == 0) {
        status = cli_read_mesh(run, path, &side->soup);
    } else {
        const double start_s = loxo_os_clock_s();
        status = loxo_read_mesh(run->ctx, path, NULL, &side->soup);
        json_put_text(run->report.json, "moving", path);
        (void)cli_seconds(run, "read_moving", start_s);
        if (status >= 0)
            report_row(&run->report, "moving", "%s  %s vertices, %s faces", text_path(path),
                       text_count(side->soup.n_vertices), text_count(side->soup.n_faces));
    }
    if (status < 0) return status;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&side->soup);
    status = loxo_mesh_create(run->ctx, &arrays, LOXO_BORROW, NULL, NULL, &side->mesh);
    return status < 0 ? status : read_landmarks(run, flag, path, side);
}

static void release(cli_run *run, cli_surface *side)
{
    loxo_release(run->ctx, side->map);
    loxo_landmarks_destroy(run->ctx, &side->landmarks);
    loxo_mesh_destroy(side->mesh);
    loxo_soup_destroy(run->ctx, &side->soup);
}

/* ---- work ------------------------------------------------------------------------------------------------------ */

typedef struct register_job {
    cli_surface fixed, moving;
    double *position;          /* of the moving surface's vertices on the fixed one */
    double *field, *resampled; /* of the moving surface, and on the fixed one's vertices; NULL: not asked for */
} register_job;

static void put_phases(json_t *object, const loxo_register_info *info)
{
    for (int i = 0; i < LOXO_REGISTER_N_PHASES; ++i) {
        char key[32];
        (void)snprintf(key, sizeof key, "%s_s", loxo_register_phase_name((loxo_register_phase)i));
        json_put_number(object, key, info->phase_s[i]);
    }
}

static void tell(cli_run *run, const loxo_register_info *info)
{
    json_t *o = json_put_object(run->report.json, "registration");
    json_put_text(o, "stop", loxo_sphere_stop_name(info->stop_reason));
    json_put_integer(o, "n_iterations", info->n_iterations);
    json_put_integer(o, "n_evaluations", info->n_evaluations);
    json_put_integer(o, "n_linear_steps", info->n_linear_steps);
    json_put_number(o, "objective", info->objective);
    json_put_number(o, "residual", info->residual);
    json_put_integer(o, "n_curves", info->n_curves);
    json_put_integer(o, "n_unpaired", info->n_unpaired);
    json_put_integer(o, "n_landmarks", info->n_landmarks);
    json_put_number(o, "energy_start", info->energy_start);
    json_put_number(o, "loss_start", info->loss_start);
    json_put_number(o, "energy", info->energy);
    json_put_number(o, "loss", info->loss);
    json_put_number(o, "landmark_max", info->landmark_max);
    json_put_integer(o, "n_folds", info->n_folds);
    json_put_integer(o, "degree", info->degree);
    json_put_integer(o, "n_held", info->n_held);
    json_put_integer(o, "n_outside", info->n_outside);
    put_phases(o, info);
    json_put_number(o, "total_s", info->total_s);
    report_row(&run->report, "turned", "energy %.4e, registration loss %.4e", info->energy_start, info->loss_start);
    report_row(&run->report, "registered", "energy %.4e, registration loss %.4e, %lld steps (%s), residual %.1e",
               info->energy, info->loss, (long long)info->n_iterations, loxo_sphere_stop_name(info->stop_reason),
               info->residual);
    report_row(&run->report, "check", "%s folds, degree %d; landmarks within %.4f of their targets on the sphere",
               text_count(info->n_folds), info->degree, info->landmark_max);
    report_row(
        &run->report, "time", "map %s, landmarks %s, move %s, locate %s",
        text_seconds(info->phase_s[LOXO_REGISTER_PHASE_MAP]), text_seconds(info->phase_s[LOXO_REGISTER_PHASE_SAMPLE]),
        text_seconds(info->phase_s[LOXO_REGISTER_PHASE_MOVE]), text_seconds(info->phase_s[LOXO_REGISTER_PHASE_LOCATE]));
    if (info->n_outside > 0)
        cli_warn(run, info->n_outside,
                 "%lld vertices lie in no triangle of the fixed surface's map: they got the nearest point",
                 (long long)info->n_outside);
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Surfaces of one triangulation: how far every vertex ends from the fixed surface's vertex of its number. */
static loxo_status tell_truth(cli_run *run, const register_job *j)
{
    const loxo_soup *fixed = &j->fixed.soup, *moving = &j->moving.soup;
    const int64_t n = fixed->n_vertices;
    if (n != moving->n_vertices || fixed->n_faces != moving->n_faces ||
        memcmp(fixed->triangle, moving->triangle, (size_t)fixed->n_faces * 3 * sizeof *fixed->triangle) != 0)
        return cli_fail(run, LOXO_ERR_MESH, "register: --truth takes two surfaces of one triangulation");
    double *away = loxo_allocate(run->ctx, n, sizeof *away), sum = 0.0;
    if (away == NULL) return LOXO_ERR_MEMORY;
    for (int64_t v = 0; v < n; ++v) {
        double square = 0.0;
        for (int64_t k = 0; k < 3; ++k) {
            const double x =
                fixed->position != NULL ? fixed->position[3 * v + k] : (double)fixed->position_float[3 * v + k];
            square += (j->position[3 * v + k] - x) * (j->position[3 * v + k] - x);
        }
        away[v] = sqrt(square);
        sum += away[v];
    }
    qsort(away, (size_t)n, sizeof *away, by_size);
    json_t *o = json_put_object(run->report.json, "truth");
    json_put_number(o, "mean", sum / (double)n);
    json_put_number(o, "median", away[n / 2]);
    json_put_number(o, "percentile_90", away[9 * n / 10]);
    json_put_number(o, "max", away[n - 1]);
    report_row(&run->report, "truth", "vertices are off by %.4g at the median, 90 %% within %.4g, all within %.4g",
               away[n / 2], away[9 * n / 10], away[n - 1]);
    loxo_release(run->ctx, away);
    return LOXO_OK;
}

static loxo_status resample(cli_run *run, register_job *j)
{
    const int64_t n = j->fixed.soup.n_vertices;
    loxo_sphere_locator *locator = NULL;
    loxo_surface_point *point = loxo_allocate(run->ctx, n, sizeof *point);
    loxo_status status = LOXO_ERR_MEMORY;
    j->resampled = loxo_allocate(run->ctx, n, sizeof *j->resampled);
    if (point == NULL || j->resampled == NULL) goto done;
    status = loxo_sphere_locator_create(run->ctx, j->moving.mesh, j->moving.map, &locator);
    if (status >= 0) status = loxo_sphere_locate(locator, n, j->fixed.map, point, NULL);
    if (status >= 0)
        status = loxo_surface_interpolate(run->ctx, n, point, j->moving.soup.n_vertices, 1, j->field, j->resampled);
done:
    loxo_sphere_locator_destroy(locator);
    loxo_release(run->ctx, point);
    return status;
}

static loxo_status solve(cli_run *run, const register_state *s, register_job *j)
{
    const int64_t n_fixed = j->fixed.soup.n_vertices, n = j->moving.soup.n_vertices;
    loxo_register *registration = NULL;
    loxo_register_info info;
    loxo_status status = LOXO_ERR_MEMORY;
    double start_s = loxo_os_clock_s();
    j->position = loxo_allocate(run->ctx, 3 * n, sizeof *j->position);
    j->moving.map = loxo_allocate(run->ctx, 3 * n, sizeof *j->moving.map);
    j->fixed.map = loxo_allocate(run->ctx, 3 * n_fixed, sizeof *j->fixed.map);
    if (j->position == NULL || j->moving.map == NULL || j->fixed.map == NULL) return status;
    run->input = run->args.operand[0];
    status = loxo_register_create(run->ctx, j->fixed.mesh, &j->fixed.landmarks, &s->settings, NULL, &registration);
    if (status < 0) return status;
    (void)cli_combine(run, status);
    start_s = cli_seconds(run, "fixed", start_s);
    memcpy(j->fixed.map, loxo_register_fixed_map(registration), (size_t)(3 * n_fixed) * sizeof(double));
    run->input = run->args.operand[1];
    status = loxo_register_solve(registration, j->moving.mesh, &j->moving.landmarks, j->moving.map, NULL, j->position,
                                 &info);
    loxo_register_destroy(registration);
    if (status < 0) return status;
    (void)cli_combine(run, status);
    (void)cli_seconds(run, "register", start_s);
    tell(run, &info);
    if (cli_args_has(&run->args, "truth")) status = tell_truth(run, j);
    if (status >= 0 && j->field != NULL) status = resample(run, j);
    return status;
}

/* ---- what goes out --------------------------------------------------------------------------------------------- */

static const char *const mesh_outputs[] = {"output", "sphere", "fixed-sphere"};

/* Before anything is read. */
static loxo_status check(cli_run *run)
{
    const char *picture = cli_args_value(&run->args, "picture", 0);
    const char *field = cli_args_value(&run->args, "field-output", 0);
    bool has_any = run->json_path != NULL || picture != NULL || field != NULL;
    loxo_format format;
    loxo_status status = LOXO_OK;
    if (!cli_args_has(&run->args, "landmarks") &&
        !(cli_args_has(&run->args, "fixed-landmarks") && cli_args_has(&run->args, "moving-landmarks")))
        return cli_fail(run, LOXO_ERR_ARGUMENT,
                        "register: no landmarks; give --landmarks for both surfaces, or --fixed-landmarks and "
                        "--moving-landmarks");
    for (size_t i = 0; i < sizeof mesh_outputs / sizeof *mesh_outputs && status >= 0; ++i) {
        const char *path = cli_args_value(&run->args, mesh_outputs[i], 0);
        cli_kind kind = CLI_MESH;
        if (path == NULL) continue;
        has_any = true;
        status = cli_output_format(run, path, NULL, true, &format, &kind);
        if (status >= 0) status = cli_output(run, path);
    }
    if (status < 0) return status;
    if (!has_any)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "register: no output; give -o FILE, another of its files, or --json");
    if (field != NULL && !cli_args_has(&run->args, "field"))
        return cli_fail(run, LOXO_ERR_ARGUMENT, "register: --field-output without --field");
    if (field != NULL) {
        cli_kind kind = CLI_FIELD;
        status = cli_output_format(run, field, NULL, false, &format, &kind);
        if (status >= 0 && kind != CLI_FIELD)
            status =
                cli_fail(run, LOXO_ERR_UNSUPPORTED, "register: a field goes to .npy, .csv or .gii, not '%s'", field);
        if (status >= 0) status = cli_output(run, field);
    }
    return status >= 0 && picture != NULL ? cli_output(run, picture) : status;
}

/* Triangles of a surface at other positions. */
static loxo_status write_mesh(cli_run *run, const char *flag, const loxo_soup *surface, double *position)
{
    const char *path = cli_args_value(&run->args, flag, 0);
    loxo_write_settings write = loxo_write_settings_default();
    cli_kind kind = CLI_MESH;
    loxo_soup moved = *surface;
    moved.position = position;
    moved.position_float = NULL;
    if (path == NULL) return LOXO_OK;
    loxo_status status = cli_output_format(run, path, NULL, true, &write.format, &kind);
    if (status >= 0) status = loxo_write_mesh(run->ctx, path, &moved, &write);
    if (status >= 0) cli_wrote(run, path);
    return status;
}

static loxo_status write_field(cli_run *run, const register_job *j)
{
    const char *path = cli_args_value(&run->args, "field-output", 0);
    loxo_write_settings write = loxo_write_settings_default();
    cli_kind kind = CLI_FIELD;
    if (path == NULL) return LOXO_OK;
    loxo_status status = cli_output_format(run, path, NULL, false, &write.format, &kind);
    if (status >= 0)
        status = loxo_write_field(run->ctx, path, "resampled", j->resampled, j->fixed.soup.n_vertices, &write);
    if (status >= 0) cli_wrote(run, path);
    return status;
}

static loxo_status write_files(cli_run *run, const register_state *s, register_job *j)
{
    const char *picture = cli_args_value(&run->args, "picture", 0);
    loxo_status status = cli_before_output(run);
    const double start_s = loxo_os_clock_s();
    if (status >= 0) status = write_mesh(run, "output", &j->moving.soup, j->position);
    if (status >= 0) status = write_mesh(run, "sphere", &j->moving.soup, j->moving.map);
    if (status >= 0) status = write_mesh(run, "fixed-sphere", &j->fixed.soup, j->fixed.map);
    if (status >= 0) status = write_field(run, j);
    (void)cli_seconds(run, "write", start_s);
    if (status >= 0 && picture != NULL)
        status = cli_register_picture(run, &j->fixed, &j->moving, j->position, &s->draw, picture);
    return status;
}

static loxo_status read_field(cli_run *run, register_job *j)
{
    const char *path = cli_args_value(&run->args, "field", 0);
    int64_t n = 0;
    if (path == NULL) return LOXO_OK;
    const loxo_status status = loxo_read_field(run->ctx, path, &j->field, &n);
    if (status < 0 || n == j->moving.soup.n_vertices) return status;
    return cli_fail_at(run, LOXO_ERR_MALFORMED, path, 0, "%lld values, the moving surface has %lld vertices",
                       (long long)n, (long long)j->moving.soup.n_vertices);
}

static loxo_status register_main(cli_run *run, void *state)
{
    const register_state *s = state;
    register_job j = {.position = NULL};
    if (s->common.estimate) return cli_fail(run, LOXO_ERR_UNSUPPORTED, "register: no estimates");
    loxo_status status = check(run);
    if (status >= 0) status = read_side(run, 0, "fixed-landmarks", &j.fixed);
    if (status >= 0) status = read_side(run, 1, "moving-landmarks", &j.moving);
    if (status >= 0) status = read_field(run, &j);
    if (status >= 0) status = solve(run, s, &j);
    if (status >= 0) status = write_files(run, s, &j);
    loxo_release(run->ctx, j.resampled);
    loxo_release(run->ctx, j.field);
    loxo_release(run->ctx, j.position);
    release(run, &j.moving);
    release(run, &j.fixed);
    return status;
}

static const cli_flag register_flags[] = {
    {.name = "landmarks",
     .values = "FILE",
     .n_values = 1,
     .repeats = true,
     .reads = true,
     .help = "landmarks of both surfaces, which have one triangulation: .border, or csv"},
    {.name = "fixed-landmarks",
     .values = "FILE",
     .n_values = 1,
     .repeats = true,
     .reads = true,
     .help = "those of FIXED; rows of csv are name,vertex or name,x,y,z or name, three vertices, three weights"},
    {.name = "moving-landmarks",
     .values = "FILE",
     .n_values = 1,
     .repeats = true,
     .reads = true,
     .help = "those of MOVING, of the same names"},
    {.name = "output",
     .letter = 'o',
     .values = "FILE",
     .n_values = 1,
     .help = "MOVING's triangles with its vertices on FIXED; - is standard output"},
    {.name = "sphere", .values = "FILE", .n_values = 1, .help = "MOVING's triangles on the sphere, registered"},
    {.name = "fixed-sphere", .values = "FILE", .n_values = 1, .help = "FIXED's triangles on the sphere"},
    {.name = "field", .values = "FILE", .n_values = 1, .reads = true, .help = "one number a vertex of MOVING ..."},
    {.name = "field-output", .values = "FILE", .n_values = 1, .help = "... and the same on the vertices of FIXED"},
    {.name = "truth", .help = "both have one triangulation: tell how far vertices end from their own numbers"},
    {.name = "picture",
     .values = "FILE.png",
     .n_values = 1,
     .help = "MOVING, its sphere and it on FIXED, with the landmarks; and FIXED"},
    {.name = NULL},
};
static const cli_group register_groups[] = {
    {"register", loxo_register_options, offsetof(register_state, settings)},
    {"sphere", loxo_sphere_options, offsetof(register_state, settings) + offsetof(loxo_register_settings, sphere)},
    {"picture", loxo_draw_options, offsetof(register_state, draw)},
    {.title = NULL},
};
static const cli_need register_needs[] = {
    {"picture", "picture"},
    {"field", "field-output"},
    {.name = NULL},
};

const cli_command command_register = {
    .name = "register",
    .operands = "FIXED MOVING --landmarks FILE .. -o OUT [options]",
    .summary = "one closed surface onto another, landmarks onto landmarks",
    .about = "FIXED and MOVING are closed surfaces of genus 0. Both are mapped to the sphere; MOVING's map is then "
             "changed, as\n"
             "little in its angles as can be, to bring its landmarks to those of FIXED, by name. Curves of different "
             "numbers of\n"
             "points are cut to the same number, evenly in length.\n",
    .examples =
        "  loxo register atlas.gii subject.gii --landmarks cs.border --landmarks sf.border -o registered.ply\n"
        "  loxo register a.ply b.ply --fixed-landmarks a.csv --moving-landmarks b.csv --lambda 10 -o b-on-a.ply\n",
    .min_operands = 2,
    .max_operands = 2,
    .flags = register_flags,
    .groups = register_groups,
    .needs = register_needs,
    .state_bytes = sizeof(register_state),
    .defaults = set_defaults,
    .main = register_main,
};
