/* rigging.h: --skeleton, --groups and --bones of vg-fitmap: a map of bones from poses.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_RIGGING_H
#define VG_RIGGING_H

#include "cli.h"

typedef struct rigging_options {
    const char *skeleton, *groups; /* NULL: not given */
    double root_at[3];
    bool has_root, learn;
    size_t method; /* a vg_rig_method */
    long bones;    /* without a skeleton; 0: not given */
    long bones_per_corner;
    double refine;
    double hold;  /* share of the vertices that go where their bones take them */
    long holdout; /* hold out every Nth pose; 0: none */
} rigging_options;

/* What method is before --method is read: envelope, or skinning with --bones. */
enum { RIGGING_METHOD_NOT_GIVEN = 2 };

/* rigging_wanted: is --skeleton, --groups or --bones given? */
bool rigging_wanted(const rigging_options *o);
/* rigging_take_root: "X,Y,Z" into root_at of the rigging_options that context is; for cli_option. */
void rigging_take_root(const char *text, void *context);
/* rigging_run: the fit, into the head of s. */
void rigging_run(vg_source *s, const rigging_options *o);

#endif
