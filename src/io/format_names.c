/* SPDX-License-Identifier: MIT */
#include "io/format_names.h"

#include <string.h>

static const struct {
    const char *suffix;
    loxo_format format;
} suffixes[] = {
    {".ply", LOXO_FORMAT_PLY}, {".obj", LOXO_FORMAT_OBJ},   {".off", LOXO_FORMAT_OFF}, {".stl", LOXO_FORMAT_STL},
    {".vtp", LOXO_FORMAT_VTP}, {".gii", LOXO_FORMAT_GIFTI}, {".npy", LOXO_FORMAT_NPY}, {".csv", LOXO_FORMAT_CSV},
};

static bool ends_in(const char *path, const char *suffix)
{
    const size_t n = strlen(path), n_suffix = strlen(suffix);
    if (n < n_suffix) return false;
    for (size_t i = 0; i < n_suffix; ++i) {
        const char c = path[n - n_suffix + i];
        if ((c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c) != suffix[i]) return false;
    }
    return true;
}

loxo_format loxo_format_from_suffix(const char *path)
{
    for (size_t i = 0; i < sizeof suffixes / sizeof suffixes[0]; ++i)
        if (ends_in(path, suffixes[i].suffix)) return suffixes[i].format;
    return LOXO_FORMAT_AUTO;
}

const char *loxo_format_name(loxo_format format)
{
    switch (format) {
    case LOXO_FORMAT_AUTO: return "auto";
    case LOXO_FORMAT_PLY: return "ply";
    case LOXO_FORMAT_OBJ: return "obj";
    case LOXO_FORMAT_OFF: return "off";
    case LOXO_FORMAT_STL: return "stl";
    case LOXO_FORMAT_GIFTI: return "gifti";
    case LOXO_FORMAT_FREESURFER: return "freesurfer";
    case LOXO_FORMAT_VTP: return "vtp";
    case LOXO_FORMAT_NPY: return "npy";
    case LOXO_FORMAT_CSV: return "csv";
    }
    return "unknown";
}
