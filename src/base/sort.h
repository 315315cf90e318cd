/* SPDX-License-Identifier: MIT
 * Sorting in place: n log n for any order, without memory, which the C library's qsort may ask for behind the context's
 * back, and without recursion. Not stable: `less` has to tell all items apart whose order matters. */
#ifndef LOXO_BASE_SORT_H
#define LOXO_BASE_SORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define LOXO_SORT_MOST 64 /* bytes of an item */

typedef bool (*loxo_less_fn)(const void *arg, const void *a, const void *b);

/* Sorts n items of so many bytes ascending. Inline, so that sizes and comparisons are known where it stands. */
static inline void loxo_sort(void *items, int64_t n, size_t size, loxo_less_fn less, const void *arg)
{
    unsigned char *item = items, x[LOXO_SORT_MOST];
    int64_t n_sorted = 1; /* most lists come in order */
    while (n_sorted < n && !less(arg, item + (size_t)n_sorted * size, item + (size_t)(n_sorted - 1) * size))
        ++n_sorted;
    if (n_sorted >= n) return;
    if (n <= 32) {
        for (int64_t i = n_sorted; i < n; ++i) {
            int64_t j = i;
            memcpy(x, item + (size_t)i * size, size);
            for (; j > 0 && less(arg, x, item + (size_t)(j - 1) * size); --j)
                memcpy(item + (size_t)j * size, item + (size_t)(j - 1) * size, size);
            memcpy(item + (size_t)j * size, x, size);
        }
        return;
    }
    /* heap sort: the first loop makes the heap, the second takes the largest off its top */
    for (int64_t top = n / 2, end = n; end > 1;) {
        if (top > 0) {
            memcpy(x, item + (size_t)--top * size, size);
        } else {
            memcpy(x, item + (size_t)--end * size, size);
            memcpy(item + (size_t)end * size, item, size);
        }
        int64_t i = top;
        for (int64_t child = 2 * i + 1; child < end; child = 2 * i + 1) {
            if (child + 1 < end && less(arg, item + (size_t)child * size, item + (size_t)(child + 1) * size)) ++child;
            if (!less(arg, x, item + (size_t)child * size)) break;
            memcpy(item + (size_t)i * size, item + (size_t)child * size, size);
            i = child;
        }
        memcpy(item + (size_t)i * size, x, size);
    }
}

#endif
