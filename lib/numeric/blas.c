/* blas.c: dense products and triangular solves through BLAS. No other file includes its header. Callers decide what
 * is multiplied, and how work is divided among threads.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/blas.h"

#include <cblas.h>
#include <pthread.h>

/* Functions of OpenBLAS; absent with another BLAS. */
void openblas_set_num_threads(int n) __attribute__((weak));
int openblas_get_num_threads(void) __attribute__((weak));

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static int alone, threads_before;

void vgi_blas_alone(void)
{
    if (!openblas_set_num_threads || !openblas_get_num_threads) return;
    pthread_mutex_lock(&lock);
    if (!alone++) {
        threads_before = openblas_get_num_threads();
        if (threads_before != 1) openblas_set_num_threads(1);
    }
    pthread_mutex_unlock(&lock);
}

void vgi_blas_shared(void)
{
    if (!openblas_set_num_threads || !openblas_get_num_threads) return;
    pthread_mutex_lock(&lock);
    if (!--alone && threads_before > 1) openblas_set_num_threads(threads_before);
    pthread_mutex_unlock(&lock);
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

static void solve_triangle(CBLAS_TRANSPOSE side, size_t n, const double *l, size_t m, double *x)
{
    if (m == 1) cblas_dtrsv(CblasRowMajor, CblasLower, side, CblasNonUnit, (int)n, l, (int)n, x, 1);
    else
        cblas_dtrsm(CblasRowMajor, CblasLeft, CblasLower, side, CblasNonUnit, (int)n, (int)m, 1, l, (int)n, x, (int)m);
}

void vgi_gemm_single(bool turn_a, bool turn_b, size_t m, size_t n, size_t k, const float *a, size_t lda,
                     const float *b, size_t ldb, float beta, float *c, size_t ldc)
{
    cblas_sgemm(CblasRowMajor, turn_a ? CblasTrans : CblasNoTrans, turn_b ? CblasTrans : CblasNoTrans, (int)m, (int)n,
                (int)k, 1, a, (int)lda, b, (int)ldb, beta, c, (int)ldc);
}

void vgi_gemm_double(bool turn_a, bool turn_b, size_t m, size_t n, size_t k, const double *a, size_t lda,
                     const double *b, size_t ldb, double beta, double *c, size_t ldc)
{
    cblas_dgemm(CblasRowMajor, turn_a ? CblasTrans : CblasNoTrans, turn_b ? CblasTrans : CblasNoTrans, (int)m, (int)n,
                (int)k, 1, a, (int)lda, b, (int)ldb, beta, c, (int)ldc);
}

void vgi_product_double_transposed(size_t m, size_t n, size_t k, const double *a, size_t lda, const double *b,
                                   size_t ldb, double *c, size_t ldc)
{
    cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)m, (int)n, (int)k, 1, a, (int)lda, b, (int)ldb, 0, c,
                (int)ldc);
}

void vgi_product_transposed_double(size_t m, size_t n, size_t k, const double *a, size_t lda, const double *b,
                                   size_t ldb, double *c, size_t ldc)
{
    cblas_dgemm(CblasRowMajor, CblasTrans, CblasNoTrans, (int)m, (int)n, (int)k, 1, a, (int)lda, b, (int)ldb, 0, c,
                (int)ldc);
}

void vgi_product_gram(size_t n, size_t k, const double *a, size_t lda, double *c, size_t ldc)
{
    cblas_dsyrk(CblasRowMajor, CblasLower, CblasNoTrans, (int)n, (int)k, 1, a, (int)lda, 0, c, (int)ldc);
}

void vgi_solve_lower_stripe(size_t n, const double *l, size_t m, double *x, size_t ldx)
{
    cblas_dtrsm(CblasRowMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, (int)n, (int)m, 1, l, (int)n, x,
                (int)ldx);
}

void vgi_solve_lower(size_t n, const double *l, size_t m, double *x)
{
    if (n && m) solve_triangle(CblasNoTrans, n, l, m, x);
}

void vgi_solve_lower_transposed(size_t n, const double *l, size_t m, double *x)
{
    if (n && m) solve_triangle(CblasTrans, n, l, m, x);
}
