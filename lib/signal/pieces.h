/* pieces.h: the surface of a vector graph cut into triangles (each face a fan) and line segments, with their
 * neighbours. Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SIGNAL_PIECES_H
#define VG_SIGNAL_PIECES_H

#include "core/core.h"

enum { VGI_NO_EDGE = 0xffffffff };

/* Two neighbouring pieces. */
typedef struct vgi_neighbours {
    uint32_t a, b;
    uint32_t from, to; /* the vertices of the shared edge; VGI_NO_EDGE: they share only a vertex */
} vgi_neighbours;

typedef struct vgi_pieces {
    const vg_graph *g;
    size_t n;
    uint32_t *face;   /* n: the face of the graph that contains each piece */
    uint32_t *first;  /* nf + 1: the pieces of each face */
    uint32_t *apex;   /* nf: index, within the face, of the corner that all triangles of the fan share */
    uint32_t *vert;   /* 3 per piece; the third of a segment is VGI_NO_EDGE */
    double *share;    /* n: shares of the surface; their sum is 1, and none is 0 */
    size_t parts;     /* number of connected components: 1 if links join the graph */
    size_t npairs;    /* these connect all pieces that the graph connects */
    vgi_neighbours *pair;
} vgi_pieces;

/* vgi_pieces_make: g is borrowed; reference: nv points, not kept. */
int vgi_pieces_make(vgi_pieces *p, const vg_graph *g, const double *reference, vg_err *e) VG_MUST_CHECK;
void vgi_pieces_clear(vgi_pieces *p);
static inline bool vgi_is_triangle(const vgi_pieces *p, size_t i)
{
    return p->vert[3 * i + 2] != VGI_NO_EDGE;
}
/* vgi_piece_edges: vectors from the first vertex of piece i to the second, and (triangles) to the third. */
void vgi_piece_edges(const vgi_pieces *p, size_t i, const double *vertices, double first[3], double second[3]);
/* vgi_piece_frame: the two edges and the unit normal of a triangle as the columns of m. False if it has no normal; m
 * is then not set. */
bool vgi_piece_frame(const double first[3], const double second[3], double m[9]);
/* A side of a piece: edge `at` % 3 of piece `at` / 3, from this vertex to the next one. */
typedef struct vgi_piece_side {
    uint32_t low, high, at;
} vgi_piece_side;
/* vgi_pieces_sides: all sides (at most 3 per piece), grouped by their vertices; returns their number. */
size_t vgi_pieces_sides(const vgi_pieces *p, vgi_piece_side *sides);
/* vgi_pieces_vectors: the vectors of the graph's corners from the two edges of each piece (6 numbers). The edge
 * shared by two triangles of a fan is averaged. */
void vgi_pieces_vectors(const vgi_pieces *p, const double *edges, double *vectors);

#endif
