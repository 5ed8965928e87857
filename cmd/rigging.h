/* rigging.h: --skeleton, --groups and --bones of vg-fitmap: a map of bones from poses.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RIGGING_H
#define VG_RIGGING_H

#include "cli.h"

extern struct rigging_options {
    const char *skeleton, *groups; /* NULL: not given */
    double root_at[3];
    bool has_root, learn;
    size_t method; /* a vg_rig_method */
    long bones;    /* without a skeleton; 0: not given */
    long bones_per_corner;
    double refine;
} rigging;

/* rigging_wanted: is --skeleton, --groups or --bones there? */
bool rigging_wanted(void);
/* rigging_take_root: "X,Y,Z" into rigging.root_at; to be given to cli_option. */
void rigging_take_root(const char *text, void *context);
/* rigging_run: the fit, into the head of s: hold: share of the vertices; holdout: every so manieth pose is left out,
 * 0: none. */
void rigging_run(vg_source *s, double hold, long holdout);

#endif
