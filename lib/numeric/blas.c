/* blas.c: dense products through BLAS. The only file that knows its header.
 * Leaves out what is multiplied, and how the work is shared out among threads.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/blas.h"

#include <cblas.h>

/* OpenBLAS's own; with another BLAS they are not there. */
void openblas_set_num_threads(int n) __attribute__((weak));
int openblas_get_num_threads(void) __attribute__((weak));

int vgi_product_begin(void)
{
    if (!openblas_set_num_threads || !openblas_get_num_threads) return 0;
    int before = openblas_get_num_threads();
    if (before != 1) openblas_set_num_threads(1);
    return before;
}

void vgi_product_end(int before)
{
    if (before > 1) openblas_set_num_threads(before);
}

void vgi_product_single(size_t m, size_t n, size_t k, const float *a, size_t lda, const float *b, size_t ldb,
                        float *c, size_t ldc)
{
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)m, (int)n, (int)k, 1, a, (int)lda, b, (int)ldb, 0, c,
                (int)ldc);
}

void vgi_product_double(size_t m, size_t n, size_t k, const double *a, size_t lda, const double *b, size_t ldb,
                        double *c, size_t ldc)
{
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)m, (int)n, (int)k, 1, a, (int)lda, b, (int)ldb, 0, c,
                (int)ldc);
}

void vgi_product_add(size_t m, size_t n, size_t k, const double *a, size_t lda, const double *b, size_t ldb,
                     double *c, size_t ldc)
{
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, (int)m, (int)n, (int)k, 1, a, (int)lda, b, (int)ldb, 1, c,
                (int)ldc);
}

void vgi_product_single_transposed(size_t m, size_t n, size_t k, const float *a, size_t lda, const float *b,
                                   size_t ldb, float *c, size_t ldc)
{
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)m, (int)n, (int)k, 1, a, (int)lda, b, (int)ldb, 0, c,
                (int)ldc);
}

void vgi_product_downdate(size_t m, size_t k, const double *p, size_t ldp, double *a, size_t lda)
{
    cblas_dsyrk(CblasRowMajor, CblasLower, CblasNoTrans, (int)m, (int)k, -1, p, (int)ldp, 1, a, (int)lda);
}

void vgi_product_divide(size_t m, size_t k, const double *l, size_t ldl, double *x, size_t ldx)
{
    cblas_dtrsm(CblasRowMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, (int)m, (int)k, 1, l, (int)ldl, x,
                (int)ldx);
}
