/* solve_features.h: features of poses as frames, and the step that takes them back: what vg-features and vg-solve share.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_FEATURES_H
#define VG_CMD_FEATURES_H

#include "cli.h"

/* Channels of a frame of features: the rotation of the root, one unit quaternion w x y z, and the centroid of each
 * connected component, in the order of their first vertices. */
#define FEATURES_ROOT "root_turn"
#define FEATURES_CENTROIDS "centroids"

/* features_solve: frames of features from s become frames of vertices on standard output or --output. */
void features_solve(vg_source *s);

#endif
