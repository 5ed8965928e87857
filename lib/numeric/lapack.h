/* lapack.h: dense linear algebra: symmetric positive definite systems, eigenpairs of symmetric matrices.
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

/* ---- the symmetric eigenproblem ---- */

/* vgi_eigen: the `count` largest eigenvalues of the symmetric matrix a (n x n, destroyed; only the lower triangle is read), in
 * descending order, and their eigenvectors.
 *
 *   count    at most n
 *   values   out, count elements
 *   vectors  out, count x n: unit eigenvectors, one per row; in each the element of largest magnitude (the first of several)
 *            is positive, so that the sign does not depend on the machine. NULL: values only
 *
 * VG_EINPUT if the iteration does not converge. O(n^3) time; n x n more memory for the vectors. */
int vgi_eigen(size_t n, double *a, size_t count, double *values, double *vectors, vg_err *e) VG_MUST_CHECK;

#endif
