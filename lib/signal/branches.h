/* branches.h: logarithms of the rotations of many pieces that vary smoothly over the surface and from frame to frame
 * (MATH 11).
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_BRANCHES_H
#define VG_SIGNAL_BRANCHES_H

#include "core/core.h"

/* A spanning forest of pieces, in traversal order. */
typedef struct vgi_branches {
    size_t n;
    uint32_t *order, *parent; /* n: parents precede their children; a root is its own parent */
    const double *share;      /* n: borrowed */
} vgi_branches;

/* vgi_branches_make: the minimum spanning forest over npairs pairs of pieces with these costs. Roots are the pieces
 * with the largest share. */
int vgi_branches_make(vgi_branches *b, size_t n, const double *share, size_t npairs, const uint32_t *pair,
                      const double *cost, vg_err *e) VG_MUST_CHECK;
void vgi_branches_clear(vgi_branches *b);
/* vgi_branches_walk: for unit quaternions q one vector (axis times half angle) per piece, near that of its parent.
 * before: vectors of the previous frame, which decide the number of whole turns of the body; NULL: none. The vectors
 * are logarithms except near whole turns, where the axis is undetermined: there they are interpolated from their
 * surroundings, and the logarithm is vgi_branch_near of them. */
void vgi_branches_walk(const vgi_branches *b, const double *q, const double *before, double *l);

#endif
