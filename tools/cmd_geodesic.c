/* SPDX-License-Identifier: MIT
 * loxo geodesic: distances over a surface from a set of source vertices. */
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "geodesic_report.h"
#include "intrinsic.h"
#include "measure_rows.h"
#include "method.h"
#include "picture.h"
#include "queries.h"
#include "run.h"
#include "sources.h"

#include <math.h>
#include <string.h>

typedef struct geodesic_state {
    cli_common common;
    loxo_mesh_settings mesh;
    loxo_intrinsic_settings intrinsic;
    loxo_geodesic_settings geodesic;
    loxo_draw_settings draw;
} geodesic_state;

static void set_defaults(void *state)
{
    *(geodesic_state *)state = (geodesic_state){.mesh = loxo_mesh_settings_default(),
                                                .intrinsic = loxo_intrinsic_settings_default(),
                                                .geodesic = loxo_geodesic_settings_default(),
                                                .draw = loxo_draw_settings_default()};
    ((geodesic_state *)state)->intrinsic.traceable = false; /* sources and results at vertices need no way back */
}

/* One file that receives the distances. */
typedef struct output {
    const char *path;
    loxo_write_settings write;
    cli_kind kind;
} output;

typedef struct outputs {
    output file[CLI_MAX_FILES];
    int n;
    const char *picture;
    cli_queries queries;
} outputs;

/* Everything that can be wrong with the files, before the long work. */
static loxo_status check_files(cli_run *run, bool is_estimate, outputs *outs)
{
    const char *path, *exact = cli_args_value(&run->args, "exact", 0);
    const char *format = cli_args_value(&run->args, "format", 0);
    loxo_status status;
    for (int cursor = 0; (path = cli_args_next(&run->args, "output", &cursor)) != NULL;) {
        output o = {.path = path, .write = loxo_write_settings_default(), .kind = CLI_FIELD};
        if ((status = cli_output_format(run, path, format, false, &o.write.format, &o.kind)) < 0) return status;
        if ((status = cli_output(run, path)) < 0) return status; /* refuses more than fit */
        outs->file[outs->n++] = o;
    }
    outs->picture = cli_args_value(&run->args, "picture", 0);
    if (outs->picture != NULL && (status = cli_output(run, outs->picture)) < 0) return status;
    if ((status = cli_queries_check(run, &outs->queries)) < 0) return status;
    if (outs->n == 0 && outs->picture == NULL && exact == NULL && run->json_path == NULL && !cli_queries_any(run) &&
        !is_estimate)
        return cli_fail(
            run, LOXO_ERR_ARGUMENT,
            "geodesic: no output; give -o FILE, --picture, --path, --lines-output, --nearest-output, --matrix, "
            "--json or --exact");
    if (exact != NULL && strcmp(exact, "-") != 0) {
        loxo_os_file file;
        if ((status = loxo_os_open(run->ctx, exact, &file)) < 0) return status;
        loxo_os_close(&file);
    }
    return LOXO_OK;
}

/* A front that moves over a large mesh meets a line of it at a time: what is near on the surface has to be near in memory,
 * in both directions. Bumpy sphere, given row by row, two threads: 10M vertices 834 ns a vertex as given, 301 along Hilbert's curve, whose
 * making takes 40; 1M vertices, which the cache half holds, 218 and 208. Where its permutation does not fit, the order is chosen as ever. */
#define MANY_FOR_A_FRONT 2000000

static void choose_order(const cli_run *run, geodesic_state *s, int64_t n_vertices, int64_t n_faces, bool is_float)
{
    const loxo_geodesic_method method = s->geodesic.method;
    loxo_mesh_settings along = s->mesh;
    size_t mesh_bytes = 0, build_bytes = 0, work_bytes = 0;
    along.order = LOXO_ORDER_HILBERT;
    if (s->mesh.order != LOXO_ORDER_AUTO || n_vertices < MANY_FOR_A_FRONT) return;
    if (method != LOXO_GEODESIC_FAST && method != LOXO_GEODESIC_AUTO) return;
    if (loxo_mesh_estimate(n_vertices, n_faces, is_float, &along, &mesh_bytes, &build_bytes) < 0) return;
    if (loxo_geodesic_estimate(run->ctx, n_vertices, n_faces, &s->geodesic, &work_bytes, NULL) < 0) return;
    const size_t solve_bytes = mesh_bytes + work_bytes + sizeof(double) * (size_t)n_vertices;
    if (build_bytes <= run->limit_bytes && solve_bytes <= run->limit_bytes) s->mesh.order = LOXO_ORDER_HILBERT;
}

static loxo_status estimate(cli_run *run, geodesic_state *s, const cli_method *method)
{
    loxo_mesh_counts counts;
    size_t mesh_bytes = 0, build_bytes = 0, work_bytes = 0;
    loxo_machine machine;
    loxo_status status = loxo_machine_get(run->ctx, &machine); /* what it loads, a solve loads, too */
    const size_t program_bytes = loxo_os_peak_rss();           /* before anything is done */
    if (status >= 0) status = cli_count_mesh(run, run->args.operand[0], &counts);
    if (status < 0) return status;
    const int64_t n = counts.n_vertices, n_faces = counts.n_faces;
    const bool tells_nearest = cli_args_has(&run->args, "nearest-output"); /* as ids, and as numbers to write */
    const size_t result_bytes =
        (sizeof(double) + (tells_nearest ? sizeof(double) + sizeof(loxo_index) : 0)) * (size_t)n;
    choose_order(run, s, n, n_faces, counts.is_float);
    if ((status = loxo_geodesic_resolve(run->ctx, n, 1, &s->geodesic)) < 0) return status;
    status = loxo_mesh_estimate(n, n_faces, counts.is_float, &s->mesh, &mesh_bytes, &build_bytes);
    if (status >= 0) status = loxo_geodesic_estimate(run->ctx, n, n_faces, &s->geodesic, &work_bytes, NULL);
    if (status < 0) return status;
    size_t intrinsic_bytes = 0, flip_bytes = 0;
    if (cli_args_has(&run->args, "intrinsic"))
        loxo_mesh_estimate_intrinsic(n, n_faces, &s->intrinsic, &intrinsic_bytes, &flip_bytes);
    const size_t small_blocks = 65536;
    const size_t solve_bytes = mesh_bytes + intrinsic_bytes + work_bytes + result_bytes + small_blocks;
    size_t peak_bytes = counts.read_bytes;
    if (mesh_bytes + flip_bytes > peak_bytes) peak_bytes = mesh_bytes + flip_bytes;
    if (build_bytes > peak_bytes) peak_bytes = build_bytes;
    if (solve_bytes > peak_bytes) peak_bytes = solve_bytes;
    cli_estimate_part(run, "read_bytes", counts.read_bytes);
    cli_estimate_part(run, "build_bytes", build_bytes);
    cli_estimate_part(run, "mesh_bytes", mesh_bytes);
    if (intrinsic_bytes > 0) cli_estimate_part(run, "intrinsic_bytes", intrinsic_bytes);
    cli_estimate_part(run, "workspace_bytes", work_bytes);
    cli_estimate_part(run, "result_bytes", result_bytes);
    if (method->is_auto && intrinsic_bytes == 0 &&
        s->geodesic.method != LOXO_GEODESIC_EXACT) { /* the triangles are not looked at here */
        loxo_mesh_estimate_intrinsic(n, n_faces, &s->intrinsic, &intrinsic_bytes, &flip_bytes);
        const size_t bytes = mesh_bytes + flip_bytes > solve_bytes + intrinsic_bytes ? mesh_bytes + flip_bytes
                                                                                     : solve_bytes + intrinsic_bytes;
        cli_estimate_part(run, "bad_triangles_bytes", bytes > peak_bytes ? bytes : peak_bytes);
    }
    cli_estimate_part(run, "process_bytes", peak_bytes + program_bytes);
    cli_estimate(run, peak_bytes,
                 cli_estimate_seconds(run, run->args.operand[0], &counts, &s->mesh, &s->geodesic, peak_bytes));
    return LOXO_OK;
}

/* Refuses a solve that will not fit before anything is read, where the head of the file tells the counts. What may turn
 * out not to be needed does not count: a permutation, cycles; nor what a repair may make of the mesh. */
static loxo_status check_memory(cli_run *run, const geodesic_state *s)
{
    loxo_mesh_counts counts;
    loxo_mesh_settings mesh = s->mesh;
    loxo_geodesic_settings geodesic = s->geodesic;
    size_t build_bytes = 0, mesh_bytes = 0, work_bytes = 0;
    if (mesh.repair || !cli_peek_counts(run, run->args.operand[0], &counts)) return LOXO_OK;
    const int64_t n = counts.n_vertices, n_faces = counts.n_faces;
    geodesic.global_constraints = false;
    if (loxo_mesh_estimate(n, n_faces, counts.is_float, &mesh, NULL, &build_bytes) < 0) return LOXO_OK;
    if (mesh.order == LOXO_ORDER_AUTO) mesh.order = LOXO_ORDER_GIVEN;
    if (loxo_mesh_estimate(n, n_faces, counts.is_float, &mesh, &mesh_bytes, NULL) < 0) return LOXO_OK;
    const loxo_status status = loxo_geodesic_estimate(run->ctx, n, n_faces, &geodesic, &work_bytes, NULL);
    run->input = run->args.operand[0];
    if (status < 0) return status == LOXO_ERR_LIMIT ? status : LOXO_OK;
    size_t intrinsic_bytes = 0;
    if (cli_args_has(&run->args, "intrinsic"))
        loxo_mesh_estimate_intrinsic(n, n_faces, &s->intrinsic, &intrinsic_bytes, NULL);
    const size_t solve_bytes = mesh_bytes + intrinsic_bytes + work_bytes + sizeof(double) * (size_t)n;
    const size_t bytes = solve_bytes > build_bytes ? solve_bytes : build_bytes;
    if (bytes <= run->limit_bytes) return LOXO_OK;
    return cli_fail_at(run, LOXO_ERR_MEMORY, run->args.operand[0], 0,
                       "%s vertices and %s faces need %zu bytes; the limit is %zu (--max-memory)", text_count(n),
                       text_count(n_faces), bytes, run->limit_bytes);
}

/* Hands the arrays of the soup over to a mesh; fields that came along are of no use here. */
static loxo_status make_mesh(cli_run *run, const geodesic_state *s, loxo_soup *soup, loxo_mesh **mesh)
{
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    loxo_mesh_info info = {0};
    soup->position = NULL; /* adopted, whatever happens */
    soup->position_float = NULL;
    soup->triangle = NULL;
    loxo_soup_destroy(run->ctx, soup);
    const double start_s = loxo_os_clock_s();
    const loxo_status status = loxo_mesh_create(run->ctx, &arrays, LOXO_ADOPT, &s->mesh, &info, mesh);
    if (status < 0) return status;
    (void)cli_seconds(run, "mesh", start_s);
    const loxo_mesh_view view = loxo_mesh_get_view(*mesh);
    cli_report_mesh(run, &info, &view);
    return cli_combine(run, status);
}

/* surface: the mesh, or what it is an intrinsic triangulation of. */
static loxo_status solve(cli_run *run, const geodesic_state *s, const loxo_mesh *mesh, const loxo_mesh *surface,
                         const cli_sources *sources, double *distance, cli_queries *queries)
{
    loxo_geodesic *geodesic = NULL;
    loxo_geodesic_info info = {0};
    const double start_s = loxo_os_clock_s();
    loxo_status status = loxo_geodesic_create(run->ctx, mesh, &s->geodesic, &geodesic);
    if (status < 0) return status;
    status = cli_sources_solve(run, sources, geodesic, distance, &info);
    if (status == LOXO_STOPPED && !run->common->keep_partial) status = LOXO_ERR_STOPPED;
    if (status >= 0) {
        (void)cli_seconds(run, "solve", start_s);
        cli_report_geodesic(run, &info, &s->geodesic, loxo_mesh_n_vertices(mesh));
        status = cli_combine(run, status);
    }
    if (status >= 0 && status != LOXO_STOPPED) {
        const loxo_status asked =
            cli_queries_ask(run, geodesic, surface, sources, distance, info.distance_max, queries);
        if (asked < 0) status = asked;
    }
    loxo_geodesic_destroy(geodesic);
    return status;
}

/* Files that carry the mesh too, and the picture: the caller's arrays are made again, for as long as this takes. */
static loxo_status write_meshes(cli_run *run, const geodesic_state *s, const outputs *outs, const loxo_mesh *mesh,
                                double *distance)
{
    loxo_soup soup = {0};
    loxo_field field = {.name = "distance", .value = distance};
    loxo_status status = cli_soup_of_mesh(run, mesh, &soup);
    if (status < 0) return status;
    soup.fields = &field;
    soup.n_fields = 1;
    for (int i = 0; i < outs->n && status >= 0; ++i) {
        if (outs->file[i].kind != CLI_MESH) continue;
        status = loxo_write_mesh(run->ctx, outs->file[i].path, &soup, &outs->file[i].write);
        if (status >= 0) cli_wrote(run, outs->file[i].path);
    }
    if (status >= 0 && outs->picture != NULL) status = cli_picture(run, &soup, distance, &s->draw, outs->picture);
    soup.fields = NULL; /* the caller's */
    soup.n_fields = 0;
    loxo_soup_destroy(run->ctx, &soup);
    return status;
}

static loxo_status write_files(cli_run *run, const geodesic_state *s, const outputs *outs, const loxo_mesh *mesh,
                               double *distance)
{
    const double start_s = loxo_os_clock_s();
    const int64_t n = loxo_mesh_n_vertices(mesh);
    bool need_mesh = outs->picture != NULL;
    loxo_status status = cli_before_output(run);
    for (int i = 0; i < outs->n && status >= 0; ++i) {
        if (outs->file[i].kind == CLI_MESH) {
            need_mesh = true;
            continue;
        }
        status = loxo_write_field(run->ctx, outs->file[i].path, "distance", distance, n, &outs->file[i].write);
        if (status >= 0) cli_wrote(run, outs->file[i].path);
    }
    if (status >= 0 && need_mesh) status = write_meshes(run, s, outs, mesh, distance);
    if (status >= 0) (void)cli_seconds(run, "write", start_s);
    return status;
}

static loxo_status geodesic_main(cli_run *run, void *state)
{
    geodesic_state *s = state;
    const char *exact = cli_args_value(&run->args, "exact", 0);
    outputs outs = {.n = 0};
    cli_method method;
    cli_sources sources = {0};
    loxo_soup soup = {0};
    loxo_mesh *mesh = NULL, *intrinsic = NULL;
    double *distance = NULL;
    loxo_status status;
    if (cli_args_has(&run->args, "source-point") || cli_args_has(&run->args, "source-points"))
        s->intrinsic.traceable = true; /* they lie in faces of the surface */
    if (cli_args_has(&run->args, "nearest-output")) s->geodesic.nearest = true;
    s->draw.title = cli_args_value(&run->args, "title", 0);
    s->draw.unit = cli_args_value(&run->args, "unit", 0);
    if ((status = cli_method_by_options(run, &s->geodesic, &method)) < 0) return status;
    if (!s->common.estimate && (status = cli_sources_check(run)) < 0) return status;
    if ((status = check_files(run, s->common.estimate, &outs)) < 0) return status;
    if (s->common.estimate) return estimate(run, s, &method);
    if ((status = check_memory(run, s)) < 0) return status;
    if ((status = cli_read_mesh(run, run->args.operand[0], &soup)) < 0) return status;
    sources.n_vertices = soup.n_vertices;
    if ((status = cli_sources_read(run, &sources)) < 0) goto done;
    choose_order(run, s, soup.n_vertices, soup.n_faces, soup.position_float != NULL);
    if ((status = make_mesh(run, s, &soup, &mesh)) < 0) goto done;
    if ((status = cli_sources_locate(run, mesh, &sources)) < 0) goto done;
    if ((status = cli_queries_prepare(run, mesh, &sources, &outs.queries)) < 0) goto done;
    bool is_intrinsic = cli_args_has(&run->args, "intrinsic");
    const int64_t n_solves = outs.queries.matrix_path != NULL ? sources.n + 1 : 1;
    status = cli_method_by_mesh(run, &method, mesh, n_solves, &s->geodesic, &s->intrinsic, &is_intrinsic);
    if (status < 0) goto done;
    if (!is_intrinsic) cli_warn_idle(run, "intrinsic", "without --intrinsic");
    if (is_intrinsic && (status = cli_make_intrinsic(run, mesh, &s->intrinsic, &intrinsic)) < 0) goto done;
    status = LOXO_ERR_MEMORY;
    if ((distance = loxo_allocate(run->ctx, loxo_mesh_n_vertices(mesh), sizeof *distance)) == NULL) goto done;
    status = solve(run, s, intrinsic != NULL ? intrinsic : mesh, mesh, &sources, distance, &outs.queries);
    if (status < 0) goto done;
    if (!is_intrinsic) cli_method_hint(run, &method, s->geodesic.method, status);
    if ((status = cli_before_output(run)) < 0) goto done;
    if (exact != NULL && (status = cli_measure_against(run, exact, distance, loxo_mesh_n_vertices(mesh))) < 0)
        goto done;
    status = write_files(run, s, &outs, mesh, distance);
    if (status >= 0) status = cli_queries_write(run, mesh, &outs.queries);
done:
    cli_queries_destroy(run, &outs.queries);
    cli_sources_destroy(run, &sources);
    loxo_release(run->ctx, distance);
    loxo_mesh_destroy(intrinsic);
    loxo_mesh_destroy(mesh);
    loxo_soup_destroy(run->ctx, &soup);
    return status;
}

static const cli_flag geodesic_flags[] = {
    CLI_SOURCE_FLAGS,
    CLI_QUERY_FLAGS,
    {.name = "intrinsic", .help = "solve on the intrinsic Delaunay triangulation: for badly shaped triangles"},
    {.name = "output",
     .letter = 'o',
     .values = "FILE",
     .n_values = 1,
     .repeats = true,
     .help = "distances: .npy .csv .shape.gii; with the mesh: .ply .vtp .surf.gii"},
    {.name = "format", .values = "F", .n_values = 1, .help = "of -o whatever its suffix, as npy"},
    {.name = "picture", .values = "FILE.png", .n_values = 1, .help = "the mesh with the distances on it"},
    {.name = "title", .values = "TEXT", .n_values = 1, .help = "over the picture"},
    {.name = "unit", .values = "TEXT", .n_values = 1, .help = "beside the picture's scale bar"},
    {.name = "exact", .values = "FILE", .n_values = 1, .reads = true, .help = "compare with these distances, eq. (29)"},
    {.name = NULL},
};
static const cli_group geodesic_groups[] = {
    {"geodesic", loxo_geodesic_options, offsetof(geodesic_state, geodesic)},
    {"mesh", loxo_mesh_options, offsetof(geodesic_state, mesh)},
    {"intrinsic", loxo_intrinsic_options, offsetof(geodesic_state, intrinsic)},
    {"picture", loxo_draw_options, offsetof(geodesic_state, draw)},
    {.title = NULL},
};

static const cli_need geodesic_needs[] = {
    {"nearest", "nearest-output"}, {"format", "output"},   {"title", "picture"},
    {"unit", "picture"},           {"picture", "picture"}, {NULL, NULL},
};

const cli_command command_geodesic = {
    .name = "geodesic",
    .operands = "MESH -s V,.. -o FILE [options]",
    .summary = "distances over the surface from one or many sources",
    .about = "Reads a surface and computes the geodesic distance of every vertex from the sources. Without --method it "
             "is exact\n"
             "up to 20,000 vertices, a front of rays beyond, and on bad triangles on an intrinsic triangulation; an "
             "option that\n"
             "only some methods have chooses one of these. Vertices that no source reaches get infinity. The answer is "
             "checked\n"
             "before it is given; one that fails is written, marked in the report, and the exit code is 8.\n",
    .examples = "  loxo geodesic bunny.off -s 0 -o distance.npy --picture bunny.png\n"
                "  loxo geodesic brain.surf.gii -s 0,17 -o distance.shape.gii --json report.json\n"
                "  loxo geodesic scan.ply --source-point 0.1,0,0.3 --method face -o distance.ply\n"
                "  loxo geodesic scan.ply -s 0 --path 1200 --path-output path.obj --lines-output lines.obj\n"
                "  loxo geodesic scan.ply --sources points.txt --matrix matrix.npy --nearest-output cells.npy\n",
    .min_operands = 1,
    .max_operands = 1,
    .flags = geodesic_flags,
    .groups = geodesic_groups,
    .needs = geodesic_needs,
    .state_bytes = sizeof(geodesic_state),
    .defaults = set_defaults,
    .main = geodesic_main,
};
