/* sparse.c: symmetric positive definite systems through CHOLMOD: one analysis, many factorisations. BLAS and OpenMP
 * run on one thread here: fronts of a surface's factor are small, and OpenMP's threads would only spin on processors
 * that other programs of the pipe could use; nor may the last digits depend on their number. No other file includes
 * CHOLMOD; it calls Core, Cholesky, Partition (LGPL) and Supernodal (GPL).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/sparse.h"
#include "numeric/blas.h"

#include <cholmod.h>
#include <stdlib.h>

/* Below this many unknowns a minimum-degree order is as good as nested dissection, and faster to find. */
enum { SMALL = 500 };

struct vgi_cholesky {
    cholmod_common common;
    cholmod_factor *L;
    cholmod_dense *x, *y, *e; /* workspace of cholmod_solve2 */
    double *b;                /* n x 3, by columns */
    const double **block;     /* per supernode, once factorised */
};

/* Functions of the libraries below; if absent, nothing needs to be limited. */
void omp_set_max_active_levels(int n) __attribute__((weak));
int omp_get_max_active_levels(void) __attribute__((weak));

/* Returns the previous setting, for end_alone. */
static int begin_alone(void)
{
    vgi_blas_alone();
    if (!omp_set_max_active_levels || !omp_get_max_active_levels) return 0;
    int before = omp_get_max_active_levels();
    omp_set_max_active_levels(0);
    return before;
}

static void end_alone(int before)
{
    if (omp_set_max_active_levels && omp_get_max_active_levels) omp_set_max_active_levels(before);
    vgi_blas_shared();
}

void vgi_sparse_clear(vgi_sparse *a)
{
    free(a->start);
    free(a->row);
    free(a->value);
    *a = (vgi_sparse){0};
}

/* ---- assembly ---- */

int vgi_triplets_make(vgi_triplets *t, size_t most, vg_err *e)
{
    *t = (vgi_triplets){.most = most};
    t->row = vgi_array_raw(most, sizeof *t->row, e);
    t->column = vgi_array_raw(most, sizeof *t->column, e);
    t->value = vgi_array_raw(most, sizeof *t->value, e);
    if (t->row && t->column && t->value) return VG_OK;
    vgi_triplets_clear(t);
    return VG_ENOMEM;
}

void vgi_triplets_clear(vgi_triplets *t)
{
    free(t->row);
    free(t->column);
    free(t->value);
    *t = (vgi_triplets){0};
}

/* order: the entries sorted by `key`; entries with the same key are in the order of `before` (NULL: as given). */
static void sort_entries(size_t n, const uint32_t *key, size_t keys, const uint32_t *before, uint32_t *first,
                         uint32_t *order)
{
    memset(first, 0, (keys + 1) * sizeof *first);
    for (size_t i = 0; i < n; i++) first[key[i] + 1]++;
    for (size_t k = 0; k < keys; k++) first[k + 1] += first[k];
    for (size_t i = 0; i < n; i++) {
        uint32_t at = before ? before[i] : (uint32_t)i;
        order[first[key[at]]++] = at;
    }
}

/* `by_column`: the entries sorted by column, then by row. */
static void sum_sorted(const vgi_triplets *t, const uint32_t *by_column, vgi_sparse *a)
{
    size_t n = 0, columns = 0;
    for (size_t i = 0; i < t->n; i++) {
        uint32_t at = by_column[i], row = t->row[at], column = t->column[at];
        while (columns <= column) a->start[columns++] = (int)n;
        if (n > (size_t)a->start[column] && a->row[n - 1] == (int)row) a->value[n - 1] += t->value[at];
        else a->row[n] = (int)row, a->value[n] = t->value[at], n++;
    }
    while (columns <= a->n) a->start[columns++] = (int)n;
}

int vgi_triplets_sum(const vgi_triplets *t, size_t rows, vgi_sparse *a, vg_err *e)
{
    *a = (vgi_sparse){.n = rows};
    if (t->n > INT32_MAX) return vg_fail(e, VG_EINPUT, "a mesh of %zu matrix entries is too large", t->n);
    uint32_t *first = vgi_array_raw(rows + 1, sizeof *first, e), *by_row = vgi_array_raw(t->n, sizeof *by_row, e);
    uint32_t *by_column = vgi_array_raw(t->n, sizeof *by_column, e);
    a->start = vgi_array_raw(rows + 1, sizeof *a->start, e);
    a->row = vgi_array_raw(t->n, sizeof *a->row, e);
    a->value = vgi_array_raw(t->n, sizeof *a->value, e);
    int r = first && by_row && by_column && a->start && a->row && a->value ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        sort_entries(t->n, t->row, rows, NULL, first, by_row);
        sort_entries(t->n, t->column, rows, by_row, first, by_column);
        sum_sorted(t, by_column, a);
    } else {
        vgi_sparse_clear(a);
    }
    free(first);
    free(by_row);
    free(by_column);
    return r;
}

/* ---- factorisation ---- */

/* a as a CHOLMOD matrix, borrowed. */
static cholmod_sparse cholmod_view(const vgi_sparse *a)
{
    return (cholmod_sparse){.nrow = a->n, .ncol = a->n, .nzmax = (size_t)a->start[a->n], .p = a->start, .i = a->row,
                            .x = a->value, .stype = -1, .itype = CHOLMOD_INT, .xtype = CHOLMOD_REAL,
                            .dtype = CHOLMOD_DOUBLE, .sorted = 1, .packed = 1};
}

/* Allocate everything that a solve needs, because CHOLMOD 3.0 does not survive a failed allocation there. */
static bool make_workspace(vgi_cholesky *c)
{
    size_t n = c->L->n, rows = c->L->maxesize ? c->L->maxesize : 1;
    if (c->b && c->x && c->y && c->e) return true; /* complete from the second solve on */
    free(c->b);
    cholmod_free_dense(&c->x, &c->common);
    cholmod_free_dense(&c->y, &c->common);
    cholmod_free_dense(&c->e, &c->common);
    c->b = vgi_array_raw(n, 3 * sizeof *c->b, NULL);
    c->x = cholmod_allocate_dense(n, 3, n, CHOLMOD_REAL, &c->common);
    c->y = cholmod_allocate_dense(n, 3, n, CHOLMOD_REAL, &c->common);
    c->e = cholmod_allocate_dense(rows, 3, rows, CHOLMOD_REAL, &c->common);
    return c->b && c->x && c->y && c->e;
}

int vgi_cholesky_new(vgi_cholesky **out, const vgi_sparse *a, int *order, vg_err *e)
{
    vgi_cholesky *c = *out = vgi_array(1, sizeof *c, e);
    if (!c) return VG_ENOMEM;
    cholmod_start(&c->common);
    c->common.print = 0;
    c->common.error_handler = NULL;
    c->common.nmethods = 1;
    c->common.method[0].ordering = order ? CHOLMOD_GIVEN : a->n < SMALL ? CHOLMOD_AMD : CHOLMOD_METIS;
    c->common.postorder = 1;
    c->common.supernodal = CHOLMOD_SUPERNODAL;
    cholmod_sparse A = cholmod_view(a);
    int before = begin_alone();
    c->L = cholmod_analyze_p(&A, order, NULL, 0, &c->common);
    end_alone(before);
    if (c->L && (c->block = vgi_array(c->L->nsuper, sizeof *c->block, NULL))) return VG_OK;
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
    free(c->block);
    free(c);
    *out = NULL;
}

int vgi_cholesky_factorize(vgi_cholesky *c, const vgi_sparse *a, vg_err *e)
{
    cholmod_sparse A = cholmod_view(a);
    int before = begin_alone();
    cholmod_factorize(&A, c->L, &c->common);
    end_alone(before);
    if (c->common.status == CHOLMOD_OUT_OF_MEMORY)
        return vg_fail(e, VG_ENOMEM, "not enough memory to factorize %zu unknowns", a->n);
    if (c->common.status != CHOLMOD_OK || c->L->minor != c->L->n)
        return vg_fail(e, VG_EINPUT, "cannot factorize: not positive definite at row %zu", c->L->minor);
    for (size_t s = 0; s < c->L->nsuper; s++)
        c->block[s] = (const double *)c->L->x + ((const int *)c->L->px)[s];
    return VG_OK;
}

int vgi_cholesky_solve(vgi_cholesky *c, double *x, vg_err *e)
{
    size_t n = c->L->n;
    if (!make_workspace(c)) return vg_fail(e, VG_ENOMEM, "not enough memory to solve for %zu unknowns", n);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 3; k++) c->b[k * n + i] = x[3 * i + k];
    cholmod_dense B = {
        .nrow = n, .ncol = 3, .nzmax = 3 * n, .d = n, .x = c->b, .xtype = CHOLMOD_REAL, .dtype = CHOLMOD_DOUBLE};
    int before = begin_alone();
    int done = cholmod_solve2(CHOLMOD_A, c->L, &B, NULL, &c->x, NULL, &c->y, &c->e, &c->common);
    end_alone(before);
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

vgi_factor vgi_cholesky_factor(const vgi_cholesky *c)
{
    const cholmod_factor *L = c->L;
    return (vgi_factor){L->n, L->nsuper, L->super, L->pi, L->s, c->block};
}

const int *vgi_cholesky_order(const vgi_cholesky *c)
{
    return c->L->Perm;
}
