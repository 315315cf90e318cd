/* SPDX-License-Identifier: MIT */
#include "paper.h"

#include <math.h>
#include <stdio.h>

/* The mesh of the soup, and room for distances. */
static loxo_status finish(paper_subject *s)
{
    loxo_context *ctx = s->b->ctx;
    s->arrays = loxo_soup_arrays(&s->soup);
    const loxo_status status = loxo_mesh_create(ctx, &s->arrays, LOXO_BORROW, NULL, NULL, &s->halfedges);
    if (status < 0) return status;
    s->distance = loxo_allocate(ctx, s->soup.n_vertices, sizeof *s->distance);
    return s->distance != NULL ? LOXO_OK : LOXO_ERR_MEMORY;
}

loxo_status paper_subject_open(bench *b, const char *model, double n_wanted, bool with_truth, paper_subject *s)
{
    int64_t n = 0;
    *s = (paper_subject){.b = b};
    loxo_status status = paper_mesh_make(b, paper_model_find(model), n_wanted, with_truth, &s->mesh);
    if (status == LOXO_ERR_UNSUPPORTED) bench_say(b, "%s: skipped: %s\n", model, bench_message(b));
    if (status >= 0) status = loxo_read_mesh(b->ctx, s->mesh.path, NULL, &s->soup);
    if (status >= 0 && s->mesh.truth[0] != '\0' && s->mesh.n_truth == s->soup.n_vertices)
        status = loxo_read_field(b->ctx, s->mesh.truth, &s->truth, &n);
    if (status >= 0) status = finish(s);
    if (status < 0) paper_subject_close(s);
    return status;
}

loxo_status paper_subject_open_either(bench *b, const char *scan, const char *generated, double n_wanted,
                                      bool with_truth, paper_subject *s)
{
    loxo_status status = paper_subject_open(b, scan, 0.0, with_truth, s);
    if (status == LOXO_ERR_UNSUPPORTED)
        status = paper_subject_open(b, generated, n_wanted * b->settings.share, with_truth, s);
    if (status >= 0) bench_say(b, "%s, %lld vertices\n\n", s->mesh.model->name, (long long)s->soup.n_vertices);
    return status;
}

loxo_status paper_subject_generate(bench *b, loxo_shape shape, double n_wanted, double param, paper_subject *s)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    *s = (paper_subject){.b = b};
    settings.shape = shape;
    settings.n_vertices = (int64_t)n_wanted;
    settings.params[0] = param;
    loxo_status status = loxo_generate(b->ctx, &settings, false, &s->soup);
    if (status >= 0) status = finish(s);
    if (status < 0) paper_subject_close(s);
    return status;
}

void paper_subject_close(paper_subject *s)
{
    loxo_mesh_destroy(s->halfedges);
    loxo_release(s->b->ctx, s->truth);
    loxo_release(s->b->ctx, s->distance);
    loxo_soup_destroy(s->b->ctx, &s->soup);
    s->halfedges = NULL;
    s->truth = s->distance = NULL;
}

loxo_status paper_subject_solve(paper_subject *s, const char *method, const loxo_index *sources, int64_t n_sources,
                                loxo_geodesic_info *info)
{
    loxo_geodesic_settings settings;
    const loxo_status status = paper_method_settings(s->b, method, &settings);
    if (status < 0) return status;
    return loxo_geodesic_distance(s->b->ctx, s->halfedges, &settings, sources, n_sources, s->distance, info);
}

loxo_status paper_subject_find_truth(paper_subject *s, const loxo_index *sources, int64_t n_sources)
{
    if (!paper_has_method("exact")) return LOXO_OK;
    double *const distance = s->distance, *truth = loxo_allocate(s->b->ctx, s->soup.n_vertices, sizeof *truth);
    if (truth == NULL) return LOXO_ERR_MEMORY;
    loxo_release(s->b->ctx, s->truth);
    s->distance = s->truth = truth;
    const loxo_status status = paper_subject_solve(s, "exact", sources, n_sources, NULL);
    s->distance = distance;
    return status;
}

double paper_subject_error(paper_subject *s, const double *truth)
{
    loxo_distance_error error;
    if (truth == NULL || loxo_measure_distance_error(s->b->ctx, s->distance, truth, s->soup.n_vertices, &error) < 0)
        return (double)NAN;
    return error.mean_relative;
}
