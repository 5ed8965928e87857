/* branch.h: rotation vectors that agree with those of their neighbours and of the previous pose, beyond half a turn
 * (MATH 12).
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_BRANCH_H
#define VG_BRANCH_H

#include "net/rings.h"

/* vgi_branch_first: make the w of the first pose of a sequence consistent (`stride` numbers apart, each within half a
 * turn), along a minimum spanning tree of the angles between neighbours, from the centre of each component. */
int vgi_branch_first(const vgi_rings *r, double *w, size_t stride, vg_err *e) VG_MUST_CHECK;
/* vgi_branch_next: the same for a later pose: first the branch nearest to `before`, then whole turns where the
 * neighbours require them. Returns the number of edges across which w still jumps by more than half a turn. */
size_t vgi_branch_next(const vgi_rings *r, double *w, size_t stride, const double *before, size_t before_stride);
/* vgi_branch_settle: the second half of both; before may be NULL. */
size_t vgi_branch_settle(const vgi_rings *r, double *w, size_t stride, const double *before, size_t before_stride);

#endif
