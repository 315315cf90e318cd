/* SPDX-License-Identifier: MIT */
#include "algebra/adder.h"

#include "base/allocate.h"

#include <string.h>

#define FEWEST_SLOTS 64

static loxo_status create(loxo_context *ctx, int64_t most, mg_adder *a)
{
    *a = (mg_adder){.mask = FEWEST_SLOTS - 1, .capacity = FEWEST_SLOTS};
    while (a->capacity / 2 < most)
        a->capacity *= 2;
    a->slot = loxo_allocate(ctx, a->capacity, sizeof *a->slot);
    a->place = loxo_allocate(ctx, a->capacity / 2, sizeof *a->place);
    a->column = loxo_allocate(ctx, a->capacity / 2, sizeof *a->column);
    a->value = loxo_allocate(ctx, a->capacity / 2, sizeof *a->value);
    if (a->slot == NULL || a->place == NULL || a->column == NULL || a->value == NULL) return LOXO_ERR_MEMORY;
    memset(a->slot, -1, (size_t)a->capacity * sizeof *a->slot);
    return LOXO_OK;
}

mg_adder *mg_create_adders(loxo_context *ctx, int n, int64_t most)
{
    mg_adder *adders = loxo_allocate_zero(ctx, n, sizeof *adders);
    for (int t = 0; t < n && adders != NULL; ++t)
        if (create(ctx, most, &adders[t]) < 0) {
            mg_destroy_adders(ctx, n, adders);
            return NULL;
        }
    return adders;
}

void mg_destroy_adders(loxo_context *ctx, int n, mg_adder *adders)
{
    for (int t = 0; t < n && adders != NULL; ++t) {
        loxo_release(ctx, adders[t].slot);
        loxo_release(ctx, adders[t].place);
        loxo_release(ctx, adders[t].column);
        loxo_release(ctx, adders[t].value);
    }
    loxo_release(ctx, adders);
}

static void empty_slots(mg_adder *a)
{
    for (int64_t k = 0; k < a->n; ++k)
        a->slot[a->place[k]] = -1;
}

void mg_adder_widen(mg_adder *a)
{
    empty_slots(a);
    a->mask = 2 * a->mask + 1;
    for (int64_t k = 0; k < a->n; ++k) {
        const uint64_t s = mg_adder_find(a, a->column[k]);
        a->slot[s] = (int32_t)k;
        a->place[k] = (int32_t)s;
    }
}

void mg_adder_clear(mg_adder *a)
{
    empty_slots(a);
    a->n = 0;
    a->mask = FEWEST_SLOTS - 1;
}
