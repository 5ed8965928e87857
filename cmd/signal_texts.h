/* signal_texts.h: reads the texts of options on signals other than edits: places, times, curves. A malformed line stops the
 * program.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_SIGNAL_TEXTS_H
#define VG_CMD_SIGNAL_TEXTS_H

#include "cli.h"

/* read_places: a line 'X Y' for each frame; the caller frees it. */
double *read_places(const char *file, size_t frames);
/* read_retime: lines 'OLD NEW', old times from 1 to `frames`; at least two. */
void read_retime(const char *file, size_t frames, vg_retime *r);
/* read_curve: lines 'X Y' of points on the curve, or lines 'control X Y'; *n of them; the caller frees them. */
double *read_curve(const char *file, size_t *n, bool *controls);

#endif
