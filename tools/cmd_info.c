/* SPDX-License-Identifier: MIT
 * loxo info: what a mesh is like, and what is wrong with it. */
#include "base/os.h"
#include "commands.h"
#include "estimate.h"
#include "intrinsic.h"
#include "run.h"

#include <math.h>

#define DEGREES (180.0 / 3.14159265358979323846)

typedef struct info_state {
    cli_common common;
    loxo_intrinsic_settings intrinsic;
} info_state;

static void set_defaults(void *state)
{
    *(info_state *)state = (info_state){.intrinsic = loxo_intrinsic_settings_default()};
    ((info_state *)state)->intrinsic.traceable = false;
}

/* A kind of fault with what a row and the JSON call it, and what its numbers count. */
typedef struct fault_row {
    const char *key, *label, *unit;
    size_t offset;
} fault_row;

static const fault_row faults[] = {
    {"nonmanifold_edges", "non-manifold edges", "face", offsetof(loxo_mesh_report, nonmanifold_edges)},
    {"nonmanifold_vertices", "non-manifold vertices", "vertex", offsetof(loxo_mesh_report, nonmanifold_vertices)},
    {"inconsistent_faces", "inconsistently oriented faces", "face", offsetof(loxo_mesh_report, inconsistent_faces)},
    {"duplicate_vertices", "duplicate vertices", "vertex", offsetof(loxo_mesh_report, duplicate_vertices)},
    {"unreferenced_vertices", "unreferenced vertices", "vertex", offsetof(loxo_mesh_report, unreferenced_vertices)},
    {"degenerate_faces", "degenerate faces", "face", offsetof(loxo_mesh_report, degenerate_faces)},
    {"zero_area_faces", "faces without area", "face", offsetof(loxo_mesh_report, zero_area_faces)},
    {"duplicate_faces", "duplicate faces", "face", offsetof(loxo_mesh_report, duplicate_faces)},
    {"nonfinite_vertices", "vertices that are not finite", "vertex", offsetof(loxo_mesh_report, nonfinite_vertices)},
};
#define N_FAULTS (sizeof faults / sizeof *faults)

static const loxo_fault *fault_of(const loxo_mesh_report *r, const fault_row *row)
{
    return (const loxo_fault *)(const void *)((const unsigned char *)r + row->offset);
}

static void report_faults(cli_run *run, const loxo_mesh_report *r)
{
    json_t *all = json_put_object(json_object_get(run->report.json, "mesh"), "faults");
    for (size_t i = 0; i < N_FAULTS; ++i) {
        const loxo_fault *f = fault_of(r, &faults[i]);
        json_t *fault = json_put_object(all, faults[i].key);
        json_put_integer(fault, "count", f->count);
        json_t *first = json_put_array(fault, "first");
        for (int k = 0; k < f->n_first; ++k)
            json_append(first, json_integer(f->first[k]));
        if (f->count == 0) continue;
        cli_warn(run, f->count, "%lld %s (first: %s %lld)", (long long)f->count, faults[i].label, faults[i].unit,
                 (long long)f->first[0]);
    }
    if (!r->is_orientable) cli_warn(run, 1, "the surface is not orientable");
}

static void put_statistics(json_t *object, const char *key, const loxo_statistics *s)
{
    json_t *inner = json_put_object(object, key);
    json_put_number(inner, "min", s->min);
    json_put_number(inner, "percentile_1", s->percentile_1);
    json_put_number(inner, "median", s->median);
    json_put_number(inner, "mean", s->mean);
    json_put_number(inner, "percentile_99", s->percentile_99);
    json_put_number(inner, "max", s->max);
}

static void put_report(json_t *mesh, const loxo_mesh_report *r)
{
    json_put_integer(mesh, "n_vertices", r->n_vertices);
    json_put_integer(mesh, "n_edges", r->n_edges);
    json_put_integer(mesh, "n_faces", r->n_faces);
    json_put_integer(mesh, "n_components", r->n_components);
    json_put_integer(mesh, "n_boundary_edges", r->n_boundary_edges);
    json_put_integer(mesh, "n_boundary_loops", r->n_boundary_loops);
    json_put_integer(mesh, "euler", r->euler);
    json_put_integer(mesh, "genus", r->genus);
    json_put_bool(mesh, "is_manifold", r->is_manifold);
    json_put_bool(mesh, "is_orientable", r->is_orientable);
    json_put_bool(mesh, "is_oriented", r->is_oriented);
    json_put_bool(mesh, "is_closed", r->is_closed);
    json_put_number(mesh, "area", r->area);
    json_put_number(mesh, "volume", r->volume);
    json_t *box = json_put_array(mesh, "bounding_box");
    for (int i = 0; i < 2; ++i) {
        json_t *corner = json_array();
        for (int k = 0; k < 3; ++k)
            json_append(corner, json_of_number(r->bounding_box[i][k]));
        json_append(box, corner);
    }
    put_statistics(mesh, "edge_length", &r->edge_length);
    put_statistics(mesh, "angle_rad", &r->angle_rad);
    json_put_number(mesh, "share_obtuse", r->share_obtuse);
    json_put_number(mesh, "share_nondelaunay", r->share_nondelaunay);
    json_put_number(mesh, "share_negative_cotangent", r->share_negative_cotangent);
    json_put_number(mesh, "quality", r->quality);
}

static void report_topology(cli_report *out, const loxo_mesh_report *r)
{
    report_row(out, "vertices", "%s", text_count(r->n_vertices));
    report_row(out, "edges", "%s", text_count(r->n_edges));
    report_row(out, "faces", "%s", text_count(r->n_faces));
    report_row(out, "components", "%s", text_count(r->n_components));
    report_row(out, "Euler number", "%s", text_count(r->euler));
    if (r->genus >= 0) report_row(out, "genus", "%s", text_count(r->genus));
    if (r->n_boundary_loops >= 0) report_row(out, "boundary loops", "%s", text_count(r->n_boundary_loops));
    report_row(out, "boundary edges", "%s", text_count(r->n_boundary_edges));
    report_row(out, "surface", "%s, %s, %s", r->is_manifold ? "manifold" : "NOT manifold",
               !r->is_orientable ? "NOT orientable"
               : r->is_oriented  ? "oriented"
                                 : "orientable, not oriented",
               r->is_closed ? "closed" : "with boundary");
}

static void report_geometry(cli_report *out, const loxo_mesh_report *r)
{
    const loxo_statistics *e = &r->edge_length, *a = &r->angle_rad;
    report_row(out, "area", "%.6g", r->area);
    if (r->is_closed) report_row(out, "volume", "%.6g", r->volume);
    report_row(out, "bounding box", "%.6g %.6g %.6g to %.6g %.6g %.6g", r->bounding_box[0][0], r->bounding_box[0][1],
               r->bounding_box[0][2], r->bounding_box[1][0], r->bounding_box[1][1], r->bounding_box[1][2]);
    report_row(out, "edge length", "min %.4g, 1 %% %.4g, median %.4g, mean %.4g, 99 %% %.4g, max %.4g", e->min,
               e->percentile_1, e->median, e->mean, e->percentile_99, e->max);
    report_row(out, "angle, degrees", "min %.4g, 1 %% %.4g, median %.4g, 99 %% %.4g, max %.4g", a->min * DEGREES,
               a->percentile_1 * DEGREES, a->median * DEGREES, a->percentile_99 * DEGREES, a->max * DEGREES);
    report_row(out, "shares", "obtuse %.2f %%, non-Delaunay edges %.2f %%, negative cotangents %.2f %%",
               100.0 * r->share_obtuse, 100.0 * r->share_nondelaunay, 100.0 * r->share_negative_cotangent);
    report_row(out, "quality", "%.4f", r->quality);
}

/* What flips would bring. The arrays go to the mesh. */
static loxo_status report_flips(cli_run *run, const info_state *s, loxo_soup *soup)
{
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    loxo_mesh *mesh = NULL, *intrinsic = NULL;
    soup->position = NULL; /* adopted, whatever happens */
    soup->position_float = NULL;
    soup->triangle = NULL;
    loxo_status status = loxo_mesh_create(run->ctx, &arrays, LOXO_ADOPT, NULL, NULL, &mesh);
    if (status >= 0) status = cli_make_intrinsic(run, mesh, &s->intrinsic, &intrinsic);
    loxo_mesh_destroy(intrinsic);
    loxo_mesh_destroy(mesh);
    return status;
}

static loxo_status estimate(cli_run *run, const info_state *s)
{
    loxo_mesh_counts counts;
    const loxo_status status = cli_count_mesh(run, run->args.operand[0], &counts);
    if (status < 0) return status;
    const size_t arrays = cli_counts_bytes(&counts);
    size_t work = 60 * (size_t)counts.n_vertices, mesh = 0, build = 0, flips = 0;
    if (cli_args_has(&run->args, "intrinsic") &&
        loxo_mesh_estimate(counts.n_vertices, counts.n_faces, counts.is_float, NULL, &mesh, &build) >= 0) {
        loxo_mesh_estimate_intrinsic(counts.n_vertices, counts.n_faces, &s->intrinsic, NULL, &flips);
        const size_t most = mesh + flips > build ? mesh + flips : build;
        if (most > arrays + work) work = most - arrays;
    }
    cli_estimate_part(run, "read_bytes", counts.read_bytes);
    cli_estimate_part(run, "arrays_bytes", arrays);
    cli_estimate_part(run, "work_bytes", work);
    cli_estimate(run, counts.read_bytes > arrays + work ? counts.read_bytes : arrays + work, NAN);
    return status;
}

static loxo_status info_main(cli_run *run, void *state)
{
    const info_state *s = state;
    loxo_soup soup = {0};
    loxo_mesh_report *r = NULL;
    if (s->common.estimate) return estimate(run, s);
    loxo_status status = cli_read_mesh(run, run->args.operand[0], &soup);
    if (status < 0) return status;
    if ((r = loxo_allocate(run->ctx, 1, sizeof *r)) == NULL) {
        status = LOXO_ERR_MEMORY;
        goto done;
    }
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    const double start_s = loxo_os_clock_s();
    if ((status = loxo_mesh_check(run->ctx, &arrays, r)) < 0) goto done;
    (void)cli_seconds(run, "report", start_s);
    put_report(json_put_object(run->report.json, "mesh"), r);
    report_faults(run, r);
    report_topology(&run->report, r);
    report_geometry(&run->report, r);
    if (cli_args_has(&run->args, "intrinsic")) status = report_flips(run, s, &soup);
done:
    loxo_release(run->ctx, r);
    loxo_soup_destroy(run->ctx, &soup);
    return status;
}

static const cli_flag info_flags[] = {
    {.name = "intrinsic", .help = "what flips to the intrinsic Delaunay triangulation would bring"},
    {.name = NULL},
};
static const cli_group info_groups[] = {
    {"intrinsic", loxo_intrinsic_options, offsetof(info_state, intrinsic)},
    {.title = NULL},
};

static const cli_need info_needs[] = {{"intrinsic", "intrinsic"}, {NULL, NULL}};

const cli_command command_info = {
    .name = "info",
    .operands = "MESH [options]",
    .summary = "topology and quality of a mesh, and its faults",
    .about =
        "Reads a surface (PLY, OBJ, OFF, STL, GIFTI, FreeSurfer; gzipped or not; - is standard input) and tells its\n"
        "counts, topology, edge lengths and angles. Each kind of fault is one warning with its count and the first\n"
        "offender; the first eight stand in the JSON report. Nothing is changed.\n",
    .examples = "  loxo info bunny.off\n  loxo info scan.ply.gz --strict --json -\n  loxo info scan.ply --intrinsic\n",
    .min_operands = 1,
    .max_operands = 1,
    .flags = info_flags,
    .groups = info_groups,
    .needs = info_needs,
    .state_bytes = sizeof(info_state),
    .defaults = set_defaults,
    .main = info_main,
};
