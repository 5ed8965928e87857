/* solve_kernel.h: triangular solves with a supernodal Cholesky factor for eight poses at once.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SOLVE_KERNEL_H
#define VG_SOLVE_KERNEL_H

#include "core/core.h"

/* A supernodal factor as CHOLMOD lays it out, borrowed. Supernode s holds columns super[s] .. super[s+1]-1; its rows are
 * rows[pi[s]] .. rows[pi[s+1]-1], the first of which are its own columns; its entries are a column-major block of that
 * many rows at values + px[s]. Only the lower triangle of the block's head is defined. */
typedef struct vgi_factor {
    size_t n, supernodes;
    const int *super, *pi, *px, *rows;
    const double *values;
} vgi_factor;

/* The unknowns of a block of poses: x, y and z of eight poses side by side for each row of the factor. */
typedef struct vgi_row {
    vgi_lanes xyz[3];
} vgi_row;

/* vgi_factor_solve: x := (L L')^-1 x, n rows in the factor's order. */
void vgi_factor_solve(const vgi_factor *f, vgi_row *x);

/* The normal matrix as what it is, a sum over faces: face f stands on rows[start[f]] .. rows[start[f+1]-1]. Of a star (see
 * reconstruct.c) the centre is one more row: centre[f]; of others UINT32_MAX. */
typedef struct vgi_stencil {
    size_t faces;
    const uint32_t *start, *rows, *centre;
} vgi_stencil;

/* vgi_residual: r -= N x. Rounds like the vectors of x, not like x: only differences within a face are formed. */
void vgi_residual(const vgi_stencil *s, const vgi_row *x, vgi_row *r);

#endif
