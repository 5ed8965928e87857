/* planar.h: what the search for planar faces sees of a solver.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PLANAR_H
#define VG_PLANAR_H

#include "numeric/solve_kernel.h"

/* The inside of a vg_solver, borrowed from it. */
typedef struct vgi_solver_view {
    const vg_graph *g;
    const vgi_factor *factor; /* of the plain normal matrix, over the rows */
    const uint32_t *row;      /* nv: row of a vertex; >= rows: held or isolated */
    size_t rows;              /* of vertices and of centroids that are unknowns */
    bool anchored;            /* held are the anchors; else one vertex that is no better than the others */
    int threads;
} vgi_solver_view;

vgi_solver_view vgi_solver_look(const vg_solver *s);

#endif
