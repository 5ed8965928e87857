/* npz.h: the arrays; shared by npz.c and npz_write.c only.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_NPZ_H
#define VG_NPZ_H

#include "io/npy.h"

/* In the order in which they are written, which is the order in which archive.c returns the members. */
enum array {
    ANCHOR_POSITIONS, ANCHORS, CENTROIDS, DEFORMATIONS, FACE_OFFSETS, FACE_VERTICES, FACES, FEATURES, GRAPH_OFFSETS,
    GRAPH_VERTICES, LINKS, NAMES, POSITIONS, REFERENCE, REFERENCE_NAME, ROOT_TURNS, ROOTS, SELECTED, TIMES, TRANSFORMS,
    VECTORS, ARRAYS
};

/* Channels of feature frames that are arrays here: CENTROIDS and ROOT_TURNS. */
#define VGI_NPZ_CENTROIDS "centroids"
#define VGI_NPZ_ROOT_TURN "root_turn"

extern const char *const vgi_npz_names[ARRAYS];

/* ---- npz_write.c: for the table in npz.c ---- */
int vgi_npz_begin(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e);
int vgi_npz_put(void *state, const vg_frame *f, vg_err *e);
int vgi_npz_end(void *state, vg_err *e);
const char *vgi_npz_warning(void *state);
void vgi_npz_release(void *state);

#endif
