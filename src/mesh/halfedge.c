/* SPDX-License-Identifier: MIT */
#include "mesh/halfedge.h"

#include "base/allocate.h"
#include "base/sort.h"
#include "mesh/soup.h"
#include "par/range.h"

#include <string.h>

/* ---- twins --------------------------------------------------------------------------------------------------- */

/* Half-edges by the lower one of their vertices: those of v are entry[begin[v]..begin[v + 1] - 1]. */
typedef struct buckets {
    int64_t *begin;
    loxo_index *entry;
} buckets;

/* Counts or hands out k places; with other threads about, atomically. The places a thread gets depend on the others,
 * so what is made of a bucket must not depend on the order in it. */
static inline int64_t take(int64_t *counter, int64_t k, bool is_shared)
{
    if (is_shared) return __atomic_fetch_add(counter, k, __ATOMIC_RELAXED);
    const int64_t at = *counter;
    *counter += k;
    return at;
}

/* Of the three half-edges of a face two have its lowest vertex, one the middle one as their lower. */
typedef struct face_split {
    loxo_index lowest, middle;      /* vertices */
    loxo_index first, second, last; /* corners: the half-edges at lowest, lowest, middle */
} face_split;

static inline face_split split_face(const loxo_index *v)
{
    const int low = v[0] < v[1] ? (v[0] < v[2] ? 0 : 2) : (v[1] < v[2] ? 1 : 2);
    const int next = low == 2 ? 0 : low + 1, previous = low == 0 ? 2 : low - 1;
    return (face_split){
        .lowest = v[low],
        .middle = v[next] < v[previous] ? v[next] : v[previous],
        .first = (loxo_index)low,
        .second = (loxo_index)previous,
        .last = (loxo_index)next,
    };
}

static void fill_buckets(loxo_context *ctx, int64_t n_vertices, int64_t n_faces, const loxo_index *triangle,
                         loxo_index *twin, const buckets *b)
{
    const int n_threads = loxo_threads_for(ctx, n_faces, 20);
    const bool is_shared = n_threads > 1;
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range v = loxo_thread_range(n_vertices + 1), r = loxo_thread_range(n_faces);
        memset(b->begin + v.begin, 0, (size_t)(v.end - v.begin) * sizeof *b->begin);
#pragma omp barrier
        for (int64_t f = r.begin; f < r.end; ++f) {
            if (loxo_is_degenerate(&triangle[3 * f])) continue;
            const face_split s = split_face(&triangle[3 * f]);
            take(&b->begin[1 + s.lowest], 2, is_shared);
            take(&b->begin[1 + s.middle], 1, is_shared);
        }
    }
    loxo_bucket_starts(ctx, n_vertices, b->begin);
#pragma omp parallel num_threads(n_threads)
    {
        const loxo_range r = loxo_thread_range(n_faces);
        for (int64_t f = r.begin; f < r.end; ++f) {
            if (loxo_is_degenerate(&triangle[3 * f])) {
                twin[3 * f] = twin[3 * f + 1] = twin[3 * f + 2] = LOXO_NO_EDGE;
                continue;
            }
            const face_split s = split_face(&triangle[3 * f]);
            const int64_t at = take(&b->begin[1 + s.lowest], 2, is_shared);
            b->entry[at] = (loxo_index)(3 * f + s.first);
            b->entry[at + 1] = (loxo_index)(3 * f + s.second);
            b->entry[take(&b->begin[1 + s.middle], 1, is_shared)] = (loxo_index)(3 * f + s.last);
        }
    }
}

/* A bucket's vertex, for comparing its half-edges. */
typedef struct bucket_key {
    const loxo_index *triangle;
    loxo_index vertex;
} bucket_key;

static inline loxo_index other_vertex(const bucket_key *key, loxo_index h)
{
    const loxo_index start = key->triangle[h];
    return start != key->vertex ? start : key->triangle[loxo_halfedge_next(h)];
}

static bool by_other_vertex(const void *arg, const void *item_a, const void *item_b)
{
    const loxo_index a = *(const loxo_index *)item_a, b = *(const loxo_index *)item_b;
    const loxo_index other_a = other_vertex(arg, a), other_b = other_vertex(arg, b);
    return other_a != other_b ? other_a < other_b : a < b;
}

/* The half-edges of one edge, ascending. */
static void link_edge(const loxo_index *triangle, const loxo_index *h, int64_t n, loxo_index *twin,
                      loxo_edge_counts *counts)
{
    counts->n_edges += 1;
    if (n == 1) {
        twin[h[0]] = -1;
        counts->n_boundary += 1;
        return;
    }
    twin[h[0]] = h[n - 1];
    for (int64_t i = 1; i < n; ++i)
        twin[h[i]] = h[i - 1];
    if (n == 2) {
        counts->n_same_way += triangle[h[0]] == triangle[h[1]];
        return;
    }
    counts->n_nonmanifold += 1;
    if (counts->first_nonmanifold < 0 || h[0] < counts->first_nonmanifold) counts->first_nonmanifold = h[0];
}

#define SMALL_BUCKET 24

/* Buckets have six half-edges on average: compare all with all. False, with nothing written, when an edge has more
 * than two: the sorted way takes those. */
static bool match_small(const bucket_key *key, const loxo_index *entry, int n, loxo_index *twin,
                        loxo_edge_counts *counts)
{
    loxo_index other[SMALL_BUCKET];
    int8_t mate[SMALL_BUCKET];
    int n_pairs = 0, n_same_way = 0;
    for (int i = 0; i < n; ++i) {
        const loxo_index start = key->triangle[entry[i]];
        other[i] = other_vertex(key, entry[i]);
        mate[i] = -1;
        for (int j = 0; j < i; ++j) {
            if (other[j] != other[i]) continue;
            if (mate[j] >= 0) return false;
            mate[i] = (int8_t)j;
            mate[j] = (int8_t)i;
            n_pairs += 1;
            n_same_way += key->triangle[entry[j]] == start;
            break;
        }
    }
    for (int i = 0; i < n; ++i)
        twin[entry[i]] = mate[i] < 0 ? -1 : entry[mate[i]];
    counts->n_edges += n - n_pairs;
    counts->n_boundary += n - 2 * n_pairs;
    counts->n_same_way += n_same_way;
    return true;
}

static void match_bucket(const bucket_key *key, loxo_index *entry, int64_t n, loxo_index *twin,
                         loxo_edge_counts *counts)
{
    if (n <= SMALL_BUCKET && match_small(key, entry, (int)n, twin, counts)) return;
    loxo_sort(entry, n, sizeof *entry, by_other_vertex, key);
    for (int64_t begin = 0, end; begin < n; begin = end) {
        const loxo_index other = other_vertex(key, entry[begin]);
        end = begin + 1;
        while (end < n && other_vertex(key, entry[end]) == other)
            ++end;
        link_edge(key->triangle, entry + begin, end - begin, twin, counts);
    }
}

loxo_status loxo_match_halfedges(loxo_context *ctx, int64_t n_vertices, int64_t n_faces, const loxo_index *triangle,
                                 loxo_index *twin, loxo_edge_counts *counts)
{
    loxo_status status = LOXO_ERR_MEMORY;
    int64_t n_edges = 0, n_boundary = 0, n_nonmanifold = 0, n_same_way = 0, first = INT64_MAX;
    buckets b = {0};
    *counts = (loxo_edge_counts){.first_nonmanifold = -1};
    b.begin = loxo_allocate(ctx, n_vertices + 1, sizeof *b.begin);
    if (b.begin == NULL) goto done;
    b.entry = loxo_allocate(ctx, 3 * n_faces, sizeof *b.entry);
    if (b.entry == NULL) goto done;
    fill_buckets(ctx, n_vertices, n_faces, triangle, twin, &b);
#pragma omp parallel num_threads(loxo_threads_for(ctx, n_faces, 30)) reduction(min : first)                            \
    reduction(+ : n_edges, n_boundary, n_nonmanifold, n_same_way)
    {
        const loxo_range r = loxo_thread_range(n_vertices);
        loxo_edge_counts mine = {.first_nonmanifold = -1};
        for (int64_t v = r.begin; v < r.end; ++v)
            match_bucket(&(bucket_key){triangle, (loxo_index)v}, b.entry + b.begin[v], b.begin[v + 1] - b.begin[v],
                         twin, &mine);
        n_edges += mine.n_edges;
        n_boundary += mine.n_boundary;
        n_nonmanifold += mine.n_nonmanifold;
        n_same_way += mine.n_same_way;
        if (mine.first_nonmanifold >= 0) first = mine.first_nonmanifold;
    }
    *counts = (loxo_edge_counts){n_edges, n_boundary, n_nonmanifold, n_same_way, first == INT64_MAX ? -1 : first};
    status = LOXO_OK;
done:
    loxo_release(ctx, b.entry);
    loxo_release(ctx, b.begin);
    return status;
}

/* ---- vertices ------------------------------------------------------------------------------------------------ */

/* While the lowest is searched: the half-edge, with the top bit where it has a twin, so that boundary ones are lower. */
#if LOXO_INDEX_MAX == INT16_MAX
typedef uint16_t rank;
#else
typedef uint32_t rank;
#endif
#define RANK_NONE  ((rank) ~(rank)0)
#define RANK_INNER ((rank)(RANK_NONE / 2 + 1)) /* of a rank: ~ of 16 bits is an int, and negative */

static void lower_rank(loxo_index *place, rank mine)
{
    loxo_index seen = __atomic_load_n(place, __ATOMIC_RELAXED);
    while (mine < (rank)seen)
        if (__atomic_compare_exchange_n(place, &seen, (loxo_index)mine, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED))
            return;
}

/* Half-edges met by turning counter-clockwise from h. */
static int64_t turn_around(const loxo_index *twin, loxo_index begin)
{
    int64_t n = 0;
    loxo_index h = begin;
    do {
        ++n;
        h = twin[loxo_halfedge_previous(h)];
    } while (h >= 0 && h != begin);
    return n;
}

int64_t loxo_link_vertices(loxo_context *ctx, int64_t n_vertices, int64_t n_faces, const loxo_index *triangle,
                           const loxo_index *twin, loxo_index *vertex_halfedge)
{
    int64_t n_met = 0;
#pragma omp parallel num_threads(loxo_threads_for(ctx, n_faces, 20)) reduction(+ : n_met)
    {
        const loxo_range v = loxo_thread_range(n_vertices), r = loxo_thread_range(3 * n_faces);
        for (int64_t i = v.begin; i < v.end; ++i)
            vertex_halfedge[i] = (loxo_index)RANK_NONE;
#pragma omp barrier
        for (int64_t h = r.begin; h < r.end; ++h)
            lower_rank(&vertex_halfedge[triangle[h]], (rank)(twin[h] < 0 ? (rank)h : (rank)((rank)h | RANK_INNER)));
#pragma omp barrier
        for (int64_t i = v.begin; i < v.end; ++i) {
            const rank found = (rank)vertex_halfedge[i];
            if (found == RANK_NONE) continue; /* the same bits as -1 */
            vertex_halfedge[i] = (loxo_index)(found & (rank)~RANK_INNER);
            n_met += turn_around(twin, vertex_halfedge[i]);
        }
    }
    return n_met;
}

/* Leaves the corner of half-edge h at vertex v over edge e, corner by corner, until a boundary or back at h. */
static int64_t turn_over(const loxo_index *triangle, const loxo_index *twin, loxo_index h, loxo_index e, bool *closed)
{
    const loxo_index v = triangle[h];
    int64_t n = 0;
    *closed = false;
    while (loxo_is_paired(twin, e)) {
        const loxo_index t = twin[e];
        const bool leaves = triangle[t] == v;
        const loxo_index corner = leaves ? t : loxo_halfedge_next(t);
        if (corner == h) {
            *closed = true;
            break;
        }
        ++n;
        e = leaves ? loxo_halfedge_previous(t) : corner;
    }
    return n;
}

int64_t loxo_fan_size(const loxo_index *triangle, const loxo_index *twin, loxo_index h)
{
    bool closed;
    int64_t n = 1 + turn_over(triangle, twin, h, loxo_halfedge_previous(h), &closed);
    if (!closed) n += turn_over(triangle, twin, h, h, &closed);
    return n;
}

/* ---- orientation --------------------------------------------------------------------------------------------- */

loxo_status loxo_find_orientation(loxo_context *ctx, int64_t n_faces, const loxo_index *triangle,
                                  const loxo_index *twin, uint8_t *turn, int64_t *n_turned, int64_t *conflict)
{
    enum { NOT_SEEN = 2 };
    loxo_index *queue = loxo_allocate(ctx, n_faces, sizeof *queue);
    *n_turned = 0;
    *conflict = -1;
    if (queue == NULL) return LOXO_ERR_MEMORY;
    memset(turn, NOT_SEEN, (size_t)n_faces);
    for (int64_t root = 0; root < n_faces; ++root) {
        if (turn[root] != NOT_SEEN) continue;
        int64_t head = 0, tail = 1, n_against = 0;
        queue[0] = (loxo_index)root;
        turn[root] = 0;
        while (head < tail) {
            const loxo_index f = queue[head++];
            n_against += turn[f];
            for (int c = 0; c < 3; ++c) {
                const loxo_index h = (loxo_index)(3 * f + c);
                if (!loxo_is_paired(twin, h)) continue;
                const loxo_index g = (loxo_index)(twin[h] / 3);
                const uint8_t wanted = turn[f] ^ (uint8_t)(triangle[h] == triangle[twin[h]]);
                if (turn[g] == NOT_SEEN) {
                    turn[g] = wanted;
                    queue[tail++] = g;
                } else if (turn[g] != wanted && *conflict < 0) {
                    *conflict = g;
                }
            }
        }
        if (2 * n_against > tail) {
            n_against = tail - n_against;
            for (int64_t i = 0; i < tail; ++i)
                turn[queue[i]] ^= 1;
        }
        *n_turned += n_against;
    }
    loxo_release(ctx, queue);
    return LOXO_OK;
}

void loxo_turn_faces(loxo_context *ctx, int64_t n_faces, const uint8_t *turn, loxo_index *triangle)
{
#pragma omp parallel num_threads(loxo_threads_for(ctx, n_faces, 1))
    {
        const loxo_range r = loxo_thread_range(n_faces);
        for (int64_t f = r.begin; f < r.end; ++f) {
            if (!turn[f]) continue;
            const loxo_index b = triangle[3 * f + 1];
            triangle[3 * f + 1] = triangle[3 * f + 2];
            triangle[3 * f + 2] = b;
        }
    }
}
