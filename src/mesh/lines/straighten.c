/* SPDX-License-Identifier: MIT
 * The faces that a way goes through, its sleeve, are laid flat one after the other; the shortest way inside them is found in
 * linear time by a funnel, the two chains of vertices that the gates seen so far let the way reach. It is straight but for
 * vertices that it bends around. Where the angle on the other side of such a vertex, outside the sleeve, is less than pi the way is
 * shorter over there: the sleeve is turned over the vertex, and all begins anew, until no vertex lets itself be passed. Each turn
 * makes the way shorter, so this ends; then it is a geodesic: it is straight over edges and bends only at vertices with
 * pi or more on both sides, and at the boundary.
 *
 * Where a vertex has less than twice pi around it, two geodesics may pass it, one on either side. Beside a straight piece all such vertices
 * are looked at: which side is shorter follows from the two angles under which its ends are seen. The way goes over
 * there as long as it becomes shorter by that.
 *
 * source  Lee, Preparata 1984 (the funnel); Xin, Wang 2007, Efficiently determining a locally exact shortest path on polyhedral
 *         surfaces; Sharp, Crane 2020, You can find geodesic paths in triangle meshes by just flipping edges */
#include "mesh/lines/straighten.h"

#include "base/allocate.h"
#include "base/context.h"
#include "kernel/layout_kernel.h"

/* A vertex is turned over where the angle beyond it is below pi by more: rounding must not turn it to and fro. */
#define LEAST_TURN 1e-9
/* A way that passes a vertex by a smaller angle touches it: what is beyond it counts. */
#define STRAIGHT 1e-12
/* A crossing so near to a vertex, in lengths of the edge, is that vertex. */
#define SNAP 1e-10
/* What comes out may be longer than what went in by rounding only. */
#define NO_LONGER 1e-9
/* So many rounds without a shorter way or fewer faces are the end: where edges have no length, turns need not make it shorter. */
#define MOST_IDLE 16
/* Another geodesic is gone over to where it is shorter by more, relative; so many times at most. */
#define LEAST_GAIN 1e-13
#define MOST_TRIES 32
#define PI         3.14159265358979323846

void line_straightener_begin(loxo_context *ctx, const loxo_mesh_view *m, line_straightener *s)
{
    *s = (line_straightener){
        .ctx = ctx, .m = m, .sleeve = {.ctx = ctx, .m = m}, .next = {.ctx = ctx, .m = m}, .kept = {.ctx = ctx, .m = m}};
}

static void release(line_straightener *s)
{
    loxo_release(s->ctx, s->node);
    loxo_release(s->ctx, s->left);
    loxo_release(s->ctx, s->right);
    loxo_release(s->ctx, s->funnel);
    loxo_release(s->ctx, s->path);
    s->node = NULL;
    s->left = s->right = s->funnel = s->path = NULL;
    s->room = 0;
}

void line_straightener_end(line_straightener *s)
{
    line_sleeve_destroy(&s->sleeve);
    line_sleeve_destroy(&s->next);
    line_sleeve_destroy(&s->kept);
    release(s);
}

static loxo_status reserve(line_straightener *s, int64_t n)
{
    if (s->room >= n && s->node != NULL) return LOXO_OK;
    const int64_t room = n + n / 2 + 64;
    release(s);
    s->node = loxo_allocate(s->ctx, room + 3, sizeof *s->node);
    s->left = loxo_allocate(s->ctx, room, sizeof *s->left);
    s->right = loxo_allocate(s->ctx, room, sizeof *s->right);
    s->funnel = loxo_allocate(s->ctx, 2 * room + 8, sizeof *s->funnel);
    s->path = loxo_allocate(s->ctx, room + 3, sizeof *s->path);
    s->room = room;
    if (s->node != NULL && s->left != NULL && s->right != NULL && s->funnel != NULL && s->path != NULL) return LOXO_OK;
    release(s);
    return LOXO_ERR_MEMORY;
}

/* ---- the funnel ---------------------------------------------------------------------------------------------- */

/* From a over b to c, to one side (1: left, -1: right) or straight on, which is to either. */
static bool bends(const line_straightener *s, int64_t a, int64_t b, int64_t c, double side)
{
    const k_spot in = spot_sub(s->node[b].at, s->node[a].at), out = spot_sub(s->node[c].at, s->node[b].at);
    const double turn = side * spot_cross(in, out), size = spot_dot(in, in) * spot_dot(out, out);
    if (turn * turn > STRAIGHT * STRAIGHT * size) return turn > 0.0;
    return spot_dot(in, out) > 0.0;
}

/* Takes a node in at one side. Seen from the apex the left chain bends to the left, the right one to the right; what the new
 * node would bend the other way goes, then the apex moves along the other chain as far as that stands between. */
static void widen(line_straightener *s, int64_t id, bool is_left)
{
    int64_t *f = s->funnel;
    const int64_t step = is_left ? -1 : 1; /* outward on this side */
    const double side = is_left ? 1.0 : -1.0;
    int64_t i = is_left ? s->low : s->high;
    while (i != s->apex && !bends(s, f[i - step], f[i], id, side))
        i -= step;
    if (i == s->apex) {
        const int64_t end = is_left ? s->high : s->low;
        while (s->apex != end && bends(s, f[s->apex], f[s->apex - step], id, -side))
            s->apex -= step;
        i = s->apex;
    }
    s->node[id].parent = f[i];
    f[i + step] = id;
    if (is_left)
        s->low = i + step;
    else
        s->high = i + step;
}

static int64_t add_node(line_straightener *s, k_spot at, loxo_index vertex, int64_t gate, bool is_left)
{
    const int64_t id = s->n_nodes++;
    s->node[id] = (line_node){.at = at, .vertex = vertex, .is_left = is_left, .first = gate, .last = gate};
    return id;
}

/* A place in the face of half-edge h, which runs from a to b with the face on its left. */
static k_spot spot_of(const line_straightener *s, const line_place *place, loxo_index h, k_spot a, k_spot b)
{
    double length[3], weight[3];
    const k_layout face = k_layout_at(s->m, h, length);
    line_place_weights(s->m, place, h / 3, weight);
    const double next = weight[k_next(h) % 3], last = weight[k_previous(h) % 3];
    return spot_beside(a, b, length[0], next * length[0] + last * face.x2, last * face.y2);
}

/* Lays the sleeve flat, with the start, and takes all that gates end at into the funnel. Returns the node of the end. A
 * half-edge of the face before a gate runs from its right to its left: one goes through it from above to below. */
static int64_t lay_flat(line_straightener *s)
{
    const line_sleeve *sleeve = &s->sleeve;
    const loxo_mesh_view *m = s->m;
    const loxo_index first = sleeve->n > 0 ? sleeve->gate[0] : (loxo_index)(3 * sleeve->face);
    double length[3];
    (void)k_layout_at(m, first, length);
    k_spot a = {0.0, 0.0}, b = {length[0], 0.0};
    s->funnel[s->apex] = add_node(s, spot_of(s, &sleeve->start, first, a, b), -1, 0, false);
    if (sleeve->n == 0) return add_node(s, spot_of(s, &sleeve->end, first, a, b), -1, 0, true);
    s->right[0] = add_node(s, a, m->halfedge_vertex[first], 0, false);
    s->left[0] = add_node(s, b, k_head(m, first), 0, true);
    widen(s, s->right[0], false);
    widen(s, s->left[0], true);
    for (int64_t i = 1; i < sleeve->n; ++i) {
        const loxo_index twin = m->halfedge_twin[sleeve->gate[i - 1]];
        const k_layout face = k_layout_at(m, twin, length);
        const k_spot third = spot_beside(b, a, length[0], face.x2, face.y2);
        const bool is_left = sleeve->gate[i] == k_next(twin);
        const int64_t id = add_node(s, third, m->halfedge_vertex[k_previous(twin)], i, is_left);
        s->left[i] = is_left ? id : s->left[i - 1];
        s->right[i] = is_left ? s->right[i - 1] : id;
        s->node[s->left[i]].last = s->node[s->right[i]].last = i;
        if (is_left)
            b = third;
        else
            a = third;
        widen(s, id, is_left);
    }
    const loxo_index behind = m->halfedge_twin[sleeve->gate[sleeve->n - 1]];
    return add_node(s, spot_of(s, &sleeve->end, behind, b, a), -1, sleeve->n, true);
}

/* The shortest way inside the sleeve, as nodes from start to end. */
static void pull(line_straightener *s)
{
    s->n_nodes = s->n_path = 0;
    s->low = s->apex = s->high = s->sleeve.n + 3;
    const int64_t end = lay_flat(s);
    widen(s, end, true);
    for (int64_t id = end; id != 0; id = s->node[id].parent)
        s->path[s->n_path++] = id;
    s->path[s->n_path++] = 0;
    for (int64_t i = 0, k = s->n_path - 1; i < k; ++i, --k) {
        const int64_t swap = s->path[i];
        s->path[i] = s->path[k];
        s->path[k] = swap;
    }
    s->length = 0.0;
    for (int64_t i = 1; i < s->n_path; ++i)
        s->length += spot_norm(spot_sub(s->node[s->path[i]].at, s->node[s->path[i - 1]].at));
}

/* ---- turning over vertices ----------------------------------------------------------------------------------- */

/* The half-edge that starts at a bend's vertex in the face before its first gate, and in the face behind its last. */
static loxo_index at_bend(const line_straightener *s, const line_node *bend, bool is_behind)
{
    const loxo_index gate = s->sleeve.gate[is_behind ? bend->last : bend->first];
    if (!is_behind) return bend->is_left ? k_next(gate) : gate;
    const loxo_index twin = s->m->halfedge_twin[gate];
    return bend->is_left ? twin : k_next(twin);
}

/* Of the corner of h, at a bend, the part that is outside the way: not between the gate's other end and where the way comes
 * from, or goes to. */
static double outer_part(const line_straightener *s, const line_node *bend, loxo_index h, int64_t gate, k_spot way)
{
    const k_spot other = s->node[bend->is_left ? s->right[gate] : s->left[gate]].at;
    return line_corner_angle(s->m, h) - spot_angle(spot_sub(way, bend->at), spot_sub(other, bend->at));
}

/* How a bend may be passed in a shorter way: around the same side, without whole turns; or around the other one. */
typedef enum passing { PASS_AS_IT_IS, PASS_UNWOUND, PASS_BEYOND } passing;

static passing pass_of(const line_straightener *s, int64_t i)
{
    const line_node *bend = &s->node[s->path[i]];
    const loxo_index from = at_bend(s, bend, false), to = at_bend(s, bend, true);
    loxo_index h = from;
    int64_t n = 0;
    for (; h != to; h = line_turn(s->m, h, bend->is_left))
        ++n;
    if (n < bend->last + 1 - bend->first) return PASS_UNWOUND;
    double angle = outer_part(s, bend, from, bend->first, s->node[s->path[i - 1]].at) +
                   outer_part(s, bend, to, bend->last, s->node[s->path[i + 1]].at);
    for (h = line_turn(s->m, from, !bend->is_left); h != to; h = line_turn(s->m, h, !bend->is_left)) {
        if (h < 0) return PASS_AS_IT_IS; /* the boundary */
        angle += line_corner_angle(s->m, h);
        if (angle >= PI) return PASS_AS_IT_IS;
    }
    return angle < PI - LEAST_TURN ? PASS_BEYOND : PASS_AS_IT_IS;
}

static loxo_status push_around(line_straightener *s, const line_node *bend, bool is_left)
{
    const loxo_index to = at_bend(s, bend, true);
    loxo_status status = LOXO_OK;
    for (loxo_index h = at_bend(s, bend, false); h != to && status >= 0; h = line_turn(s->m, h, is_left))
        status = line_sleeve_push(&s->next, line_exit(h, is_left));
    return status;
}

static void begin_next(line_straightener *s)
{
    s->next.start = s->sleeve.start;
    s->next.end = s->sleeve.end;
    s->next.face = s->sleeve.face;
    s->next.n = 0;
}

/* Gates from begin to end - 1 stay. */
static loxo_status push_gates(line_straightener *s, int64_t begin, int64_t end)
{
    loxo_status status = LOXO_OK;
    for (int64_t i = begin; i < end && status >= 0; ++i)
        status = line_sleeve_push(&s->next, s->sleeve.gate[i]);
    return status;
}

static void take_next(line_straightener *s)
{
    const line_sleeve swap = s->sleeve;
    s->sleeve = s->next;
    s->next = swap;
    line_sleeve_trim(&s->sleeve);
}

/* One turn over each bend that is worth it, but for those that share gates with the one before: these come next time. */
static loxo_status turn_over(line_straightener *s, int64_t *n_turns)
{
    loxo_status status = LOXO_OK;
    int64_t done = 0; /* gates */
    begin_next(s);
    *n_turns = 0;
    for (int64_t i = 1; i + 1 < s->n_path && status >= 0; ++i) {
        const line_node *bend = &s->node[s->path[i]];
        const passing how = bend->first < done ? PASS_AS_IT_IS : pass_of(s, i);
        if (how == PASS_AS_IT_IS) continue;
        status = push_gates(s, done, bend->first);
        if (status >= 0) status = push_around(s, bend, bend->is_left == (how == PASS_UNWOUND));
        done = bend->last + 1;
        ++*n_turns;
    }
    return status < 0 ? status : push_gates(s, done, s->sleeve.n);
}

/* Until nothing is turned over: a geodesic. */
static loxo_status tighten(line_straightener *s)
{
    const int64_t most_rounds = 4 * s->sleeve.n + 64;
    int64_t fewest = INT64_MAX, n_idle = 0;
    double least = HUGE_VAL;
    for (int64_t round = 0;; ++round) {
        int64_t n_turns = 0;
        loxo_status status = reserve(s, s->sleeve.n);
        if (status < 0) return status;
        pull(s);
        const bool is_shorter = s->length < least, is_as_long = !(s->length > least);
        n_idle = is_shorter || (is_as_long && s->sleeve.n < fewest) ? 0 : n_idle + 1;
        if (round == most_rounds || n_idle == MOST_IDLE) return LOXO_OK;
        if (n_idle == 0) {
            least = s->length;
            fewest = s->sleeve.n;
        }
        if ((status = turn_over(s, &n_turns)) < 0 || n_turns == 0) return status;
        take_next(s);
        if (round % 64 == 63 && loxo_stop_wanted(s->ctx, "straighten", 0.0))
            return loxo_fail(s->ctx, LOXO_ERR_STOPPED, "stopped while a way was straightened");
    }
}

/* ---- other geodesics beside it ------------------------------------------------------------------------------- */

/* Two geodesics pass a vertex whose angles add up to less than twice pi, one on either side; both ends of a straight piece seen
 * from there, the shorter is on the side of the smaller angle. How much shorter that is than the present one; 0: it is not. */
static double gain_beyond(const line_straightener *s, const line_node *node, k_spot from, k_spot to)
{
    const k_spot a = spot_sub(from, node->at), b = spot_sub(to, node->at);
    const double angle = spot_angle(a, b), start_length = spot_norm(a), end_length = spot_norm(b);
    const loxo_index start = at_bend(s, node, false);
    double other = -angle;
    loxo_index h = start;
    do {
        other += line_corner_angle(s->m, h);
        h = line_turn(s->m, h, true);
    } while (h >= 0 && h != start && other < angle);
    if (h != start || !(other < angle)) return 0.0; /* the boundary; no */
    /* c^2 = (a - b)^2 + 4 a b sin^2(angle / 2): of the difference of two c no digits are lost */
    const double sum = sin(0.5 * (angle + other)) * sin(0.5 * (angle - other));
    const double gap = start_length - end_length, half = sin(0.5 * other);
    const double here = spot_norm(spot_sub(from, to));
    const double there = sqrt(gap * gap + 4.0 * start_length * end_length * half * half);
    return 4.0 * start_length * end_length * sum / (here + there);
}

/* Gains of all vertices that a straight piece passes; the node of the largest, or -1. */
static int64_t find_gains(line_straightener *s)
{
    int64_t best = -1, i = 1;
    for (int64_t id = 1; id + 1 < s->n_nodes; ++id) {
        line_node *node = &s->node[id];
        while (s->node[s->path[i]].first < node->first && i + 1 < s->n_path)
            ++i;
        const line_node *from = &s->node[s->path[i - 1]], *to = &s->node[s->path[i]];
        node->gain = 0.0;
        if (id == s->path[i] || node->last >= to->first || (i > 1 && node->first <= from->last)) continue;
        node->gain = gain_beyond(s, node, from->at, to->at);
        if (node->gain > LEAST_GAIN * s->length && (best < 0 || node->gain > s->node[best].gain)) best = id;
    }
    return best;
}

/* Passes one node beyond, or all that gain anything and share no gates. */
static loxo_status pass_beyond(line_straightener *s, int64_t only)
{
    loxo_status status = LOXO_OK;
    int64_t done = 0;
    begin_next(s);
    for (int64_t id = 1; id + 1 < s->n_nodes && status >= 0; ++id) {
        const line_node *node = &s->node[id];
        const bool is_meant = only >= 0 ? id == only : node->gain > LEAST_GAIN * s->length;
        if (!is_meant || node->first < done) continue;
        status = push_gates(s, done, node->first);
        if (status >= 0) status = push_around(s, node, !node->is_left);
        done = node->last + 1;
    }
    return status < 0 ? status : push_gates(s, done, s->sleeve.n);
}

/* Keeps the sleeve, or puts the kept one in its place again. */
static loxo_status copy_sleeve(line_sleeve *to, const line_sleeve *from)
{
    loxo_status status = LOXO_OK;
    to->start = from->start;
    to->end = from->end;
    to->face = from->face;
    to->n = 0;
    for (int64_t i = 0; i < from->n && status >= 0; ++i)
        status = line_sleeve_push(to, from->gate[i]);
    return status;
}

/* From one geodesic to a shorter one on the other side of vertices, as long as that is found. */
static loxo_status try_beside(line_straightener *s)
{
    loxo_status status = LOXO_OK;
    bool is_alone = false; /* all together gained nothing: the best alone */
    for (int tries = 0; tries < MOST_TRIES; ++tries) {
        const double before = s->length;
        const int64_t best = find_gains(s);
        if (best < 0) return LOXO_OK;
        if ((status = copy_sleeve(&s->kept, &s->sleeve)) < 0) return status;
        if ((status = pass_beyond(s, is_alone ? best : -1)) < 0) return status;
        take_next(s);
        if ((status = tighten(s)) < 0) return status;
        if (s->length < before * (1.0 - LEAST_GAIN)) {
            is_alone = false;
            continue;
        }
        if ((status = copy_sleeve(&s->sleeve, &s->kept)) < 0) return status;
        pull(s);
        if (is_alone) return LOXO_OK;
        is_alone = true;
    }
    return LOXO_OK;
}

/* ---- the way ------------------------------------------------------------------------------------------------- */

static loxo_status build(const line_straightener *s, line_builder *builder)
{
    const line_sleeve *sleeve = &s->sleeve;
    loxo_status status = line_place_build(&sleeve->start, builder);
    int64_t gate = 0;
    for (int64_t i = 1; i < s->n_path && status >= 0; ++i) {
        const line_node *from = &s->node[s->path[i - 1]], *to = &s->node[s->path[i]];
        double along = 0.0;
        for (; gate < to->first && status >= 0; ++gate) {
            const loxo_index h = sleeve->gate[gate];
            double t = spot_gate(from->at, to->at, s->node[s->right[gate]].at, s->node[s->left[gate]].at, &along);
            if (!(t >= SNAP)) t = 0.0;
            if (t > 1.0 - SNAP) t = 1.0;
            status = line_add_on_edge(builder, s->m->halfedge_vertex[h], k_head(s->m, h), t);
        }
        if (status >= 0 && i + 1 < s->n_path) status = line_add_vertex(builder, to->vertex);
        if (gate <= to->last) gate = to->last + 1;
    }
    return status < 0 ? status : line_place_build(&sleeve->end, builder);
}

loxo_status line_straighten(line_straightener *s, const line_way *way, line_builder *builder)
{
    if (way->n < 2) return line_way_build(way, builder);
    loxo_status status = line_sleeve_of_way(&s->sleeve, way);
    if (status == LOXO_ERR_ARGUMENT) return line_way_build(way, builder);
    if (status < 0) return status;
    line_sleeve_trim(&s->sleeve);
    if ((status = tighten(s)) < 0 || (status = try_beside(s)) < 0) return status;
    return s->length <= line_way_length(way, s->m) * (1.0 + NO_LONGER) ? build(s, builder)
                                                                       : line_way_build(way, builder);
}
