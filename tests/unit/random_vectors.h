/* SPDX-License-Identifier: MIT
 * Directions and planes drawn at random, the same everywhere. */
#ifndef LOXO_TESTS_UNIT_RANDOM_VECTORS_H
#define LOXO_TESTS_UNIT_RANDOM_VECTORS_H

#include "base/rng.h"
#include "kernel/vec3.h"

/* Random numbers in [-1, 1). */
static inline double draw(uint64_t *count) { return 2.0 * loxo_random_unit(7, (*count)++) - 1.0; }

static inline loxo_vec3 draw_unit(uint64_t *count)
{
    for (;;) {
        const loxo_vec3 v = {draw(count), draw(count), draw(count)};
        const double norm = v3_norm(v);
        if (norm > 0.1 && norm < 1.0) return v3_scale(1.0 / norm, v);
    }
}

/* Two orthogonal unit vectors. */
static inline void draw_plane(uint64_t *count, loxo_vec3 *x, loxo_vec3 *y)
{
    *x = draw_unit(count);
    const loxo_vec3 other = draw_unit(count), across = v3_axpy(other, -v3_dot(other, *x), *x);
    *y = v3_scale(1.0 / v3_norm(across), across);
}

#endif
