/* skeletons.h: what vg-info tells of skeletons and rigs.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SKELETONS_H
#define VG_SKELETONS_H

#include "report.h"

/* report_skeleton: its joints as a tree, in a group that the caller has begun. label: what it is called in the
 * text. */
void report_skeleton(report *r, const char *label, const vg_skeleton *s);
/* write_weights: the skin of a rig as text, a vertex per line. */
void write_weights(FILE *f, const vg_rig *g, size_t nv);

#endif
