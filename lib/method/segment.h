/* segment.h: what fitting a map needs of segmentation.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SEGMENT_H
#define VG_SEGMENT_H

#include "core/core.h"

/* vgi_connected_pieces: piece[f]: connected pieces of faces of one label, numbered in the order of their first faces;
 * faces that share a vertex hang together. Labels are less than nlabels. */
int vgi_connected_pieces(size_t nv, size_t nf, const uint32_t *start, const uint32_t *vert, const uint32_t *label,
                         size_t nlabels, uint32_t *piece, size_t *count, vg_err *e) VG_MUST_CHECK;
/* vgi_neighbours: pairs a < b of labels that share vertices, ascending,
 * and how many vertices each pair shares. free() both. */
int vgi_neighbours(size_t nv, size_t nf, const uint32_t *start, const uint32_t *vert, const uint32_t *label,
                   uint32_t (**pair)[2], uint32_t **shared, size_t *count, vg_err *e) VG_MUST_CHECK;

#endif
