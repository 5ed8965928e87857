/* rings.h: precomputed data of a mesh's reference pose for its features: triangles, the weighted edges around each
 * vertex, components with their centres, and the factor of the reconstruction (MATH 12). Internal. Poses are measured
 * in feature_kernel.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RINGS_H
#define VG_RINGS_H

#include "numeric/sparse.h"

enum { VGI_NO_PART = -1 };

typedef struct vgi_rings {
    size_t nv, ntriangles, nparts; /* nparts: connected components of the vertices that are in a face */
    uint32_t *triangle;            /* 3 each; polygons are fans */
    /* The edges of vertex v are first[v] .. first[v + 1] - 1; both directions of an edge are listed. */
    uint32_t *first, *to;
    double *weight;   /* per edge: half the sum of the two cotangents, clamped; 1 for a line segment */
    double *edge;     /* 3 each: r_v - r_to in the reference */
    double *gradient; /* 3 each: weight M^-1 (r_v - r_to): D_v = sum (p_v - p_to) gradient' + n_v across_v' */
    double *across;   /* 3 per vertex: w_n M^-1 n, n the unit normal in the reference */
    double *open;     /* 9 per vertex: projector onto directions that the ring does not determine; see is_open */
    bool *is_open;    /* the ring and its normal do not span space */
    size_t nopen;
    int *part;        /* per vertex: its component, VGI_NO_PART if it is in no face */
    size_t *part_size;
    uint32_t *centre; /* per component: the vertex with the smallest distance, along edges, to its farthest vertex */
    size_t main_part; /* index of the largest */
    size_t nball;
    uint32_t *ball;   /* the vertices around the centre of the largest component, which determine the root's
                         rotation */
    double *reference; /* nv points */
    vgi_cholesky *cholesky; /* of the weighted Laplacian, with one pinned vertex in each component */
    vgi_factor factor;
    uint32_t *row;     /* per vertex: its row of the factor; UINT32_MAX if it is in no face */
} vgi_rings;

/* vgi_rings_make: VG_EINPUT if there are no faces. reference: nv points, copied. */
int vgi_rings_make(vgi_rings *r, const vg_mesh *m, const double *reference, vg_err *e) VG_MUST_CHECK;
void vgi_rings_clear(vgi_rings *r);

#endif
