/* SPDX-License-Identifier: MIT
 * Children that make meshes, or measure how they are built. */
#include "base/options.h"
#include "base/os.h"
#include "worker.h"

#include <stdlib.h>
#include <string.h>

loxo_status bench_mesh_of(bench *b, loxo_soup *soup, const loxo_mesh_settings *settings, loxo_mesh_info *info,
                          loxo_mesh **mesh)
{
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    soup->position = NULL;
    soup->position_float = NULL;
    soup->triangle = NULL;
    return loxo_mesh_create(b->ctx, &arrays, LOXO_ADOPT, settings, info, mesh);
}

/* generate SHAPE N FILE */
loxo_status bench_task_generate(bench *b, char **argv)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    int64_t n_vertices = 0, n_faces = 0;
    if (!loxo_shape_from_name(argv[0], &settings.shape))
        return bench_fail(b, LOXO_ERR_ARGUMENT, "no shape of that name: %s", argv[0]);
    settings.n_vertices = strtoll(argv[1], NULL, 10);
    const loxo_status status = loxo_generate_to_ply(b->ctx, &settings, false, argv[2], &n_vertices, &n_faces);
    if (status < 0) return status;
    return bench_print_json(
        b, json_pack("{s:I, s:I}", "n_vertices", (json_int_t)n_vertices, "n_faces", (json_int_t)n_faces));
}

static loxo_status print_counts(bench *b, const loxo_soup *soup)
{
    return bench_print_json(
        b, json_pack("{s:I, s:I}", "n_vertices", (json_int_t)soup->n_vertices, "n_faces", (json_int_t)soup->n_faces));
}

/* What a task changed goes to a file; the soup is destroyed. */
static loxo_status write_out(bench *b, loxo_soup *soup, const char *path, loxo_status status)
{
    if (status >= 0) status = loxo_write_mesh(b->ctx, path, soup, NULL);
    if (status >= 0) status = print_counts(b, soup);
    loxo_soup_destroy(b->ctx, soup);
    return status;
}

/* subdivide FILE TIMES OUT: also tells the counts when TIMES is 0, and then writes nothing. */
loxo_status bench_task_subdivide(bench *b, char **argv)
{
    loxo_soup soup = {0};
    const int n_times = (int)strtol(argv[1], NULL, 10);
    loxo_status status = loxo_read_mesh(b->ctx, argv[0], NULL, &soup);
    if (status >= 0 && n_times == 0) {
        status = print_counts(b, &soup);
        loxo_soup_destroy(b->ctx, &soup);
        return status;
    }
    if (status >= 0) status = loxo_soup_subdivide(b->ctx, &soup, n_times);
    return write_out(b, &soup, argv[2], status);
}

loxo_status bench_task_shuffle(bench *b, char **argv)
{
    loxo_soup soup = {0};
    loxo_status status = loxo_read_mesh(b->ctx, argv[0], NULL, &soup);
    if (status >= 0) status = loxo_soup_shuffle(b->ctx, &soup, 1, NULL);
    return write_out(b, &soup, argv[1], status);
}

loxo_status bench_task_closed_form(bench *b, char **argv)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_soup soup = {0};
    double *distance = NULL;
    if (!loxo_shape_from_name(argv[0], &settings.shape))
        return bench_fail(b, LOXO_ERR_ARGUMENT, "no shape of that name: %s", argv[0]);
    settings.n_vertices = strtoll(argv[1], NULL, 10);
    loxo_status status = loxo_generate(b->ctx, &settings, false, &soup);
    if (status < 0) return status;
    distance = loxo_allocate(b->ctx, soup.n_vertices, sizeof *distance);
    status = distance == NULL
                 ? LOXO_ERR_MEMORY
                 : loxo_generate_exact_distance(b->ctx, &settings, &soup, (loxo_index)b->settings.source, distance);
    if (status >= 0) status = loxo_write_field(b->ctx, argv[2], "distance", distance, soup.n_vertices, NULL);
    if (status >= 0) status = print_counts(b, &soup);
    loxo_release(b->ctx, distance);
    loxo_soup_destroy(b->ctx, &soup);
    return status;
}

/* build FILE N: half-edges of a mesh in memory and its intrinsic Delaunay triangulation, N times after a warm-up. */
loxo_status bench_task_build(bench *b, char **argv)
{
    loxo_soup soup;
    const int n = (int)strtol(argv[1], NULL, 10);
    json_t *total = json_array(), *halfedge = json_array(), *reorder = json_array(), *intrinsic = json_array();
    loxo_mesh_info info = {0};
    loxo_intrinsic_info flips = {0};
    loxo_status status = loxo_read_mesh(b->ctx, argv[0], NULL, &soup);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    for (int k = -1; k < n && status >= 0; ++k) {
        loxo_mesh *mesh = NULL, *delaunay = NULL;
        const double start = loxo_os_clock_s();
        status = loxo_mesh_create(b->ctx, &arrays, LOXO_BORROW, NULL, &info, &mesh);
        const double seconds = loxo_os_clock_s() - start;
        if (status >= 0) status = loxo_mesh_create_intrinsic(b->ctx, mesh, NULL, &flips, &delaunay);
        loxo_mesh_destroy(delaunay);
        loxo_mesh_destroy(mesh);
        if (k < 0) continue;
        json_array_append_new(total, json_real(seconds));
        json_array_append_new(halfedge, json_real(info.halfedge_s));
        json_array_append_new(reorder, json_real(info.reorder_s));
        json_array_append_new(intrinsic, json_real(flips.seconds));
    }
    json_t *result =
        json_pack("{s:o, s:o, s:o, s:o, s:I, s:I, s:I, s:I, s:i, s:I}", "total_s", total, "halfedge_s", halfedge,
                  "reorder_s", reorder, "intrinsic_s", intrinsic, "n_flips", (json_int_t)flips.n_flips, "mesh_bytes",
                  (json_int_t)info.mesh_bytes, "order_bytes", (json_int_t)info.order_bytes, "peak_bytes",
                  (json_int_t)info.peak_bytes, "order", (int)info.order, "n_vertices", (json_int_t)soup.n_vertices);
    loxo_soup_destroy(b->ctx, &soup);
    if (status >= 0) return bench_print_json(b, result);
    json_decref(result);
    return status;
}

/* One thread is timed by its processor time, which others on the machine disturb less; several by the clock. */
static double order_clock(const bench *b)
{
    return loxo_context_n_threads(b->ctx) == 1 ? loxo_os_cpu_s() : loxo_os_clock_s();
}

/* One round of bench_task_order. */
static loxo_status order_once(bench *b, const loxo_mesh_arrays *arrays, const loxo_mesh_settings *mesh_settings,
                              const loxo_geodesic_settings *settings, double *distance, loxo_mesh_info *info,
                              double seconds[4])
{
    const loxo_index source = (loxo_index)b->settings.source;
    loxo_mesh *mesh = NULL;
    loxo_geodesic *geodesic = NULL;
    const double start = order_clock(b);
    loxo_status status = loxo_mesh_create(b->ctx, arrays, LOXO_BORROW, mesh_settings, info, &mesh);
    const double built = order_clock(b);
    if (status >= 0) status = loxo_geodesic_create(b->ctx, mesh, settings, &geodesic);
    const double created = order_clock(b);
    if (status >= 0) status = loxo_geodesic_solve(geodesic, &source, 1, distance, NULL);
    const double share = info->total_s > 0.0 ? info->reorder_s / info->total_s : 0.0;
    seconds[0] = share * (built - start);
    seconds[1] = (1.0 - share) * (built - start);
    seconds[2] = created - built;
    seconds[3] = order_clock(b) - created;
    loxo_geodesic_destroy(geodesic);
    loxo_mesh_destroy(mesh);
    return status;
}

/* order FILE ORDER N METHOD: half-edges and a solve in an order, N times, the first on memory never touched. */
loxo_status bench_task_order(bench *b, char **argv)
{
    static const char *const keys[4] = {"reorder_s", "halfedge_s", "create_s", "solve_s"};
    loxo_soup soup = {0};
    loxo_mesh_settings mesh_settings = loxo_mesh_settings_default();
    loxo_geodesic_settings settings;
    loxo_mesh_info info = {0};
    const int n = (int)strtol(argv[2], NULL, 10);
    json_t *result = json_object();
    double seconds[4], *distance = NULL;
    for (int q = 0; q < 4; ++q)
        json_object_set_new(result, keys[q], json_array());
    loxo_status status = loxo_options_set(b->ctx, "mesh", loxo_mesh_options, &mesh_settings, "order", argv[1]);
    if (status >= 0) status = bench_method_settings(b, argv[3], &settings);
    if (status >= 0) status = loxo_read_mesh(b->ctx, argv[0], NULL, &soup);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    if (status >= 0 && (distance = loxo_allocate(b->ctx, soup.n_vertices, sizeof *distance)) == NULL)
        status = LOXO_ERR_MEMORY;
    for (int k = 0; k < n && status >= 0; ++k) {
        status = order_once(b, &arrays, &mesh_settings, &settings, distance, &info, seconds);
        for (int q = 0; q < 4; ++q)
            json_array_append_new(json_object_get(result, keys[q]), json_real(seconds[q]));
    }
    json_object_set_new(result, "order", json_integer((int)info.order));
    json_object_set_new(result, "n_vertices", json_integer((json_int_t)soup.n_vertices));
    loxo_release(b->ctx, distance);
    loxo_soup_destroy(b->ctx, &soup);
    if (status >= 0) return bench_print_json(b, result);
    json_decref(result);
    return status;
}
