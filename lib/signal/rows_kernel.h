/* rows_kernel.h: dense products of tall and wide matrices whose rows lie far apart, without the copies that BLAS
 * makes first.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_ROWS_KERNEL_H
#define VG_ROWS_KERNEL_H

#include "core/isa.h"

enum {
    VGI_TILE = 24, /* columns multiplied at a time, at most */
    VGI_ROWS = 4   /* rows multiplied at a time */
};

/* Columns from first to end of: to (rows x ...) := a (rows x depth) b (depth x ...) + add. A number of the result depends on
 * its row of a and its column of b alone. */
typedef struct vgi_product {
    size_t rows, depth, first, end;
    const double *a;    /* by vgi_pack_rows */
    bool lower;         /* a is a lower triangle; then b may be the result itself */
    const double *b;
    size_t ldb;
    const double *add;  /* the same for every row, or NULL */
    double *const *to;  /* each row of the result */
    double *room;       /* depth x VGI_TILE numbers */
} vgi_product;

typedef struct vgi_rows_kernel {
    void (*multiply)(const vgi_product *p);
    /* gram: lower triangle of g (n x n) += a a', a n x width */
    void (*gram)(size_t n, size_t width, const double *a, size_t lda, double *g, size_t ldg);
    /* centre: mean (width) := the mean of n rows, which is deducted from each */
    void (*centre)(size_t n, size_t width, double *a, size_t lda, double *mean);
} vgi_rows_kernel;
VGI_KERNEL(vgi_rows_kernel)

/* vgi_packed: how many numbers vgi_pack_rows writes. */
static inline size_t vgi_packed(size_t rows, size_t depth)
{
    return (rows + VGI_ROWS - 1) / VGI_ROWS * VGI_ROWS * depth;
}

/* vgi_pack_rows: to := a (rows x depth, row-major), the numbers of four rows side by side; the rows that are missing are 0. */
static inline void vgi_pack_rows(size_t rows, size_t depth, const double *a, double *to)
{
    for (size_t i = 0; i < rows; i += VGI_ROWS)
        for (size_t k = 0; k < depth; k++)
            for (size_t r = i; r < i + VGI_ROWS; r++) *to++ = r < rows ? a[r * depth + k] : 0;
}

#endif
