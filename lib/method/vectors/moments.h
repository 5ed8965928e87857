/* moments.h: the second moments of a face's vectors, as deformation gradients need them. Small symmetric matrices are
 * xx xy xz yy yz zz.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_MOMENTS_H
#define VG_MOMENTS_H

#include "core/core.h"

/* vgi_unit_normal: Newell's normal from the r vectors of a face; false if the face has none. */
bool vgi_unit_normal(const double *w, size_t r, double n[3]);

/* vgi_gradient_moments: P = (sum r r' + h n n')^-1 and q = h P n (MATH 5), with h half the trace of the sum and n the
 * unit normal. *size: |N|, twice the area. False if the face has no normal or is nearly a line. */
bool vgi_gradient_moments(const double *w, size_t r, double P[6], double q[3], double *size);

void vgi_symmetric_times(const double a[6], const double x[3], double y[3]);

/* vgi_mesh_moments: of all faces: per corner p = P r, per face q = h P n / sqrt|N| (vgi_source). slow[face]: 0; 1: a line
 * segment; 2: no gradient, or a line segment without a length. p, q and slow must be 0. */
int vgi_mesh_moments(const vg_mesh *m, const double *reference, double *p, double *q, unsigned char *slow,
                     vg_err *e) VG_MUST_CHECK;

#endif
