/* laplacian.c: the graph Laplacian of weighted edges.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/laplacian.h"
#include "numeric/vec3.h"

#include <stdlib.h>

int vgi_edges_add(vgi_edges *edges, uint32_t a, uint32_t b, double weight, uint8_t kind, vg_err *e)
{
    int r = vgi_grow(&edges->at, &edges->cap, edges->n + 1, sizeof *edges->at, e);
    if (r == VG_OK) edges->at[edges->n++] = (struct vgi_edge){a, b, kind, weight};
    return r;
}

void vgi_edges_clear(vgi_edges *edges)
{
    free(edges->at);
    *edges = (vgi_edges){0};
}

static int compare_edges(const void *a, const void *b)
{
    const struct vgi_edge *x = a, *y = b;
    if (x->a != y->a) return x->a < y->a ? -1 : 1;
    if (x->b != y->b) return x->b < y->b ? -1 : 1;
    return x->weight < y->weight ? -1 : x->weight > y->weight; /* sums must not depend on the sort order */
}

static int add_reverses(vgi_edges *edges, vg_err *e)
{
    int r = VG_OK;
    if (edges->n > INT32_MAX / 2) return vg_fail(e, VG_EINPUT, "a mesh of %zu edges is too large", edges->n);
    for (size_t i = 0, n = edges->n; i < n && r == VG_OK; i++) {
        struct vgi_edge x = edges->at[i];
        r = vgi_edges_add(edges, x.b, x.a, x.weight, x.kind, e);
    }
    return r;
}

static void merge_edges(vgi_laplacian *L, const vgi_edges *edges)
{
    size_t to = 0;
    for (size_t i = 0; i < edges->n; i++) {
        const struct vgi_edge *x = &edges->at[i];
        L->sum[x->a] += x->weight;
        if (i && x[-1].a == x->a && x[-1].b == x->b) {
            L->weight[to - 1] += x->weight, L->kinds[to - 1] |= x->kind;
            continue;
        }
        L->to[to] = x->b, L->kinds[to] = x->kind, L->weight[to++] = x->weight;
        L->first[x->a + 1]++;
    }
    for (size_t v = 0; v < L->nv; v++) L->first[v + 1] += L->first[v];
}

int vgi_laplacian_make(vgi_laplacian *L, size_t nv, vgi_edges *edges, vg_err *e)
{
    *L = (vgi_laplacian){.nv = nv};
    int r = add_reverses(edges, e);
    if (r == VG_OK) {
        L->first = vgi_array(nv + 1, sizeof *L->first, e);
        L->to = vgi_array_raw(edges->n, sizeof *L->to, e);
        L->weight = vgi_array_raw(edges->n, sizeof *L->weight, e);
        L->kinds = vgi_array_raw(edges->n, sizeof *L->kinds, e);
        L->sum = vgi_array(nv, sizeof *L->sum, e);
        if (!L->first || !L->to || !L->weight || !L->kinds || !L->sum) r = VG_ENOMEM;
    }
    if (r == VG_OK) {
        if (edges->n) qsort(edges->at, edges->n, sizeof *edges->at, compare_edges);
        merge_edges(L, edges);
    }
    vgi_edges_clear(edges);
    if (r < 0) vgi_laplacian_clear(L);
    return r;
}

void vgi_laplacian_clear(vgi_laplacian *L)
{
    free(L->first);
    free(L->to);
    free(L->weight);
    free(L->kinds);
    free(L->sum);
    *L = (vgi_laplacian){0};
}

void vgi_laplacian_apply(const vgi_laplacian *L, const double *x, double *y)
{
    for (size_t v = 0; v < L->nv; v++) {
        double *to = y + 3 * v;
        const double *at = x + 3 * v;
        to[0] = to[1] = to[2] = 0;
        for (uint32_t i = L->first[v]; i < L->first[v + 1]; i++) {
            double way[3];
            vgi_subtract(at, x + 3 * (size_t)L->to[i], way);
            vgi_add_scaled(to, L->weight[i], way);
        }
    }
}
