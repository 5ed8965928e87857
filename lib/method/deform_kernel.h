/* deform_kernel.h: deformed target vectors of one face in eight poses at once (Frames, MATH 4).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_DEFORM_KERNEL_H
#define VG_DEFORM_KERNEL_H

#include "core/core.h"

typedef struct vgi_vec {
    vgi_lanes x, y, z;
} vgi_vec;

/* vgi_transfer_faces: faces first .. last-1, each of 3 or more corners.
 *   start, vert   the graph (vg_graph)
 *   poses         8 poses: positions if `vertices`, else vectors
 *   coordinates   3 per corner: the target's vector in the frame of the source's reference corner, over the length of
 *                 the source's reference vector
 *   shortest2     squared length below which a vector is degenerate
 *   skip          1 per face: do nothing
 *   w             workspace of max corners + 1
 *   out           lanes of them, vectors of the target
 *   bad           called for each face with a degenerate corner in one of the first `lanes` poses, after its vectors have been written */
typedef struct vgi_transfer {
    const uint32_t *start, *vert;
    const double *const *poses;
    bool vertices;
    const double *coordinates;
    double shortest2;
    const unsigned char *skip;
    double *const *out;
    size_t lanes;
    void (*bad)(void *context, size_t face, unsigned lanes);
    void *context;
} vgi_transfer;

void vgi_transfer_faces(const vgi_transfer *t, size_t first, size_t last, vgi_vec *w);

#endif
