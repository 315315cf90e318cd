/* SPDX-License-Identifier: MIT
 * A host that calls from parallel regions of its own: several of its threads at once, each with a context, get the bits
 * that a lone call gives. */
#include "../solver/surfaces.h"

#include <omp.h>

#define N_HOSTS 3

typedef struct call {
    const loxo_soup *soup; /* only read */
    int n_threads;         /* of the context */
    loxo_geodesic_method method;
    loxo_status status;
    uint64_t hash;
    size_t left_bytes; /* in the context when all is destroyed */
} call;

/* All of it: no checks in here, which may not jump out of a region. */
static void run(call *c)
{
    loxo_context_settings settings = loxo_context_settings_default();
    loxo_geodesic_settings geodesic = unjudged_settings(c->method);
    const loxo_mesh_arrays arrays = loxo_soup_arrays(c->soup);
    const loxo_index sources[] = {5, 700, (loxo_index)(c->soup->n_vertices - 1)};
    loxo_context *ctx = NULL;
    loxo_mesh *mesh = NULL;
    loxo_geodesic_info info;
    geodesic.global_constraints = true;
    settings.n_threads = c->n_threads;
    c->status = loxo_context_create(&settings, &ctx);
    if (c->status < 0) return;
    double *distance = loxo_allocate(ctx, c->soup->n_vertices, sizeof *distance);
    c->status = distance != NULL ? loxo_mesh_create(ctx, &arrays, LOXO_COPY, NULL, NULL, &mesh) : LOXO_ERR_MEMORY;
    if (c->status >= 0) c->status = loxo_geodesic_distance(ctx, mesh, &geodesic, sources, 3, distance, &info);
    if (c->status >= 0) c->hash = test_hash(distance, (size_t)c->soup->n_vertices * sizeof *distance);
    loxo_release(ctx, distance);
    loxo_mesh_destroy(mesh);
    c->left_bytes = loxo_context_memory(ctx).current_bytes;
    loxo_context_destroy(ctx);
}

/* The mesh is different for each of the host's threads, so that what is shared would show. */
static void check_hosts(loxo_geodesic_method method, int most_levels)
{
    NEEDS_IDS(6 * 20000);
    static const loxo_shape shapes[N_HOSTS] = {LOXO_SHAPE_NOISY, LOXO_SHAPE_TORUS, LOXO_SHAPE_BUMPY};
    loxo_soup soup[N_HOSTS];
    call alone[N_HOSTS], together[N_HOSTS];
    const int levels_before = omp_get_max_active_levels();
    for (int i = 0; i < N_HOSTS; ++i) {
        soup[i] = soup_make(test_context, shapes[i], 20000 - 3000 * i, NAN);
        alone[i] = together[i] = (call){.soup = &soup[i], .n_threads = 1, .method = method};
        run(&alone[i]);
        CHECK_EQUAL(alone[i].status, LOXO_OK);
        together[i].n_threads = 1 + i;
    }
    omp_set_max_active_levels(most_levels); /* 2: the host lets regions nest */
#pragma omp parallel for num_threads(N_HOSTS) schedule(static, 1)
    for (int i = 0; i < N_HOSTS; ++i)
        for (int k = 0; k < 2; ++k)
            run(&together[i]);
    omp_set_max_active_levels(levels_before);
    for (int i = 0; i < N_HOSTS; ++i) {
        CHECK_EQUAL(together[i].status, LOXO_OK);
        CHECK(together[i].hash == alone[i].hash);
        CHECK_EQUAL(together[i].left_bytes, 0);
        loxo_soup_destroy(test_context, &soup[i]);
    }
}

TEST(edge_in_regions_of_a_host) { check_hosts(LOXO_GEODESIC_EDGE, 1); }

TEST(face_in_regions_of_a_host) { check_hosts(LOXO_GEODESIC_FACE, 1); }

TEST(edge_where_regions_may_nest) { check_hosts(LOXO_GEODESIC_EDGE, 2); }
