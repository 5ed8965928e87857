/* mapped.h: --map of vg-deform: poses by a map from patch transforms.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_MAPPED_H
#define VG_MAPPED_H

#include "cli.h"

extern struct mapped_options {
    const char *map; /* --map; NULL: not given */
    bool live, joints, transforms;
} mapped;

/* mapped_check: wrong usage ends the program. `others`: an option of another job was given. To be called after cli_start. */
void mapped_check(const char *others);
/* mapped_run: the whole job, from the input's head to the end of the output. */
void mapped_run(vg_source *s);

#endif
