/* SPDX-License-Identifier: MIT
 * The solver for spherical maps: what every method is surrounded with. It looks at the surface, finds a start, lets the method work, mends
 * folds, centres, checks, and gives the map in the caller's order. */
#include "algebra/cholesky.h"
#include "base/allocate.h"
#include "base/options.h"
#include "base/os.h"
#include "kernel/vec3.h"
#include "par/range.h"
#include "solver/sphere/sphere_internal.h"
#include "solver/sphere/tangent.h"

#include <inttypes.h>
#include <stdio.h>

/* A harmonic map of more energy than that is far from what newton finds: limbs and negative weights make it so. */
#define MOST_START_ENERGY 0.1

struct loxo_sphere {
    sphere_problem problem;
    const loxo_mesh *mesh;
    int64_t n_given;   /* the caller's vertices */
    loxo_index *order; /* [n_given] the mesh's number of each */
    sphere_map f;      /* [n_vertices] */
    double prepare_s;
};

static loxo_status refuse(loxo_context *ctx, const char *what)
{
    return loxo_fail(ctx, LOXO_ERR_MESH,
                     "sphere: the surface %s; a map to the sphere takes one closed piece of genus 0", what);
}

/* One closed piece of genus 0, whose vertices all have faces. */
static loxo_status check_surface(loxo_context *ctx, const loxo_mesh *mesh, const loxo_mesh_view *m)
{
    char what[96];
    int64_t n_components;
    if (m->n_faces == 0) return refuse(ctx, "has no faces");
    if (m->halfedge_length != NULL) return refuse(ctx, "is an intrinsic triangulation, which has no faces in space");
    loxo_index *component = loxo_allocate(ctx, loxo_mesh_n_vertices(mesh), sizeof *component);
    if (component == NULL) return LOXO_ERR_MEMORY;
    const loxo_status status = loxo_mesh_components(mesh, component, &n_components);
    loxo_release(ctx, component);
    if (status < 0) return status;
    int64_t n_edges = 0, n_bare = 0, n_open = 0, bare = -1;
    for (int64_t v = 0; v < m->n_vertices; ++v) {
        if (m->vertex_halfedge[v] < 0) bare = n_bare++ == 0 ? v : bare;
    }
    for (int64_t h = 0; h < 3 * m->n_faces; ++h) {
        n_open += m->halfedge_twin[h] < 0;
        n_edges += m->halfedge_twin[h] < h;
    }
    if (n_components > 1) {
        snprintf(what, sizeof what, "has %" PRId64 " pieces", n_components);
        return refuse(ctx, what);
    }
    if (n_open > 0) {
        snprintf(what, sizeof what, "is open: %" PRId64 " edges at its boundary", n_open);
        return refuse(ctx, what);
    }
    const int64_t genus = (2 - (m->n_vertices - n_bare - n_edges + m->n_faces)) / 2;
    if (genus != 0) {
        snprintf(what, sizeof what, "has genus %" PRId64, genus);
        return refuse(ctx, what);
    }
    if (n_bare == 0) return LOXO_OK;
    if (m->vertex_origin != NULL) bare = m->vertex_origin[bare];
    return loxo_fail_at(ctx, LOXO_ERR_MESH, (loxo_place){.byte = -1, .element = bare},
                        "sphere: vertex %" PRId64 " and %" PRId64
                        " more belong to no face; drop them first (convert --drop-unreferenced)",
                        bare, n_bare - 1);
}

static loxo_status create(loxo_context *ctx, const loxo_mesh *mesh, const loxo_mesh *weights,
                          const loxo_sphere_settings *settings, loxo_sphere **out)
{
    const loxo_sphere_settings chosen = settings != NULL ? *settings : loxo_sphere_settings_default();
    const double start_s = loxo_os_clock_s();
    if (out == NULL || ctx == NULL) return LOXO_ERR_ARGUMENT;
    *out = NULL;
    if (mesh == NULL || weights == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "sphere: the mesh is NULL");
    loxo_status status = loxo_options_check(ctx, "sphere", loxo_sphere_options, &chosen);
    if (status < 0) return status;
    const loxo_mesh_view m = loxo_mesh_get_view(mesh), w = loxo_mesh_get_view(weights);
    loxo_progress_begin(ctx);
    if ((status = check_surface(ctx, mesh, &m)) < 0) return status;
    if (w.n_vertices != m.n_vertices)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "sphere: the intrinsic triangulation is that of another mesh");
    loxo_sphere *s = loxo_allocate_zero(ctx, 1, sizeof *s);
    if (s == NULL) return LOXO_ERR_MEMORY;
    s->mesh = mesh;
    s->n_given = loxo_mesh_n_vertices(mesh);
    status = sphere_problem_create(ctx, &m, &w, &chosen, &s->problem);
    s->order = loxo_allocate(ctx, s->n_given, sizeof *s->order);
    s->f = loxo_allocate(ctx, m.n_vertices, sizeof *s->f);
    if (status >= 0 && (s->order == NULL || s->f == NULL)) status = LOXO_ERR_MEMORY;
    if (status >= 0) status = loxo_mesh_vertex_order(mesh, s->order);
    if (status < 0) {
        loxo_sphere_destroy(s);
        return status;
    }
    s->prepare_s = loxo_os_clock_s() - start_s;
    *out = s;
    return LOXO_OK;
}

loxo_status loxo_sphere_create(loxo_context *ctx, const loxo_mesh *mesh, const loxo_sphere_settings *settings,
                               loxo_sphere **out)
{
    return create(ctx, mesh, mesh, settings, out);
}

loxo_status loxo_sphere_create_intrinsic(loxo_context *ctx, const loxo_mesh *mesh, const loxo_mesh *intrinsic,
                                         const loxo_sphere_settings *settings, loxo_sphere **out)
{
    return create(ctx, mesh, intrinsic, settings, out);
}

void loxo_sphere_destroy(loxo_sphere *s)
{
    if (s == NULL) return;
    loxo_context *ctx = s->problem.ctx;
    sphere_problem_destroy(&s->problem);
    loxo_release(ctx, s->order);
    loxo_release(ctx, s->f);
    loxo_release(ctx, s);
}

/* Bytes a vertex: of multigrid's hierarchy at most, of mending folds, of hbtr's matrix and vectors; and a little whatever the size. */
#define MULTIGRID_BYTES 160
#define UNFOLD_BYTES    130
#define HBTR_BYTES      450
#define SMALL_BYTES     65536

loxo_status loxo_sphere_estimate(loxo_context *ctx, int64_t n_vertices, int64_t n_faces,
                                 const loxo_sphere_settings *settings, size_t *bytes)
{
    const loxo_sphere_settings chosen = settings != NULL ? *settings : loxo_sphere_settings_default();
    if (ctx == NULL) return LOXO_ERR_ARGUMENT;
    if (bytes == NULL || n_vertices < 0 || n_faces < 0)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "sphere: counts are not negative");
    const loxo_status status = loxo_options_check(ctx, "sphere", loxo_sphere_options, &chosen);
    if (status < 0) return status;
    const size_t n = (size_t)n_vertices;
    const size_t matrix = n * 16 + (size_t)n_faces * 3 * 12, own = n * (8 + 24 + sizeof(loxo_index));
    const size_t factor = loxo_cholesky_guess_bytes(n_vertices);
    const size_t solver = chosen.factor == LOXO_SPHERE_CHOLESKY ? factor : MULTIGRID_BYTES * n;
    size_t most = solver + sphere_newton_bytes(n_vertices, n_faces) + UNFOLD_BYTES * n;
    /* Twice the rows, and blocks of four numbers where L's factor has one. */
    if (chosen.method == LOXO_SPHERE_HBTR && most < 4 * factor + HBTR_BYTES * n) most = 4 * factor + HBTR_BYTES * n;
    *bytes = matrix + own + most + SMALL_BYTES;
    return LOXO_OK;
}

loxo_status sphere_center(const sphere_problem *p, sphere_map f, loxo_center_info *info)
{
    loxo_progress_enter(p->ctx);
    const loxo_status status = loxo_moebius_center(p->ctx, p->m.n_vertices, f[0], NULL, p->area, NULL, f[0], info);
    loxo_progress_leave(p->ctx);
    return status;
}

/* The caller's map as unit vectors. */
static loxo_status take_start(loxo_sphere *s, const double *start)
{
    const sphere_problem *p = &s->problem;
    if (start == NULL) return loxo_fail(p->ctx, LOXO_ERR_ARGUMENT, "sphere: no map to begin with is given");
    for (int64_t i = 0; i < s->n_given; ++i) {
        const loxo_vec3 x = v3_load(&start[3 * i]);
        const double length = v3_norm(x);
        if (!(length > 0.0) || !isfinite(length))
            return loxo_fail_at(p->ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = i},
                                "sphere: vertex %" PRId64 " of the map to begin with has no direction", i);
        v3_store(s->f[s->order[i]], v3_scale(1.0 / length, x));
    }
    return LOXO_OK;
}

/* What maps a surface without a start. */
static loxo_status map_by(const sphere_problem *p, loxo_sphere_start which, sphere_map f, loxo_sphere_info *info)
{
    switch (which) {
    case LOXO_SPHERE_START_SCEM: return sphere_map_scem(p, f, info);
    case LOXO_SPHERE_START_FLASH: return sphere_map_flash(p, f, info);
    case LOXO_SPHERE_START_CMCF: return sphere_map_cmcf(p, f, info);
    case LOXO_SPHERE_START_POSITIVE: return sphere_map_positive(p, f, info);
    default: return sphere_map_harmonic(p, f, info);
    }
}

/* Folds and energy of the map as it is. */
static loxo_status look(loxo_sphere *s, sphere_folds *folds, sphere_energy *energy)
{
    const sphere_problem *p = &s->problem;
    const loxo_status status = sphere_find_folds(p, (sphere_const_map)s->f, NULL, folds);
    return status < 0 ? status : sphere_find_energy(p, (sphere_const_map)s->f, energy);
}

/* The same, as what is told of a start. */
static loxo_status look_at_start(loxo_sphere *s, sphere_folds *folds, loxo_sphere_info *info)
{
    sphere_energy energy;
    const loxo_status status = look(s, folds, &energy);
    if (status < 0) return status;
    info->n_folds_start = folds->n;
    info->energy_start = info->energy = energy.energy;
    return status;
}

static bool is_one_to_one(const sphere_folds *folds) { return folds->n == 0 && folds->degree == 1; }

/* Makes the start of the settings; of auto the first that will do. The method's tolerance and limits are not those of its start. */
static loxo_status find_start(loxo_sphere *s, sphere_folds *folds, loxo_sphere_info *info)
{
    static const loxo_sphere_start ladder[] = {LOXO_SPHERE_START_HARMONIC, LOXO_SPHERE_START_SCEM};
    const bool is_auto = info->start == LOXO_SPHERE_START_AUTO;
    const loxo_sphere_settings usual = loxo_sphere_settings_default();
    sphere_problem p = s->problem;
    p.settings.tolerance = usual.tolerance;
    p.settings.max_iterations = usual.max_iterations;
    for (int k = 0;; ++k) {
        if (is_auto) info->start = ladder[k];
        loxo_status status = map_by(&p, info->start, s->f, info);
        if (status == LOXO_STOPPED || status < 0) return status;
        if ((status = look_at_start(s, folds, info)) < 0 || !is_auto || k == 1) return status;
        if (is_one_to_one(folds) && info->energy_start < MOST_START_ENERGY) return status;
    }
}

/* A start that is given, or made; one to one where the method must begin so. */
static loxo_status make_start(loxo_sphere *s, const double *start, loxo_sphere_info *info)
{
    const sphere_problem *p = &s->problem;
    const bool is_auto = p->settings.start == LOXO_SPHERE_START_AUTO;
    sphere_folds folds;
    sphere_energy energy;
    loxo_status status;
    info->start = p->settings.start;
    if (info->start == LOXO_SPHERE_START_GIVEN) {
        status = take_start(s, start);
        if (status >= 0) status = look_at_start(s, &folds, info);
    } else {
        status = find_start(s, &folds, info);
    }
    if (status < 0 || status == LOXO_STOPPED) return status;
    if (p->settings.method != LOXO_SPHERE_NEWTON || is_one_to_one(&folds)) return LOXO_OK;
    if ((status = sphere_unfold(p, s->f, info)) != LOXO_OK) return status;
    if ((status = look(s, &folds, &energy)) < 0 || is_one_to_one(&folds) || !is_auto) return status;
    info->start = LOXO_SPHERE_START_POSITIVE;
    if ((status = sphere_map_positive(p, s->f, info)) != LOXO_OK) return status;
    return look_at_start(s, &folds, info);
}

static loxo_status run_method(loxo_sphere *s, loxo_sphere_info *info)
{
    const sphere_problem *p = &s->problem;
    switch (p->settings.method) {
    case LOXO_SPHERE_HBTR: return sphere_map_hbtr(p, s->f, info);
    case LOXO_SPHERE_SCEM: return map_by(p, LOXO_SPHERE_START_SCEM, s->f, info);
    case LOXO_SPHERE_FLASH: return map_by(p, LOXO_SPHERE_START_FLASH, s->f, info);
    case LOXO_SPHERE_CMCF: return map_by(p, LOXO_SPHERE_START_CMCF, s->f, info);
    default: return sphere_map_newton(p, NULL, s->f, info);
    }
}

static bool has_start(const loxo_sphere *s)
{
    return s->problem.settings.method == LOXO_SPHERE_NEWTON || s->problem.settings.method == LOXO_SPHERE_HBTR;
}

static void clock_phase(double *clock_s, loxo_sphere_phase phase, loxo_sphere_info *info)
{
    const double now = loxo_os_clock_s();
    info->phase_s[phase] += now - *clock_s;
    *clock_s = now;
}

/* What is told of the map, and whether it is one to one. */
static loxo_status judge(loxo_sphere *s, loxo_status status, loxo_sphere_info *info)
{
    const sphere_problem *p = &s->problem;
    sphere_folds folds;
    sphere_energy energy;
    loxo_status found = sphere_find_folds(p, (sphere_const_map)s->f, NULL, &folds);
    if (found >= 0) found = sphere_find_energy(p, (sphere_const_map)s->f, &energy);
    if (found < 0) return found;
    info->n_folds = folds.n;
    info->degree = folds.degree;
    info->objective = energy.energy;
    info->image_area = energy.image_area;
    if (status != LOXO_OK || (folds.n == 0 && folds.degree == 1)) return status;
    (void)loxo_fail(p->ctx, LOXO_CHECK_FAILED,
                    "sphere: %" PRId64 " triangles are turned over; the map covers the sphere %d times", folds.n,
                    folds.degree);
    return LOXO_CHECK_FAILED;
}

static loxo_status solve(loxo_sphere *s, const double *start, loxo_sphere_info *info)
{
    const sphere_problem *p = &s->problem;
    double clock_s = loxo_os_clock_s();
    sphere_folds folds;
    sphere_energy energy;
    loxo_status status = has_start(s) ? make_start(s, start, info) : LOXO_OK;
    if (status < 0) return status;
    clock_phase(&clock_s, LOXO_SPHERE_PHASE_START, info);
    loxo_status done = status == LOXO_STOPPED ? status : run_method(s, info);
    if (done < 0) return done;
    clock_phase(&clock_s, LOXO_SPHERE_PHASE_ITERATE, info);
    if ((status = look(s, &folds, &energy)) < 0) return status;
    info->n_folds_unmended = folds.n;
    info->energy = energy.energy;
    if (p->settings.is_centred && done != LOXO_STOPPED) {
        if ((status = sphere_center(p, s->f, &info->center)) < 0) return status;
        if (done == LOXO_OK || status == LOXO_STOPPED) done = status;
    }
    clock_phase(&clock_s, LOXO_SPHERE_PHASE_CENTER, info);
    /* Flat triangles are not what Moebius maps keep: centring may turn one over. */
    if (p->settings.is_unfolded && done != LOXO_STOPPED) {
        if ((status = sphere_unfold(p, s->f, info)) < 0) return status;
        if (status == LOXO_STOPPED) done = status;
    }
    clock_phase(&clock_s, LOXO_SPHERE_PHASE_UNFOLD, info);
    if (done == LOXO_STOPPED) info->stop_reason = LOXO_SPHERE_STOP_MONITOR;
    status = judge(s, done, info);
    clock_phase(&clock_s, LOXO_SPHERE_PHASE_CHECK, info);
    return status;
}

loxo_status loxo_sphere_solve(loxo_sphere *s, const double *start, double *map, loxo_sphere_info *info)
{
    loxo_sphere_info own = {.n_iterations = 0};
    if (s == NULL) return LOXO_ERR_ARGUMENT;
    const sphere_problem *p = &s->problem;
    const double start_s = loxo_os_clock_s();
    if (map == NULL) return loxo_fail(p->ctx, LOXO_ERR_ARGUMENT, "sphere: map is NULL");
    loxo_progress_begin(p->ctx);
    own.method = p->settings.method;
    own.phase_s[LOXO_SPHERE_PHASE_PREPARE] = s->prepare_s;
    const loxo_status status = solve(s, start, &own);
    if (status < 0) return status;
    for (int64_t i = 0; i < s->n_given; ++i)
        for (int k = 0; k < 3; ++k)
            map[3 * i + k] = s->f[s->order[i]][k];
    own.total_s = s->prepare_s + loxo_os_clock_s() - start_s;
    own.peak_bytes = loxo_context_memory(p->ctx).peak_bytes;
    if (info != NULL) *info = own;
    return status;
}
