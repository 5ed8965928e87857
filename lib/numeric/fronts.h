/* fronts.h: Cholesky factors of many principal submatrices of one matrix: those that remain when a set of rows is
 * held. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FRONTS_H
#define VG_FRONTS_H

#include "numeric/sparse.h"

/* Data shared by all these factors. */
typedef struct vgi_fronts vgi_fronts;

/* One row in addition to those of a matrix: its diagonal entry, and its entries in n other rows. */
typedef struct vgi_border {
    size_t n;
    uint32_t *row;
    double *value, diagonal;
} vgi_border;

/* vgi_fronts_new: c is the Cholesky factor of a. With a border, its row comes after all others. The factor is
 * borrowed; a and the border are not kept. With its border the matrix may be singular. */
int vgi_fronts_new(vgi_fronts **f, const vgi_sparse *a, const vgi_cholesky *c, const vgi_border *border,
                   vg_err *e) VG_MUST_CHECK;
void vgi_fronts_free(vgi_fronts **f);

/* The factor of the rows that are not held. Blocks unaffected by the held rows belong to the vgi_fronts. Rows are
 * those of c, in the order of its factor, then the border. */
typedef struct vgi_held_factor {
    vgi_factor factor;
    uint32_t *row;  /* per row: its row in this factor, or UINT32_MAX if held */
    size_t entries; /* of the factor, including shared ones */
    int *super, *pi, *rows;
    const double **block;
    double *values;
} vgi_held_factor;

/* vgi_fronts_hold: held: per row. Several threads may call it on one vgi_fronts. VG_EINPUT if the remaining matrix is
 * not positive definite. */
int vgi_fronts_hold(const vgi_fronts *f, const bool *held, vgi_held_factor *out, vg_err *e) VG_MUST_CHECK;
void vgi_held_factor_clear(vgi_held_factor *h);

#endif
