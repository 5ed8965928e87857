/* pose_times.c: the positions that N and --at ask for along a path through key poses, and the names of poses
 * there. The paths are in lib/method.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "pose_times.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void pose_times_take(const char *list, void *to)
{
    pose_times *m = to;
    size_t most = strlen(list) / 2 + 1;
    free(m->at);
    m->at = cli_allocate(most, sizeof *m->at, "the list of --at");
    m->count = (long)cli_parse_numbers(list, m->at, most);
    if (!m->count) cli_usage("option '--at' needs numbers with commas between, not '%s'", list);
}

double pose_times_at(const pose_times *m, size_t i, size_t keys)
{
    if (m->at) return m->at[i];
    if (m->speed > 0) return fmin((double)i * m->speed, (double)(keys - 1));
    return m->count < 2 ? 0 : (double)i * (double)(keys - 1) / (double)(m->count - 1);
}

size_t pose_times_count(const pose_times *m, size_t keys)
{
    double n = m->speed > 0 ? floor((double)(keys - 1) / m->speed * (1 + 1e-12)) + 1 : (double)m->count;
    if (n > 1e9) cli_usage("--speed %g makes more than 1000000000 poses", m->speed);
    return (size_t)n;
}

void key_label(vg_frame *f, const pose_key *keys, size_t nkeys, double t)
{
    vg_err e;
    size_t last = nkeys > 1 ? nkeys - 2 : 0, number = t > 0 ? (t < (double)last ? (size_t)t : last) : 0;
    const pose_key *a = &keys[number], *b = &keys[nkeys > 1 ? number + 1 : number];
    double u = t - (double)number;
    size_t room = strlen(a->name) + strlen(b->name) + 40;
    char *name = cli_allocate(room, 1, "the key poses");
    if (u == 0 || u == 1) snprintf(name, room, "%s", u == 0 ? a->name : b->name);
    else snprintf(name, room, "%s~%s@%.6g", a->name, b->name, u);
    if (vg_frame_rename(f, name, &e) < 0) cli_die(&e);
    free(name);
    f->has_time = a->has_time && b->has_time;
    f->time = f->has_time ? a->time + u * (b->time - a->time) : 0;
}
