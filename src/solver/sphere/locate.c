/* SPDX-License-Identifier: MIT
 * The inverse of a map to the sphere: a hierarchy of boxes over its triangles. Faces are sorted along Hilbert's curve by the middles of
 * their images; so many neighbours make a leaf, so many nodes a node of the next level. A point of a spherical triangle lies in the
 * box around its corners made wider by what the triangle bulges: only boxes that hold a direction are opened. */
#include "base/allocate.h"
#include "base/context.h"
#include "kernel/closest_kernel.h"
#include "kernel/locate_kernel.h"
#include "mesh/mesh_internal.h"
#include "mesh/reorder_internal.h"
#include "par/range.h"

#include <loxo/locate.h>

#include <inttypes.h>
#include <string.h>

#define LEAF_FACES   4
#define ARITY        4
#define MAX_LEVELS   32
#define MAX_OPEN     (MAX_LEVELS * (ARITY - 1) + 1) /* nodes that wait at any time, going depth first */
#define ROUNDING     1e-15                          /* of directions and corners */
#define QUERIES_WAVE ((int64_t)1 << 18)             /* between two looks at the monitor */
#define NS_PER_QUERY 700.0

typedef struct box {
    double low[3], high[3];
} box;

struct loxo_sphere_locator {
    loxo_context *ctx;
    loxo_mesh_view m;
    double (*f)[3];   /* [n_vertices] unit vectors, the mesh's order */
    loxo_index *face; /* [n_faces] along the curve */
    box *node;        /* [level_begin[n_levels]] leaves first */
    int n_levels;
    int64_t level_begin[MAX_LEVELS + 1];
};

typedef struct place {
    int64_t face; /* -1: none */
    double weight[3];
    double square; /* of the distance */
} place;

typedef struct open_node {
    int level;
    int64_t i; /* in its level */
    double square;
} open_node;

/* ---- making it ------------------------------------------------------------------------------------------------- */

static bool to_unit(const double *p, double out[3])
{
    const double most = fmax(fabs(p[0]), fmax(fabs(p[1]), fabs(p[2])));
    if (!(most > 0.0 && isfinite(most))) return false;
    const loxo_vec3 x = v3_scale(1.0 / most, v3_load(p)); /* no square overflows */
    if (!isfinite(x.x + x.y + x.z)) return false;         /* a length below 1e-308 */
    v3_store(out, v3_scale(1.0 / v3_norm(x), x));
    return true;
}

static loxo_status take_map(loxo_sphere_locator *l, const double *map)
{
    const loxo_mesh_view *m = &l->m;
    for (int64_t i = 0; i < m->n_vertices; ++i) {
        const int64_t v = m->vertex_origin != NULL ? m->vertex_origin[i] : i;
        if (to_unit(&map[3 * v], l->f[i])) continue;
        if (m->vertex_halfedge[i] >= 0)
            return loxo_fail_at(l->ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = v},
                                "locate: the image of vertex %" PRId64 " is 0 or not finite", v);
        v3_store(l->f[i], (loxo_vec3){0.0, 0.0, 1.0});
    }
    return LOXO_OK;
}

static void load_face(const loxo_sphere_locator *l, int64_t f, loxo_vec3 corner[3])
{
    for (int k = 0; k < 3; ++k)
        corner[k] = v3_load(l->f[l->m.halfedge_vertex[3 * f + k]]);
}

static loxo_status sort_faces(loxo_sphere_locator *l)
{
    const int64_t n = l->m.n_faces;
    float *middle = loxo_allocate(l->ctx, 3 * n, sizeof *middle);
    unsigned char *is_used = loxo_allocate(l->ctx, n, 1);
    loxo_status status = LOXO_ERR_MEMORY;
    if (middle == NULL || is_used == NULL) goto done;
#pragma omp parallel num_threads(loxo_threads_for(l->ctx, n, 10.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t f = r.begin; f < r.end; ++f) {
            loxo_vec3 c[3];
            load_face(l, f, c);
            const loxo_vec3 sum = v3_add(c[0], v3_add(c[1], c[2]));
            middle[3 * f] = (float)sum.x;
            middle[3 * f + 1] = (float)sum.y;
            middle[3 * f + 2] = (float)sum.z;
            is_used[f] = 1;
        }
    }
    const loxo_mesh_arrays points = {.n_vertices = n, .position_float = middle};
    status = loxo_order_curve(l->ctx, &points, is_used, true, l->face);
done:
    loxo_release(l->ctx, is_used);
    loxo_release(l->ctx, middle);
    return status;
}

static const box nothing = {{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};

static void widen(box *b, const double low[3], const double high[3])
{
    for (int k = 0; k < 3; ++k) {
        b->low[k] = fmin(b->low[k], low[k]);
        b->high[k] = fmax(b->high[k], high[k]);
    }
}

static box box_of_leaf(const loxo_sphere_locator *l, int64_t leaf)
{
    const int64_t begin = leaf * LEAF_FACES, rest = l->m.n_faces - begin;
    box all = nothing;
    for (int64_t i = begin; i < begin + (rest < LEAF_FACES ? rest : LEAF_FACES); ++i) {
        loxo_vec3 c[3];
        load_face(l, l->face[i], c);
        const double bulge = k_cone_bulge(c[0], c[1], c[2]) + ROUNDING;
        for (int k = 0; k < 3; ++k) {
            const double low[3] = {c[k].x - bulge, c[k].y - bulge, c[k].z - bulge};
            const double high[3] = {c[k].x + bulge, c[k].y + bulge, c[k].z + bulge};
            widen(&all, low, high);
        }
    }
    return all;
}

static int64_t n_in_level(const loxo_sphere_locator *l, int level)
{
    return l->level_begin[level + 1] - l->level_begin[level];
}

static box box_of_node(const loxo_sphere_locator *l, int level, int64_t i)
{
    const int64_t begin = i * ARITY, rest = n_in_level(l, level - 1) - begin;
    box all = nothing;
    for (int64_t child = begin; child < begin + (rest < ARITY ? rest : ARITY); ++child) {
        const box *b = &l->node[l->level_begin[level - 1] + child];
        widen(&all, b->low, b->high);
    }
    return all;
}

static void fill_level(const loxo_sphere_locator *l, int level)
{
    const int64_t n = n_in_level(l, level);
#pragma omp parallel num_threads(loxo_threads_for(l->ctx, n, 100.0))
    {
        const loxo_range r = loxo_thread_range(n);
        for (int64_t i = r.begin; i < r.end; ++i)
            l->node[l->level_begin[level] + i] = level == 0 ? box_of_leaf(l, i) : box_of_node(l, level, i);
    }
}

/* Levels up to the one of a single node. */
static void count_levels(loxo_sphere_locator *l)
{
    int64_t n = (l->m.n_faces + LEAF_FACES - 1) / LEAF_FACES;
    for (l->n_levels = 1, l->level_begin[1] = n; n > 1; ++l->n_levels) {
        n = (n + ARITY - 1) / ARITY;
        l->level_begin[l->n_levels + 1] = l->level_begin[l->n_levels] + n;
    }
}

loxo_status loxo_sphere_locator_create(loxo_context *ctx, const loxo_mesh *mesh, const double *map,
                                       loxo_sphere_locator **out)
{
    if (out != NULL) *out = NULL;
    if (ctx == NULL || mesh == NULL || map == NULL || out == NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "locate: NULL for a mesh, a map or a place for the locator");
    const loxo_mesh_view m = loxo_mesh_get_view(mesh);
    if (m.halfedge_length != NULL)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "locate: ask the surface of an intrinsic triangulation");
    if (m.n_faces == 0) return loxo_fail(ctx, LOXO_ERR_MESH, "locate: the mesh has no faces");
    loxo_sphere_locator *l = loxo_allocate(ctx, 1, sizeof *l);
    if (l == NULL) return LOXO_ERR_MEMORY;
    *l = (loxo_sphere_locator){.ctx = ctx, .m = m};
    count_levels(l);
    loxo_status status = LOXO_ERR_MEMORY;
    l->f = loxo_allocate(ctx, m.n_vertices, sizeof *l->f);
    l->face = loxo_allocate(ctx, m.n_faces, sizeof *l->face);
    if (l->f == NULL || l->face == NULL) goto fail;
    if ((status = take_map(l, map)) < 0 || (status = sort_faces(l)) < 0) goto fail;
    l->node = loxo_allocate(ctx, l->level_begin[l->n_levels], sizeof *l->node);
    if (l->node == NULL) {
        status = LOXO_ERR_MEMORY;
        goto fail;
    }
    for (int level = 0; level < l->n_levels; ++level)
        fill_level(l, level);
    *out = l;
    return LOXO_OK;
fail:
    loxo_sphere_locator_destroy(l);
    return status;
}

void loxo_sphere_locator_destroy(loxo_sphere_locator *l)
{
    if (l == NULL) return;
    loxo_release(l->ctx, l->node);
    loxo_release(l->ctx, l->face);
    loxo_release(l->ctx, l->f);
    loxo_release(l->ctx, l);
}

/* ---- asking it ------------------------------------------------------------------------------------------------- */

static bool has(const box *b, loxo_vec3 q)
{
    return q.x >= b->low[0] && q.x <= b->high[0] && q.y >= b->low[1] && q.y <= b->high[1] && q.z >= b->low[2] &&
           q.z <= b->high[2];
}

/* Squared distance to a box: not more than to what is in it. */
static double to_box(const box *b, loxo_vec3 q)
{
    const double x = fmax(fmax(b->low[0] - q.x, q.x - b->high[0]), 0.0);
    const double y = fmax(fmax(b->low[1] - q.y, q.y - b->high[1]), 0.0);
    const double z = fmax(fmax(b->low[2] - q.z, q.z - b->high[2]), 0.0);
    return x * x + y * y + z * z;
}

static loxo_range faces_of(const loxo_sphere_locator *l, int64_t leaf)
{
    const int64_t begin = leaf * LEAF_FACES, end = begin + LEAF_FACES;
    return (loxo_range){begin, end < l->m.n_faces ? end : l->m.n_faces};
}

static loxo_range children_of(const loxo_sphere_locator *l, const open_node *node)
{
    const int64_t begin = node->i * ARITY, end = begin + ARITY, n = n_in_level(l, node->level - 1);
    return (loxo_range){begin, end < n ? end : n};
}

/* The first face whose cone holds q. */
static place find_holder(const loxo_sphere_locator *l, loxo_vec3 q)
{
    open_node open[MAX_OPEN];
    int n_open = 1;
    place best = {.face = -1};
    open[0] = (open_node){.level = l->n_levels - 1};
    while (n_open > 0) {
        const open_node node = open[--n_open];
        if (node.level > 0) {
            const loxo_range r = children_of(l, &node);
            for (int64_t i = r.begin; i < r.end; ++i)
                if (has(&l->node[l->level_begin[node.level - 1] + i], q))
                    open[n_open++] = (open_node){.level = node.level - 1, .i = i};
            continue;
        }
        const loxo_range r = faces_of(l, node.i);
        for (int64_t i = r.begin; i < r.end; ++i) {
            const int64_t f = l->face[i];
            loxo_vec3 c[3];
            double weight[3];
            if (best.face >= 0 && f > best.face) continue;
            load_face(l, f, c);
            if (!k_cone_weights(q, c[0], c[1], c[2], weight)) continue;
            best.face = f;
            memcpy(best.weight, weight, sizeof weight);
        }
    }
    return best;
}

/* Children that may be nearer than what is known, the nearest of them last, which is opened first. */
static int open_children(const loxo_sphere_locator *l, const open_node *node, loxo_vec3 q, double square,
                         open_node *open, int n_open)
{
    const loxo_range r = children_of(l, node);
    const int first = n_open;
    for (int64_t i = r.begin; i < r.end; ++i) {
        const open_node child = {
            .level = node->level - 1, .i = i, .square = to_box(&l->node[l->level_begin[node->level - 1] + i], q)};
        int at = n_open;
        if (child.square > square) continue;
        for (; at > first && open[at - 1].square < child.square; --at)
            open[at] = open[at - 1];
        open[at] = child;
        ++n_open;
    }
    return n_open;
}

/* The nearest point of all flat triangles, of equally near ones that of the first face. */
static place find_nearest(const loxo_sphere_locator *l, loxo_vec3 q)
{
    open_node open[MAX_OPEN];
    int n_open = 1;
    place best = {.face = -1, .square = HUGE_VAL};
    open[0] = (open_node){.level = l->n_levels - 1};
    while (n_open > 0) {
        const open_node node = open[--n_open];
        if (node.square > best.square) continue;
        if (node.level > 0) {
            n_open = open_children(l, &node, q, best.square, open, n_open);
            continue;
        }
        const loxo_range r = faces_of(l, node.i);
        for (int64_t i = r.begin; i < r.end; ++i) {
            place here = {.face = l->face[i]};
            loxo_vec3 c[3];
            load_face(l, here.face, c);
            here.square = k_closest_in_triangle(q, c[0], c[1], c[2], here.weight);
            if (here.square < best.square || (here.square == best.square && here.face < best.face)) best = here;
        }
    }
    return best;
}

static void locate(const loxo_sphere_locator *l, const double q[3], loxo_surface_point *point, double *away)
{
    const loxo_mesh_view *m = &l->m;
    place at = find_holder(l, v3_load(q));
    if (at.face < 0) at = find_nearest(l, v3_load(q));
    if (away != NULL) *away = sqrt(at.square);
    for (int k = 0; k < 3; ++k) {
        const loxo_index v = m->halfedge_vertex[3 * at.face + k];
        const bool is_used = at.weight[k] != 0.0;
        point->vertex[k] = !is_used ? -1 : m->vertex_origin != NULL ? m->vertex_origin[v] : v;
        point->weight[k] = at.weight[k];
    }
}

loxo_status loxo_sphere_locate(const loxo_sphere_locator *l, int64_t n, const double *direction,
                               loxo_surface_point *point, double *away)
{
    if (l == NULL) return LOXO_ERR_ARGUMENT;
    if (n < 0 || (n > 0 && (direction == NULL || point == NULL)))
        return loxo_fail(l->ctx, LOXO_ERR_ARGUMENT, "locate: an array is NULL");
    for (int64_t i = 0; i < n; ++i) {
        double q[3];
        if (to_unit(&direction[3 * i], q)) continue;
        return loxo_fail_at(l->ctx, LOXO_ERR_ARGUMENT, (loxo_place){.byte = -1, .element = i},
                            "locate: direction %" PRId64 " is 0 or not finite", i);
    }
    loxo_progress_begin(l->ctx);
    for (int64_t begin = 0; begin < n; begin += QUERIES_WAVE) {
        const int64_t n_now = n - begin < QUERIES_WAVE ? n - begin : QUERIES_WAVE;
#pragma omp parallel num_threads(loxo_threads_for(l->ctx, n_now, NS_PER_QUERY))
        {
            const loxo_range r = loxo_thread_range(n_now);
            for (int64_t i = begin + r.begin; i < begin + r.end; ++i) {
                double q[3] = {0.0, 0.0, 1.0};
                (void)to_unit(&direction[3 * i], q);
                locate(l, q, &point[i], away == NULL ? NULL : &away[i]);
            }
        }
        if (begin + n_now < n && loxo_stop_wanted(l->ctx, "locate", (double)(begin + n_now) / (double)n))
            return loxo_fail(l->ctx, LOXO_ERR_STOPPED, "stopped while locating");
    }
    return LOXO_OK;
}
