/* face_rows.h: the faces of a graph as rows of a solver's factor, in row order.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_FACE_ROWS_H
#define VG_FACE_ROWS_H

#include "method/vectors/metric.h"
#include "numeric/solve_kernel.h"

/* Internals of a vg_solver, borrowed from it. */
typedef struct vgi_solver_view {
    const vg_graph *g;
    const vgi_metric *metric; /* uniform if its face is NULL */
    const vgi_factor *factor; /* of the plain normal matrix, over the rows */
    const uint32_t *row;      /* nv: row of a vertex; >= rows if held or isolated */
    size_t rows;              /* number of unknowns: vertices and centroids */
    bool anchored;            /* the anchors are held; otherwise one arbitrary vertex is */
    int threads;
} vgi_solver_view;

vgi_solver_view vgi_solver_look(const vg_solver *s);
/* vgi_solver_is_star: whether the centroid of face f is a separate unknown. Its metric is then the weight alone. */
bool vgi_solver_is_star(const vg_solver *s, size_t f);
/* vgi_solver_place: translate a pose so that its first anchor is at `to`, or without anchors its mean; set the anchors, to
 * the positions from `to` on, and isolated vertices. */
void vgi_solver_place(const vg_solver *s, double *x, const double *to);

/* The faces with at least a given number of corners, sorted by their lowest row for the cache. Held vertices get the
 * rows after those of the factor, in ascending order. */
typedef struct vgi_face_rows {
    size_t nheld, nf;
    uint32_t *held; /* nheld vertices in faces that have no row */
    uint32_t *face; /* nf faces of the graph, ascending */
    uint32_t *order; /* position of face[i] in the sorted order */
    uint32_t *start, *row; /* sorted: the corners of a face are row[start[i]] .. row[start[i + 1] - 1] */
} vgi_face_rows;

int vgi_face_rows_make(vgi_face_rows *f, const vgi_solver_view *s, size_t least_corners, vg_err *e) VG_MUST_CHECK;
void vgi_face_rows_clear(vgi_face_rows *f);

/* vgi_keep_root: translate the attached vertices of x so that their mean is `root`. */
void vgi_keep_root(const vg_graph *g, double *x, const double root[3]);

#endif
