/* SPDX-License-Identifier: MIT
 * Numbers from text, the same under every locale: the text is (pointer, end) and need not end with a zero. */
#ifndef LOXO_IO_SCAN_H
#define LOXO_IO_SCAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* What became of a token. A token is all that stands up to the next space or line end, or the end of the text. */
typedef enum loxo_scan {
    LOXO_SCAN_OK,
    LOXO_SCAN_BAD,       /* not a number of this kind, as a whole: `1.5abc`, `0x10`, `1,5`, `2.5` for an integer, `` */
    LOXO_SCAN_OVERFLOW,  /* an integer outside 64 bits */
    LOXO_SCAN_NONFINITE, /* a double that is NaN or infinite, spelled or by overflow (1e400); the value is set */
} loxo_scan;

/* The number that starts exactly at *at and must fill the whole token; *at moves behind the token, whatever the answer.
 * Doubles are correctly rounded; underflow is no fault. `+1`, `.5`, `1.`, `1E5`, and as not finite `nan`, `-inf`,
 * `infinity` in any case, `nan(7)`, `-1.#IND` are known. value is untouched by LOXO_SCAN_BAD. */
loxo_scan loxo_scan_double(const char **at, const char *end, double *value);
loxo_scan loxo_scan_int64(const char **at, const char *end, int64_t *value);

/* The integer at *at up to the first character that is no digit, as in `1/2/3`; *at moves there. */
loxo_scan loxo_scan_int64_prefix(const char **at, const char *end, int64_t *value);

/* Space, tab, line feed, vertical tab, form feed, carriage return. */
static inline bool loxo_is_space(char c) { return c == ' ' || (unsigned char)(c - '\t') < 5; }
static inline bool loxo_is_digit(char c) { return (unsigned char)(c - '0') < 10; }

static inline const char *loxo_token_end(const char *p, const char *end)
{
    while (p < end && !loxo_is_space(*p))
        ++p;
    return p;
}

/* Whether p starts with word, letters of any case; word is in lower case. */
bool loxo_starts_with(const char *p, const char *end, const char *word);

#endif
