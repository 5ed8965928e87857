/* sparse.h: symmetric positive definite systems with a fixed pattern and changing values: analysed once, factorised
 * for each set of values. Internal. Solves for many poses are in solve_kernel.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SPARSE_H
#define VG_SPARSE_H

#include "numeric/solve_kernel.h"

/* The lower triangle, by columns: the rows of column j are row[start[j]] .. row[start[j + 1] - 1], ascending,
 * beginning with j itself. */
typedef struct vgi_sparse {
    size_t n;
    int *start; /* n + 1 */
    int *row;
    double *value;
} vgi_sparse;

void vgi_sparse_clear(vgi_sparse *a);

/* Entries of such a matrix one by one, in any order; entries at one position add up. Each may be in either
 * triangle. */
typedef struct vgi_triplets {
    size_t n, most; /* number of entries so far, and the capacity */
    uint32_t *row, *column;
    double *value;
} vgi_triplets;

int vgi_triplets_make(vgi_triplets *t, size_t most, vg_err *e) VG_MUST_CHECK;
void vgi_triplets_clear(vgi_triplets *t);
static inline void vgi_triplets_put(vgi_triplets *t, size_t i, size_t j, double x)
{
    t->row[t->n] = (uint32_t)(i > j ? i : j), t->column[t->n] = (uint32_t)(i > j ? j : i), t->value[t->n] = x;
    t->n++;
}
/* vgi_triplets_sum: the matrix with `rows` rows; every diagonal entry must be present. VG_EINPUT if it is too
 * large. */
int vgi_triplets_sum(const vgi_triplets *t, size_t rows, vgi_sparse *a, vg_err *e) VG_MUST_CHECK;

typedef struct vgi_cholesky vgi_cholesky;
/* vgi_cholesky_new: analyse the pattern of a; its values are not read, and a is not kept. order (n): eliminate the
 * rows in about this order, which saves most of the analysis; NULL: find one. VG_ENOMEM. */
int vgi_cholesky_new(vgi_cholesky **c, const vgi_sparse *a, int *order, vg_err *e) VG_MUST_CHECK;
void vgi_cholesky_free(vgi_cholesky **c);
/* vgi_cholesky_factorize: with the values of a, whose pattern must be the analysed one. VG_EINPUT if it is not
 * positive definite. */
int vgi_cholesky_factorize(vgi_cholesky *c, const vgi_sparse *a, vg_err *e) VG_MUST_CHECK;
/* vgi_cholesky_solve: x := A^-1 x for three right-hand sides side by side: x is n x 3. VG_ENOMEM. */
int vgi_cholesky_solve(vgi_cholesky *c, double *x, vg_err *e) VG_MUST_CHECK;
size_t vgi_cholesky_entries(const vgi_cholesky *c); /* of the factor */
/* vgi_cholesky_factor: the factor itself, borrowed; its blocks are NULL until it is factorised. Row i of the factor
 * is row vgi_cholesky_order()[i] of the matrix. */
vgi_factor vgi_cholesky_factor(const vgi_cholesky *c);
const int *vgi_cholesky_order(const vgi_cholesky *c);

#endif
