/* bone_edits.h: --edit of vg-play: turns of single bones, asked for by name.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_BONE_EDITS_H
#define VG_BONE_EDITS_H

#include "cli.h"

typedef struct bone_edits {
    size_t n;
    struct bone_edit *at; /* in the order of the command line */
} bone_edits;

/* bone_edits_take: 'BONE x|y|z|twist DEGREES'; to be given to cli_option with a bone_edits as its context. */
void bone_edits_take(const char *text, void *edits);
/* bone_edits_find: look the bones up in the rig of a map; `operand` is what messages call the map. A bone that is not
 * there is wrong usage. */
void bone_edits_find(bone_edits *e, const vg_head *map, const char *operand);
/* bone_edits_apply: each edit in turn to the transforms of one pose, 7 numbers a bone. */
void bone_edits_apply(const bone_edits *e, const vg_rig *rig, double *transforms);

#endif
