/* SPDX-License-Identifier: MIT
 * Random numbers that are the same everywhere: a counter hashed with a seed (splitmix64's finaliser), so element i can
 * be drawn alone and in parallel.
 * source  Steele, Lea, Flood 2014, Fast Splittable Pseudorandom Number Generators */
#ifndef LOXO_BASE_RNG_H
#define LOXO_BASE_RNG_H

#include <stdint.h>

static inline uint64_t loxo_random_u64(uint64_t seed, uint64_t i)
{
    uint64_t z = seed * 0xd1342543de82ef95u + (i + 1u) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* Uniform in [0, 1). */
static inline double loxo_random_unit(uint64_t seed, uint64_t i)
{
    return (double)(loxo_random_u64(seed, i) >> 11) * 0x1p-53;
}

#endif
