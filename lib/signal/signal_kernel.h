/* signal_kernel.h: the inner loops of fitting a signal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_KERNEL_H
#define VG_SIGNAL_KERNEL_H

#include "core/isa.h"

/* pull: point `at` of a layout against the first `count` others, each pair once. want: distances to them. Distances
 * in the plane below `least` count as `least`. With d the distance and u the difference from other j to the point:
 * stress += (d - want)^2; the point's pull (2 numbers) += want u / d, and that of j (bx, by) -= it. */
typedef struct vgi_pull {
    size_t count;
    const double *want, *x, *y;
    double least, at[2], *bx, *by;
    double stress, sum[2]; /* out */
} vgi_pull;

typedef struct vgi_signal_kernel {
    void (*pull)(vgi_pull *p);
    /* project: for each row of q (n numbers): v -= row times (row . v), which is added to c. */
    void (*project)(const double *q, size_t rows, size_t n, double *v, double *c);
    /* through: product (m) := a v, sum (n) := a' a v; a is m x n. */
    void (*through)(size_t n, size_t m, const double *v, const double *a, double *product, double *sum);
    /* distances: squared distances of row x from `count` others, `stride` apart */
    void (*distances)(const double *x, const double *others, size_t count, size_t stride, size_t m, double *square);
} vgi_signal_kernel;
VGI_KERNEL(vgi_signal_kernel)

#endif
