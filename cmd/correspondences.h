/* correspondences.h: a correspondence in reports.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_CORRESPONDENCES_H
#define VG_CMD_CORRESPONDENCES_H

#include "report.h"

/* report_correspondence: how much of both meshes it covers, and how far matched faces are apart. D: the diagonal of
 * the source as it lies on the target, which is what the stream holds of the target. */
void report_correspondence(report *r, const vg_head *h, double D);

#endif
