/* gltf_basis.h: few morph targets for many frames: what gltf_morph.c asks of gltf_basis.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_BASIS_H
#define VG_GLTF_BASIS_H

#include "core/core.h"

/* Frame i is, but for an error, the sum over k of weights[i * n + k] times target k. */
typedef struct vgi_gltf_basis {
    size_t n;
    float *targets; /* n x 3 nv */
    float *weights; /* frames x n, the largest of each target 1 or -1 */
    double error;   /* the largest distance of a vertex from its place, over all frames */
} vgi_gltf_basis;

/* Where the frames come from: displacements, 3 nv numbers each. */
typedef struct vgi_gltf_frames_in {
    size_t frames, nv;
    int (*load)(void *context, size_t frame, float *to, vg_err *e);
    void *context;
} vgi_gltf_frames_in;

/* vgi_gltf_basis_make: the leading left and right singular vectors of the matrix of all frames, as many as bring the error
 * to `tolerance` (mesh units), but no more than `most`. At most 2048 frames, evenly spread, say what the targets are; all
 * are met as well as these can. Memory: n and a few more targets, and 2048 x 2048 numbers.
 * VG_EINPUT: the frames are too large for sums in binary32. */
int vgi_gltf_basis_make(vgi_gltf_basis *b, const vgi_gltf_frames_in *in, size_t most, double tolerance,
                        vg_err *e) VG_MUST_CHECK;
void vgi_gltf_basis_clear(vgi_gltf_basis *b);

#endif
