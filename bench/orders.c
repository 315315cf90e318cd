/* SPDX-License-Identifier: MIT
 * Orders of a mesh: what they cost and what they win. The same mesh in every order, all orders of a round one after the
 * other, each in a process of its own; and what LOXO_ORDER_AUTO takes. */
#include "base/options.h"
#include "bench.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define MOST_ORDERS 8

static const char *const keys[4] = {"reorder_s", "halfedge_s", "create_s", "solve_s"};

typedef struct timing {
    bool ran;
    double sample[4][BENCH_MAX_REPEATS], total[BENCH_MAX_REPEATS];
    int n, taken; /* the order that was taken, for auto */
} timing;

/* Rounds of all orders in turns. */
static loxo_status run_rounds(bench *b, const char *mesh, const char *method, int n_threads, const char *const *orders,
                              timing *t, double *n_vertices)
{
    for (int o = 0; orders[o] != NULL; ++o)
        t[o] = (timing){.ran = true};
    for (int k = 0; k < b->settings.repeats; ++k)
        for (int o = 0; orders[o] != NULL; ++o) {
            json_t *result = NULL;
            if (!t[o].ran) continue;
            const loxo_status status = bench_worker_run(
                b, n_threads, (const char *const[]){"order", mesh, orders[o], "1", method, NULL}, &result);
            if (status < 0 && b->child_exit == loxo_status_exit_code(LOXO_ERR_UNSUPPORTED)) {
                t[o].ran = false; /* no METIS here */
                continue;
            }
            if (status < 0) return status;
            *n_vertices = bench_number(result, "n_vertices");
            t[o].taken = (int)bench_number(result, "order");
            t[o].total[k] = 0.0;
            for (int q = 0; q < 4; ++q) {
                t[o].sample[q][k] = json_number_value(json_array_get(json_object_get(result, keys[q]), 0));
                t[o].total[k] += t[o].sample[q][k];
            }
            t[o].n = k + 1;
            json_decref(result);
        }
    return LOXO_OK;
}

static double median_of(const timing *t, int q) { return bench_stat_of(t->n, q < 4 ? t->sample[q] : t->total).median; }

static void show(bench *b, bench_table *table, const char *mesh, double n, const char *method, int n_threads,
                 const char *const *orders, const timing *t)
{
    double given = (double)NAN, best = INFINITY, chosen = (double)NAN;
    int best_order = 0, auto_order = 0;
    for (int o = 0; orders[o] != NULL; ++o)
        if (t[o].ran && strcmp(orders[o], "given") == 0) given = median_of(&t[o], 4);
    for (int o = 0; orders[o] != NULL; ++o) {
        if (!t[o].ran) {
            bench_table_row(table, "%s|%.0f|%s|%d|%s|not in this build", mesh, n, method, n_threads, orders[o]);
            continue;
        }
        const double total = median_of(&t[o], 4);
        char text[2][64], name[48];
        if (strcmp(orders[o], "auto") == 0)
            chosen = total, auto_order = t[o].taken;
        else if (total < best)
            best = total, best_order = o;
        snprintf(name, sizeof name, strcmp(orders[o], "auto") == 0 ? "%s: %s" : "%s", orders[o], orders[t[o].taken]);
        bench_table_row(table, "%s|%.0f|%s|%d|%s|%.3f|%.3f|%.3f|%s|%s|%.2f", mesh, n, method, n_threads, name,
                        median_of(&t[o], 0), median_of(&t[o], 1), median_of(&t[o], 2),
                        bench_stat_text(bench_stat_of(t[o].n, t[o].sample[3]), 1.0, text[0], sizeof text[0]),
                        bench_stat_text(bench_stat_of(t[o].n, t[o].total), 1.0, text[1], sizeof text[1]),
                        given / total);
        bench_record(b, "orders",
                     json_pack("{s:s, s:f, s:s, s:i, s:s, s:s, s:f, s:f, s:f, s:f, s:f}", "mesh", mesh, "n_vertices", n,
                               "method", method, "threads", n_threads, "order", orders[o], "taken", orders[t[o].taken],
                               keys[0], median_of(&t[o], 0), keys[1], median_of(&t[o], 1), keys[2], median_of(&t[o], 2),
                               keys[3], median_of(&t[o], 3), "total_s", total));
    }
    bench_say(b, "%s, %s, %d thread%s: best for one solve is %s; auto takes %s and %.0f %% more time\n", mesh, method,
              n_threads, n_threads == 1 ? "" : "s", orders[best_order], orders[auto_order],
              100.0 * (chosen / best - 1.0));
}

/* A mesh of the bench's, as it is or shuffled. */
static loxo_status derive(bench *b, const char *task, const char *from, const char *times, const char *name,
                          char path[BENCH_PATH])
{
    json_t *result = NULL;
    const int n = snprintf(path, BENCH_PATH, "%s/%s.ply", b->work, name);
    if (n < 0 || n >= BENCH_PATH) return bench_fail(b, LOXO_ERR_ARGUMENT, "--work: the name is too long");
    if (access(path, R_OK) == 0) return LOXO_OK;
    const char *const subdivide[] = {task, from, times, path, NULL}, *const shuffle[] = {task, from, path, NULL};
    const loxo_status status = bench_worker_run(b, 1, times != NULL ? subdivide : shuffle, &result);
    json_decref(result);
    return status;
}

static loxo_status measure(bench *b, const char *mesh, const char *path, bench_table *table)
{
    static timing t[MOST_ORDERS]; /* large */
    const char *const *orders = loxo_options_find(loxo_mesh_options, "order")->choices;
    for (int m = 0; m < b->n_methods; ++m)
        for (int i = 0; i < b->n_threads; ++i) {
            double n = 0.0;
            if (b->case_filter != NULL && strstr(mesh, b->case_filter) == NULL) continue;
            const loxo_status status = run_rounds(b, path, b->methods[m], b->threads[i], orders, t, &n);
            if (status < 0) return status;
            show(b, table, mesh, n, b->methods[m], b->threads[i], orders, t);
        }
    return LOXO_OK;
}

loxo_status bench_orders(bench *b)
{
    static bench_table table; /* large */
    static const loxo_shape shapes[] = {LOXO_SHAPE_BUMPY, LOXO_SHAPE_BRAIN};
    char path[BENCH_PATH], base[BENCH_PATH], name[64];
    loxo_status status = LOXO_OK;
    bench_table_begin(&table, "mesh|vertices|method|threads|order|order, s|half-edges, s|create, s|solve, s|in all, s|"
                              "faster than given");
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0] && status >= 0; ++i) {
        const char *shape = loxo_shape_name(shapes[i]);
        status = bench_generate(b, shapes[i], b->settings.vertices, base);
        if (status >= 0) status = measure(b, shape, base, &table);
        snprintf(name, sizeof name, "%s-shuffled", shape);
        if (status >= 0) status = derive(b, "shuffle", base, NULL, name, path);
        if (status >= 0) status = measure(b, name, path, &table);
    }
    if (status < 0) return status;
    if (snprintf(base, sizeof base, "%s/surfaces/igea134k.ply", b->shared) < (int)sizeof base && b->shared[0] != '\0' &&
        access(base, R_OK) == 0) {
        status = measure(b, "igea", base, &table);
        if (status >= 0 && b->settings.vertices >= 400000) status = derive(b, "subdivide", base, "1", "igea-x1", path);
        if (status >= 0 && b->settings.vertices >= 400000) status = measure(b, "igea-x1", path, &table);
        if (status >= 0) status = derive(b, "shuffle", base, NULL, "igea-shuffled", path);
        if (status >= 0) status = measure(b, "igea-shuffled", path, &table);
    } else {
        bench_table_row(&table, "igea|not here (--shared)");
    }
    if (status < 0) return status;
    bench_say(b, "\n");
    bench_table_print(b, &table);
    bench_say(
        b, "order: finding the permutation (auto's look at the mesh included). half-edges: the rest of building the\n"
           "mesh. faster than given: all four steps, one solve.\n");
    return LOXO_OK;
}
