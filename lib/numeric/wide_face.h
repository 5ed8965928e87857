/* wide_face.h: one face per lane: sums over its corners. Included by *_kernel.c alone.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_WIDE_FACE_H
#define VG_WIDE_FACE_H

#include "core/wide.h"

/* vgi_wide_face: sums over the corners, with vertices x relative to that of the first corner: m (row-major) += x r';
 * the normal, with length twice the area; spread, the sum of squares. The n corners have the vertices vert[0 ..]; r:
 * three numbers each. If the r sum to 0, m does not depend on the centre. */
VGI_INLINE void vgi_wide_face(const double *const *poses, const uint32_t *vert, size_t n, const double *r, vgi_wide m[9],
                              vgi_wide normal[3], vgi_wide *spread)
{
    vgi_wide first[3], before[3] = {{0}};
    vgi_gather_point(poses, 3 * (size_t)vert[0], first);
    for (size_t c = 1; c < n; c++) {
        vgi_wide x[3];
        vgi_gather_point(poses, 3 * (size_t)vert[c], x);
#pragma GCC unroll 3
        for (size_t i = 0; i < 3; i++) {
            x[i] -= first[i];
            *spread += x[i] * x[i];
#pragma GCC unroll 3
            for (size_t k = 0; k < 3; k++) m[3 * i + k] += x[i] * vgi_same(r[3 * c + k]);
        }
        normal[0] += before[1] * x[2] - before[2] * x[1];
        normal[1] += before[2] * x[0] - before[0] * x[2];
        normal[2] += before[0] * x[1] - before[1] * x[0];
#pragma GCC unroll 3
        for (int i = 0; i < 3; i++) before[i] = x[i];
    }
}

#endif
