/* SPDX-License-Identifier: MIT
 * Measures of maps to the sphere: what motions and Moebius maps leave alone, folds, percentiles. */
#include "../shapes.h"
#include "kernel/distortion_kernel.h"
#include "operator/laplacian.h"
#include "solver/stopper.h"
#include "solver/surfaces.h"
#include "unit/random_vectors.h"

#include <loxo/loxo.h>

#define PI 3.14159265358979323846

/* ---- whole surfaces --------------------------------------------------------------------------------------------- */

static loxo_soup make(loxo_shape shape, int64_t n_vertices)
{
    loxo_generate_settings settings = loxo_generate_settings_default();
    loxo_soup soup = {0};
    settings.shape = shape;
    settings.n_vertices = n_vertices;
    CHECK_OK(loxo_generate(test_context, &settings, false, &soup));
    return soup;
}

/* Directions of the positions: a map of a surface around the origin. */
static double *directions(const loxo_soup *soup)
{
    double *map = loxo_allocate(test_context, 3 * soup->n_vertices, sizeof *map);
    for (int64_t v = 0; v < soup->n_vertices; ++v) {
        const loxo_vec3 p = v3_load(soup->position + 3 * v);
        v3_store(map + 3 * v, v3_scale(1.0 / v3_norm(p), p));
    }
    return map;
}

static loxo_sphere_map_measure measure(const loxo_soup *soup, const double *map)
{
    const loxo_mesh_arrays arrays = loxo_soup_arrays(soup);
    loxo_sphere_map_measure m;
    CHECK_OK(loxo_measure_sphere_map(test_context, &arrays, map, &m, NULL));
    return m;
}

/* Shift along a direction that is no symmetry of the icosphere. */
static void boost(double *map, int64_t n, double size)
{
    loxo_moebius moebius;
    const double w[3] = {0.36 * size, 0.48 * size, 0.8 * size};
    CHECK_OK(loxo_moebius_set_identity(test_context, 3, &moebius));
    CHECK_OK(loxo_moebius_append_shift(test_context, &moebius, w, 0.0));
    CHECK_OK(loxo_moebius_map_sphere(test_context, &moebius, n, map, map));
}

TEST(the_identity_is_conformal)
{
    loxo_soup soup = make(LOXO_SHAPE_ICOSPHERE, 2562);
    const loxo_sphere_map_measure m = measure(&soup, soup.position);
    CHECK_EQUAL(m.degree, 1);
    CHECK_EQUAL(m.n_folds + m.n_flat + m.n_image_flat, 0);
    CHECK_EQUAL(m.n_faces, soup.n_faces);
    CHECK_EQUAL(m.angle_error_deg.n, 3 * soup.n_faces);
    CHECK_EQUAL(m.angle_error_deg.max, 0.0); /* both sides of a difference are the same product */
    CHECK_EQUAL(m.angle_error_deg.mean, 0.0);
    CHECK_EQUAL(m.angle_error_deg.sd, 0.0);
    CHECK(m.beltrami.max < 1e-14);
    CHECK(m.area_log.max < 1e-14);
    CHECK(m.energy < 4.0 * PI * 1e-29); /* squares of roundings */
    CHECK_EQUAL(m.energy_signed, m.energy);
    CHECK_EQUAL(m.image_area_signed, m.image_area);
    CHECK_NEAR(m.area, m.image_area, 1e-13);
    CHECK(m.area < 4.0 * PI && m.area > 3.99 * PI);
    loxo_soup_destroy(test_context, &soup);
}

TEST(the_energy_is_that_of_the_matrix)
{
    static const loxo_shape shapes[] = {LOXO_SHAPE_ELLIPSOID, LOXO_SHAPE_BUMPY};
    for (int i = 0; i < 4; ++i) { /* then with faces flatter than the matrix takes them for */
        loxo_soup soup = make(shapes[i % 2], 1000);
        if (i >= 2) shape_add_caps(test_context, &soup, 50, i == 2 ? 1e-9 : 1e-2);
        double *map = directions(&soup);
        const loxo_sphere_map_measure m = measure(&soup, map);
        surface s = surface_from_soup(test_context, soup, LOXO_ORDER_GIVEN);
        const loxo_mesh_view view = loxo_mesh_get_view(s.mesh);
        loxo_csr l;
        long double dirichlet = 0.0L;
        CHECK_OK(loxo_laplacian_create(test_context, &view, &l, NULL));
        for (int64_t row = 0; row < l.n_rows; ++row)
            for (int64_t e = l.begin[row]; e < l.begin[row + 1]; ++e) {
                const loxo_vec3 d = v3_sub(v3_load(map + 3 * row), v3_load(map + 3 * (int64_t)l.column[e]));
                dirichlet -= 0.25L * (long double)(l.value[e] * v3_dot(d, d));
            }
        /* The matrix has heights from lengths: a hundredth of a side is known to 1e4 roundings. */
        CHECK_NEAR(m.dirichlet, (double)dirichlet, (i == 3 ? 1e-11 : 1e-13) * m.dirichlet);
        CHECK_NEAR(m.energy, (double)(dirichlet - (long double)m.image_area), (i == 3 ? 1e-11 : 1e-13) * m.dirichlet);
        CHECK_NEAR(m.image_area_signed, m.image_area, 1e-15);
        CHECK(m.degree == 1 && m.n_folds == 0 && m.energy > 0.01);
        loxo_csr_destroy(test_context, &l);
        loxo_release(test_context, map);
        surface_destroy(&s);
    }
}

TEST(moebius_maps_of_finer_spheres_come_near_to_conformal)
{
    double mean[3], energy[3];
    for (int i = 0; i < 3; ++i) {
        NEEDS_IDS(3 * (int64_t)1280 << 2 * i);
        loxo_soup soup = make(LOXO_SHAPE_ICOSPHERE, 10 * ((int64_t)64 << 2 * i) + 2);
        double *map = directions(&soup);
        boost(map, soup.n_vertices, 0.5);
        const loxo_sphere_map_measure m = measure(&soup, map);
        CHECK(m.degree == 1 && m.n_folds == 0);
        /* Areas are drawn out by (1 - w^2) / (1 -+ w)^2 at most, twice that in logs: 3, 1/3, squared, to O(h). */
        CHECK_NEAR(m.area_log.max, 2.0 * log(3.0), 0.2);
        mean[i] = m.angle_error_deg.mean;
        energy[i] = m.energy;
        loxo_release(test_context, map);
        loxo_soup_destroy(test_context, &soup);
    }
    for (int i = 1; i < 3; ++i) { /* O(h) and O(h^2), as in section 5.3 of the paper */
        CHECK_NEAR(mean[i - 1] / mean[i], 2.0, 0.05);
        CHECK_NEAR(energy[i - 1] / energy[i], 4.0, 0.2);
    }
}

TEST(a_mirror_turns_all_faces_over)
{
    loxo_soup soup = make(LOXO_SHAPE_ICOSPHERE, 642);
    double *map = directions(&soup);
    for (int64_t v = 0; v < soup.n_vertices; ++v)
        map[3 * v + 2] = -map[3 * v + 2];
    const loxo_sphere_map_measure m = measure(&soup, map);
    CHECK_EQUAL(m.degree, -1);
    CHECK_EQUAL(m.n_folds, soup.n_faces);
    CHECK_EQUAL(m.n_image_flat, 0);
    CHECK(m.energy < 1e-27 && m.beltrami.max < 1e-13 && m.angle_error_deg.max < 1e-12);
    CHECK_NEAR(m.image_area_signed, -m.image_area, 1e-12);
    CHECK_NEAR(m.energy_signed, 2.0 * m.image_area, 1e-12);
    loxo_release(test_context, map);
    loxo_soup_destroy(test_context, &soup);
}

static void check_near(const loxo_distribution *a, const loxo_distribution *b, double tolerance)
{
    CHECK_EQUAL(a->n, b->n);
    CHECK_NEAR(a->mean, b->mean, tolerance);
    CHECK_NEAR(a->sd, b->sd, tolerance);
    CHECK_NEAR(a->max, b->max, tolerance);
    /* Percentiles are middles of bins of one part in 2^20: numbers at a bin's end may go to the next. */
    const double bin = 2e-6 * a->max;
    CHECK_NEAR(a->median, b->median, bin);
    CHECK_NEAR(a->percentile_75, b->percentile_75, bin);
    CHECK_NEAR(a->percentile_95, b->percentile_95, bin);
    CHECK_NEAR(a->percentile_99, b->percentile_99, bin);
}

/* Rounding only: some 100 operations a face, angles of 0.1 and more. */
static void check_same(const loxo_sphere_map_measure *a, const loxo_sphere_map_measure *b)
{
    CHECK_NEAR(a->energy, b->energy, 1e-12);
    CHECK_NEAR(a->image_area, b->image_area, 1e-12);
    CHECK_EQUAL(a->n_folds, b->n_folds);
    CHECK_EQUAL(a->degree, b->degree);
    check_near(&a->angle_error_deg, &b->angle_error_deg, 1e-11);
    check_near(&a->beltrami, &b->beltrami, 1e-12);
    check_near(&a->area_log, &b->area_log, 1e-11);
}

static void turn(double *p, int64_t n)
{
    uint64_t count = 100;
    loxo_vec3 x, y;
    draw_plane(&count, &x, &y);
    const loxo_vec3 z = v3_cross(x, y);
    for (int64_t v = 0; v < n; ++v) {
        const loxo_vec3 q = v3_load(p + 3 * v);
        v3_store(p + 3 * v, (loxo_vec3){v3_dot(x, q), v3_dot(y, q), v3_dot(z, q)});
    }
}

TEST(size_and_place_do_not_matter)
{
    loxo_soup soup = make(LOXO_SHAPE_BUMPY, 2000);
    double *map = directions(&soup);
    const loxo_sphere_map_measure first = measure(&soup, map);
    CHECK(first.angle_error_deg.mean > 1.0);
    turn(map, soup.n_vertices);
    loxo_sphere_map_measure m = measure(&soup, map);
    check_same(&first, &m);
    turn(soup.position, soup.n_vertices);
    for (int i = 0; i < 2; ++i) {
        const double scale = i == 0 ? 1e30 : 1e-60;
        for (int64_t k = 0; k < 3 * soup.n_vertices; ++k)
            soup.position[k] *= scale;
        m = measure(&soup, map);
        check_same(&first, &m);
        CHECK_NEAR(m.area / (first.area * (i == 0 ? 1e60 : 1e-60)), 1.0, 1e-12);
    }
    loxo_release(test_context, map);
    loxo_soup_destroy(test_context, &soup);
}

/* All fields of a measure. */
typedef struct all_fields {
    double *array[6];
    loxo_sphere_map_fields fields;
} all_fields;

static all_fields fields_make(loxo_context *ctx, const loxo_soup *soup)
{
    all_fields all;
    const int64_t n[6] = {3 * soup->n_faces, 2 * soup->n_faces, soup->n_faces,
                          soup->n_vertices,  soup->n_vertices,  soup->n_vertices};
    for (int i = 0; i < 6; ++i)
        all.array[i] = loxo_allocate(ctx, n[i], sizeof(double));
    all.fields =
        (loxo_sphere_map_fields){all.array[0], all.array[1], all.array[2], all.array[3], all.array[4], all.array[5]};
    return all;
}

static void fields_free(loxo_context *ctx, all_fields *all)
{
    for (int i = 0; i < 6; ++i)
        loxo_release(ctx, all->array[i]);
}

TEST(numbers_of_vertices_do_not_matter)
{
    loxo_soup soup = make(LOXO_SHAPE_BUMPY, 2000);
    double *map = directions(&soup);
    all_fields first = fields_make(test_context, &soup), other = fields_make(test_context, &soup);
    loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    loxo_sphere_map_measure a, b;
    loxo_index *origin = NULL;
    CHECK_OK(loxo_measure_sphere_map(test_context, &arrays, map, &a, &first.fields));
    CHECK_OK(loxo_soup_shuffle(test_context, &soup, 5, &origin));
    double *moved = directions(&soup);
    arrays = loxo_soup_arrays(&soup);
    CHECK_OK(loxo_measure_sphere_map(test_context, &arrays, moved, &b, &other.fields));
    check_same(&a, &b);
    for (int64_t v = 0; v < soup.n_vertices; ++v)
        for (int i = 3; i < 6; ++i)
            CHECK_NEAR(other.array[i][v], first.array[i][origin[v]], 1e-12);
    loxo_release(test_context, origin);
    loxo_release(test_context, moved);
    loxo_release(test_context, map);
    fields_free(test_context, &first);
    fields_free(test_context, &other);
    loxo_soup_destroy(test_context, &soup);
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Against sums in long doubles and a sorted copy. */
static void check_distribution(const loxo_distribution *d, int64_t n, const double *value)
{
    double *sorted = malloc((size_t)n * sizeof *sorted);
    long double sum = 0.0L, squares = 0.0L;
    memcpy(sorted, value, (size_t)n * sizeof *sorted);
    qsort(sorted, (size_t)n, sizeof *sorted, by_size);
    for (int64_t i = 0; i < n; ++i)
        sum += (long double)value[i];
    const long double mean = sum / (long double)n;
    for (int64_t i = 0; i < n; ++i)
        squares += ((long double)value[i] - mean) * ((long double)value[i] - mean);
    const double most = sorted[n - 1], found[4] = {d->median, d->percentile_75, d->percentile_95, d->percentile_99};
    const int per_cent[4] = {50, 75, 95, 99};
    CHECK_EQUAL(d->n, n);
    CHECK_NEAR(d->mean, (double)mean, 1e-14 * most);
    CHECK_NEAR(d->sd, (double)sqrtl(squares / (long double)n), 1e-13 * most);
    CHECK_NEAR(d->max, most, 1e-14 * most);
    for (int i = 0; i < 4; ++i) { /* one part in 2^20 */
        const double exact = sorted[(n * per_cent[i] + 99) / 100 - 1];
        CHECK_NEAR(found[i], exact, 2e-6 * exact);
    }
    free(sorted);
}

TEST(distributions_and_averages_are_those_of_the_fields)
{
    loxo_soup soup = make(LOXO_SHAPE_BUMPY, 1500);
    double *map = directions(&soup);
    all_fields all = fields_make(test_context, &soup);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    const int64_t n = soup.n_vertices, n_faces = soup.n_faces;
    loxo_sphere_map_measure m;
    CHECK_OK(loxo_measure_sphere_map(test_context, &arrays, map, &m, &all.fields));
    double *size = malloc((size_t)n_faces * sizeof *size), *log_size = malloc((size_t)n_faces * sizeof *log_size);
    long double share = 0.0L;
    for (int64_t f = 0; f < n_faces; ++f) {
        const loxo_index *v = soup.triangle + 3 * f;
        size[f] = hypot(all.fields.face_beltrami[2 * f], all.fields.face_beltrami[2 * f + 1]);
        log_size[f] = fabs(all.fields.face_area_log[f]);
        const k_triangle face =
            k_triangle_of(v3_load(soup.position + 3 * (int64_t)v[0]), v3_load(soup.position + 3 * (int64_t)v[1]),
                          v3_load(soup.position + 3 * (int64_t)v[2]));
        share += (long double)(0.5 * face.twice_area / m.area * exp(all.fields.face_area_log[f]));
    }
    CHECK_NEAR((double)share, 1.0, 1e-12); /* the images' shares */
    check_distribution(&m.angle_error_deg, 3 * n_faces, all.fields.corner_angle_error_deg);
    check_distribution(&m.beltrami, n_faces, size);
    check_distribution(&m.area_log, n_faces, log_size);

    /* around vertices, and Gauss-Bonnet */
    double *sums = calloc((size_t)n * 3, sizeof *sums), curvature = 0.0;
    for (int64_t h = 0; h < 3 * n_faces; ++h) {
        double *s = sums + 3 * (int64_t)soup.triangle[h];
        s[0] += all.fields.corner_angle_error_deg[h];
        s[1] += size[h / 3];
        s[2] += 1.0;
    }
    for (int64_t v = 0; v < n; ++v) {
        CHECK_NEAR(all.fields.vertex_angle_error_deg[v], sums[3 * v] / sums[3 * v + 2], 1e-12);
        CHECK_NEAR(all.fields.vertex_beltrami[v], sums[3 * v + 1] / sums[3 * v + 2], 1e-13);
        curvature += all.fields.vertex_curvature_rad[v];
    }
    CHECK_NEAR(curvature, 4.0 * PI, 1e-11);
    free(sums);
    free(log_size);
    free(size);
    fields_free(test_context, &all);
    loxo_release(test_context, map);
    loxo_soup_destroy(test_context, &soup);
}

/* ---- folds ------------------------------------------------------------------------------------------------------ */

/* All but the faces around one vertex lie within 1e-9 of the south pole: the plane's coordinates of the stereographic map, times 1e-10.
 * Then every tenth vertex is moved across its neighbours in the plane. What is turned over there, by exact coordinates, is
 * what is turned over on the sphere. */
TEST(folds_are_counted_right_on_faces_of_area_1e_20)
{
    loxo_soup soup = make(LOXO_SHAPE_ICOSPHERE, 2562);
    const int64_t n = soup.n_vertices;
    double(*plane)[2] = malloc((size_t)n * sizeof *plane), *map = directions(&soup);
    int64_t top = 0, n_folds = 0, n_looked = 0;
    turn(map, n);
    for (int64_t v = 0; v < n; ++v)
        if (map[3 * v + 2] > map[3 * top + 2]) top = v;
    for (int64_t v = 0; v < n; ++v) {
        const double jump = v % 10 == 0 ? 0.12 : 0.0; /* edges are 0.07 at the south pole */
        plane[v][0] = map[3 * v] / (1.0 - map[3 * v + 2]) + jump;
        plane[v][1] = map[3 * v + 1] / (1.0 - map[3 * v + 2]);
        if (v == top) continue;
        const double x = 1e-10 * plane[v][0], y = 1e-10 * plane[v][1], t = 2.0 / (1.0 + x * x + y * y);
        map[3 * v] = t * x;
        map[3 * v + 1] = t * y;
        map[3 * v + 2] = 1.0 - t;
    }
    map[3 * top] = map[3 * top + 1] = 0.0;
    map[3 * top + 2] = 1.0;
    double least = 1.0;
    for (int64_t f = 0; f < soup.n_faces; ++f) {
        const loxo_index *v = soup.triangle + 3 * f;
        if (v[0] == top || v[1] == top || v[2] == top) continue;
        const double *a = plane[v[0]], *b = plane[v[1]], *c = plane[v[2]];
        const double area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
        /* The projection from the north pole, seen from there, keeps the sense of the sphere seen from within. */
        n_folds += area >= 0.0;
        n_looked += 1;
        least = fmin(least, 4e-20 * fabs(area));
    }
    CHECK(least < 1e-21 && n_looked > 5000 && n_folds > 200 && n_folds < n_looked / 2);
    const loxo_sphere_map_measure m = measure(&soup, map);
    CHECK_EQUAL(m.n_folds, n_folds);
    CHECK_EQUAL(m.n_image_flat, 0);
    CHECK_EQUAL(m.degree, 1);
    free(plane);
    loxo_release(test_context, map);
    loxo_soup_destroy(test_context, &soup);
}

TEST(flat_faces_are_counted_and_left_out)
{
    /* Whole coordinates, and halves of them: middles of edges are exact. Caps lie on an edge of the surface, but not in the image. */
    loxo_soup soup = shape_cube(test_context);
    for (int64_t i = 0; i < 3 * soup.n_vertices; ++i)
        soup.position[i] = 2.0 * soup.position[i] - 1.0;
    CHECK_OK(loxo_soup_subdivide(test_context, &soup, 3));
    const int64_t n_before = soup.n_faces;
    loxo_soup other = shape_copy(test_context, &soup);
    shape_add_caps(test_context, &soup, 40, 0.0);
    shape_add_caps(test_context, &other, 40, 0.3);
    double *map = directions(&other);
    const int64_t n_caps = (soup.n_faces - n_before) / 2;
    all_fields all = fields_make(test_context, &soup);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&soup);
    loxo_sphere_map_measure m;
    CHECK_OK(loxo_measure_sphere_map(test_context, &arrays, map, &m, &all.fields));
    CHECK_EQUAL(m.n_flat, n_caps);
    CHECK_EQUAL(m.angle_error_deg.n, 3 * (soup.n_faces - n_caps));
    CHECK_EQUAL(m.beltrami.n, soup.n_faces - n_caps);
    CHECK_EQUAL(m.area_log.n, soup.n_faces - n_caps);
    CHECK(m.n_folds == 0 && m.degree == 1 && isfinite(m.energy) && isfinite(m.angle_error_deg.mean));
    int64_t n_nan = 0;
    for (int64_t f = 0; f < soup.n_faces; ++f)
        n_nan += isnan(all.fields.face_beltrami[2 * f]) && isnan(all.fields.corner_angle_error_deg[3 * f + 2]);
    CHECK_EQUAL(n_nan, n_caps);
    for (int64_t v = 0; v < soup.n_vertices; ++v)
        CHECK(isfinite(all.fields.vertex_angle_error_deg[v]));
    fields_free(test_context, &all);
    loxo_release(test_context, map);
    loxo_soup_destroy(test_context, &other);
    loxo_soup_destroy(test_context, &soup);
}

TEST(a_map_to_one_point)
{
    loxo_soup soup = make(LOXO_SHAPE_ICOSPHERE, 42);
    double *map = directions(&soup);
    for (int64_t v = 1; v < soup.n_vertices; ++v)
        memcpy(map + 3 * v, map, 3 * sizeof *map);
    const loxo_sphere_map_measure m = measure(&soup, map);
    CHECK_EQUAL(m.degree, 0);
    CHECK_EQUAL(m.n_folds, soup.n_faces);
    CHECK_EQUAL(m.n_image_flat, soup.n_faces);
    CHECK_EQUAL(m.energy, 0.0);
    CHECK_EQUAL(m.beltrami.mean, 1.0);
    CHECK_NEAR(m.angle_error_deg.mean, 30.0, 1e-12); /* of 90, 90, 90 */
    CHECK(m.area_log.n == 0 && isnan(m.area_log.mean) && isnan(m.area_log.sd) && isnan(m.area_log.max));
    loxo_release(test_context, map);
    loxo_soup_destroy(test_context, &soup);
}

/* ---- contexts --------------------------------------------------------------------------------------------------- */

typedef struct sample {
    loxo_soup soup;
    double *map;
} sample;

static uint64_t hash_measure(loxo_context *ctx, const void *arg)
{
    const sample *s = arg;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&s->soup);
    all_fields all = fields_make(ctx, &s->soup);
    loxo_sphere_map_measure m;
    CHECK_STATUS(ctx, loxo_measure_sphere_map(ctx, &arrays, s->map, &m, &all.fields), LOXO_OK);
    uint64_t hash = test_hash(&m.area, sizeof m - offsetof(loxo_sphere_map_measure, area));
    const int64_t n[6] = {3 * s->soup.n_faces, 2 * s->soup.n_faces, s->soup.n_faces,
                          s->soup.n_vertices,  s->soup.n_vertices,  s->soup.n_vertices};
    for (int i = 0; i < 6; ++i)
        hash = 31 * hash + test_hash(all.array[i], (size_t)n[i] * sizeof(double));
    fields_free(ctx, &all);
    return hash;
}

static sample sample_make(int64_t n_vertices)
{
    sample s = {.soup = make(LOXO_SHAPE_BUMPY, n_vertices)};
    CHECK_OK(loxo_soup_shuffle(test_context, &s.soup, 3, NULL)); /* threads meet at every block of faces */
    s.map = directions(&s.soup);
    return s;
}

static void sample_free(sample *s)
{
    loxo_release(test_context, s->map);
    loxo_soup_destroy(test_context, &s->soup);
}

TEST(threads_do_not_matter)
{
    NEEDS_IDS(60000);
    sample s = sample_make(10000);
    test_same_for_any_threads(hash_measure, &s);
    sample_free(&s);
}

static loxo_status measure_once(loxo_context *ctx, void *arg)
{
    const sample *s = arg;
    const loxo_mesh_arrays arrays = loxo_soup_arrays(&s->soup);
    loxo_sphere_map_measure m;
    double *curvature = loxo_allocate(ctx, s->soup.n_vertices, sizeof *curvature);
    if (curvature == NULL) return LOXO_ERR_MEMORY;
    const loxo_sphere_map_fields fields = {.vertex_curvature_rad = curvature};
    const loxo_status status = loxo_measure_sphere_map(ctx, &arrays, s->map, &m, &fields);
    loxo_release(ctx, curvature);
    return status;
}

TEST(every_allocation_may_fail)
{
    sample s = sample_make(5000);
    CHECK(test_each_allocation_fails(measure_once, &s) >= 6);
    sample_free(&s);
}

TEST(the_monitor_stops_it)
{
    sample s = sample_make(300);
    int stop_at = 1;
    for (;; ++stop_at) {
        stopper w;
        stopper_begin(&w, test_context, stop_at);
        const loxo_status status = measure_once(test_context, &s);
        stopper_end(&w);
        if (status == LOXO_OK) break;
        CHECK_EQUAL(status, LOXO_ERR_STOPPED);
    }
    CHECK(stop_at == 5); /* before each kind of numbers, and the fields */
    sample_free(&s);
}

TEST(what_is_no_map_of_a_closed_surface_is_refused)
{
    sample s = sample_make(300);
    loxo_mesh_arrays arrays = loxo_soup_arrays(&s.soup);
    loxo_sphere_map_measure m = {.n_faces = -1};
    loxo_index *t = s.soup.triangle, swap;
#define CHECK_REFUSED(expected)                                                                                        \
    CHECK_STATUS(test_context, loxo_measure_sphere_map(test_context, &arrays, s.map, &m, NULL), (expected))
    arrays.n_faces -= 1;
    CHECK_REFUSED(LOXO_ERR_MESH);
    CHECK_TEXT(loxo_context_failure(test_context)->text,
               "measure: the surface is open: 3 boundary edges, Euler characteristic 1");
    arrays.n_faces = 0;
    CHECK_REFUSED(LOXO_ERR_MESH);
    arrays = loxo_soup_arrays(&s.soup);
    swap = t[4], t[4] = t[5], t[5] = swap;
    CHECK_REFUSED(LOXO_ERR_MESH);
    CHECK_TEXT(loxo_context_failure(test_context)->text,
               "measure: neighbouring faces of the surface are not oriented alike");
    swap = t[4], t[4] = t[5], t[5] = swap;
    swap = t[7], t[7] = (loxo_index)s.soup.n_vertices;
    CHECK_REFUSED(LOXO_ERR_MALFORMED);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 2);
    t[7] = swap;
    const int64_t last = s.soup.n_vertices - 1;
    const double x = s.map[3 * last];
    s.map[3 * last] += 1e-4;
    CHECK_REFUSED(LOXO_ERR_MESH);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, last);
    s.map[3 * last] = (double)NAN;
    CHECK_REFUSED(LOXO_ERR_MESH);
    s.map[3 * last] = x;
    s.soup.position[7] = INFINITY;
    CHECK_REFUSED(LOXO_ERR_MALFORMED);
    s.soup.position[7] = 1e200;
    CHECK_REFUSED(LOXO_ERR_NUMERIC);
    memset(s.soup.position, 0, (size_t)(3 * s.soup.n_vertices) * sizeof(double));
    CHECK_REFUSED(LOXO_ERR_MESH);
#undef CHECK_REFUSED
    CHECK_STATUS(test_context, loxo_measure_sphere_map(test_context, &arrays, NULL, &m, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_measure_sphere_map(test_context, NULL, s.map, &m, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_measure_sphere_map(test_context, &arrays, s.map, NULL, NULL), LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(m.n_faces, -1);
    sample_free(&s);
}

/* Rays from the middle of a torus meet it twice or not at all. */
TEST(any_genus_will_do)
{
    loxo_soup soup = shape_torus(test_context, 40, 20);
    double *map = directions(&soup);
    const loxo_sphere_map_measure m = measure(&soup, map);
    CHECK_EQUAL(m.degree, 0);
    CHECK(m.n_folds > 0 && m.n_folds < m.n_faces);
    loxo_release(test_context, map);
    loxo_soup_destroy(test_context, &soup);
}

TEST(vertices_without_faces_are_left_alone)
{
    sample s = sample_make(300);
    const int64_t n = s.soup.n_vertices;
    double *position = loxo_allocate(test_context, 3 * (n + 1), sizeof *position);
    double *map = loxo_allocate(test_context, 3 * (n + 1), sizeof *map);
    double *mean = loxo_allocate(test_context, n + 1, sizeof *mean);
    memcpy(position, s.soup.position, (size_t)(3 * n) * sizeof *position);
    memcpy(map, s.map, (size_t)(3 * n) * sizeof *map);
    for (int k = 0; k < 3; ++k) {
        position[3 * n + k] = 1.0;
        map[3 * n + k] = (double)NAN;
    }
    const loxo_mesh_arrays arrays = {
        .n_vertices = n + 1, .n_faces = s.soup.n_faces, .position = position, .triangle = s.soup.triangle};
    const loxo_sphere_map_fields fields = {.vertex_angle_error_deg = mean};
    loxo_sphere_map_measure m;
    const loxo_sphere_map_measure before = measure(&s.soup, s.map);
    CHECK_OK(loxo_measure_sphere_map(test_context, &arrays, map, &m, &fields));
    CHECK_EQUAL(m.energy, before.energy);
    CHECK(isnan(mean[n]) && isfinite(mean[n - 1]));
    loxo_release(test_context, mean);
    loxo_release(test_context, map);
    loxo_release(test_context, position);
    sample_free(&s);
}
