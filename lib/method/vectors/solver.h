/* solver.h: internals of vg_solver, for the files that build one and solve with it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SOLVER_H
#define VG_SOLVER_H

#include "method/vectors/face_rows.h"
#include "method/vectors/guess.h"
#include "numeric/fronts.h"

#define NO_ROW UINT32_MAX

/* Data shared by the solvers derived from one base solver. All rows are those of its factor, in its order, followed
 * by the vertex that it holds at 0 if it has no anchors. */
typedef struct vgi_sharing {
    vgi_fronts *fronts; /* NULL without rows */
    vgi_point *points;  /* threads * rows */
} vgi_sharing;

struct vg_solver {
    const vg_graph *g;
    int threads;
    size_t unknowns;  /* attached vertices that are not anchors, then centroids */
    size_t vertices_unknown;
    uint32_t pinned;  /* without anchors: the vertex held at 0 */
    uint32_t *row;    /* nv: row in the factor's order; NO_ROW if held or isolated */
    vgi_metric metric;
    size_t nsteps;
    vgi_step *walk;       /* from the held vertices to all others */
    uint32_t *anchors;
    size_t nanchors;  /* given by the caller; 0: one vertex is pinned */
    size_t nisolated;
    uint32_t *isolated;
    double *isolated_at;
    vgi_sparse matrix; /* over the vertices that are not held, in order, then centroids; kept for derived solvers */
    vgi_cholesky *cholesky;
    vgi_factor factor;
    vgi_row *x;       /* threads * unknowns */
    vgi_point *spare; /* for vg_solver_load: nv + max_corners per thread */
    vg_solver_stats stats;
    vgi_sharing *sharing; /* shared with derived solvers; NULL: none yet */
    const vg_solver *like; /* NULL, or the base solver, which provides graph, metric, walk, isolated vertices and
                              workspace */
    vgi_held_factor held;  /* with `like`: instead of `cholesky` */
};

double vgi_solver_seconds(void);
/* vgi_solver_all_rows: number of all rows, as above. */
static inline size_t vgi_solver_all_rows(const vg_solver *s)
{
    return s->unknowns + (s->pinned < s->g->faces.nv);
}

void *vgi_solver_for_threads(const vg_solver *s, size_t n, size_t size, vg_err *e);
void vgi_sharing_free(vgi_sharing **x);
/* vgi_solver_solve_like: vg_solver_solve for n poses of a derived solver s; s NULL: pose i uses each[i]. */
void vgi_solver_solve_like(size_t n, const vg_solver *s, vg_solver *const *each, const double *const *rhs,
                           double *const *x, const double *const *anchors, const double *const *roots);
/* vgi_solver_solve_lane: to := N^-1 from in one lane, over all rows of s or its base solver; 0 at vertices that s
 * holds. points: workspace of as many. */
void vgi_solver_solve_lane(const vg_solver *s, size_t lane, const vgi_row *from, vgi_row *to, vgi_point *points);

#endif
