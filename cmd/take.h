/* take.h: which frames of a sequence are wanted, as numbers and ranges on the command line. Leaves out names of frames.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_TAKE_H
#define VG_TAKE_H

#include "cli.h"

typedef struct take_range {
    uint64_t first, last, step; /* last is UINT64_MAX when nothing is said; step is 1 or more */
} take_range;

typedef struct take_list {
    size_t n; /* 0: all frames are wanted */
    take_range *range; /* ascending, disjoint; of the process's life */
    size_t at; /* the first range that is not over */
} take_list;

/* take_parse: "3,10-20,30-/2" into `list`, a take_list; usage error when it is anything else. As cli_option.take. */
void take_parse(const char *text, void *list);
/* take_wants: is this frame, counted from 0, wanted? To be asked of each in its turn. */
bool take_wants(take_list *t, uint64_t frame);
/* take_end: there were so many frames; stops when one was asked for by its number that is not there. */
void take_end(const take_list *t, uint64_t frames);

#endif
