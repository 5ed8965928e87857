/* playback.h: the job of vg-play: poses from a map of patches or bones.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PLAYBACK_H
#define VG_PLAYBACK_H

#include "bone_edits.h"
#include "driving.h"
#include "pose_times.h"

typedef struct playback_options {
    const char *map;                        /* the operand that brings the map */
    bool live, rotations, transforms, feet; /* the options of these names */
    driving_options driving;
    bone_edits edits;
    pose_times between; /* count 0: every pose of the input is played */
} playback_options;

/* playback_run: the whole job, from the head of the input to the end of the output. Without input (s NULL) it
 * edits the reference pose of the map. */
void playback_run(playback_options *o, vg_source *s);

#endif
