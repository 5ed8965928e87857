/* placing.h: --axes, --scale, --unit, --mirror and --origin of vg-encode: where and how a sequence stands.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PLACING_H
#define VG_PLACING_H

#include "cli.h"

typedef struct placing {
    double axes[9];     /* row-major, determinant 1: from the axes of the input to those of the output; all 0: the same */
    double scale, unit; /* factors; 0: 1 */
    const char *origin; /* "centre", "floor" or X,Y,Z; NULL: stays */
    long mirror;        /* 1 2 3: mirror x, y or z; 0: do not */
    const char *pairs;  /* "auto", or a file with two vertices a line */
    double up[3];       /* of the output, by --axes; all 0: y */
    /* filled in by placing_head: */
    double matrix[9], shift[3];
    size_t nv;
    vg_mirror mirrored; /* its shift follows */
    double *room;       /* nv points */
} placing;

/* placing_take_axes, placing_take_unit: to be given to cli_option with a struct placing as the context. */
void placing_take_axes(const char *text, void *placing);
void placing_take_unit(const char *text, void *placing);
void placing_take_mirror(const char *text, void *placing);
/* placing_wanted: is there anything to do? */
bool placing_wanted(const placing *p);
/* placing_head: place the reference pose of h, whose frames are vertices, and drop what becomes invalid by it. */
void placing_head(placing *p, vg_head *h);
/* placing_frame: place a frame of vertices. */
void placing_frame(const placing *p, vg_frame *f);

#endif
