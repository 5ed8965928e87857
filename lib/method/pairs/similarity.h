/* similarity.h: the similarity that lays points on those that they correspond to.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIMILARITY_H
#define VG_SIMILARITY_H

#include "core/core.h"

typedef struct vgi_similarity {
    double scale, rotation[9], shift[3]; /* x -> scale R x + shift */
} vgi_similarity;

/* vgi_similarity_fit: least squares (Horn 1987) for n weighted pairs of points, all alike if weight is NULL. The scale
 * is symmetric in both sides. Returns what is left: the distance of the points, both sets at unit size, in the root of
 * the mean square; negative if the points of a side coincide, and *s is then not set. */
double vgi_similarity_fit(vgi_similarity *s, const double *from, const double *to, const double *weight, size_t n);
void vgi_similarity_apply(const vgi_similarity *s, const double x[3], double y[3]);

/* vgi_motion_size: how much larger motions of expressions are on n points `to` than on the points `from` that they
 * correspond to, with these weights; 1 if there are none. The ratio of the sizes, but of two people a power of ten. */
double vgi_motion_size(const double *from, const double *to, const double *weight, size_t n);

#endif
