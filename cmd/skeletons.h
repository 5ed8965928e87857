/* skeletons.h: skeletons and rigs in reports.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SKELETONS_H
#define VG_SKELETONS_H

#include "report.h"

/* report_skeletons: the skeleton and the rig of a head. turned: how many of the frames say how joints have turned. */
void report_skeletons(report *r, const vg_head *h, uint64_t turned, uint64_t frames);
/* write_weights: the skinning weights of a rig as text, one vertex per line. */
void write_weights(FILE *f, const vg_rig *g, size_t nv);

#endif
