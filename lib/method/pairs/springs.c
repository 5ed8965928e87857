/* springs.c: the graph Laplacian of a polygon mesh, and the entries of the matrices of its two smoothness terms. They
 * are used in fit.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/springs.h"

#include <stdlib.h>

enum { HUB = 100 }; /* number of neighbours */
static const double SHORTEST = 0.05; /* relative to the mean: springs do not get stronger below */

/* Springs between all corners of a small face; in a large one along edges, to the second neighbours, and across. */
static int add_face(vgi_edges *l, const uint32_t *vert, size_t size, vg_err *e)
{
    int r = VG_OK;
    if (size <= VGI_SMALL_FACE) {
        for (size_t i = 1; i < size && r == VG_OK; i++)
            for (size_t j = 0; j < i && r == VG_OK; j++) r = vgi_edges_add(l, vert[i], vert[j], 1.0 / (double)size, 0, e);
        return r;
    }
    for (size_t i = 0; i < size && r == VG_OK; i++) {
        r = vgi_edges_add(l, vert[i], vert[(i + 1) % size], 0.25, 0, e);
        if (r == VG_OK) r = vgi_edges_add(l, vert[i], vert[(i + 2) % size], 0.125, 0, e);
        if (r == VG_OK && i < size / 2) r = vgi_edges_add(l, vert[i], vert[i + size / 2], 0.125, 0, e);
    }
    return r;
}

static int gather_springs(vgi_edges *l, const vgi_fitting *in, vg_err *e)
{
    const vg_mesh *m = in->source;
    int r = VG_OK;
    for (size_t f = 0; f < m->nf && r == VG_OK; f++)
        r = add_face(l, m->vert + m->start[f], m->start[f + 1] - m->start[f], e);
    for (size_t i = 0; i < in->nlinks && r == VG_OK; i++)
        r = vgi_edges_add(l, in->links[2 * i], in->links[2 * i + 1], 0.5, 0, e);
    /* points joined by a tie have an entry in the matrix, without a spring */
    for (size_t i = 0; i < in->nties; i++)
        for (int k = 0; k < 3 && r == VG_OK; k++) {
            uint32_t a = in->tie[i].vertex[k], b = in->tie[i].vertex[(k + 1) % 3];
            if (a != b) r = vgi_edges_add(l, a, b, 0, 0, e);
        }
    return r;
}

/* The strength of a spring is one over its length: otherwise the surface is softer where its vertices are dense. */
static void divide_by_lengths(vgi_edges *l, const double *rest)
{
    double sum = 0, weight = 0;
    for (size_t i = 0; i < l->n; i++) {
        sum += l->at[i].weight * sqrt(vgi_square(rest + 3 * (size_t)l->at[i].a, rest + 3 * (size_t)l->at[i].b));
        weight += l->at[i].weight;
    }
    for (size_t i = 0; i < l->n && sum > 0; i++) {
        double length = sqrt(vgi_square(rest + 3 * (size_t)l->at[i].a, rest + 3 * (size_t)l->at[i].b));
        l->at[i].weight /= fmax(length * weight / sum, SHORTEST);
    }
}

int vgi_springs_make(vgi_laplacian *L, const vgi_fitting *in, vg_err *e)
{
    vgi_edges list = {0};
    int r = gather_springs(&list, in, e);
    if (r == VG_OK) divide_by_lengths(&list, in->rest);
    if (r == VG_OK) return vgi_laplacian_make(L, in->source->nv, &list, e);
    vgi_edges_clear(&list);
    *L = (vgi_laplacian){0};
    return r;
}

/* ---- smoothness ---- */

bool vgi_is_hub(const vgi_laplacian *L, size_t v)
{
    return L->first[v + 1] - L->first[v] >= HUB;
}

static int compare_ints(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return x < y ? -1 : x > y;
}

/* Rows >= column of the column's neighbours' neighbours, ascending. mark[v] == column + 1: seen. */
static size_t column_rows(const vgi_laplacian *L, uint32_t column, int *rows, uint32_t *mark)
{
    size_t n = 0;
    mark[column] = column + 1, rows[n++] = (int)column;
    for (uint32_t i = L->first[column]; i <= L->first[column + 1]; i++) {
        uint32_t k = i < L->first[column + 1] ? L->to[i] : column; /* the column itself is appended last */
        if (k != column && vgi_is_hub(L, k)) continue;
        for (uint32_t j = L->first[k]; j < L->first[k + 1]; j++) {
            uint32_t v = L->to[j];
            if (v <= column || mark[v] == column + 1) continue;
            mark[v] = column + 1, rows[n++] = (int)v;
        }
    }
    qsort(rows, n, sizeof *rows, compare_ints);
    return n;
}

static int make_pattern(vgi_smoothness *s, const vgi_laplacian *L, vg_err *e)
{
    vgi_sparse *A = &s->matrix;
    size_t cap = 0, n = 0, nv = L->nv;
    uint32_t *mark = vgi_array(nv, sizeof *mark, e);
    int *rows = vgi_array_raw(nv, sizeof *rows, e);
    A->n = nv;
    A->start = vgi_array(nv + 1, sizeof *A->start, e);
    int r = mark && rows && A->start ? VG_OK : VG_ENOMEM;
    for (size_t j = 0; j < nv && r == VG_OK; j++) {
        size_t k = column_rows(L, (uint32_t)j, rows, mark);
        if (n + k > INT32_MAX) r = vg_fail(e, VG_EINPUT, "a mesh of %zu vertices is too large to be fitted", nv);
        else r = vgi_grow(&A->row, &cap, n + k, sizeof *A->row, e);
        if (r == VG_OK) memcpy(A->row + n, rows, k * sizeof *rows);
        n += k;
        A->start[j + 1] = (int)n;
    }
    free(mark);
    free(rows);
    if (r < 0) return r;
    A->value = vgi_array(n, sizeof *A->value, e);
    s->bending = vgi_array(n, sizeof *s->bending, e);
    s->stretching = vgi_array(n, sizeof *s->stretching, e);
    return A->value && s->bending && s->stretching ? VG_OK : VG_ENOMEM;
}

/* L_ij with L_ii = sum */
static void fill_column(const vgi_laplacian *L, size_t j, double *bend, double *stretch)
{
    stretch[j] = L->sum[j];
    for (uint32_t i = L->first[j]; i <= L->first[j + 1]; i++) {
        bool self = i == L->first[j + 1];
        size_t k = self ? j : L->to[i];
        double a = self ? L->sum[j] : -L->weight[i];
        if (!self) stretch[k] = -L->weight[i];
        if (!(L->sum[k] > 0) || vgi_is_hub(L, k)) continue;
        a /= L->sum[k];
        bend[k] += a * L->sum[k];
        for (uint32_t p = L->first[k]; p < L->first[k + 1]; p++) bend[L->to[p]] -= a * L->weight[p];
    }
}

static int fill_matrices(vgi_smoothness *s, const vgi_laplacian *L, vg_err *e)
{
    const vgi_sparse *A = &s->matrix;
    double *bend = vgi_array(L->nv, sizeof *bend, e), *stretch = vgi_array(L->nv, sizeof *stretch, e);
    if (!bend || !stretch) return free(bend), free(stretch), VG_ENOMEM;
    for (size_t j = 0; j < L->nv; j++) {
        fill_column(L, j, bend, stretch);
        for (int i = A->start[j]; i < A->start[j + 1]; i++)
            s->bending[i] = bend[A->row[i]], s->stretching[i] = stretch[A->row[i]];
        for (uint32_t i = L->first[j]; i <= L->first[j + 1]; i++) {
            size_t k = i < L->first[j + 1] ? L->to[i] : j;
            bend[k] = stretch[k] = 0;
            if (vgi_is_hub(L, k)) continue;
            for (uint32_t p = L->first[k]; p < L->first[k + 1]; p++) bend[L->to[p]] = 0;
        }
    }
    free(bend);
    free(stretch);
    return VG_OK;
}

int vgi_smoothness_make(vgi_smoothness *s, const vgi_laplacian *L, vg_err *e)
{
    *s = (vgi_smoothness){0};
    int r = make_pattern(s, L, e);
    if (r == VG_OK) r = fill_matrices(s, L, e);
    if (r < 0) vgi_smoothness_clear(s);
    return r;
}

void vgi_smoothness_clear(vgi_smoothness *s)
{
    vgi_sparse_clear(&s->matrix);
    free(s->bending);
    free(s->stretching);
    *s = (vgi_smoothness){0};
}
