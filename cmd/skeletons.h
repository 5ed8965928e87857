/* skeletons.h: skeletons and rigs in reports.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SKELETONS_H
#define VG_SKELETONS_H

#include "report.h"

/* report_skeleton: the joints as a tree, in a group that the caller has begun. label: its name in the text. */
void report_skeleton(report *r, const char *label, const vg_skeleton *s);
/* write_weights: the skinning weights of a rig as text, one vertex per line. */
void write_weights(FILE *f, const vg_rig *g, size_t nv);

#endif
