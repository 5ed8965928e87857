/* unwrap.h: unwrapping of face rotations: rotation vectors that agree with those of neighbouring faces, also beyond
 * half a turn and a whole turn. Internal; used by interpolate.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_UNWRAP_H
#define VG_UNWRAP_H

#include "core/core.h"

/* vgi_shorter: choose between q and -q the one that rotates by at most half a turn. */
void vgi_shorter(double q[4]);

/* vgi_branch_near: among all vectors l (axis times half angle) with exp(l) = q or -q, the one nearest to `near`. q:
 * unit. Returns false if it is much farther from `near` than the rotations are from each other. This happens near
 * whole turns, where the axis is undetermined. */
bool vgi_branch_near(const double q[4], const double near[3], double l[3]);

/* vgi_branch_follow: the vector of a face that rotates by q, with a neighbour (or neighbours' mean) at `near`: the
 * nearest branch, or, if that is unreliable, the neighbour's axis with the angle by which q rotates about it (returns
 * false). */
bool vgi_branch_follow(const double q[4], const double near[3], double l[3]);

/* vgi_choose_turns: one vector (axis times half angle) for each face of a graph, including links. q: a quaternion per
 * corner, none 0. *beyond: whether some face or corner rotates by more than half a turn. If none does, the vectors
 * are logarithms of the mean rotations of the faces. If some does, the vectors vary smoothly over the mesh, and
 * exp(turn) is near the rotation of the face (mostly within 1 radian) but not always equal to it. */
int vgi_choose_turns(const vg_graph *g, const double *q, double *turn, bool *beyond, vg_err *e) VG_MUST_CHECK;

#endif
