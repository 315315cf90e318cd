/* SPDX-License-Identifier: MIT
 * Sorting in place: ascending, nothing lost, whatever the order was and however large the items are. */
#include "base/rng.h"
#include "base/sort.h"
#include "test.h"

enum { MOST = 500 };

typedef struct item {
    int32_t key, number;
    double ballast[3];
} item;

static bool by_key(const void *arg, const void *a, const void *b)
{
    const item *x = a, *y = b;
    const int32_t sign = *(const int32_t *)arg;
    return x->key != y->key ? sign * x->key < sign * y->key : x->number < y->number;
}

static bool by_byte(const void *arg, const void *a, const void *b)
{
    (void)arg;
    return *(const unsigned char *)a < *(const unsigned char *)b;
}

TEST(items_are_sorted)
{
    item x[MOST];
    for (int32_t n = 0; n < MOST; n = n < 70 ? n + 1 : n + 43)
        for (int order = 0; order < 5; ++order)
            for (int32_t sign = -1; sign <= 1; sign += 2) {
                bool is_there[MOST] = {false};
                for (int32_t i = 0; i < n;
                     ++i) { /* drawn, many equal, ascending, descending, ascending but for the last */
                    const int32_t drawn =
                        (int32_t)(loxo_random_unit((uint64_t)n, (uint64_t)i) * (order == 1 ? 4 : 1e6));
                    x[i].key = order < 2 ? drawn : order == 2 ? i : order == 3 ? -i : i + 1 == n ? 0 : i;
                    x[i].number = i;
                    for (int k = 0; k < 3; ++k)
                        x[i].ballast[k] = x[i].key + k;
                }
                loxo_sort(x, n, sizeof *x, by_key, &sign);
                for (int32_t i = 0; i < n; ++i) {
                    CHECK(i == 0 || by_key(&sign, &x[i - 1], &x[i]));
                    CHECK(!is_there[x[i].number]);
                    is_there[x[i].number] = true;
                    for (int k = 0; k < 3; ++k)
                        CHECK_EQUAL(x[i].ballast[k], x[i].key + k);
                }
            }
}

TEST(bytes_are_sorted)
{
    unsigned char text[] = "a heap stands on its head, and what is largest falls off its top at every step";
    const int64_t n = (int64_t)strlen((const char *)text);
    loxo_sort(text, n, 1, by_byte, NULL);
    for (int64_t i = 1; i < n; ++i)
        CHECK(text[i - 1] <= text[i]);
}
