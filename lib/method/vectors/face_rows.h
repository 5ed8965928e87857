/* face_rows.h: the faces of a graph as rows of a solver's factor, in the order of those rows.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FACE_ROWS_H
#define VG_FACE_ROWS_H

#include "method/vectors/metric.h"
#include "numeric/solve_kernel.h"

/* The inside of a vg_solver, borrowed from it. */
typedef struct vgi_solver_view {
    const vg_graph *g;
    const vgi_metric *metric; /* its face is NULL: uniform */
    const vgi_factor *factor; /* of the plain normal matrix, over the rows */
    const uint32_t *row;      /* nv: row of a vertex; >= rows: held or isolated */
    size_t rows;              /* of vertices and of centroids that are unknowns */
    bool anchored;            /* held are the anchors; else one vertex that is no better than the others */
    int threads;
} vgi_solver_view;

vgi_solver_view vgi_solver_look(const vg_solver *s);
/* vgi_solver_is_star: the centroid of face f is an unknown of its own; its metric is the weight alone. */
bool vgi_solver_is_star(const vg_solver *s, size_t f);
/* vgi_solver_place: move a pose to its place: its first anchor to `anchor`, or its mean to `root`; anchors and isolated
 * vertices are set. */
void vgi_solver_place(const vg_solver *s, double *x, const double *anchor, const double *root);

/* The faces of at least a given number of corners, sorted by their least row for the sake of the cache. Held vertices
 * get the rows after those of the factor, in ascending order. */
typedef struct vgi_face_rows {
    size_t nheld, nf;
    uint32_t *held; /* nheld vertices that are in a face and have no row */
    uint32_t *face; /* nf faces of the graph, ascending */
    uint32_t *order; /* place of face[i] in the sorted order */
    uint32_t *start, *row; /* in the sorted order: corners of a face are row[start[i]] .. row[start[i + 1] - 1] */
} vgi_face_rows;

int vgi_face_rows_make(vgi_face_rows *f, const vgi_solver_view *s, size_t least_corners, vg_err *e) VG_MUST_CHECK;
void vgi_face_rows_clear(vgi_face_rows *f);

/* vgi_keep_root: move the attached vertices of x until their mean is `root`. */
void vgi_keep_root(const vg_graph *g, double *x, const double root[3]);

#endif
