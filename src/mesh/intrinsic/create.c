/* SPDX-License-Identifier: MIT
 * loxo_mesh_create_intrinsic: a mesh in, its intrinsic Delaunay triangulation out. */
#include "base/allocate.h"
#include "base/context.h"
#include "base/options.h"
#include "base/os.h"
#include "kernel/layout_kernel.h"
#include "mesh/intrinsic/flip.h"
#include "mesh/mesh_internal.h"
#include "par/range.h"

#include <string.h>

const loxo_option loxo_intrinsic_options[] = {
    {.name = "max-flips",
     .type = LOXO_OPTION_INT64,
     .offset = offsetof(loxo_intrinsic_settings, max_flips),
     .max = 0x1p62,
     .help = "at most so many flips; 0: as many as it takes"},
    {.name = "flip-tolerance",
     .type = LOXO_OPTION_DOUBLE,
     .offset = offsetof(loxo_intrinsic_settings, flip_tolerance),
     .max = 1.0,
     .help = "an edge is flipped when the cotangents opposite sum to less than minus this"},
    {.name = "mollify",
     .type = LOXO_OPTION_DOUBLE,
     .offset = offsetof(loxo_intrinsic_settings, mollify),
     .max = 0.01,
     .exclusive_min = true,
     .help = "how far a face must be from flat, in mean edge lengths; else all edges grow"},
    {.name = "traceable",
     .type = LOXO_OPTION_BOOL,
     .offset = offsetof(loxo_intrinsic_settings, traceable),
     .help = "keep the way back to the surface"},
    {.name = NULL},
};

loxo_intrinsic_settings loxo_intrinsic_settings_default(void)
{
    return (loxo_intrinsic_settings){
        .max_flips = 0,
        .flip_tolerance = 1e-10, /* cotangents of ordinary angles are known to 1e-15 */
        .mollify = 1e-9,         /* a flat face then gets heights of 1e-5 edges */
        .traceable = true,
    };
}

/* Bytes held, and those that only flipping needs. */
static void count_bytes(int64_t n_vertices, int64_t n_faces, const loxo_intrinsic_settings *s, size_t *held,
                        size_t *working)
{
    const size_t n_halfedges = 3 * (size_t)n_faces;
    *held = (size_t)n_vertices * sizeof(loxo_index) + n_halfedges * (2 * sizeof(loxo_index) + sizeof(double));
    if (s->traceable) *held += n_halfedges * (sizeof(int32_t) + sizeof(loxo_index));
    *working = n_halfedges * sizeof(double);
}

void loxo_mesh_estimate_intrinsic(int64_t n_vertices, int64_t n_faces, const loxo_intrinsic_settings *settings,
                                  size_t *mesh_bytes, size_t *peak_bytes)
{
    const loxo_intrinsic_settings s = settings != NULL ? *settings : loxo_intrinsic_settings_default();
    const size_t small_blocks = 4096;
    size_t held, working;
    count_bytes(n_vertices, n_faces, &s, &held, &working);
    if (mesh_bytes != NULL) *mesh_bytes = held;
    if (peak_bytes != NULL) *peak_bytes = held + working + small_blocks;
}

static loxo_status allocate_all(loxo_mesh *mesh, loxo_flips *t, bool is_traceable)
{
    const int64_t n_halfedges = 3 * t->n_faces;
    t->halfedge_vertex = mesh->halfedge_vertex = loxo_allocate(t->ctx, n_halfedges, sizeof *t->halfedge_vertex);
    t->halfedge_twin = mesh->halfedge_twin = loxo_allocate(t->ctx, n_halfedges, sizeof *t->halfedge_twin);
    t->vertex_halfedge = mesh->vertex_halfedge = loxo_allocate(t->ctx, t->n_vertices, sizeof *t->vertex_halfedge);
    t->length = mesh->halfedge_length = loxo_allocate(t->ctx, n_halfedges, sizeof *t->length);
    t->cotangent = loxo_allocate(t->ctx, n_halfedges, sizeof *t->cotangent);
    if (t->halfedge_vertex == NULL || t->halfedge_twin == NULL || t->vertex_halfedge == NULL || t->length == NULL ||
        t->cotangent == NULL)
        return LOXO_ERR_MEMORY;
    if (!is_traceable) return LOXO_OK;
    t->crossing = mesh->crossing = loxo_allocate(t->ctx, n_halfedges, sizeof *t->crossing);
    t->surface_next = mesh->surface_next = loxo_allocate(t->ctx, n_halfedges, sizeof *t->surface_next);
    return t->crossing != NULL && t->surface_next != NULL ? LOXO_OK : LOXO_ERR_MEMORY;
}

/* What one thread copies of a vertex's or a half-edge's numbers, it writes first. Returns the least excess of two sides
 * of a face over the third. */
static double copy_surface(loxo_flips *t, const loxo_mesh_view *surface)
{
    double least = HUGE_VAL;
#pragma omp parallel num_threads(loxo_threads_for(t->ctx, t->n_faces, 30.0)) reduction(min : least)
    {
        const loxo_range v = loxo_thread_range(t->n_vertices), f = loxo_thread_range(t->n_faces);
        if (v.end > v.begin)
            memcpy(&t->vertex_halfedge[v.begin], &surface->vertex_halfedge[v.begin],
                   (size_t)(v.end - v.begin) * sizeof *t->vertex_halfedge);
        for (int64_t i = f.begin; i < f.end; ++i) {
            double *length = &t->length[3 * i];
            k_face_lengths(surface, i, length);
            for (int k = 0; k < 3; ++k) {
                const int64_t h = 3 * i + k;
                t->halfedge_vertex[h] = surface->halfedge_vertex[h];
                t->halfedge_twin[h] = surface->halfedge_twin[h];
                if (t->crossing == NULL) continue;
                t->crossing[h] = -1;
                t->surface_next[h] = (loxo_index)h;
            }
            const double longest = fmax(length[0], fmax(length[1], length[2]));
            const double shortest = fmin(length[0], fmin(length[1], length[2]));
            const double middle = fmax(fmin(length[0], length[1]), fmin(fmax(length[0], length[1]), length[2]));
            const double excess = shortest - (longest - middle);
            if (!(excess >= least)) least = excess;
        }
    }
    return least;
}

/* sums: edge lengths, edges. */
static void partial_lengths(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const loxo_flips *t = arg;
    for (int64_t h = 3 * begin; h < 3 * end; ++h) {
        if (t->halfedge_twin[h] >= 0 && t->halfedge_twin[h] < h) continue;
        sums[0] += t->length[h];
        sums[1] += 1.0;
    }
}

/* Makes all edges longer where a face is too flat, and finds the cotangents. */
static loxo_status mollify(loxo_flips *t, double least, double share, loxo_intrinsic_info *info)
{
    double sums[2];
    const loxo_status status = loxo_sum(t->ctx, t->n_faces, 2, partial_lengths, t, sums);
    if (status < 0) return status;
    const double mean = sums[0] / sums[1], wanted = share * mean;
    info->n_edges = (int64_t)sums[1];
    if (t->n_faces > 0 && (!(mean > 1e-40) || !(mean < 1e40) || !(least > -mean)))
        return loxo_fail(t->ctx, LOXO_ERR_MESH, "intrinsic: edges too long or short to compute with (mean %g)", mean);
    const double longer = least < wanted ? wanted - least : 0.0;
    info->lengthened = longer;
#pragma omp parallel num_threads(loxo_threads_for(t->ctx, t->n_faces, 20.0))
    {
        const loxo_range r = loxo_thread_range(t->n_faces);
        for (int64_t f = r.begin; f < r.end; ++f) {
            for (int k = 0; k < 3 && longer > 0.0; ++k)
                t->length[3 * f + k] += longer;
            k_cotangents_of(&t->length[3 * f], &t->cotangent[3 * f]);
        }
    }
    return LOXO_OK;
}

enum { SUM_QUALITY, SUM_INTERIOR, SUM_NONDELAUNAY, SUM_LOOPS, N_SUMS };

static void partial_shape(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const loxo_flips *t = arg;
    for (int64_t f = begin; f < end; ++f) {
        sums[SUM_QUALITY] += k_quality_of(&t->length[3 * f]);
        for (int64_t h = 3 * f; h < 3 * f + 3; ++h) {
            const loxo_index twin = t->halfedge_twin[h];
            if (twin < h) continue;
            const bool is_loop = t->halfedge_vertex[h] == t->halfedge_vertex[twin];
            sums[SUM_INTERIOR] += 1.0;
            sums[SUM_NONDELAUNAY] += t->cotangent[h] + t->cotangent[twin] < -t->tolerance ? 1.0 : 0.0;
            sums[SUM_LOOPS] += is_loop ? 1.0 : 0.0;
        }
    }
}

static loxo_status measure(const loxo_flips *t, double *quality, double *share_nondelaunay, int64_t *n_loops)
{
    double sums[N_SUMS];
    const loxo_status status = loxo_sum(t->ctx, t->n_faces, N_SUMS, partial_shape, t, sums);
    if (status < 0) return status;
    *quality = t->n_faces > 0 ? sums[SUM_QUALITY] / (double)t->n_faces : 0.0;
    *share_nondelaunay = sums[SUM_INTERIOR] > 0.0 ? sums[SUM_NONDELAUNAY] / sums[SUM_INTERIOR] : 0.0;
    *n_loops = (int64_t)sums[SUM_LOOPS];
    return LOXO_OK;
}

static loxo_status make_delaunay(loxo_flips *t, const loxo_mesh_view *surface, const loxo_intrinsic_settings *s,
                                 loxo_intrinsic_info *info)
{
    const double least = copy_surface(t, surface);
    loxo_status status = mollify(t, least, s->mollify, info);
    if (status < 0) return status;
    status = measure(t, &info->quality_before, &info->share_nondelaunay_before, &info->n_loops);
    if (status < 0) return status;
    const loxo_status flipped = loxo_flip_to_delaunay(t);
    if (flipped < 0) return flipped;
    info->n_flips = t->n_flips;
    status = measure(t, &info->quality_after, &info->share_nondelaunay_after, &info->n_loops);
    return status < 0 ? status : flipped;
}

static void show_view(loxo_mesh *mesh)
{
    mesh->view = mesh->surface->view;
    mesh->view.halfedge_vertex = mesh->halfedge_vertex;
    mesh->view.halfedge_twin = mesh->halfedge_twin;
    mesh->view.vertex_halfedge = mesh->vertex_halfedge;
    mesh->view.halfedge_length = mesh->halfedge_length;
}

loxo_status loxo_mesh_create_intrinsic(loxo_context *ctx, const loxo_mesh *surface,
                                       const loxo_intrinsic_settings *settings, loxo_intrinsic_info *info,
                                       loxo_mesh **out)
{
    const loxo_intrinsic_settings s = settings != NULL ? *settings : loxo_intrinsic_settings_default();
    const double start_s = loxo_os_clock_s();
    loxo_intrinsic_info result = {0};
    loxo_mesh *mesh = NULL;
    size_t held, working;
    if (out != NULL) *out = NULL;
    if (ctx == NULL || surface == NULL || out == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "intrinsic: no context, no mesh or no place for the result");
    if (surface->view.halfedge_length != NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "intrinsic: the mesh is an intrinsic triangulation already");
    loxo_status status = loxo_options_check(ctx, "intrinsic", loxo_intrinsic_options, &s);
    if (status < 0) return status;
    count_bytes(surface->view.n_vertices, surface->view.n_faces, &s, &held, &working);
    if ((status = loxo_memory_check(ctx, held + working, "the intrinsic triangulation")) < 0) return status;
    loxo_progress_begin(ctx);
    loxo_flips flips = {.ctx = ctx,
                        .n_vertices = surface->view.n_vertices,
                        .n_faces = surface->view.n_faces,
                        .surface_twin = surface->view.halfedge_twin,
                        .tolerance = s.flip_tolerance,
                        .most_flips = s.max_flips};
    mesh = loxo_allocate(ctx, 1, sizeof *mesh);
    if (mesh == NULL) return LOXO_ERR_MEMORY;
    *mesh = (loxo_mesh){.ctx = ctx,
                        .surface = surface,
                        .n_caller_vertices = surface->n_caller_vertices,
                        .caller_to_mesh = surface->caller_to_mesh};
    status = allocate_all(mesh, &flips, s.traceable);
    if (status >= 0) status = make_delaunay(&flips, &surface->view, &s, &result);
    loxo_release(ctx, flips.cotangent);
    if (status < 0) {
        loxo_mesh_destroy(mesh);
        return status;
    }
    show_view(mesh);
    mesh->lengthened = result.lengthened;
    result.mesh_bytes = held;
    result.peak_bytes = held + working;
    result.seconds = loxo_os_clock_s() - start_s;
    if (info != NULL) *info = result;
    *out = mesh;
    return status;
}
