/* SPDX-License-Identifier: MIT
 * The best smoothing factor m of (28), t = m h^2. The paper searches it for the heat method and its variational sister, model
 * by model, «that produces results with the best accuracy», and prints it with one decimal; how it searched it does not say.
 * Here, for every method that diffuses heat: from m = 1 by doubling, then by halving, as long as the error falls (one rise
 * is passed over: errors of neighbouring m differ by chance); then around the best, three times, at half the distance. So m
 * is known to a factor 2^(1/8), 9 %, within which the error is flat. */
#include "../worker.h"
#include "paper.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MOST_DOUBLINGS 8 /* up to 256, and down to 1/256 */
#define N_REFINEMENTS  3

bool paper_is_heat(const char *method)
{
    static const char *const names[] = {"edge", "face", "heat", "variational"};
    const size_t n = strcspn(method, ",");
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i)
        if (strlen(names[i]) == n && strncmp(names[i], method, n) == 0) return true;
    return false;
}

typedef struct search {
    bench *b;
    const loxo_mesh *mesh;
    loxo_geodesic_settings settings;
    int64_t n_truth;
    const double *truth;
    double *distance;
    double best_m, best_error;
    json_t *tried;
} search;

/* Error at m = 2^exponent; infinite when the solve failed. */
static loxo_status try_m(search *s, double exponent, double *error)
{
    const loxo_index source = (loxo_index)s->b->settings.source;
    loxo_distance_error measured = {0};
    s->settings.time_factor = exp2(exponent);
    loxo_status status = loxo_geodesic_distance(s->b->ctx, s->mesh, &s->settings, &source, 1, s->distance, NULL);
    if (status == LOXO_ERR_MEMORY || status == LOXO_ERR_UNSUPPORTED || status == LOXO_ERR_ARGUMENT) return status;
    *error = INFINITY;
    if (status >= 0) {
        status = loxo_measure_distance_error(s->b->ctx, s->distance, s->truth, s->n_truth, &measured);
        if (status < 0) return status;
        if (measured.n_mismatched == 0) *error = measured.mean_relative;
    }
    json_array_append_new(s->tried, json_pack("{s:f, s:o}", "m", s->settings.time_factor, "error", paper_json(*error)));
    if (*error < s->best_error) {
        s->best_error = *error;
        s->best_m = s->settings.time_factor;
    }
    return LOXO_OK;
}

static loxo_status find_best(search *s)
{
    double error = 0.0;
    loxo_status status = try_m(s, 0.0, &error);
    for (int direction = 1; direction >= -1 && status >= 0; direction -= 2) {
        double before = s->best_error;
        int n_rises = 0;
        for (int k = 1; k <= MOST_DOUBLINGS && n_rises < 2 && status >= 0; ++k) {
            if ((status = try_m(s, direction * k, &error)) < 0) break;
            n_rises = error < before ? 0 : n_rises + 1;
            before = fmin(before, error);
        }
    }
    for (int k = 1; k <= N_REFINEMENTS && status >= 0; ++k) {
        const double centre = log2(s->best_m), step = exp2(-k);
        for (int side = -1; side <= 1 && status >= 0; side += 2)
            status = try_m(s, centre + side * step, &error);
    }
    return status;
}

/* search FILE METHOD TRUTH */
loxo_status bench_task_search(bench *b, char **argv)
{
    loxo_soup soup = {0};
    loxo_mesh *mesh = NULL;
    double *truth = NULL;
    search s = {.b = b, .best_m = 1.0, .best_error = INFINITY, .tried = json_array()};
    loxo_status status = paper_method_settings(b, argv[1], &s.settings);
    if (status >= 0) status = loxo_read_mesh(b->ctx, argv[0], NULL, &soup);
    if (status >= 0) status = bench_mesh_of(b, &soup, NULL, NULL, &mesh);
    if (status >= 0) status = loxo_read_field(b->ctx, argv[2], &truth, &s.n_truth);
    if (status >= 0 && s.n_truth > loxo_mesh_n_vertices(mesh))
        status = bench_fail(b, LOXO_ERR_MALFORMED, "%s: not of this mesh", argv[2]);
    s.mesh = mesh;
    s.truth = truth;
    if (status >= 0 && (s.distance = loxo_allocate(b->ctx, loxo_mesh_n_vertices(mesh), sizeof *s.distance)) == NULL)
        status = LOXO_ERR_MEMORY;
    if (status >= 0) status = find_best(&s);
    loxo_release(b->ctx, s.distance);
    loxo_release(b->ctx, truth);
    loxo_mesh_destroy(mesh);
    loxo_soup_destroy(b->ctx, &soup);
    if (status >= 0)
        return bench_print_json(
            b, json_pack("{s:f, s:o, s:o}", "m", s.best_m, "error", paper_json(s.best_error), "tried", s.tried));
    json_decref(s.tried);
    return status;
}

double paper_best_m(bench *b, const paper_mesh *mesh, const char *method, int n_threads, double *error_at_one)
{
    json_t *result = NULL;
    *error_at_one = (double)NAN;
    if (mesh->truth[0] == '\0' ||
        paper_predict_bytes(b, method, mesh->n_vertices, mesh->n_faces) > paper_memory_limit(b))
        return (double)NAN;
    const loxo_status status =
        bench_worker_run(b, n_threads, (const char *const[]){"search", mesh->path, method, mesh->truth, NULL}, &result);
    if (status < 0) return (double)NAN;
    const double m = bench_number(result, "m"), found = bench_number(result, "error");
    *error_at_one = bench_number(json_array_get(json_object_get(result, "tried"), 0), "error"); /* it begins there */
    bench_record(b, "search",
                 json_pack("{s:s, s:I, s:s, s:O}", "mesh", mesh->model->name, "n_vertices",
                           (json_int_t)mesh->n_vertices, "method", method, "tried", json_object_get(result, "tried")));
    json_decref(result);
    return isnan(found) ? (double)NAN : m;
}
