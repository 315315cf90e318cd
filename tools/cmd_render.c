/* SPDX-License-Identifier: MIT
 * loxo render: a picture of a mesh, with a field on it if there is one. */
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "picture.h"
#include "run.h"

#include <math.h>
#include <string.h>

typedef struct render_state {
    cli_common common;
    loxo_draw_settings draw;
} render_state;

static void set_defaults(void *state) { *(render_state *)state = (render_state){.draw = loxo_draw_settings_default()}; }

/* The mesh's own field of that name, else a file's. *owned is to be released. */
static loxo_status find_field(cli_run *run, const loxo_soup *soup, const char *name, const double **value,
                              double **owned)
{
    int64_t n = 0;
    for (int i = 0; i < soup->n_fields; ++i) {
        if (strcmp(soup->fields[i].name, name) != 0) continue;
        *value = soup->fields[i].value;
        return LOXO_OK;
    }
    const loxo_status status = loxo_read_field(run->ctx, name, owned, &n);
    if (status < 0) return status;
    if (n != soup->n_vertices)
        return cli_fail_at(run, LOXO_ERR_ARGUMENT, name, 0, "holds %lld values, the mesh has %lld vertices",
                           (long long)n, (long long)soup->n_vertices);
    *value = *owned;
    return LOXO_OK;
}

static loxo_status estimate(cli_run *run, const loxo_draw_settings *s)
{
    const size_t samples = (size_t)s->supersample * (size_t)s->supersample;
    const size_t picture = (size_t)s->width * (size_t)s->height * (3 + 16 * samples);
    loxo_mesh_counts counts;
    const loxo_status status = cli_count_mesh(run, run->args.operand[0], &counts);
    if (status < 0) return status;
    const size_t arrays = cli_counts_bytes(&counts), sum = arrays + picture;
    cli_estimate_part(run, "read_bytes", counts.read_bytes);
    cli_estimate_part(run, "arrays_bytes", arrays);
    cli_estimate_part(run, "picture_bytes", picture);
    cli_estimate(run, counts.read_bytes > sum ? counts.read_bytes : sum, NAN);
    return status;
}

static loxo_status render_main(cli_run *run, void *state)
{
    render_state *s = state;
    const char *path = cli_args_value(&run->args, "output", 0), *name = cli_args_value(&run->args, "field", 0);
    const double *value = NULL;
    double *owned = NULL;
    loxo_soup soup = {0};
    loxo_status status;
    s->draw.title = cli_args_value(&run->args, "title", 0);
    s->draw.unit = cli_args_value(&run->args, "unit", 0);
    if (path == NULL && !s->common.estimate)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "render: no output; give -o FILE.png");
    if (path != NULL && (status = cli_output(run, path)) < 0) return status;
    if (s->common.estimate) return estimate(run, &s->draw);
    if ((status = cli_read_mesh(run, run->args.operand[0], &soup)) < 0) return status;
    if (name != NULL && (status = find_field(run, &soup, name, &value, &owned)) < 0) goto done;
    if ((status = cli_before_output(run)) < 0) goto done;
    status = cli_picture(run, &soup, value, &s->draw, path);
done:
    loxo_release(run->ctx, owned);
    loxo_soup_destroy(run->ctx, &soup);
    return status;
}

static const cli_flag render_flags[] = {
    {.name = "output", .letter = 'o', .values = "FILE.png", .n_values = 1, .help = "where to; - is standard output"},
    {.name = "field",
     .values = "FILE|NAME",
     .n_values = 1,
     .reads = true,
     .help = "one number a vertex: a file, or a property of the mesh file"},
    {.name = "title", .values = "TEXT", .n_values = 1, .help = "over the picture"},
    {.name = "unit", .values = "TEXT", .n_values = 1, .help = "beside the scale bar"},
    {.name = NULL},
};
static const cli_group render_groups[] = {
    {"picture", loxo_draw_options, offsetof(render_state, draw)},
    {.title = NULL},
};

const cli_command command_render = {
    .name = "render",
    .operands = "MESH -o FILE.png [options]",
    .summary = "a picture of a mesh with a field on it",
    .about = "Draws without a display. Values that are not finite are grey.\n",
    .examples = "  loxo render bunny.off --field distance.npy -o bunny.png --azimuth 40\n"
                "  loxo render distance.ply --field distance --isolines 30 -o p.png\n",
    .min_operands = 1,
    .max_operands = 1,
    .flags = render_flags,
    .groups = render_groups,
    .state_bytes = sizeof(render_state),
    .defaults = set_defaults,
    .main = render_main,
};
