/* measures_kernel.h: the comparison of the faces of two poses, eight faces of one size at a time.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_MEASURES_KERNEL_H
#define VG_MEASURES_KERNEL_H

#include "core/isa.h"
#include "core/lanes.h"
#include "numeric/stats.h"

/* All faces with r corners: `faces` of them. corners: for each group of eight faces r times eight vertices: the first
 * corner of each, the second of each, and so on. The last group is filled up with copies of the last face. */
typedef struct vgi_face_class {
    size_t r, faces;
    uint32_t *corners;
} vgi_face_class;

/* Sums over the faces that have a normal in the truth; planarity: those with a normal in each pose, with four or more
 * corners. */
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
