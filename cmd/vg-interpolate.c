/* vg-interpolate: interpolates and extrapolates key poses, as vectors. The mathematics is in
 * lib/method/vectors/interpolate.c; paths of transforms need a map (vg-play).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "batch.h"
#include "pose_times.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct {
    pose_times times;
    bool smooth;
} opts;

static const cli_option options[] = {
    {"at", 0, "T,...", "write the poses at these moments: 0 is the first pose, 1 the second; outside is extrapolated",
     .take = pose_times_take, .context = &opts.times, .excludes = "speed"},
    {"speed", 0, "X", "play at this speed with the same frame rate: 0.5 is slow motion with twice as many frames",
     .number = &opts.times.speed, .least = 1e-4, .most = 1e4},
    {"smooth", 0, NULL, "keep the velocity continuous at the poses that are interpolated", .flag = &opts.smooth},
    {.name = NULL}};

static const cli_program program = {
    .name = "vg-interpolate",
    .synopsis = "[options] N | --at T,... | --speed X [FILE]",
    .summary = "interpolate and extrapolate key poses: N evenly spaced poses, or poses at given moments",
    .options = options,
    .most_operands = 2,
    .writes_stream = true,
    .writes_vectors = true,
    .threaded = true};

/* Takes N from the operands unless --at was given; returns how many operands that used. */
static size_t take_count(char **operands, size_t n)
{
    if (opts.times.at) {
        if (n > 1) cli_usage("--at defines which poses are written, so '%s' is one operand too many", operands[0]);
        return 0;
    }
    if (opts.times.speed > 0) {
        if (n > 1) cli_usage("--speed defines how many poses are written, so '%s' is one operand too many", operands[0]);
        return 0;
    }
    if (n == 0) cli_usage("say how many poses to write: vg-interpolate 30, or which: vg-interpolate --at 0,0.5,1");
    double count;
    bool digits = !operands[0][strspn(operands[0], "0123456789")];
    if (!digits || cli_parse_numbers(operands[0], &count, 1) != 1 || !(count >= 1 && count <= 1e9))
        cli_usage("the number of poses is from 1 to 1000000000, not '%s'", operands[0]);
    opts.times.count = (long)count;
    return 1;
}

/* ---- the key poses ---- */

typedef struct poses {
    vg_head *h;
    vg_graph *g;
    vg_kind kind;   /* what comes in */
    size_t numbers; /* of the values of a key */
    vg_key *keys;
    pose_key *labels;
    size_t n, cap;
} poses;

static void prepare(void *context, vg_head *h, vg_frame *in)
{
    poses *p = context;
    vg_err e;
    (void)in;
    p->h = h, p->kind = h->kind;
    if (p->kind == VG_TRANSFORMS)
        cli_stop(VG_EINPUT, "the input holds transforms: interpolate them with 'vg-play MAP --interpolate N'");
    if (p->kind == VG_FEATURES || p->kind == VG_COORDINATES)
        cli_stop(VG_EINPUT, "the input holds %s: vg-interpolate takes vertices, vectors or deformations",
                 vg_head_form(p->h));
    p->numbers = p->h->count * vg_head_width(p->h);
    if (vg_head_prepare_vectors(p->h, &e) < 0 || vg_head_graph(&p->g, p->h, &e) < 0) cli_die(&e);
    p->h->kind = VG_VECTORS;
    p->h->count = vg_graph_corners(p->g);
}

static void keep_pose(poses *p, const vg_frame *f)
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
        if (h->nanchors) memcpy(anchors, vg_frame_anchors(f), 3 * h->nanchors * sizeof *anchors);
    }
    p->labels[p->n++] = (pose_key){cli_copy_text(f->name, "the key poses"), f->has_time, f->time};
}

/* Velocities are per unit of time if all keys have times and these increase, else per key. */
static void place_keys(poses *p)
{
    bool timed = true;
    for (size_t i = 0; i < p->n; i++)
        timed = timed && p->labels[i].has_time && (i == 0 || p->labels[i].time > p->labels[i - 1].time);
    for (size_t i = 0; i < p->n; i++) p->keys[i].place = timed ? p->labels[i].time : (double)i;
}

static void keep_batch(void *context, size_t n, vg_frame *in)
{
    for (size_t i = 0; i < n; i++) keep_pose(context, &in[i]);
}

static void clear_poses(poses *p)
{
    for (size_t i = 0; i < p->n; i++) {
        free((double *)(uintptr_t)p->keys[i].values);
        free((double *)(uintptr_t)p->keys[i].anchors);
        free(p->labels[i].name);
    }
    free(p->keys);
    free(p->labels);
    vg_graph_free(&p->g);
}

/* ---- the poses between them ---- */

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

/* The stem that the names of all keys have, as in "Walk.0001"; 0: they have none in common. number: of the first. */
static size_t common_stem(const poses *p, uint64_t *number)
{
    uint64_t other;
    size_t n = vg_frame_stem(p->labels[0].name, number);
    for (size_t i = 1; n && i < p->n; i++)
        if (vg_frame_stem(p->labels[i].name, &other) != n || memcmp(p->labels[i].name, p->labels[0].name, n)) n = 0;
    return n;
}

/* Frames of another speed are numbered on as those of an animation are, and last so much longer. */
static void label_speed(const poses *p, vg_frame *f, size_t i)
{
    vg_err e;
    uint64_t number;
    size_t stem = common_stem(p, &number);
    f->time = p->labels[0].time + (f->time - p->labels[0].time) / opts.times.speed;
    if (!stem) return;
    char *name = cli_allocate(stem + 30, 1, "the name of a pose");
    snprintf(name, stem + 30, "%.*s.%04llu", (int)stem, p->labels[0].name, (unsigned long long)number + i);
    if (vg_frame_rename(f, name, &e) < 0) cli_die(&e);
    free(name);
}

static void write_poses(const poses *p, vg_path *path)
{
    vg_err e;
    vg_frame f = {0};
    size_t count = pose_times_count(&opts.times, p->n);
    if (vg_frame_shape(&f, p->h, &e) < 0) cli_die(&e);
    for (size_t i = 0; i < count; i++) {
        double t = pose_times_at(&opts.times, i, p->n);
        if (vg_path_at(path, t, f.values, f.root, vg_frame_anchors(&f), &e) < 0) cli_die(&e);
        key_label(&f, p->labels, p->n, t);
        if (opts.times.speed > 0) label_speed(p, &f, i);
        check_finite(p, &f, t);
        cli_stream_put(&f);
        cli_progress_of("poses", i + 1, count);
    }
    vg_frame_clear(&f);
}

static void report_path(const vg_path *path)
{
    vg_path_stats stats = vg_path_get_stats(path);
    const vg_deform_stats *c = &stats.degenerate;
    cli_note("%zu segments between keys, %zu with rotations by more than half a turn", stats.segments, stats.beyond);
    if (c->corners)
        cli_warn("%llu corners without a direction took the rotation of their face (the first in face %llu)",
                 (unsigned long long)c->corners, (unsigned long long)c->first_face);
}

static void interpolate(void *context)
{
    poses *p = context;
    vg_path *path;
    vg_err e;
    if (p->n < 2)
        cli_stop(VG_EINPUT, "there is %s in the input, but a path needs at least two", p->n ? "one pose" : "no pose");
    place_keys(p);
    const vg_path_options o = {.kind = p->kind, .nanchors = p->h->nanchors, .smooth = opts.smooth,
                               .threads = cli_threads()};
    if (vg_path_new(&path, p->g, p->h->body.reference, p->keys, p->n, &o, &e) < 0) cli_die(&e);
    write_poses(p, path);
    report_path(path);
    vg_path_free(&path);
}

int main(int argc, char **argv)
{
    static const step between = {
        .batch = 1, .unit = "keys", .init = prepare, .process = keep_batch, .finish = interpolate};
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands), count = take_count(operands, n);
    poses p = {0};
    step_run(&between, &p, cli_source(operands + count, n - count));
    clear_poses(&p);
    cli_finish(0);
}
