/* rig_kernel.c: the inner loops of fitting a rig.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/rig_kernel.h"
#include "core/wide.h"

/* The order of the sum is the same for every width. */
VGI_INLINE double across(const vgi_wide *parts)
{
    double x[VGI_LANES];
#pragma GCC unroll 4
    for (size_t p = 0; p < VGI_PARTS; p++) vgi_store(x + p * VGI_WIDTH, parts[p]);
    return (x[0] + x[4]) + (x[2] + x[6]) + ((x[1] + x[5]) + (x[3] + x[7]));
}

static void dots(const double *rows, const double *x, size_t n, double y[4])
{
    size_t whole = n - n % VGI_LANES;
    vgi_wide sum[4][VGI_PARTS] = {{{0}}};
    for (size_t i = 0; i < whole; i += VGI_LANES)
#pragma GCC unroll 4
        for (size_t p = 0; p < VGI_PARTS; p++) {
            vgi_wide at = vgi_load(x + i + p * VGI_WIDTH);
#pragma GCC unroll 4
            for (size_t k = 0; k < 4; k++) sum[k][p] += vgi_load(rows + k * n + i + p * VGI_WIDTH) * at;
        }
    for (size_t k = 0; k < 4; k++) {
        y[k] = across(sum[k]);
        for (size_t i = whole; i < n; i++) y[k] += rows[k * n + i] * x[i];
    }
}

static void add_rows(const double *rows, const double *last, const double c[4], size_t n, double *y)
{
    size_t whole = n - n % VGI_WIDTH;
    vgi_wide a = vgi_same(c[0]), b = vgi_same(c[1]), d = vgi_same(c[2]), e = vgi_same(c[3]);
    for (size_t i = 0; i < whole; i += VGI_WIDTH)
        vgi_store(y + i, vgi_load(y + i) + (a * vgi_load(rows + i) + b * vgi_load(rows + n + i) + d * vgi_load(rows + 2 * n + i) +
                                            e * vgi_load(last + i)));
    for (size_t i = whole; i < n; i++) y[i] += c[0] * rows[i] + c[1] * rows[n + i] + c[2] * rows[2 * n + i] + c[3] * last[i];
}

const vgi_rig_kernel VGI_OF_SET(vgi_rig_kernel) = {dots, add_rows};
