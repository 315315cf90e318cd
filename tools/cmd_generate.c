/* SPDX-License-Identifier: MIT
 * loxo generate: meshes of known shapes, of any size, and their exact distances where a closed form is known. */
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "run.h"

#include <math.h>
#include <string.h>

typedef struct generate_values {
    int64_t n_vertices;
    uint64_t seed;
    bool is_float;
} generate_values;

typedef struct generate_state {
    cli_common common;
    generate_values values;
} generate_state;

static const loxo_option generate_options[] = {
    {.name = "vertices",
     .type = LOXO_OPTION_INT64,
     .offset = offsetof(generate_values, n_vertices),
     .min = 1,
     .max = 0x1p62,
     .help = "wanted number of vertices; the nearest that the shape can have is made"},
    {.name = "seed",
     .type = LOXO_OPTION_UINT64,
     .offset = offsetof(generate_values, seed),
     .max = 0x1p64,
     .help = "of what is random in the shape"},
    {.name = "float",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(generate_values, is_float),
     .max = 1,
     .help = "positions in single precision"},
    {.name = NULL},
};

static void set_defaults(void *state)
{
    const loxo_generate_settings d = loxo_generate_settings_default();
    *(generate_state *)state = (generate_state){.values = {.n_vertices = d.n_vertices, .seed = d.seed}};
}

static loxo_status shape_settings(cli_run *run, const generate_values *values, loxo_generate_settings *settings)
{
    const char *name = run->args.operand[0], *params = cli_args_value(&run->args, "params", 0);
    *settings = loxo_generate_settings_default();
    settings->n_vertices = values->n_vertices;
    settings->seed = values->seed;
    if (!loxo_shape_from_name(name, &settings->shape)) {
        char names[256] = "";
        for (int i = 0; i < LOXO_N_SHAPES; ++i) {
            const size_t used = strlen(names);
            (void)snprintf(names + used, sizeof names - used, " %s", loxo_shape_name((loxo_shape)i));
        }
        return cli_fail(run, LOXO_ERR_ARGUMENT, "generate: there is no shape '%s'; one of%s", name, names);
    }
    if (params != NULL && cli_parse_numbers(params, settings->params, 4) < 0)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "generate: --params takes up to four numbers with commas, not '%s'",
                        params);
    return LOXO_OK;
}

/* Two triangles a vertex, as on every closed surface (13 bytes each in PLY); flat shapes have a few less. */
static void estimate(cli_run *run, const generate_values *values, bool streams)
{
    const size_t n = (size_t)values->n_vertices, position = 3 * (values->is_float ? sizeof(float) : sizeof(double));
    const size_t arrays = n * (position + 6 * sizeof(loxo_index));
    cli_estimate_part(run, "file_bytes", n * (position + 26));
    cli_estimate(run, streams ? (size_t)64 << 20 : arrays, NAN);
}

static loxo_status write_exact(cli_run *run, const loxo_generate_settings *settings, const loxo_soup *soup)
{
    const char *vertex = cli_args_value(&run->args, "exact-from", 0);
    const char *path = cli_args_value(&run->args, "exact-from", 1);
    const loxo_write_settings write = loxo_write_settings_default();
    int64_t source = -1;
    if (!cli_parse_integer(vertex, strlen(vertex), &source) || source < 0 || source >= soup->n_vertices)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "generate: vertex %s of --exact-from is not in 0..%lld", vertex,
                        (long long)soup->n_vertices - 1);
    double *distance = loxo_allocate(run->ctx, soup->n_vertices, sizeof *distance);
    if (distance == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = loxo_generate_exact_distance(run->ctx, settings, soup, (loxo_index)source, distance);
    if (status >= 0) status = cli_before_output(run);
    if (status >= 0) status = loxo_write_field(run->ctx, path, "distance", distance, soup->n_vertices, &write);
    if (status >= 0) cli_wrote(run, path);
    loxo_release(run->ctx, distance);
    return status;
}

static loxo_status make_in_memory(cli_run *run, const generate_values *values, const loxo_generate_settings *settings,
                                  const char *path, const loxo_write_settings *write, int64_t *n_vertices,
                                  int64_t *n_faces)
{
    loxo_soup soup = {0};
    loxo_status status = loxo_generate(run->ctx, settings, values->is_float, &soup);
    if (status < 0) return status;
    *n_vertices = soup.n_vertices;
    *n_faces = soup.n_faces;
    /* the exact distances first: where there are none, nothing is written */
    if (cli_args_has(&run->args, "exact-from")) status = write_exact(run, settings, &soup);
    if (status >= 0) status = cli_before_output(run);
    if (status >= 0) status = loxo_write_mesh(run->ctx, path, &soup, write);
    loxo_soup_destroy(run->ctx, &soup);
    return status;
}

static loxo_status generate_main(cli_run *run, void *state)
{
    const generate_state *s = state;
    const char *path = cli_args_value(&run->args, "output", 0), *exact = cli_args_value(&run->args, "exact-from", 1);
    loxo_write_settings write = loxo_write_settings_default();
    loxo_generate_settings settings;
    cli_kind kind = CLI_MESH;
    int64_t n_vertices = 0, n_faces = 0;
    loxo_status status = shape_settings(run, &s->values, &settings);
    if (status < 0) return status;
    if (path == NULL && !s->common.estimate)
        return cli_fail(run, LOXO_ERR_ARGUMENT, "generate: no output; give -o FILE");
    if (path != NULL) {
        const char *format = cli_args_value(&run->args, "format", 0);
        if ((status = cli_output_format(run, path, format, true, &write.format, &kind)) < 0) return status;
        if ((status = cli_output(run, path)) < 0) return status;
    }
    if (exact != NULL && (status = cli_output(run, exact)) < 0) return status;
    /* PLY is written as it is made, in memory that does not grow. */
    const bool streams = exact == NULL && (path == NULL || write.format == LOXO_FORMAT_PLY);
    if (s->common.estimate) {
        estimate(run, &s->values, streams);
        return LOXO_OK;
    }
    const double start_s = loxo_os_clock_s();
    if (streams)
        status = loxo_generate_to_ply(run->ctx, &settings, s->values.is_float, path, &n_vertices, &n_faces);
    else
        status = make_in_memory(run, &s->values, &settings, path, &write, &n_vertices, &n_faces);
    if (status < 0) return status;
    const double seconds = cli_seconds(run, "generate", start_s) - start_s;
    json_t *mesh = json_put_object(run->report.json, "mesh");
    json_put_text(mesh, "shape", loxo_shape_name(settings.shape));
    json_put_integer(mesh, "n_vertices", n_vertices);
    json_put_integer(mesh, "n_faces", n_faces);
    report_row(&run->report, "shape", "%s  %s vertices, %s faces", loxo_shape_name(settings.shape),
               text_count(n_vertices), text_count(n_faces));
    report_row(&run->report, "generate", "%s", text_seconds(seconds));
    cli_wrote(run, path);
    return status;
}

static void list_shapes(FILE *out)
{
    for (int i = 0; i < LOXO_N_SHAPES; ++i)
        (void)fprintf(out, "  %-10s %s\n", loxo_shape_name((loxo_shape)i), loxo_shape_help((loxo_shape)i));
}

static const cli_flag generate_flags[] = {
    {.name = "output", .letter = 'o', .values = "FILE", .n_values = 1, .help = "where to; - is standard output"},
    {.name = "format", .values = "F", .n_values = 1, .help = "ply, obj, off, vtp or gii; else by the suffix"},
    {.name = "params", .values = "A,B,..", .n_values = 1, .help = "of the shape, in its order"},
    {.name = "exact-from",
     .values = "V FILE",
     .n_values = 2,
     .help = "also the exact distances from vertex V, where a closed form is known"},
    {.name = NULL},
};
static const cli_group generate_groups[] = {
    {"generate", generate_options, offsetof(generate_state, values)},
    {.title = NULL},
};

const cli_command command_generate = {
    .name = "generate",
    .operands = "SHAPE --vertices N -o FILE [options]",
    .summary = "a mesh of a known shape, of any size",
    .about = "Binary PLY is written as it is made: memory does not grow with the mesh. Shapes with their params:\n",
    .examples = "  loxo generate icosphere --vertices 1000000 -o sphere.ply\n"
                "  loxo generate torus --vertices 50000 --params 1,0.3 -o torus.off\n"
                "  loxo generate icosphere --vertices 40000 -o s.ply --exact-from 0 exact.npy\n",
    .min_operands = 1,
    .max_operands = 1,
    .flags = generate_flags,
    .groups = generate_groups,
    .state_bytes = sizeof(generate_state),
    .defaults = set_defaults,
    .more_help = list_shapes,
    .main = generate_main,
};
