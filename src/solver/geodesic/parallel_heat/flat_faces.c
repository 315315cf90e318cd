/* SPDX-License-Identifier: MIT
 * Faces without a direction: those without area, or with the same heat at all corners. A difference of zero along their
 * edges would be a target like any other and pull the distance towards a constant; they take over what their neighbours
 * want instead. */
#include "kernel/layout_kernel.h"
#include "par/range.h"
#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

static bool is_flat(const double *difference, int64_t f)
{
    const double *d = &difference[3 * f];
    return d[0] == 0.0 && d[1] == 0.0 && d[2] == 0.0;
}

static bool is_reached(const parallel_heat *g, int64_t f)
{
    const loxo_index *v = &g->m.halfedge_vertex[3 * f];
    return g->rank[v[0]] >= 0 && g->rank[v[1]] >= 0 && g->rank[v[2]] >= 0;
}

/* Edges to faces with a direction get the difference that these want. The others share, by their length, what closes the
 * face. */
static void fill(const parallel_heat *g, double *difference, int64_t f)
{
    double *d = &difference[3 * f], known = 0.0, length[3], unknown_length = 0.0;
    k_face_lengths(&g->m, f, length);
    for (int c = 0; c < 3; ++c) {
        const loxo_index h = (loxo_index)(3 * f + c), t = g->m.halfedge_twin[h];
        if (t >= 0 && !is_flat(difference, k_face_of(t))) {
            length[c] = 0.0;
            d[c] = -difference[t];
            known += d[c];
        } else {
            unknown_length += length[c];
        }
    }
    for (int c = 0; c < 3 && unknown_length > 0.0; ++c)
        if (length[c] > 0.0) d[c] = -known * (length[c] / unknown_length);
}

typedef struct looking {
    const parallel_heat *g;
    const double *difference;
} looking;

static void partial_flat(int64_t begin, int64_t end, const void *arg, double *sums)
{
    const looking *a = arg;
    for (int64_t f = begin; f < end; ++f)
        sums[0] += is_flat(a->difference, f) && is_reached(a->g, f) ? 1.0 : 0.0;
}

loxo_status heat_fill_flat_faces(parallel_heat *g, double *difference)
{
    const looking arg = {g, difference};
    double n_flat = 0.0;
    const loxo_status status = loxo_sum(g->ctx, g->m.n_faces, 1, partial_flat, &arg, &n_flat);
    if (status < 0) return status;
    for (int64_t f = 0; f < g->m.n_faces && n_flat > 0.0; ++f) { /* one after the other: a row of them is filled, too */
        if (!is_flat(difference, f) || !is_reached(g, f)) continue;
        n_flat -= 1.0;
        double *d = &difference[3 * f];
        fill(g, difference, f);
        if (g->settings.method == LOXO_GEODESIC_EDGE) continue;
        d[2] = -(d[0] + d[1]); /* a gradient */
        g->target[f][0] = d[0];
        g->target[f][1] = d[1];
    }
    return LOXO_OK;
}
