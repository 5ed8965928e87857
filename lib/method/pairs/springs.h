/* springs.h: what holds a surface of polygons together while it is fitted: its graph Laplacian L, and the two
 * smoothness terms |(L x)_v|^2 / L_vv and sum over edges of |x_u - x_v|^2 as sparse matrices of one pattern (fit.c).
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SPRINGS_H
#define VG_SPRINGS_H

#include "method/pairs/register.h"
#include "model/laplacian.h"
#include "numeric/sparse.h"

/* In faces of up to this many corners all corners are joined with one another; larger faces have fewer springs. */
enum { VGI_SMALL_FACE = 8 };

/* vgi_springs_make: of the source's faces and links; vertices that a tie joins have springs without weight.
 * Failed: *L is 0. */
int vgi_springs_make(vgi_laplacian *L, const vgi_fitting *in, vg_err *e) VG_MUST_CHECK;
/* vgi_is_hub: does v have so many neighbours that its bending term is left out? It would join all of them. */
bool vgi_is_hub(const vgi_laplacian *L, size_t v);

typedef struct vgi_smoothness {
    vgi_sparse matrix;            /* the pattern; its numbers are the caller's to set */
    double *bending, *stretching; /* per entry */
} vgi_smoothness;

/* vgi_smoothness_make: failed: *s is 0. */
int vgi_smoothness_make(vgi_smoothness *s, const vgi_laplacian *L, vg_err *e) VG_MUST_CHECK;
void vgi_smoothness_clear(vgi_smoothness *s);

#endif
