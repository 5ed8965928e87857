/* fronts_kernel.c: dense partial Cholesky factorisation of one front. Fronts of a surface are small, mostly below 100
 * rows; for these the overhead of BLAS calls exceeds the arithmetic. Fronts are assembled in fronts.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/fronts_kernel.h"
#include "core/wide.h"

#include <math.h>

enum { COLUMNS = 4, VECTORS = 3 }; /* columns updated together, and vectors of rows: their sums stay in registers */

/* c[i + q ldc] -= sum over k < depth of a[i + k lda] b[q + k ldb], for `n` columns and `vectors` vectors of rows. */
VGI_INLINE void update_tile(int vectors, int n, size_t depth, const double *a, size_t lda, const double *b, size_t ldb,
                            double *c, size_t ldc)
{
    vgi_wide sum[COLUMNS][VECTORS];
#pragma GCC unroll 4
    for (int q = 0; q < n; q++)
#pragma GCC unroll 4
        for (int v = 0; v < vectors; v++) sum[q][v] = vgi_load(c + (size_t)q * ldc + (size_t)v * VGI_WIDTH);
    for (size_t k = 0; k < depth; k++) {
        vgi_wide row[VECTORS];
#pragma GCC unroll 4
        for (int v = 0; v < vectors; v++) row[v] = vgi_load(a + k * lda + (size_t)v * VGI_WIDTH);
#pragma GCC unroll 4
        for (int q = 0; q < n; q++) {
            vgi_wide factor = vgi_same(b[k * ldb + (size_t)q]);
#pragma GCC unroll 4
            for (int v = 0; v < vectors; v++) sum[q][v] -= row[v] * factor;
        }
    }
#pragma GCC unroll 4
    for (int q = 0; q < n; q++)
#pragma GCC unroll 4
        for (int v = 0; v < vectors; v++) vgi_store(c + (size_t)q * ldc + (size_t)v * VGI_WIDTH, sum[q][v]);
}

VGI_INLINE void update_row(int n, size_t depth, const double *a, size_t lda, const double *b, size_t ldb, double *c,
                           size_t ldc)
{
    double sum[COLUMNS];
#pragma GCC unroll 4
    for (int q = 0; q < n; q++) sum[q] = c[(size_t)q * ldc];
    for (size_t k = 0; k < depth; k++)
#pragma GCC unroll 4
        for (int q = 0; q < n; q++) sum[q] -= a[k * lda] * b[k * ldb + (size_t)q];
#pragma GCC unroll 4
    for (int q = 0; q < n; q++) c[(size_t)q * ldc] = sum[q];
}

VGI_INLINE void update_columns(int n, size_t rows, size_t depth, const double *a, size_t lda, const double *b, size_t ldb,
                               double *c, size_t ldc)
{
    size_t i = 0;
    for (; i + VECTORS * VGI_WIDTH <= rows; i += VECTORS * VGI_WIDTH)
        update_tile(VECTORS, n, depth, a + i, lda, b, ldb, c + i, ldc);
    for (; i + VGI_WIDTH <= rows; i += VGI_WIDTH) update_tile(1, n, depth, a + i, lda, b, ldb, c + i, ldc);
    for (; i < rows; i++) update_row(n, depth, a + i, lda, b, ldb, c + i, ldc);
}

static void update(size_t n, size_t rows, size_t depth, const double *a, size_t lda, const double *b, size_t ldb,
                   double *c, size_t ldc)
{
    if (n >= COLUMNS) update_columns(COLUMNS, rows, depth, a, lda, b, ldb, c, ldc);
    else if (n == 3) update_columns(3, rows, depth, a, lda, b, ldb, c, ldc);
    else if (n == 2) update_columns(2, rows, depth, a, lda, b, ldb, c, ldc);
    else update_columns(1, rows, depth, a, lda, b, ldb, c, ldc);
}

/* Finish columns j .. j + n - 1 of l; those before them are done and applied. */
static bool finish_columns(size_t m, size_t j, size_t n, double *l)
{
    for (size_t q = 0; q < n; q++) {
        double *column = l + (j + q) * m;
        for (size_t p = 0; p < q; p++) {
            const double *before = l + (j + p) * m;
            double factor = before[j + q];
            for (size_t i = j + q; i < m; i++) column[i] -= factor * before[i];
        }
        double pivot = column[j + q];
        if (!(pivot > 0) || !isfinite(pivot)) return false;
        double root = sqrt(pivot), scale = 1 / root;
        column[j + q] = root;
        for (size_t i = j + q + 1; i < m; i++) column[i] *= scale;
    }
    return true;
}

static void complete_front(size_t m, size_t c, const double *l, double *u)
{
    for (size_t j = 0, left = m - c; c && j < left; j += COLUMNS) {
        size_t n = left - j < COLUMNS ? left - j : COLUMNS;
        update(n, left - j, c, l + c + j, m, l + c + j, m, u + j * left + j, left);
    }
}

static size_t eliminate_columns(size_t m, size_t c, double *l, double *u)
{
    for (size_t j = 0; j < c; j += COLUMNS) {
        size_t n = c - j < COLUMNS ? c - j : COLUMNS;
        if (j) update(n, m - j, j, l + j, m, l + j, m, l + j * m + j, m);
        if (!finish_columns(m, j, n, l)) return j;
    }
    complete_front(m, c, l, u);
    return c;
}

VGI_INLINE void add_run(size_t n, const double *from, double *to)
{
    size_t i = 0;
    for (; i + VGI_WIDTH <= n; i += VGI_WIDTH) vgi_store(to + i, vgi_load(to + i) + vgi_load(from + i));
    for (; i < n; i++) to[i] += from[i];
}

/* Consecutive rows on both sides are added together: run[i] is the first row after the run. */
static void scatter(size_t n, const uint32_t *at, const uint32_t *to, uint32_t *run, size_t ld, const double *from,
                    size_t m, size_t c, double *l, double *u)
{
    for (size_t i = n; i-- > 0;) {
        bool last = i + 1 == n || to[i + 1] != to[i] + 1 || at[i + 1] != at[i] + 1;
        run[i] = last ? (uint32_t)i + 1 : run[i + 1];
    }
    for (size_t j = 0; j < n; j++) {
        bool in_l = to[j] < c;
        if (in_l && !l) continue;
        size_t above = in_l ? 0 : c; /* rows above the first of l or u */
        double *column = in_l ? l + to[j] * m : u + (to[j] - c) * (m - c);
        for (size_t i = j; i < n; i = run[i]) add_run(run[i] - i, from + at[j] * ld + at[i], column + (to[i] - above));
    }
}

const vgi_fronts_kernel VGI_OF_SET(vgi_fronts_kernel) = {eliminate_columns, complete_front, scatter};
