/* sparse.h: symmetric positive definite systems whose pattern stays while their numbers change: analysed once,
 * factorized for each set of numbers. Internal. Leaves out the many-pose solves of the main job (reconstruct.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SPARSE_H
#define VG_SPARSE_H

#include "core/core.h"

/* The lower triangle, by columns: the rows of column j are row[start[j]] .. row[start[j + 1] - 1], ascending, the
 * first of which is j itself. */
typedef struct vgi_sparse {
    size_t n;
    int *start; /* n + 1 */
    int *row;
    double *value;
} vgi_sparse;

void vgi_sparse_clear(vgi_sparse *a);

typedef struct vgi_cholesky vgi_cholesky;
/* vgi_cholesky_new: analyse the pattern of a, whose numbers are not looked at; a is not kept. VG_ENOMEM. */
int vgi_cholesky_new(vgi_cholesky **c, const vgi_sparse *a, vg_err *e) VG_MUST_CHECK;
void vgi_cholesky_free(vgi_cholesky **c);
/* vgi_cholesky_factorize: the numbers of a, whose pattern is the one that was analysed. VG_EINPUT when it is not
 * positive definite. */
int vgi_cholesky_factorize(vgi_cholesky *c, const vgi_sparse *a, vg_err *e) VG_MUST_CHECK;
/* vgi_cholesky_solve: x := A^-1 x for three right-hand sides side by side: x is n x 3. VG_ENOMEM. */
int vgi_cholesky_solve(vgi_cholesky *c, double *x, vg_err *e) VG_MUST_CHECK;
size_t vgi_cholesky_entries(const vgi_cholesky *c); /* of the factor */

#endif
