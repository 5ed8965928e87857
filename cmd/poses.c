/* poses.c: reads all poses of a sequence into memory.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "poses.h"
#include "batch.h"

#include <stdlib.h>
#include <string.h>

typedef struct gathering {
    poses p;
    size_t cap, most;
    bool timed;
} gathering;

static void gather_poses(void *work, size_t n, vg_frame *f)
{
    gathering *g = work;
    poses *p = &g->p;
    (void)n; /* one at a time */
    if (p->n == g->most)
        cli_stop(VG_EINPUT, "there are more than %zu frames: take fewer with vg-encode --take, or one piece of the "
                 "sequence after another", g->most);
    if (p->n == g->cap) {
        g->cap = g->cap ? 2 * g->cap : 32;
        p->values = cli_resize(p->values, g->cap, p->numbers * sizeof *p->values, "the poses");
        p->names = cli_resize(p->names, g->cap, sizeof *p->names, "the poses");
        p->times = cli_resize(p->times, g->cap, sizeof *p->times, "the poses");
    }
    if (p->numbers) memcpy(p->values + p->n * p->numbers, f->values, p->numbers * sizeof *p->values);
    p->names[p->n] = cli_copy_text(f->name ? f->name : "", "the poses");
    g->timed = g->timed && f->has_time;
    p->times[p->n++] = f->time;
}

poses poses_read(vg_source *s, size_t most)
{
    static const step reading = {.batch = 1, .unit = "poses", .process = gather_poses};
    const vg_head *h = vg_source_head(s);
    gathering g = {.p = {.numbers = h->count * vg_head_width(h)}, .most = most, .timed = true};
    vg_frame *in = batch_frames(&reading);
    batch_read(&reading, &g, s, in);
    batch_frames_free(&reading, in);
    if (!g.timed || !g.p.n) {
        free(g.p.times);
        g.p.times = NULL;
    }
    return g.p;
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
