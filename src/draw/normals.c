/* SPDX-License-Identifier: MIT
 * Vertex normals in 8 bytes a vertex. Faces add to their corners, several threads at once, so the sums are whole numbers:
 * these come out the same in any order. One 64-bit addition adds three fields of 21 bits; the borrow of a negative field
 * is undone when the sum is read. */
#include "draw/scene.h"
#include "par/range.h"

#include <math.h>

#define FIELD_BITS 21
/* A field holds +-2^20 of these: corners of 128 rad in all, 20 times a flat vertex's. More (hundreds of faces at one
 * vertex) wraps around: that vertex alone is shaded wrongly. */
#define UNITS_PER_RADIAN 8192.0

/* |error| < 7e-5; source  Abramowitz, Stegun 1964, Handbook of Mathematical Functions, 4.4.45 */
static double fast_acos(double x)
{
    const double a = fabs(x), s = sqrt(fmax(1.0 - a, 0.0));
    const double y = s * (1.5707288 + a * (-0.2121144 + a * (0.0742610 - 0.0187293 * a)));
    return x < 0.0 ? 3.14159265358979 - y : y;
}

static uint64_t pack(const double n[3])
{
    return (uint64_t)llrint(n[0]) + ((uint64_t)llrint(n[1]) << FIELD_BITS) +
           ((uint64_t)llrint(n[2]) << (2 * FIELD_BITS));
}

static int64_t unpack_field(uint64_t *packed, int bits)
{
    const int64_t field = (int64_t)(*packed << (64 - bits)) >> (64 - bits);
    *packed = (*packed - (uint64_t)field) >> bits;
    return field;
}

bool loxo_draw_vertex_normal(const loxo_draw_scene *scene, int64_t v, double normal[3])
{
    uint64_t packed = scene->normal[v];
    for (int k = 0; k < 2; ++k)
        normal[k] = (double)unpack_field(&packed, FIELD_BITS);
    normal[2] = (double)unpack_field(&packed, 64 - 2 * FIELD_BITS);
    const double length = sqrt(loxo_draw_dot(normal, normal));
    if (!(length > 16.0)) return false; /* nothing, or faces that cancel each other */
    for (int k = 0; k < 3; ++k)
        normal[k] /= length;
    return true;
}

static void add_face(const loxo_draw_scene *scene, int64_t f, bool is_shared)
{
    const loxo_index *v = &scene->mesh->triangle[3 * f];
    double p[3][3], edge[3][3], length[3], normal[3];
    for (int c = 0; c < 3; ++c) {
        if (!(scene->inverse_depth[v[c]] > 0.0F)) return;
        loxo_draw_unit_point(scene, v[c], p[c]);
    }
    for (int c = 0; c < 3; ++c) { /* edge c: from corner c to the next */
        for (int k = 0; k < 3; ++k)
            edge[c][k] = p[(c + 1) % 3][k] - p[c][k];
        length[c] = sqrt(loxo_draw_dot(edge[c], edge[c]));
    }
    loxo_draw_cross(edge[0], edge[1], normal);
    const double area = sqrt(loxo_draw_dot(normal, normal));
    if (!(area > 0.0)) return;
    for (int c = 0; c < 3; ++c) {
        const int before = (c + 2) % 3;
        const double cosine = -loxo_draw_dot(edge[c], edge[before]) / (length[c] * length[before]);
        const double weight = UNITS_PER_RADIAN * fast_acos(fmin(fmax(cosine, -1.0), 1.0)) / area;
        const double n[3] = {weight * normal[0], weight * normal[1], weight * normal[2]};
        uint64_t *sum = &scene->normal[v[c]];
        if (is_shared)
            __atomic_fetch_add(sum, pack(n), __ATOMIC_RELAXED);
        else
            *sum += pack(n);
    }
}

/* Vector area (0 for a closed surface), area, and volume, each times 2, 2 and 6. */
static void add_volume(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const loxo_draw_scene *scene = arg;
    for (int64_t f = begin; f < end; ++f) {
        const loxo_index *v = &scene->mesh->triangle[3 * f];
        double p[3][3], a[3], b[3], normal[3];
        bool is_good = true;
        for (int c = 0; c < 3; ++c) {
            is_good = is_good && scene->inverse_depth[v[c]] > 0.0F;
            loxo_draw_unit_point(scene, v[c], p[c]);
        }
        if (!is_good) continue;
        for (int k = 0; k < 3; ++k)
            a[k] = p[1][k] - p[0][k], b[k] = p[2][k] - p[0][k];
        loxo_draw_cross(a, b, normal);
        for (int k = 0; k < 3; ++k)
            sums[k] += normal[k];
        sums[3] += sqrt(loxo_draw_dot(normal, normal));
        sums[4] += loxo_draw_dot(p[0], normal);
    }
}

loxo_status loxo_draw_sum_normals(loxo_context *ctx, loxo_draw_scene *scene)
{
    const int64_t n = scene->mesh->n_faces;
    const int64_t block = (int64_t)1 << 22; /* between two looks at the monitor */
    for (int64_t begin = 0; begin < n; begin += block) {
        const int64_t count = n - begin < block ? n - begin : block;
        const int n_threads = loxo_threads_for(ctx, count, 60.0);
#pragma omp parallel num_threads(n_threads)
        {
            const loxo_range r = loxo_thread_range(count);
            for (int64_t f = begin + r.begin; f < begin + r.end; ++f)
                add_face(scene, f, n_threads > 1);
        }
        if (loxo_stop_wanted(ctx, "draw", 0.2 + 0.2 * (double)(begin + count) / (double)n)) return LOXO_ERR_STOPPED;
    }
    double sums[5];
    const loxo_status status = loxo_sum(ctx, n, 5, add_volume, scene, sums);
    if (status < 0) return status;
    scene->inside_out = sqrt(loxo_draw_dot(sums, sums)) < 1e-6 * sums[3] && sums[4] < 0.0;
    return LOXO_OK;
}
