/* SPDX-License-Identifier: MIT */
#include "harness.h"
#include "io/formats.h"

FUZZ_READER(loxo_read_gifti(ctx, bytes, n, "input", &soup),
            soup.position_float != NULL && soup.n_vertices == 4 && soup.position_float[0] > 1.0f)
