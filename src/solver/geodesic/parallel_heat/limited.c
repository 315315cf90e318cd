/* SPDX-License-Identifier: MIT
 * Solves that end at a largest distance, at the cost of the ball. Levels are taken in until one lies wholly outside; with a
 * margin they are copied into a small mesh of their own, whose arrays stand in the room that a whole solve uses, and that
 * is solved as any other. The margin is so wide that nothing in the ball can tell the difference:
 *
 * Let the levels 0..l be there. What is missing beyond makes other values in level l, from the step l on in which that is
 * taken in, and from there moves inward by one level a step: level B does not see it before step 2 l - B. So where B was
 * final earlier (the march tells the step), it has the bits of the whole mesh. Unfolding looks at what is hotter, which lies
 * in the ball, and in its second pass at the neighbours' neighbours. ADMM reaches one face a step and the tree
 * none outward: B is the last level with a vertex in the ball, plus the number of ADMM's iterations, plus one for an
 * edge's other side and one for a face's other corners.
 *
 * The ball is bounded by straight distances, which no way over the surface is shorter than. A way that leaves level k
 * outward passes a vertex of it or an edge between two of them, since levels differ by at most one along an edge; and a point
 * of an edge is at most half its length nearer than the ends. So the ball ends before k when all its vertices are farther
 * than the largest distance by half their longest edge. Computed distances are now and then too short: the ball is made a
 * tenth and two mean edge lengths larger. */
#include "base/allocate.h"
#include "base/os.h"
#include "kernel/layout_kernel.h"
#include "mesh/intrinsic/overlay.h"
#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

#include <math.h>
#include <string.h>

#define FEW_SEEDS     32 /* straight distances are taken to each; of more, to the box around them */
#define LARGER        1.1
#define LARGER_EDGES  2.0
#define FIRST_MARGIN  12 /* levels beyond B at first; doubled when B was not final early enough */
#define DIGIT_BITS    11
#define N_DIGITS      (1 << DIGIT_BITS)
#define UNFOLD_REACH  3   /* B is so many levels beyond the ball */
#define LEAST_A_PLACE 150 /* bytes; what does not fit by this does not fit */

/* Straight distances from the seeds. */
typedef struct straight {
    int64_t n; /* 0: the box */
    loxo_vec3 seed[FEW_SEEDS], least, most;
    double limit;
} straight;

/* The levels that were taken in: places of the search as in order. */
typedef struct region {
    int64_t n, n_levels;
    int64_t last_needed; /* level B */
    bool is_whole;       /* there is nothing beyond */
} region;

static loxo_vec3 position_of_seed(const loxo_mesh *mesh, const geodesic_seed *seed)
{
    loxo_face_point p = {seed->face, {seed->weight[0], seed->weight[1], seed->weight[2]}};
    const loxo_mesh_view *m = &mesh->view;
    loxo_vec3 sum = {0.0, 0.0, 0.0};
    if (mesh->surface != NULL && seed->vertex < 0) { /* an intrinsic face is no triangle in space */
        p = loxo_to_surface(mesh, &p);
        m = &mesh->surface->view;
    }
    for (int k = 0; k < 3; ++k)
        if (p.weight[k] > 0.0)
            sum = v3_axpy(sum, p.weight[k], k_position(m, m->halfedge_vertex[(int64_t)3 * p.face + k]));
    return sum;
}

static straight straight_from(const parallel_heat *g, const geodesic_seed *seeds, int64_t n_seeds)
{
    straight s = {.n = n_seeds <= FEW_SEEDS ? n_seeds : 0};
    s.limit = LARGER * g->problem->settings.max_distance + LARGER_EDGES * g->mean_edge_length;
    for (int64_t i = 0; i < n_seeds; ++i) {
        const loxo_vec3 x = position_of_seed(g->mesh, &seeds[i]);
        if (n_seeds <= FEW_SEEDS) s.seed[i] = x;
        s.least = i == 0 ? x : (loxo_vec3){fmin(s.least.x, x.x), fmin(s.least.y, x.y), fmin(s.least.z, x.z)};
        s.most = i == 0 ? x : (loxo_vec3){fmax(s.most.x, x.x), fmax(s.most.y, x.y), fmax(s.most.z, x.z)};
    }
    return s;
}

static double straight_distance(const straight *s, loxo_vec3 x)
{
    double square = HUGE_VAL;
    for (int64_t i = 0; i < s->n; ++i) {
        const loxo_vec3 way = v3_sub(x, s->seed[i]);
        square = fmin(square, v3_dot(way, way));
    }
    if (s->n > 0) return sqrt(square);
    const loxo_vec3 nearest = {fmin(fmax(x.x, s->least.x), s->most.x), fmin(fmax(x.y, s->least.y), s->most.y),
                               fmin(fmax(x.z, s->least.z), s->most.z)};
    return v3_norm(v3_sub(x, nearest));
}

static double longest_edge_at(const loxo_mesh_view *m, loxo_index v)
{
    const loxo_index start = m->vertex_halfedge[v];
    double longest = 0.0;
    for (loxo_index h = start; h >= 0;) {
        double length[3];
        const loxo_index before = k_previous(h);
        k_face_lengths(m, h / 3, length);
        longest = fmax(longest, fmax(length[h % 3], length[before % 3]));
        h = m->halfedge_twin[before];
        if (h == start) break;
    }
    return longest;
}

static bool is_outside(const parallel_heat *g, const straight *s, int64_t begin, int64_t end)
{
    for (int64_t p = begin; p < end; ++p)
        if (straight_distance(s, k_position(&g->m, g->order[p])) <= s->limit) return false;
    for (int64_t p = begin; p < end; ++p) {
        const double edge = longest_edge_at(&g->m, g->order[p]);
        if (straight_distance(s, k_position(&g->m, g->order[p])) <= s->limit + 0.5 * edge) return false;
    }
    return true;
}

/* rank of what is not in a region is -1, before and after. */
static void clear_ranks(parallel_heat *g)
{
    if (!g->is_rank_clear)
        for (int64_t v = 0; v < g->m.n_vertices; ++v)
            g->rank[v] = -1;
    g->is_rank_clear = true;
}

static void leave(parallel_heat *g, const loxo_index *vertex, int64_t n)
{
    for (int64_t i = 0; i < n; ++i)
        g->rank[vertex[i]] = -1;
}

static void take_in(parallel_heat *g, region *r, loxo_index v)
{
    if (g->rank[v] >= 0) return;
    g->rank[v] = 0;
    g->order[r->n++] = v;
}

/* Vertices of levels 0 to `margin` beyond B, in order and marked in rank. false: there are more than `most`. */
static bool find_region(parallel_heat *g, const geodesic_seed *seeds, int64_t n_seeds, int64_t margin, int64_t most,
                        region *r)
{
    const straight s = straight_from(g, seeds, n_seeds);
    int64_t begin = 0, last = INT64_MAX;
    *r = (region){.last_needed = INT64_MAX};
    for (int64_t i = 0; i < n_seeds; ++i)
        for (int k = 0; k < 3; ++k)
            if (seeds[i].weight[k] > 0.0) take_in(g, r, g->m.halfedge_vertex[(int64_t)3 * seeds[i].face + k]);
    while (begin < r->n && r->n <= most) {
        const int64_t end = r->n;
        if (last == INT64_MAX && r->n_levels > 0 && is_outside(g, &s, begin, end)) {
            const int64_t reach = heat_unfolds(&g->settings) ? UNFOLD_REACH : g->settings.n_iterations + 2;
            r->last_needed = r->n_levels - 1 + reach;
            last = r->last_needed + margin;
        }
        if (r->n_levels++ >= last) return true;
        for (int64_t p = begin; p < end; ++p) {
            k_around around = k_around_vertex(&g->m, g->order[p]);
            for (loxo_index to; (to = k_around_next(&g->m, &around)) >= 0;)
                take_in(g, r, to);
        }
        begin = end;
    }
    r->is_whole = begin == r->n;
    return r->is_whole && r->n <= most;
}

/* Ascending: from a to b in three passes, a is used up. */
static void sort_indices(loxo_index *a, loxo_index *b, int64_t n)
{
    int64_t place[N_DIGITS];
    for (int pass = 0; pass < 3; ++pass) {
        const loxo_index *from = pass == 1 ? b : a;
        loxo_index *to = pass == 1 ? a : b;
        int64_t sum = 0;
        memset(place, 0, sizeof place);
        for (int64_t i = 0; i < n; ++i)
            ++place[((uint32_t)from[i] >> (pass * DIGIT_BITS)) & (N_DIGITS - 1)];
        for (int digit = 0; digit < N_DIGITS; ++digit) {
            const int64_t count = place[digit];
            place[digit] = sum;
            sum += count;
        }
        for (int64_t i = 0; i < n; ++i)
            to[place[((uint32_t)from[i] >> (pass * DIGIT_BITS)) & (N_DIGITS - 1)]++] = from[i];
    }
}

/* The small mesh. Its numbers of vertices go up with those of the whole; faces go by the least of their vertices. */
typedef struct small_mesh {
    loxo_index *vertex;     /* [n_vertices] in the whole mesh */
    double *distance;       /* [n_vertices] */
    loxo_index *face_begin; /* [n_vertices + 1] faces whose least vertex it is */
    loxo_index *face;       /* [n_faces] in the whole mesh */
    double (*position)[3];  /* one of the three, as the whole mesh has it */
    float (*position_float)[3];
    double *halfedge_length;
    loxo_index *halfedge_vertex, *halfedge_twin, *vertex_halfedge;
    int64_t n_faces, n_boundary_edges;
} small_mesh;

/* Whether all corners of the face of h are in the region, and v is the least of them, h the first half-edge that starts
 * there. */
static bool is_owned(const parallel_heat *g, loxo_index h, int64_t v)
{
    const loxo_index *corner = &g->m.halfedge_vertex[h - h % 3];
    for (int k = 0; k < 3; ++k) {
        if (g->rank[corner[k]] < v) return false; /* -1: outside */
        if (k < h % 3 && g->rank[corner[k]] == v) return false;
    }
    return true;
}

/* Faces that vertex i of the region owns go to list. */
static int64_t owned_faces(const parallel_heat *g, const loxo_index *vertex, int64_t i, loxo_index *list)
{
    const loxo_index start = g->m.vertex_halfedge[vertex[i]];
    int64_t n = 0;
    for (loxo_index h = start; h >= 0;) {
        if (is_owned(g, h, i)) list[n++] = (loxo_index)(h / 3);
        h = g->m.halfedge_twin[k_previous(h)];
        if (h == start) break;
    }
    return n;
}

/* The small mesh's number of a face of the whole; -1: it is not there. */
static loxo_index local_face(const parallel_heat *g, const small_mesh *small, int64_t f)
{
    const loxo_index *corner = &g->m.halfedge_vertex[3 * f];
    loxo_index least = g->rank[corner[0]];
    for (int k = 1; k < 3; ++k)
        if (g->rank[corner[k]] < least) least = g->rank[corner[k]];
    if (least < 0) return -1;
    for (loxo_index j = small->face_begin[least]; j < small->face_begin[least + 1]; ++j)
        if (small->face[j] == f) return j;
    return -1;
}

/* Names the arrays; while the arena has no block this only adds up their size. */
static void lay_out_small(const parallel_heat *g, int64_t n, small_mesh *small, parallel_heat *sub)
{
    loxo_arena *a = &sub->arena;
    small->vertex = loxo_arena_take(a, n, sizeof *small->vertex); /* these two stand to the end, */
    small->distance = loxo_arena_take(a, n, sizeof *small->distance);
    small->face_begin = loxo_arena_take(a, n + 1, sizeof *small->face_begin);
    small->face = loxo_arena_take(a, small->n_faces, sizeof *small->face);
    small->halfedge_vertex = loxo_arena_take(a, 3 * small->n_faces, sizeof *small->halfedge_vertex);
    small->halfedge_twin = loxo_arena_take(a, 3 * small->n_faces, sizeof *small->halfedge_twin);
    small->vertex_halfedge = loxo_arena_take(a, n, sizeof *small->vertex_halfedge);
    if (g->m.halfedge_length != NULL)
        small->halfedge_length = loxo_arena_take(a, 3 * small->n_faces, sizeof *small->halfedge_length);
    else if (g->m.position != NULL)
        small->position = loxo_arena_take(a, n, sizeof *small->position);
    else
        small->position_float = loxo_arena_take(a, n, sizeof *small->position_float);
    heat_lay_out(sub);
}

static void fill_faces(const parallel_heat *g, small_mesh *small)
{
    for (int64_t j = 0; j < small->n_faces; ++j)
        for (int k = 0; k < 3; ++k) {
            const int64_t h = (int64_t)3 * small->face[j] + k;
            const loxo_index t = g->m.halfedge_twin[h], other = t >= 0 ? local_face(g, small, t / 3) : -1;
            small->halfedge_vertex[3 * j + k] = g->rank[g->m.halfedge_vertex[h]];
            small->halfedge_twin[3 * j + k] = other >= 0 ? (loxo_index)(3 * other + t % 3) : -1;
            if (small->halfedge_length != NULL) small->halfedge_length[3 * j + k] = g->m.halfedge_length[h];
        }
}

/* Walks around a vertex begin where they do in the whole mesh, or else numbers would come in another order. At the
 * rim, where that face is missing, anywhere. */
static void link_vertices(const parallel_heat *g, int64_t n, small_mesh *small)
{
    for (int64_t i = 0; i < n; ++i) {
        const loxo_index h = g->m.vertex_halfedge[small->vertex[i]];
        const loxo_index f = h >= 0 ? local_face(g, small, h / 3) : -1;
        small->vertex_halfedge[i] = f >= 0 ? (loxo_index)(3 * f + h % 3) : -1;
    }
    for (int64_t h = 0; h < 3 * small->n_faces; ++h) {
        loxo_index *at = &small->vertex_halfedge[small->halfedge_vertex[h]];
        if (*at < 0) *at = (loxo_index)h;
    }
}

static void fill_vertices(const parallel_heat *g, int64_t n, const small_mesh *small)
{
    for (int64_t i = 0; i < n; ++i) {
        const loxo_index v = small->vertex[i];
        if (small->position != NULL && g->m.position != NULL)
            memcpy(small->position[i], g->m.position[v], sizeof small->position[i]);
        else if (small->position_float != NULL)
            memcpy(small->position_float[i], g->m.position_float[v], sizeof small->position_float[i]);
    }
}

static bool is_inside(const parallel_heat *g, int64_t f)
{
    const loxo_index *corner = &g->m.halfedge_vertex[3 * f];
    return g->rank[corner[0]] >= 0 && g->rank[corner[1]] >= 0 && g->rank[corner[2]] >= 0;
}

/* Half-edges of a face that vertex i of the region owns with no face of the region beyond. */
static int64_t rim_of(const parallel_heat *g, int64_t f)
{
    int64_t n = 0;
    for (int64_t h = 3 * f; h < 3 * f + 3; ++h)
        n += g->m.halfedge_twin[h] < 0 || !is_inside(g, g->m.halfedge_twin[h] / 3) ? 1 : 0;
    return n;
}

/* Vertices to the front of the loose memory, sorted and ranked, faces and boundary edges counted. */
static void count_small(parallel_heat *g, int64_t n, loxo_index *vertex, small_mesh *small)
{
    sort_indices(g->order, vertex, n);
    for (int64_t i = 0; i < n; ++i)
        g->rank[vertex[i]] = (loxo_index)i;
    for (int64_t i = 0; i < n; ++i) {
        const loxo_index start = g->m.vertex_halfedge[vertex[i]];
        for (loxo_index h = start; h >= 0;) {
            if (is_owned(g, h, i)) {
                ++small->n_faces;
                small->n_boundary_edges += rim_of(g, h / 3);
            }
            h = g->m.halfedge_twin[k_previous(h)];
            if (h == start) break;
        }
    }
}

/* From the region in order and rank to a method's state of its own, in the loose memory of g. false: no room. */
static bool make_small(parallel_heat *g, int64_t n, small_mesh *small, parallel_heat *sub)
{
    unsigned char *loose = g->arena.block + g->loose_begin;
    const size_t n_loose = g->arena.size - g->loose_begin;
    *small = (small_mesh){.n_faces = 0};
    count_small(g, n, (loxo_index *)(void *)loose, small);
    *sub = (parallel_heat){.problem = g->problem,
                           .ctx = g->ctx,
                           .mesh = g->mesh,
                           .settings = g->settings,
                           .kernels = g->kernels,
                           .mean_edge_length = g->mean_edge_length,
                           .time = g->time,
                           .area = g->area,
                           .n_boundary_edges = small->n_boundary_edges};
    sub->m = (loxo_mesh_view){.n_vertices = n, .n_faces = small->n_faces, .genus = -1, .n_boundary_loops = -1};
    lay_out_small(g, n, small, sub);
    if (sub->arena.overflow || sub->arena.size > n_loose) return false;
    sub->arena = (loxo_arena){.block = loose, .size = n_loose};
    lay_out_small(g, n, small, sub);

    loxo_index n_faces = 0;
    for (int64_t i = 0; i < n; ++i) {
        small->face_begin[i] = n_faces;
        n_faces = (loxo_index)(n_faces + owned_faces(g, small->vertex, i, &small->face[n_faces]));
    }
    small->face_begin[n] = n_faces;
    fill_faces(g, small);
    link_vertices(g, n, small);
    fill_vertices(g, n, small);
    sub->m.position = (const double(*)[3])small->position;
    sub->m.position_float = (const float(*)[3])small->position_float;
    sub->m.halfedge_length = small->halfedge_length;
    sub->m.halfedge_vertex = small->halfedge_vertex;
    sub->m.halfedge_twin = small->halfedge_twin;
    sub->m.vertex_halfedge = small->vertex_halfedge;
    return true;
}

/* In the numbers of the small mesh; the faces of vertices are not asked for. */
static void local_seeds(const parallel_heat *g, const small_mesh *small, const geodesic_seed *seeds, int64_t n_seeds,
                        geodesic_seed *local)
{
    for (int64_t i = 0; i < n_seeds; ++i) {
        local[i] = seeds[i];
        if (seeds[i].vertex >= 0)
            local[i].vertex = g->rank[seeds[i].vertex];
        else
            local[i].face = local_face(g, small, seeds[i].face);
    }
}

/* Solves on the small mesh, and scatters; *is_enough: the margin was wide enough. */
static loxo_status solve_small(parallel_heat *g, const region *r, small_mesh *small, parallel_heat *sub,
                               const geodesic_seed *seeds, int64_t n_seeds, double *distance,
                               diffusion_result *diffusion, loxo_geodesic_info *info, bool *is_enough)
{
    geodesic_seed *local = loxo_allocate(g->ctx, n_seeds, sizeof *local);
    if (local == NULL) return LOXO_ERR_MEMORY;
    local_seeds(g, small, seeds, n_seeds, local);
    sub->last_needed = r->last_needed;
    *diffusion = (diffusion_result){0};
    const loxo_status status = heat_find_distances(sub, local, n_seeds, small->distance, diffusion, info);
    heat_end(sub);
    loxo_release(g->ctx, sub->more_levels);
    loxo_release(g->ctx, local);
    *is_enough = r->is_whole || diffusion->stopped || (r->last_needed + diffusion->needed_step) / 2 < r->n_levels - 1;
    for (int64_t i = 0; i < r->n && !diffusion->stopped; ++i) /* rounds that waited for something beyond the rim */
        *is_enough = *is_enough && (r->is_whole || !isnan(small->distance[i]));
    g->clock_s = sub->clock_s;
    if (status < 0 || !*is_enough) return status;
    for (int64_t v = 0; v < g->m.n_vertices; ++v)
        distance[v] = HUGE_VAL;
    for (int64_t i = 0; i < r->n; ++i)
        distance[small->vertex[i]] = small->distance[i];
    info->n_levels = sub->n_levels;
    g->touched = small->vertex;
    g->n_touched = r->n;
    return status;
}

loxo_status heat_solve_limited(parallel_heat *g, const geodesic_seed *seeds, int64_t n_seeds, double *distance,
                               diffusion_result *diffusion, loxo_geodesic_info *info, bool *is_done)
{
    const int64_t most = (int64_t)((g->arena.size - g->loose_begin) / LEAST_A_PLACE);
    loxo_status status = LOXO_OK;
    *is_done = false;
    g->has_heat = false;
    clear_ranks(g);
    for (int64_t margin = FIRST_MARGIN; !*is_done && status >= 0; margin *= 2) {
        parallel_heat sub;
        small_mesh small;
        region r;
        g->clock_s = loxo_os_clock_s();
        const bool is_small = find_region(g, seeds, n_seeds, margin, most, &r);
        if (!is_small) {
            leave(g, g->order, r.n);
            break;
        }
        const bool fits = make_small(g, r.n, &small, &sub);
        heat_clock(g, LOXO_GEODESIC_PHASE_LEVELS, info);
        if (fits) status = solve_small(g, &r, &small, &sub, seeds, n_seeds, distance, diffusion, info, is_done);
        leave(g, (const loxo_index *)(const void *)(g->arena.block + g->loose_begin), r.n);
        if (!fits) break;
    }
    return status;
}
