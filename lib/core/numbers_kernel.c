/* numbers_kernel.c: test for finite numbers; copies without negative zeros, and in binary32.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/numbers_kernel.h"
#include "core/wide.h"

/* x - x is 0 for finite x and NaN otherwise; bits are or-ed so that the loop needs no branch. */
VGI_INLINE vgi_mask not_finite(vgi_wide x)
{
    return (vgi_mask)(x - x); /* NOLINT(misc-redundant-expression) */
}

static bool all_finite(const double *x, size_t n)
{
    enum { SOME = 4 };
    vgi_mask bad[SOME] = {{0}};
    for (; n >= SOME * VGI_WIDTH; n -= SOME * VGI_WIDTH, x += SOME * VGI_WIDTH) {
#pragma GCC unroll 4
        for (size_t k = 0; k < SOME; k++) bad[k] |= not_finite(vgi_load(x + k * VGI_WIDTH));
    }
    for (; n >= VGI_WIDTH; n -= VGI_WIDTH, x += VGI_WIDTH) bad[0] |= not_finite(vgi_load(x));
    vgi_wide rest = {0};
    if (n) memcpy(&rest, x, n * sizeof *x);
    bad[0] |= bad[1] | bad[2] | bad[3] | not_finite(rest);
    int64_t bits = 0;
    for (int i = 0; i < VGI_WIDTH; i++) bits |= bad[0][i];
    return bits == 0;
}

static void plain_zeros(double *to, const double *from, size_t n)
{
    size_t i = 0;
    for (; i + VGI_WIDTH <= n; i += VGI_WIDTH) vgi_store(to + i, vgi_load(from + i) + vgi_same(0));
    for (; i < n; i++) to[i] = from[i] + 0.0;
}

/* The compiler vectorises this; the difference is 0 or NaN. */
static bool to_single(float *restrict to, const double *restrict from, size_t n)
{
    uint32_t bad = 0;
    for (size_t i = 0; i < n; i++) {
        float y = (float)from[i], zero = y - y; /* NOLINT(misc-redundant-expression) */
        to[i] = y;
        bad |= vgi_float_bits(zero);
    }
    return bad == 0;
}

const vgi_numbers_kernel VGI_OF_SET(vgi_numbers_kernel) = {all_finite, plain_zeros, to_single};
