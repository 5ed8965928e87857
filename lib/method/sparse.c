/* sparse.c: symmetric positive definite systems through CHOLMOD: one analysis, many factorisations.
 * BLAS runs alone here: these systems are too small for more threads, and the last digits must not depend on their
 * number. Leaves out assembling them. Calls Core, Cholesky, Partition (LGPL) and Supernodal (GPL) of CHOLMOD.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/sparse.h"

#include <cholmod.h>
#include <stdlib.h>

/* Below this many unknowns a minimum-degree order is as good as nested dissection, and faster. */
enum { SMALL = 500 };

struct vgi_cholesky {
    cholmod_common common;
    cholmod_factor *L;
    cholmod_dense *x, *y, *e; /* what cholmod_solve2 works in */
    double *b;                /* n x 3, by columns */
};

/* OpenBLAS's own; with another BLAS they are not there. */
void openblas_set_num_threads(int n) __attribute__((weak));
int openblas_get_num_threads(void) __attribute__((weak));

static int blas_threads(int n)
{
    if (!openblas_set_num_threads || !openblas_get_num_threads) return n;
    int before = openblas_get_num_threads();
    if (n != before) openblas_set_num_threads(n);
    return before;
}

void vgi_sparse_clear(vgi_sparse *a)
{
    free(a->start);
    free(a->row);
    free(a->value);
    *a = (vgi_sparse){0};
}

/* a as CHOLMOD sees it, borrowed. */
static cholmod_sparse view(const vgi_sparse *a)
{
    return (cholmod_sparse){.nrow = a->n, .ncol = a->n, .nzmax = (size_t)a->start[a->n], .p = a->start, .i = a->row,
                            .x = a->value, .stype = -1, .itype = CHOLMOD_INT, .xtype = CHOLMOD_REAL,
                            .dtype = CHOLMOD_DOUBLE, .sorted = 1, .packed = 1};
}

/* All that a solve needs: CHOLMOD 3.0 does not survive a failed allocation in there. */
static bool make_workspace(vgi_cholesky *c)
{
    size_t n = c->L->n, rows = c->L->maxesize ? c->L->maxesize : 1;
    c->x = cholmod_allocate_dense(n, 3, n, CHOLMOD_REAL, &c->common);
    c->y = cholmod_allocate_dense(n, 3, n, CHOLMOD_REAL, &c->common);
    c->e = cholmod_allocate_dense(rows, 3, rows, CHOLMOD_REAL, &c->common);
    return c->x && c->y && c->e;
}

int vgi_cholesky_new(vgi_cholesky **out, const vgi_sparse *a, vg_err *e)
{
    vgi_cholesky *c = *out = vgi_array(1, sizeof *c, e);
    if (!c) return VG_ENOMEM;
    cholmod_start(&c->common);
    c->common.print = 0;
    c->common.error_handler = NULL;
    c->common.nmethods = 1;
    c->common.method[0].ordering = a->n < SMALL ? CHOLMOD_AMD : CHOLMOD_METIS;
    c->common.postorder = 1;
    c->common.supernodal = CHOLMOD_SUPERNODAL;
    cholmod_sparse A = view(a);
    c->L = cholmod_analyze(&A, &c->common);
    c->b = vgi_array_raw(a->n, 3 * sizeof *c->b, e);
    if (c->L && c->b && make_workspace(c)) return VG_OK;
    vgi_cholesky_free(out);
    return vg_fail(e, VG_ENOMEM, "not enough memory to factorize %zu unknowns", a->n);
}

void vgi_cholesky_free(vgi_cholesky **out)
{
    vgi_cholesky *c = *out;
    if (!c) return;
    cholmod_free_dense(&c->x, &c->common);
    cholmod_free_dense(&c->y, &c->common);
    cholmod_free_dense(&c->e, &c->common);
    cholmod_free_factor(&c->L, &c->common);
    cholmod_finish(&c->common);
    free(c->b);
    free(c);
    *out = NULL;
}

int vgi_cholesky_factorize(vgi_cholesky *c, const vgi_sparse *a, vg_err *e)
{
    cholmod_sparse A = view(a);
    int threads = blas_threads(1);
    cholmod_factorize(&A, c->L, &c->common);
    blas_threads(threads);
    if (c->common.status == CHOLMOD_OUT_OF_MEMORY)
        return vg_fail(e, VG_ENOMEM, "not enough memory to factorize %zu unknowns", a->n);
    if (c->common.status != CHOLMOD_OK || c->L->minor != c->L->n)
        return vg_fail(e, VG_EINPUT, "cannot factorize: not positive definite at row %zu", c->L->minor);
    return VG_OK;
}

int vgi_cholesky_solve(vgi_cholesky *c, double *x, vg_err *e)
{
    size_t n = c->L->n;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 3; k++) c->b[k * n + i] = x[3 * i + k];
    cholmod_dense B = {
        .nrow = n, .ncol = 3, .nzmax = 3 * n, .d = n, .x = c->b, .xtype = CHOLMOD_REAL, .dtype = CHOLMOD_DOUBLE};
    int threads = blas_threads(1);
    int done = cholmod_solve2(CHOLMOD_A, c->L, &B, NULL, &c->x, NULL, &c->y, &c->e, &c->common);
    blas_threads(threads);
    if (!done) return vg_fail(e, VG_ENOMEM, "not enough memory to solve for %zu unknowns", n);
    const double *from = c->x->x;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 3; k++) x[3 * i + k] = from[k * n + i];
    return VG_OK;
}

size_t vgi_cholesky_entries(const vgi_cholesky *c)
{
    return c->L->xsize;
}
