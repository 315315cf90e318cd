/* SPDX-License-Identifier: MIT
 * Figure 6: the extension of a curve passes Moebius maps through, before it and behind it: pictures, and how far the two ways differ.
 * source  Cantarella, Schumacher 2022, Computing the conformal barycenter, Fig. 6 */
#include "surface.h"

#include <loxo/extension.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#define N_SAMPLES 4096
#define PI        3.141592653589793

static const double before[2] = {0.5, 0.3}, behind[3] = {0.3, -0.4, 0.2};

typedef struct samples {
    double angle[N_SAMPLES], x[N_SAMPLES][3];
} samples;

/* gamma; with the map before it: the same points, at the circle's points that it takes there; with the one behind: their images. */
static loxo_status sample(bench *b, bool with_before, bool with_behind, samples *out)
{
    double base = 0.0;
    loxo_moebius map;
    loxo_status status = loxo_moebius_set_identity(b->ctx, 3, &map);
    if (status >= 0 && with_behind) status = loxo_moebius_append_shift(b->ctx, &map, behind, 0.0);
    for (int k = 0; k < N_SAMPLES && status >= 0; ++k) {
        const double x[2] = {cos(2.0 * PI * k / N_SAMPLES), sin(2.0 * PI * k / N_SAMPLES)};
        double at[2] = {x[0], x[1]};
        paper_curve_at(x, out->x[k]);
        if (with_before) paper_move_node(before, x, at); /* the inverse of sigma_before */
        const double angle = atan2(at[1], at[0]);
        if (k == 0) base = angle;
        out->angle[k] = angle < base ? angle + 2.0 * PI : angle;
    }
    return status < 0 ? status : loxo_moebius_map_sphere(b->ctx, &map, N_SAMPLES, &out->x[0][0], &out->x[0][0]);
}

/* The extension of samples at points z; co may be NULL. */
static loxo_status extend(bench *b, const samples *c, int64_t n, const double *z, double *w, double *co)
{
    const loxo_curve curve = {.n = N_SAMPLES, .d = 3, .x = &c->x[0][0], .angle = c->angle};
    const loxo_extension_values values = {.w = w, .co = co};
    loxo_extension_settings settings = loxo_extension_settings_default();
    loxo_extension *extension = NULL;
    settings.n_nodes = N_SAMPLES;
    loxo_status status = loxo_extension_create(b->ctx, &curve, &settings, &extension);
    if (status >= 0) status = loxo_extension_evaluate(extension, n, z, NULL, &values, NULL);
    loxo_extension_destroy(extension);
    return status;
}

/* Images of the disk's points inside by sigma_before, of the circle's by the same. */
static loxo_status move_disk(paper_surface *s, double (*out)[2])
{
    loxo_moebius map;
    loxo_status status = loxo_moebius_set_identity(s->b->ctx, 2, &map);
    if (status >= 0) status = loxo_moebius_append_shift(s->b->ctx, &map, before, 0.0);
    for (int64_t i = 0; i < s->n && status >= 0; ++i)
        status = hypot(s->z[i][0], s->z[i][1]) > 1.0 - 1e-9
                     ? loxo_moebius_map_sphere(s->b->ctx, &map, 1, s->z[i], out[i])
                     : loxo_moebius_map_ball(s->b->ctx, &map, 1, s->z[i], NULL, out[i], NULL);
    return status;
}

/* Images of the surface's points by sigma_behind. */
static loxo_status move_surface(paper_surface *s, const double *co)
{
    loxo_moebius map;
    loxo_status status = loxo_moebius_set_identity(s->b->ctx, 3, &map);
    if (status >= 0) status = loxo_moebius_append_shift(s->b->ctx, &map, behind, 0.0);
    for (int64_t i = 0; i < s->n && status >= 0; ++i)
        status = co[i] > 0.0 ? loxo_moebius_map_ball(s->b->ctx, &map, 1, s->w[i], &co[i], s->w[i], NULL)
                             : loxo_moebius_map_sphere(s->b->ctx, &map, 1, s->w[i], s->w[i]);
    return status;
}

static double largest_difference(const paper_surface *s, double (*w)[3])
{
    double most = 0.0;
    for (int64_t i = 0; i < s->n; ++i) {
        const double e[3] = {s->w[i][0] - w[i][0], s->w[i][1] - w[i][1], s->w[i][2] - w[i][2]};
        most = fmax(most, sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]));
    }
    return most;
}

static loxo_status picture(const paper_surface *s, const char *suffix, const char *what)
{
    char title[128];
    snprintf(title, sizeof title, "Figure 6: %s", what);
    return paper_surface_draw(s, suffix, title, "|z|");
}

loxo_status paper_cantarella2022_fig6(bench *b)
{
    static samples c; /* large */
    static bench_table table;
    paper_surface s;
    double apart[2] = {0.0, 0.0};
    loxo_status status = paper_surface_open(b, 20000.0 * b->settings.share, &s);
    double(*kept)[3] = loxo_allocate(b->ctx, s.n, sizeof *kept),
    (*moved)[2] = loxo_allocate(b->ctx, s.n, sizeof *moved), *co = loxo_allocate(b->ctx, s.n, sizeof *co);
    if (status >= 0 && (kept == NULL || moved == NULL || co == NULL)) status = LOXO_ERR_MEMORY;
    if (status < 0 || (status = sample(b, false, false, &c)) < 0 ||
        (status = extend(b, &c, s.n, &s.z[0][0], &s.w[0][0], co)) < 0 ||
        (status = picture(&s, "gamma", "E(gamma)")) < 0)
        goto done;
    if ((status = move_surface(&s, co)) < 0 || (status = picture(&s, "behind-map", "phi2 o E(gamma)")) < 0) goto done;
    memcpy(kept, s.w, (size_t)s.n * sizeof *kept);
    if ((status = sample(b, false, true, &c)) < 0 || (status = extend(b, &c, s.n, &s.z[0][0], &s.w[0][0], NULL)) < 0 ||
        (status = picture(&s, "behind-curve", "E(phi2 o gamma)")) < 0)
        goto done;
    apart[1] = largest_difference(&s, kept);
    if ((status = sample(b, true, false, &c)) < 0 || (status = extend(b, &c, s.n, &s.z[0][0], &s.w[0][0], NULL)) < 0 ||
        (status = picture(&s, "before-curve", "E(gamma o phi1)")) < 0)
        goto done;
    memcpy(kept, s.w, (size_t)s.n * sizeof *kept);
    if ((status = move_disk(&s, moved)) < 0 || (status = sample(b, false, false, &c)) < 0 ||
        (status = extend(b, &c, s.n, &moved[0][0], &s.w[0][0], NULL)) < 0 ||
        (status = picture(&s, "before-map", "E(gamma) o phi1")) < 0)
        goto done;
    apart[0] = largest_difference(&s, kept);
    bench_table_begin(&table, "two ways|points|largest distance");
    bench_table_row(&table, "E(gamma o phi1), E(gamma) o phi1|%lld|%.1e", (long long)s.n, apart[0]);
    bench_table_row(&table, "E(phi2 o gamma), phi2 o E(gamma)|%lld|%.1e", (long long)s.n, apart[1]);
    bench_table_print(b, &table);
    bench_say(b,
              "%d samples of a curve of eight great arcs, as many nodes, tolerance 1e-8. Between samples both ways "
              "take other arcs, "
              "and corners are\nresolved by nodes: what is left is of the order of a squared step. The paper shows "
              "pictures only, of other "
              "curves.\n",
              N_SAMPLES);
    bench_record(b, "fig6",
                 json_pack("{s:I, s:f, s:f}", "points", (json_int_t)s.n, "before", apart[0], "behind", apart[1]));
done:
    loxo_release(b->ctx, kept);
    loxo_release(b->ctx, moved);
    loxo_release(b->ctx, co);
    paper_surface_close(&s);
    return status;
}
