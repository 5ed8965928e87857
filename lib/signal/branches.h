/* branches.h: logarithms of the turns of many pieces that vary smoothly over the surface and from frame to frame (MATH 11).
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_BRANCHES_H
#define VG_SIGNAL_BRANCHES_H

#include "core/core.h"

/* A spanning forest of pieces in the order in which it is walked. */
typedef struct vgi_branches {
    size_t n;
    uint32_t *order, *parent; /* n: parents come before their children; a root is its own parent */
    const double *share;      /* n: borrowed */
} vgi_branches;

/* vgi_branches_make: the minimum spanning forest over npairs pairs (two pieces each) of these costs. Roots are the pieces
 * of the largest share. */
int vgi_branches_make(vgi_branches *b, size_t n, const double *share, size_t npairs, const uint32_t *pair,
                      const double *cost, vg_err *e) VG_MUST_CHECK;
void vgi_branches_clear(vgi_branches *b);
/* vgi_branches_walk: for unit quaternions q a vector (axis times half angle) for each piece, which follows its parent's.
 * before: those of the previous frame, which decide how often the whole has turned; NULL: there is none. The vectors are
 * logarithms, but near whole turns, where the axis of a turn says nothing: there they only lie between those around, and
 * the logarithm is vgi_branch_near of them. */
void vgi_branches_walk(const vgi_branches *b, const double *q, const double *before, double *l);

#endif
