/* playback.c: the job of vg-play: measures patches or bones, or takes their transforms from the input or a skeleton,
 * edits or interpolates them, and maps them to vertices by one product. Maps are fitted in vg-fitmap; paths through
 * vectors are in vg-interpolate.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "playback.h"
#include "batch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BATCH = 32 };

/* The poses that --interpolate and --at go between. */
typedef struct key_list {
    pose_key *label;
    double **transforms;
    size_t n, cap;
} key_list;

typedef struct playback {
    playback_options *o;
    vg_head *h; /* the input's, then the output's */
    vg_head home; /* of the map, which has been taken out of it */
    vg_map map;
    vg_kind kind; /* what comes in */
    size_t count; /* transforms */
    vg_player *player;
    driving driving;         /* a skeleton comes in */
    size_t n, most;          /* poses in hand, at most BATCH */
    vg_frame out[BATCH];
    double *transforms[BATCH];
    key_list keys;
} playback;

static void load_map(playback *p)
{
    cli_load(&p->home, p->o->map, "map");
    vg_head_take_out(&p->map, &p->home, "map");
}

static void take_skeleton(playback *p)
{
    if (p->map.kind != VG_MAP_BONES)
        cli_stop(VG_EINPUT,
                 "the input is a skeleton, but '%s' is a map of patches: make one of bones with vg-fitmap --skeleton",
                 p->o->map);
    driving_start(&p->driving, &p->o->driving, &p->home.body.rig, p->o->map, &p->h->body.skeleton);
}

static void check_input(playback *p)
{
    vg_err e;
    const vg_head *h = p->h;
    char name[200];
    snprintf(name, sizeof name, "'%.190s'", p->o->map);
    p->kind = h->kind, p->count = p->map.n;
    int r = VG_OK;
    if (p->o->feet && p->map.kind != VG_MAP_BONES)
        cli_usage("--feet needs a map of bones, and %s is one of patches: make one with vg-fitmap --skeleton", name);
    if (p->kind == VG_VERTICES && h->body.skeleton.njoints) {
        take_skeleton(p);
    } else if (p->o->driving.align || p->o->driving.joints) {
        cli_usage("--align and --joints need a skeleton as input, this input holds %s", vg_head_form(h));
    } else if (p->kind == VG_VERTICES) {
        r = vg_mesh_same(&h->body.mesh, "the sequence", &p->home.body.mesh, name, &e);
    } else if (p->kind != VG_TRANSFORMS) {
        r = vg_fail(&e, VG_EINPUT, "the input holds %s: vg-play takes vertices or transforms", vg_head_form(h));
    } else if (h->count != p->count) {
        r = vg_fail(&e, VG_EINPUT, "the input has %zu transforms per frame, but the map %s needs %zu", h->count, name,
                    p->count);
    }
    if (r < 0) cli_die(&e);
}

/* The output's head: the input's provenance, records and precision, the map's mesh with all that describes it. */
static void make_head(playback *p)
{
    vg_err e;
    vg_head home, *h = p->h; /* the player goes on using p->home */
    if (vg_head_merge_trace(h, &p->home, &e) < 0 || vg_head_copy(&home, &p->home, &e) < 0) cli_die(&e);
    vg_head_take(h, &home, NULL);
    vg_head_clear(&home);
    if (!p->o->transforms) vg_head_drop(h, "rig"); /* with transforms it defines what they move */
    h->kind = p->o->transforms ? VG_TRANSFORMS : VG_VERTICES;
    h->count = p->o->transforms ? p->count : h->body.mesh.nv;
}

static void put_batch(playback *p)
{
    const double *from[BATCH];
    double *to[BATCH];
    for (size_t i = 0; i < p->n; i++) {
        from[i] = p->transforms[i], to[i] = p->out[i].values;
        bone_edits_apply(&p->o->edits, &p->home.body.rig, p->transforms[i]);
        if (p->o->rotations) vg_player_place(p->player, p->transforms[i]);
        if (p->o->transforms) memcpy(to[i], from[i], 7 * p->count * sizeof *to[i]);
    }
    if (!p->o->transforms) vg_player_pose(p->player, p->n, from, to);
    for (size_t i = 0; i < p->n; i++) cli_stream_put(&p->out[i]);
    p->n = 0;
}

/* The transforms of n frames, measured or as they came. */
static void take_transforms(playback *p, size_t n, const vg_frame *in, double *const *to)
{
    const double *poses[BATCH] = {NULL};
    for (size_t i = 0; i < n; i++) poses[i] = in[i].values;
    for (size_t i = 0; i < n && p->driving.driver; i++)
        vg_driver_pose(p->driving.driver, poses[i], driving_take(&p->driving, &in[i]), to[i]);
    if (p->driving.driver) return;
    if (p->kind == VG_VERTICES) vg_player_measure(p->player, n, poses, to);
    for (size_t i = 0; i < n && p->kind == VG_TRANSFORMS; i++) memcpy(to[i], poses[i], 7 * p->count * sizeof *to[i]);
}

static void play_batch(void *context, size_t n, vg_frame *in)
{
    playback *p = context;
    vg_err e;
    take_transforms(p, n, in, p->transforms);
    for (size_t i = 0; i < n; i++)
        if (vg_frame_label(&p->out[i], &in[i], &e) < 0) cli_die(&e);
    p->n = n;
    put_batch(p);
}

/* ---- between keys ---- */

static void add_key(void *context, size_t n, vg_frame *in)
{
    playback *p = context;
    key_list *k = &p->keys;
    for (size_t i = 0; i < n; i++) {
        if (k->n == k->cap) {
            k->cap = 2 * k->cap + 16;
            k->label = cli_resize(k->label, k->cap, sizeof *k->label, "the keys");
            k->transforms = cli_resize(k->transforms, k->cap, sizeof *k->transforms, "the keys");
        }
        k->label[k->n] = (pose_key){cli_copy_text(in[i].name, "the keys"), in[i].has_time, in[i].time};
        k->transforms[k->n] = cli_allocate(7 * p->count, sizeof(double), "the transforms");
        take_transforms(p, 1, &in[i], &k->transforms[k->n++]);
    }
}

static void put_moment(playback *p, const key_list *k, double t)
{
    size_t last = k->n - 1, i = t > 0 ? (size_t)floor(t < (double)last ? t : (double)last) : 0;
    if (i == last && i > 0) i--;
    if (k->n == 1) memcpy(p->transforms[p->n], k->transforms[0], 7 * p->count * sizeof(double));
    else vg_player_between(p->player, k->transforms[i], k->transforms[i + 1], t - (double)i, p->transforms[p->n]);
    key_label(&p->out[p->n], k->label, k->n, t);
    if (++p->n == p->most) put_batch(p);
}

static void play_between(void *context)
{
    playback *p = context;
    if (p->keys.n == 0) cli_stop(VG_EINPUT, "the input has no poses to interpolate");
    for (size_t i = 0; i < (size_t)p->o->between.count; i++) {
        put_moment(p, &p->keys, pose_times_at(&p->o->between, i, p->keys.n));
        cli_progress_of("poses", i + 1, (uint64_t)p->o->between.count);
    }
    put_batch(p);
}

/* ---- with feet that stand ---- */

static void play_standing(void *context)
{
    playback *p = context;
    key_list *k = &p->keys;
    vg_err e;
    if (k->n && vg_feet_hold(&p->home.body.rig, k->n, k->transforms, &e) < 0) cli_die(&e);
    for (size_t i = 0; i < k->n; i++) {
        memcpy(p->transforms[p->n], k->transforms[i], 7 * p->count * sizeof(double));
        key_label(&p->out[p->n], k->label, k->n, (double)i);
        if (++p->n == p->most) put_batch(p);
        cli_progress_of("poses", i + 1, k->n);
    }
    put_batch(p);
}

/* The reference pose, edited, is all there is. */
static void play_reference(playback *p)
{
    vg_err e;
    for (size_t i = 0; i < p->count; i++) p->transforms[0][7 * i] = 1;
    if (vg_frame_rename(&p->out[0], p->h->body.reference_name, &e) < 0) cli_die(&e);
    p->n = 1;
    put_batch(p);
}

static void prepare(void *context, vg_head *h, vg_frame *in)
{
    playback *p = context;
    vg_err e;
    p->h = h;
    load_map(p);
    if (in) check_input(p);
    else p->count = p->map.n, h->precision = p->home.precision;
    bone_edits_find(&p->o->edits, &p->map, &p->home.body.rig, p->o->map);
    if (vg_player_new(&p->player, &p->home.body, &p->map, h->precision == VG_F32, cli_threads(), &e) < 0) cli_die(&e);
    make_head(p);
    for (size_t i = 0; i < p->most; i++) {
        p->transforms[i] = cli_allocate(7 * p->count, sizeof(double), "the transforms");
        if (vg_frame_shape(&p->out[i], h, &e) < 0) cli_die(&e);
    }
}

void playback_run(playback_options *o, vg_source *s)
{
    static playback p; /* lives until the end; the process releases it */
    static vg_head alone;
    p.o = o, p.most = o->live ? 1 : BATCH;
    step play = {.batch = p.most, .unit = "poses", .init = prepare, .process = play_batch};
    if (o->between.count) play.process = add_key, play.finish = play_between;
    if (o->feet) play.process = add_key, play.finish = play_standing;
    if (s) {
        step_run(&play, &p, s);
        return;
    }
    prepare(&p, &alone, NULL);
    cli_stream_open(&alone);
    play_reference(&p);
    cli_stream_end(NULL);
}
