/* SPDX-License-Identifier: MIT
 * Numbers as text, whatever locale the host has set. */
#ifndef LOXO_IO_PRINT_H
#define LOXO_IO_PRINT_H

#include <stddef.h>
#include <stdint.h>

#define LOXO_PRINT_MAX 40 /* bytes that any number takes at most */

/* All return the number of characters; nothing is ended by NUL.
 *
 * Floating point reads back to the same bits: the shortest such text for magnitudes from 1e-6 to 1e17 (where ordinary
 * coordinates are: 128-bit integers decide exactly), 17 (9) digits outside. Infinities are inf and -inf, NaN is nan. */
size_t loxo_print_int(char *text, int64_t value);
size_t loxo_print_double(char *text, double value);
size_t loxo_print_float(char *text, float value);

#endif
