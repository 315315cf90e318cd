/* SPDX-License-Identifier: MIT
 * Any bytes under any name: the format is told from both, gzip is unpacked. */
#include "harness.h"

#include <loxo/io.h>

static loxo_status read_named(loxo_context *ctx, const uint8_t *bytes, size_t n, loxo_soup *soup)
{
    static const char *const names[] = {"a", "a.ply", "a.obj", "a.off", "a.stl", "a.surf.gii", "lh.white", "a.npy"};
    const loxo_read_settings settings = {.max_bytes = (size_t)1 << 20};
    /* The last byte chooses the name; no format begins there. */
    const char *name = names[n == 0 ? 0 : bytes[n - 1] % (sizeof names / sizeof names[0])];
    return loxo_read_mesh_memory(ctx, bytes, n, name, &settings, soup);
}

FUZZ_READER(read_named(ctx, bytes, n, &soup), soup.n_vertices == 4 && soup.n_faces == 3)
