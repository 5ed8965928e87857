/* gltf_basis.h: few morph targets for many frames; used by gltf_morph.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_BASIS_H
#define VG_GLTF_BASIS_H

#include "core/core.h"

/* Frame i is approximately the sum over k of weights[i * n + k] times target k. */
typedef struct vgi_gltf_basis {
    size_t n;
    float *targets; /* n x 3 nv */
    float *weights; /* frames x n; the largest of each target is 1 or -1 */
    double error;   /* largest distance of a vertex from its position, over all frames */
} vgi_gltf_basis;

/* Source of the frames: displacements, 3 nv numbers each. */
typedef struct vgi_gltf_frames_in {
    size_t frames, nv;
    int (*load)(void *context, size_t frame, float *to, vg_err *e);
    void *context;
} vgi_gltf_frames_in;

/* vgi_gltf_basis_make: the leading left and right singular vectors of the matrix of all frames: as many as reduce the
 * error to `tolerance` (mesh units), but at most `most`. The targets are found from at most 2048 evenly spread
 * frames; all frames are fitted to them by least squares. Memory: n and a few more targets, and 2048 x 2048 numbers.
 * VG_EINPUT if the frames are too large for sums in binary32. */
int vgi_gltf_basis_make(vgi_gltf_basis *b, const vgi_gltf_frames_in *in, size_t most, double tolerance,
                        vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_basis_solve: n x frames numbers, to be freed: by how much frame f of anything that is mixed by these weights counts
 * in its target t, by least squares. */
int vgi_gltf_basis_solve(const vgi_gltf_basis *b, size_t frames, double **solved, vg_err *e) VG_MUST_CHECK;
void vgi_gltf_basis_clear(vgi_gltf_basis *b);

#endif
