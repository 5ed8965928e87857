/* measures_kernel.h: how far the faces of two poses are apart, eight faces of one size at a time.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_MEASURES_KERNEL_H
#define VG_MEASURES_KERNEL_H

#include "core/isa.h"
#include "core/lanes.h"
#include "numeric/stats.h"

/* All faces of r corners: `faces` of them. corners: for each eight faces r times eight vertices, the first corner of
 * each, the second of each; in the last eight, the last face again in the place of those that are not there. */
typedef struct vgi_face_class {
    size_t r, faces;
    uint32_t *corners;
} vgi_face_class;

/* Over faces that have a normal: in the truth; planarity: each by itself, of four corners and more. */
typedef struct vgi_face_sums {
    vgi_running orientation, area, planarity[2];
    uint64_t planarity_histogram[2][10];
} vgi_face_sums;

typedef struct vgi_measures_kernel {
    /* faces: add all of a class to *s. poses: truth, result. */
    void (*faces)(const vgi_face_class *c, double diagonal, const double *const poses[2], vgi_face_sums *s);
} vgi_measures_kernel;
VGI_KERNEL(vgi_measures_kernel)

#endif
