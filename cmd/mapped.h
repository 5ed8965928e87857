/* mapped.h: --map of vg-deform: poses by a map from transforms of patches or bones.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_MAPPED_H
#define VG_MAPPED_H

#include "cli.h"

extern struct mapped_options {
    const char *map; /* --map; NULL: not given */
    bool live, joints, transforms, align;
    size_t nedits;
    struct mapped_edit *edits; /* --edit, in order */
} mapped;

/* mapped_take_edit: 'BONE AXIS ANGLE'; to be given to cli_option. */
void mapped_take_edit(const char *text, void *context);
/* mapped_needs_input: false when edits of the reference pose are all there is, with so many operands. Options that
 * need an input all the same are wrong usage. */
bool mapped_needs_input(size_t operands);
/* mapped_run: the whole job, from the input's head to the end of the output. s may be NULL unless it needs input. */
void mapped_run(vg_source *s);

#endif
