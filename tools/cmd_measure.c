/* SPDX-License-Identifier: MIT
 * loxo measure: how far distances are from a reference. */
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "measure_rows.h"
#include "run.h"

#include <math.h>

typedef struct measure_state {
    cli_common common;
} measure_state;

static void set_defaults(void *state) { *(measure_state *)state = (measure_state){0}; }

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

static loxo_status measure_main(cli_run *run, void *state)
{
    const measure_state *s = state;
    double *distance = NULL;
    int64_t n = 0;
    const double start_s = loxo_os_clock_s();
    run->input = run->args.operand[0];
    json_put_text(run->report.json, "input", run->args.operand[0]);
    json_put_text(run->report.json, "reference", run->args.operand[1]);
    loxo_status status = loxo_read_field(run->ctx, run->args.operand[0], &distance, &n);
    if (status < 0) return status;
    if (s->common.estimate)
        cli_estimate(run, 2 * sizeof(double) * (size_t)n, NAN);
    else
        status = cli_measure_against(run, run->args.operand[1], distance, n);
    (void)cli_seconds(run, "measure", start_s);
    loxo_release(run->ctx, distance);
    return status;
}

static const cli_flag no_flags[] = {{.name = NULL}};
static const cli_group no_groups[] = {{.title = NULL}};

const cli_command command_measure = {
    .name = "measure",
    .operands = "DISTANCES REFERENCE [options]",
    .summary = "errors of distances against a reference",
    .about = "Both are one number a vertex: .npy, .csv, .txt, .gii, or mesh.ply:property. The mean relative error is "
             "that of\n"
             "eq. (29) of the parallel heat paper.\n",
    .examples = "  loxo measure d.npy exact.npy\n  loxo measure d.ply:distance exact.npy --json -\n",
    .min_operands = 2,
    .max_operands = 2,
    .flags = no_flags,
    .groups = no_groups,
    .state_bytes = sizeof(measure_state),
    .defaults = set_defaults,
    .main = measure_main,
};
