/* map_kernel.h: what eight poses add to the sums that a map is fitted from.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_MAP_KERNEL_H
#define VG_MAP_KERNEL_H

#include "core/isa.h"
#include "core/lanes.h"

/* The similarity x -> A x + t of a patch in eight poses. Where there are fewer, A and its rotation are 0 in the other
 * lanes. */
typedef struct vgi_map_motion {
    double a[9][VGI_LANES], rotation[9][VGI_LANES], t[3][VGI_LANES]; /* not aligned as vgi_lanes are */
} vgi_map_motion;

typedef struct vgi_map_kernel {
    /* face: pull (3 per corner) += A' (x - centre of the face); turn (9) += rotation' face_turn; m: of the face's patch */
    void (*face)(const vgi_map_motion *m, const double *const *poses, const uint32_t *vert, size_t corners,
                 const vgi_lanes *face_turn, double *pull, double *turn);
    /* vertex: want (3 per patch) += A' (x - t), A of the patches near[0] .. near[n - 1] of m, t of the owner */
    void (*vertex)(const vgi_map_motion *m, size_t owner, const uint32_t *near, size_t n, const double *const *poses,
                   size_t v, double *want);
} vgi_map_kernel;
VGI_KERNEL(vgi_map_kernel)

#endif
