/* poses.c: reads all poses of a sequence into memory.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "poses.h"

#include <stdlib.h>
#include <string.h>

poses poses_read(vg_source *s, size_t most)
{
    vg_frame f = {0};
    const vg_head *h = vg_source_head(s);
    poses p = {.numbers = h->count * vg_head_width(h)};
    bool timed = true;
    size_t cap = 0;
    while (cli_next(s, &f)) {
        cli_progress("poses", p.n + 1);
        if (p.n == most)
            cli_stop(VG_EINPUT, "there are more than %zu frames: take fewer with vg-encode --take, or one piece of the "
                     "sequence after another", most);
        if (p.n == cap) {
            cap = cap ? 2 * cap : 32;
            p.values = cli_resize(p.values, cap, p.numbers * sizeof *p.values, "the poses");
            p.names = cli_resize(p.names, cap, sizeof *p.names, "the poses");
            p.times = cli_resize(p.times, cap, sizeof *p.times, "the poses");
        }
        if (p.numbers) memcpy(p.values + p.n * p.numbers, f.values, p.numbers * sizeof *p.values);
        p.names[p.n] = cli_copy_text(f.name ? f.name : "", "the poses");
        timed = timed && f.has_time;
        p.times[p.n++] = f.time;
    }
    if (!timed || !p.n) {
        free(p.times);
        p.times = NULL;
    }
    vg_frame_clear(&f);
    return p;
}

poses poses_load(const char *operand, size_t most, const vg_mesh *mesh, vg_head *to)
{
    vg_err e;
    vg_source *s = cli_source((char *[]){(char *)operand}, 1);
    vg_head *h = vg_source_head(s);
    char name[200];
    snprintf(name, sizeof name, "'%.190s'", operand);
    cli_need_vertices(h, name);
    if (vg_mesh_same(mesh, "its body", &h->body.mesh, name, &e) < 0 || vg_head_merge_trace(to, h, &e) < 0) cli_die(&e);
    poses p = poses_read(s, most);
    vg_source_close(&s);
    return p;
}

void poses_clear(poses *p)
{
    for (size_t i = 0; p->names && i < p->n; i++) free(p->names[i]);
    free(p->names);
    free(p->values);
    free(p->times);
    *p = (poses){0};
}

void poses_name(poses *p, vg_signal *s)
{
    s->names = p->names, s->times = p->times, s->timed = p->times != NULL;
    p->names = NULL, p->times = NULL;
}
