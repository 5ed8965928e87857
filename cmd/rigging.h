/* rigging.h: --skeleton and --groups of vg-fitmap: a map of bones from poses and a skeleton.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RIGGING_H
#define VG_RIGGING_H

#include "cli.h"

extern struct rigging_options {
    const char *skeleton, *groups; /* NULL: not given */
    const char *root_at, *method;
    size_t method_choice; /* a vg_rig_method */
    bool learn;
    long bones_per_corner;
    double refine;
} rigging;

/* rigging_wanted: is --skeleton or --groups there? */
bool rigging_wanted(void);
/* rigging_check: wrong usage ends the program. To be called after cli_start. */
void rigging_check(void);
/* rigging_run: the fit, into the head of s: hold: share of the vertices; holdout: every so manieth pose is left out,
 * 0: none. */
void rigging_run(vg_source *s, double hold, long holdout);

#endif
