/* SPDX-License-Identifier: MIT */
#include "maps.h"

#include <math.h>
#include <string.h>

const paper_map_model paper_map_models[] = {
    {"fandisk", "Fandisk", 6475},
    {"planck", "Planck", 51108},
    {"horse", "Horse", 21013},
    {"bunny", "Bunny", 55684},
    {"brain48k", "Brain", 32160},
    {"venus", "Venus", 14303},
    {0},
};

loxo_sphere_settings paper_map_settings(loxo_sphere_method method, loxo_sphere_start start)
{
    loxo_sphere_settings settings = loxo_sphere_settings_default();
    settings.method = method;
    settings.start = start;
    settings.is_unfolded = settings.is_centred = false;
    return settings;
}

typedef struct watch {
    double most_s;
    paper_map_curve *curve; /* NULL: not wanted */
} watch;

static int look(void *user, const loxo_progress *p)
{
    const watch *w = user;
    paper_map_curve *c = w->curve;
    if (c != NULL && strcmp(p->phase, "hbtr") == 0) {
        /* A step that was not taken leaves the point where it was. */
        const bool is_same =
            c->n > 0 && c->energy[c->n - 1] == p->objective && c->gradient[c->n - 1] == p->gradient_norm;
        if (!is_same && c->n < PAPER_MAP_MOST_POINTS) {
            c->step[c->n] = (double)p->iteration;
            c->energy[c->n] = p->objective;
            c->gradient[c->n] = p->gradient_norm;
            c->move[c->n++] = isfinite(p->residual) ? p->residual : (double)NAN;
        }
    }
    return p->elapsed_s > w->most_s;
}

static loxo_status measure(paper_subject *s, paper_map *map)
{
    loxo_context *ctx = s->b->ctx;
    const int64_t n = s->soup.n_vertices;
    double *centred = loxo_allocate(ctx, n, 3 * sizeof *centred), *area = loxo_allocate(ctx, n, sizeof *area);
    loxo_status status = centred != NULL && area != NULL ? LOXO_OK : LOXO_ERR_MEMORY;
    if (status >= 0) status = loxo_measure_sphere_map(ctx, &s->arrays, map->map, &map->raw, NULL);
    if (status >= 0) status = loxo_mesh_vertex_areas(ctx, &s->arrays, area);
    if (status >= 0) status = loxo_moebius_center(ctx, n, map->map, NULL, area, NULL, centred, NULL);
    if (status >= 0) status = loxo_measure_sphere_map(ctx, &s->arrays, centred, &map->centred, NULL);
    loxo_release(ctx, centred);
    loxo_release(ctx, area);
    return status;
}

loxo_status paper_map_make(paper_subject *s, const loxo_sphere_settings *settings, paper_map_curve *curve,
                           paper_map *map)
{
    loxo_context *ctx = s->b->ctx;
    watch w = {.most_s = s->b->settings.solve_seconds, .curve = curve};
    loxo_sphere *sphere = NULL;
    *map = (paper_map){.b = s->b};
    if (curve != NULL) curve->n = 0;
    map->map = loxo_allocate(ctx, s->soup.n_vertices, 3 * sizeof *map->map);
    if (map->map == NULL) return LOXO_ERR_MEMORY;
    loxo_context_set_monitor(ctx, look, &w);
    map->status = loxo_sphere_create(ctx, s->halfedges, settings, &sphere);
    if (map->status >= 0) map->status = loxo_sphere_solve(sphere, NULL, map->map, &map->info);
    loxo_context_set_monitor(ctx, NULL, NULL);
    loxo_sphere_destroy(sphere);
    if (map->status >= 0) return measure(s, map);
    loxo_release(ctx, map->map);
    map->map = NULL;
    return LOXO_OK;
}

void paper_map_close(paper_map *map)
{
    loxo_release(map->b->ctx, map->map);
    map->map = NULL;
}

const char *paper_map_note(const paper_map *map) { return map->status == LOXO_OK ? "" : loxo_status_name(map->status); }
