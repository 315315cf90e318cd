/* SPDX-License-Identifier: MIT
 * What the first look at atoms of the sphere finds, see moment_kernel.h. */
#ifndef LOXO_KERNEL_MOMENTS_H
#define LOXO_KERNEL_MOMENTS_H

/* About atoms that are to be unit vectors, and their weights; numbers that are none show in the sums. */
typedef struct k_first_look {
    double off;   /* greatest (|x|^2 - 1)^2 */
    double least; /* weight, or 1 */
} k_first_look;

#endif
