/* rows_kernel.c: the inner loops of dense products: as many sums as the registers hold, of rows that are read where
 * they lie. BLAS copies its operands into blocks first, which takes a fifth of the time at these shapes.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/rows_kernel.h"
#include "core/wide.h"

#include <string.h>

/* ---- multiply: four rows by three vectors ---- */

enum { ACROSS = 3, COLUMNS = ACROSS * VGI_WIDTH };

/* Copy `n` columns of all rows together; what is missing of a tile is 0. */
VGI_INLINE void copy_tile(const vgi_product *p, size_t first, size_t n)
{
    for (size_t k = 0; k < p->depth; k++) {
        const double *from = p->b + k * p->ldb + first;
        double *to = p->room + k * COLUMNS;
        if (n == COLUMNS)
#pragma GCC unroll 3
            for (size_t j = 0; j < ACROSS; j++) vgi_store(to + VGI_WIDTH * j, vgi_load(from + VGI_WIDTH * j));
        else for (size_t j = 0; j < COLUMNS; j++) to[j] = j < n ? from[j] : 0;
    }
}

/* sum := add + four rows of a times the tile */
VGI_INLINE void multiply_four(const double *a, size_t depth, const double *tile, const double *add,
                              vgi_wide sum[VGI_ROWS][ACROSS])
{
#pragma GCC unroll 4
    for (size_t i = 0; i < VGI_ROWS; i++)
#pragma GCC unroll 3
        for (size_t j = 0; j < ACROSS; j++) sum[i][j] = vgi_load(add + VGI_WIDTH * j);
    for (size_t k = 0; k < depth; k++, a += VGI_ROWS, tile += COLUMNS) {
        vgi_wide b[ACROSS];
#pragma GCC unroll 3
        for (size_t j = 0; j < ACROSS; j++) b[j] = vgi_load(tile + VGI_WIDTH * j);
#pragma GCC unroll 4
        for (size_t i = 0; i < VGI_ROWS; i++) {
            vgi_wide x = vgi_same(a[i]);
#pragma GCC unroll 3
            for (size_t j = 0; j < ACROSS; j++) sum[i][j] += x * b[j];
        }
    }
}

VGI_INLINE void put_row(double *to, size_t n, const vgi_wide sum[ACROSS])
{
    if (n == COLUMNS) {
#pragma GCC unroll 3
        for (size_t j = 0; j < ACROSS; j++) vgi_store(to + VGI_WIDTH * j, sum[j]);
    } else {
        double all[COLUMNS];
        for (size_t j = 0; j < ACROSS; j++) vgi_store(all + VGI_WIDTH * j, sum[j]);
        memcpy(to, all, n * sizeof *to);
    }
}

static void all_multiply(const vgi_product *p)
{
    for (size_t first = p->first; first < p->end; first += COLUMNS) {
        size_t n = p->end - first < COLUMNS ? p->end - first : COLUMNS;
        double add[COLUMNS] = {0};
        copy_tile(p, first, n);
        if (p->add) memcpy(add, p->add + first, n * sizeof *add);
        for (size_t i = 0; i < p->rows; i += VGI_ROWS) {
            size_t end = i + VGI_ROWS < p->rows ? i + VGI_ROWS : p->rows, depth = p->lower ? end : p->depth;
            vgi_wide sum[VGI_ROWS][ACROSS];
            multiply_four(p->a + i * p->depth, depth, p->room, add, sum);
            for (size_t k = i; k < end; k++) put_row(p->to[k] + first, n, sum[k - i]);
        }
    }
}

/* ---- gram: three rows against four ---- */

enum { HIGH = 3, WIDE = 4 };

VGI_INLINE double sum_of(vgi_wide x)
{
    double lane[VGI_WIDTH], sum = 0;
    vgi_store(lane, x);
#pragma GCC unroll 8
    for (size_t k = 0; k < VGI_WIDTH; k++) sum += lane[k];
    return sum;
}

/* Products of rows: sums[h][w] = x[h] . y[w] */
VGI_INLINE void products(const double *const x[HIGH], const double *const y[WIDE], size_t n, double sums[HIGH][WIDE])
{
    const vgi_wide zero = vgi_same(0);
    vgi_wide s[HIGH][WIDE];
    size_t c = 0;
#pragma GCC unroll 3
    for (size_t h = 0; h < HIGH; h++)
#pragma GCC unroll 4
        for (size_t w = 0; w < WIDE; w++) s[h][w] = zero;
    for (; c + VGI_WIDTH <= n; c += VGI_WIDTH) {
        vgi_wide u[HIGH];
#pragma GCC unroll 3
        for (size_t h = 0; h < HIGH; h++) u[h] = vgi_load(x[h] + c);
#pragma GCC unroll 4
        for (size_t w = 0; w < WIDE; w++) {
            vgi_wide v = vgi_load(y[w] + c);
#pragma GCC unroll 3
            for (size_t h = 0; h < HIGH; h++) s[h][w] += u[h] * v;
        }
    }
#pragma GCC unroll 3
    for (size_t h = 0; h < HIGH; h++)
#pragma GCC unroll 4
        for (size_t w = 0; w < WIDE; w++) sums[h][w] = sum_of(s[h][w]);
    for (; c < n; c++)
        for (size_t h = 0; h < HIGH; h++)
            for (size_t w = 0; w < WIDE; w++) sums[h][w] += x[h][c] * y[w][c];
}

static void all_gram(size_t n, size_t width, const double *a, size_t lda, double *g, size_t ldg)
{
    for (size_t i = 0; i < n; i += HIGH)
        for (size_t j = 0; j < i + HIGH && j < n; j += WIDE) {
            const double *x[HIGH], *y[WIDE];
            double sums[HIGH][WIDE];
            for (size_t h = 0; h < HIGH; h++) x[h] = a + (i + h < n ? i + h : i) * lda; /* a row again: not used */
            for (size_t w = 0; w < WIDE; w++) y[w] = a + (j + w < n ? j + w : j) * lda;
            products(x, y, width, sums);
            for (size_t h = 0; h < HIGH && i + h < n; h++)
                for (size_t w = 0; w < WIDE && j + w <= i + h; w++) g[(i + h) * ldg + j + w] += sums[h][w];
        }
}

/* ---- centre ---- */

/* A few columns of all rows at a time, which stay in the cache. */
static void all_centre(size_t n, size_t width, double *a, size_t lda, double *restrict mean)
{
    enum { FEW = 256 };
    for (size_t first = 0; first < width; first += FEW) {
        size_t end = width - first < FEW ? width : first + FEW;
        for (size_t c = first; c < end; c++) mean[c] = 0;
        for (size_t i = 0; i < n; i++) {
            const double *restrict row = a + i * lda;
            for (size_t c = first; c < end; c++) mean[c] += row[c];
        }
        for (size_t c = first; c < end; c++) mean[c] /= (double)n;
        for (size_t i = 0; i < n; i++) {
            double *restrict row = a + i * lda;
            for (size_t c = first; c < end; c++) row[c] -= mean[c];
        }
    }
}

const vgi_rows_kernel VGI_OF_SET(vgi_rows_kernel) = {all_multiply, all_gram, all_centre};
