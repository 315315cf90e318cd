/* SPDX-License-Identifier: MIT */
#include "io/sniff.h"

#include "base/context.h"
#include "io/bytes.h"
#include "io/format_names.h"
#include "io/scan.h"

#include <stdio.h>

/* First bytes that are sure signs, of what is read and of what is not. Letters are compared in any case where the sign is
 * in lower case only and `any_case` is set. */
static const struct {
    const char *sign;
    size_t n;
    bool any_case;
    loxo_format format; /* LOXO_FORMAT_AUTO: not read */
    loxo_status status;
    const char *looks_like;
} signs[] = {
    {"\xff\xff\xfe", 3, false, LOXO_FORMAT_FREESURFER, LOXO_OK, "a FreeSurfer surface"},
    {"\xff\xff\xff", 3, false, LOXO_FORMAT_FREESURFER, LOXO_OK, "a FreeSurfer surface of quadrangles"},
    {"\xff\xff\xfd", 3, false, LOXO_FORMAT_FREESURFER, LOXO_OK, "a FreeSurfer surface of quadrangles"},
    {"\xff\xfe", 2, false, LOXO_FORMAT_AUTO, LOXO_ERR_MALFORMED, "text in UTF-16: save it as UTF-8"},
    {"\xfe\xff", 2, false, LOXO_FORMAT_AUTO, LOXO_ERR_MALFORMED, "text in UTF-16: save it as UTF-8"},
    {"p\0l\0y", 5, false, LOXO_FORMAT_AUTO, LOXO_ERR_MALFORMED, "text in UTF-16: save it as UTF-8"},
    {"\0p\0l\0y", 6, false, LOXO_FORMAT_AUTO, LOXO_ERR_MALFORMED, "text in UTF-16: save it as UTF-8"},
    {"\x1f\x8b", 2, false, LOXO_FORMAT_AUTO, LOXO_ERR_UNSUPPORTED, "gzip inside gzip: unpack it first"},
    {"PK\3\4", 4, false, LOXO_FORMAT_AUTO, LOXO_ERR_UNSUPPORTED, "a zip archive: unpack it first"},
    {"\xfd"
     "7zXZ",
     5, false, LOXO_FORMAT_AUTO, LOXO_ERR_UNSUPPORTED, "an xz file: unpack it first"},
    {"BZh", 3, false, LOXO_FORMAT_AUTO, LOXO_ERR_UNSUPPORTED, "a bzip2 file: unpack it first"},
    {"(\xb5/\xfd", 4, false, LOXO_FORMAT_AUTO, LOXO_ERR_UNSUPPORTED, "a zstd file: unpack it first"},
    {"version https://git-lfs", 23, false, LOXO_FORMAT_AUTO, LOXO_ERR_MALFORMED,
     "a Git LFS pointer, not the file itself (git lfs pull)"},
    {"<!doctype gifti", 15, true, LOXO_FORMAT_GIFTI, LOXO_OK, "GIFTI"},
    {"<gifti", 6, true, LOXO_FORMAT_GIFTI, LOXO_OK, "GIFTI"},
    {"<!doctype html", 14, true, LOXO_FORMAT_AUTO, LOXO_ERR_MALFORMED, "an HTML page (a failed download?)"},
    {"<html", 5, true, LOXO_FORMAT_AUTO, LOXO_ERR_MALFORMED, "an HTML page (a failed download?)"},
    {"<vtkfile", 8, true, LOXO_FORMAT_AUTO, LOXO_ERR_UNSUPPORTED, "VTK XML, which is only written"},
    {"# vtk datafile", 14, true, LOXO_FORMAT_AUTO, LOXO_ERR_UNSUPPORTED, "legacy VTK, which is not read"},
    {"meshversionformatted", 20, true, LOXO_FORMAT_AUTO, LOXO_ERR_UNSUPPORTED, "a Medit mesh, which is not read"},
    {"$meshformat", 11, true, LOXO_FORMAT_AUTO, LOXO_ERR_UNSUPPORTED, "a Gmsh mesh, which is not read"},
    {"glTF", 4, false, LOXO_FORMAT_AUTO, LOXO_ERR_UNSUPPORTED, "glTF, which is not read"},
    {"\x93NUMPY", 6, false, LOXO_FORMAT_AUTO, LOXO_ERR_UNSUPPORTED, "a NumPy array, not a surface"},
    {"\x89PNG", 4, false, LOXO_FORMAT_AUTO, LOXO_ERR_MALFORMED, "a PNG picture"},
    {"%PDF", 4, false, LOXO_FORMAT_AUTO, LOXO_ERR_MALFORMED, "a PDF document"},
    {"\x7f"
     "ELF",
     4, false, LOXO_FORMAT_AUTO, LOXO_ERR_MALFORMED, "a program"},
};

static loxo_status fail_as(loxo_context *ctx, const char *name, loxo_status status, const char *looks_like)
{
    return loxo_fail_at(ctx, status, (loxo_place){.file = name, .byte = -1, .element = -1}, "looks like %s",
                        looks_like);
}

static const char *skip_space(const char *p, const char *end)
{
    while (p < end && loxo_is_space(*p))
        ++p;
    return p;
}

static const char *skip_line(const char *p, const char *end)
{
    while (p < end && *p != '\n' && *p != '\r')
        ++p;
    return skip_space(p, end);
}

static bool has_sign(const char *p, const char *end, size_t i)
{
    if (signs[i].any_case) return loxo_starts_with(p, end, signs[i].sign);
    return (size_t)(end - p) >= signs[i].n && memcmp(p, signs[i].sign, signs[i].n) == 0;
}

/* Over an XML declaration and comments, to what tells one XML from another. */
static const char *skip_xml_prolog(const char *p, const char *end)
{
    while (p < end && (loxo_starts_with(p, end, "<?xml") || loxo_starts_with(p, end, "<!--"))) {
        const bool is_comment = p[1] == '!';
        while (p < end && !(is_comment ? loxo_starts_with(p, end, "-->") : *p == '>'))
            ++p;
        p = skip_space(p < end ? p + (is_comment ? 3 : 1) : p, end);
    }
    return p;
}

static bool looks_like_off(const char *p, const char *end)
{
    while (p < end && *p == '#')
        p = skip_line(p, end);
    if (end - p >= 2 && p[0] == 'S' && p[1] == 'T') p += 2;
    for (int i = 0; i < 4 && p < end && memchr("CN4n", *p, 4) != NULL; ++i)
        ++p;
    return end - p >= 3 && memcmp(p, "OFF", 3) == 0;
}

/* One of the first lines that is no comment begins with a word that OBJ files begin with. */
static bool looks_like_obj(const char *p, const char *end)
{
    static const char *const words[] = {"v", "vn", "vt", "vp", "f", "o", "g", "s", "mtllib", "usemtl"};
    while (p < end && *p == '#')
        p = skip_line(p, end);
    const size_t n = (size_t)(loxo_token_end(p, end) - p);
    for (size_t i = 0; i < sizeof words / sizeof words[0]; ++i) {
        if (strlen(words[i]) == n && memcmp(p, words[i], n) == 0) return true;
    }
    return false;
}

static bool looks_like_binary_stl(const uint8_t *head, size_t n, int64_t n_total)
{
    if (n < 84) return false;
    const uint32_t n_facets = loxo_load_u32(head + 80, LOXO_HOST_IS_BIG);
    /* Of a stream, whose size is not known, some facet must be there: an endless device of zeros has none. */
    return n_total < 0 ? n_facets > 0 && n == 65536 && memchr(head, 0, n) != NULL
                       : n_total == 84 + 50 * (int64_t)n_facets;
}

/* The format that the content shows, LOXO_FORMAT_AUTO when it shows none. A failure when it is known and not read. */
static loxo_status look(loxo_context *ctx, const uint8_t *head, size_t n, int64_t n_total, const char *name,
                        loxo_format *format)
{
    const char *p = (const char *)head, *end = p + n;
    *format = LOXO_FORMAT_AUTO;
    if (n_total >= 0 && looks_like_binary_stl(head, n, n_total)) { /* whatever its header says */
        *format = LOXO_FORMAT_STL;
        return LOXO_OK;
    }
    if (n >= 3 && memcmp(p, "\xef\xbb\xbf", 3) == 0) p += 3;
    const char *begin = p;
    p = skip_xml_prolog(skip_space(p, end), end);
    for (size_t i = 0; i < sizeof signs / sizeof signs[0]; ++i) {
        if (!has_sign(p, end, i) && !has_sign(begin, end, i)) continue;
        if (signs[i].status < 0) return fail_as(ctx, name, signs[i].status, signs[i].looks_like);
        *format = signs[i].format;
        return LOXO_OK;
    }
    if (loxo_starts_with(begin, end, "ply") && loxo_token_end(begin, end) - begin == 3)
        *format = LOXO_FORMAT_PLY;
    else if (looks_like_off(p, end))
        *format = LOXO_FORMAT_OFF;
    else if (loxo_starts_with(p, end, "solid"))
        *format = LOXO_FORMAT_STL;
    else if (looks_like_obj(p, end))
        *format = LOXO_FORMAT_OBJ;
    else if (p < end && *p == '<')
        return fail_as(ctx, name, LOXO_ERR_UNSUPPORTED, "XML of an unknown kind");
    return LOXO_OK;
}

/* Of the name without ".gz". */
static loxo_format suffix_format(const char *name)
{
    char plain[4096];
    const size_t n = strlen(name);
    if (n < 4 || n >= sizeof plain || !loxo_starts_with(name + n - 3, name + n, ".gz"))
        return loxo_format_from_suffix(name);
    snprintf(plain, sizeof plain, "%.*s", (int)(n - 3), name);
    return loxo_format_from_suffix(plain);
}

loxo_status loxo_sniff(loxo_context *ctx, const uint8_t *head, size_t n, int64_t n_total, const char *name,
                       loxo_format wanted, loxo_format *format)
{
    const loxo_place place = {.file = name, .byte = -1, .element = -1};
    const loxo_format suffix = suffix_format(name);
    loxo_format seen;
    loxo_status status;
    *format = LOXO_FORMAT_AUTO;
    if (n == 0) return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "empty file");
    if (wanted > LOXO_FORMAT_FREESURFER)
        return loxo_fail_at(ctx, LOXO_ERR_UNSUPPORTED, place, "surfaces are not read from %s",
                            loxo_format_name(wanted));
    if ((status = look(ctx, head, n, n_total, name, &seen)) < 0) return status;

    const loxo_format expected = wanted != LOXO_FORMAT_AUTO ? wanted : suffix;
    if (seen != LOXO_FORMAT_AUTO && expected != LOXO_FORMAT_AUTO && seen != expected)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "%s %s, but the content looks like %s",
                            wanted != LOXO_FORMAT_AUTO ? "asked for as" : "the suffix says", loxo_format_name(expected),
                            loxo_format_name(seen));
    if (seen != LOXO_FORMAT_AUTO) {
        *format = seen;
        return LOXO_OK;
    }
    /* Nothing to be seen: a broken STL or OBJ may still be called one, and its reader tells what is wrong. */
    if (expected == LOXO_FORMAT_STL || expected == LOXO_FORMAT_OBJ) {
        *format = expected;
        return LOXO_OK;
    }
    if (expected == LOXO_FORMAT_AUTO && looks_like_binary_stl(head, n, n_total)) {
        *format = LOXO_FORMAT_STL;
        return LOXO_OK;
    }
    if (expected != LOXO_FORMAT_AUTO && expected <= LOXO_FORMAT_FREESURFER)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, place, "does not begin as a %s file does",
                            loxo_format_name(expected));
    return loxo_fail_at(ctx, LOXO_ERR_UNSUPPORTED, place,
                        "no known format of surfaces: neither its content nor its name tell one");
}
