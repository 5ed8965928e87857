/* rig_kernel.h: the inner loops of fitting a rig.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RIG_KERNEL_H
#define VG_RIG_KERNEL_H

#include "core/isa.h"

typedef struct vgi_rig_kernel {
    /* dots: y[k] := row k of four (n numbers each) times x */
    void (*dots)(const double *rows, const double *x, size_t n, double y[4]);
} vgi_rig_kernel;
VGI_KERNEL(vgi_rig_kernel)

#endif
