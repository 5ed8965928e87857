/* polar_kernel.c: rotations of faces in eight poses at once.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/wide_polar.h"

static const double enough = 1e-12; /* squared change: what is left is below 1e-12 */

/* sum of d r' over the corners, and of the unit normals (times the weight that the reference's carries) */
VGI_INLINE void face_matrix(const vgi_turns *t, size_t f, const double *const *poses, vgi_wide *m)
{
    uint32_t begin = t->start[f], end = t->start[f + 1];
    vgi_wide first[3], before[3] = {{0}}, n[3] = {{0}}, spread = {0};
    vgi_gather_point(poses, 3 * (size_t)t->vert[begin], first);
#pragma GCC unroll 9
    for (int i = 0; i < 9; i++) m[i] = vgi_same(0);
    for (uint32_t c = begin + 1; c < end; c++) {
        vgi_wide x[3];
        const double *r = t->vector + 3 * (size_t)c; /* they sum to 0 over the face: any point will do for a centre */
        vgi_gather_point(poses, 3 * (size_t)t->vert[c], x);
#pragma GCC unroll 3
        for (size_t i = 0; i < 3; i++) {
            x[i] -= first[i];
            spread += x[i] * x[i];
#pragma GCC unroll 3
            for (size_t k = 0; k < 3; k++) m[3 * i + k] += x[i] * vgi_same(r[k]);
        }
        n[0] += before[1] * x[2] - before[2] * x[1];
        n[1] += before[2] * x[0] - before[0] * x[2];
        n[2] += before[0] * x[1] - before[1] * x[0];
#pragma GCC unroll 3
        for (int i = 0; i < 3; i++) before[i] = x[i];
    }
    vgi_wide n2 = vgi_dot(n, n), weight = vgi_only(n2 > 1e-24 * spread * spread, 1.0 / vgi_roots(n2));
#pragma GCC unroll 3
    for (size_t i = 0; i < 3; i++)
#pragma GCC unroll 3
        for (size_t k = 0; k < 3; k++) m[3 * i + k] += n[i] * weight * vgi_same(t->normal[3 * f + k]);
}

static void measure(const vgi_turns *t, size_t f, const double *const *poses, vgi_lanes *rotation)
{
    for (size_t part = 0; part < VGI_PARTS; part++) {
        vgi_wide m[9], x[9];
        face_matrix(t, f, poses + part * VGI_WIDTH, m);
        vgi_wide_polar(m, x, enough);
        for (int i = 0; i < 9; i++) vgi_store(rotation[i] + part * VGI_WIDTH, x[i]);
    }
}

const vgi_polar_kernel VGI_OF_SET(vgi_polar_kernel) = {measure};
