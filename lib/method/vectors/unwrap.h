/* unwrap.h: unwrapping of face rotations: rotation vectors that agree with their neighbours' beyond half a turn
 * and beyond a whole one. Internal; used by interpolate.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_UNWRAP_H
#define VG_UNWRAP_H

#include "core/core.h"

/* vgi_shorter: of q and -q, the one that turns by at most half a turn. */
void vgi_shorter(double q[4]);

/* vgi_branch_near: of all vectors l (axis times half angle) with exp(l) = q or -q, the one nearest to `near`. q:
 * unit. False if it is much farther from `near` than the rotations are from one another, as happens near whole
 * turns, where the axis is undetermined. */
bool vgi_branch_near(const double q[4], const double near[3], double l[3]);

/* vgi_branch_follow: the vector of a face that turns by q, next to a neighbour (or neighbours' mean) at `near`: the nearest
 * branch, or, where that cannot be trusted, the neighbour's axis with the angle by which q turns about it (false). */
bool vgi_branch_follow(const double q[4], const double near[3], double l[3]);

/* vgi_choose_turns: for each face of a graph, links included, one vector (axis times half angle). q: a quaternion
 * per corner, none 0. *beyond: whether some face or corner turns by more than half a turn. If none does, vectors
 * are logarithms of the faces' mean turns. If some does, the vectors vary smoothly over the mesh, and exp(turn) is
 * near the face's turn (mostly within 1 radian) but need not be it. */
int vgi_choose_turns(const vg_graph *g, const double *q, double *turn, bool *beyond, vg_err *e) VG_MUST_CHECK;

#endif
