/* springs.h: smoothness of a polygon surface during the fit: its graph Laplacian L, and the two terms |(L x)_v|^2 /
 * L_vv and sum over edges of |x_u - x_v|^2 as sparse matrices with one pattern (fit.c).
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SPRINGS_H
#define VG_SPRINGS_H

#include "method/pairs/register.h"
#include "model/laplacian.h"
#include "numeric/sparse.h"

/* In faces with up to this many corners all corners are joined; larger faces have fewer springs. */
enum { VGI_SMALL_FACE = 8 };

/* vgi_springs_make: from the source's faces and links. Vertices joined by a tie have springs of weight 0. On failure
 * *L is 0. */
int vgi_springs_make(vgi_laplacian *L, const vgi_fitting *in, vg_err *e) VG_MUST_CHECK;
/* vgi_is_hub: whether v has so many neighbours that its bending term is left out, because it would couple all of
 * them. */
bool vgi_is_hub(const vgi_laplacian *L, size_t v);

typedef struct vgi_smoothness {
    vgi_sparse matrix;            /* the pattern; the caller sets the values */
    double *bending, *stretching; /* per entry */
} vgi_smoothness;

/* vgi_smoothness_make: on failure *s is 0. */
int vgi_smoothness_make(vgi_smoothness *s, const vgi_laplacian *L, vg_err *e) VG_MUST_CHECK;
void vgi_smoothness_clear(vgi_smoothness *s);

#endif
