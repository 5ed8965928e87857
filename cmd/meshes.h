/* meshes.h: a mesh in reports.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_MESHES_H
#define VG_CMD_MESHES_H

#include "report.h"

/* report_mesh: the mesh of a head: sizes, faces, components, and what goes with it; nothing without a reference. */
void report_mesh(report *r, const vg_head *h);

#endif
