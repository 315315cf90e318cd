/* SPDX-License-Identifier: MIT */
#include "kernel/variants.h"

extern const k_variant k_variant_baseline;
#if defined(__x86_64__)
extern const k_variant k_variant_avx2, k_variant_avx512;
#endif

const k_variant *k_variant_get(loxo_isa isa)
{
#if defined(__x86_64__)
    if (isa == LOXO_ISA_AVX512) return &k_variant_avx512;
    if (isa == LOXO_ISA_AVX2) return &k_variant_avx2;
#endif
    (void)isa;
    return &k_variant_baseline;
}
