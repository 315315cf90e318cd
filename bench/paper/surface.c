/* SPDX-License-Identifier: MIT
 * A closed curve on the sphere and surfaces over the disk.
 * source  Cantarella, Schumacher 2022, Computing the conformal barycenter, section 6.1 */
#include "surface.h"

#include <math.h>

#define N_CORNERS 8
#define PI        3.141592653589793

/* Eight corners, by turns 45 degrees above and below the equator. */
static void corner(int k, double x[2], double gamma[3])
{
    const double angle = 2.0 * PI * k / N_CORNERS, r = sqrt(0.5);
    x[0] = cos(angle);
    x[1] = sin(angle);
    gamma[0] = r * x[0];
    gamma[1] = r * x[1];
    gamma[2] = k % 2 == 0 ? r : -r;
}

static double cross(const double a[2], const double b[2]) { return a[0] * b[1] - a[1] * b[0]; }

void paper_curve_at(const double x[2], double out[3])
{
    const double angle = atan2(x[1], x[0]), at = (angle < 0.0 ? angle + 2.0 * PI : angle) * N_CORNERS / (2.0 * PI);
    const int k = (int)at % N_CORNERS;
    double p[2], q[2], a[3], b[3], square = 0.0;
    corner(k, p, a);
    corner(k + 1, q, b);
    const double s = fmax(0.0, cross(p, x)), t = fmax(0.0, cross(x, q)); /* x is (t p + s q) up to a factor */
    for (int i = 0; i < 3; ++i) {
        out[i] = t * a[i] + s * b[i];
        square += out[i] * out[i];
    }
    for (int i = 0; i < 3; ++i)
        out[i] /= sqrt(square);
}

void paper_move_node(const double z[2], const double node[2], double out[2])
{
    /* co (x + z) / |x + z|^2 + z, the inverse of (8) by differences */
    const double e[2] = {node[0] + z[0], node[1] + z[1]}, co = 1.0 - z[0] * z[0] - z[1] * z[1];
    const double f = co / (e[0] * e[0] + e[1] * e[1]);
    const double y[2] = {f * e[0] + z[0], f * e[1] + z[1]}, length = hypot(y[0], y[1]);
    out[0] = y[0] / length;
    out[1] = y[1] / length;
}

loxo_status paper_surface_open(bench *b, double n_wanted, paper_surface *s)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    *s = (paper_surface){.b = b};
    settings.shape = LOXO_SHAPE_DISK;
    settings.n_vertices = n_wanted > 200.0 ? (int64_t)n_wanted : 200;
    const loxo_status status = loxo_generate(b->ctx, &settings, false, &s->soup);
    if (status < 0) return status;
    s->n = s->soup.n_vertices;
    s->z = loxo_allocate(b->ctx, s->n, sizeof *s->z);
    s->w = loxo_allocate(b->ctx, s->n, sizeof *s->w);
    s->value = loxo_allocate(b->ctx, s->n, sizeof *s->value);
    if (s->z == NULL || s->w == NULL || s->value == NULL) return LOXO_ERR_MEMORY;
    for (int64_t i = 0; i < s->n; ++i) {
        const double *p = s->soup.position + 3 * i, r = hypot(p[0], p[1]);
        for (int k = 0; k < 2; ++k)
            s->z[i][k] = r > 1.0 - 1e-9 ? p[k] / r : p[k];
        s->value[i] = fmin(r, 1.0);
    }
    return LOXO_OK;
}

void paper_surface_close(paper_surface *s)
{
    loxo_release(s->b->ctx, s->z);
    loxo_release(s->b->ctx, s->w);
    loxo_release(s->b->ctx, s->value);
    loxo_soup_destroy(s->b->ctx, &s->soup);
}

loxo_status paper_surface_draw(const paper_surface *s, const char *suffix, const char *title, const char *unit)
{
    loxo_draw_settings settings = loxo_draw_settings_default();
    loxo_mesh_arrays arrays = loxo_soup_arrays(&s->soup);
    arrays.position = &s->w[0][0];
    settings.title = title;
    settings.unit = unit;
    settings.n_isolines = 10;
    return paper_draw(s->b, suffix, &arrays, s->value, &settings);
}
