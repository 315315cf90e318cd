/* SPDX-License-Identifier: MIT
 * After a solve within a small ball: which vertices it has touched. */
#include "solver/geodesic/touched.h"

#include "base/sort.h"
#include "kernel/layout_kernel.h"

#include <math.h>

/* Of more than one vertex in so many the list comes into order by a look at the marks of all, else by sorting. */
#define FEW_OF 64

static void touch(const geodesic_touch *t, loxo_index v, loxo_index *list, int64_t room, int64_t *n)
{
    if (!(t->distance[v] < HUGE_VAL) && (t->flags[v] & t->reached) == 0) return;
    if ((t->flags[v] & t->listed) != 0 || *n == room) return;
    t->flags[v] = (uint8_t)(t->flags[v] | t->listed);
    list[(*n)++] = v;
}

static bool by_number(const void *arg, const void *a, const void *b)
{
    (void)arg;
    return *(const loxo_index *)a < *(const loxo_index *)b;
}

int64_t geodesic_list_touched(const geodesic_touch *t, const geodesic_seed *seeds, int64_t n_seeds, loxo_index *list,
                              int64_t room)
{
    const loxo_mesh_view *m = t->m;
    int64_t n = 0;
    for (int64_t i = 0; i < n_seeds; ++i)
        for (int k = 0; k < 3; ++k)
            touch(t, m->halfedge_vertex[(int64_t)3 * seeds[i].face + k], list, room, &n);
    for (int64_t i = 0; i < n; ++i) {
        const loxo_index first = m->vertex_halfedge[list[i]];
        loxo_index h = first;
        do {
            touch(t, k_head(m, h), list, room, &n);
            touch(t, m->halfedge_vertex[k_previous(h)], list, room, &n);
            h = m->halfedge_twin[k_previous(h)];
        } while (h >= 0 && h != first);
    }
    if (n > m->n_vertices / FEW_OF) {
        int64_t k = 0;
        for (int64_t v = 0; v < m->n_vertices && k < n; ++v)
            if ((t->flags[v] & t->listed) != 0) list[k++] = (loxo_index)v;
    } else
        loxo_sort(list, n, sizeof *list, by_number, NULL);
    for (int64_t i = 0; i < n; ++i)
        t->flags[list[i]] = (uint8_t)(t->flags[list[i]] & ~t->listed);
    return n;
}
