/* metric.h: weights of the differences of a face's corners in the reconstruction (MATH 2, Weights).
 *
 * The energy of a face is tr((X - W*) G (X - W*)') with G = weight (I - 11'/r) + R' S R, R the 3 x r reference
 * vectors in the face's plane. Uniform: weight 1, S 0, the projector of the printed energy. Area: the metric of the
 * surface, on triangles that are not thin the cotangent Laplacian. G is positive semidefinite and its null space
 * contains translations only, so that consistent vectors are reproduced exactly for any weights.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_METRIC_H
#define VG_METRIC_H

#include "core/core.h"

typedef struct vgi_face_metric {
    double weight;
    double s[6]; /* xx xy xz yy yz zz */
} vgi_face_metric;

typedef struct vgi_metric {
    vgi_face_metric *face; /* per face; NULL: uniform */
    double *plane;         /* 3 per corner: its reference vector in the plane of its face */
} vgi_metric;

/* vgi_metric_make: the area metric of a graph in its reference pose (nv points). Segments and links have weight 1; a
 * face without extent is uniform; weights of thin faces are bounded on both sides. */
int vgi_metric_make(vgi_metric *m, const vg_graph *g, const double *reference, vg_err *e) VG_MUST_CHECK;
void vgi_metric_clear(vgi_metric *m);
/* vgi_metric_entry: entry of G of face f for its corners p and q. */
double vgi_metric_entry(const vgi_metric *m, const vg_graph *g, size_t f, size_t p, size_t q);
double vgi_metric_weight(const vgi_metric *m, size_t f);

#endif
