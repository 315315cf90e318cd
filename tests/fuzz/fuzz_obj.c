/* SPDX-License-Identifier: MIT */
#include "harness.h"
#include "io/formats.h"

FUZZ_READER(loxo_read_obj(ctx, bytes, n, "input", &soup), soup.n_vertices == 5 && soup.n_faces == 4)
