/* driving.h: pairs the joints of a skeleton with those of a rig, and aligns their rest poses, for vg-play.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_DRIVING_H
#define VG_DRIVING_H

#include "cli.h"

typedef struct driving_options {
    const char *align;  /* "auto", "none", "all", or names of bones with commas; NULL: auto */
    const char *joints; /* a file of pairs of joints; NULL: by their names */
} driving_options;

/* driving_start: create the driver of a map's rig by a skeleton (both borrowed); warns of limbs it aligned and
 * bones without a partner. Messages call the map by its operand `map`. */
vg_driver *driving_start(const driving_options *o, const vg_rig *rig, const char *map, const vg_skeleton *by);

#endif
