/* raw.h: frames as numbers with nothing around them: x y z of each vertex, frame after frame, little-endian.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_CMD_RAW_H
#define VG_CMD_RAW_H

#include "cli.h"

/* raw_output: does the name end in ":f32" or ":f64"? Then *width (4 or 8) and *file, the name without it (free with
 * free()). */
bool raw_output(const char *name, size_t *width, char **file);
/* raw_write: write count numbers of `width` bytes to f. A number that is not a finite binary32 ends the program. */
void raw_write(FILE *f, const vg_frame *from, size_t count, size_t width);

typedef struct raw_input {
    int fd;
    const char *shown, *quote; /* its name in messages, and the quotes around it */
    size_t count, width; /* numbers of a frame, bytes of a number */
    unsigned char *room;
    uint64_t frames;   /* that have been read */
} raw_input;

/* raw_open: file "-": standard input. raw_next: the next frame, named by its number from 0, into f, which has room
 * (vg_frame_shape); false at the end. Half a frame ends the program. */
raw_input raw_open(const char *file, size_t count, size_t width);
bool raw_next(raw_input *in, vg_frame *f);
void raw_close(raw_input *in);

#endif
