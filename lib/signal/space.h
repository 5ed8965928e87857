/* space.h: poses as vectors of numbers whose linear combinations are shapes: rotations and stretches of corners or
 * triangles, or relations between neighbouring triangles (MATH 11, shape spaces). Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_SPACE_H
#define VG_SIGNAL_SPACE_H

#include "signal/pieces.h"

typedef struct vgi_relative vgi_relative;

/* One of the spaces other than VG_SPACE_VERTICES, for one graph. */
typedef struct vgi_space {
    vg_space kind;
    const vg_graph *g;
    vgi_pieces pieces;
    size_t d;             /* numbers of a shape */
    size_t nodes;         /* vectors: faces; otherwise pieces: the elements with a rotation */
    double *node_share;   /* nodes: shares of the surface */
    double *vectors;      /* of the reference: 3 per corner */
    double *edges;        /* of the reference: 6 per piece */
    double *inverse;      /* gradients, rotations: 9 per piece: inverse of its reference frame; zeros if it has none */
    vgi_relative *relative; /* rotations, lengths */
    double *moved;        /* workspace: 6 per piece */
} vgi_space;

int vgi_space_make(vgi_space *s, vg_space kind, const vg_graph *g, const double *reference, vg_err *e) VG_MUST_CHECK;
void vgi_space_clear(vgi_space *s);
/* vgi_space_homes: the number of homes of rotations; 0 if neighbours are measured against each other. */
size_t vgi_space_homes(const vgi_space *s);

/* vgi_space_measure: n poses (n x 3 nv) become values (n x d). home: vgi_space_homes unit quaternions, out. jumps:
 * number of pairs of neighbours, over all frames, whose rotations differ by more than 180 degrees. */
int vgi_space_measure(const vgi_space *s, const double *reference, size_t n, const double *poses, double *values,
                      double *home, size_t *jumps, int threads, vg_err *e) VG_MUST_CHECK;
/* vgi_space_vectors: the vectors of the graph's corners for a shape. Not thread-safe for one space. */
int vgi_space_vectors(vgi_space *s, const double *home, const double *values, double *vectors, vg_err *e) VG_MUST_CHECK;

/* ---- space_relative.c: rotations and lengths ---- */

/* vgi_space_stretch_at: index in a shape's values of the six numbers of the stretch of piece i. */
static inline size_t vgi_space_stretch_at(const vgi_space *s, size_t i)
{
    return s->kind == VG_SPACE_GRADIENTS ? 9 * i + 3 : 3 * s->pieces.npairs + 6 * i;
}
/* vgi_triangle_axes: the direction of the first edge, the direction perpendicular to it in the triangle, and the
 * normal, as columns. False if the triangle (its two edges) has no normal. */
bool vgi_triangle_axes(const double edges[6], double m[9]);

int vgi_relative_make(vgi_space *s, const double *reference, vg_err *e) VG_MUST_CHECK;
void vgi_relative_free(vgi_relative **r);
/* vgi_relative_lengths: the values that depend on a single pose (lengths: edges and angles of neighbours). */
void vgi_relative_lengths(const vgi_space *s, const double *pose, double *values);
/* vgi_relative_finish: the other values, from the rotations of the pieces (n x 4 per piece) in all poses. */
void vgi_relative_finish(const vgi_space *s, size_t n, const double *turns, double *values, size_t *jumps);
/* vgi_relative_edges: the edges of the pieces of a shape, written to s->moved. */
int vgi_relative_edges(vgi_space *s, const double *values, vg_err *e) VG_MUST_CHECK;

/* vgi_stretch_get: the stretch m from six numbers of a symmetric matrix minus the identity, weighted so that their sum of squares
 * is that of the matrix. */
void vgi_stretch_get(const double in[6], double weight, double m[9]);

#endif
