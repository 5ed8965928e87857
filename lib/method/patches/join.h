/* join.h: merges neighbouring pieces that are similar, until a given number is left.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_JOIN_H
#define VG_JOIN_H

#include "core/core.h"

/* Pieces with the mean of a feature over their members, and the pairs of neighbours. */
typedef struct vgi_joining {
    size_t n, width;
    double *mean, *size; /* n x width, and the number of members; merging updates both */
    uint32_t (*pair)[2]; /* npairs pairs of neighbours a < b, without duplicates */
    size_t npairs;
} vgi_joining;

/* vgi_join_pieces: repeatedly merge the two neighbours with the smallest increase of the sum of squared distances
 * from the means (Ward 1963; ties: the pair that comes first), until k pieces are left or none has a neighbour.
 * set[i] (n): the lowest piece of the merged set that contains i. About O(npairs log npairs) steps of O(width). */
int vgi_join_pieces(vgi_joining *j, size_t k, uint32_t *set, vg_err *e) VG_MUST_CHECK;

#endif
