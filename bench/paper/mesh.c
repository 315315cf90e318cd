/* SPDX-License-Identifier: MIT
 * Meshes of the tables and figures: scans, refined where a size is wanted, and generated ones; with true distances. */
#include "paper.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

const paper_model paper_models[] = {
    {"sphere", NULL, NULL, LOXO_SHAPE_ICOSPHERE},
    {"bumpy", NULL, NULL, LOXO_SHAPE_BUMPY},
    {"brain", NULL, NULL, LOXO_SHAPE_BRAIN},
    {"genus", NULL, NULL, LOXO_SHAPE_GENUS},
    {"igea", "surfaces/igea134k.ply", "exact/igea_from0.npy", LOXO_N_SHAPES},
    {"kitten", "surfaces/kitten10k.ply", "exact/kitten_from0.npy", LOXO_N_SHAPES},
    {"bunny", "surfaces/bunny35k.obj.gz", NULL, LOXO_N_SHAPES},
    {"armadillo", "surfaces/armadillo50k.obj.gz", NULL, LOXO_N_SHAPES},
    {"horse", "surfaces/horse20k.off.gz", NULL, LOXO_N_SHAPES},
    {"bimba", "surfaces/bimba25k.ply", NULL, LOXO_N_SHAPES},
    {"fandisk", "surfaces/fandisk.obj.gz", NULL, LOXO_N_SHAPES},
    {"planck", "surfaces/maxplanck10k.obj.gz", NULL, LOXO_N_SHAPES},
    {"brain48k", "surfaces/brain48k.ply", NULL, LOXO_N_SHAPES},
    {"venus", "surfaces/venus50k.off.gz", NULL, LOXO_N_SHAPES},
    {"fsaverage5", "surfaces/fsaverage5.lh.white", NULL, LOXO_N_SHAPES},
    {"camel", "surfaces/camel10k.off.gz", NULL, LOXO_N_SHAPES},
    {"moai", "surfaces/moai48k-slivers.ply", NULL, LOXO_N_SHAPES},
    {"conte69", "surfaces/conte69.L.32k.gii", NULL, LOXO_N_SHAPES},
    {"white", "surfaces/fsLR32k.L.white.surf.gii", NULL, LOXO_N_SHAPES},
    {"pial", "surfaces/fsLR32k.L.pial.surf.gii", NULL, LOXO_N_SHAPES},
    {"bumpy250k", "surfaces/bumpy250k.ply", "exact/bumpy250k_from0.npy", LOXO_N_SHAPES},
    {0},
};

const paper_model *paper_model_find(const char *name)
{
    for (const paper_model *m = paper_models; m->name != NULL; ++m)
        if (strcmp(m->name, name) == 0) return m;
    return NULL;
}

static loxo_status shared_path(bench *b, const char *file, char path[BENCH_PATH])
{
    const int n = snprintf(path, BENCH_PATH, "%s/%s", b->shared, file);
    if (b->shared[0] != '\0' && n > 0 && n < BENCH_PATH && access(path, R_OK) == 0) return LOXO_OK;
    return bench_fail(b, LOXO_ERR_UNSUPPORTED,
                      b->shared[0] != '\0' ? "%s is not in %s" : "%s: no folder of meshes (--shared)", file, b->shared);
}

static loxo_status work_path(bench *b, char path[BENCH_PATH], const char *name, const char *what, int64_t number,
                             const char *ending)
{
    const int n = snprintf(path, BENCH_PATH, "%s/%s-%s%lld%s", b->work, name, what, (long long)number, ending);
    return n > 0 && n < BENCH_PATH ? LOXO_OK : bench_fail(b, LOXO_ERR_ARGUMENT, "--work: the name is too long");
}

/* Counts of a mesh file, by a child. */
static loxo_status count(bench *b, const char *path, int64_t *n_vertices, int64_t *n_faces)
{
    json_t *result = NULL;
    const loxo_status status =
        bench_worker_run(b, 1, (const char *const[]){"subdivide", path, "0", "-", NULL}, &result);
    if (status < 0) return status;
    *n_vertices = (int64_t)bench_number(result, "n_vertices");
    *n_faces = (int64_t)bench_number(result, "n_faces");
    json_decref(result);
    return LOXO_OK;
}

/* Distances by the method `exact`, kept in the work folder; none where this build lacks it or it does not fit. */
static loxo_status solve_exactly(bench *b, const char *path, int64_t n_vertices, int64_t n_faces, paper_mesh *mesh)
{
    json_t *result = NULL;
    if (!paper_has_method("exact") || paper_predict_bytes(b, "exact", n_vertices, n_faces) > paper_memory_limit(b))
        return LOXO_OK;
    loxo_status status = work_path(b, mesh->truth, mesh->model->name, "truth", n_vertices, ".npy");
    if (status < 0) return status;
    mesh->truth_from = "method exact";
    mesh->n_truth = n_vertices;
    if (access(mesh->truth, R_OK) == 0) return LOXO_OK;
    status = bench_worker_run(b, b->threads[b->n_threads - 1],
                              (const char *const[]){"solve", path, "exact", "1", mesh->truth, NULL}, &result);
    json_decref(result);
    return status;
}

static loxo_status make_generated(bench *b, double n_wanted, bool with_truth, paper_mesh *mesh)
{
    char number[32];
    json_t *result = NULL;
    const int64_t n = n_wanted < 12.0 ? 12 : (int64_t)n_wanted;
    loxo_status status = bench_generate(b, mesh->model->shape, n, mesh->path);
    if (status >= 0) status = count(b, mesh->path, &mesh->n_vertices, &mesh->n_faces);
    if (status < 0 || !with_truth) return status;
    if (mesh->model->shape != LOXO_SHAPE_ICOSPHERE)
        return solve_exactly(b, mesh->path, mesh->n_vertices, mesh->n_faces, mesh);
    if ((status = work_path(b, mesh->truth, mesh->model->name, "truth", n, ".npy")) < 0) return status;
    mesh->truth_from = "closed form";
    mesh->n_truth = mesh->n_vertices;
    if (access(mesh->truth, R_OK) == 0) return LOXO_OK;
    snprintf(number, sizeof number, "%lld", (long long)n);
    status = bench_worker_run(
        b, 1, (const char *const[]){"closed-form", loxo_shape_name(mesh->model->shape), number, mesh->truth, NULL},
        &result);
    json_decref(result);
    return status;
}

loxo_status paper_mesh_make(bench *b, const paper_model *model, double n_wanted, bool with_truth, paper_mesh *mesh)
{
    char times[16];
    json_t *result = NULL;
    int64_t n_base = 0, n_base_faces = 0;
    *mesh = (paper_mesh){.model = model, .truth_from = ""};
    if (!paper_wants(b, model->name)) return bench_fail(b, LOXO_ERR_UNSUPPORTED, "left out by --case");
    if (model->file == NULL) return make_generated(b, n_wanted, with_truth, mesh);
    loxo_status status = shared_path(b, model->file, mesh->path);
    if (status >= 0) status = count(b, mesh->path, &n_base, &n_base_faces);
    if (status < 0) return status;
    mesh->n_vertices = n_base;
    mesh->n_faces = n_base_faces;
    if (with_truth) {
        if (model->exact != NULL && b->settings.source == 0) {
            if ((status = shared_path(b, model->exact, mesh->truth)) < 0) return status;
            mesh->truth_from = "kept file";
            mesh->n_truth = n_base;
        } else if ((status = solve_exactly(b, mesh->path, n_base, n_base_faces, mesh)) < 0) {
            return status;
        }
    }
    const double times_wanted = round(log(n_wanted / (double)n_base) / log(4.0));
    mesh->n_subdivisions = times_wanted > 0.0 ? (int)times_wanted : 0;
    if (mesh->n_subdivisions == 0) return LOXO_OK;
    snprintf(times, sizeof times, "%d", mesh->n_subdivisions);
    char base[BENCH_PATH];
    memcpy(base, mesh->path, sizeof base);
    if ((status = work_path(b, mesh->path, model->name, "x", mesh->n_subdivisions, ".ply")) < 0) return status;
    if (access(mesh->path, R_OK) != 0) {
        status = bench_worker_run(b, 1, (const char *const[]){"subdivide", base, times, mesh->path, NULL}, &result);
        json_decref(result);
        if (status < 0) return status;
    }
    return count(b, mesh->path, &mesh->n_vertices, &mesh->n_faces);
}

double paper_error(bench *b, const paper_mesh *mesh, const char *distances)
{
    json_t *result = NULL;
    if (mesh->truth[0] == '\0') return (double)NAN;
    const loxo_status status =
        bench_worker_run(b, 1, (const char *const[]){"compare", mesh->truth, distances, NULL}, &result);
    const double error = status < 0 ? (double)NAN : bench_number(result, "mean_relative");
    json_decref(result);
    return error;
}
