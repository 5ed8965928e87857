/* lanes.h: eight poses side by side, and what all numeric kernels do with them.
 * Internal. Leaves out which instructions a kernel is compiled for: each one says that itself.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_LANES_H
#define VG_LANES_H

#include "core/core.h"

/* Eight poses side by side: the unit of every numeric kernel. GCC and Clang lower it to what the machine has. */
enum { VGI_LANES = 8 };
typedef double vgi_lanes __attribute__((vector_size(64)));
typedef int64_t vgi_mask __attribute__((vector_size(64))); /* what comparing lanes gives: -1 or 0 */

/* vgi_gather: number i of eight arrays. */
static inline __attribute__((always_inline)) vgi_lanes vgi_gather(const double *const *p, size_t i)
{
    return (vgi_lanes){p[0][i], p[1][i], p[2][i], p[3][i], p[4][i], p[5][i], p[6][i], p[7][i]};
}

/* vgi_lane_roots: the square root of each. */
static inline __attribute__((always_inline)) vgi_lanes vgi_lane_roots(vgi_lanes a)
{
    for (int i = 0; i < VGI_LANES; i++) a[i] = __builtin_sqrt(a[i]);
    return a;
}

/* vgi_lane_bits: bit k: is mask[k] set? */
static inline __attribute__((always_inline)) unsigned vgi_lane_bits(vgi_mask mask)
{
    unsigned bits = 0;
    for (int k = 0; k < VGI_LANES; k++) bits |= (unsigned)(mask[k] & 1) << k;
    return bits;
}

/* 3 x 3 matrices, row-major: the sum of squares; the cofactors (x^-1 = c' / det), and the determinant. */
static inline __attribute__((always_inline)) vgi_lanes vgi_lane_squares(const vgi_lanes *x)
{
    vgi_lanes s = {0};
    for (int i = 0; i < 9; i++) s += x[i] * x[i];
    return s;
}

static inline __attribute__((always_inline)) vgi_lanes vgi_lane_cofactors(const vgi_lanes *x, vgi_lanes *c)
{
    c[0] = x[4] * x[8] - x[5] * x[7], c[1] = x[5] * x[6] - x[3] * x[8], c[2] = x[3] * x[7] - x[4] * x[6];
    c[3] = x[2] * x[7] - x[1] * x[8], c[4] = x[0] * x[8] - x[2] * x[6], c[5] = x[1] * x[6] - x[0] * x[7];
    c[6] = x[1] * x[5] - x[2] * x[4], c[7] = x[2] * x[3] - x[0] * x[5], c[8] = x[0] * x[4] - x[1] * x[3];
    return x[0] * c[0] + x[1] * c[1] + x[2] * c[2];
}

#endif
