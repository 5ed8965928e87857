/* lapack.h: dense linear algebra: factorisation and solution of systems, QR, singular values, eigenvalues.
 * Internal. Matrices are contiguous row-major arrays. Products are in blas.h, sparse systems in sparse.h, 3 x 3
 * matrices in vec3.h and polar.h.
 *
 * Functions may run on several threads at once, each on its own arrays. Code that calls them often from its own
 * threads encloses the calls in vgi_blas_alone and vgi_blas_shared (blas.h), so that BLAS starts no threads.
 *
 * Errors: VG_ENOMEM; VG_EINPUT if an argument contains numbers that are not finite, or as stated.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_LAPACK_H
#define VG_LAPACK_H

#include "core/core.h"

/* ---- symmetric positive definite systems ---- */

/* vgi_spd_factor: a (n x n; only the lower triangle is read) becomes L of a = L L' in its lower triangle; false if it
 * is not positive definite. O(n^3 / 3). */
bool vgi_spd_factor(size_t n, double *a) VG_MUST_CHECK;
/* vgi_spd_solve: x (n x m) := (L L')^-1 x */
void vgi_spd_solve(size_t n, const double *l, size_t m, double *x);

/* ---- general systems ---- */

/* vgi_lu_factor: a (n x n) becomes its triangular factors, `pivot` (n elements) the row exchanges. VG_EINPUT if it is
 * singular. O(2 n^3 / 3). */
int vgi_lu_factor(size_t n, double *a, int *pivot, vg_err *e) VG_MUST_CHECK;
/* vgi_lu_solve: x (n x m) := a^-1 x, with the result of vgi_lu_factor */
int vgi_lu_solve(size_t n, const double *lu, const int *pivot, size_t m, double *x, vg_err *e) VG_MUST_CHECK;

/* ---- orthogonal factors ---- */

/* vgi_qr: a (m x n, m >= n) = Q R. a becomes Q (m x n, orthonormal columns); r (n x n) the upper triangle, 0 below. The
 * diagonal of R may have either sign. */
int vgi_qr(size_t m, size_t n, double *a, double *r, vg_err *e) VG_MUST_CHECK;
/* vgi_svd: a (m x n, destroyed) = U S V'. With k = min(m, n): u (m x k), s (k, descending), vt (k x n). VG_EINPUT if
 * the iteration does not converge. */
int vgi_svd(size_t m, size_t n, double *a, double *u, double *s, double *vt, vg_err *e) VG_MUST_CHECK;

/* ---- the symmetric eigenproblem ---- */

typedef enum vgi_end { VGI_LARGEST, VGI_SMALLEST } vgi_end;

/* vgi_eigen: `count` eigenpairs of the symmetric matrix a (n x n, destroyed; only the lower triangle is read), from
 * the given end of the spectrum: VGI_LARGEST in descending order, VGI_SMALLEST in ascending order.
 *
 *   count    at most n
 *   values   out, count elements
 *   vectors  out, count x n: unit eigenvectors, one per row; in each the element of largest magnitude (the first of several)
 *            is positive, so that the sign does not depend on the machine. NULL: values only
 *
 * VG_EINPUT if the iteration does not converge. O(n^3) time; n x n more memory for the vectors. */
int vgi_eigen(size_t n, double *a, vgi_end end, size_t count, double *values, double *vectors, vg_err *e) VG_MUST_CHECK;

#endif
