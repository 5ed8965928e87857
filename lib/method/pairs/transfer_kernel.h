/* transfer_kernel.h: the inner loops of transfer by a correspondence, eight poses at once.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TRANSFER_KERNEL_H
#define VG_TRANSFER_KERNEL_H

#include "core/isa.h"
#include "core/lanes.h"

/* A linear map of space in eight poses, row-major. */
typedef struct vgi_map {
    vgi_lanes m[9];
} vgi_map;

/* Precomputed data that gives the map of a source face from its vertices: per corner p = P r (deform_kernel.h); per
 * face q = h P n / sqrt|N|, N the sum of cross products, so that the normal stretches by the square root of the area
 * ratio. */
typedef struct vgi_source {
    const uint32_t *start, *vert; /* the source mesh */
    const double *p, *q;
    const unsigned char *slow;    /* per face: set if this kernel leaves it out */
    const double *const *poses;   /* 8, vertices */
} vgi_source;

/* Source faces that drive something, with their weights. */
typedef struct vgi_drivers {
    const vgi_map *maps;      /* of all source faces */
    const unsigned char *bad; /* lanes in which a face has no map */
    const uint32_t *source;
    const double *weight;
} vgi_drivers;

/* How a target face follows its map D: D itself; the rotation R of D, with the stretch of D for each vector; the mean
 * of both; or R alone (rigid). */
typedef enum vgi_follow { VGI_FOLLOW_GRADIENT, VGI_FOLLOW_POSE, VGI_FOLLOW_BLEND, VGI_FOLLOW_RIGID } vgi_follow;

typedef struct vgi_transfer_kernel {
    /* measure: D of faces first .. last-1. bad[face]: the lanes in which the face has no normal. */
    void (*measure)(const vgi_source *s, size_t first, size_t last, vgi_map *maps, unsigned char *bad);
    /* add: the weighted maps of drivers first .. last-1, and the sums of their weights, over the lanes with a map */
    void (*add)(const vgi_drivers *d, size_t first, size_t last, vgi_map *sum, vgi_lanes weight);
    /* finish: sum /= weight; the identity where the weight is 0 */
    void (*finish)(vgi_map *sum, const vgi_lanes weight);
    /* polar: the rotation nearest to a, for any a, up to rounding */
    void (*polar)(const vgi_map *a, vgi_map *rotation);
    /* follow: for `r` reference vectors (xyz each), write the wanted vectors of the first `lanes` poses to out[k] +
     * offset */
    void (*follow)(const vgi_map *d, vgi_follow how, const double *vectors, size_t r, double *const *out,
                   size_t offset, size_t lanes);
} vgi_transfer_kernel;
VGI_KERNEL(vgi_transfer_kernel)

#endif
