/* dense.c: Cholesky of dense systems, block by block, so that large ones are products.
 * Leaves out sparse ones (sparse.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/dense.h"
#include "numeric/blas.h"

#include <math.h>

static bool factor_block(double *a, size_t stride, size_t n)
{
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j <= i; j++) {
            double sum = a[i * stride + j];
            const double *x = a + i * stride, *y = a + j * stride;
            double s[4] = {0, 0, 0, 0};
            size_t k = 0;
            for (; k + 4 <= j; k += 4)
                for (size_t q = 0; q < 4; q++) s[q] += x[k + q] * y[k + q];
            for (; k < j; k++) s[0] += x[k] * y[k];
            sum -= (s[0] + s[1]) + (s[2] + s[3]);
            if (i == j && !(sum > 0)) return false;
            a[i * stride + j] = i == j ? sqrt(sum) : sum / a[j * stride + j];
        }
    return true;
}

bool vgi_cholesky_dense(double *a, size_t n)
{
    enum { WIDTH = 64 };
    for (size_t k = 0; k < n; k += WIDTH) {
        size_t width = n - k < WIDTH ? n - k : WIDTH, below = n - k - width;
        double *block = a + k * n + k, *panel = block + width * n;
        if (!factor_block(block, n, width)) return false;
        if (!below) break;
        vgi_product_divide(below, width, block, n, panel, n);
        vgi_product_downdate(below, width, panel, n, panel + width, n);
    }
    return true;
}

void vgi_cholesky_dense_solve(const double *l, size_t n, double *x, size_t m)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < i; k++)
            for (size_t c = 0; c < m; c++) x[i * m + c] -= l[i * n + k] * x[k * m + c];
        for (size_t c = 0; c < m; c++) x[i * m + c] /= l[i * n + i];
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t c = 0; c < m; c++) x[i * m + c] /= l[i * n + i];
        for (size_t k = 0; k < i; k++)
            for (size_t c = 0; c < m; c++) x[k * m + c] -= l[i * n + k] * x[i * m + c];
    }
}
