/* SPDX-License-Identifier: MIT
 * Formats by the names of files. */
#ifndef LOXO_IO_FORMAT_NAMES_H
#define LOXO_IO_FORMAT_NAMES_H

#include <loxo/io.h>

/* Of the suffix, in any case: ".ply", ".gii", ...; LOXO_FORMAT_AUTO when it tells nothing. "mesh.ply.gz" tells nothing. */
loxo_format loxo_format_from_suffix(const char *path);

#endif
