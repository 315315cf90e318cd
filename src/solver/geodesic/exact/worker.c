/* SPDX-License-Identifier: MIT
 * What each thread has of its own: free blocks, items, offers, arrays to work in. Threads at work never allocate: what has no
 * room is left, and done again when the calling thread has made some. */
#include "base/allocate.h"
#include "solver/geodesic/exact/exact_internal.h"

/* Batches that a thread keeps to itself. */
#define BATCHES_KEPT 2

static void lock_pool(exact_state *s)
{
    if (s->n_threads > 1)
        while (__atomic_test_and_set(&s->pool.is_locked, __ATOMIC_ACQUIRE)) {
        }
}

static void unlock_pool(exact_state *s)
{
    if (s->n_threads > 1) __atomic_clear(&s->pool.is_locked, __ATOMIC_RELEASE);
}

static void push_batch(exact_pool *pool, uint32_t *first, uint32_t id)
{
    exact_pool_block(pool, id)->round = *first;
    *first = id;
}

static uint32_t pop_batch(const exact_pool *pool, uint32_t *first)
{
    const uint32_t id = *first;
    if (id != EXACT_NONE) *first = exact_pool_block(pool, id)->round;
    return id;
}

/* Takes batches from the pool until there are so many blocks. */
static bool has_blocks(exact_state *s, exact_worker *worker, int64_t n)
{
    while (worker->n_free + EXACT_BATCH * worker->n_batches < n) {
        lock_pool(s);
        const uint32_t id = pop_batch(&s->pool, &s->pool.first_batch);
        unlock_pool(s);
        if (id == EXACT_NONE) return false;
        push_batch(&s->pool, &worker->first_batch, id);
        worker->n_batches += 1;
    }
    return true;
}

static uint32_t take_block(exact_state *s, exact_worker *worker)
{
    if (worker->n_free == 0) {
        worker->first_free = pop_batch(&s->pool, &worker->first_batch);
        worker->n_free = EXACT_BATCH;
        worker->n_batches -= 1;
    }
    const uint32_t id = worker->first_free;
    worker->first_free = exact_pool_block(&s->pool, id)->next;
    worker->n_free -= 1;
    return id;
}

void exact_free_block(exact_state *s, exact_worker *worker, uint32_t id)
{
    if (worker->n_free == EXACT_BATCH) {
        push_batch(&s->pool, &worker->first_batch, worker->first_free);
        worker->n_batches += 1;
        worker->first_free = EXACT_NONE;
        worker->n_free = 0;
        if (worker->n_batches > BATCHES_KEPT) {
            const uint32_t batch = pop_batch(&s->pool, &worker->first_batch);
            worker->n_batches -= 1;
            lock_pool(s);
            push_batch(&s->pool, &s->pool.first_batch, batch);
            unlock_pool(s);
        }
    }
    exact_pool_block(&s->pool, id)->next = worker->first_free;
    worker->first_free = id;
    worker->n_free += 1;
}

static void want(int64_t *wanted, int64_t n)
{
    if (n > *wanted) *wanted = n;
}

bool exact_has_room(exact_state *s, exact_worker *worker, const exact_needs *needs)
{
    const int next = 1 - s->side;
    const int64_t n_items = worker->n_items[next] + needs->n_items, n_offers = worker->n_offers + needs->n_offers;
    bool fits = true;
    if (needs->n_windows > worker->work.room) {
        want(&worker->wanted.n_windows, needs->n_windows);
        fits = false;
    }
    if (n_items > worker->item_room[next]) {
        want(&worker->wanted.n_items, n_items);
        fits = false;
    }
    if (n_offers > worker->offer_room) {
        want(&worker->wanted.n_offers, n_offers);
        fits = false;
    }
    if (!has_blocks(s, worker, needs->n_blocks)) {
        want(&worker->wanted.n_blocks, needs->n_blocks);
        fits = false;
    }
    return fits;
}

/* More than what is wanted, so that it is not asked for often. */
static int64_t room_for(int64_t wanted) { return wanted + wanted / 2 + 64; }

static loxo_status grow_work(loxo_context *ctx, exact_work *work, int64_t n)
{
    exact_work more = {.room = room_for(n)};
    if (n <= work->room) return LOXO_OK;
    more.taken = loxo_allocate(ctx, more.room, sizeof *more.taken);
    more.kept = loxo_allocate(ctx, more.room, sizeof *more.kept);
    more.place = loxo_allocate(ctx, more.room, sizeof *more.place);
    more.other_place = loxo_allocate(ctx, more.room, sizeof *more.other_place);
    const bool is_whole = more.taken != NULL && more.kept != NULL && more.place != NULL && more.other_place != NULL;
    exact_work *old = is_whole ? work : &more;
    loxo_release(ctx, old->taken);
    loxo_release(ctx, old->kept);
    loxo_release(ctx, old->place);
    loxo_release(ctx, old->other_place);
    if (is_whole) *work = more;
    return is_whole ? LOXO_OK : LOXO_ERR_MEMORY;
}

static loxo_status grow_worker(exact_state *s, exact_worker *worker)
{
    const exact_needs *wanted = &worker->wanted;
    loxo_status status = grow_work(s->ctx, &worker->work, wanted->n_windows);
    for (int side = 0; side < 2 && status >= 0; ++side) {
        if (wanted->n_items <= worker->item_room[side]) continue;
        uint32_t *item = loxo_reallocate(s->ctx, worker->item[side], room_for(wanted->n_items), sizeof *item);
        if (item == NULL) return LOXO_ERR_MEMORY;
        worker->item[side] = item;
        worker->item_room[side] = room_for(wanted->n_items);
    }
    if (status >= 0 && wanted->n_offers > worker->offer_room) {
        exact_offer *offer = loxo_reallocate(s->ctx, worker->offer, room_for(wanted->n_offers), sizeof *offer);
        if (offer == NULL) return LOXO_ERR_MEMORY;
        worker->offer = offer;
        worker->offer_room = room_for(wanted->n_offers);
    }
    return status;
}

loxo_status exact_make_room(exact_state *s)
{
    int64_t n_blocks = 0;
    for (int i = 0; i < s->n_threads; ++i) {
        const loxo_status status = grow_worker(s, &s->worker[i]);
        if (status < 0) return status;
        if (s->worker[i].wanted.n_blocks > 0) n_blocks += s->worker[i].wanted.n_blocks + EXACT_BATCH;
        s->worker[i].wanted = (exact_needs){0};
    }
    const int64_t n_more = (s->pool.n_chunks << EXACT_CHUNK_BITS) / 4;
    if (n_blocks == 0) return LOXO_OK;
    return exact_pool_grow(s->ctx, &s->pool, n_blocks > n_more ? n_blocks : n_more);
}

void exact_clear_workers(exact_state *s)
{
    exact_pool_clear(&s->pool);
    for (int i = 0; i < s->n_workers; ++i) {
        exact_worker *worker = &s->worker[i];
        worker->first_free = worker->first_batch = EXACT_NONE;
        worker->n_free = worker->n_batches = 0;
        worker->n_items[0] = worker->n_items[1] = worker->n_offers = worker->n_more = 0;
        worker->wanted = (exact_needs){0};
    }
}

size_t exact_worker_bytes(const exact_worker *worker)
{
    return (size_t)worker->work.room * 2 * (sizeof(exact_taken) + sizeof(struct exact_place)) +
           (size_t)(worker->item_room[0] + worker->item_room[1]) * sizeof *worker->item[0] +
           (size_t)worker->offer_room * sizeof *worker->offer;
}

void exact_worker_destroy(loxo_context *ctx, exact_worker *worker)
{
    loxo_release(ctx, worker->work.taken);
    loxo_release(ctx, worker->work.kept);
    loxo_release(ctx, worker->work.place);
    loxo_release(ctx, worker->work.other_place);
    loxo_release(ctx, worker->item[0]);
    loxo_release(ctx, worker->item[1]);
    loxo_release(ctx, worker->offer);
}

void exact_put(exact_state *s, exact_worker *worker, exact_chain *chain, const k_window *w, exact_origin origin)
{
    exact_block *block = chain->block;
    if (block == NULL || block->n == EXACT_BLOCK) {
        const uint32_t id = take_block(s, worker);
        block = exact_pool_block(&s->pool, id);
        block->n = 0;
        block->next = chain->head;
        block->round = s->round;
        if (chain->tail == EXACT_NONE) chain->tail = id;
        chain->head = id;
        chain->block = block;
    }
    block->w[block->n] = *w;
    block->origin[block->n] = origin;
    block->n += 1;
    worker->n_more += 1;
}

void exact_queue(exact_state *s, exact_worker *worker, uint32_t item, double key)
{
    const int next = 1 - s->side;
    worker->item[next][worker->n_items[next]++] = item;
    if (key < worker->least) worker->least = key;
}

void exact_hang(exact_state *s, exact_worker *worker, exact_chain *chain, loxo_index h, double key)
{
    exact_block *last = exact_pool_block(&s->pool, chain->tail);
    uint32_t *list = &s->list[h], first;
    if (s->n_threads > 1) {
        first = __atomic_load_n(list, __ATOMIC_RELAXED);
        do
            last->next = first;
        while (!__atomic_compare_exchange_n(list, &first, chain->head, true, __ATOMIC_ACQ_REL, __ATOMIC_RELAXED));
    } else {
        first = last->next = *list;
        *list = chain->head;
    }
    /* The list is queued once; whichever chain came first, the least key of them counts. */
    if (first == EXACT_NONE) worker->item[1 - s->side][worker->n_items[1 - s->side]++] = (uint32_t)h;
    if (key < worker->least) worker->least = key;
}
