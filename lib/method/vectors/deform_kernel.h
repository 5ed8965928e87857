/* deform_kernel.h: deformed target vectors of one face in eight poses at once (Frames, MATH 4).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_DEFORM_KERNEL_H
#define VG_DEFORM_KERNEL_H

#include "core/isa.h"
#include "core/lanes.h"

/* What is transferred: see MATH 5. */
typedef enum vgi_method { VGI_POSE, VGI_GRADIENT, VGI_BLEND, VGI_OFFSET } vgi_method;

/* The deformation gradient of a face is D = (sum d_c r_c' + h n_d n_r') P with P = (sum r_c r_c' + h n_r n_r')^-1.
 * For the target's vector t the wanted vector is D t + rho (d - D r): the second term is the part of the source's
 * vector that no linear map of the face gives, scaled to the target (corners of a bent face are not linear images of
 * one another). With b = t - rho r this is sum d_k (p_k . b) + n_d (q . b) + rho d, p_k = P r_k, q = h P n_r.
 * By offset it is rho d + R b with the same b, R half the rotation of D and half that of the corner (Frames), and rho the
 * ratio of sizes of the whole meshes. */
typedef struct vgi_gradient {
    double p[3], b[3];
} vgi_gradient; /* per corner */
typedef struct vgi_gradient_face {
    double q[3], rho;
} vgi_gradient_face;

/* vgi_transfer_faces: faces first .. last-1, each with 3 or more corners.
 *   start, vert   the graph (vg_graph)
 *   poses         8 poses: positions if `vertices`, else vectors
 *   gradient, gradient_face   for all but VGI_POSE, see above
 *   coordinates   3 per corner, in the frame of the source's reference corner: for VGI_POSE and VGI_BLEND the target's
 *                 vector divided by the length of the source's; for VGI_OFFSET b
 *   shortest2     squared length below which a vector is degenerate
 *   skip          1 per face: do nothing
 *   w             workspace of 2 (max corners + 1) points of eight poses
 *   out           per lane: vectors of the target
 *   bad           called for each face with a degenerate corner in one of the first `lanes` poses, after its vectors
 *                 have been written */
typedef struct vgi_transfer {
    const uint32_t *start, *vert;
    const double *const *poses;
    bool vertices;
    vgi_method method;
    const double *coordinates;
    const vgi_gradient *gradient;
    const vgi_gradient_face *gradient_face;
    double shortest2;
    const unsigned char *skip;
    double *const *out;
    size_t lanes;
    void (*bad)(void *context, size_t face, unsigned lanes);
    void *context;
} vgi_transfer;

typedef vgi_lanes vgi_lane_point[3];

typedef struct vgi_deform_kernel {
    void (*transfer)(const vgi_transfer *t, size_t first, size_t last, vgi_lane_point *w, size_t max_corners);
} vgi_deform_kernel;
VGI_KERNEL(vgi_deform_kernel)

static inline void vgi_transfer_faces(const vgi_transfer *t, size_t first, size_t last, vgi_lane_point *w,
                                      size_t max_corners)
{
    vgi_deform_kernel_now()->transfer(t, first, last, w, max_corners);
}

#endif
