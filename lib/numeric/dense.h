/* dense.h: symmetric positive definite systems of a few hundred unknowns, row-major.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_DENSE_H
#define VG_DENSE_H

#include <stdbool.h>
#include <stddef.h>

/* vgi_cholesky_dense: a (n x n, the lower triangle) becomes its factor; false when it is not positive definite. Large
 * ones call BLAS: between vgi_product_begin and _end. */
bool vgi_cholesky_dense(double *a, size_t n);
/* vgi_cholesky_dense_solve: x (n x m) := (L L')^-1 x */
void vgi_cholesky_dense_solve(const double *l, size_t n, double *x, size_t m);

#endif
