/* lapack.c: definite systems and eigenpairs of symmetric matrices through LAPACK. No other file includes its header. A row-major matrix is the
 * transpose of a column-major one, so the routines are called for the transpose, without copies. Products are in
 * blas.c, sparse systems in sparse.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/lapack.h"
#include "numeric/blas.h"

#include <lapacke.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>

bool vgi_spd_factor(size_t n, double *a)
{
    if (!n) return true;
    return !LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'U', (lapack_int)n, a, (lapack_int)n);
}

void vgi_spd_solve(size_t n, const double *l, size_t m, double *x)
{
    vgi_solve_lower(n, l, m, x);
    vgi_solve_lower_transposed(n, l, m, x);
}

/* ---- eigenpairs ---- */

/* LAPACKE's result as a status of vg. Negative values, except its two for memory, name an argument: numbers that are not finite. */
static int status_of(lapack_int info, size_t n, vg_err *e)
{
    if (!info) return VG_OK;
    if (info == LAPACK_WORK_MEMORY_ERROR || info == LAPACK_TRANSPOSE_MEMORY_ERROR)
        return vg_fail(e, VG_ENOMEM, "not enough memory for the eigenvalues of a matrix of %zu rows", n);
    if (info < 0) return vg_fail(e, VG_EINPUT, "a matrix of %zu rows has numbers that are not finite", n);
    return vg_fail(e, VG_EINPUT, "the eigenvalues of a matrix of %zu rows do not converge", n);
}

static void fix_sign(size_t n, double *v)
{
    size_t most = 0;
    for (size_t i = 1; i < n; i++)
        if (fabs(v[i]) > fabs(v[most])) most = i;
    if (v[most] < 0)
        for (size_t i = 0; i < n; i++) v[i] = -v[i];
}

static void reverse_rows(size_t rows, size_t columns, double *x)
{
    for (size_t i = 0; i < rows / 2; i++)
        for (size_t k = 0; k < columns; k++) {
            double *a = x + i * columns + k, *b = x + (rows - 1 - i) * columns + k, kept = *a;
            *a = *b, *b = kept;
        }
}

int vgi_eigen(size_t n, double *a, size_t count, double *values, double *vectors, vg_err *e)
{
    if (n > INT_MAX) return vg_fail(e, VG_ENOMEM, "a matrix of %zu rows is too large for eigenvalues", n);
    if (!count) return VG_OK;
    double *all = vgi_array_raw(n, sizeof *all, e);
    lapack_int *support = vgi_array_raw(2 * n, sizeof *support, e);
    int r = all && support ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) { /* eigenvalues are numbered from 1, ascending */
        lapack_int size = (lapack_int)n, first = (lapack_int)(n - count + 1), found;
        lapack_int info = LAPACKE_dsyevr(LAPACK_COL_MAJOR, vectors ? 'V' : 'N', 'I', 'U', size, a, size, 0, 0, first,
                                         first + (lapack_int)count - 1, 0, &found, all, vectors, size, support);
        r = status_of(info, n, e);
    }
    if (r == VG_OK) {
        memcpy(values, all, count * sizeof *values);
        reverse_rows(count, 1, values);
        if (vectors) reverse_rows(count, n, vectors);
        for (size_t i = 0; vectors && i < count; i++) fix_sign(n, vectors + i * n);
    }
    free(all);
    free(support);
    return r;
}
