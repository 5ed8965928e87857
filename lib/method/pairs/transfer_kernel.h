/* transfer_kernel.h: the two inner loops of transfer by a correspondence, eight poses at once.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TRANSFER_KERNEL_H
#define VG_TRANSFER_KERNEL_H

#include "numeric/lanes.h"

/* A linear map of space in eight poses, row-major. */
typedef struct vgi_map {
    vgi_lanes m[9];
} vgi_map;

/* What a source face needs to tell its map from its vertices: per corner p = P r (deform_kernel.h), per face q = h P
 * n / sqrt|N|, N the sum of cross products, so that the normal stretches by the root of the area's ratio. */
typedef struct vgi_source {
    const uint32_t *start, *vert; /* the source mesh */
    const double *p, *q;
    const unsigned char *slow;    /* per face: not by this kernel */
    const double *const *poses;   /* 8, vertices */
} vgi_source;

/* vgi_measure_maps: D of faces first .. last-1. Where a face has no normal in a pose, bad[face] gets the lanes; else
 * 0. */
void vgi_measure_maps(const vgi_source *s, size_t first, size_t last, vgi_map *maps, unsigned char *bad);

/* How a target face follows: its map D as it is; the rotation R of D with the stretch that D gives each vector; the
 * mean of both; or R alone (rigid). */
typedef enum vgi_follow { VGI_FOLLOW_GRADIENT, VGI_FOLLOW_POSE, VGI_FOLLOW_BLEND, VGI_FOLLOW_RIGID } vgi_follow;

/* vgi_polar: the rotation nearest to a, whatever a is: scaled Newton (Higham 1986), to rounding, or
 * vgi_fit_rotation. */
void vgi_polar(const vgi_map *a, vgi_map *rotation);

/* vgi_follow_face: wanted vectors of `r` reference vectors (xyz each), for the first `lanes` poses,
 * to out[k] + 3 i. */
void vgi_follow_face(const vgi_map *d, vgi_follow how, const double *vectors, size_t r, double *const *out,
                     size_t offset, size_t lanes);

#endif
