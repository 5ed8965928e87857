/* segment_kernel.h: inner loops of K-means over features of binary32. Rows of features are multiples of 16 numbers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SEGMENT_KERNEL_H
#define VG_SEGMENT_KERNEL_H

#include "core/isa.h"
#include "core/lanes.h"

typedef struct vgi_segment_kernel {
    /* inner: a . b, n a multiple of 16 */
    float (*inner)(const float *a, const float *b, size_t n);
    /* move: *to += x, and *from -= x unless it is NULL */
    void (*move)(const float *x, size_t n, double *to, double *from);
    /* add: the contribution of the 9 rotation entries of the first `lanes` poses to a feature: entry n of pose k,
     * minus that of the identity, is added to to[at[9 k + n]] with sign[9 k + n] */
    void (*add)(const vgi_lanes *rotation, size_t lanes, const uint32_t *at, const float *sign, float *to);
} vgi_segment_kernel;
VGI_KERNEL(vgi_segment_kernel)

#endif
