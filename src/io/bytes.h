/* SPDX-License-Identifier: MIT
 * Numbers out of bytes, unaligned and of either byte order. */
#ifndef LOXO_IO_BYTES_H
#define LOXO_IO_BYTES_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
#define LOXO_HOST_IS_BIG true
#else
#define LOXO_HOST_IS_BIG false
#endif

static inline uint16_t loxo_load_u16(const uint8_t *p, bool swap)
{
    uint16_t x;
    memcpy(&x, p, sizeof x);
    return swap ? __builtin_bswap16(x) : x;
}

static inline uint32_t loxo_load_u32(const uint8_t *p, bool swap)
{
    uint32_t x;
    memcpy(&x, p, sizeof x);
    return swap ? __builtin_bswap32(x) : x;
}

static inline uint64_t loxo_load_u64(const uint8_t *p, bool swap)
{
    uint64_t x;
    memcpy(&x, p, sizeof x);
    return swap ? __builtin_bswap64(x) : x;
}

static inline float loxo_load_float(const uint8_t *p, bool swap)
{
    const uint32_t x = loxo_load_u32(p, swap);
    float f;
    memcpy(&f, &x, sizeof f);
    return f;
}

static inline double loxo_load_double(const uint8_t *p, bool swap)
{
    const uint64_t x = loxo_load_u64(p, swap);
    double f;
    memcpy(&f, &x, sizeof f);
    return f;
}

#endif
