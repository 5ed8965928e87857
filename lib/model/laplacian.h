/* laplacian.h: the weighted neighbours of each vertex: a graph Laplacian, (L x)_v = sum of weight (x_v - x_to).
 * Internal. Edges and weights come from the caller: cotangents from net/rings.c, polygons from pairs/springs.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_LAPLACIAN_H
#define VG_LAPLACIAN_H

#include "core/core.h"

/* Neighbours of vertex v are to[first[v]] .. to[first[v + 1] - 1], ascending. Both directions of an edge are listed. */
typedef struct vgi_laplacian {
    size_t nv;
    uint32_t *first, *to; /* first: nv + 1 */
    double *weight;       /* per entry */
    uint8_t *kinds;       /* per entry: the kinds of the edges merged into it, or-ed */
    double *sum;          /* nv: L_vv, the weights of v's edges; 0 for a vertex without neighbours */
} vgi_laplacian;

/* Edges in any order. */
typedef struct vgi_edges {
    size_t n, cap;
    struct vgi_edge {
        uint32_t a, b;
        uint8_t kind; /* a bit, or 0 */
        double weight;
    } *at;
} vgi_edges;

int vgi_edges_add(vgi_edges *edges, uint32_t a, uint32_t b, double weight, uint8_t kind, vg_err *e) VG_MUST_CHECK;
void vgi_edges_clear(vgi_edges *edges);

/* vgi_laplacian_make: from nv vertices and these edges, which are cleared. Edges between the same vertices are merged
 * by adding their weights. VG_EINPUT if there are too many; *L is 0 on failure. O(n log n) for n edges. */
int vgi_laplacian_make(vgi_laplacian *L, size_t nv, vgi_edges *edges, vg_err *e) VG_MUST_CHECK;
void vgi_laplacian_clear(vgi_laplacian *L);
/* vgi_laplacian_apply: y = L x, nv points */
void vgi_laplacian_apply(const vgi_laplacian *L, const double *x, double *y);

#endif
