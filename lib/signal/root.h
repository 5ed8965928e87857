/* root.h: the rigid motion of a body, removed from its poses.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_ROOT_H
#define VG_SIGNAL_ROOT_H

#include "core/core.h"

/* vgi_root_remove: remove from poses (n x 3 nv) the rotation turn (n quaternions) and shift (n vectors) that are
 * closest to the reference by least squares: original pose = turn of (result) + shift. Quaternions are continuous in
 * sign. */
void vgi_root_remove(size_t n, size_t nv, const double *reference, double *poses, double *turn, double *shift);
/* vgi_root_centre: move the results so that the mean of the graph's vertices is at `centre` in every pose; the shifts
 * are adapted. */
void vgi_root_centre(size_t n, const vg_graph *g, const double centre[3], double *poses, const double *turn, double *shift);
/* vgi_root_apply: in place */
void vgi_root_apply(const double turn[4], const double shift[3], size_t nv, double *vertices);

#endif
