/* SPDX-License-Identifier: MIT
 * Which order a mesh gets, and its parts: ranges of vertices whose data fit half of one core's second-level cache, so
 * that a kernel which passes over a part more than once finds it there. */
#include "mesh/reorder.h"

#include "base/allocate.h"
#include "base/context.h"
#include "mesh/partition.h"
#include "mesh/reorder_internal.h"
#include "par/range.h"

/* What a solver touches a vertex: 76 bytes of mesh and about as much of its own. */
#define BYTES_A_VERTEX 150
/* Below that no cache is too small, and asking for its size would cost more than it tells. */
#define SMALL 1024

static loxo_status part_size(loxo_context *ctx, int64_t n_vertices, size_t part_bytes, int64_t *n_part_vertices)
{
    *n_part_vertices = SMALL;
    if (part_bytes == 0 && n_vertices <= SMALL) return LOXO_OK;
    if (part_bytes == 0) {
        loxo_machine machine;
        const loxo_status status = loxo_machine_get(ctx, &machine);
        if (status < 0) return status;
        part_bytes = (machine.l2_bytes > 0 ? machine.l2_bytes : (size_t)1 << 20) / 2;
    }
    const size_t fitting = part_bytes / BYTES_A_VERTEX;
    *n_part_vertices = fitting < 64 ? 64 : fitting > LOXO_INDEX_MAX ? LOXO_INDEX_MAX : (int64_t)fitting;
    return LOXO_OK;
}

/* Marks the vertices that triangles use. Bytes are set to the same value by whoever comes: in any order the same. */
static void mark_used(loxo_context *ctx, const loxo_mesh_arrays *arrays, unsigned char *is_used)
{
    const int n_threads = loxo_threads_for(ctx, arrays->n_faces, 5.0);
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(3 * arrays->n_faces);
        for (int64_t h = r.begin; h < r.end; ++h) {
            unsigned char *mark = &is_used[arrays->triangle[h]];
            if (__atomic_load_n(mark, __ATOMIC_RELAXED) == 0) __atomic_store_n(mark, 1, __ATOMIC_RELAXED);
        }
    }
}

static loxo_status even_parts(loxo_context *ctx, int64_t n_vertices, int64_t n_parts, loxo_reordering *out)
{
    out->n_parts = n_parts;
    out->part_vertex = loxo_allocate(ctx, n_parts + 1, sizeof *out->part_vertex);
    if (out->part_vertex == NULL) return LOXO_ERR_MEMORY;
    out->part_vertex[0] = 0;
    for (int64_t p = 0; p < n_parts; ++p)
        out->part_vertex[p + 1] = loxo_range_of(n_vertices, p, n_parts).end;
    return LOXO_OK;
}

/* Jumps a vertex up to which the caller's order is kept. Measured at one million vertices, one thread, ns a vertex of a
 * pass over the fans of all vertices, and of a pass over all faces and their twins:
 *     jumps   0.007 (rows) 14.8, 7.9   0.009 (rows cut in blocks of 512, shuffled) 18.8, 14.4   0.03 (blocks of 128) 33, 18
 *             0.1 (blocks of 32) 56, 28    4.5 (random) 343, 49       Hilbert: 0.045, by cubes, all in cache: 17, 15
 * Scans as they are found: 0.02 to 0.5. Making the Hilbert order costs 60 to 80 ns a vertex, before anything is moved.
 * So rows, slices and levels stay as they are, and so does what is in a space-filling order already.
 *
 * Whole jobs (order, half-edges, one edge-based solve; `loxo-bench orders`, the table in bench/README.md) say the same: what
 * a generator or a scanner numbered is done first as given, by 7 % at least against Morton, except for a subdivided scan
 * (7 % behind Morton, 4 % ahead of Hilbert); shuffled, Hilbert and Morton halve the time or better, and BFS and METIS, whose
 * solves are as fast or a tenth faster, cost that many solves more to make that they never catch up in one. */
#define LOCAL_ENOUGH 0.05

static loxo_status choose(loxo_context *ctx, const loxo_mesh_arrays *arrays, int64_t n_parts, loxo_order *order)
{
    double jumps_a_vertex = 0.0;
    if (*order != LOXO_ORDER_AUTO) return LOXO_OK;
    *order = LOXO_ORDER_GIVEN;
    if (n_parts == 1) return LOXO_OK; /* all of it fits the cache */
    const loxo_status status = loxo_count_jumps(ctx, arrays, &jumps_a_vertex);
    if (jumps_a_vertex > LOCAL_ENOUGH) *order = LOXO_ORDER_HILBERT;
    return status;
}

/* METIS gives the parts; breadth-first inside each takes their graph, which is there anyway.
 *
 * The curves' parts stay in the order of the curve: breadth-first inside them saves the passes above 3 of 17 and 4 of 15
 * ns, and costs 70 ns a vertex where the mesh came in rows and 700 where it came shuffled (1M vertices, two threads):
 * more than a solve wins back. */
static loxo_status order_by_parts(loxo_context *ctx, const loxo_mesh_arrays *arrays, const unsigned char *is_used,
                                  int64_t n_parts, loxo_reordering *out)
{
    const int64_t n = arrays->n_vertices;
    loxo_status status = LOXO_ERR_MEMORY;
    int64_t n_filled = 0;
    loxo_index *part = loxo_allocate_zero(ctx, n, sizeof *part);
    out->part_vertex = loxo_allocate(ctx, n_parts + 1, sizeof *out->part_vertex);
    if (part == NULL || out->part_vertex == NULL) goto done;
    if (n_parts > 1 && (status = loxo_partition_parts(ctx, arrays, n_parts, part)) < 0) goto done;
    status = loxo_order_bfs(ctx, arrays, is_used, part, n_parts, out->part_vertex, out->vertex_new_to_old);
    if (status < 0) goto done;
    for (int64_t p = 0; p < n_parts; ++p) /* METIS may leave a part empty */
        if (out->part_vertex[p + 1] > out->part_vertex[n_filled])
            out->part_vertex[++n_filled] = out->part_vertex[p + 1];
    out->n_parts = n_filled > 0 ? n_filled : 1;
done:
    loxo_release(ctx, part);
    return status;
}

static loxo_status order_by(loxo_context *ctx, const loxo_mesh_arrays *arrays, const unsigned char *is_used,
                            int64_t n_parts, loxo_reordering *out)
{
    loxo_status status = LOXO_OK;
    int64_t whole[2];
    switch (out->order) {
    case LOXO_ORDER_METIS: return order_by_parts(ctx, arrays, is_used, n_parts, out);
    case LOXO_ORDER_METIS_ND: status = loxo_partition_dissect(ctx, arrays, is_used, out->vertex_new_to_old); break;
    case LOXO_ORDER_BFS: status = loxo_order_bfs(ctx, arrays, is_used, NULL, 1, whole, out->vertex_new_to_old); break;
    default:
        status = loxo_order_curve(ctx, arrays, is_used, out->order == LOXO_ORDER_HILBERT, out->vertex_new_to_old);
        break;
    }
    return status < 0 ? status : even_parts(ctx, arrays->n_vertices, n_parts, out);
}

loxo_status loxo_reorder(loxo_context *ctx, const loxo_mesh_arrays *arrays, loxo_order order, size_t part_bytes,
                         loxo_reordering *out)
{
    const int64_t n = arrays->n_vertices;
    int64_t n_part_vertices = 0;
    unsigned char *is_used = NULL;
    loxo_status status;
    *out = (loxo_reordering){0};
    if ((int)order < LOXO_ORDER_AUTO || (int)order > LOXO_ORDER_METIS_ND)
        return loxo_fail(ctx, LOXO_ERR_ARGUMENT, "mesh: no order has number %d", (int)order);
    if ((status = part_size(ctx, n, part_bytes, &n_part_vertices)) < 0) return status;
    const int64_t n_parts = n > n_part_vertices ? (n + n_part_vertices - 1) / n_part_vertices : 1;
    if ((status = choose(ctx, arrays, n_parts, &order)) < 0) return status;
    out->order = order;
    if (order == LOXO_ORDER_GIVEN) return even_parts(ctx, n, n_parts, out);

    if (loxo_stop_wanted(ctx, "order", 0.0)) return loxo_fail(ctx, LOXO_ERR_STOPPED, "mesh: stopped while ordering");
    status = LOXO_ERR_MEMORY;
    is_used = loxo_allocate_zero(ctx, n, sizeof *is_used);
    out->vertex_new_to_old = loxo_allocate(ctx, n, sizeof *out->vertex_new_to_old);
    if (is_used != NULL && out->vertex_new_to_old != NULL) {
        mark_used(ctx, arrays, is_used);
        status = order_by(ctx, arrays, is_used, n_parts, out);
    }
    loxo_release(ctx, is_used);
    if (status < 0) loxo_reordering_destroy(ctx, out);
    return status;
}

void loxo_reordering_destroy(loxo_context *ctx, loxo_reordering *r)
{
    loxo_release(ctx, r->vertex_new_to_old);
    loxo_release(ctx, r->part_vertex);
    *r = (loxo_reordering){0};
}
