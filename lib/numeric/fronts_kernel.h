/* fronts_kernel.h: dense partial Cholesky factorisation of one front.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FRONTS_KERNEL_H
#define VG_FRONTS_KERNEL_H

#include "core/isa.h"

typedef struct vgi_fronts_kernel {
    /* eliminate: the first c of m columns of a symmetric matrix. Its lower triangle is given: the first c columns in
     * l (m rows, column-major), the others in u (m - c rows). l becomes the columns of the factor, u the remainder.
     * Entries above the diagonal may be overwritten. Returns c, or the first column that is not positive. */
    size_t (*eliminate)(size_t m, size_t c, double *l, double *u);
    /* complete: the second half of eliminate: u -= B B', B the rows of l from c on. */
    void (*complete)(size_t m, size_t c, const double *l, double *u);
    /* scatter: add the lower triangle of a matrix (ld rows, column-major) to such a front. Its n rows and columns
     * at[] are rows and columns to[] there, both ascending. l may be NULL: its columns are left out. run: workspace
     * of n. */
    void (*scatter)(size_t n, const uint32_t *at, const uint32_t *to, uint32_t *run, size_t ld, const double *from,
                    size_t m, size_t c, double *l, double *u);
} vgi_fronts_kernel;
VGI_KERNEL(vgi_fronts_kernel)

#endif
