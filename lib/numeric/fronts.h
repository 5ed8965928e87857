/* fronts.h: Cholesky factors of many principal submatrices of one matrix: those that are left when a set of rows is
 * held. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FRONTS_H
#define VG_FRONTS_H

#include "numeric/sparse.h"

/* What all these factors share. */
typedef struct vgi_fronts vgi_fronts;

/* One row more than a matrix has: its diagonal entry, and those in the n other rows that it has any in. */
typedef struct vgi_border {
    size_t n;
    uint32_t *row;
    double *value, diagonal;
} vgi_border;

/* vgi_fronts_new: a and c, its Cholesky factor; with a border, that row is behind all others. What is in the factor is
 * borrowed, a and the border are not kept. Bordered, the matrix may be singular. */
int vgi_fronts_new(vgi_fronts **f, const vgi_sparse *a, const vgi_cholesky *c, const vgi_border *border,
                   vg_err *e) VG_MUST_CHECK;
void vgi_fronts_free(vgi_fronts **f);

/* The factor of the rows that are not held. Blocks that the held rows do not affect belong to the vgi_fronts. Rows are those
 * of c, in the order of its factor, then the border. */
typedef struct vgi_held_factor {
    vgi_factor factor;
    uint32_t *row;  /* per row: its row in this factor; UINT32_MAX: held */
    size_t entries; /* of the factor, those that are shared included */
    int *super, *pi, *rows;
    const double **block;
    double *values;
} vgi_held_factor;

/* vgi_fronts_hold: held: per row. Several threads may call it on one vgi_fronts. VG_EINPUT when what is left is not
 * positive definite. */
int vgi_fronts_hold(const vgi_fronts *f, const bool *held, vgi_held_factor *out, vg_err *e) VG_MUST_CHECK;
void vgi_held_factor_clear(vgi_held_factor *h);

#endif
