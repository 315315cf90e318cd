/* SPDX-License-Identifier: MIT
 * The best smoothing factor m of (28), t = m h^2. The paper searches it for the heat method and its variational sister, model
 * by model, «that produces results with the best accuracy», and prints it with one decimal; how it searched it does not say.
 * Here, for every method that diffuses heat: from m = 1 by doubling, then by halving, as long as the error falls (one rise
 * is passed over: errors of neighbouring m differ by chance); then around the best, three times, at half the distance. So m
 * is known to a factor 2^(1/8), 9 %, within which the error is flat. That is about a dozen solves. A large mesh is searched
 * so on a smaller mesh of the same surface; on itself it is then tried at that m and at 1, from the better of them by
 * doubling and halving until the error rises, and half-way. --search-seconds ends either. */
#include "../worker.h"
#include "base/os.h"
#include "paper.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOST_DOUBLINGS 8 /* up to 256, and down to 1/256 */

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
    double start_s, longest_s, solves_s; /* of the search; of a solve; of all solves */
    bool is_cut;                         /* time was up */
    double best_m, best_error;
    json_t *tried;
} search;

/* Error at m = 2^exponent; infinite when the solve failed, or when there is no time for it. */
static loxo_status try_m(search *s, double exponent, double *error)
{
    const loxo_index source = (loxo_index)s->b->settings.source;
    const double m = exp2(exponent), begin_s = loxo_os_clock_s();
    loxo_distance_error measured = {0};
    json_t *one;
    size_t i;
    *error = INFINITY;
    json_array_foreach(s->tried, i, one)
    {
        if (fabs(bench_number(one, "m") / m - 1.0) > 1e-6) continue;
        if (json_is_number(json_object_get(one, "error"))) *error = bench_number(one, "error");
        return LOXO_OK;
    }
    s->is_cut = s->is_cut ||
                (json_array_size(s->tried) > 0 && begin_s + s->longest_s > s->start_s + s->b->settings.search_seconds);
    if (s->is_cut) return LOXO_OK;
    s->settings.time_factor = m;
    loxo_status status = loxo_geodesic_distance(s->b->ctx, s->mesh, &s->settings, &source, 1, s->distance, NULL);
    if (status == LOXO_ERR_MEMORY || status == LOXO_ERR_UNSUPPORTED || status == LOXO_ERR_ARGUMENT) return status;
    if (status >= 0) {
        status = loxo_measure_distance_error(s->b->ctx, s->distance, s->truth, s->n_truth, &measured);
        if (status < 0) return status;
        if (measured.n_mismatched == 0) *error = measured.mean_relative;
    }
    const double seconds = loxo_os_clock_s() - begin_s;
    s->longest_s = fmax(s->longest_s, seconds);
    s->solves_s += seconds;
    json_array_append_new(s->tried, json_pack("{s:f, s:o}", "m", m, "error", paper_json(*error)));
    if (*error < s->best_error) {
        s->best_error = *error;
        s->best_m = m;
    }
    return LOXO_OK;
}

/* From the best, by doubling and by halving, until the error has risen so often. */
static loxo_status climb(search *s, int most_rises)
{
    const double centre = log2(s->best_m);
    loxo_status status = LOXO_OK;
    for (int direction = 1; direction >= -1 && status >= 0; direction -= 2) {
        double before = s->best_error, error = 0.0;
        int n_rises = 0;
        for (int k = 1; k <= MOST_DOUBLINGS && n_rises < most_rises && status >= 0; ++k) {
            if ((status = try_m(s, centre + direction * k, &error)) < 0) break;
            n_rises = error < before ? 0 : n_rises + 1;
            before = fmin(before, error);
        }
    }
    return status;
}

/* start: 1, or the best m of a smaller mesh. */
static loxo_status find_best(search *s, double start)
{
    const bool is_first = start == 1.0;
    double error = 0.0;
    loxo_status status = try_m(s, log2(start), &error);
    if (status >= 0) status = try_m(s, 0.0, &error);
    if (status >= 0) status = climb(s, is_first ? 2 : 1);
    for (int k = 1; k <= (is_first ? 3 : 1) && status >= 0; ++k) {
        const double centre = log2(s->best_m), step = exp2(-k);
        for (int side = -1; side <= 1 && status >= 0; side += 2)
            status = try_m(s, centre + side * step, &error);
    }
    return status;
}

static double error_at_one(const json_t *tried)
{
    json_t *one;
    size_t i;
    json_array_foreach(tried, i, one) if (bench_number(one, "m") == 1.0) return bench_number(one, "error");
    return (double)NAN;
}

/* search FILE METHOD TRUTH START */
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
    s.start_s = loxo_os_clock_s();
    if (status >= 0) status = find_best(&s, strtod(argv[3], NULL));
    loxo_release(b->ctx, s.distance);
    loxo_release(b->ctx, truth);
    loxo_mesh_destroy(mesh);
    loxo_soup_destroy(b->ctx, &soup);
    if (status >= 0)
        return bench_print_json(b, json_pack("{s:f, s:o, s:o, s:b, s:f, s:o}", "m", s.best_m, "error",
                                             paper_json(s.best_error), "error_at_one",
                                             paper_json(error_at_one(s.tried)), "is_cut", (int)s.is_cut, "solve_s",
                                             s.solves_s / (double)json_array_size(s.tried), "tried", s.tried));
    json_decref(s.tried);
    return status;
}

/* What one search found; false when it found nothing. */
static bool search_on(bench *b, const paper_mesh *mesh, const char *method, int n_threads, double start,
                      paper_search *found, json_t **result)
{
    char text[32];
    snprintf(text, sizeof text, "%.17g", start);
    const loxo_status status = bench_worker_run(
        b, n_threads, (const char *const[]){"search", mesh->path, method, mesh->truth, text, NULL}, result);
    if (status < 0 || isnan(bench_number(*result, "error"))) return false;
    found->m = bench_number(*result, "m");
    found->error_at_one = bench_number(*result, "error_at_one");
    bench_record(b, "search",
                 json_pack("{s:s, s:I, s:s, s:O, s:O}", "mesh", mesh->model->name, "n_vertices",
                           (json_int_t)mesh->n_vertices, "method", method, "tried", json_object_get(*result, "tried"),
                           "is_cut", json_object_get(*result, "is_cut")));
    return true;
}

static int n_tried(const json_t *result) { return (int)json_array_size(json_object_get(result, "tried")); }

static const char *cut_text(const json_t *result)
{
    return json_is_true(json_object_get(result, "is_cut")) ? " (time up)" : "";
}

void paper_search_m(bench *b, const paper_mesh *mesh, const char *method, int n_threads, paper_search *found)
{
    paper_mesh coarse;
    json_t *first = NULL, *second = NULL;
    *found = (paper_search){.m = (double)NAN, .error_at_one = (double)NAN};
    if (mesh->truth[0] == '\0' ||
        paper_predict_bytes(b, method, mesh->n_vertices, mesh->n_faces) > paper_memory_limit(b) ||
        paper_mesh_coarsen(b, mesh, &coarse) < 0)
        return;
    const bool is_all = coarse.n_vertices == mesh->n_vertices;
    if (!search_on(b, &coarse, method, n_threads, 1.0, found, &first)) goto done;
    snprintf(found->how, sizeof found->how, "m by %d solve%s%s", n_tried(first), n_tried(first) == 1 ? "" : "s",
             cut_text(first));
    if (is_all) goto done;
    found->predicted_s = bench_number(first, "solve_s") * paper_growth(b, method, &coarse, mesh);
    found->error_at_one = (double)NAN; /* of the other mesh */
    if (found->predicted_s > fmin(b->settings.search_seconds, b->settings.solve_seconds))
        snprintf(found->how, sizeof found->how, "m that of %.0fk vertices%s", 1e-3 * (double)coarse.n_vertices,
                 cut_text(first));
    else if (search_on(b, mesh, method, n_threads, found->m, found, &second))
        snprintf(found->how, sizeof found->how, "m by %d solves of %.0fk%s, %d here%s", n_tried(first),
                 1e-3 * (double)coarse.n_vertices, cut_text(first), n_tried(second), cut_text(second));
done:
    json_decref(first);
    json_decref(second);
}
