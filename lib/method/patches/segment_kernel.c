/* segment_kernel.c: features of rotations, their sums and inner products.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/patches/segment_kernel.h"
#include "core/wide.h"

enum { WIDTH = 2 * VGI_WIDTH, SUMS = 32 / WIDTH };
typedef float floats __attribute__((vector_size(8 * VGI_WIDTH)));
typedef float floats_at __attribute__((vector_size(8 * VGI_WIDTH), aligned(4), may_alias));

VGI_INLINE floats load_floats(const float *p)
{
    return *(const floats_at *)p;
}

/* 32 partial sums for any width of vector, so that every instruction set adds in the same order. */
static float inner_product(const float *a, const float *b, size_t n)
{
    floats sum[SUMS] = {{0}};
    size_t i = 0;
    for (; i + 32 <= n; i += 32)
#pragma GCC unroll 8
        for (size_t k = 0; k < SUMS; k++) sum[k] += load_floats(a + i + k * WIDTH) * load_floats(b + i + k * WIDTH);
#pragma GCC unroll 8
    for (size_t k = 0; k < SUMS / 2; k++) {
        if (i < n) sum[k] += load_floats(a + i + k * WIDTH) * load_floats(b + i + k * WIDTH);
        sum[k] += sum[SUMS / 2 + k];
    }
    float total = 0;
    for (size_t k = 0; k < SUMS / 2; k++)
        for (size_t j = 0; j < WIDTH; j++) total += sum[k][j];
    return total;
}

static void move_feature(const float *restrict x, size_t n, double *restrict to, double *restrict from)
{
    for (size_t i = 0; i < n; i++) to[i] += (double)x[i];
    for (size_t i = 0; from && i < n; i++) from[i] -= (double)x[i];
}

static void add_features(const vgi_lanes *rotation, size_t lanes, const uint32_t *at, const float *sign, float *to)
{
    float x[VGI_LANES * 9]; /* in pose order, so that neighbouring features are added consecutively */
    for (size_t n = 0; n < 9; n++)
        for (size_t k = 0; k < VGI_LANES; k++) x[9 * k + n] = (float)(rotation[n][k] - (n % 4 == 0));
    for (size_t i = 0; i < 9 * lanes; i++) to[at[i]] += sign[i] * x[i];
}

const vgi_segment_kernel VGI_OF_SET(vgi_segment_kernel) = {inner_product, move_feature, add_features};
