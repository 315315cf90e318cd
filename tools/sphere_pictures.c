/* SPDX-License-Identifier: MIT */
#include "sphere_pictures.h"

#include "base/os.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Puts a picture of that width into a wider one, x pixels from the left. */
static void put_beside(const uint8_t *part, int part_width, uint8_t *whole, int width, int x, int height)
{
    for (int y = 0; y < height; ++y)
        memcpy(whole + 3 * ((size_t)y * (size_t)width + (size_t)x), part + (size_t)3 * (size_t)y * (size_t)part_width,
               (size_t)3 * (size_t)part_width);
}

typedef struct canvas {
    uint8_t *whole, *part;
    int width, height;
} canvas;

static loxo_status canvas_create(cli_run *run, int width, int height, canvas *c)
{
    *c = (canvas){.width = width, .height = height};
    c->whole = loxo_allocate(run->ctx, (int64_t)width * height, 3);
    c->part = loxo_allocate(run->ctx, (int64_t)width * height, 3);
    return c->whole != NULL && c->part != NULL ? LOXO_OK : LOXO_ERR_MEMORY;
}

static void canvas_destroy(cli_run *run, canvas *c)
{
    loxo_release(run->ctx, c->whole);
    loxo_release(run->ctx, c->part);
}

/* ---- both sides ------------------------------------------------------------------------------------------------- */

#define BAR  0.2 /* room for the scale bar, in heights */
#define SIDE 1.1 /* and for a side: wide enough that the height decides how large spheres and letters are */

loxo_draw_settings cli_sphere_draw_default(void)
{
    loxo_draw_settings s = loxo_draw_settings_default();
    s.width = (int)((2.0 * SIDE + BAR) * s.height);
    s.n_isolines = 0;
    return s;
}

/* Ends of the colours that are not given, the same for both sides. */
static void find_ends(const double *value, int64_t n, loxo_draw_settings *s)
{
    double low = (double)INFINITY, high = -(double)INFINITY;
    for (int64_t v = 0; v < n; ++v) {
        if (!isfinite(value[v])) continue;
        low = fmin(low, value[v]);
        high = fmax(high, value[v]);
    }
    if (!isfinite(s->value_min) && low < high) s->value_min = low;
    if (!isfinite(s->value_max) && s->value_min < high) s->value_max = high;
}

loxo_status cli_sphere_picture(cli_run *run, const loxo_mesh_arrays *image, const double *value, const char *what,
                               const loxo_draw_settings *settings, const char *path)
{
    const double start_s = loxo_os_clock_s();
    const int room = value != NULL && settings->scale_bar ? (int)(BAR * settings->height) : 0;
    const int front = (settings->width - room) / 2;
    canvas c;
    loxo_status status = canvas_create(run, settings->width, settings->height, &c);
    loxo_draw_settings s = *settings;
    if (value != NULL) find_ends(value, image->n_vertices, &s);
    for (int side = 0; side < 2 && status >= 0; ++side) {
        char title[160];
        (void)snprintf(title, sizeof title, "%s, %s", what, side == 0 ? "front" : "back");
        s.title = title;
        s.width = side == 0 ? front : settings->width - front;
        s.scale_bar = side == 1 && settings->scale_bar;
        if (side == 1) {
            s.azimuth_deg += s.azimuth_deg > 180.0 ? -180.0 : 180.0;
            s.elevation_deg = -s.elevation_deg;
        }
        status = loxo_draw(run->ctx, image, value, &s, c.part);
        if (status >= 0) put_beside(c.part, s.width, c.whole, c.width, side == 0 ? 0 : front, c.height);
    }
    if (status >= 0) status = loxo_picture_write(run->ctx, path, c.whole, c.width, c.height);
    canvas_destroy(run, &c);
    if (status < 0) return status;
    (void)cli_seconds(run, "draw", start_s);
    cli_wrote(run, path);
    return status;
}

/* ---- histograms ------------------------------------------------------------------------------------------------- */

enum { MOST_BINS = 100, WANTED_BINS = 40, PLOT_WIDTH = 900, PLOT_HEIGHT = 600 };

typedef struct histogram {
    int n_bins;
    double step, from[MOST_BINS + 1], share[MOST_BINS + 1]; /* per cent */
    double beyond;
} histogram;

/* 1, 2 or 5 times a power of ten, such that so many reach to the 99th percentile or a little further. */
static double step_to(double reach)
{
    const double least = reach > 0.0 ? reach / WANTED_BINS : 0.1, power = pow(10.0, floor(log10(least)));
    const double factor = least / power;
    return power * (factor <= 1.0 ? 1.0 : factor <= 2.0 ? 2.0 : factor <= 5.0 ? 5.0 : 10.0);
}

/* Sizes of numbers of d parts. */
static void count(int64_t n, int d, const double *value, double reach, histogram *h)
{
    int64_t n_in[MOST_BINS + 1] = {0}, total = 0;
    *h = (histogram){.step = step_to(reach)};
    h->n_bins = (int)fmin(fmax(ceil(reach / h->step), 10.0) + 2.0, MOST_BINS);
    for (int64_t i = 0; i < n; ++i) {
        const double x = d == 2 ? hypot(value[2 * i], value[2 * i + 1]) : value[i];
        if (isnan(x)) continue;
        total += 1;
        n_in[x < h->n_bins * h->step ? (int)(x / h->step) : h->n_bins] += 1;
    }
    for (int b = 0; b <= h->n_bins; ++b) {
        h->from[b] = b * h->step;
        h->share[b] = total > 0 ? 100.0 * (double)n_in[b] / (double)total : 0.0;
    }
    h->beyond = h->share[h->n_bins];
    h->share[h->n_bins] = 0.0;
}

static loxo_status draw_histogram(cli_run *run, const histogram *h, const loxo_distribution *d, const char *what,
                                  const char *unit, const char *of, uint8_t *rgb)
{
    const loxo_plot_series bars = {.style = LOXO_PLOT_BARS, .n = h->n_bins + 1, .x = h->from, .y = h->share};
    loxo_plot plot = loxo_plot_default();
    char title[160], x_title[160], y_title[160];
    (void)snprintf(title, sizeof title, "%s: mean %.3g, SD %.3g; beyond: %.2g %%", what, d->mean, d->sd, h->beyond);
    (void)snprintf(x_title, sizeof x_title, "%s%s", what, unit);
    (void)snprintf(y_title, sizeof y_title, "%% of the %s", of);
    plot.width = PLOT_WIDTH;
    plot.height = PLOT_HEIGHT;
    plot.title = title;
    plot.x_title = x_title;
    plot.y_title = y_title;
    plot.x_min = 0.0;
    plot.x_max = h->n_bins * h->step;
    plot.y_min = 0.0;
    plot.n_series = 1;
    plot.series = &bars;
    return loxo_plot_draw(run->ctx, &plot, rgb);
}

loxo_status cli_sphere_histograms(cli_run *run, int64_t n_faces, const double *angle_error_deg, const double *mu,
                                  const loxo_sphere_map_measure *m, const char *path)
{
    const double start_s = loxo_os_clock_s();
    canvas c;
    histogram h;
    loxo_status status = canvas_create(run, 2 * PLOT_WIDTH, PLOT_HEIGHT, &c);
    if (status < 0) goto done;
    count(3 * n_faces, 1, angle_error_deg, m->angle_error_deg.percentile_99, &h);
    status = draw_histogram(run, &h, &m->angle_error_deg, "angle error", ", degrees", "corners", c.part);
    if (status < 0) goto done;
    put_beside(c.part, PLOT_WIDTH, c.whole, c.width, 0, c.height);
    count(n_faces, 2, mu, m->beltrami.percentile_99, &h);
    status = draw_histogram(run, &h, &m->beltrami, "|mu|", "", "faces", c.part);
    if (status < 0) goto done;
    put_beside(c.part, PLOT_WIDTH, c.whole, c.width, PLOT_WIDTH, c.height);
    status = loxo_picture_write(run->ctx, path, c.whole, c.width, c.height);
    if (status < 0) goto done;
    (void)cli_seconds(run, "histogram", start_s);
    cli_wrote(run, path);
done:
    canvas_destroy(run, &c);
    return status;
}
