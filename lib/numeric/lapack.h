/* lapack.h: dense linear algebra: factors and solutions of systems, QR, singular values, eigenvalues.
 * Internal. Matrices are plain row-major arrays without gaps between rows. Leaves out products (blas.h), sparse systems
 * (sparse.h) and 3 x 3 matrices (vec3.h, polar.h).
 *
 * Functions may run on several threads at once, each on its own arrays. What calls them many times from its own threads
 * does so between vgi_blas_alone and vgi_blas_shared (blas.h), so that BLAS starts no threads of its own.
 *
 * Errors: VG_ENOMEM; VG_EINPUT where an argument has numbers that are not finite, or where it says so.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_LAPACK_H
#define VG_LAPACK_H

#include "core/core.h"

/* ---- symmetric positive definite systems ---- */

/* vgi_spd_factor: a (n x n; only the lower triangle is read) becomes L of a = L L' in its lower triangle; false when it
 * is not positive definite. O(n^3 / 3). */
bool vgi_spd_factor(size_t n, double *a) VG_MUST_CHECK;
/* vgi_spd_solve: x (n x m) := (L L')^-1 x */
void vgi_spd_solve(size_t n, const double *l, size_t m, double *x);

/* ---- general systems ---- */

/* vgi_lu_factor: a (n x n) becomes its triangular factors, `pivot` (n elements) the exchanges of rows. VG_EINPUT when it
 * is singular. O(2 n^3 / 3). */
int vgi_lu_factor(size_t n, double *a, int *pivot, vg_err *e) VG_MUST_CHECK;
/* vgi_lu_solve: x (n x m) := a^-1 x, from what vgi_lu_factor left */
int vgi_lu_solve(size_t n, const double *lu, const int *pivot, size_t m, double *x, vg_err *e) VG_MUST_CHECK;

/* ---- orthogonal factors ---- */

/* vgi_qr: a (m x n, m >= n) = Q R. a becomes Q (m x n, orthonormal columns); r (n x n) the upper triangle, 0 below. The
 * diagonal of R may have either sign. */
int vgi_qr(size_t m, size_t n, double *a, double *r, vg_err *e) VG_MUST_CHECK;
/* vgi_svd: a (m x n, destroyed) = U S V'. With k = min(m, n): u (m x k), s (k, descending), vt (k x n). VG_EINPUT when
 * the iteration does not converge. */
int vgi_svd(size_t m, size_t n, double *a, double *u, double *s, double *vt, vg_err *e) VG_MUST_CHECK;

/* ---- the symmetric eigenproblem ---- */

typedef enum vgi_end { VGI_LARGEST, VGI_SMALLEST } vgi_end;

/* vgi_eigen: `count` eigenpairs of the symmetric matrix a (n x n, destroyed; only the lower triangle is read), from the
 * end of the spectrum that is asked for: VGI_LARGEST in descending order, VGI_SMALLEST in ascending order.
 *
 *   count    at most n
 *   values   out, count elements
 *   vectors  out, count x n: unit eigenvectors, one a row; in each the element of largest magnitude (the first of several)
 *            is positive, so that the sign does not depend on the machine. NULL: values only
 *
 * VG_EINPUT when the iteration does not converge. O(n^3); memory n x n more for the vectors. */
int vgi_eigen(size_t n, double *a, vgi_end end, size_t count, double *values, double *vectors, vg_err *e) VG_MUST_CHECK;

#endif
