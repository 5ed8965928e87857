/* product_kernel.c: products of a matrix with eight chains, in blocks that stay in registers. The matrix is read once,
 * in order, and asked for ahead of its use. Sums are in a fixed order. Products of many chains and steps, as in the
 * gradients of matrices, use BLAS.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/product_kernel.h"
#ifndef VGI_NET_DOUBLE
#include "core/wide.h"
#endif

#define INLINE static inline __attribute__((always_inline))

/* A block has 2 * ROWS or COLUMNS sums of eight chains. */
#if defined(__AVX__) || defined(__aarch64__)
enum { ROWS = 6, COLUMNS = 12 };
#else
enum { ROWS = 3, COLUMNS = 6 };
#endif
enum { PART = 4096 }; /* numbers of the matrix that stay in the nearest cache */

/* `rows` rows of w; even and odd columns have own sums, so that no sum waits for the one before */
INLINE void multiply_rows(size_t rows, size_t n, const real *w, const net_lanes *x, bool add, net_lanes *y)
{
    net_lanes even[ROWS], odd[ROWS];
#pragma GCC unroll 6
    for (size_t r = 0; r < rows; r++) even[r] = add ? y[r] : (net_lanes){0}, odd[r] = (net_lanes){0};
    for (size_t k = 0; k + 1 < n; k += 2) {
        __builtin_prefetch(w + 2 * rows * n + k * rows);
#pragma GCC unroll 6
        for (size_t r = 0; r < rows; r++) even[r] += x[k] * w[r * n + k], odd[r] += x[k + 1] * w[r * n + k + 1];
    }
    if (n % 2)
#pragma GCC unroll 6
        for (size_t r = 0; r < rows; r++) even[r] += x[n - 1] * w[r * n + n - 1];
#pragma GCC unroll 6
    for (size_t r = 0; r < rows; r++) y[r] = even[r] + odd[r];
}

static void multiply(size_t rows, size_t columns, const real *w, const net_lanes *x, bool add, net_lanes *y)
{
    size_t r = 0;
    for (; r + ROWS <= rows; r += ROWS) multiply_rows(ROWS, columns, w + r * columns, x, add, y + r);
    for (; r < rows; r++) multiply_rows(1, columns, w + r * columns, x, add, y + r);
}

/* some columns of `rows` rows of w, which is n wide; next: what to ask for */
INLINE void multiply_columns(size_t columns, size_t rows, size_t n, const real *w, const net_lanes *x, net_lanes *y,
                             const real *next)
{
    net_lanes sum[COLUMNS];
#pragma GCC unroll 12
    for (size_t k = 0; k < columns; k++) sum[k] = y[k];
    for (size_t r = 0; r < rows; r++) {
        __builtin_prefetch(next + r * columns);
#pragma GCC unroll 12
        for (size_t k = 0; k < columns; k++) sum[k] += x[r] * w[r * n + k];
    }
#pragma GCC unroll 12
    for (size_t k = 0; k < columns; k++) y[k] = sum[k];
}

static void multiply_turned(size_t rows, size_t columns, const real *w, const net_lanes *x, bool add, net_lanes *y)
{
    size_t part = PART / columns < 8 ? 8 : PART / columns;
    if (!add) memset(y, 0, columns * sizeof *y);
    for (size_t first = 0; first < rows; first += part) {
        size_t n = rows - first < part ? rows - first : part, k = 0;
        const real *at = w + first * columns, *next = at + part * columns;
        for (; k + COLUMNS <= columns; k += COLUMNS)
            multiply_columns(COLUMNS, n, columns, at + k, x + first, y + k, next + k * n);
        for (; k + 2 <= columns; k += 2) multiply_columns(2, n, columns, at + k, x + first, y + k, next + k * n);
        for (; k < columns; k++) multiply_columns(1, n, columns, at + k, x + first, y + k, next + k * n);
    }
}

#ifdef VGI_NET_DOUBLE
const net_product_kernel vgi_double_product_kernel = {multiply, multiply_turned};
#else
const net_product_kernel VGI_OF_SET(net_product_kernel) = {multiply, multiply_turned};
#endif
