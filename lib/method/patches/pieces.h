/* pieces.h: labelled faces: connected pieces, adjacent labels, and the points where they meet.
 * Internal. Faces that share a vertex are connected. label: per face of the mesh.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PIECES_H
#define VG_PIECES_H

#include "core/core.h"

/* vgi_connected_pieces: piece[f]: connected pieces of faces with one label, numbered in the order of their first
 * faces. Labels are less than nlabels. */
int vgi_connected_pieces(const vg_mesh *m, const uint32_t *label, size_t nlabels, uint32_t *piece, size_t *count,
                         vg_err *e) VG_MUST_CHECK;

/* vgi_neighbours: pairs a < b of labels that share vertices, ascending, and the number of vertices that each pair
 * shares. At most 32 labels are examined around one vertex. Release both with free(). */
int vgi_neighbours(const vg_mesh *m, const uint32_t *label, uint32_t (**pair)[2], uint32_t **shared, size_t *count,
                   vg_err *e) VG_MUST_CHECK;

/* vgi_shared_points: for n such pairs (two labels each) the mean of their shared vertices. points: nv points; mean: n
 * points. */
int vgi_shared_points(const vg_mesh *m, const uint32_t *label, const uint32_t *pairs, size_t n, const double *points,
                      double *mean, vg_err *e) VG_MUST_CHECK;

#endif
