/* SPDX-License-Identifier: MIT
 * Places of vertices among their neighbours. What counts in the end is the sign of every triangle by its rounded corners. */
#include "kernel/conformal_kernel.h"
#include "solver/sphere/embedding.h"

#define LEAST_UP   0.3 /* stars that reach farther than 70 degrees are not taken to a plane */
#define N_STEPS    2   /* of Newton's method in a visit */
#define LEAST_MEAN 0.1 /* of neighbours, to be a direction */

int sphere_star_folds(const sphere_embedding *e, loxo_index v)
{
    const loxo_vec3 x = v3_load(e->f[v]);
    const int64_t n = e->degree[v];
    loxo_index h = e->first[v];
    int n_folds = 0;
    for (int64_t i = 0; i < n; ++i, h = embedding_turn(e, h)) {
        double side;
        (void)k_image_normal(x, v3_load(e->f[e->corner[k_next(h)]]), v3_load(e->f[e->corner[k_previous(h)]]), &side);
        n_folds += !(side > 0.0);
    }
    return n_folds;
}

/* The least height of the triangles around v, over their size: what is made larger where there is no plane. */
static double least_side(const sphere_embedding *e, loxo_index v, int n, const loxo_index *ring)
{
    const loxo_vec3 x = v3_load(e->f[v]);
    double least = HUGE_VAL;
    for (int i = 0; i < n; ++i) {
        double side;
        (void)k_image_normal(x, v3_load(e->f[ring[i]]), v3_load(e->f[ring[i + 1 < n ? i + 1 : 0]]), &side);
        least = side > least ? least : side;
    }
    return least;
}

/* Towards the mean of the neighbours. */
static void relax_large(sphere_embedding *e, loxo_index v, int n, const loxo_index *ring)
{
    const loxo_vec3 before = v3_load(e->f[v]);
    const double least = least_side(e, v, n, ring);
    loxo_vec3 sum = {0.0, 0.0, 0.0};
    for (int i = 0; i < n; ++i)
        sum = v3_add(sum, v3_load(e->f[ring[i]]));
    const double length = v3_norm(sum);
    if (!(length > LEAST_MEAN)) return;
    const loxo_vec3 way = v3_sub(v3_scale(1.0 / length, sum), before);
    if (v3_dot(way, before) < -1.0) return; /* on the other side of the sphere */
    double share = 1.0;
    for (int k = 0; k < 4; ++k) {
        v3_store(e->f[v], k_unit(v3_axpy(before, share, way)));
        if (least_side(e, v, n, ring) > least) return;
        share *= 0.5;
    }
    v3_store(e->f[v], before);
}

static double surface_distance(const sphere_embedding *e, loxo_index v, loxo_index w)
{
    return v3_norm(v3_sub(k_position(&e->p->m, v), k_position(&e->p->m, w)));
}

void sphere_relax_vertex(sphere_embedding *e, loxo_index v)
{
    loxo_index ring[K_STAR_MOST];
    double to_ring[K_STAR_MOST];
    k_star star;
    const int n = embedding_ring(e, v, K_STAR_MOST, ring);
    const loxo_vec3 before = v3_load(e->f[v]);
    const k_frame frame = k_frame_at(before);
    double radius = 0.0;
    if (n > K_STAR_MOST) return;
    star.n = n;
    /* the plane that touches the sphere in v, seen from the centre: arcs become straight */
    for (int i = 0; i < n; ++i) {
        const loxo_vec3 q = k_frame_in(&frame, v3_load(e->f[ring[i]]));
        if (q.z < LEAST_UP) {
            relax_large(e, v, n, ring);
            return;
        }
        star.ring[i][0] = q.x / q.z;
        star.ring[i][1] = q.y / q.z;
        radius = fmax(radius, fmax(fabs(star.ring[i][0]), fabs(star.ring[i][1])));
    }
    if (!(radius > e->least_radius)) return;
    for (int i = 0; i < n; ++i) {
        star.ring[i][0] /= radius;
        star.ring[i][1] /= radius;
        to_ring[i] = surface_distance(e, v, ring[i]);
    }
    for (int i = 0; i < n; ++i) {
        const int next = i + 1 < n ? i + 1 : 0;
        k_star_set_face(&star, i, to_ring[i], to_ring[next], surface_distance(e, ring[i], ring[next]));
    }
    double x[2] = {0.0, 0.0}, energy = k_star_energy(&star, 0.0, 0.0);
    bool is_moved = false;
    for (int k = 0; k < N_STEPS && energy < HUGE_VAL; ++k) {
        const bool is_lower = k_star_step(&star, x, &energy);
        is_moved |= is_lower;
        if (!is_lower) break;
    }
    if (!is_moved) return;
    v3_store(e->f[v], k_frame_out(&frame, (loxo_vec3){radius * x[0], radius * x[1], 1.0}));
    if (sphere_star_folds(e, v) > 0) v3_store(e->f[v], before);
}

bool sphere_place_vertex(sphere_embedding *e, loxo_index v)
{
    loxo_index ring[EMBEDDING_MOST_NEIGHBOURS];
    loxo_vec3 at[EMBEDDING_MOST_NEIGHBOURS], place;
    const int n = embedding_ring(e, v, EMBEDDING_MOST_NEIGHBOURS, ring);
    for (int i = 0; i < n; ++i)
        at[i] = v3_load(e->f[ring[i]]);
    if (!k_star_center(n, at, &place)) place = at[0];
    /* by rounding the middle may turn something over where a point nearer to the first neighbour does not */
    for (int k = 0; k < 4; ++k) {
        v3_store(e->f[v], place);
        if (sphere_star_folds(e, v) == 0) {
            sphere_relax_vertex(e, v);
            return true;
        }
        place = k_unit(v3_add(place, at[0]));
    }
    return false;
}
