/* between.c: --interpolate, --at and --smooth of vg-deform: collect the key poses, write the poses between them as
 * vectors.
 * Leaves out the mathematics (lib/method/vectors/interpolate.c), and paths of transforms, which need a map.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "between.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct between_options between;

/* ---- moments ---- */

void between_take_at(const char *list, void *context)
{
    (void)context;
    size_t most = strlen(list) / 2 + 1;
    free(between.at);
    between.at = cli_allocate(most, sizeof *between.at, "the list of --at");
    between.count = cli_parse_numbers(list, between.at, most);
    if (!between.count) cli_usage("option '--at' needs numbers with commas between, not '%s'", list);
}

bool between_wanted(void)
{
    return between.frames || between.at;
}

size_t between_count(void)
{
    return between.at ? between.count : (size_t)between.frames;
}

double between_moment(size_t i, size_t keys)
{
    if (between.at) return between.at[i];
    size_t n = between_count();
    return n < 2 ? 0 : (double)i * (double)(keys - 1) / (double)(n - 1);
}

void between_label(vg_frame *f, const between_key *keys, size_t nkeys, double t)
{
    vg_err e;
    size_t last = nkeys > 1 ? nkeys - 2 : 0, number = t > 0 ? (t < (double)last ? (size_t)t : last) : 0;
    const between_key *a = &keys[number], *b = &keys[nkeys > 1 ? number + 1 : number];
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

/* ---- a path of vectors ---- */

typedef struct poses {
    vg_head *h;
    vg_graph *g;
    vg_kind kind;   /* what comes in */
    size_t numbers; /* of the values of a key */
    vg_key *keys;
    between_key *labels;
    size_t n, cap;
} poses;

static void prepare(poses *p, vg_source *s)
{
    vg_err e;
    p->h = vg_source_head(s);
    p->kind = p->h->kind;
    if (p->kind == VG_TRANSFORMS) cli_stop(VG_EINPUT, "the input holds transforms: name their map with --map");
    p->numbers = p->h->count * vg_kind_width(p->kind);
    if (vg_head_prepare_vectors(p->h, &e) < 0 || vg_graph_new(&p->g, p->h, &e) < 0) cli_die(&e);
    p->h->kind = VG_VECTORS;
    p->h->count = vg_graph_corners(p->g);
}

static void keep(poses *p, const vg_frame *f)
{
    const vg_head *h = p->h;
    double *values = cli_allocate(p->numbers, sizeof *values, "the key poses"),
           *anchors = cli_allocate(3 * h->nanchors, sizeof *anchors, "the key poses");
    if (p->n == p->cap) {
        p->cap = 2 * p->cap + 16;
        p->keys = cli_resize(p->keys, p->cap, sizeof *p->keys, "the key poses");
        p->labels = cli_resize(p->labels, p->cap, sizeof *p->labels, "the key poses");
    }
    vg_key *k = &p->keys[p->n];
    *k = (vg_key){.values = values, .anchors = anchors};
    memcpy(values, f->values, p->numbers * sizeof *values);
    if (p->kind == VG_VERTICES) {
        vg_graph_root(p->g, values, k->root);
        vg_graph_anchors(values, h->anchors, h->nanchors, anchors);
    } else {
        memcpy(k->root, f->root, sizeof k->root);
        if (h->nanchors) memcpy(anchors, f->anchors, 3 * h->nanchors * sizeof *anchors);
    }
    p->labels[p->n++] = (between_key){cli_copy_text(f->name, "the key poses"), f->has_time, f->time};
}

/* Speeds are by time where all keys have times, and these grow. */
static void place_keys(poses *p)
{
    bool timed = true;
    for (size_t i = 0; i < p->n; i++)
        timed = timed && p->labels[i].has_time && (i == 0 || p->labels[i].time > p->labels[i - 1].time);
    for (size_t i = 0; i < p->n; i++) p->keys[i].place = timed ? p->labels[i].time : (double)i;
}

static void collect(poses *p, vg_source *s)
{
    vg_frame f = {0};
    while (cli_next(s, &f)) keep(p, &f);
    if (p->n < 2)
        cli_stop(VG_EINPUT, "there is %s in the input, and a path needs two or more", p->n ? "one pose" : "no pose");
    vg_frame_clear(&f);
    place_keys(p);
}

static void check_finite(const poses *p, const vg_frame *f, double t)
{
    bool finite = isfinite(f->root[0]) && isfinite(f->root[1]) && isfinite(f->root[2]);
    for (size_t i = 0; i < 3 * p->h->count; i++) finite &= isfinite(f->values[i]) != 0;
    if (finite) return;
    if (t >= 0 && t <= (double)(p->n - 1))
        cli_stop(VG_EINPUT, "frame '%s' cannot be calculated: the poses beside it are too large, or too far apart",
                 f->name);
    cli_stop(VG_EARG, "frame '%s' is so far outside that numbers overflow: choose --at nearer to the keys", f->name);
}

static void write_poses(const poses *p, vg_path *path)
{
    vg_err e;
    vg_frame f = {0};
    if (vg_frame_shape(&f, p->h, &e) < 0) cli_die(&e);
    for (size_t i = 0; i < between_count(); i++) {
        double t = between_moment(i, p->n);
        if (vg_path_at(path, t, f.values, f.root, f.anchors, &e) < 0) cli_die(&e);
        between_label(&f, p->labels, p->n, t);
        check_finite(p, &f, t);
        cli_stream_put(&f);
        cli_progress("poses", i + 1);
    }
    vg_frame_clear(&f);
}

static void report(const vg_path *path)
{
    vg_path_facts facts = vg_path_get_facts(path);
    const vg_deform_counts *c = &facts.degenerate;
    cli_note("%zu stretches between keys, %zu with turns by more than half a turn", facts.segments, facts.beyond);
    if (c->corners)
        cli_warn("%llu corners without a direction took the turn of their face (the first in face %llu)",
                 (unsigned long long)c->corners, (unsigned long long)c->first_face);
}

static void clear(poses *p)
{
    for (size_t i = 0; i < p->n; i++) {
        free((double *)(uintptr_t)p->keys[i].values);
        free((double *)(uintptr_t)p->keys[i].anchors);
        free((char *)(uintptr_t)p->labels[i].name);
    }
    free(p->keys);
    free(p->labels);
    vg_graph_free(&p->g);
}

void between_run(vg_source *s)
{
    poses p = {0};
    vg_path *path;
    vg_err e;
    prepare(&p, s);
    cli_stream_open(p.h);
    collect(&p, s);
    const vg_path_options o = {.kind = p.kind, .nanchors = p.h->nanchors, .smooth = between.smooth,
                               .threads = cli.threads};
    if (vg_path_new(&path, p.g, p.h->body.reference, p.keys, p.n, &o, &e) < 0) cli_die(&e);
    write_poses(&p, path);
    report(path);
    vg_path_free(&path);
    cli_stream_end(vg_source_tail(s));
    clear(&p);
}
