/* polar_kernel.c: rotations of faces in eight poses at once.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/wide_face.h"
#include "numeric/wide_polar.h"

static const vgi_polar_stop stop = {.scaled = 4, .enough = 1e-12};

/* sum of d r' over the corners, plus the outer product of the unit normals (with the weight contained in the
 * reference's) */
VGI_INLINE void face_matrix(const vgi_turns *t, size_t f, const double *const *poses, vgi_wide *m)
{
    size_t begin = t->start[f];
    vgi_wide n[3] = {{0}}, spread = {0};
#pragma GCC unroll 9
    for (int i = 0; i < 9; i++) m[i] = vgi_same(0);
    vgi_wide_face(poses, t->vert + begin, t->start[f + 1] - begin, t->vector + 3 * begin, m, n, &spread);
    vgi_wide n2 = vgi_wide_dot(n, n), weight = vgi_only(n2 > 1e-24 * spread * spread, 1.0 / vgi_roots(n2));
#pragma GCC unroll 3
    for (size_t i = 0; i < 3; i++)
#pragma GCC unroll 3
        for (size_t k = 0; k < 3; k++) m[3 * i + k] += n[i] * weight * vgi_same(t->normal[3 * f + k]);
}

static void measure_face(const vgi_turns *t, size_t f, const double *const *poses, vgi_lanes *rotation)
{
    for (size_t part = 0; part < VGI_PARTS; part++) {
        vgi_wide m[9], x[9];
        face_matrix(t, f, poses + part * VGI_WIDTH, m);
        vgi_wide_polar(m, x, stop);
        for (int i = 0; i < 9; i++) vgi_store(rotation[i] + part * VGI_WIDTH, x[i]);
    }
}

const vgi_polar_kernel VGI_OF_SET(vgi_polar_kernel) = {measure_face};
