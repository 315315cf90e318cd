/* SPDX-License-Identifier: MIT
 * Landmarks of two surfaces, paired by name and cut to the same number of points.
 *
 * Between two points of a curve the surface says nothing of its way. It is taken to be what the map makes of the great circle between
 * their images: points of it lie on the surface, whatever folds it has, at the cost of asking the map's inverse. How far along a curve a
 * point is, is told by the lengths of the straight lines between its own points in space. */
#include "base/allocate.h"
#include "base/context.h"
#include "base/sort.h"
#include "kernel/conformal_kernel.h"
#include "solver/sphere/register_internal.h"

#include <inttypes.h>
#include <string.h>

double *register_positions(loxo_context *ctx, const loxo_mesh *mesh, const loxo_index *order)
{
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    const int64_t n = loxo_mesh_n_vertices(mesh);
    double *position = loxo_allocate(ctx, 3 * n, sizeof *position);
    if (position == NULL) return NULL;
    for (int64_t i = 0; i < n; ++i)
        v3_store(&position[3 * i], order[i] >= 0 ? k_position(&m, order[i]) : (loxo_vec3){0.0, 0.0, 0.0});
    return position;
}

/* ---- one curve ----------------------------------------------------------------------------------------------- */

static loxo_vec3 at_point(const loxo_surface_point *point, const double *x)
{
    loxo_vec3 sum = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; ++k)
        if (point->vertex[k] >= 0) sum = v3_axpy(sum, point->weight[k], v3_load(&x[3 * (int64_t)point->vertex[k]]));
    return sum;
}

typedef struct curve {
    const register_side *side;
    int64_t begin, n; /* points */
    bool is_closed;
} curve;

static curve curve_of(const register_side *side, int64_t i)
{
    const loxo_landmarks *l = side->landmarks;
    return (curve){side, l->curve_begin[i], l->curve_begin[i + 1] - l->curve_begin[i], l->is_closed[i]};
}

static const loxo_surface_point *curve_point(const curve *c, int64_t i)
{
    return &c->side->landmarks->point[c->begin + i % c->n];
}

static int64_t n_segments(const curve *c) { return c->is_closed ? c->n : c->n - 1; }

static double segment_length(const curve *c, int64_t i)
{
    const loxo_vec3 a = at_point(curve_point(c, i), c->side->position);
    return v3_norm(v3_sub(at_point(curve_point(c, i + 1), c->side->position), a));
}

/* On the great circle from the direction of a to that of b, at t of the angle: (sin((1 - t) w) a + sin(t w) b) / sin w. */
static loxo_vec3 on_great_circle(loxo_vec3 a, loxo_vec3 b, double t)
{
    const loxo_vec3 p = v3_scale(1.0 / v3_norm(a), a), q = v3_scale(1.0 / v3_norm(b), b);
    const double w = 2.0 * asin(fmin(0.5 * v3_norm(v3_sub(q, p)), 1.0)), sine = sin(w);
    if (!(sine > 1e-8))
        return v3_axpy(p, t, v3_sub(q, p)); /* one place, or opposite ones, between which any way will do */
    return v3_axpy(v3_scale(sin((1.0 - t) * w) / sine, p), sin(t * w) / sine, q);
}

/* Directions of n points, evenly spaced in length, ends included where it has ends. */
static void sample(const curve *c, int64_t n, double (*direction)[3])
{
    double total = 0.0, before = 0.0;
    int64_t segment = 0;
    for (int64_t i = 0; i < n_segments(c); ++i)
        total += segment_length(c, i);
    double length = segment_length(c, 0);
    for (int64_t i = 0; i < n; ++i) {
        const double n_steps = (double)(c->is_closed || n == 1 ? n : n - 1);
        const double s = n == 1 && !c->is_closed ? 0.5 * total : total * ((double)i / n_steps);
        while (segment + 1 < n_segments(c) && s > before + length) {
            before += length;
            length = segment_length(c, ++segment);
        }
        const double t = length > 0.0 ? fmin((s - before) / length, 1.0) : 0.0;
        const loxo_vec3 a = at_point(curve_point(c, segment), c->side->map);
        const loxo_vec3 b = at_point(curve_point(c, segment + 1), c->side->map);
        v3_store(direction[i], on_great_circle(a, b, t));
    }
}

/* n points of a curve; its own where it has as many and is not to be cut anew. */
static loxo_status take_points(const curve *c, int64_t n, bool is_sampled, double (*direction)[3],
                               loxo_surface_point *point)
{
    if (is_sampled && c->n > 1) {
        sample(c, n, direction);
        return loxo_sphere_locate(c->side->locator, n, direction[0], point, NULL);
    }
    memcpy(point, curve_point(c, 0), (size_t)n * sizeof *point);
    return LOXO_OK;
}

/* ---- pairs --------------------------------------------------------------------------------------------------- */

typedef struct named_curve {
    const char *name;
    int64_t i;
} named_curve;

static bool is_less(const void *arg, const void *a, const void *b)
{
    const named_curve *x = a, *y = b;
    const int order = strcmp(x->name, y->name);
    (void)arg;
    return order < 0 || (order == 0 && x->i < y->i);
}

/* By name, those of one name as they stand; NULL: no memory. */
static named_curve *sort_curves(const register_side *side)
{
    const loxo_landmarks *l = side->landmarks;
    named_curve *sorted = loxo_allocate(side->ctx, l->n_curves, sizeof *sorted);
    if (sorted == NULL) return NULL;
    for (int64_t i = 0; i < l->n_curves; ++i)
        sorted[i] = (named_curve){l->name[i], i};
    loxo_sort(sorted, l->n_curves, sizeof *sorted, is_less, NULL);
    return sorted;
}

/* How many points a pair of curves gets, and whether they are cut anew. */
static loxo_status count_points(const curve *a, const curve *b, const char *name, int64_t n_samples, int64_t *n,
                                bool *is_sampled)
{
    if ((a->n == 1) != (b->n == 1) || a->is_closed != b->is_closed)
        return loxo_fail(a->side->ctx, LOXO_ERR_ARGUMENT,
                         "register: \"%s\" is %s of the fixed surface and %s of the moving one", name,
                         a->n == 1      ? "a point"
                         : a->is_closed ? "a closed curve"
                                        : "an open curve",
                         b->n == 1      ? "a point"
                         : b->is_closed ? "a closed curve"
                                        : "an open curve");
    *is_sampled = a->n > 1 && (n_samples > 0 || a->n != b->n);
    *n = a->n == 1 ? 1 : n_samples > 0 ? n_samples : a->n > b->n ? a->n : b->n;
    return LOXO_OK;
}

typedef struct curve_pair {
    curve fixed, moving;
    int64_t n;
    bool is_sampled;
} curve_pair;

static loxo_status add_pair(const register_side *fixed, const register_side *moving, const named_curve *f,
                            const named_curve *m, int64_t n_samples, register_pairs *pairs, curve_pair *found)
{
    curve_pair *pair = &found[pairs->n_curves++];
    *pair = (curve_pair){.fixed = curve_of(fixed, f->i), .moving = curve_of(moving, m->i)};
    const loxo_status status =
        count_points(&pair->fixed, &pair->moving, f->name, n_samples, &pair->n, &pair->is_sampled);
    pairs->n += pair->n;
    return status;
}

/* Walks along both sorted lists. */
static loxo_status find_pairs(const register_side *fixed, const register_side *moving, int64_t n_samples,
                              register_pairs *pairs, curve_pair *found)
{
    const int64_t n_fixed = fixed->landmarks->n_curves, n_moving = moving->landmarks->n_curves;
    named_curve *f = sort_curves(fixed), *m = sort_curves(moving);
    loxo_status status = f == NULL || m == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    for (int64_t i = 0, k = 0; i < n_fixed && k < n_moving && status >= 0;) {
        const int order = strcmp(f[i].name, m[k].name);
        if (order == 0) status = add_pair(fixed, moving, &f[i], &m[k], n_samples, pairs, found);
        i += order <= 0;
        k += order >= 0;
    }
    loxo_release(fixed->ctx, m);
    loxo_release(fixed->ctx, f);
    if (status < 0) return status;
    pairs->n_unpaired = n_fixed + n_moving - 2 * pairs->n_curves;
    if (pairs->n_curves > 0) return LOXO_OK;
    return loxo_fail(fixed->ctx, LOXO_ERR_ARGUMENT,
                     "register: no landmark of the moving surface has the name of one of the fixed surface");
}

loxo_status register_pair(const register_side *fixed, const register_side *moving, int64_t n_samples,
                          register_pairs *pairs)
{
    loxo_context *ctx = fixed->ctx;
    int64_t most = 0, at = 0;
    double(*direction)[3] = NULL;
    *pairs = (register_pairs){0};
    curve_pair *found = loxo_allocate(ctx, fixed->landmarks->n_curves, sizeof *found);
    if (found == NULL) return LOXO_ERR_MEMORY;
    loxo_status status = find_pairs(fixed, moving, n_samples, pairs, found);
    if (status < 0) goto done;
    for (int64_t i = 0; i < pairs->n_curves; ++i)
        most = found[i].n > most ? found[i].n : most;
    status = LOXO_ERR_MEMORY;
    direction = loxo_allocate(ctx, most, sizeof *direction);
    pairs->fixed = loxo_allocate(ctx, pairs->n, sizeof *pairs->fixed);
    pairs->moving = loxo_allocate(ctx, pairs->n, sizeof *pairs->moving);
    if (direction == NULL || pairs->fixed == NULL || pairs->moving == NULL) goto done;
    status = LOXO_OK;
    for (int64_t i = 0; i < pairs->n_curves && status >= 0; ++i) {
        const curve_pair *p = &found[i];
        status = take_points(&p->fixed, p->n, p->is_sampled, direction, &pairs->fixed[at]);
        if (status >= 0) status = take_points(&p->moving, p->n, p->is_sampled, direction, &pairs->moving[at]);
        at += p->n;
    }
    if (pairs->n_unpaired > 0)
        loxo_warn(ctx, "register-unpaired", pairs->n_unpaired,
                  "%" PRId64 " landmarks or curves have no partner of their name on the other surface: left out",
                  pairs->n_unpaired);
done:
    loxo_release(ctx, direction);
    loxo_release(ctx, found);
    return status;
}

void register_pairs_destroy(loxo_context *ctx, register_pairs *pairs)
{
    loxo_release(ctx, pairs->fixed);
    loxo_release(ctx, pairs->moving);
    *pairs = (register_pairs){0};
}
