/* springs.c: the graph Laplacian of polygons, and the matrices of its two smoothness terms, entry by entry.
 * Leaves out what is fitted with them (fit.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/springs.h"

#include <stdlib.h>

enum { HUB = 100 }; /* neighbours */

typedef struct spring_list {
    size_t n, cap;
    struct spring {
        uint32_t a, b;
        double weight;
    } *at;
} spring_list;

static int add_spring(spring_list *l, uint32_t a, uint32_t b, double weight, vg_err *e)
{
    int r = vgi_grow(&l->at, &l->cap, l->n + 1, sizeof *l->at, e);
    if (r == VG_OK) l->at[l->n++] = (struct spring){a, b, weight};
    return r;
}

/* Springs between all corners of a small face; in a large one along edges, to the second neighbour, and across. */
static int add_face(spring_list *l, const uint32_t *vert, size_t r, vg_err *e)
{
    int code = VG_OK;
    if (r <= VGI_SMALL_FACE) {
        for (size_t i = 1; i < r && code == VG_OK; i++)
            for (size_t j = 0; j < i && code == VG_OK; j++) code = add_spring(l, vert[i], vert[j], 1.0 / (double)r, e);
        return code;
    }
    for (size_t i = 0; i < r && code == VG_OK; i++) {
        code = add_spring(l, vert[i], vert[(i + 1) % r], 0.25, e);
        if (code == VG_OK) code = add_spring(l, vert[i], vert[(i + 2) % r], 0.125, e);
        if (code == VG_OK && i < r / 2) code = add_spring(l, vert[i], vert[i + r / 2], 0.125, e);
    }
    return code;
}

static int gather_springs(spring_list *l, const vgi_fitting *in, vg_err *e)
{
    const vg_mesh *m = in->source;
    int r = VG_OK;
    for (size_t f = 0; f < m->nf && r == VG_OK; f++)
        r = add_face(l, m->vert + m->start[f], m->start[f + 1] - m->start[f], e);
    for (size_t i = 0; i < in->nlinks && r == VG_OK; i++)
        r = add_spring(l, in->links[2 * i], in->links[2 * i + 1], 0.5, e);
    /* points joined by a tie: an entry in the matrix without a spring */
    for (size_t i = 0; i < in->nties; i++)
        for (int k = 0; k < 3 && r == VG_OK; k++) {
            uint32_t a = in->tie[i].vertex[k], b = in->tie[i].vertex[(k + 1) % 3];
            if (a != b) r = add_spring(l, a, b, 0, e);
        }
    return r;
}

static int compare_springs(const void *a, const void *b)
{
    const struct spring *x = a, *y = b;
    if (x->a != y->a) return x->a < y->a ? -1 : 1;
    if (x->b != y->b) return x->b < y->b ? -1 : 1;
    return x->weight < y->weight ? -1 : x->weight > y->weight; /* sums must not depend on the order of sorting */
}

int vgi_springs_make(vgi_springs *L, const vgi_fitting *in, vg_err *e)
{
    spring_list list = {0};
    int r = gather_springs(&list, in, e);
    size_t n = list.n, nv = in->source->nv;
    *L = (vgi_springs){.nv = nv};
    if (r == VG_OK && n > INT32_MAX / 2)
        r = vg_fail(e, VG_EINPUT, "a mesh of %zu vertices is too large to be fitted", nv);
    for (size_t i = 0; i < n && r == VG_OK; i++)
        r = add_spring(&list, list.at[i].b, list.at[i].a, list.at[i].weight, e);
    L->first = vgi_array(nv + 1, sizeof *L->first, e);
    L->to = vgi_array_raw(list.n, sizeof *L->to, e);
    L->weight = vgi_array_raw(list.n, sizeof *L->weight, e);
    L->sum = vgi_array(nv, sizeof *L->sum, e);
    if (r == VG_OK && !(L->first && L->to && L->weight && L->sum)) r = VG_ENOMEM;
    if (r < 0) {
        vgi_springs_clear(L);
        free(list.at);
        return r;
    }
    if (list.n) qsort(list.at, list.n, sizeof *list.at, compare_springs);
    size_t to = 0;
    for (size_t i = 0; i < list.n; i++) {
        const struct spring *s = &list.at[i];
        if (i && s[-1].a == s->a && s[-1].b == s->b) {
            L->weight[to - 1] += s->weight;
        } else {
            L->to[to] = s->b, L->weight[to++] = s->weight;
            L->first[s->a + 1]++;
        }
        L->sum[s->a] += s->weight;
    }
    for (size_t v = 0; v < nv; v++) L->first[v + 1] += L->first[v];
    free(list.at);
    return VG_OK;
}

void vgi_springs_clear(vgi_springs *L)
{
    free(L->first);
    free(L->to);
    free(L->weight);
    free(L->sum);
    *L = (vgi_springs){0};
}

void vgi_springs_apply(const vgi_springs *L, const double *x, double *y)
{
    for (size_t v = 0; v < L->nv; v++) {
        double *to = y + 3 * v;
        const double *at = x + 3 * v;
        to[0] = to[1] = to[2] = 0;
        for (uint32_t i = L->first[v]; i < L->first[v + 1]; i++) {
            const double *from = x + 3 * (size_t)L->to[i];
            for (int k = 0; k < 3; k++) to[k] += L->weight[i] * (at[k] - from[k]);
        }
    }
}

/* ---- smoothness ---- */

bool vgi_is_hub(const vgi_springs *L, size_t v)
{
    return L->first[v + 1] - L->first[v] >= HUB;
}

static int compare_ints(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return x < y ? -1 : x > y;
}

/* Rows >= column of the column's neighbours' neighbours, ascending. mark[v] == column + 1: seen. */
static size_t column_rows(const vgi_springs *L, uint32_t column, int *rows, uint32_t *mark)
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

static int make_pattern(vgi_smoothness *s, const vgi_springs *L, vg_err *e)
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
static void fill_column(const vgi_springs *L, size_t j, double *bend, double *stretch)
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

static int fill(vgi_smoothness *s, const vgi_springs *L, vg_err *e)
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

int vgi_smoothness_make(vgi_smoothness *s, const vgi_springs *L, vg_err *e)
{
    *s = (vgi_smoothness){0};
    int r = make_pattern(s, L, e);
    if (r == VG_OK) r = fill(s, L, e);
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
