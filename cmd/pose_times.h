/* pose_times.h: positions along a path through key poses, and the names of poses there. Shared by vg-interpolate
 * and vg-play.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_POSE_TIMES_H
#define VG_POSE_TIMES_H

#include "cli.h"

/* Positions count keys: 0 is the first key, 1 the second, 0.5 half way between them. */
typedef struct pose_times {
    double *at;  /* --at; NULL: evenly spaced from the first key to the last */
    long count;  /* number of poses to write; 0: no positions were given */
    double speed; /* --speed: keys from one pose to the next; 0: not given */
} pose_times;

/* pose_times_take: parse "0,0.5,1" into a struct pose_times; for cli_option, with the struct as its context. */
void pose_times_take(const char *list, void *times);
/* pose_times_at: position i, with `keys` >= 1 keys. */
double pose_times_at(const pose_times *m, size_t i, size_t keys);

/* pose_times_count: the number of poses to write. */
size_t pose_times_count(const pose_times *m, size_t keys);

/* The name and time of a key. */
typedef struct pose_key {
    char *name;
    bool has_time;
    double time;
} pose_key;
/* key_label: name f after position t ("a~b@0.25"; at a key, the key's own name), and interpolate its time. */
void key_label(vg_frame *f, const pose_key *keys, size_t nkeys, double t);

#endif
