/* SPDX-License-Identifier: MIT
 * Accuracy: our diffusion against a direct solve of (4) in the sense of eq. (8), and the distances of both recoveries,
 * from our heat and from the direct one, against exact distances in the sense of eq. (29). */
#include "bench.h"
#include "direct.h"

#include <math.h>
#include <stdio.h>

typedef struct subject {
    bench *b;
    const bench_case *c;
    loxo_soup soup;
    loxo_mesh_arrays arrays;
    double *exact;
    loxo_mesh *mesh;
    double *direct_value;
    int32_t *direct_scale;
    bool has_direct;
    double *value, *distance;
    int32_t *scale;
} subject;

static loxo_status open_subject(subject *s)
{
    loxo_context *ctx = s->b->ctx;
    loxo_status status = bench_case_load(s->b, s->c, &s->soup, &s->exact);
    if (status < 0) return status;
    const int64_t n = s->soup.n_vertices;
    s->arrays = loxo_soup_arrays(&s->soup);
    if ((status = loxo_mesh_create(ctx, &s->arrays, LOXO_BORROW, NULL, NULL, &s->mesh)) < 0) return status;
    s->direct_value = loxo_allocate(ctx, n, sizeof *s->direct_value);
    s->direct_scale = loxo_allocate(ctx, n, sizeof *s->direct_scale);
    s->value = loxo_allocate(ctx, n, sizeof *s->value);
    s->scale = loxo_allocate(ctx, n, sizeof *s->scale);
    s->distance = loxo_allocate(ctx, n, sizeof *s->distance);
    const bool is_there = s->direct_value != NULL && s->direct_scale != NULL && s->value != NULL && s->scale != NULL &&
                          s->distance != NULL;
    return is_there ? LOXO_OK : LOXO_ERR_MEMORY;
}

static void close_subject(subject *s)
{
    loxo_context *ctx = s->b->ctx;
    loxo_mesh_destroy(s->mesh);
    loxo_release(ctx, s->direct_value);
    loxo_release(ctx, s->direct_scale);
    loxo_release(ctx, s->value);
    loxo_release(ctx, s->scale);
    loxo_release(ctx, s->distance);
    loxo_release(ctx, s->exact);
    loxo_soup_destroy(ctx, &s->soup);
}

/* The direct heat; where it cannot be had the reason is printed and the columns stay empty. */
static void solve_directly(subject *s)
{
#ifdef LOXO_BENCH_WITH_CHOLMOD
    bench_direct_info info;
    const loxo_status status = bench_direct_heat(s->b->ctx, &s->arrays, loxo_geodesic_settings_default().time_factor,
                                                 (const loxo_index[]){0}, 1, s->direct_value, s->direct_scale, &info);
    s->has_direct = status >= 0;
    if (s->has_direct)
        printf(
            "%s: direct solve: %.2e entries in L, %.2f s + %.2f s, residual %.1e of each row's terms, %lld heats not "
            "positive\n",
            s->c->name, (double)info.n_factor, info.factor_s, info.solve_s, info.residual,
            (long long)info.n_nonpositive);
    else
        printf("%s: direct solve: %s\n", s->c->name, loxo_status_text(status));
    if (s->has_direct)
        bench_record(s->b, "direct",
                     json_pack("{s:s, s:f, s:f, s:f, s:I}", "case", s->c->name, "residual", info.residual, "factor_s",
                               info.factor_s, "solve_s", info.solve_s, "n_nonpositive",
                               (json_int_t)info.n_nonpositive));
#else
    printf("%s: direct solve: this build has no CHOLMOD\n", s->c->name);
#endif
}

static loxo_status error_of(subject *s, const double *distance, double *error)
{
    loxo_distance_error e = {.mean_relative = NAN};
    const loxo_status status =
        s->exact == NULL ? LOXO_OK : loxo_measure_distance_error(s->b->ctx, distance, s->exact, s->soup.n_vertices, &e);
    *error = e.mean_relative;
    return status;
}

static const char *percent(double share, char *text, size_t n)
{
    snprintf(text, n, isnan(share) ? "-" : "%.4f %%", 100.0 * share);
    return text;
}

static void add_row(subject *s, bench_table *table, const char *method, const char *diffusion, double heat_error,
                    double ours, double direct, double seconds)
{
    char a[32], c[32], heat[32], ratio[32], time[32];
    snprintf(heat, sizeof heat, isnan(heat_error) ? "-" : "%.2e", heat_error);
    snprintf(ratio, sizeof ratio, isnan(ours / direct) ? "-" : "%.4f", ours / direct);
    snprintf(time, sizeof time, isnan(seconds) ? "-" : "%.3f", seconds);
    bench_table_row(table, "%s|%lld|%s|%s|%s|%s|%s|%s|%s", s->c->name, (long long)s->soup.n_vertices, method, diffusion,
                    heat, percent(ours, a, sizeof a), percent(direct, c, sizeof c), ratio, time);
    json_t *row = json_pack("{s:s, s:s, s:s, s:I}", "case", s->c->name, "method", method, "diffusion", diffusion,
                            "n_vertices", (json_int_t)s->soup.n_vertices);
    const struct {
        const char *key;
        double value;
    } numbers[] = {{"direction_error", heat_error},
                   {"mean_relative", ours},
                   {"mean_relative_direct", direct},
                   {"seconds", seconds}};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; ++i)
        json_object_set_new(row, numbers[i].key, isnan(numbers[i].value) ? json_null() : json_real(numbers[i].value));
    bench_record(s->b, "accuracy", row);
}

/* One row: a method with our diffusion, or with n_sweeps of the paper's. */
static loxo_status measure(subject *s, bench_table *table, const char *method, int64_t n_sweeps)
{
    const loxo_index source = 0;
    loxo_context *ctx = s->b->ctx;
    loxo_geodesic_settings settings = loxo_geodesic_settings_default();
    loxo_geodesic *geodesic = NULL;
    loxo_geodesic_info info;
    double heat_error = NAN, ours = NAN, direct = NAN;
    const bool has_heat = bench_is_parallel_heat(method);
    char diffusion[32] = "-";
    loxo_status status = bench_method_settings(s->b, method, &settings);
    if (status < 0) return status;
    if (has_heat) snprintf(diffusion, sizeof diffusion, "marching");
    if (n_sweeps > 0) {
        settings.diffusion = LOXO_DIFFUSION_SWEEPS;
        settings.n_sweeps = n_sweeps;
        snprintf(diffusion, sizeof diffusion, "%lld sweeps", (long long)n_sweeps);
    }
    if ((status = loxo_geodesic_create(ctx, s->mesh, &settings, &geodesic)) < 0) return status;
    if ((status = loxo_geodesic_solve(geodesic, &source, 1, s->distance, &info)) < 0) goto done;
    if (status > 0) printf("%s, %s, %s: %s\n", s->c->name, method, diffusion, loxo_status_text(status));
    if ((status = error_of(s, s->distance, &ours)) < 0) goto done;
    if (s->has_direct && has_heat) {
        if ((status = loxo_geodesic_heat(geodesic, s->value, s->scale)) < 0) goto done;
        status = loxo_measure_direction_error(ctx, &s->arrays, s->value, s->scale, s->direct_value, s->direct_scale,
                                              &heat_error);
        if (status < 0) goto done;
        status =
            loxo_geodesic_solve_from_heat(geodesic, &source, 1, s->direct_value, s->direct_scale, s->distance, NULL);
        if (status < 0 || (status = error_of(s, s->distance, &direct)) < 0) goto done;
    }
    add_row(s, table, method, diffusion, heat_error, ours, direct, info.total_s);
done:
    loxo_geodesic_destroy(geodesic);
    return status;
}

/* A peer's distances on the same mesh, measured once. */
static loxo_status measure_peer(subject *s, bench_table *table, const bench_peer *peer)
{
    char mesh[BENCH_PATH], out[BENCH_PATH + 64];
    bench_peer_result result;
    double *distance = NULL, error = NAN;
    loxo_status status = bench_case_path(s->b, s->c, mesh);
    if (status < 0) return status;
    snprintf(out, sizeof out, "%s/peer.out", s->b->work);
    if ((status = bench_peer_run(s->b, peer, mesh, out, 1, "edge", &result)) < 0) return status;
    if (!result.has_written) {
        bench_say(s->b, "%s: wrote no distances to %s: their error is not known\n", peer->name, out);
        return LOXO_OK;
    }
    status = bench_read_distances(s->b, out, s->soup.n_vertices, &distance);
    if (status >= 0) status = error_of(s, distance, &error);
    loxo_release(s->b->ctx, distance);
    if (status >= 0) add_row(s, table, peer->name, "its own", NAN, error, NAN, result.seconds);
    return status;
}

static loxo_status measure_case(bench *b, const bench_case *c, bench_table *table)
{
    subject s = {.b = b, .c = c};
    loxo_status status = open_subject(&s);
    if (status >= 0) solve_directly(&s);
    for (int k = 0; k < b->n_methods && status >= 0; ++k) {
        status = measure(&s, table, b->methods[k], 0);
        for (int i = 0; i < b->n_sweeps && status >= 0 && bench_is_parallel_heat(b->methods[k]); ++i)
            status = measure(&s, table, b->methods[k], b->sweeps[i]);
    }
    for (int i = 0; i < b->n_peers && status >= 0; ++i)
        status = measure_peer(&s, table, &b->peers[i]);
    close_subject(&s);
    return status;
}

loxo_status bench_accuracy(bench *b)
{
    static bench_table table; /* large */
    bench_table_begin(&table, "case|vertices|method|diffusion|heat, eq. 8|error, eq. 29|on direct heat|ratio|seconds");
    for (int i = 0; i < bench_n_cases(b); ++i) {
        const bench_case c = bench_case_get(b, i);
        if (!bench_case_wanted(b, &c, BENCH_ACCURACY)) continue;
        if (!bench_case_present(b, &c)) {
            bench_table_row(&table, "%s|skipped: no mesh here", c.name);
            continue;
        }
        const loxo_status status = measure_case(b, &c, &table);
        if (status < 0) return status;
    }
    putchar('\n');
    bench_table_print(b, &table);
    puts("heat, eq. 8: directions of the heat against the direct solve; wanted: at most 1e-3.\n"
         "ratio: error over the error of the same recovery on the directly solved heat; wanted: at most 1.05.\n"
         "seconds: one solve, one sample (`loxo-bench time` measures time).\n"
         "The paper, Fig. 2: 63,208 vertices, eq. 8 at 1e-2 after 153 sweeps (0.169 s, 4 threads), 1e-3 after 185.");
    return LOXO_OK;
}
