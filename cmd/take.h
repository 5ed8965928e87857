/* take.h: which frames of a sequence are wanted, as numbers and ranges on the command line.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TAKE_H
#define VG_TAKE_H

#include "cli.h"

typedef struct take_range {
    uint64_t first, last, step; /* last is UINT64_MAX for an open range; step is 1 or more */
} take_range;

typedef struct take_list {
    size_t n; /* 0: all frames are wanted */
    take_range *range; /* ascending, disjoint; lives as long as the process */
    size_t at; /* the first range that is not over */
} take_list;

/* take_parse: parse "3,10-20,30-/2" into `list`, a take_list; anything else is wrong usage. For cli_option.take. */
void take_parse(const char *text, void *list);
/* take_wants: is this frame (from 0) wanted? Call it for each frame in order. */
bool take_wants(take_list *t, uint64_t frame);
/* take_end: after the last of `n` frames; stops if the list names a frame that does not exist. */
void take_end(const take_list *t, uint64_t frames);

#endif
