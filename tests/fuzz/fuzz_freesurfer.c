/* SPDX-License-Identifier: MIT */
#include "harness.h"
#include "io/formats.h"

FUZZ_READER(loxo_read_freesurfer(ctx, bytes, n, "input", &soup), soup.n_faces == 3)
