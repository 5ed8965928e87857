/* bone_edits.h: --edit of vg-play: rotations of single bones, by name.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_BONE_EDITS_H
#define VG_BONE_EDITS_H

#include "cli.h"

typedef struct bone_edits {
    size_t n;
    struct bone_edit *at; /* in the order of the command line */
} bone_edits;

/* bone_edits_take: parse 'BONE x|y|z|twist DEGREES'; for cli_option, with a bone_edits as its context. */
void bone_edits_take(const char *text, void *edits);
/* bone_edits_find: find the bones in the rig of a map; messages call the map `operand`. A missing bone is wrong
 * usage. */
void bone_edits_find(bone_edits *e, const vg_map *map, const vg_rig *rig, const char *operand);
/* bone_edits_apply: apply the edits in order to the transforms of one pose, 7 numbers per bone. */
void bone_edits_apply(const bone_edits *e, const vg_rig *rig, double *transforms);

#endif
