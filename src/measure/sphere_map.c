/* SPDX-License-Identifier: MIT
 * Measures of maps to the sphere: what the surface must be, sums over its faces, percentiles, and sums of squares off the medians. */
#include "measure/sphere_map.h"

#include "base/context.h"
#include "base/rng.h"
#include "kernel/conformal_kernel.h"
#include "mesh/statistics.h"
#include "par/range.h"

#define OFF_SPHERE 1e-5
#define FOUR_PI    12.566370614359172954

/* ---- what is asked of the surface and the map ------------------------------------------------------------------- */

/* The faces' half-edges as a chain of edges, each edge a random number, less than none where it is run downward: 0 where every edge is
 * run as often one way as the other. Numbers of 64 bits that wrap: the order of the sum is of no matter. */
static uint64_t sum_boundary(loxo_context *ctx, const loxo_mesh_arrays *mesh)
{
    uint64_t sum = 0;
#pragma omp parallel num_threads(loxo_threads_for(ctx, mesh->n_faces, 6.0)) reduction(+ : sum)
    {
        const loxo_range r = loxo_thread_range(mesh->n_faces);
        for (int64_t f = r.begin; f < r.end; ++f) {
            for (int k = 0; k < 3; ++k) {
                const loxo_index from = mesh->triangle[3 * f + k], to = mesh->triangle[3 * f + (k + 1) % 3];
                if (from == to) continue;
                const uint64_t low = (uint64_t)(from < to ? from : to), high = (uint64_t)(from < to ? to : from);
                const uint64_t edge = loxo_random_u64(1, low << 32 | high);
                sum = from < to ? sum + edge : sum - edge;
            }
        }
    }
    return sum;
}

/* Says what keeps the surface from being closed. */
static loxo_status fail_open(loxo_context *ctx, const loxo_mesh_arrays *mesh)
{
    loxo_mesh_report report;
    const loxo_status status = loxo_mesh_check(ctx, mesh, &report);
    if (status < 0) return status;
    if (report.n_boundary_edges > 0)
        return loxo_fail(ctx, LOXO_ERR_MESH,
                         "measure: the surface is open: %lld boundary edges, Euler characteristic %lld",
                         (long long)report.n_boundary_edges, (long long)report.euler);
    if (report.is_manifold && !report.is_orientable)
        return loxo_fail(ctx, LOXO_ERR_MESH, "measure: the surface is not orientable");
    return loxo_fail(ctx, LOXO_ERR_MESH, "measure: neighbouring faces of the surface are not oriented alike");
}

/* The lowest vertex of a face that is not on the unit sphere, or -1. */
static int64_t find_off_sphere(loxo_context *ctx, const loxo_mesh_arrays *mesh, const double *map)
{
    int64_t worst = INT64_MAX;
#pragma omp parallel num_threads(loxo_threads_for(ctx, mesh->n_faces, 9.0)) reduction(min : worst)
    {
        const loxo_range r = loxo_thread_range(3 * mesh->n_faces);
        for (int64_t h = r.begin; h < r.end; ++h) {
            const int64_t v = mesh->triangle[h];
            if (!(fabs(v3_norm(v3_load(map + 3 * v)) - 1.0) <= OFF_SPHERE) && v < worst) worst = v;
        }
    }
    return worst < INT64_MAX ? worst : -1;
}

static loxo_status check(loxo_context *ctx, const loxo_mesh_arrays *mesh, const double *map)
{
    int64_t n_degenerate, first;
    loxo_status status = loxo_arrays_check_counts(ctx, "measure", mesh);
    if (status < 0) return status;
    if (mesh->n_faces == 0) return loxo_fail(ctx, LOXO_ERR_MESH, "measure: the surface has no faces");
    if (map == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "measure: no map to the sphere");
    if ((status = loxo_arrays_check_ids(ctx, mesh, &n_degenerate, &first)) < 0) return status;
    if ((status = loxo_arrays_check_finite(ctx, mesh)) < 0) return status;
    if (sum_boundary(ctx, mesh) != 0) return fail_open(ctx, mesh);
    const int64_t vertex = find_off_sphere(ctx, mesh, map);
    if (vertex < 0) return LOXO_OK;
    return loxo_fail_at(ctx, LOXO_ERR_MESH, (loxo_place){.byte = -1, .element = vertex},
                        "measure: the image of vertex %lld is not on the unit sphere within %g", (long long)vertex,
                        OFF_SPHERE);
}

/* ---- sums ------------------------------------------------------------------------------------------------------- */

enum { SUM_DIRICHLET, SUM_ENERGY, SUM_AREA, SUM_IMAGE, SUM_INWARD, SUM_SOLID, SUM_FOLDS, SUM_FLAT, SUM_N };

static void add_faces(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const measured_map *m = arg;
    for (int64_t f = begin; f < end; ++f) {
        const k_triangle face = map_source(m, f), image = map_image(m, f);
        const k_distortion d = k_distortion_of(&face, &image);
        const loxo_vec3 a = map_point(m, 3 * f), b = map_point(m, 3 * f + 1), c = map_point(m, 3 * f + 2);
        double side;
        (void)k_image_normal(a, b, c, &side);
        sums[SUM_DIRICHLET] += d.dirichlet;
        sums[SUM_ENERGY] += d.energy;
        sums[SUM_AREA] += 0.5 * face.twice_area;
        sums[SUM_IMAGE] += 0.5 * image.twice_area;
        sums[SUM_INWARD] += side < 0.0 ? 0.5 * image.twice_area : 0.0;
        sums[SUM_SOLID] += k_solid_angle(a, b, c);
        sums[SUM_FOLDS] += side > 0.0 ? 0.0 : 1.0;
        sums[SUM_FLAT] += face.twice_area > 0.0 ? 0.0 : 1.0;
    }
}

/* Angle errors, |mu| and |log|, each less the shift: sums and sums of squares; and images without area. */
enum { OF_ANGLES, OF_BELTRAMI, OF_AREA, N_KINDS };
enum { SUM_IMAGE_FLAT = 2 * N_KINDS, SUM_N_SHIFTED };

static void add_value(const measured_map *m, int kind, double value, double *sums)
{
    const double x = value - m->shift[kind];
    sums[(int64_t)2 * kind] += x;
    sums[(int64_t)2 * kind + 1] += x * x;
}

static void add_shifted(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const measured_map *m = arg;
    for (int64_t f = begin; f < end; ++f) {
        const k_triangle face = map_source(m, f), image = map_image(m, f);
        sums[SUM_IMAGE_FLAT] += image.twice_area > 0.0 ? 0.0 : 1.0;
        if (!(face.twice_area > 0.0)) continue;
        for (int k = 0; k < 3; ++k)
            add_value(m, OF_ANGLES, map_angle_error(&face, &image, k), sums);
        add_value(m, OF_BELTRAMI, k_distortion_of(&face, &image).size, sums);
        if (image.twice_area > 0.0) add_value(m, OF_AREA, fabs(map_area_log(m, &face, &image)), sums);
    }
}

/* ---- percentiles ------------------------------------------------------------------------------------------------ */

static int sample_angles(const void *arg, int64_t f, double value[3])
{
    const k_triangle face = map_source(arg, f), image = map_image(arg, f);
    if (!(face.twice_area > 0.0)) return 0;
    for (int k = 0; k < 3; ++k) {
        double sine, cosine;
        k_angle_error(&face, &image, k, &sine, &cosine);
        value[k] = k_angle_rank(sine, cosine);
    }
    return 3;
}

static int sample_beltrami(const void *arg, int64_t f, double value[3])
{
    const k_triangle face = map_source(arg, f), image = map_image(arg, f);
    if (!(face.twice_area > 0.0)) return 0;
    value[0] = k_distortion_of(&face, &image).size;
    return 1;
}

static int sample_area(const void *arg, int64_t f, double value[3])
{
    const k_triangle face = map_source(arg, f), image = map_image(arg, f);
    if (!(face.twice_area > 0.0) || !(image.twice_area > 0.0)) return 0;
    value[0] = fabs(map_area_log(arg, &face, &image));
    return 1;
}

static double as_it_is(double x) { return x; }

static loxo_status find_percentiles(loxo_context *ctx, measured_map *m, int kind, loxo_distribution *out)
{
    static const loxo_sample_fn sample[N_KINDS] = {sample_angles, sample_beltrami, sample_area};
    static const int per_cent[4] = {50, 75, 95, 99};
    double (*const value_of)(double) = kind == OF_ANGLES ? k_angle_of_rank : as_it_is;
    loxo_quantiles q;
    if (loxo_stop_wanted(ctx, "measure", 0.1 + 0.2 * kind))
        return loxo_fail(ctx, LOXO_ERR_STOPPED, "measure: stopped by the monitor");
    const loxo_status status = loxo_quantiles_find(ctx, m->mesh->n_faces, sample[kind], m, 4, per_cent, &q);
    if (status < 0) return status;
    *out = (loxo_distribution){
        .n = q.n,
        .median = value_of(q.quantile[0]),
        .percentile_75 = value_of(q.quantile[1]),
        .percentile_95 = value_of(q.quantile[2]),
        .percentile_99 = value_of(q.quantile[3]),
        .max = value_of(q.max),
    };
    m->shift[kind] = q.n > 0 ? out->median : 0.0;
    return LOXO_OK;
}

static void set_moments(const measured_map *m, int kind, const double *sums, loxo_distribution *out)
{
    const double n = (double)out->n, mean = sums[(int64_t)2 * kind] / n;
    out->mean = m->shift[kind] + mean;
    out->sd = sqrt(fmax(sums[(int64_t)2 * kind + 1] / n - mean * mean, 0.0));
    if (out->n == 0) out->mean = out->sd = (double)NAN;
}

static void to_degrees(loxo_distribution *d)
{
    double *const value[] = {&d->mean,          &d->sd, &d->median, &d->percentile_75, &d->percentile_95,
                             &d->percentile_99, &d->max};
    for (size_t i = 0; i < sizeof value / sizeof *value; ++i)
        *value[i] *= DEGREES;
}

/* ---- all of it -------------------------------------------------------------------------------------------------- */

static loxo_status measure_sums(loxo_context *ctx, measured_map *m, loxo_sphere_map_measure *out)
{
    double sums[SUM_N];
    const loxo_status status = loxo_sum(ctx, m->mesh->n_faces, SUM_N, add_faces, m, sums);
    if (status < 0) return status;
    for (int k = 0; k < SUM_N; ++k)
        if (!isfinite(sums[k]))
            return loxo_fail(ctx, LOXO_ERR_NUMERIC, "measure: the surface's area or the map's energy is not finite");
    if (!(sums[SUM_AREA] > 0.0)) return loxo_fail(ctx, LOXO_ERR_MESH, "measure: the surface has no area");
    *out = (loxo_sphere_map_measure){
        .n_faces = m->mesh->n_faces,
        .n_flat = (int64_t)sums[SUM_FLAT],
        .n_folds = (int64_t)sums[SUM_FOLDS],
        .degree = (int)lrint(sums[SUM_SOLID] / FOUR_PI),
        .area = sums[SUM_AREA],
        .image_area = sums[SUM_IMAGE],
        .image_area_signed = sums[SUM_IMAGE] - 2.0 * sums[SUM_INWARD],
        .dirichlet = sums[SUM_DIRICHLET],
        .energy = sums[SUM_ENERGY],
        .energy_signed = sums[SUM_ENERGY] + 2.0 * sums[SUM_INWARD],
    };
    m->log_total = sums[SUM_IMAGE] > 0.0 ? log(sums[SUM_IMAGE] / sums[SUM_AREA]) : 0.0;
    return LOXO_OK;
}

static loxo_status measure_distributions(loxo_context *ctx, measured_map *m, loxo_sphere_map_measure *out)
{
    loxo_distribution *const kinds[N_KINDS] = {&out->angle_error_deg, &out->beltrami, &out->area_log};
    double sums[SUM_N_SHIFTED];
    loxo_status status;
    for (int kind = 0; kind < N_KINDS; ++kind)
        if ((status = find_percentiles(ctx, m, kind, kinds[kind])) < 0) return status;
    if ((status = loxo_sum(ctx, m->mesh->n_faces, SUM_N_SHIFTED, add_shifted, m, sums)) < 0) return status;
    for (int kind = 0; kind < N_KINDS; ++kind)
        set_moments(m, kind, sums, kinds[kind]);
    out->n_image_flat = (int64_t)sums[SUM_IMAGE_FLAT];
    to_degrees(&out->angle_error_deg);
    return LOXO_OK;
}

loxo_status loxo_measure_sphere_map(loxo_context *ctx, const loxo_mesh_arrays *mesh, const double *map,
                                    loxo_sphere_map_measure *measure, const loxo_sphere_map_fields *fields)
{
    measured_map m = {.mesh = mesh, .map = map};
    loxo_sphere_map_measure found = {.n_faces = 0};
    if (measure == NULL) return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "measure: no place for the result");
    loxo_progress_begin(ctx);
    loxo_status status = check(ctx, mesh, map);
    if (status >= 0) status = measure_sums(ctx, &m, &found);
    if (status >= 0) status = measure_distributions(ctx, &m, &found);
    if (status >= 0 && fields != NULL) status = measure_fill_fields(ctx, &m, fields);
    if (status >= 0) *measure = found;
    return status;
}
