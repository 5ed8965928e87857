/* root.h: the rigid motion of a whole body, taken out of its poses.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_ROOT_H
#define VG_SIGNAL_ROOT_H

#include "core/core.h"

/* vgi_root_remove: poses (n x 3 nv) become what turn (n quaternions) and shift (n vectors) take back to where they were:
 * pose = turn of (what is left) + shift. Least squares against the reference; quaternions are continuous in sign. */
void vgi_root_remove(size_t n, size_t nv, const double *reference, double *poses, double *turn, double *shift);
/* vgi_root_centre: move what is left so that the mean of the graph's vertices is at `centre` in every pose; the shifts
 * follow. */
void vgi_root_centre(size_t n, const vg_graph *g, const double centre[3], double *poses, const double *turn, double *shift);
/* vgi_root_apply: in place */
void vgi_root_apply(const double turn[4], const double shift[3], size_t nv, double *vertices);

#endif
