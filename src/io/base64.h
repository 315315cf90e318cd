/* SPDX-License-Identifier: MIT
 * Base64, RFC 4648 with padding. */
#ifndef LOXO_IO_BASE64_H
#define LOXO_IO_BASE64_H

#include <stdbool.h>
#include <stddef.h>

/* Four characters for each three bytes begun. Returns how many; out has room for (n + 2) / 3 * 4. */
size_t loxo_base64_encode(const unsigned char *bytes, size_t n, unsigned char *out);

/* Decodes in place, leaving out blanks and line ends. false when a character is none of Base64's, when padding is wrong
 * or something follows it; *n is then the place of the fault, else the number of bytes. */
bool loxo_base64_decode(unsigned char *text, size_t *n);

#endif
