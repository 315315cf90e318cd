/* SPDX-License-Identifier: MIT
 * Fields: .npy, text and GIFTI, told by the content. */
#include "harness.h"
#include "io/field.h"

static void fuzz_one(loxo_context *ctx, const uint8_t *bytes, size_t n)
{
    double *value = NULL;
    int64_t n_values = 0;
    const loxo_status status = loxo_read_field_bytes(ctx, bytes, n, "input", &value, &n_values);
    fuzz_check_status(ctx, status);
    FUZZ_CHECK(status >= 0 ? value != NULL && n_values >= 0 : value == NULL && n_values == 0);
    double sum = 0.0;
    for (int64_t i = 0; i < n_values; ++i)
        sum += value[i];
    FUZZ_PLANT(n_values == 5 && sum > 0.0);
    FUZZ_CHECK(sum <= 0.0 || sum >= 0.0 || sum != sum);
    loxo_release(ctx, value);
}
