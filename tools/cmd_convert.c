/* SPDX-License-Identifier: MIT
 * loxo convert: from one file format to another, with repair, subdivision and renumbering on the way. */
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "run.h"

#include <math.h>
#include <string.h>

typedef struct convert_settings {
    bool repair, shuffle;
    int subdivide;
    uint64_t seed;
} convert_settings;

typedef struct convert_state {
    cli_common common;
    convert_settings convert;
    loxo_repair_settings repair;
} convert_state;

static const loxo_option convert_options[] = {
    {.name = "repair",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(convert_settings, repair),
     .max = 1,
     .help = "mend the mesh, as set below"},
    {.name = "subdivide",
     .type = LOXO_OPTION_INT,
     .offset = offsetof(convert_settings, subdivide),
     .max = 15,
     .help = "times to split each triangle into four at the midpoints"},
    {.name = "shuffle",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(convert_settings, shuffle),
     .max = 1,
     .help = "renumber vertices and faces at random"},
    {.name = "seed",
     .type = LOXO_OPTION_UINT64,
     .offset = offsetof(convert_settings, seed),
     .max = 0x1p64,
     .help = "of the renumbering"},
    {.name = NULL},
};

static void set_defaults(void *state)
{
    *(convert_state *)state = (convert_state){.convert.seed = 1, .repair = loxo_repair_settings_default()};
}

static void report_repair(cli_run *run, const loxo_repair_info *info)
{
    json_t *repair = json_put_object(run->report.json, "repair");
    const struct {
        const char *key, *label;
        int64_t n;
    } rows[] = {
        {"n_degenerate_dropped", "degenerate faces dropped", info->n_degenerate_dropped},
        {"n_faces_turned", "faces turned", info->n_faces_turned},
        {"n_vertices_welded", "vertices welded", info->n_vertices_welded},
        {"n_duplicate_faces_dropped", "duplicate faces dropped", info->n_duplicate_faces_dropped},
        {"n_vertices_split", "vertices added by splitting", info->n_vertices_split},
        {"n_unreferenced_dropped", "unreferenced vertices dropped", info->n_unreferenced_dropped},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; ++i) {
        json_put_integer(repair, rows[i].key, rows[i].n);
        if (rows[i].n > 0) report_row(&run->report, "repaired", "%s %s", text_count(rows[i].n), rows[i].label);
    }
}

/* Bytes while the last subdivision runs: the mesh before and after, and its edges' midpoints in between. */
static loxo_status estimate(cli_run *run, int n_times)
{
    loxo_mesh_counts counts;
    const loxo_status status = cli_count_mesh(run, run->args.operand[0], &counts);
    if (status < 0) return status;
    const double before = (double)cli_counts_bytes(&counts) * pow(4.0, n_times > 0 ? n_times - 1 : 0);
    const double after = n_times > 0 ? 4.0 * before : before;
    const double work = n_times > 0 ? before + 1.5 * after : 2.0 * after;
    cli_estimate_part(run, "read_bytes", counts.read_bytes);
    cli_estimate_part(run, "input_bytes", cli_counts_bytes(&counts));
    cli_estimate_part(run, "result_bytes", (size_t)after);
    cli_estimate(run, (double)counts.read_bytes > work ? counts.read_bytes : (size_t)work, NAN);
    return status;
}

static loxo_status change(cli_run *run, const convert_state *s, loxo_soup *soup)
{
    loxo_status status = LOXO_OK;
    double start_s = loxo_os_clock_s();
    if (s->convert.repair) {
        loxo_repair_info info = {0};
        status = loxo_soup_repair(run->ctx, soup, &s->repair, NULL, &info);
        if (status < 0) return status;
        (void)cli_combine(run, status);
        report_repair(run, &info);
        start_s = cli_seconds(run, "repair", start_s);
    }
    if (s->convert.subdivide > 0) {
        if ((status = loxo_soup_subdivide(run->ctx, soup, s->convert.subdivide)) < 0) return status;
        start_s = cli_seconds(run, "subdivide", start_s);
    }
    if (s->convert.shuffle) {
        if ((status = loxo_soup_shuffle(run->ctx, soup, s->convert.seed, NULL)) < 0) return status;
        (void)cli_seconds(run, "shuffle", start_s);
    }
    return LOXO_OK;
}

static loxo_status convert_main(cli_run *run, void *state)
{
    const convert_state *s = state;
    const char *path = cli_args_value(&run->args, "output", 0);
    loxo_write_settings write = loxo_write_settings_default();
    cli_kind kind = CLI_MESH;
    loxo_soup soup = {0};
    loxo_status status;
    if (path == NULL && !s->common.estimate)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "convert: no output; give -o FILE");
    if (path != NULL) {
        const char *format = cli_args_value(&run->args, "format", 0);
        if ((status = cli_output_format(run, path, format, true, &write.format, &kind)) < 0) return status;
        if ((status = cli_output(run, path)) < 0) return status;
    }
    if (s->common.estimate) return estimate(run, s->convert.subdivide);
    if ((status = cli_read_mesh(run, run->args.operand[0], &soup)) < 0) return status;
    if ((status = change(run, s, &soup)) < 0) goto done;
    if ((status = cli_before_output(run)) < 0) goto done;
    const double start_s = loxo_os_clock_s();
    if ((status = loxo_write_mesh(run->ctx, path, &soup, &write)) < 0) goto done;
    (void)cli_seconds(run, "write", start_s);
    json_t *result = json_put_object(run->report.json, "mesh");
    json_put_integer(result, "n_vertices", soup.n_vertices);
    json_put_integer(result, "n_faces", soup.n_faces);
    report_row(&run->report, "result", "%s vertices, %s faces", text_count(soup.n_vertices), text_count(soup.n_faces));
    cli_wrote(run, path);
done:
    loxo_soup_destroy(run->ctx, &soup);
    return status;
}

static const cli_flag convert_flags[] = {
    {.name = "output", .letter = 'o', .values = "FILE", .n_values = 1, .help = "where to; - is standard output"},
    {.name = "format", .values = "F", .n_values = 1, .help = "ply, obj, off, vtp or gii; else by the suffix"},
    {.name = NULL},
};
static const cli_group convert_groups[] = {
    {"convert", convert_options, offsetof(convert_state, convert)},
    {"repair", loxo_repair_options, offsetof(convert_state, repair)},
    {.title = NULL},
};

static const cli_need convert_needs[] = {{"repair", "repair"}, {"seed", "shuffle"}, {NULL, NULL}};

const cli_command command_convert = {
    .name = "convert",
    .operands = "IN -o OUT [options]",
    .summary = "another file format; repair, subdivide, renumber",
    .about = "Reads a surface and writes it as PLY, OBJ, OFF, VTP or GIFTI. On the way, in this order: --repair,\n"
             "--subdivide, --shuffle. Without --repair the triangles are written as they were read.\n",
    .examples = "  loxo convert scan.obj.gz -o scan.ply\n  loxo convert scan.stl --repair --subdivide 2 -o fine.ply\n",
    .min_operands = 1,
    .max_operands = 1,
    .flags = convert_flags,
    .groups = convert_groups,
    .needs = convert_needs,
    .state_bytes = sizeof(convert_state),
    .defaults = set_defaults,
    .main = convert_main,
};
