/* SPDX-License-Identifier: MIT
 * What a solve will take, before it is run: bytes by the library's own estimate, seconds by a solve on a smaller mesh of the
 * same surface. */
#include "paper.h"

#include <math.h>
#include <string.h>

#define COARSE_VERTICES 250000.0
/* Factors of the paper's Table 1 grow as n^1.18; what the library knows of heat and variational is growth by multigrid. */
#define GROWTH_OF_FACTORS 0.2

size_t paper_predict_bytes(bench *b, const char *method, int64_t n_vertices, int64_t n_faces)
{
    loxo_geodesic_settings settings;
    size_t mesh_bytes = 0, build_bytes = 0, work_bytes = 0;
    if (paper_method_settings(b, method, &settings) < 0 ||
        loxo_mesh_estimate(n_vertices, n_faces, false, NULL, &mesh_bytes, &build_bytes) < 0 ||
        loxo_geodesic_estimate(b->ctx, n_vertices, n_faces, &settings, &work_bytes, NULL) < 0)
        return 0;
    const size_t solve_bytes = mesh_bytes + work_bytes + sizeof(double) * (size_t)n_vertices;
    return solve_bytes > build_bytes ? solve_bytes : build_bytes;
}

size_t paper_memory_limit(const bench *b)
{
    return b->settings.max_memory > 0 ? b->settings.max_memory : loxo_context_memory(b->ctx).limit_bytes;
}

loxo_status paper_mesh_coarsen(bench *b, const paper_mesh *mesh, paper_mesh *coarse)
{
    *coarse = *mesh;
    if ((double)mesh->n_vertices < 2.1 * COARSE_VERTICES) return LOXO_OK;
    const bool has_truth = mesh->truth[0] != '\0';
    const loxo_status status = paper_mesh_make(b, mesh->model, COARSE_VERTICES, has_truth, coarse);
    if (status >= 0 && coarse->n_vertices >= mesh->n_vertices) *coarse = *mesh;
    return status;
}

double paper_growth(bench *b, const char *method, const paper_mesh *from, const paper_mesh *to)
{
    loxo_geodesic_settings settings;
    double from_s = 0.0, to_s = 0.0;
    if (paper_method_settings(b, method, &settings) < 0 ||
        loxo_geodesic_estimate(b->ctx, from->n_vertices, from->n_faces, &settings, NULL, &from_s) < 0 ||
        loxo_geodesic_estimate(b->ctx, to->n_vertices, to->n_faces, &settings, NULL, &to_s) < 0)
        return (double)NAN;
    const double more = settings.factor == LOXO_FACTOR_CHOLESKY ? GROWTH_OF_FACTORS : 0.0;
    return to_s / from_s * pow((double)to->n_vertices / (double)from->n_vertices, more);
}

double paper_predict_seconds(bench *b, const paper_mesh *mesh, const char *method, int n_threads)
{
    paper_mesh coarse;
    json_t *result = NULL;
    char text[BENCH_PATH];
    paper_method_text(method, text, sizeof text);
    if (paper_mesh_coarsen(b, mesh, &coarse) < 0 || coarse.n_vertices == mesh->n_vertices) return (double)NAN;
    if (bench_worker_run(b, n_threads, (const char *const[]){"solve", coarse.path, text, "1", "-", NULL}, &result) < 0)
        return (double)NAN;
    const json_t *solve = json_array_get(json_object_get(result, "solves"), 0);
    const double seconds = bench_number(result, "create_s") + bench_number(solve, "solve_s");
    json_decref(result);
    return seconds * paper_growth(b, method, &coarse, mesh);
}
