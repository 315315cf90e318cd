/* SPDX-License-Identifier: MIT
 * A cycle: its steps in a list, and their passes over rows as phases without barriers between them, since on small levels
 * a barrier with a thread that the system has taken off its processor costs more than the pass. */
#include "algebra/dense.h"
#include "algebra/multigrid_internal.h"
#include "base/allocate.h"
#include "par/phases.h"

#include <string.h>

#define CHUNK_ROWS     2048 /* at least, of a pass */
#define GROUPS_A_CHUNK 256
#define NS_A_ROW       5.0 /* of a short pass: a thread is of no use when its share of one is not worth its waking */

static void add(mg_step *list, int64_t *n, mg_step step)
{
    if (list != NULL) list[*n] = step;
    ++*n;
}

/* The levels from `at` on, as an approximate inverse: x from b. With list NULL only counts. A level that is visited twice
 * is solved the second time for what the first left: x = B b + B (b - A B b), as symmetric as B. */
static int64_t plan(const loxo_multigrid *mg, int at, const double *b, double *x, mg_step *list)
{
    const mg_level *l = &mg->level[at], *next = l + 1;
    const bool is_last = at + 1 == mg->n_levels, is_twice = at + 2 < mg->n_levels && next->x_more != NULL;
    int64_t n = 0;
    if (is_last && mg->dense != NULL) {
        add(list, &n, (mg_step){MG_SOLVE, l, b, NULL, x});
        return n;
    }
    add(list, &n, (mg_step){MG_FORWARD, l, b, NULL, is_last ? l->y : x});
    if (is_last) {
        add(list, &n, (mg_step){MG_BACKWARD, l, b, l->y, x});
        return n;
    }
    if (l->stiff.n_groups > 0) {
        add(list, &n, (mg_step){MG_FIND, l, b, x, NULL});
        add(list, &n, (mg_step){MG_TAKE, l, NULL, NULL, x});
    }
    add(list, &n, (mg_step){MG_RESIDUAL, l, b, x, l->y});
    add(list, &n, (mg_step){MG_RESTRICT, l, NULL, l->y, next->b});
    n += plan(mg, at + 1, next->b, next->x, list != NULL ? list + n : NULL);
    if (is_twice) {
        add(list, &n, (mg_step){MG_RESIDUAL, next, next->b, next->x, next->b_more});
        n += plan(mg, at + 1, next->b_more, next->x_more, list != NULL ? list + n : NULL);
        add(list, &n, (mg_step){MG_ADD, next, NULL, next->x_more, next->x});
    }
    add(list, &n, (mg_step){MG_PROLONG, l, next->x, x, l->y});
    if (l->stiff.n_groups > 0) {
        add(list, &n, (mg_step){MG_FIND, l, b, l->y, NULL});
        add(list, &n, (mg_step){MG_TAKE, l, NULL, NULL, l->y});
    }
    add(list, &n, (mg_step){MG_BACKWARD, l, b, l->y, x});
    return n;
}

loxo_status mg_plan_cycle(loxo_multigrid *mg)
{
    mg->n_steps = plan(mg, 0, NULL, NULL, NULL);
    mg->step = loxo_allocate(mg->ctx, mg->n_steps, sizeof *mg->step);
    if (mg->step == NULL) return LOXO_ERR_MEMORY;
    plan(mg, 0, NULL, NULL, mg->step);
    return LOXO_OK;
}

typedef struct running {
    const loxo_multigrid *mg;
    const double *r;
    double *z;
    int64_t at; /* step */
    mg_step step;
    int64_t n_rows, chunk_rows;
} running;

/* Arrays of level 0 that the caller has. */
static mg_step resolve(const running *run, mg_step s)
{
    const bool is_first = s.level == run->mg->level;
    if (is_first && s.b == NULL && s.act != MG_RESTRICT) s.b = run->r;
    if (is_first && s.in == NULL) s.in = run->z;
    if (is_first && s.out == NULL) s.out = run->z;
    return s;
}

static int64_t advance(void *arg)
{
    running *run = arg;
    if (++run->at == run->mg->n_steps) return -1;
    run->step = resolve(run, run->mg->step[run->at]);
    const mg_level *l = run->step.level;
    if (run->step.act == MG_SOLVE) return 1;
    run->chunk_rows = GROUPS_A_CHUNK;
    run->n_rows = l->stiff.n_groups;
    if (run->step.act == MG_FIND || run->step.act == MG_TAKE)
        return (run->n_rows + GROUPS_A_CHUNK - 1) / GROUPS_A_CHUNK;
    run->n_rows = run->step.act == MG_RESTRICT ? l->down.n_rows : l->n;
    run->chunk_rows = l->block_rows > CHUNK_ROWS ? l->block_rows : CHUNK_ROWS; /* a multiple: both are powers of two */
    return (run->n_rows + run->chunk_rows - 1) / run->chunk_rows;
}

/* y = given + map x for rows begin..end-1; given NULL: y = map x. */
static void apply_map(const mg_map *map, int64_t begin, int64_t end, const double *x, const double *given, double *y)
{
    for (int64_t i = begin; i < end; ++i) {
        double sum = 0.0;
        for (uint32_t k = map->begin[i]; k < map->begin[i + 1]; ++k)
            sum += (double)map->value[k] * x[map->column[k]];
        y[i] = (given != NULL ? given[i] : 0.0) + sum / MG_ONE;
    }
}

static void smooth(const mg_step *s, int64_t begin, int64_t end)
{
    const mg_level *l = s->level;
    const k_smooth_level rows = mg_rows(l);
    for (int64_t from = begin; from < end; from += l->block_rows) {
        const int64_t to = from + l->block_rows < end ? from + l->block_rows : end;
        if (s->act == MG_FORWARD)
            k_smooth_forward(&rows, from, to, s->b, s->out);
        else
            k_smooth_backward(&rows, from, to, s->b, s->in, s->out);
    }
}

static void work(void *arg, int64_t chunk)
{
    const running *run = arg;
    const mg_step *s = &run->step;
    const mg_level *l = s->level;
    const k_smooth_level rows = mg_rows(l);
    const int64_t begin = chunk * run->chunk_rows;
    const int64_t end = begin + run->chunk_rows < run->n_rows ? begin + run->chunk_rows : run->n_rows;
    switch (s->act) {
    case MG_FORWARD:
    case MG_BACKWARD: smooth(s, begin, end); break;
    case MG_RESIDUAL: k_smooth_residual(&rows, begin, end, s->b, s->in, s->out); break;
    case MG_RESTRICT: apply_map(&l->down, begin, end, s->in, NULL, s->out); break;
    case MG_PROLONG: apply_map(&l->up, begin, end, s->b, s->in, s->out); break;
    case MG_ADD:
        for (int64_t i = begin; i < end; ++i)
            s->out[i] += s->in[i];
        break;
    case MG_FIND: mg_find_steps(l, begin, end, s->b, s->in); break;
    case MG_TAKE: mg_take_steps(l, begin, end, s->out); break;
    case MG_SOLVE:
        memcpy(s->out, s->b, (size_t)l->n * sizeof *s->out);
        loxo_dense_solve(l->n, run->mg->dense, s->out);
        break;
    }
}

void loxo_multigrid_apply(void *state, const double *r, double *z)
{
    const loxo_multigrid *mg = state;
    running run = {.mg = mg, .r = r, .z = z, .at = -1};
    const loxo_phases phases = {advance, work, NULL, &run};
    (void)loxo_phases_run(&phases, loxo_threads_for(mg->ctx, mg->level[0].n, NS_A_ROW));
}
