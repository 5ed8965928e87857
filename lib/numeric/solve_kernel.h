/* solve_kernel.h: triangular solves with a supernodal Cholesky factor for eight poses at once.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SOLVE_KERNEL_H
#define VG_SOLVE_KERNEL_H

#include "core/isa.h"
#include "core/lanes.h"

/* A supernodal factor in CHOLMOD's layout, borrowed. Supernode s holds columns super[s] .. super[s+1]-1. Its rows are
 * rows[pi[s]] .. rows[pi[s+1]-1]; the first of them are its own columns. Its entries are block[s], column-major, with
 * that many rows. Only the lower triangle of the block's head is defined. */
typedef struct vgi_factor {
    size_t n, supernodes;
    const int *super, *pi, *rows;
    const double *const *block;
} vgi_factor;

/* The unknowns of a block of poses: x, y and z of eight poses side by side for each row of the factor. */
typedef struct vgi_row {
    vgi_lanes xyz[3];
} vgi_row;

typedef struct vgi_solve_kernel {
    void (*solve)(const vgi_factor *f, vgi_row *x);
    void (*solve_one)(const vgi_factor *f, double *x);
    void (*load)(vgi_row *x, const uint32_t *row, size_t nv, size_t rows, const double *const *rhs);
    void (*add)(const vgi_row *x, const uint32_t *row, size_t nv, size_t rows, double *const *pose, size_t lanes);
} vgi_solve_kernel;
VGI_KERNEL(vgi_solve_kernel)

/* vgi_factor_solve: x := (L L')^-1 x, n rows in the factor's order. */
static inline void vgi_factor_solve(const vgi_factor *f, vgi_row *x)
{
    vgi_solve_kernel_now()->solve(f, x);
}

/* vgi_factor_solve_one: the same for one pose: each row of x is x, y, z and an unused number. */
static inline void vgi_factor_solve_one(const vgi_factor *f, double *x)
{
    vgi_solve_kernel_now()->solve_one(f, x);
}

/* vgi_load_rows: x[row[v]] := rhs of vertex v in 8 poses (nv x 3 each), for every v with row[v] < rows. */
static inline void vgi_load_rows(vgi_row *x, const uint32_t *row, size_t nv, size_t rows, const double *const *rhs)
{
    vgi_solve_kernel_now()->load(x, row, nv, rows, rhs);
}

/* vgi_add_rows: the inverse, for the first `lanes` poses: pose[k] of v += x[row[v]]. */
static inline void vgi_add_rows(const vgi_row *x, const uint32_t *row, size_t nv, size_t rows, double *const *pose,
                                size_t lanes)
{
    vgi_solve_kernel_now()->add(x, row, nv, rows, pose, lanes);
}

#endif
