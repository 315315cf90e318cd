/* SPDX-License-Identifier: MIT */
#include "register_picture.h"

#include "picture.h"

#include <math.h>
#include <string.h>

#define N_PANELS 4
#define WIDTH    2.1 /* of a panel; what is in it has a radius of 1 */
#define N_RINGS  2   /* of vertices around a landmark that are coloured, too */

/* Curves of one name have one colour on both surfaces: by the fixed one's list. NaN: not in it. */
static double color_of(const cli_surface *fixed, const char *name)
{
    const loxo_landmarks *l = &fixed->landmarks;
    for (int64_t i = 0; i < l->n_curves; ++i)
        if (strcmp(l->name[i], name) == 0) return ((double)i + 0.5) / (double)l->n_curves;
    return NAN;
}

/* value [n_vertices] out: the colour at landmarks and around them, NaN elsewhere. Vertices that get one in a round spread in the next. */
static loxo_status mark(cli_run *run, const cli_surface *fixed, const cli_surface *side, double *value)
{
    const int64_t n = side->soup.n_vertices;
    const loxo_landmarks *l = &side->landmarks;
    double *next = loxo_allocate(run->ctx, n, sizeof *next);
    if (next == NULL) return LOXO_ERR_MEMORY;
    for (int64_t v = 0; v < n; ++v)
        value[v] = NAN;
    for (int64_t c = 0; c < l->n_curves; ++c) {
        const double color = color_of(fixed, l->name[c]);
        for (int64_t i = l->curve_begin[c]; i < l->curve_begin[c + 1]; ++i)
            for (int k = 0; k < 3; ++k)
                if (l->point[i].vertex[k] >= 0) value[l->point[i].vertex[k]] = color;
    }
    for (int ring = 0; ring < N_RINGS; ++ring) {
        memcpy(next, value, (size_t)n * sizeof *next);
        for (int64_t f = 0; f < side->soup.n_faces; ++f) {
            const loxo_index *t = &side->soup.triangle[3 * f];
            for (int k = 0; k < 3; ++k) {
                const loxo_index from = t[k], to = t[(k + 1) % 3];
                if (isnan(next[to])) next[to] = value[from];
                if (isnan(next[from])) next[from] = value[to];
            }
        }
        memcpy(value, next, (size_t)n * sizeof *next);
    }
    loxo_release(run->ctx, next);
    return LOXO_OK;
}

static double coordinate(const loxo_soup *soup, const double *position, int64_t i)
{
    if (position != NULL) return position[i];
    return soup->position != NULL ? soup->position[i] : (double)soup->position_float[i];
}

/* Vertices and faces of a panel behind those that are there, moved to the middle of the panel. position NULL: the surface's own. */
static void add_panel(const cli_surface *side, const double *position, int panel, const double right[3], loxo_soup *all)
{
    const loxo_soup *soup = &side->soup;
    const int64_t n = soup->n_vertices;
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, radius = 0.0;
    for (int64_t i = 0; i < 3 * n; ++i) {
        low[i % 3] = fmin(low[i % 3], coordinate(soup, position, i));
        high[i % 3] = fmax(high[i % 3], coordinate(soup, position, i));
    }
    for (int k = 0; k < 3; ++k)
        radius = fmax(radius, 0.5 * (high[k] - low[k]));
    for (int64_t i = 0; i < 3 * n; ++i) {
        const double middle = 0.5 * (low[i % 3] + high[i % 3]), place = WIDTH * panel * right[i % 3];
        all->position[3 * all->n_vertices + i] = place + (coordinate(soup, position, i) - middle) / radius;
    }
    for (int64_t i = 0; i < 3 * soup->n_faces; ++i)
        all->triangle[3 * all->n_faces + i] = (loxo_index)(soup->triangle[i] + all->n_vertices);
    all->n_vertices += n;
    all->n_faces += soup->n_faces;
}

loxo_status cli_register_picture(cli_run *run, const cli_surface *fixed, const cli_surface *moving,
                                 const double *position, const loxo_draw_settings *settings, const char *path)
{
    const struct {
        const cli_surface *side;
        const double *position;
    } panel[N_PANELS] = {{moving, NULL}, {moving, moving->map}, {moving, position}, {fixed, NULL}};
    const double azimuth = settings->azimuth_deg * (3.14159265358979323846 / 180.0);
    const double across[3] = {-sin(azimuth), cos(azimuth), 0.0}; /* of the picture, z up */
    const int turn = settings->up == LOXO_DRAW_UP_Z ? 0 : settings->up == LOXO_DRAW_UP_Y ? 2 : 1;
    loxo_draw_settings draw = *settings;
    loxo_soup all = {.n_vertices = 0};
    double right[3], *value = NULL;
    int64_t n_vertices = 0, n_faces = 0, n_before = 0;
    for (int k = 0; k < 3; ++k)
        right[(k + turn) % 3] = across[k];
    for (int i = 0; i < N_PANELS; ++i) {
        n_vertices += panel[i].side->soup.n_vertices;
        n_faces += panel[i].side->soup.n_faces;
    }
    if (n_vertices > LOXO_INDEX_MAX)
        return cli_fail(run, LOXO_ERR_LIMIT, "register: %lld vertices in one picture are more than ids go",
                        (long long)n_vertices);
    loxo_status status = LOXO_ERR_MEMORY;
    all.position = loxo_allocate(run->ctx, 3 * n_vertices, sizeof *all.position);
    all.triangle = loxo_allocate(run->ctx, 3 * n_faces, sizeof *all.triangle);
    value = loxo_allocate(run->ctx, n_vertices, sizeof *value);
    if (all.position == NULL || all.triangle == NULL || value == NULL) goto done;
    status = LOXO_OK;
    for (int i = 0; i < N_PANELS && status >= 0; ++i) {
        status = mark(run, fixed, panel[i].side, value + n_before);
        add_panel(panel[i].side, panel[i].position, i, right, &all);
        n_before = all.n_vertices;
    }
    draw.value_min = 0.0;
    draw.value_max = 1.0;
    if (status >= 0) status = cli_picture(run, &all, value, &draw, path);
done:
    loxo_release(run->ctx, value);
    loxo_soup_destroy(run->ctx, &all);
    return status;
}
