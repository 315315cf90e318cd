/* SPDX-License-Identifier: MIT
 * Adds up numbers by column, in the order in which columns first came: open addressing over a table that grows with the
 * row, so that long rows cost no more an entry than short ones. */
#ifndef LOXO_ALGEBRA_ADDER_H
#define LOXO_ALGEBRA_ADDER_H

#include "base/context.h"

typedef struct mg_adder {
    int64_t n;          /* entries so far */
    uint64_t mask;      /* slots in use, less one */
    int64_t capacity;   /* slots, a power of two */
    int32_t *slot;      /* [capacity] number of the entry, -1: free; all are free between rows */
    int32_t *place;     /* [capacity / 2] slot of an entry */
    loxo_index *column; /* [capacity / 2] */
    double *value;      /* [capacity / 2] */
} mg_adder;

/* One a thread, each for rows of `most` different columns; NULL: no memory. */
mg_adder *mg_create_adders(loxo_context *ctx, int n, int64_t most);
void mg_destroy_adders(loxo_context *ctx, int n, mg_adder *adders);
void mg_adder_widen(mg_adder *a);
void mg_adder_clear(mg_adder *a);

static inline uint64_t mg_adder_find(const mg_adder *a, loxo_index column)
{
    uint64_t s = (((uint64_t)(uint32_t)column * 0x9e3779b9u) >> 7) & a->mask;
    while (a->slot[s] >= 0 && a->column[a->slot[s]] != column)
        s = (s + 1) & a->mask;
    return s;
}

static inline void mg_adder_add(mg_adder *a, loxo_index column, double value)
{
    uint64_t s = mg_adder_find(a, column);
    if (a->slot[s] >= 0) {
        a->value[a->slot[s]] += value;
        return;
    }
    if (2 * (a->n + 1) > (int64_t)a->mask + 1) {
        mg_adder_widen(a);
        s = mg_adder_find(a, column);
    }
    a->slot[s] = (int32_t)a->n;
    a->place[a->n] = (int32_t)s;
    a->column[a->n] = column;
    a->value[a->n++] = value;
}

#endif
