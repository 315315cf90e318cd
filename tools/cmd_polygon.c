/* SPDX-License-Identifier: MIT
 * loxo polygon: closing polygons without changing their edges' lengths, and random closed ones. */
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "run.h"

#include <math.h>
#include <string.h>

#define MOST_REPORTS   (1 << 21) /* numbers between two questions to the monitor: so many polygons' reports are held */
#define PICTURE_SIZE   900
#define PICTURE_LEGEND 53 /* more height than width, so that a unit is as long both ways */

typedef struct polygon_state {
    cli_common common;
    loxo_polygon_sample_settings polygon;
} polygon_state;

static void set_defaults(void *state)
{
    *(polygon_state *)state = (polygon_state){.polygon = loxo_polygon_sample_settings_default()};
}

/* What is closed, and what comes out. */
typedef struct work {
    loxo_array given; /* of close */
    loxo_polygons polygons;
    double *length, *out, *log_weight;
    int64_t first;
    loxo_polygon_info info;
} work;

static void work_destroy(cli_run *run, work *k)
{
    loxo_array_destroy(run->ctx, &k->given);
    loxo_release(run->ctx, k->length);
    loxo_release(run->ctx, k->out);
    loxo_release(run->ctx, k->log_weight);
}

static bool is_close(const cli_run *run) { return strcmp(run->args.operand[0], "close") == 0; }

/* A whole number in a range. */
static loxo_status number(cli_run *run, const char *flag, int64_t least, int64_t most, int64_t *value)
{
    const char *text = cli_args_value(&run->args, flag, 0);
    if (text == NULL) return LOXO_OK;
    if (!cli_parse_integer(text, strlen(text), value) || *value < least || *value > most)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "polygon: --%s takes a whole number from %lld to %lld", flag,
                        (long long)least, (long long)most);
    return LOXO_OK;
}

static bool is_given(const cli_run *run, const char *name)
{
    const loxo_option *option = loxo_options_find(loxo_polygon_sample_options, name);
    return option != NULL ? cli_args_has_option(&run->args, option) : cli_args_has(&run->args, name);
}

/* Flags and options that only the other word has. */
static loxo_status check_words(cli_run *run)
{
    static const char *const of_sample[] = {"count",   "sides", "dimension", "lengths", "first",
                                            "weights", "seed",  "measure",   NULL};
    static const char *const of_close[] = {"given-edges", NULL};
    const char *const *other = is_close(run) ? of_sample : of_close;
    if (!is_close(run) && strcmp(run->args.operand[0], "sample") != 0)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "polygon: close or sample, not '%s'", run->args.operand[0]);
    if (is_close(run) != (run->args.n_operands == 2))
        return cli_fail(run, LOXO_ERR_ARGUMENT,
                        is_close(run) ? "polygon: close takes a file" : "polygon: sample takes no file");
    for (; *other != NULL; ++other)
        if (is_given(run, *other))
            return cli_fail(run, LOXO_ERR_ARGUMENT, "polygon: --%s is not of %s", *other, run->args.operand[0]);
    return LOXO_OK;
}

static loxo_status check_outputs(cli_run *run)
{
    static const char *const flags[] = {"output", "weights", "picture", NULL};
    bool any = run->json_path != NULL;
    for (int i = 0; flags[i] != NULL; ++i) {
        const char *path = cli_args_value(&run->args, flags[i], 0);
        loxo_status status;
        if (path == NULL) continue;
        any = true;
        if ((status = cli_output(run, path)) < 0) return status;
    }
    if (!any) return cli_fail(run, LOXO_ERR_ARGUMENT, "polygon: no output; give -o FILE or --json");
    return LOXO_OK;
}

/* Shapes (n, d) and (batch, n, d) to polygons. */
static loxo_status take_shape(cli_run *run, work *k)
{
    const char *path = run->args.operand[1];
    const bool is_edges = cli_args_has(&run->args, "given-edges");
    const loxo_array *a = &k->given;
    const int64_t rows = a->n_dimensions == 3 ? a->shape[1] : a->shape[0];
    const int64_t d = a->n_dimensions == 3 ? a->shape[2] : a->shape[1];
    if (a->n_dimensions < 2 || d < 2 || d > LOXO_MOEBIUS_MOST_DIMENSIONS || rows < (is_edges ? 1 : 2))
        return cli_fail_at(run, LOXO_ERR_UNSUPPORTED, path, 0,
                           "not rows of 2 to %d coordinates, a vertex each, of one polygon or of a batch",
                           LOXO_MOEBIUS_MOST_DIMENSIONS);
    k->polygons = (loxo_polygons){.n_polygons = a->n_dimensions == 3 ? a->shape[0] : 1,
                                  .n_edges = is_edges ? rows : rows - 1,
                                  .d = (int)d,
                                  .form = is_edges ? LOXO_POLYGON_EDGES : LOXO_POLYGON_VERTICES,
                                  .x = a->value};
    return LOXO_OK;
}

static loxo_status read_given(cli_run *run, work *k)
{
    const char *path = run->args.operand[1];
    run->input = path;
    json_put_text(run->report.json, "input", path);
    loxo_status status = loxo_read_array(run->ctx, path, &k->given);
    if (status >= 0) status = take_shape(run, k);
    if (status < 0) return status;
    const loxo_array *a = &k->given;
    const int64_t d = k->polygons.d, n_rows = a->n_dimensions == 3 ? a->shape[0] * a->shape[1] : a->shape[0];
    for (int64_t i = 0; i < n_rows * d; ++i)
        if (!isfinite(a->value[i]))
            return cli_fail_at(run, LOXO_ERR_MALFORMED, path, 0, "row %lld is not finite", (long long)(i / d));
    return LOXO_OK;
}

static loxo_status read_wanted(cli_run *run, work *k)
{
    const char *path = cli_args_value(&run->args, "lengths", 0);
    int64_t count = 1, sides = 0, d = 3;
    loxo_status status = number(run, "count", 0, INT64_MAX / 4, &count);
    if (status >= 0) status = number(run, "sides", 3, INT64_MAX / 4, &sides);
    if (status >= 0) status = number(run, "dimension", 2, LOXO_MOEBIUS_MOST_DIMENSIONS, &d);
    if (status >= 0) status = number(run, "first", 0, INT64_MAX / 4, &k->first);
    if (status < 0) return status;
    if ((sides == 0) == (path == NULL))
        return cli_fail(run, LOXO_ERR_ARGUMENT, "polygon: give either --sides N or --lengths FILE");
    if (path != NULL) {
        json_put_text(run->report.json, "lengths", path);
        run->input = path;
        if ((status = loxo_read_field(run->ctx, path, &k->length, &sides)) < 0) return status;
    }
    k->polygons = (loxo_polygons){
        .n_polygons = count, .n_edges = sides, .d = (int)d, .form = LOXO_POLYGON_DIRECTIONS, .length = k->length};
    return LOXO_OK;
}

static void tell(cli_run *run, const work *k)
{
    const loxo_polygons *p = &k->polygons;
    const loxo_polygon_info *info = &k->info;
    json_t *o = json_put_object(run->report.json, "polygons");
    json_put_integer(o, "n", p->n_polygons);
    json_put_integer(o, "edges", p->n_edges);
    json_put_integer(o, "d", p->d);
    json_put_integer(o, "closed", info->n_closed);
    json_put_integer(o, "loose", info->n_loose);
    json_put_integer(o, "flat", info->n_flat);
    json_put_integer(o, "cannot", info->n_cannot);
    json_put_integer(o, "bad", info->n_bad);
    json_put_integer(o, "left", info->n_left);
    json_put_integer(o, "first_failed", info->first_failed);
    json_put_number(o, "gap_max", info->gap_max);
    json_put_number(o, "bound_max", info->bound_max);
    json_put_number(o, "total_s", info->total_s);
    report_row(&run->report, "polygons", "%s of %s edges in %d dimensions, %s", text_count(p->n_polygons),
               text_count(p->n_edges), p->d, text_seconds(info->total_s));
    report_row(&run->report, "closed", "%s, gap at most %.1e of the length, within %.1e of the barycenter",
               text_count(info->n_closed + info->n_flat), info->gap_max, info->bound_max);
    if (info->n_cannot > 0)
        cli_warn(run, info->n_cannot,
                 "%lld polygons cannot be closed: edges of one direction have half of the length (first: %lld)",
                 (long long)info->n_cannot, (long long)info->first_failed);
    if (info->n_bad > 0)
        cli_warn(run, info->n_bad, "%lld polygons have numbers that are not finite, or no length",
                 (long long)info->n_bad);
    if (info->n_flat > 0)
        cli_warn(run, info->n_flat, "%lld polygons have two directions only and close to and fro",
                 (long long)info->n_flat);
}

/* Effective share of the samples: sum of weights squared over their number and sum of squares. */
static void tell_weights(cli_run *run, const work *k)
{
    double most = -HUGE_VAL, sum = 0.0, squares = 0.0;
    for (int64_t i = 0; i < k->polygons.n_polygons; ++i)
        most = fmax(most, k->log_weight[i]);
    for (int64_t i = 0; i < k->polygons.n_polygons && most > -HUGE_VAL; ++i) {
        const double w = exp(k->log_weight[i] - most);
        sum += w;
        squares += w * w;
    }
    const double share = squares > 0.0 ? sum * sum / squares / (double)k->polygons.n_polygons : 0.0;
    json_t *o = json_put_object(run->report.json, "sampling");
    json_put_integer(o, "first", k->first);
    json_put_number(o, "log_mean_weight", sum > 0.0 ? most + log(sum / (double)k->polygons.n_polygons) : -HUGE_VAL);
    json_put_number(o, "effective_share", share);
    report_row(&run->report, "weights", "as good as %.1f %% of as many uniform ones", 100.0 * share);
}

/* Closed and open polygon of the first of the batch, in the plane of the first two coordinates; as Figure 2 (a), (d). */
static loxo_status draw(cli_run *run, const work *k, bool is_edges_out, const char *path)
{
    const loxo_polygons *p = &k->polygons;
    const int64_t n = p->n_edges, n_open = p->form == LOXO_POLYGON_DIRECTIONS ? 0 : n + 1;
    double *xy = loxo_allocate(run->ctx, 4 * (n + 1), sizeof *xy), low[2], high[2], at[4] = {0};
    if (xy == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i <= n; ++i)
        for (int c = 0; c < 2; ++c) {
            const int64_t row = i * p->d + c, end = i < n ? row : c;
            double *closed = xy + c * (n + 1), *open = xy + (c + 2) * (n + 1);
            closed[i] = is_edges_out ? at[c] : k->out[end];
            if (is_edges_out && i < n) at[c] += k->out[row];
            if (n_open == 0) continue;
            open[i] = p->form == LOXO_POLYGON_EDGES ? at[c + 2] : p->x[row];
            if (p->form == LOXO_POLYGON_EDGES && i < n) at[c + 2] += p->x[row];
        }
    for (int c = 0; c < 2; ++c) {
        low[c] = high[c] = xy[c * (n + 1)];
        for (int64_t i = 0; i <= n; ++i)
            for (int s = 0; s < (n_open > 0 ? 2 : 1); ++s) {
                low[c] = fmin(low[c], xy[(c + 2 * s) * (n + 1) + i]);
                high[c] = fmax(high[c], xy[(c + 2 * s) * (n + 1) + i]);
            }
    }
    const double half = 0.55 * fmax(fmax(high[0] - low[0], high[1] - low[1]), 1e-300);
    const loxo_plot_style style = n <= 100 ? LOXO_PLOT_BOTH : LOXO_PLOT_LINE;
    const loxo_plot_series series[2] = {
        {.name = "closed", .style = style, .n = n + 1, .x = xy, .y = xy + (n + 1)},
        {.name = "open", .style = style, .is_dashed = true, .n = n_open, .x = xy + 2 * (n + 1), .y = xy + 3 * (n + 1)}};
    loxo_plot plot = loxo_plot_default();
    plot.width = PICTURE_SIZE;
    plot.height = PICTURE_SIZE + PICTURE_LEGEND;
    plot.x_min = 0.5 * (low[0] + high[0]) - half;
    plot.x_max = 0.5 * (low[0] + high[0]) + half;
    plot.y_min = 0.5 * (low[1] + high[1]) - half;
    plot.y_max = 0.5 * (low[1] + high[1]) + half;
    plot.n_series = n_open > 0 ? 2 : 1;
    plot.series = series;
    const loxo_status status = loxo_plot_png(run->ctx, &plot, path);
    loxo_release(run->ctx, xy);
    if (status >= 0) cli_wrote(run, path);
    return status;
}

static loxo_status write_files(cli_run *run, const polygon_state *s, const work *k)
{
    const char *output = cli_args_value(&run->args, "output", 0), *weights = cli_args_value(&run->args, "weights", 0);
    const char *picture = cli_args_value(&run->args, "picture", 0);
    const loxo_polygons *p = &k->polygons;
    const bool is_one = p->form != LOXO_POLYGON_DIRECTIONS && k->given.n_dimensions == 2;
    const int64_t shape[3] = {p->n_polygons, p->n_edges, p->d};
    loxo_status status = cli_before_output(run);
    if (status >= 0 && output != NULL) {
        status = loxo_write_array(run->ctx, output, k->out, is_one ? 2 : 3, is_one ? shape + 1 : shape);
        if (status >= 0) cli_wrote(run, output);
    }
    if (status >= 0 && weights != NULL) {
        status = loxo_write_array(run->ctx, weights, k->log_weight, 1, shape);
        if (status >= 0) cli_wrote(run, weights);
    }
    if (status >= 0 && picture != NULL && p->n_polygons > 0) status = draw(run, k, s->polygon.edges, picture);
    return status;
}

/* What sampling refuses of lengths, one of them or all together, is in their file. */
static loxo_status blame_lengths(cli_run *run, loxo_status status)
{
    const loxo_failure *failure = loxo_context_failure(run->ctx);
    if (status != LOXO_ERR_ARGUMENT) return status;
    return cli_fail_at(run, LOXO_ERR_MALFORMED, run->input, 0, "%s", failure->text);
}

static loxo_status solve(cli_run *run, const polygon_state *s, work *k)
{
    const loxo_polygons *p = &k->polygons;
    const double start_s = loxo_os_clock_s();
    int64_t n = 0;
    if (__builtin_mul_overflow(p->n_polygons, p->n_edges, &n) || __builtin_mul_overflow(n, (int64_t)p->d, &n))
        return cli_fail(run, LOXO_ERR_LIMIT, "polygon: too many edges");
    k->out = loxo_allocate(run->ctx, n, sizeof *k->out);
    k->log_weight = loxo_allocate(run->ctx, p->n_polygons, sizeof *k->log_weight);
    if (k->out == NULL || k->log_weight == NULL) return LOXO_ERR_MEMORY;
    loxo_status status;
    if (is_close(run)) {
        const loxo_polygon_settings how = {
            .tolerance = s->polygon.tolerance, .max_iterations = s->polygon.max_iterations, .edges = s->polygon.edges};
        status = loxo_polygon_close(run->ctx, p, &how, k->out, NULL, NULL, &k->info);
    } else {
        status = loxo_polygon_sample(run->ctx, &s->polygon, k->first, p->n_polygons, p->n_edges, p->d, k->length,
                                     k->out, k->log_weight, &k->info);
        if (k->length != NULL) status = blame_lengths(run, status);
    }
    if (status < 0) return status;
    if (status == LOXO_STOPPED) return LOXO_ERR_STOPPED; /* polygons that nobody looked at are in the output */
    (void)cli_seconds(run, is_close(run) ? "close" : "sample", start_s);
    tell(run, k);
    if (!is_close(run)) tell_weights(run, k);
    return cli_combine(run, status);
}

/* What is given, what comes out, and what the cost of loxo/polygon.h says of the work. */
static loxo_status estimate(cli_run *run, work *k)
{
    size_t read_bytes = 0, given_bytes = 0, out_bytes = 0, n_numbers = 0;
    loxo_status status;
    if (is_close(run)) {
        status = cli_count_array(run, run->args.operand[1], &k->given, &read_bytes);
        if (status >= 0) status = take_shape(run, k);
    } else {
        status = read_wanted(run, k);
    }
    if (status < 0) return status;
    const loxo_polygons *p = &k->polygons;
    const size_t n = (size_t)p->n_polygons, edges = (size_t)p->n_edges, d = (size_t)p->d;
    if (__builtin_mul_overflow(n, edges * d, &n_numbers) || n_numbers > SIZE_MAX / 64)
        return cli_fail(run, LOXO_ERR_LIMIT, "polygon: too many edges");
    const size_t slab = (size_t)MOST_REPORTS / (edges * d > 0 ? edges * d : 1) + 8;
    const size_t room = CLI_ESTIMATE_FIXED + (p->d <= 3 && p->n_edges <= 2048
                                                  ? edges * 256 * (size_t)run->common->n_threads + edges * 32
                                                  : edges * (d + 1) * 16);
    const size_t reports = (slab < n ? slab : n) * sizeof(loxo_polygon_report);
    const size_t drawn = is_close(run) ? 0 : ((size_t)MOST_REPORTS / 8 + 8 * edges * d) * sizeof(double);
    given_bytes = is_close(run) ? (n_numbers + (p->form == LOXO_POLYGON_VERTICES ? n * d : 0)) * sizeof(double) : 0;
    out_bytes = (n_numbers + n) * sizeof(double);
    const size_t peak = given_bytes + out_bytes + room + reports + drawn;
    if (is_close(run)) cli_estimate_part(run, "read_bytes", read_bytes);
    cli_estimate_part(run, "given_bytes", given_bytes);
    cli_estimate_part(run, "result_bytes", out_bytes);
    cli_estimate_part(run, "work_bytes", room + reports + drawn);
    cli_estimate(run, peak > read_bytes ? peak : read_bytes, NAN);
    return LOXO_OK;
}

static loxo_status polygon_main(cli_run *run, void *state)
{
    const polygon_state *s = state;
    work k = {0};
    loxo_status status = check_words(run);
    if (status >= 0 && s->common.estimate) {
        status = estimate(run, &k);
        work_destroy(run, &k);
        return status;
    }
    if (status >= 0) status = check_outputs(run);
    if (status >= 0) status = is_close(run) ? read_given(run, &k) : read_wanted(run, &k);
    if (status >= 0) status = solve(run, s, &k);
    if (status >= 0) status = write_files(run, s, &k);
    work_destroy(run, &k);
    return status;
}

static const cli_flag polygon_flags[] = {
    {.name = "given-edges", .help = "close: rows are edges, not vertices"},
    {.name = "sides", .values = "N", .n_values = 1, .help = "sample: edges of length 1"},
    {.name = "lengths",
     .values = "FILE",
     .n_values = 1,
     .reads = true,
     .help = "sample: the lengths of the edges instead"},
    {.name = "count", .letter = 'n', .values = "N", .n_values = 1, .help = "sample: polygons [1]"},
    {.name = "dimension", .values = "D", .n_values = 1, .help = "sample: of the space [3]"},
    {.name = "first",
     .values = "N",
     .n_values = 1,
     .help = "sample: number of the first polygon of the seed's stream [0]"},
    {.name = "output", .letter = 'o', .values = "FILE", .n_values = 1, .help = "vertices, a row each: .npy .csv"},
    {.name = "weights", .values = "FILE", .n_values = 1, .help = "sample: logarithms of the weights: .npy .csv"},
    {.name = "picture", .values = "FILE", .n_values = 1, .help = "PNG of the first polygon, open and closed"},
    {.name = NULL},
};
static const cli_group polygon_groups[] = {
    {"polygon", loxo_polygon_sample_options, offsetof(polygon_state, polygon)},
    {.title = NULL},
};

const cli_command command_polygon = {
    .name = "polygon",
    .operands = "close FILE | sample --sides N  -o OUT [options]",
    .summary = "closes polygons without changing their edges' lengths; random closed ones",
    .about = "close: FILE has the vertices of an open polygon, a row each (.npy of shape (n, d), .csv), or many of "
             "them (.npy of\n"
             "shape (batch, n, d)). The closed one has an edge for each of the open one's; its first vertex stays.\n"
             "sample: random closed polygons with weights that make them uniform; the same for a seed on any machine's "
             "threads.\n",
    .examples = "  loxo polygon close walk.csv -o closed.csv --picture closed.png\n"
                "  loxo polygon sample --sides 64 --count 100000 -o polygons.npy --weights log_weights.npy\n",
    .min_operands = 1,
    .max_operands = 2,
    .flags = polygon_flags,
    .groups = polygon_groups,
    .state_bytes = sizeof(polygon_state),
    .defaults = set_defaults,
    .main = polygon_main,
};
