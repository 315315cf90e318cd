/* SPDX-License-Identifier: MIT
 * The extension of a map of the sphere to the ball: faces cut into pieces that are small as seen from z, six nodes in each, and the
 * conformal barycenter of their images. EXTENSION.md, «Maps of the sphere». */
#include "base/allocate.h"
#include "base/context.h"
#include "base/options.h"
#include "base/os.h"
#include "kernel/ball_kernel.h"
#include "par/range.h"
#include "solver/barycenter/search_options.h"

#include <loxo/barycenter.h>
#include <loxo/extension.h>

#include <inttypes.h>
#include <string.h>

#define PI          3.14159265358979323846
#define OFF_SPHERE  1e-6
#define OUTSIDE     1e-12
#define ON_SPHERE   4e-16 /* as of the circle */
#define OFF_COVER   1e-9  /* of 4 pi */
#define MOST_LEVELS 60
#define IMAGE_SIDE  0.5 /* longest side of a piece's image */
#define N_NODES     6

loxo_sphere_extension_settings loxo_sphere_extension_settings_default(void)
{
    return (loxo_sphere_extension_settings){.piece = 0.5, .tolerance = 1e-8, .max_iterations = 50};
}

#define FIELD(name) offsetof(loxo_sphere_extension_settings, name)

const loxo_option loxo_sphere_extension_options[] = {
    {.name = "piece",
     .type = LOXO_OPTION_DOUBLE,
     .offset = FIELD(piece),
     .min = 1e-3,
     .max = 4.0,
     .help = "longest side of a piece of a face over its distance from the point"},
    SEARCH_TOLERANCE(loxo_sphere_extension_settings, "hyperbolic distance from the nodes' barycenter"),
    {.name = "max-iterations",
     .type = LOXO_OPTION_INT64,
     .offset = FIELD(max_iterations),
     .min = 1.0,
     .max = 1e6,
     .help = "most steps for a point"},
    {.name = NULL}};

/* Strang and Fix's rule of degree 4 on a triangle. */
static const double node_at[2] = {0.091576213509770743460, 0.44594849091596488632};
static const double node_share[2] = {0.10995174365532186764, 0.22338158967801146570};

/* A corner of a piece, by its face's corners. */
typedef struct corner {
    double share[3];
} corner;

typedef struct piece {
    corner at[3];
    int level;
} piece;

/* The map with its vertices on the spheres, and the point that it is seen from. */
typedef struct seen {
    const loxo_sphere_map *map;
    const double *x, *y;
    double z[3], co, longest; /* longest: settings.piece */
} seen;

static double apart(const double *a, const double *b, int d)
{
    double square = 0.0;
    for (int k = 0; k < d; ++k)
        square += (a[k] - b[k]) * (a[k] - b[k]);
    return sqrt(square);
}

static void combine(const loxo_index *v, const double *point, int d, const corner *at, double *out)
{
    for (int k = 0; k < d; ++k)
        out[k] = at->share[0] * point[(int64_t)v[0] * d + k] + at->share[1] * point[(int64_t)v[1] * d + k] +
                 at->share[2] * point[(int64_t)v[2] * d + k];
}

static void project(int d, double *x)
{
    const double norm = sqrt(k_ball_dot(d, x, x));
    for (int k = 0; k < d; ++k)
        x[k] = norm > 0.0 ? x[k] / norm : 0.0;
}

static corner middle(const corner *a, const corner *b)
{
    corner m;
    for (int k = 0; k < 3; ++k)
        m.share[k] = 0.5 * (a->share[k] + b->share[k]);
    return m;
}

/* Whether nodes in it will do. */
static bool is_small(const seen *s, const loxo_index *v, const piece *p)
{
    double x[3][3], centre[3], side = 0.0, image = 0.0, y[3][LOXO_MOEBIUS_MOST_DIMENSIONS];
    const int d = s->map->d;
    if (p->level == MOST_LEVELS) return true;
    for (int i = 0; i < 3; ++i) {
        combine(v, s->x, 3, &p->at[i], x[i]);
        combine(v, s->y, d, &p->at[i], y[i]);
        project(d, y[i]);
    }
    for (int i = 0; i < 3; ++i) {
        side = fmax(side, apart(x[i], x[i == 2 ? 0 : i + 1], 3));
        image = fmax(image, apart(y[i], y[i == 2 ? 0 : i + 1], d));
        centre[i] = (x[0][i] + x[1][i] + x[2][i]) / 3.0;
    }
    project(3, centre);
    return side <= s->longest * apart(centre, s->z, 3) && (image <= IMAGE_SIDE || side <= 1e-6);
}

/* Its six nodes: images and their harmonic measure. */
static void put_nodes(const seen *s, const loxo_index *v, const piece *p, double *atom, double *weight)
{
    const int d = s->map->d;
    double x[3][3], ab[3], ac[3], normal[3];
    for (int i = 0; i < 3; ++i)
        combine(v, s->x, 3, &p->at[i], x[i]);
    for (int k = 0; k < 3; ++k) {
        ab[k] = x[1][k] - x[0][k];
        ac[k] = x[2][k] - x[0][k];
    }
    normal[0] = ab[1] * ac[2] - ab[2] * ac[1];
    normal[1] = ab[2] * ac[0] - ab[0] * ac[2];
    normal[2] = ab[0] * ac[1] - ab[1] * ac[0];
    const double volume = 0.5 * fabs(k_ball_dot(3, normal, x[0])); /* area times the distance of its plane */
    const double *same = s->y + (int64_t)v[0] * d;
    const bool is_rest = memcmp(same, s->y + (int64_t)v[1] * d, (size_t)d * sizeof *same) == 0 &&
                         memcmp(same, s->y + (int64_t)v[2] * d, (size_t)d * sizeof *same) == 0;
    for (int i = 0; i < N_NODES; ++i) {
        const double a = node_at[i / 3];
        corner at;
        double here[3];
        for (int k = 0; k < 3; ++k) { /* corner i % 3 has 1 - 2 a, the others a */
            at.share[k] = a * (p->at[0].share[k] + p->at[1].share[k] + p->at[2].share[k]) +
                          (1.0 - 3.0 * a) * p->at[i % 3].share[k];
        }
        combine(v, s->x, 3, &at, here);
        const double square = k_ball_dot(3, here, here);
        project(3, here);
        const double far = apart(here, s->z, 3), poisson = s->co / (far * far);
        weight[i] = node_share[i / 3] * volume / (square * sqrt(square)) * poisson * poisson;
        if (is_rest) {
            memcpy(atom + (ptrdiff_t)i * d, same, (size_t)d * sizeof *same);
        } else {
            combine(v, s->y, d, &at, atom + (ptrdiff_t)i * d);
            project(d, atom + (ptrdiff_t)i * d);
        }
    }
}

/* Cuts a face; nodes go to atom and weight where those are given. Returns the number of pieces. */
static int64_t cut_face(const seen *s, int64_t face, double *atom, double *weight)
{
    const loxo_index *v = s->map->triangle + 3 * face;
    piece stack[3 * MOST_LEVELS + 4];
    int n_stack = 1;
    int64_t n_pieces = 0;
    stack[0] = (piece){.at = {{{1.0, 0.0, 0.0}}, {{0.0, 1.0, 0.0}}, {{0.0, 0.0, 1.0}}}};
    while (n_stack > 0) {
        const piece p = stack[--n_stack];
        if (is_small(s, v, &p)) {
            if (atom != NULL) put_nodes(s, v, &p, atom + n_pieces * N_NODES * s->map->d, weight + n_pieces * N_NODES);
            ++n_pieces;
            continue;
        }
        const corner ab = middle(&p.at[0], &p.at[1]), bc = middle(&p.at[1], &p.at[2]), ca = middle(&p.at[2], &p.at[0]);
        stack[n_stack++] = (piece){{p.at[0], ab, ca}, p.level + 1};
        stack[n_stack++] = (piece){{ab, p.at[1], bc}, p.level + 1};
        stack[n_stack++] = (piece){{ca, bc, p.at[2]}, p.level + 1};
        stack[n_stack++] = (piece){{ab, bc, ca}, p.level + 1};
    }
    return n_pieces;
}

/* ---- checks ---------------------------------------------------------------------------------------------------- */

static loxo_status copy_units(loxo_context *ctx, const char *what, int64_t n, int d, const double *from, double *to)
{
    for (int64_t i = 0; i < n; ++i) {
        const double norm = sqrt(k_ball_dot(d, from + i * d, from + i * d)), away = fabs(norm - 1.0);
        if (!(away <= OFF_SPHERE))
            return loxo_fail_at(ctx, LOXO_ERR_MESH, (loxo_place){.byte = -1, .element = i},
                                "extension: %s of vertex %" PRId64 " is not on the unit sphere within 1e-6", what, i);
        for (int k = 0; k < d; ++k)
            to[i * d + k] = away <= 2.3e-16 ? from[i * d + k] : from[i * d + k] / norm;
    }
    return LOXO_OK;
}

/* Solid angle of a face, signed. */
static double solid_angle(const double *a, const double *b, const double *c)
{
    const double det =
        a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
    return 2.0 * atan2(det, 1.0 + k_ball_dot(3, a, b) + k_ball_dot(3, b, c) + k_ball_dot(3, c, a));
}

/* One sign, and 4 pi together. */
static loxo_status check_cover(loxo_context *ctx, const loxo_sphere_map *map, const double *x)
{
    double sum = 0.0, sizes = 0.0;
    for (int64_t f = 0; f < map->n_faces; ++f) {
        const loxo_index *v = map->triangle + 3 * f;
        for (int k = 0; k < 3; ++k)
            if (v[k] < 0 || v[k] >= map->n_vertices)
                return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.byte = -1, .element = f},
                                    "face %" PRId64 ": a vertex number is not in 0..%" PRId64, f, map->n_vertices - 1);
        const double angle = solid_angle(x + 3 * (int64_t)v[0], x + 3 * (int64_t)v[1], x + 3 * (int64_t)v[2]);
        sum += angle;
        sizes += fabs(angle);
    }
    if (fabs(fabs(sum) / (4.0 * PI) - 1.0) <= OFF_COVER && sizes - fabs(sum) <= 4.0 * PI * OFF_COVER) return LOXO_OK;
    return loxo_fail(ctx, LOXO_ERR_MESH,
                     "extension: the faces cover %.6g of the sphere, %.6g with their orientation; it has to be once",
                     sizes / (4.0 * PI), sum / (4.0 * PI));
}

static double co_of(const double *z, const double *co)
{
    const double radius = sqrt(k_ball_dot(3, z, z));
    if (co != NULL) return *co;
    return fabs(1.0 - radius) <= ON_SPHERE ? 0.0 : (1.0 - radius) * (1.0 + radius);
}

static loxo_status check_points(loxo_context *ctx, int64_t n, const double *z, const double *co)
{
    for (int64_t i = 0; i < n; ++i) {
        const double radius = sqrt(k_ball_dot(3, z + 3 * i, z + 3 * i)),
                     own = fmax((1.0 - radius) * (1.0 + radius), 0.0);
        if (!(radius <= 1.0 + OUTSIDE) || (co != NULL && !k_ball_is_co(own, co[i])))
            return loxo_fail_at(ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = i},
                                "extension: point %" PRId64 " is not in the unit ball", i);
    }
    return LOXO_OK;
}

/* ---- one point ------------------------------------------------------------------------------------------------- */

/* What points use one after the other. */
typedef struct workspace {
    double *x, *y;  /* the map's, on the spheres */
    int64_t *begin; /* [n_faces + 1] first piece of a face */
    double *atom, *weight;
    int64_t n_pieces; /* that there is room for */
    loxo_barycenter_info found;
} workspace;

/* The map at a point of the sphere: of the face in which the point's least share is largest. */
static void map_at(const loxo_sphere_map *map, const workspace *k, const double *z, double *out)
{
    double best = -HUGE_VAL;
    for (int64_t f = 0; f < map->n_faces; ++f) {
        const loxo_index *v = map->triangle + 3 * f;
        const double *p[3] = {k->x + 3 * (int64_t)v[0], k->x + 3 * (int64_t)v[1], k->x + 3 * (int64_t)v[2]};
        corner at;
        double least = HUGE_VAL;
        const double whole = fabs(solid_angle(p[0], p[1], p[2]));
        for (int i = 0; i < 3; ++i) {
            const double *a = p[i == 2 ? 0 : i + 1], *b = p[i == 0 ? 2 : i - 1];
            at.share[i] = z[0] * (a[1] * b[2] - a[2] * b[1]) + z[1] * (a[2] * b[0] - a[0] * b[2]) +
                          z[2] * (a[0] * b[1] - a[1] * b[0]);
        }
        const double sign = at.share[0] + at.share[1] + at.share[2] < 0.0 ? -1.0 : 1.0;
        const double towards = k_ball_dot(3, z, p[0]) + k_ball_dot(3, z, p[1]) + k_ball_dot(3, z, p[2]);
        for (int i = 0; i < 3; ++i)
            least = fmin(least, sign * at.share[i]);
        if (!(whole > 0.0) || !(towards > 0.0) || !(least > best)) continue;
        best = least;
        combine(v, k->y, map->d, &at, out);
        for (int i = 0; i < map->d; ++i)
            out[i] *= sign;
    }
    project(map->d, out);
}

static loxo_status make_room(loxo_context *ctx, int64_t n_pieces, int d, workspace *k)
{
    if (n_pieces <= k->n_pieces) return LOXO_OK;
    const int64_t more = n_pieces + n_pieces / 4;
    loxo_release(ctx, k->atom);
    loxo_release(ctx, k->weight);
    k->n_pieces = 0;
    k->weight = NULL;
    if ((k->atom = loxo_allocate(ctx, more * N_NODES * d, sizeof *k->atom)) == NULL) return LOXO_ERR_MEMORY;
    if ((k->weight = loxo_allocate(ctx, more * N_NODES, sizeof *k->weight)) == NULL) return LOXO_ERR_MEMORY;
    k->n_pieces = more;
    return LOXO_OK;
}

/* Nodes of all faces: counted first, so that each has its place. */
static loxo_status put_all_nodes(loxo_context *ctx, const seen *s, workspace *k)
{
    const int64_t n = s->map->n_faces;
    const int d = s->map->d;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n, 40.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t f = r.begin; f < r.end; ++f)
            k->begin[f] = cut_face(s, f, NULL, NULL);
    }
    int64_t n_pieces = 0;
    for (int64_t f = 0; f < n; ++f) {
        const int64_t here = k->begin[f];
        k->begin[f] = n_pieces;
        n_pieces += here;
    }
    k->begin[n] = n_pieces;
    const loxo_status status = make_room(ctx, n_pieces, d, k);
    if (status < 0) return status;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n_pieces, 120.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t f = r.begin; f < r.end; ++f)
            (void)cut_face(s, f, k->atom + k->begin[f] * N_NODES * d, k->weight + k->begin[f] * N_NODES);
    }
    return LOXO_OK;
}

static void keep(const loxo_extension_values *v, int d, int64_t i, const double *w, double co, double bound,
                 loxo_extension_kind kind)
{
    for (int k = 0; k < d; ++k)
        v->w[i * d + k] = w == NULL ? (double)NAN : w[k];
    if (v->co != NULL) v->co[i] = co;
    if (v->bound != NULL) v->bound[i] = bound;
    if (v->error != NULL) v->error[i] = (double)NAN;
    if (v->kind != NULL) v->kind[i] = (unsigned char)kind;
}

static loxo_status find_value(loxo_context *ctx, const seen *s, const loxo_barycenter_settings *how, workspace *k,
                              int64_t i, const loxo_extension_values *values, loxo_sphere_extension_info *info)
{
    const int d = s->map->d;
    loxo_barycenter_info *b = &k->found;
    if (!(s->co > 0.0)) {
        double out[LOXO_MOEBIUS_MOST_DIMENSIONS] = {0.0};
        map_at(s->map, k, s->z, out);
        keep(values, d, i, out, 0.0, 0.0, LOXO_EXTENSION_CURVE);
        info->n_on_sphere += 1;
        return LOXO_OK;
    }
    loxo_status status = put_all_nodes(ctx, s, k);
    if (status < 0) return status;
    const loxo_atoms atoms = {.n = k->begin[s->map->n_faces] * N_NODES, .d = d, .x = k->atom, .weight = k->weight};
    status = loxo_barycenter(ctx, &atoms, how, b);
    if (status < 0 || status == LOXO_STOPPED) return status;
    info->n_nodes += atoms.n;
    info->n_iterations += b->n_iterations;
    if (b->kind != LOXO_BARYCENTER_STABLE) {
        keep(values, d, i, b->w, b->kind == LOXO_BARYCENTER_NONE ? 0.0 : b->co, 0.0, LOXO_EXTENSION_RESTING);
        info->n_resting += 1;
        return LOXO_OK;
    }
    const bool is_done = status == LOXO_OK || b->frame_bound <= how->tolerance;
    keep(values, d, i, b->w, b->co, b->frame_bound, is_done ? LOXO_EXTENSION_INSIDE : LOXO_EXTENSION_OPEN);
    info->n_open += !is_done;
    if (is_done) info->bound_max = fmax(info->bound_max, b->frame_bound);
    return LOXO_OK;
}

static loxo_status find_values(loxo_context *ctx, const loxo_sphere_map *map,
                               const loxo_sphere_extension_settings *settings, int64_t n, const double *z,
                               const double *co, workspace *k, const loxo_extension_values *values,
                               loxo_sphere_extension_info *info)
{
    const loxo_barycenter_settings how = {
        .method = LOXO_BARYCENTER_DAMPED, .tolerance = settings->tolerance, .max_iterations = settings->max_iterations};
    for (int64_t i = 0; i < n; ++i) {
        const seen s = {.map = map,
                        .x = k->x,
                        .y = k->y,
                        .z = {z[3 * i], z[3 * i + 1], z[3 * i + 2]},
                        .co = co_of(z + 3 * i, co == NULL ? NULL : co + i),
                        .longest = settings->piece};
        loxo_status status = find_value(ctx, &s, &how, k, i, values, info);
        if (status < 0) return status;
        if (status != LOXO_STOPPED) info->n_points += 1;
        if (status == LOXO_STOPPED || (i + 1 < n && loxo_stop_wanted(ctx, "extension", (double)(i + 1) / (double)n))) {
            for (int64_t j = status == LOXO_STOPPED ? i : i + 1; j < n; ++j)
                keep(values, map->d, j, NULL, NAN, HUGE_VAL, LOXO_EXTENSION_OPEN);
            return LOXO_STOPPED;
        }
    }
    return info->n_open > 0 ? LOXO_NOT_CONVERGED : LOXO_OK;
}

static loxo_status check_arguments(loxo_context *ctx, const loxo_sphere_map *map, int64_t n, const double *z,
                                   const loxo_extension_values *values)
{
    if (map == NULL || map->x == NULL || map->y == NULL || map->triangle == NULL || map->n_vertices < 4 ||
        map->n_faces < 4 || map->n_vertices > LOXO_INDEX_MAX)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "extension: a map of a closed mesh is needed");
    if (map->d < 2 || map->d > LOXO_MOEBIUS_MOST_DIMENSIONS)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "extension: %d dimensions, not 2 to %d", map->d,
                         LOXO_MOEBIUS_MOST_DIMENSIONS);
    if (n < 0 || (n > 0 && (z == NULL || values == NULL || values->w == NULL)))
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "extension: no points, or nowhere to put their values");
    return LOXO_OK;
}

loxo_status loxo_sphere_extension(loxo_context *ctx, const loxo_sphere_map *map,
                                  const loxo_sphere_extension_settings *settings, int64_t n, const double *z,
                                  const double *co, const loxo_extension_values *values,
                                  loxo_sphere_extension_info *info)
{
    const loxo_sphere_extension_settings s = settings == NULL ? loxo_sphere_extension_settings_default() : *settings;
    const double start_s = loxo_os_clock_s();
    loxo_sphere_extension_info own = {.n_points = 0};
    loxo_status status = loxo_options_check(ctx, "extension", loxo_sphere_extension_options, &s);
    if (status >= 0) status = check_arguments(ctx, map, n, z, values);
    if (status >= 0) status = check_points(ctx, n, z, co);
    if (status < 0) return status;
    workspace *k = loxo_allocate_zero(ctx, 1, sizeof *k);
    if (k == NULL) return LOXO_ERR_MEMORY;
    loxo_progress_begin(ctx);
    loxo_progress_enter(ctx);
    k->x = loxo_allocate(ctx, 3 * map->n_vertices, sizeof *k->x);
    k->y = loxo_allocate(ctx, map->d * map->n_vertices, sizeof *k->y);
    k->begin = loxo_allocate(ctx, map->n_faces + 1, sizeof *k->begin);
    status = k->x == NULL || k->y == NULL || k->begin == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
    if (status >= 0) status = copy_units(ctx, "the place", map->n_vertices, 3, map->x, k->x);
    if (status >= 0) status = copy_units(ctx, "the image", map->n_vertices, map->d, map->y, k->y);
    if (status >= 0) status = check_cover(ctx, map, k->x);
    if (status >= 0) status = find_values(ctx, map, &s, n, z, co, k, values, &own);
    loxo_release(ctx, k->x);
    loxo_release(ctx, k->y);
    loxo_release(ctx, k->begin);
    loxo_release(ctx, k->atom);
    loxo_release(ctx, k->weight);
    loxo_release(ctx, k);
    loxo_progress_leave(ctx);
    if (status < 0) return status;
    own.total_s = loxo_os_clock_s() - start_s;
    own.peak_bytes = loxo_context_memory(ctx).peak_bytes;
    if (info != NULL) *info = own;
    return status;
}
