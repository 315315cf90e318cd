/* SPDX-License-Identifier: MIT */
#include "harness.h"
#include "io/formats.h"

FUZZ_READER(loxo_read_gifti(ctx, bytes, n, "input", &soup), soup.n_vertices == 4 && soup.triangle[0] == 3)
