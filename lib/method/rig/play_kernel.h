/* play_kernel.h: from the product of a map (a row per vertex with x, y and z of each pose) to the poses.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PLAY_KERNEL_H
#define VG_PLAY_KERNEL_H

#include "core/isa.h"

typedef struct vgi_play_kernel {
    /* spread: vertices[k] + 3 (first + v) := numbers 3 k .. 3 k + 2 of row v, plus the root of pose k; n poses, rows of
     * 3 n numbers */
    void (*spread_single)(const float *product, size_t rows, size_t n, const double (*roots)[3],
                          double *const *vertices, size_t first);
    void (*spread_double)(const double *product, size_t rows, size_t n, const double (*roots)[3],
                          double *const *vertices, size_t first);
} vgi_play_kernel;
VGI_KERNEL(vgi_play_kernel)

#endif
