/* lapack.c: dense linear algebra through LAPACK. No other file includes its header. A row-major matrix is the
 * transpose of a column-major one, so the routines are called for the transpose, without copies. Products are in
 * blas.c, sparse systems in sparse.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/lapack.h"
#include "numeric/blas.h"

#include <lapacke.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>

/* Converts LAPACKE's result to a vg status. Negative values, except its two for memory, name an argument. Sizes are
 * checked here, so that argument must contain a number that is not finite. `failure` describes positive values. */
static int status_of(lapack_int info, size_t n, const char *failure, vg_err *e)
{
    if (!info) return VG_OK;
    if (info == LAPACK_WORK_MEMORY_ERROR || info == LAPACK_TRANSPOSE_MEMORY_ERROR)
        return vg_fail(e, VG_ENOMEM, "not enough memory for a dense system of %zu unknowns", n);
    if (info < 0) return vg_fail(e, VG_EINPUT, "a dense system of %zu unknowns has numbers that are not finite", n);
    return vg_fail(e, VG_EINPUT, failure, n);
}

static int check_size(size_t m, size_t n, vg_err *e)
{
    if (m <= INT_MAX && n <= INT_MAX) return VG_OK;
    return vg_fail(e, VG_ENOMEM, "a dense system of %zu x %zu is too large", m, n);
}

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

int vgi_lu_factor(size_t n, double *a, int *pivot, vg_err *e)
{
    if (check_size(n, n, e)) return VG_ENOMEM;
    if (!n) return VG_OK;
    return status_of(LAPACKE_dgetrf(LAPACK_COL_MAJOR, (lapack_int)n, (lapack_int)n, a, (lapack_int)n, pivot), n,
                     "a dense system of %zu unknowns is singular", e);
}

static void transpose_matrix(size_t rows, size_t columns, const double *from, double *to)
{
    for (size_t i = 0; i < rows; i++)
        for (size_t k = 0; k < columns; k++) to[k * rows + i] = from[i * columns + k];
}

int vgi_lu_solve(size_t n, const double *lu, const int *pivot, size_t m, double *x, vg_err *e)
{
    if (check_size(n, m, e)) return VG_ENOMEM;
    if (!n || !m) return VG_OK;
    double *y = m > 1 ? vgi_array_raw(n, m * sizeof *y, e) : x;
    if (!y) return VG_ENOMEM;
    if (m > 1) transpose_matrix(n, m, x, y);
    lapack_int info = LAPACKE_dgetrs(LAPACK_COL_MAJOR, 'T', (lapack_int)n, (lapack_int)m, lu, (lapack_int)n, pivot, y,
                                     (lapack_int)n);
    if (m > 1) {
        transpose_matrix(m, n, y, x);
        free(y);
    }
    return status_of(info, n, "", e);
}

/* The transpose of a = Q R is R' Q', LAPACK's LQ. */
int vgi_qr(size_t m, size_t n, double *a, double *r, vg_err *e)
{
    if (check_size(m, n, e)) return VG_ENOMEM;
    if (!n) return VG_OK;
    double *tau = vgi_array_raw(n, sizeof *tau, e);
    if (!tau) return VG_ENOMEM;
    lapack_int rows = (lapack_int)n, columns = (lapack_int)m;
    lapack_int info = LAPACKE_dgelqf(LAPACK_COL_MAJOR, rows, columns, a, rows, tau);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++) r[i * n + k] = k < i ? 0 : a[i * n + k];
    if (!info) info = LAPACKE_dorglq(LAPACK_COL_MAJOR, rows, columns, rows, a, rows, tau);
    free(tau);
    return status_of(info, n, "", e);
}

/* The transpose of a = U S V' is V S U'. */
int vgi_svd(size_t m, size_t n, double *a, double *u, double *s, double *vt, vg_err *e)
{
    if (check_size(m, n, e)) return VG_ENOMEM;
    if (!m || !n) return VG_OK;
    lapack_int rows = (lapack_int)n, columns = (lapack_int)m, k = rows < columns ? rows : columns;
    lapack_int info = LAPACKE_dgesdd(LAPACK_COL_MAJOR, 'S', rows, columns, a, rows, s, vt, rows, u, k);
    return status_of(info, (size_t)k, "the singular values of a matrix of rank %zu or less do not converge", e);
}

/* ---- eigenpairs ---- */

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

int vgi_eigen(size_t n, double *a, vgi_end end, size_t count, double *values, double *vectors, vg_err *e)
{
    if (check_size(n, n, e)) return VG_ENOMEM;
    if (!count) return VG_OK;
    double *all = vgi_array_raw(n, sizeof *all, e);
    lapack_int *support = vgi_array_raw(2 * n, sizeof *support, e);
    int r = all && support ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) { /* eigenvalues are numbered from 1, ascending */
        lapack_int size = (lapack_int)n, first = end == VGI_LARGEST ? (lapack_int)(n - count + 1) : 1, found;
        lapack_int info = LAPACKE_dsyevr(LAPACK_COL_MAJOR, vectors ? 'V' : 'N', 'I', 'U', size, a, size, 0, 0, first,
                                         first + (lapack_int)count - 1, 0, &found, all, vectors, size, support);
        r = status_of(info, n, "the eigenvalues of a matrix of %zu rows do not converge", e);
    }
    if (r == VG_OK) {
        memcpy(values, all, count * sizeof *values);
        if (end == VGI_LARGEST) reverse_rows(count, 1, values);
        if (vectors && end == VGI_LARGEST) reverse_rows(count, n, vectors);
        for (size_t i = 0; vectors && i < count; i++) fix_sign(n, vectors + i * n);
    }
    free(all);
    free(support);
    return r;
}
