/* rigging.h: --skeleton, --groups and --bones of vg-fitmap: a map of bones from poses.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RIGGING_H
#define VG_RIGGING_H

#include "cli.h"

typedef struct rigging_options {
    const char *skeleton, *groups; /* NULL: not given */
    double root_at[3];
    bool has_root, learn;
    size_t method;         /* a vg_rig_method, or one of those below */
    long bones;            /* without a skeleton; 0: not given */
    long bones_per_corner; /* 0: not given */
    double refine;         /* below 0: not given */
    double hold;  /* share of the vertices that go where their bones take them */
    long holdout; /* hold out every Nth pose; 0: none */
} rigging_options;

/* Both mixed by held-out poses; what method is before --method is read: skinning with --bones, else both mixed. */
enum { RIGGING_METHOD_AUTO = 2, RIGGING_METHOD_NOT_GIVEN = 3 };

/* rigging_wanted: is --skeleton, --groups or --bones given? */
bool rigging_wanted(const rigging_options *o);
/* rigging_take_root: "X,Y,Z" into root_at of the rigging_options that context is; for cli_option. */
void rigging_take_root(const char *text, void *context);
/* rigging_run: the fit, into the head of s. */
void rigging_run(vg_source *s, const rigging_options *o);

#endif
