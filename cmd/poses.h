/* poses.h: all poses of a sequence in one array, with their names and times.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_POSES_H
#define VG_CMD_POSES_H

#include "cli.h"

typedef struct poses {
    size_t n, numbers; /* number of poses, and of numbers per pose */
    double *values;    /* n x numbers, from malloc */
    char **names;
    double *times;     /* n; NULL unless all have one */
} poses;

/* poses_read: read to the end; stops if there are more than `most`. */
poses poses_read(vg_source *s, size_t most);
/* poses_load: read the operand of an option: vertices of this mesh. Its provenance is added to `to`. */
poses poses_load(const char *operand, size_t most, const vg_mesh *mesh, vg_head *to);
void poses_clear(poses *p);
/* poses_name: move names and times to the signal. */
void poses_name(poses *p, vg_signal *s);

#endif
