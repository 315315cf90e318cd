/* SPDX-License-Identifier: MIT
 * loxo barycenter: the conformal barycenter of weighted points of the sphere. */
#include "barycenter_report.h"
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "run.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

typedef struct barycenter_state {
    cli_common common;
    loxo_barycenter_settings barycenter;
} barycenter_state;

static void set_defaults(void *state)
{
    *(barycenter_state *)state = (barycenter_state){.barycenter = loxo_barycenter_settings_default()};
}

static void tell(cli_run *run, const loxo_barycenter_info *info, int d)
{
    char text[96] = "";
    int used = 0;
    cli_put_barycenter(json_put_object(run->report.json, "barycenter"), info, d);
    for (int k = 0; k < d && k < 4; ++k)
        used += snprintf(text + used, sizeof text - (size_t)used, "%.6g ", info->w[k]);
    report_row(&run->report, "barycenter", "%s%s1 - |w| %.4g, %s", text, d > 4 ? "... " : "", info->gap,
               loxo_barycenter_class_name(info->kind));
    report_row(&run->report, "certified", "within %.1e; least eigenvalue %.4g, q %.1e, %lld steps, %s", info->bound,
               info->lambda_min, info->q, (long long)info->n_iterations, text_seconds(info->total_s));
    if (info->kind == LOXO_BARYCENTER_NONE)
        cli_warn(run, 1, "half of the weight or more is in one point: there is no barycenter, that point is told");
    if (info->kind == LOXO_BARYCENTER_NOT_UNIQUE)
        cli_warn(run, 1, "two points have half of the weight each: every point of the geodesic between them is one");
}

static loxo_status read_weights(cli_run *run, int64_t n, double **weight)
{
    const char *path = cli_args_value(&run->args, "weights", 0);
    int64_t n_weights = 0;
    if (path == NULL) return LOXO_OK;
    json_put_text(run->report.json, "weights", path);
    const loxo_status status = loxo_read_field(run->ctx, path, weight, &n_weights);
    if (status >= 0 && n_weights != n)
        return cli_fail_at(run, LOXO_ERR_ARGUMENT, path, 0, "holds %lld weights, there are %lld points",
                           (long long)n_weights, (long long)n);
    return status;
}

/* The atoms as they lie around the barycenter. */
static loxo_status write_centred(cli_run *run, const char *path, const loxo_barycenter_info *info, loxo_array *atoms)
{
    loxo_status status = cli_before_output(run);
    if (status < 0) return status;
    status = loxo_moebius_map_sphere(run->ctx, &info->map, atoms->shape[0], atoms->value, atoms->value);
    if (status >= 0) status = loxo_write_array(run->ctx, path, atoms->value, 2, atoms->shape);
    if (status >= 0) cli_wrote(run, path);
    return status;
}

static loxo_status check_shape(cli_run *run, const loxo_array *atoms)
{
    if (atoms->n_dimensions == 2 && atoms->shape[1] >= 2 && atoms->shape[1] <= LOXO_BARYCENTER_MOST_DIMENSIONS)
        return LOXO_OK;
    return cli_fail_at(run, LOXO_ERR_UNSUPPORTED, run->input, 0, "not rows of 2 to %d coordinates",
                       LOXO_BARYCENTER_MOST_DIMENSIONS);
}

/* Points, weights, and the points once more where the search has to shift them. */
static loxo_status estimate(cli_run *run)
{
    loxo_array atoms;
    size_t read_bytes = 0;
    loxo_status status = cli_count_array(run, run->args.operand[0], &atoms, &read_bytes);
    if (status >= 0) status = check_shape(run, &atoms);
    if (status < 0) return status;
    const size_t n = (size_t)atoms.shape[0], d = (size_t)atoms.shape[1];
    const size_t points = n * d * sizeof(double);
    const size_t weights = cli_args_has(&run->args, "weights") ? n * sizeof(double) : 0;
    const size_t sums = (n / 4096 + 1) * (1 + d + d * (d + 1) / 2) * sizeof(double);
    const size_t work = 2 * points + weights + sums + CLI_ESTIMATE_FIXED;
    cli_estimate_part(run, "read_bytes", read_bytes);
    cli_estimate_part(run, "points_bytes", points + weights);
    cli_estimate_part(run, "work_bytes", points + sums + CLI_ESTIMATE_FIXED);
    cli_estimate(run, work > read_bytes ? work : read_bytes, NAN);
    return LOXO_OK;
}

/* Of two files the one that holds what was refused. */
static loxo_status blame(cli_run *run, loxo_status status, const char *points, const double *weight)
{
    const char *weights = cli_args_value(&run->args, "weights", 0);
    const loxo_failure *failure = loxo_context_failure(run->ctx);
    const int64_t i = failure->element;
    if (status == LOXO_ERR_ARGUMENT && weight != NULL && i < 0) /* all of them together */
        return cli_fail_at(run, LOXO_ERR_MALFORMED, weights, 0, "%s", failure->text);
    return cli_blame(run, status, weight != NULL && !(weight[i] >= 0.0 && weight[i] < HUGE_VAL) ? weights : points);
}

static loxo_status barycenter_main(cli_run *run, void *state)
{
    const barycenter_state *s = state;
    const char *path = cli_args_value(&run->args, "output", 0), *input = run->args.operand[0];
    loxo_array atoms = {0};
    double *weight = NULL;
    loxo_barycenter_info *info = NULL;
    loxo_status status;
    if (s->common.estimate) return estimate(run);
    if (path != NULL && (status = cli_output(run, path)) < 0) return status;
    run->input = input;
    json_put_text(run->report.json, "input", input);
    const double start_s = loxo_os_clock_s();
    if ((status = loxo_read_array(run->ctx, input, &atoms)) < 0) return status;
    if ((status = check_shape(run, &atoms)) < 0) goto done;
    if ((status = read_weights(run, atoms.shape[0], &weight)) < 0) goto done;
    (void)cli_seconds(run, "read", start_s);
    status = LOXO_ERR_MEMORY;
    if ((info = loxo_allocate(run->ctx, 1, sizeof *info)) == NULL) goto done;
    const int d = (int)atoms.shape[1];
    const loxo_atoms view = {.n = atoms.shape[0], .d = d, .x = atoms.value, .weight = weight};
    const double solve_s = loxo_os_clock_s();
    if ((status = loxo_barycenter(run->ctx, &view, &s->barycenter, info)) < 0) {
        status = blame(run, status, input, weight);
        goto done;
    }
    (void)cli_seconds(run, "solve", solve_s);
    json_put_integer(run->report.json, "n", view.n);
    json_put_integer(run->report.json, "d", d);
    tell(run, info, d);
    (void)cli_combine(run, status);
    if (path != NULL) status = write_centred(run, path, info, &atoms);
done:
    loxo_release(run->ctx, info);
    loxo_release(run->ctx, weight);
    loxo_array_destroy(run->ctx, &atoms);
    return status;
}

static const cli_flag barycenter_flags[] = {
    {.name = "weights", .values = "FILE", .n_values = 1, .reads = true, .help = "a weight a point; else all alike"},
    {.name = "output",
     .letter = 'o',
     .values = "FILE",
     .n_values = 1,
     .help = "the points as seen from the barycenter: .npy .csv"},
    {.name = NULL},
};
static const cli_group barycenter_groups[] = {
    {"barycenter", loxo_barycenter_options, offsetof(barycenter_state, barycenter)},
    {.title = NULL},
};

const cli_command command_barycenter = {
    .name = "barycenter",
    .operands = "POINTS [-o OUT] [options]",
    .summary = "conformal barycenter of weighted points of the sphere",
    .about = "POINTS has a unit vector of 2 to 64 coordinates a row: .npy of shape (n, d), .csv or text. The "
             "barycenter is the\n"
             "point of the ball from which they are balanced; what is told of it is certified.\n",
    .examples = "  loxo barycenter points.npy --json -\n"
                "  loxo barycenter points.csv --weights w.csv -o centred.npy\n",
    .min_operands = 1,
    .max_operands = 1,
    .flags = barycenter_flags,
    .groups = barycenter_groups,
    .state_bytes = sizeof(barycenter_state),
    .defaults = set_defaults,
    .main = barycenter_main,
};
