/* SPDX-License-Identifier: MIT
 * Numbers from text, the same under every locale: the text is (pointer, end) and need not end with a zero. */
#ifndef LOXO_IO_SCAN_H
#define LOXO_IO_SCAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* What became of a token. A token is all that stands up to the next blank, line end or end of the text. */
typedef enum loxo_scan {
    LOXO_SCAN_OK,
    LOXO_SCAN_NONE, /* no token: only blanks up to the end of the line */
    LOXO_SCAN_BAD, /* not a number of this kind, as a whole: `1.5abc`, `0x10`, `1,5`, `2.5` where an integer is asked */
    LOXO_SCAN_OVERFLOW,  /* an integer outside 64 bits */
    LOXO_SCAN_NONFINITE, /* a double that is NaN or infinite, spelled or by overflow (1e400); the value is set */
} loxo_scan;

/* The number that starts exactly at *p and must fill the whole token; *p moves behind the token, whatever the answer.
 * Doubles are correctly rounded; underflow is no fault; `+1`, `.5`, `1.`, `1e5`, `nan`, `inf` in any case are known. */
loxo_scan loxo_scan_double(const char **p, const char *end, double *value);
loxo_scan loxo_scan_int64(const char **p, const char *end, int64_t *value);

/* Blanks within a line: space, tab, vertical tab, form feed. */
static inline bool loxo_is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
static inline bool loxo_is_line_end(char c) { return c == '\n' || c == '\r'; }

static inline const char *loxo_skip_blanks(const char *p, const char *end)
{
    while (p < end && loxo_is_blank(*p))
        ++p;
    return p;
}

#endif
