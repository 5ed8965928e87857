/* blas.h: dense products and triangular solves through BLAS. BLAS runs on one thread here, because the library has
 * its own threads and the last digits must not depend on their number.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_BLAS_H
#define VG_BLAS_H

#include <stdbool.h>
#include <stddef.h>

/* vgi_blas_alone, vgi_blas_shared: enclose calls of BLAS or LAPACK from several threads at once. Between the first
 * _alone and the last _shared BLAS starts no threads. Calls may nest, also across threads. */
void vgi_blas_alone(void);
void vgi_blas_shared(void);

/* c (m x n, row stride ldc) := a (m x k) b (k x n), all row-major */
void vgi_product_single(size_t m, size_t n, size_t k, const float *a, size_t lda, const float *b, size_t ldb,
                        float *c, size_t ldc);
void vgi_product_double(size_t m, size_t n, size_t k, const double *a, size_t lda, const double *b, size_t ldb,
                        double *c, size_t ldc);
/* the same, added to c */
void vgi_product_add(size_t m, size_t n, size_t k, const double *a, size_t lda, const double *b, size_t ldb,
                     double *c, size_t ldc);
/* c (m x n) := a (m x k) b', b n x k */
void vgi_product_single_transposed(size_t m, size_t n, size_t k, const float *a, size_t lda, const float *b,
                                   size_t ldb, float *c, size_t ldc);

void vgi_product_double_transposed(size_t m, size_t n, size_t k, const double *a, size_t lda, const double *b,
                                   size_t ldb, double *c, size_t ldc);
/* c (m x n) := a' b, a k x m, b k x n */
void vgi_product_transposed_double(size_t m, size_t n, size_t k, const double *a, size_t lda, const double *b,
                                   size_t ldb, double *c, size_t ldc);
/* c (n x n, its lower triangle) := a a', a n x k */
void vgi_product_gram(size_t n, size_t k, const double *a, size_t lda, double *c, size_t ldc);

/* c (m x n) := a b + beta c, or with a' or b' in place of a or b */
void vgi_gemm_single(bool turn_a, bool turn_b, size_t m, size_t n, size_t k, const float *a, size_t lda,
                     const float *b, size_t ldb, float beta, float *c, size_t ldc);
void vgi_gemm_double(bool turn_a, bool turn_b, size_t m, size_t n, size_t k, const double *a, size_t lda,
                     const double *b, size_t ldb, double beta, double *c, size_t ldc);

/* x (n x m, row stride ldx) := l^-1 x, l a lower triangle of n x n */
void vgi_solve_lower_stripe(size_t n, const double *l, size_t m, double *x, size_t ldx);
/* x (n x m, row-major) := l^-1 x and l'^-1 x, l a lower triangle of n x n */
void vgi_solve_lower(size_t n, const double *l, size_t m, double *x);
void vgi_solve_lower_transposed(size_t n, const double *l, size_t m, double *x);

#endif
