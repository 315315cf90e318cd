/* SPDX-License-Identifier: MIT */
#include "harness.h"
#include "io/formats.h"

FUZZ_READER(loxo_read_off(ctx, bytes, n, "input", &soup), soup.n_vertices == 4 && soup.n_faces == 3)
