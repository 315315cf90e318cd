/* SPDX-License-Identifier: MIT
 * The named meshes that are measured, as arrays or as files. */
#include "bench.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* clang-format off */
static const bench_case cases[] = {
    {"sphere", BENCH_ACCURACY, NULL, NULL, LOXO_SHAPE_ICOSPHERE, 4, true},
    {"igea134k", BENCH_ACCURACY, "surfaces/igea134k.ply", "exact/igea_from0.npy", LOXO_N_SHAPES, 1, false},
    {"bumpy250k", BENCH_ACCURACY, "surfaces/bumpy250k.ply", "exact/bumpy250k_from0.npy", LOXO_N_SHAPES, 1, false},
    {"kitten10k", BENCH_ACCURACY, "surfaces/kitten10k.ply", "exact/kitten_from0.npy", LOXO_N_SHAPES, 1, false},
    {"icosphere", BENCH_TIME, NULL, NULL, LOXO_SHAPE_ICOSPHERE, 1, true},
    {"bumpy", BENCH_TIME, NULL, NULL, LOXO_SHAPE_BUMPY, 1, false},
};
/* clang-format on */
#define N_CASES ((int)(sizeof cases / sizeof cases[0]))

static bool take_shared(bench *b, const char *folder, int n_folder, const char *name)
{
    char path[BENCH_PATH];
    if (snprintf(path, sizeof path, "%.*s%s", n_folder, folder, name) >= BENCH_PATH || access(path, R_OK) != 0)
        return false;
    memcpy(b->shared, path, sizeof path);
    return true;
}

void bench_find_shared(bench *b)
{
    const char *root = getenv("LOXO_SHARED");
    char self[BENCH_PATH];
    if (b->shared[0] != '\0') return;
    if (root != NULL && root[0] != '\0' && take_shared(b, root, (int)strlen(root), "/meshes")) return;
    if (take_shared(b, "", 0, "../shared/meshes") || !bench_self_path(self)) return;
    for (char *end = strrchr(self, '/'); end != NULL && end != self; end = strrchr(self, '/')) {
        *end = '\0';
        if (take_shared(b, self, (int)(end - self), "/shared/meshes")) return;
    }
}

void bench_tell_shared(const bench *b)
{
    if (b->shared[0] != '\0')
        bench_say(b, "Meshes of others: %s\n\n", b->shared);
    else
        bench_say(
            b, "Meshes of others: none; looked for $LOXO_SHARED/meshes, ../shared/meshes, and shared/meshes above this "
               "program (--shared names the folder)\n\n");
}

int bench_n_cases(const bench *b) { return N_CASES + (b->mesh != NULL ? 1 : 0); }

bench_case bench_case_get(const bench *b, int i)
{
    if (i < N_CASES) return cases[i];
    return (bench_case){"given", BENCH_ACCURACY | BENCH_TIME, b->mesh, b->exact, LOXO_N_SHAPES, 1, false};
}

bool bench_case_wanted(const bench *b, const bench_case *c, bench_use use)
{
    if ((c->use & (unsigned)use) == 0) return false;
    if (b->case_filter != NULL) return strstr(c->name, b->case_filter) != NULL;
    return b->mesh == NULL || c->file == b->mesh; /* a mesh of one's own is measured alone */
}

/* A file of the meshes' folder, or the user's own as it was given. */
static bool find_file(const bench *b, const char *file, char path[BENCH_PATH])
{
    const bool is_own = file == b->mesh || file == b->exact;
    if (!is_own && b->shared[0] == '\0') return false;
    const int n =
        is_own ? snprintf(path, BENCH_PATH, "%s", file) : snprintf(path, BENCH_PATH, "%s/%s", b->shared, file);
    return n > 0 && n < BENCH_PATH && access(path, R_OK) == 0;
}

bool bench_case_present(const bench *b, const bench_case *c)
{
    char path[BENCH_PATH];
    if (c->file == NULL) return true;
    return find_file(b, c->file, path) && (c->exact == NULL || find_file(b, c->exact, path));
}

loxo_status bench_generate(bench *b, loxo_shape shape, int64_t n_vertices, char path[BENCH_PATH])
{
    char count[32];
    json_t *result = NULL;
    const int n = snprintf(path, BENCH_PATH, "%s/%s-%lld.ply", b->work, loxo_shape_name(shape), (long long)n_vertices);
    if (n < 0 || n >= BENCH_PATH) return bench_fail(b, LOXO_ERR_ARGUMENT, "--work: the name is too long");
    if (access(path, R_OK) == 0) return LOXO_OK;
    snprintf(count, sizeof count, "%lld", (long long)n_vertices);
    const loxo_status status =
        bench_worker_run(b, 1, (const char *const[]){"generate", loxo_shape_name(shape), count, path, NULL}, &result);
    json_decref(result);
    return status;
}

static int64_t n_wanted(const bench *b, const bench_case *c) { return b->settings.vertices / c->divisor; }

loxo_status bench_case_path(bench *b, const bench_case *c, char path[BENCH_PATH])
{
    if (c->file == NULL) return bench_generate(b, c->shape, n_wanted(b, c), path);
    if (find_file(b, c->file, path)) return LOXO_OK;
    return bench_fail(b, LOXO_ERR_READ, "%s: not there", c->file);
}

loxo_status bench_case_load(bench *b, const bench_case *c, loxo_soup *soup, double **exact)
{
    char path[BENCH_PATH];
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_status status;
    *soup = (loxo_soup){0};
    if (exact != NULL) *exact = NULL;
    if (c->file != NULL) {
        int64_t n = 0;
        if (!find_file(b, c->file, path)) return bench_fail(b, LOXO_ERR_READ, "%s: not there", c->file);
        if ((status = loxo_read_mesh(b->ctx, path, NULL, soup)) < 0) return status;
        if (exact == NULL || c->exact == NULL) return LOXO_OK;
        if (!find_file(b, c->exact, path)) status = bench_fail(b, LOXO_ERR_READ, "%s: not there", c->exact);
        if (status >= 0) status = loxo_read_field(b->ctx, path, exact, &n);
        if (status >= 0 && n != soup->n_vertices)
            status = bench_fail(b, LOXO_ERR_MALFORMED, "%s: %lld values for %lld vertices", c->exact, (long long)n,
                                (long long)soup->n_vertices);
        if (status < 0) goto fail;
        return LOXO_OK;
    }
    settings.shape = c->shape;
    settings.n_vertices = n_wanted(b, c);
    if ((status = loxo_generate(b->ctx, &settings, false, soup)) < 0) return status;
    if (exact == NULL || !c->has_closed_form) return LOXO_OK;
    *exact = loxo_allocate(b->ctx, soup->n_vertices, sizeof **exact);
    status = *exact == NULL ? LOXO_ERR_MEMORY : loxo_generate_exact_distance(b->ctx, &settings, soup, 0, *exact);
    if (status >= 0) return LOXO_OK;
fail:
    if (exact != NULL) {
        loxo_release(b->ctx, *exact);
        *exact = NULL;
    }
    loxo_soup_destroy(b->ctx, soup);
    return status;
}

loxo_status bench_list(bench *b)
{
    bench_table table;
    bench_table_begin(&table, "case|used by|mesh|true distances|here");
    for (int i = 0; i < bench_n_cases(b); ++i) {
        const bench_case c = bench_case_get(b, i);
        char mesh[BENCH_CELL];
        if (c.file != NULL)
            snprintf(mesh, sizeof mesh, "%s", c.file);
        else
            snprintf(mesh, sizeof mesh, "%s, %lld vertices", loxo_shape_name(c.shape), (long long)n_wanted(b, &c));
        bench_table_row(&table, "%s|%s%s|%s|%s|%s", c.name, (c.use & BENCH_ACCURACY) != 0 ? "accuracy " : "",
                        (c.use & BENCH_TIME) != 0 ? "time" : "", mesh,
                        c.exact != NULL     ? c.exact
                        : c.has_closed_form ? "closed form"
                                            : "-",
                        bench_case_present(b, &c) ? "yes" : "no: skipped");
    }
    bench_table_print(b, &table);
    bench_tell_shared(b);
    return LOXO_OK;
}
