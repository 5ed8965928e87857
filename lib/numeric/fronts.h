/* fronts.h: Cholesky factors of many principal submatrices of one matrix: those that are left when a set of rows is
 * held. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FRONTS_H
#define VG_FRONTS_H

#include "numeric/sparse.h"

/* What all these factors share. */
typedef struct vgi_fronts vgi_fronts;

/* vgi_fronts_new: a, whose rows are about in the order of elimination; it may be singular as a whole. Not kept.
 * VG_EINPUT when it is not positive semidefinite. */
int vgi_fronts_new(vgi_fronts **f, const vgi_sparse *a, vg_err *e) VG_MUST_CHECK;
void vgi_fronts_free(vgi_fronts **f);

/* The factor of the rows that are not held. Blocks that the held rows do not affect belong to the vgi_fronts. */
typedef struct vgi_held_factor {
    vgi_factor factor;
    uint32_t *row;  /* per row of a: its row in the factor; UINT32_MAX: held */
    size_t entries; /* of the factor, those that are shared included */
    int *super, *pi, *rows;
    const double **block;
    double *values;
} vgi_held_factor;

/* vgi_fronts_hold: held: per row of a. Several threads may call it on one vgi_fronts. VG_EINPUT when what is left is not
 * positive definite. */
int vgi_fronts_hold(const vgi_fronts *f, const bool *held, vgi_held_factor *out, vg_err *e) VG_MUST_CHECK;
void vgi_held_factor_clear(vgi_held_factor *h);

#endif
