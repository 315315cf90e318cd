/* SPDX-License-Identifier: MIT */
#include "draw/scene.h"
#include "par/range.h"

#include <float.h>
#include <math.h>

/* From the camera to the middle of the mesh, in radii: far enough that lengths stay comparable, near enough that the
 * eye sees depth. Points of the mesh are 5 to 7 radii away, so nothing is ever behind the camera. */
#define CAMERA_DISTANCE 6.0

loxo_status loxo_draw_mark_vertices(loxo_context *ctx, loxo_draw_scene *scene)
{
    const loxo_mesh_arrays *m = scene->mesh;
    int64_t bad_face = m->n_faces;
#pragma omp parallel num_threads(loxo_threads_for(ctx, m->n_faces, 3.0))
    {
        const loxo_range r = loxo_thread_range(m->n_faces);
        int64_t bad = m->n_faces;
        for (int64_t f = r.begin; f < r.end; ++f) {
            for (int c = 0; c < 3; ++c) {
                const int64_t v = m->triangle[3 * f + c];
                if (v < 0 || v >= m->n_vertices) {
                    if (bad > f) bad = f;
                    continue;
                }
                float one = 1.0F; /* threads that meet here write the same */
                __atomic_store(&scene->inverse_depth[v], &one, __ATOMIC_RELAXED);
            }
        }
#pragma omp critical
        if (bad < bad_face) bad_face = bad;
    }
    if (bad_face < m->n_faces)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.byte = -1, .element = bad_face},
                            "draw: face %lld has a vertex number outside 0..%lld", (long long)bad_face,
                            (long long)m->n_vertices - 1);
    return LOXO_OK;
}

typedef struct bounds {
    double min[3], max[3];
} bounds;

static void bounds_clear(bounds *b)
{
    for (int k = 0; k < 3; ++k)
        b->min[k] = INFINITY, b->max[k] = -INFINITY;
}

static void bounds_add(bounds *b, const double *p, int n)
{
    for (int k = 0; k < n; ++k) {
        b->min[k] = p[k] < b->min[k] ? p[k] : b->min[k];
        b->max[k] = p[k] > b->max[k] ? p[k] : b->max[k];
    }
}

/* A thread's bounds are empty where its vertices are not drawn. */
static void bounds_join(bounds *b, const bounds *part, int n)
{
    if (part->min[0] > part->max[0]) return;
    bounds_add(b, part->min, n);
    bounds_add(b, part->max, n);
}

/* Centre and radius of the box of the marked vertices; takes the mark from those that are not finite. */
static void measure_box(loxo_context *ctx, loxo_draw_scene *scene, int64_t *n_drawn, int64_t *n_nonfinite)
{
    const int64_t n = scene->mesh->n_vertices;
    bounds box;
    int64_t drawn = 0, nonfinite = 0;
    bounds_clear(&box);
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 4.0)) reduction(+ : drawn, nonfinite)
    {
        const loxo_range r = loxo_thread_range(n);
        bounds mine;
        bounds_clear(&mine);
        for (int64_t v = r.begin; v < r.end; ++v) {
            double p[3];
            if (!(scene->inverse_depth[v] > 0.0F)) continue;
            loxo_draw_point(scene->mesh, v, p);
            if (isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2])) {
                bounds_add(&mine, p, 3);
                drawn += 1;
            } else {
                scene->inverse_depth[v] = 0.0F;
                nonfinite += 1;
            }
        }
#pragma omp critical
        bounds_join(&box, &mine, 3);
    }
    *n_drawn = drawn;
    *n_nonfinite = nonfinite;
    if (drawn == 0) return;
    /* Half extents first: nothing overflows, whatever the coordinates. */
    double half[3], longest = 0.0;
    for (int k = 0; k < 3; ++k) {
        scene->centre[k] = 0.5 * box.min[k] + 0.5 * box.max[k];
        half[k] = 0.5 * box.max[k] - 0.5 * box.min[k];
        longest = fmax(longest, half[k]);
    }
    scene->radius = 1.0;
    if (longest > 0.0) {
        for (int k = 0; k < 3; ++k)
            half[k] /= longest;
        /* The rounding of the centre leaves points at most a few units in the last place outside. */
        scene->radius = fmin(longest * sqrt(loxo_draw_dot(half, half)), DBL_MAX);
        if (!(scene->radius >= 1e-307)) scene->radius = 1e-307; /* quotients of denormal numbers would be coarse */
    }
}

/* The three axes, so that the mesh's up axis is z. */
static void aim(loxo_draw_scene *scene)
{
    const loxo_draw_settings *s = scene->settings;
    const double degree = acos(-1.0) / 180.0;
    const double ca = cos(degree * s->azimuth_deg), sa = sin(degree * s->azimuth_deg);
    const double ce = cos(degree * s->elevation_deg), se = sin(degree * s->elevation_deg);
    const double toward[3] = {ce * ca, ce * sa, se}, right[3] = {-sa, ca, 0.0}, up[3] = {-se * ca, -se * sa, ce};
    const int turn = s->up == LOXO_DRAW_UP_Z ? 0 : s->up == LOXO_DRAW_UP_Y ? 2 : 1; /* x, y, z -> their places */
    for (int k = 0; k < 3; ++k) {
        scene->toward[(k + turn) % 3] = toward[k];
        scene->right[(k + turn) % 3] = right[k];
        scene->up[(k + turn) % 3] = up[k];
    }
}

/* Tangents of the angles under which the camera sees the vertex; returns 1 / depth. */
static double see(const loxo_draw_scene *scene, int64_t v, double tangent[2])
{
    double p[3];
    loxo_draw_unit_point(scene, v, p);
    const double q = 1.0 / (CAMERA_DISTANCE - loxo_draw_dot(p, scene->toward));
    tangent[0] = q * loxo_draw_dot(p, scene->right);
    tangent[1] = q * loxo_draw_dot(p, scene->up);
    return q;
}

static int32_t to_subsample(double x)
{
    const double limit = LOXO_DRAW_MAX_COORDINATE, y = rint(x * LOXO_DRAW_SUBSAMPLE);
    return (int32_t)(y < -limit ? -limit : y > limit ? limit : y);
}

loxo_status loxo_draw_project(loxo_context *ctx, loxo_draw_scene *scene, const loxo_draw_rectangle *fit,
                              int64_t *n_drawn, int64_t *n_nonfinite)
{
    const int64_t n = scene->mesh->n_vertices;
    const int n_threads = loxo_threads_for(ctx, n, 10.0);
    const double samples = scene->settings->supersample;
    measure_box(ctx, scene, n_drawn, n_nonfinite);
    if (*n_drawn == 0) return LOXO_OK;
    aim(scene);
    if (loxo_stop_wanted(ctx, "draw", 0.1)) return LOXO_ERR_STOPPED;

    bounds seen;
    bounds_clear(&seen);
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(n);
        bounds mine;
        bounds_clear(&mine);
        for (int64_t v = r.begin; v < r.end; ++v) {
            double tangent[2];
            if (!(scene->inverse_depth[v] > 0.0F)) continue;
            see(scene, v, tangent);
            bounds_add(&mine, tangent, 2);
        }
#pragma omp critical
        bounds_join(&seen, &mine, 2);
    }
    const double width = seen.max[0] - seen.min[0], height = seen.max[1] - seen.min[1];
    double scale = 1.0;
    if (width > 0.0 || height > 0.0) scale = fmin((fit->right - fit->left) / width, (fit->bottom - fit->top) / height);
    scale *= samples * scene->settings->zoom;
    scene->scale = scale;
    scene->middle_depth = CAMERA_DISTANCE;
    scene->shift[0] = 0.5 * samples * (fit->left + fit->right) - 0.5 * scale * (seen.min[0] + seen.max[0]);
    scene->shift[1] = 0.5 * samples * (fit->top + fit->bottom) + 0.5 * scale * (seen.min[1] + seen.max[1]);

#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t v = r.begin; v < r.end; ++v) {
            double tangent[2];
            if (!(scene->inverse_depth[v] > 0.0F)) continue;
            scene->inverse_depth[v] = (float)see(scene, v, tangent);
            scene->xy[v][0] = to_subsample(scene->shift[0] + scale * tangent[0]);
            scene->xy[v][1] = to_subsample(scene->shift[1] - scale * tangent[1]);
        }
    }
    return loxo_stop_wanted(ctx, "draw", 0.2) ? LOXO_ERR_STOPPED : LOXO_OK;
}
