/* blas.h: dense products through BLAS, which runs alone here: the threads are ours, and the last digits must not
 * depend on them.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_BLAS_H
#define VG_BLAS_H

#include <stddef.h>

/* vgi_product_begin, _end: around products that are called from several threads at once. */
int vgi_product_begin(void); /* gives what _end takes */
void vgi_product_end(int before);

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

/* a (lower triangle of m x m, row stride lda) -= p p', p m x k */
void vgi_product_downdate(size_t m, size_t k, const double *p, size_t ldp, double *a, size_t lda);
/* x (m x k) := x l'^-1, l a lower triangle of k x k */
void vgi_product_divide(size_t m, size_t k, const double *l, size_t ldl, double *x, size_t ldx);

#endif
