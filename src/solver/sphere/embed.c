/* SPDX-License-Identifier: MIT
 * Vertices are taken out in rounds, of each round no two neighbours, and put back in the opposite order. */
#include "base/sort.h"
#include "kernel/conformal_kernel.h"
#include "solver/sphere/embedding.h"

#define MOST  EMBEDDING_MOST_NEIGHBOURS
#define FEW   8    /* neighbours, of a vertex that is taken out of the whole */
#define CROWD 8    /* neighbours that may come together at a vertex without a malus ... */
#define MALUS 0.05 /* ... of so much each in the quality of the triangles */
#define BLOCK 1024 /* vertices between two looks at the monitor */
#define EARLY_SWEEPS                                                                                                   \
    1000.0 /* at most: early rounds of the whole get a sweep for each time that the vertices there fit into all */
#define GROWTH 1.2 /* of the free vertices until all of them are relaxed again */

/* How far the search for vertices to take out goes. */
typedef enum patience_level {
    ALL_GOOD, /* only where no triangle turned over is left in the place of the vertex */
    FEWER,    /* or fewer than before */
    ANY       /* or any number: the hole grows */
} patience_level;

/* Twice the area of a face over the square of its longest edge; with signs where it is on the sphere. */
static double quality_of(loxo_vec3 a, loxo_vec3 b, loxo_vec3 c, bool is_signed)
{
    double side;
    const loxo_vec3 normal = k_image_normal(a, b, c, &side), ab = v3_sub(b, a), bc = v3_sub(c, b), ca = v3_sub(a, c);
    const double longest = fmax(v3_dot(ab, ab), fmax(v3_dot(bc, bc), v3_dot(ca, ca)));
    if (is_signed && !(side > 0.0)) return -1.0;
    return longest > 0.0 ? v3_norm(normal) / longest : 0.0;
}

/* The half-edge along which v is best taken out, -1: none. *n_folds: triangles turned over that would stand in its place. */
static loxo_index choose_halfedge(const sphere_embedding *e, loxo_index v, bool is_whole, bool is_patient, int *n_folds)
{
    loxo_index ring[MOST];
    loxo_vec3 at[MOST];
    double score[MOST];
    int folds[MOST];
    const int n = embedding_ring(e, v, MOST, ring);
    for (int i = 0; i < n; ++i)
        at[i] = is_whole ? k_position(&e->p->m, ring[i]) : v3_load(e->f[ring[i]]);
    for (int j = 0; j < n; ++j) {
        const int64_t n_after = (int64_t)e->degree[ring[j]] + n - 4;
        double least = 1.0;
        folds[j] = 0;
        for (int i = 1; i + 1 < n; ++i) {
            const int b = j + i < n ? j + i : j + i - n, c = b + 1 < n ? b + 1 : 0;
            const double quality = quality_of(at[j], at[b], at[c], !is_whole);
            folds[j] += quality < 0.0;
            least = fmin(least, quality);
        }
        /* least is within -1 and 1, the malus grows to 2 at most: 4 for a fold comes first */
        score[j] = -4.0 * folds[j] + least - fmin(2.0, n_after > CROWD ? MALUS * (double)(n_after - CROWD) : 0.0);
    }
    for (int k = 0; k < n; ++k) {
        int best = 0;
        for (int j = 1; j < n; ++j)
            if (score[j] > score[best]) best = j;
        loxo_index h = e->first[v];
        for (int j = 0; j < best; ++j)
            h = embedding_turn(e, h);
        if (sphere_embedding_can_collapse(e, h, is_patient)) {
            *n_folds = folds[best];
            return h;
        }
        score[best] = -HUGE_VAL;
    }
    return -1;
}

static bool leaves_first(const void *arg, const void *a, const void *b)
{
    const sphere_leaving *x = a, *y = b;
    (void)arg;
    return x->share > y->share || (x->share == y->share && x->vertex < y->vertex);
}

static void list_vertex(sphere_embedding *e, loxo_index v, int64_t *n_next)
{
    if (e->listed[v] == e->round + 1) return;
    e->listed[v] = e->round + 1;
    e->next_list[(*n_next)++] = v;
}

/* Those of the list that have to go, the ones with most folds first; how many. */
static int64_t find_leaving(sphere_embedding *e, bool is_whole)
{
    int64_t n = 0;
    for (int64_t i = 0; i < e->n_list; ++i) {
        const loxo_index v = e->list[i];
        if (e->degree[v] == 0) continue;
        const int n_folds = is_whole ? 0 : sphere_star_folds(e, v);
        if (n_folds > 0 || e->is_forced[v])
            e->leaving[n++] = (sphere_leaving){
                .vertex = v, .n_folds = (loxo_index)n_folds, .share = (double)n_folds / (double)e->degree[v]};
    }
    if (!is_whole) loxo_sort(e->leaving, n, sizeof *e->leaving, leaves_first, NULL);
    return n;
}

/* One round: no vertex and no neighbour of it are taken out both. How many were. */
static int64_t remove_round(sphere_embedding *e, bool is_whole, patience_level patience, int64_t n_leaving)
{
    const int most = is_whole && patience == ALL_GOOD ? FEW : MOST;
    int64_t n_next = 0, n_removed = 0;
    for (int64_t i = 0; i < n_leaving; ++i) {
        const loxo_index v = e->leaving[i].vertex;
        loxo_index ring[MOST], h = -1;
        int n_after = 0;
        if (e->lock[v] != e->round && e->degree[v] <= most)
            h = choose_halfedge(e, v, is_whole, patience == ANY, &n_after);
        if (n_after > 0 && patience != ANY && !(patience == FEWER && n_after < e->leaving[i].n_folds)) h = -1;
        if (h < 0) {
            list_vertex(e, v, &n_next);
            continue;
        }
        const int n = embedding_ring(e, v, MOST, ring);
        sphere_embedding_collapse(e, h);
        ++n_removed;
        for (int j = 0; j < n; ++j) {
            e->lock[ring[j]] = e->round;
            if (!is_whole) list_vertex(e, ring[j], &n_next);
        }
    }
    loxo_index *const now = e->next_list;
    e->next_list = e->list;
    e->list = now;
    e->n_list = n_next;
    return n_removed;
}

/* Nothing can be taken out where it should: the neighbours have to go too. */
static void force_neighbours(sphere_embedding *e)
{
    const int64_t n_old = e->n_list;
    int64_t n = n_old;
    for (int64_t i = 0; i < n_old; ++i) {
        const loxo_index v = e->list[i];
        loxo_index h = e->first[v];
        e->is_forced[v] = true;
        for (int64_t k = 0; k < e->degree[v]; ++k, h = embedding_turn(e, h)) {
            const loxo_index w = e->corner[k_next(h)];
            if (!e->is_forced[w] && e->listed[w] != e->round + 1) {
                e->listed[w] = e->round + 1;
                e->list[n++] = w;
            }
            e->is_forced[w] = true;
        }
    }
    e->n_list = n;
}

static bool remove_vertices(sphere_embedding *e, bool is_whole)
{
    patience_level patience = ALL_GOOD;
    e->round = 1;
    for (int64_t n_leaving; (n_leaving = find_leaving(e, is_whole)) > 0 && e->n_there > 4; ++e->round) {
        if (loxo_stop_wanted(e->p->ctx, "embed", 0.0)) return false;
        const int64_t n = remove_round(e, is_whole, patience, n_leaving);
        if (n > 0) {
            patience = ALL_GOOD;
        } else if (patience < ANY) {
            patience += 1;
        } else {
            force_neighbours(e);
        }
    }
    return true;
}

static void let_free(sphere_embedding *e, loxo_index v)
{
    if (e->is_free[v]) return;
    e->is_free[v] = true;
    e->free[e->n_free++] = v;
}

/* The corners of a regular tetrahedron for the four that are left. */
static void place_tetrahedron(sphere_embedding *e)
{
    static const double corner[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    const double size = sqrt(1.0 / 3.0);
    loxo_index v[4] = {0, 0, 0, 0};
    int n = 0;
    for (int64_t i = 0; i < e->p->m.n_vertices && n < 4; ++i)
        if (e->degree[i] > 0) v[n++] = (loxo_index)i;
    /* from v[0] counter-clockwise */
    (void)embedding_ring(e, v[0], 3, &v[1]);
    for (int k = 0; k < 4; ++k) {
        v3_store(e->f[v[k]], v3_scale(size, v3_load(corner[k])));
        let_free(e, v[k]);
    }
}

static bool relax_free(sphere_embedding *e, double fraction)
{
    for (int64_t i = 0; i < e->n_free; ++i) {
        if (i % BLOCK == 0 && loxo_stop_wanted(e->p->ctx, "embed", fraction)) return false;
        sphere_relax_vertex(e, e->free[i]);
    }
    return true;
}

/* A vertex of a patch is settled with the free ones around it. */
static void settle(sphere_embedding *e, loxo_index v)
{
    loxo_index ring[MOST];
    const int n = embedding_ring(e, v, MOST, ring);
    for (int i = 0; i < n && i < MOST; ++i)
        if (e->is_free[ring[i]]) sphere_relax_vertex(e, ring[i]);
    sphere_relax_vertex(e, v);
}

static bool restore_vertices(sphere_embedding *e, bool is_whole, int n_sweeps)
{
    const double n_all = (double)(e->n_removed > 0 ? e->n_removed : 1);
    double n_relaxed = (double)e->n_free;
    while (e->n_removed > 0) {
        const int32_t round = e->removed_round[e->n_removed - 1];
        const double fraction = 1.0 - (double)e->n_removed / n_all;
        while (e->n_removed > 0 && e->removed_round[e->n_removed - 1] == round) {
            if (e->n_removed % BLOCK == 0 && loxo_stop_wanted(e->p->ctx, "embed", fraction)) return false;
            const loxo_index v = sphere_embedding_restore(e);
            e->n_failed += !sphere_place_vertex(e, v);
            let_free(e, v);
            if (!is_whole) settle(e, v);
        }
        if ((double)e->n_free < GROWTH * n_relaxed && e->n_removed > 0) continue;
        n_relaxed = (double)e->n_free;
        const double early = fmin(EARLY_SWEEPS, (double)e->p->m.n_vertices / n_relaxed);
        const int n_now = is_whole && early > (double)n_sweeps ? (int)early : n_sweeps;
        for (int k = 0; k < n_now; ++k)
            if (!relax_free(e, fraction)) return false;
    }
    return true;
}

loxo_status sphere_embed(sphere_embedding *e, bool is_whole, int n_sweeps)
{
    e->n_list = 0;
    for (int64_t i = 0; i < e->p->m.n_vertices; ++i) {
        const loxo_index v = (loxo_index)i;
        if (e->degree[v] == 0) continue;
        e->is_forced[v] |= is_whole;
        e->list[e->n_list++] = v;
    }
    bool is_going_on = remove_vertices(e, is_whole);
    if (is_going_on && e->n_there == 4 && (is_whole || find_leaving(e, false) > 0)) place_tetrahedron(e);
    is_going_on = is_going_on && restore_vertices(e, is_whole, n_sweeps);
    while (e->n_removed > 0) {
        const loxo_index v = sphere_embedding_restore(e);
        const loxo_vec3 at = v3_load(e->f[e->corner[k_next(e->first[v])]]);
        v3_store(e->f[v], at);
    }
    return is_going_on ? LOXO_OK : LOXO_STOPPED;
}
