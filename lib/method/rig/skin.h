/* skin.h: weights of linear blend skinning from sums over the poses.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SKIN_H
#define VG_SKIN_H

#include "method/rig/rig_sums.h"

/* vgi_skin_near: weights without poses: each vertex follows the nearest bone in the reference pose. */
int vgi_skin_near(vg_rig *r, size_t nv, const double *reference, vg_err *e) VG_MUST_CHECK;
/* vgi_skin_fit: for each vertex at most VG_SKIN weights >= 0 that sum to 1, by least squares over the poses of s
 * (MATH 6). Among bones that move alike, near ones are preferred. miss (nv, may be NULL): root mean square of the
 * remaining distance. */
int vgi_skin_fit(vg_rig *r, const vgi_rig_sums *s, const double *reference, int threads, double *miss,
                 vg_err *e) VG_MUST_CHECK;

#endif
