/* join.h: pieces that are joined with neighbours that are alike, until few are left.
 * Internal.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_JOIN_H
#define VG_JOIN_H

#include "core/core.h"

/* Pieces, each with the mean of a feature over its members, and which of them are neighbours. */
typedef struct vgi_joining {
    size_t n, width;
    double *mean, *size; /* n x width, and the number of members; those of joined pieces become those of both */
    uint32_t (*pair)[2]; /* npairs of neighbours a < b, none twice */
    size_t npairs;
} vgi_joining;

/* vgi_join_pieces: again and again join the two neighbours whose union costs the least (Ward 1963: what the sum of
 * squared distances from the means grows by; of several the pair that comes first), until k are left or none has a
 * neighbour. set[i] (n): the lowest piece of those that i is joined with. About O(npairs log npairs) steps, each of
 * O(width). */
int vgi_join_pieces(vgi_joining *j, size_t k, uint32_t *set, vg_err *e) VG_MUST_CHECK;

#endif
