/* SPDX-License-Identifier: MIT */
#include "io/base64.h"

#include <stdint.h>

size_t loxo_base64_encode(const unsigned char *bytes, size_t n, unsigned char *out)
{
    static const unsigned char letters[65] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    size_t used = 0;
    for (size_t i = 0; i < n; i += 3, used += 4) {
        const size_t n_left = n - i;
        const uint32_t group = (uint32_t)bytes[i] << 16 | (n_left > 1 ? (uint32_t)bytes[i + 1] << 8 : 0) |
                               (n_left > 2 ? (uint32_t)bytes[i + 2] : 0);
        out[used] = letters[group >> 18];
        out[used + 1] = letters[group >> 12 & 63];
        out[used + 2] = n_left > 1 ? letters[group >> 6 & 63] : '=';
        out[used + 3] = n_left > 2 ? letters[group & 63] : '=';
    }
    return used;
}

/* 0..63; 64: padding; 65: blank; 66: none of Base64's. */
static unsigned value_of(unsigned char c)
{
    if (c >= 'A' && c <= 'Z') return c - (unsigned)'A';
    if (c >= 'a' && c <= 'z') return c - (unsigned)'a' + 26;
    if (c >= '0' && c <= '9') return c - (unsigned)'0' + 52;
    switch (c) {
    case '+': return 62;
    case '/': return 63;
    case '=': return 64;
    case ' ':
    case '\t':
    case '\n':
    case '\r': return 65;
    default: return 66;
    }
}

bool loxo_base64_decode(unsigned char *text, size_t *n)
{
    unsigned char value[256];
    uint32_t group = 0;
    unsigned n_in_group = 0, n_padding = 0;
    size_t used = 0;
    for (unsigned c = 0; c < 256; ++c)
        value[c] = (unsigned char)value_of((unsigned char)c);
    for (size_t i = 0; i < *n; ++i) {
        const unsigned v = value[text[i]];
        if (v == 65) continue;
        if (v == 66 || (v == 64 && n_in_group < 2) || (v != 64 && n_padding > 0) || n_in_group + n_padding == 4) {
            *n = i;
            return false;
        }
        if (v == 64) {
            ++n_padding;
            continue;
        }
        group = group << 6 | v;
        if (++n_in_group == 4) {
            text[used++] = (unsigned char)(group >> 16);
            text[used++] = (unsigned char)(group >> 8);
            text[used++] = (unsigned char)group;
            n_in_group = 0;
            group = 0;
        }
    }
    if (n_in_group == 0 && n_padding == 0) {
        *n = used;
        return true;
    }
    if (n_in_group + n_padding != 4) return false;
    if (n_in_group == 2) {
        text[used++] = (unsigned char)(group >> 4);
    } else {
        text[used++] = (unsigned char)(group >> 10);
        text[used++] = (unsigned char)(group >> 2);
    }
    *n = used;
    return true;
}
