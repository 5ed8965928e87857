/* feature_kernel.h: features of eight poses side by side, and their inverse (MATH 12). Internal. Rotation vectors are
 * within half a turn here; branch.h chooses other branches.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FEATURE_KERNEL_H
#define VG_FEATURE_KERNEL_H

#include "core/isa.h"
#include "net/rings.h"

/* Numbers per vertex: rotation vector w and symmetric stretch S (xx xy xz yy yz zz); with 12 also the residual of the
 * reconstruction at the vertex, in the frame of its ring. */
enum { VGI_NINE = 9, VGI_TWELVE = 12 };

/* Workspace of eight poses. */
typedef struct vgi_feature_block {
    vgi_row *point, *normal; /* nv; normal also holds reconstructed points */
    vgi_lanes *gradient, *turn; /* 9 per vertex, row-major: D, and R with D = R S */
    vgi_row *x;              /* nv: right-hand sides in the order of the factor */
    vgi_row *sum;            /* per part */
    double root[VGI_LANES][9]; /* rotation of the root */
} vgi_feature_block;

typedef struct vgi_feature_kernel {
    void (*measure)(const vgi_rings *r, vgi_feature_block *b, const double *const *poses);
    void (*put)(const vgi_rings *r, vgi_feature_block *b, size_t width, const double *const *poses,
                double *const *values, double *const *centroids);
    void (*back)(const vgi_rings *r, vgi_feature_block *b, size_t width, const double *const *values,
                 const double *const *centroids, double *const *vertices, size_t lanes);
} vgi_feature_kernel;
VGI_KERNEL(vgi_feature_kernel)

/* vgi_feature_measure: D and R of eight poses (nv points each). */
static inline void vgi_feature_measure(const vgi_rings *r, vgi_feature_block *b, const double *const *poses)
{
    vgi_feature_kernel_now()->measure(r, b, poses);
}

/* vgi_feature_put: after measure, with b->root set: write width numbers per vertex and pose, w of root' R within half
 * a turn, and centroids (3 per part). Vertices without faces move with the root. poses: as measured. */
static inline void vgi_feature_put(const vgi_rings *r, vgi_feature_block *b, size_t width, const double *const *poses,
                                   double *const *values, double *const *centroids)
{
    vgi_feature_kernel_now()->put(r, b, width, poses, values, centroids);
}

/* vgi_feature_back: the inverse, with b->root set: write the vertices of `lanes` poses (arrays of the others are
 * NULL). */
static inline void vgi_feature_back(const vgi_rings *r, vgi_feature_block *b, size_t width,
                                    const double *const *values, const double *const *centroids,
                                    double *const *vertices, size_t lanes)
{
    vgi_feature_kernel_now()->back(r, b, width, values, centroids, vertices, lanes);
}

#endif
