/* SPDX-License-Identifier: MIT
 * Windows of one list against each other: on the edge, and in the face that they have just crossed. */
#include "solver/geodesic/exact/exact_internal.h"

typedef enum verdict { BOTH_STAY, FIRST_GOES, SECOND_GOES } verdict;

static inline double slack_of(double way) { return K_WINDOW_SLACK * way; }

/* Where the ways by a and b are equally long, between l and r, where a is shorter at one and b at the other.
 * |A - x| = |B - x| + k, k = b.offset - a.offset, squared with x = l + u:
 *     p - q u = 2 k |B - x|,   p = |A'|^2 - |B'|^2 - k^2,  q = 2 (A'_x - B'_x),   A' = A - l.
 * false: rounding errors do not let it be told. */
static bool meeting_point(const k_window *a, const k_window *b, double l, double r, double *meeting)
{
    const double ax = a->x - l, bx = b->x - l, k = b->offset - a->offset;
    const double q = 2.0 * (ax - bx);
    const double p = (ax - bx) * (ax + bx) + (a->y - b->y) * (a->y + b->y) - k * k;
    /* (p - q u)^2 = 4 k^2 ((u - bx)^2 + by^2) */
    const double c2 = q * q - 4.0 * k * k, c1 = -2.0 * p * q + 8.0 * k * k * bx;
    const double c0 = p * p - 4.0 * k * k * (bx * bx + b->y * b->y);
    const double root = c1 * c1 - 4.0 * c2 * c0;
    const double s = root > 0.0 ? sqrt(root) : 0.0;
    const double h = -0.5 * (c1 + (c1 >= 0.0 ? s : -s));
    double best = HUGE_VAL, at = 0.0;
    for (int i = 0; i < 2; ++i) {
        const double x = l + (i == 0 ? h / c2 : c0 / h);
        double e;
        if (!(x >= l && x <= r)) continue;
        e = fabs(k_window_way(a, x, 0.0) - k_window_way(b, x, 0.0));
        if (e < best) {
            best = e;
            at = x;
        }
    }
    *meeting = at;
    return best <= 1e-14 * k_window_way(a, at, 0.0);
}

/* Two windows that overlap on the edge. A way through a point is needless when the other is shorter to that point. */
static verdict compare_overlap(k_window *a, k_window *b)
{
    const double l = a->begin > b->begin ? a->begin : b->begin, r = a->end < b->end ? a->end : b->end;
    const double al = k_window_way(a, l, 0.0), ar = k_window_way(a, r, 0.0);
    const double at_l = al - k_window_way(b, l, 0.0), at_r = ar - k_window_way(b, r, 0.0);
    const double slack = slack_of(al > ar ? al : ar);
    const bool b_left = at_l > slack, b_right = at_r > slack, a_left = at_l < -slack, a_right = at_r < -slack;
    double x;
    if ((b_left && b_right) || (a_left && a_right)) {
        k_window *good = b_left ? b : a, *bad = b_left ? a : b;
        if (good->y > bad->y) {
            /* The nearer source may win between the ends, most where the line through both sources meets the edge. */
            x = bad->x + (bad->x - good->x) * (bad->y / (good->y - bad->y));
            if (x > l && x < r && !(k_window_way(bad, x, 0.0) - k_window_way(good, x, 0.0) > slack)) return BOTH_STAY;
        }
        if (bad->begin >= l) {
            if (bad->end <= r) return b_left ? FIRST_GOES : SECOND_GOES;
            bad->begin = r;
        } else if (bad->end <= r) {
            bad->end = l;
        }
        return BOTH_STAY;
    }
    if (!((b_left && a_right) || (a_left && b_right)) || !meeting_point(a, b, l, r, &x)) return BOTH_STAY;
    {
        k_window *left = a_left ? a : b, *right = a_left ? b : a;
        if (left->end <= r) left->end = x;
        if (right->begin >= l) right->begin = x;
    }
    return BOTH_STAY;
}

/* Windows a left of b. Where rays of both cross inside the face below, the longer of the two need not go on. */
static verdict compare_crossing(k_window *a, k_window *b, double length, double corner_x, double corner_y)
{
    /* The inner rays, downwards: x at depth t is a->end - t sa, b->begin - t sb; they meet when sb > sa. */
    const double da = a->end - a->x, db = b->begin - b->x, gap = b->begin - a->end;
    double depth, px, way_a, way_b, slack;
    if (!(db * a->y > da * b->y)) return BOTH_STAY;
    depth = gap * a->y * b->y / (db * a->y - da * b->y);
    if (!(depth < a->y && depth < b->y)) return BOTH_STAY;
    px = a->end - depth * (da / a->y);
    if (!(corner_y * px > corner_x * depth && corner_y * (length - px) > (length - corner_x) * depth)) return BOTH_STAY;
    way_a = k_window_way(a, px, -depth);
    way_b = k_window_way(b, px, -depth);
    slack = slack_of(way_a);
    if (way_a + slack < way_b) {
        /* b's rays cross a's last ray inside the face up to where that came in. */
        const double sa = da / a->y;
        const double by_left = corner_y * sa + corner_x, by_right = (length - corner_x) - corner_y * sa;
        double in = a->y, limit;
        if (by_left > 0.0 && corner_y * a->end < in * by_left) in = corner_y * a->end / by_left;
        if (by_right > 0.0 && corner_y * (length - a->end) < in * by_right)
            in = corner_y * (length - a->end) / by_right;
        if (!(in < b->y)) return SECOND_GOES;
        limit = b->x + (a->end - in * sa - b->x) * (b->y / (b->y - in));
        if (limit >= b->end) return SECOND_GOES;
        if (limit > b->begin) b->begin = limit;
    } else if (way_b + slack < way_a) {
        const double sb = db / b->y;
        const double by_left = corner_y * sb + corner_x, by_right = (length - corner_x) - corner_y * sb;
        double in = b->y, limit;
        if (by_left > 0.0 && corner_y * b->begin < in * by_left) in = corner_y * b->begin / by_left;
        if (by_right > 0.0 && corner_y * (length - b->begin) < in * by_right)
            in = corner_y * (length - b->begin) / by_right;
        if (!(in < a->y)) return FIRST_GOES;
        limit = a->x + (b->begin - in * sb - a->x) * (a->y / (a->y - in));
        if (limit <= a->begin) return FIRST_GOES;
        if (limit < a->end) a->end = limit;
    }
    return BOTH_STAY;
}

/* Whether a goes before b, when both begin at one place: by anything that tells them apart. */
static bool is_before(const exact_taken *a, const exact_taken *b)
{
    if (a->w.end != b->w.end) return a->w.end < b->w.end;
    if (a->w.offset != b->w.offset) return a->w.offset < b->w.offset;
    if (a->w.x != b->w.x) return a->w.x < b->w.x;
    if (a->w.y != b->w.y) return a->w.y < b->w.y;
    return a->origin <= b->origin;
}

static inline bool is_sorted(const exact_taken *taken, const struct exact_place *a, const struct exact_place *b)
{
    return a->begin < b->begin || (a->begin == b->begin && is_before(&taken[a->i], &taken[b->i]));
}

/* Merges ascending runs until there is one; lists come as two or three. Returns the array that holds it. */
static struct exact_place *sort_by_begin(const exact_taken *taken, struct exact_place *place, struct exact_place *other,
                                         int64_t n)
{
    for (;;) {
        struct exact_place *const swap = place;
        int64_t n_runs = 0, out = 0;
        for (int64_t i = 0; i < n; ++n_runs) {
            int64_t a = i, a_end = i + 1, b, b_end;
            while (a_end < n && is_sorted(taken, &place[a_end - 1], &place[a_end]))
                ++a_end;
            b = b_end = a_end;
            if (a == 0 && a_end == n) return place;
            if (b < n)
                for (++b_end; b_end < n && is_sorted(taken, &place[b_end - 1], &place[b_end]);)
                    ++b_end;
            while (a < a_end || b < b_end)
                other[out++] =
                    b == b_end || (a < a_end && is_sorted(taken, &place[a], &place[b])) ? place[a++] : place[b++];
            i = b_end;
        }
        place = other;
        other = swap;
        if (n_runs <= 1) return place;
    }
}

int64_t exact_prune(exact_work *work, int64_t n, double length, double corner_x, double corner_y)
{
    exact_taken *kept = work->kept;
    const struct exact_place *place;
    int64_t n_kept = 0;
    for (int64_t i = 0; i < n; ++i)
        work->place[i] = (struct exact_place){work->taken[i].w.begin, i};
    place = sort_by_begin(work->taken, work->place, work->other_place, n);
    for (int64_t i = 0; i < n; ++i) {
        exact_taken e = work->taken[place[i].i];
        bool stays = true;
        while (stays && n_kept > 0) {
            k_window *a = &kept[n_kept - 1].w, *b = &e.w;
            verdict v = BOTH_STAY;
            if (a->end > b->begin && b->end > a->begin) v = compare_overlap(a, b);
            if (v == BOTH_STAY && a->end <= b->begin) v = compare_crossing(a, b, length, corner_x, corner_y);
            if (v == SECOND_GOES || !(b->begin < b->end))
                stays = false;
            else if (v == FIRST_GOES || !(a->begin < a->end))
                n_kept -= 1;
            else
                break;
        }
        if (stays) kept[n_kept++] = e;
    }
    return n_kept;
}
