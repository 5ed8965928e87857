/* rig_sums.h: sums over poses that determine the fit of vertices to the motions of bones. Their size does not depend
 * on the number of poses.
 *
 * In pose k bone j moves a point x to A x + t. With its joint at_j, the matrix T_j = [A, A at_j + t] maps (x - at_j,
 * 1) there. Each pose is relative to its own origin, the centroid of its vertices; this does not change a fit that
 * follows motion of the whole body.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RIG_SUMS_H
#define VG_RIG_SUMS_H

#include "numeric/polar.h"

typedef struct vgi_rig_sums {
    size_t nv, n; /* number of vertices, of bones */
    size_t poses;
    double *at;             /* 3 n: the joints of the bones */
    double *cross;          /* 4 n x 4 n: sum of T_i' T_j */
    double *pull;           /* nv x 4 n: sum of T_j' y */
    double *square;         /* nv: sum of |y|^2 */
    const vgi_turns *turns; /* NULL, or the reference for rotations of faces: */
    double *turn;           /* (3 per face) x 3 n: sum of F' A_j, F the rotation of the face */
    /* workspace */
    double *motions, *turned, *transposed, (*origin)[3];
} vgi_rig_sums;

/* vgi_rig_sums_make: at: 3 n numbers, copied. turns: borrowed until clear. */
int vgi_rig_sums_make(vgi_rig_sums *s, size_t nv, size_t n, const double *at, const vgi_turns *turns,
                      vg_err *e) VG_MUST_CHECK;
void vgi_rig_sums_clear(vgi_rig_sums *s);
/* vgi_rig_sums_restart: forget all poses: the next ones that are added are the first. */
void vgi_rig_sums_restart(vgi_rig_sums *s);
/* vgi_rig_sums_add: any number of poses (nv points) with their transforms (7 n numbers). */
void vgi_rig_sums_add(vgi_rig_sums *s, size_t count, const double *const *poses, const double *const *transforms,
                      int threads);

#endif
