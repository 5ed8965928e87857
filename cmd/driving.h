/* driving.h: how vg-play pairs the joints of a skeleton with those of a rig, and makes their rest poses alike.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_DRIVING_H
#define VG_DRIVING_H

#include "cli.h"

typedef struct driving_options {
    const char *align;  /* "auto", "none", "all", or names of bones with commas; NULL: auto */
    const char *joints; /* a file of pairs of joints; NULL: by their names */
} driving_options;

/* driving_start: the driver of the rig of a map by a skeleton (both borrowed); says what it has aligned, and what is
 * missing. map: the operand that brings the map, for messages. */
vg_driver *driving_start(const driving_options *o, const vg_rig *rig, const char *map, const vg_skeleton *by);

#endif
