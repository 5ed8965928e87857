/* rig_kernel.h: the inner loops of fitting a rig.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RIG_KERNEL_H
#define VG_RIG_KERNEL_H

#include "core/isa.h"

typedef struct vgi_rig_kernel {
    /* dots: y[k] := row k of four (n numbers each) times x */
    void (*dots)(const double *rows, const double *x, size_t n, double y[4]);
    /* add_rows: y += c[0] times row 0 + ... + c[2] times row 2 (n numbers each, one after another) + c[3] times last */
    void (*add_rows)(const double *rows, const double *last, const double c[4], size_t n, double *y);
} vgi_rig_kernel;
VGI_KERNEL(vgi_rig_kernel)

#endif
