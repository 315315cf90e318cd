/* SPDX-License-Identifier: MIT
 * A picture: check, measure the field, aim the camera, and then see and shade, band by band; letters
 * last. */
#include "base/allocate.h"
#include "base/options.h"
#include "base/os.h"
#include "draw/annotate.h"
#include "draw/png.h"
#include "draw/shade.h"
#include "par/range.h"

#include <loxo/draw.h>

#include <math.h>
#include <string.h>

#define MAX_SAMPLE_BYTES ((size_t)512 << 20) /* larger pictures are drawn in bands, each going twice over all faces */

static loxo_status check_arguments(loxo_context *ctx, const loxo_mesh_arrays *mesh, const loxo_draw_settings *settings)
{
    if (mesh == NULL || settings == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "draw: no mesh or no settings");
    const loxo_status status = loxo_options_check(ctx, "draw", loxo_draw_options, settings);
    if (status < 0) return status;
    if (!(settings->value_min < settings->value_max))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "draw: value-min is %g, not below value-max, which is %g",
                         settings->value_min, settings->value_max);
    if (mesh->n_vertices < 0 || mesh->n_faces < 0)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "draw: negative number of vertices or faces");
    if (mesh->n_faces > INT32_MAX) /* the visible face of a sample is kept in 32 bits */
        return loxo_fail(ctx, LOXO_ERR_LIMIT, "draw: %lld faces, at most %d can be drawn", (long long)mesh->n_faces,
                         INT32_MAX);
    if (mesh->n_faces > 0 && mesh->triangle == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "draw: no triangles");
    if (mesh->n_vertices > 0 && (mesh->position == NULL) == (mesh->position_float == NULL))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "draw: exactly one array of positions is needed");
    return LOXO_OK;
}

/* Ends of the colour map: as set, else of the finite values at vertices that are drawn. */
static void measure_values(loxo_context *ctx, loxo_draw_scene *scene)
{
    const int64_t n = scene->mesh->n_vertices;
    const loxo_draw_settings *s = scene->settings;
    double low = INFINITY, high = -INFINITY;
    int64_t n_gaps = 0;
    if (scene->value == NULL) return;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 2.0)) reduction(+ : n_gaps) reduction(min : low) \
    reduction(max : high)
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v) {
            const double x = scene->value[v];
            if (!(scene->inverse_depth[v] > 0.0F)) continue;
            if (!isfinite(x)) {
                n_gaps += 1;
                continue;
            }
            low = x < low ? x : low;
            high = x > high ? x : high;
        }
    }
    scene->has_gaps = n_gaps > 0;
    scene->has_range = low <= high;
    if (!scene->has_range) return;
    if (isfinite(s->value_min)) low = s->value_min;
    if (isfinite(s->value_max)) high = s->value_max;
    if (!(0.5 * high - 0.5 * low > 0.0)) { /* one value, or all on the far side of the end that is set */
        const double room = fmax(0.1 * fabs(low), 1e-300);
        if (!isfinite(s->value_max)) high = fmin((isfinite(s->value_min) ? low : high) + room, 0x1p1023);
        if (!isfinite(s->value_min)) low = fmax((isfinite(s->value_max) ? high : low) - room, -0x1p1023);
    }
    scene->value_min = low + 0.0; /* no -0 */
    scene->value_max = high + 0.0;
    if (s->n_isolines > 0) {
        const loxo_draw_ticks levels = loxo_draw_ticks_find(scene->value_min, scene->value_max, s->n_isolines);
        if (levels.first <= levels.last) scene->isoline_step = loxo_draw_tick_step(&levels);
    }
}

/* Rows of pixels whose samples are held at once. */
static int band_height(const loxo_context *ctx, const loxo_draw_settings *s)
{
    const loxo_memory memory = loxo_context_memory(ctx);
    const size_t room = memory.limit_bytes > memory.current_bytes ? memory.limit_bytes - memory.current_bytes : 0;
    const size_t row_bytes = (size_t)s->width * (size_t)(s->supersample * s->supersample) * sizeof(uint64_t);
    const size_t rows = (room / 2 < MAX_SAMPLE_BYTES ? room / 2 : MAX_SAMPLE_BYTES) / row_bytes;
    return rows < 1 ? 1 : rows > (size_t)s->height ? s->height : (int)rows;
}

/* What the samples of the pixel rows begin..end-1 see. */
static loxo_status see_band(loxo_context *ctx, const loxo_draw_scene *scene, int begin, int end, uint64_t *visible)
{
    const int64_t samples = scene->settings->supersample,
                  n = (end - begin) * samples * samples * scene->settings->width;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 0.5))
    {
        const loxo_range r = loxo_thread_range(n);
        memset(&visible[r.begin], 0, (size_t)(r.end - r.begin) * sizeof *visible);
    }
    return loxo_draw_rasterise(ctx, scene, begin * samples, end * samples, visible);
}

static loxo_status draw_mesh(loxo_context *ctx, const loxo_draw_scene *scene, uint8_t *rgb)
{
    const loxo_draw_settings *s = scene->settings;
    const int samples = s->supersample;
    const double per_row = 1.0 / s->height;
    loxo_draw_cavity cavity;
    loxo_status status = loxo_draw_cavity_create(ctx, scene, &cavity);
    if (status < 0) return status;
    const int height = band_height(ctx, s); /* in what memory is left now */
    loxo_draw_palette *palette = loxo_allocate(ctx, 1, sizeof *palette);
    uint64_t *visible = loxo_allocate(ctx, (int64_t)height * s->width * samples * samples, sizeof *visible);
    status = LOXO_ERR_MEMORY; /* loxo_allocate leaves the message */
    if (palette == NULL || visible == NULL) goto done;
    loxo_draw_palette_fill(palette, s->colormap);

    for (int begin = 0; begin < s->height; begin += height) {
        const int end = begin + height < s->height ? begin + height : s->height;
        if ((status = see_band(ctx, scene, begin, end, visible)) < 0) goto done;
        loxo_draw_cavity_add(ctx, scene, visible, (int64_t)begin * samples, (int64_t)end * samples, &cavity);
        if (loxo_stop_wanted(ctx, "draw", 0.4 + 0.3 * end * per_row)) status = LOXO_ERR_STOPPED;
        if (status < 0) goto done;
    }
    loxo_draw_cavity_blur(&cavity);
    for (int begin = 0; begin < s->height; begin += height) {
        const int end = begin + height < s->height ? begin + height : s->height;
        if (height < s->height && (status = see_band(ctx, scene, begin, end, visible)) < 0) goto done;
        loxo_draw_shade(ctx, scene, palette, &cavity, visible, begin, end, rgb);
        if (loxo_stop_wanted(ctx, "draw", 0.7 + 0.3 * end * per_row)) status = LOXO_ERR_STOPPED;
        if (status < 0) goto done;
    }
done:
    loxo_draw_cavity_destroy(ctx, &cavity);
    loxo_release(ctx, visible);
    loxo_release(ctx, palette);
    return status;
}

loxo_status loxo_draw(loxo_context *ctx, const loxo_mesh_arrays *mesh, const double *value,
                      const loxo_draw_settings *settings, uint8_t *rgb)
{
    loxo_status status = check_arguments(ctx, mesh, settings);
    int64_t n_drawn = 0, n_nonfinite = 0;
    if (status < 0) return status;
    if (rgb == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "draw: no picture to draw into");
    loxo_progress_begin(ctx);

    loxo_draw_scene scene = {.mesh = mesh, .value = value, .settings = settings};
    scene.xy = loxo_allocate(ctx, mesh->n_vertices, sizeof *scene.xy);
    scene.inverse_depth = loxo_allocate_zero(ctx, mesh->n_vertices, sizeof *scene.inverse_depth);
    scene.normal = loxo_allocate_zero(ctx, mesh->n_vertices, sizeof *scene.normal);
    status = LOXO_ERR_MEMORY; /* loxo_allocate has left the message */
    if (scene.xy == NULL || scene.inverse_depth == NULL || scene.normal == NULL) goto done;
    if ((status = loxo_draw_mark_vertices(ctx, &scene)) < 0) goto done;
    measure_values(ctx, &scene);
    const loxo_draw_layout layout = loxo_draw_lay_out(&scene);
    scene.clip = layout.clip;
    if ((status = loxo_draw_project(ctx, &scene, &layout.fit, &n_drawn, &n_nonfinite)) < 0) goto done;
    if (n_nonfinite > 0)
        loxo_warn(ctx, "draw-nonfinite", n_nonfinite, "%lld vertices are not finite: their faces are not drawn",
                  (long long)n_nonfinite);
    if (n_drawn > 0) {
        if ((status = loxo_draw_sum_normals(ctx, &scene)) < 0) goto done;
        if ((status = draw_mesh(ctx, &scene, rgb)) < 0) goto done;
    } else {
        loxo_warn(ctx, "draw-empty", 1, "the mesh has nothing to draw: the picture is empty");
        memset(rgb, LOXO_DRAW_BACKGROUND, (size_t)3 * (size_t)settings->width * (size_t)settings->height);
    }
    loxo_draw_annotate(&scene, &layout, rgb);
done:
    if (status == LOXO_ERR_STOPPED) loxo_fail(ctx, status, "draw: stopped by the monitor");
    loxo_release(ctx, scene.normal);
    loxo_release(ctx, scene.inverse_depth);
    loxo_release(ctx, scene.xy);
    return status;
}

loxo_status loxo_draw_png(loxo_context *ctx, const loxo_mesh_arrays *mesh, const double *value,
                          const loxo_draw_settings *settings, const char *path)
{
    loxo_status status = loxo_draw_png_available(ctx);
    if (status < 0) return status;
    if ((status = check_arguments(ctx, mesh, settings)) < 0) return status;
    if (path == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "draw: no path");
    if ((status = loxo_os_output_check(ctx, path)) < 0) return status; /* before the work, not after */
    uint8_t *rgb = loxo_allocate(ctx, (int64_t)3 * settings->width * settings->height, sizeof *rgb);
    if (rgb == NULL) return LOXO_ERR_MEMORY;
    status = loxo_draw(ctx, mesh, value, settings, rgb);
    if (status >= 0) status = loxo_draw_png_save(ctx, path, rgb, settings->width, settings->height);
    loxo_release(ctx, rgb);
    return status;
}

loxo_status loxo_picture_write(loxo_context *ctx, const char *path, const uint8_t *rgb, int width, int height)
{
    if (path == NULL || rgb == NULL || width < 1 || height < 1 || width > 16384 || height > 16384)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "picture: no path, no pixels, or more than 16384 a side");
    const loxo_status status = loxo_draw_png_available(ctx);
    return status < 0 ? status : loxo_draw_png_save(ctx, path, rgb, width, height);
}
