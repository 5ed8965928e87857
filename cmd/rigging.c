/* rigging.c: --skeleton and --groups of vg-fitmap: fits a rig and its map to poses and a skeleton, known or not. Maps
 * of patches are in vg-fitmap.c, rigs are driven in playback.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "rigging.h"
#include "driving.h"
#include "rig_choice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLE = 64 };

bool rigging_wanted(const rigging_options *o)
{
    return o->skeleton || o->groups || o->bones;
}

static bool by_skinning(const rigging_options *o)
{
    return o->method == RIGGING_METHOD_NOT_GIVEN ? o->bones > 0 : o->method == VG_RIG_LBS;
}

static bool by_choice(const rigging_options *o)
{
    return o->method == RIGGING_METHOD_NOT_GIVEN ? !o->bones : o->method == RIGGING_METHOD_AUTO;
}

void rigging_take_root(const char *text, void *context)
{
    rigging_options *o = context;
    o->has_root = cli_parse_numbers(text, o->root_at, 3) == 3;
    if (!o->has_root) cli_usage("option '--root-at' needs X,Y,Z, not '%s'", text);
}

/* ---- what is at hand ---- */

/* Poses of a skeleton, frame after frame. */
typedef struct motion {
    vg_skeleton skeleton;
    size_t n, cap;
    double *positions, *turns; /* n x 3 and 4 per joint */
} motion;

typedef struct work {
    const rigging_options *o;
    vg_head *h;
    fitting poses;
    size_t reference; /* the first pose that is the reference; poses.n: none is */
    size_t nsample, sample_at[SAMPLE];
    double *sample[SAMPLE];
    motion given;
    vg_joint_groups groups;
    vg_inverse_skin *inverse; /* NULL: motions are known, or bones are free */
    vg_free_bones *free;      /* NULL: bones have a skeleton */
    double **transforms; /* of each pose */
    vg_map maps[2];      /* by vg_rig_method; the envelope only when it is asked for */
    rig_choice choice;
    fitting_errors errors[2][2]; /* envelope, skinning; fitted, left out */
} work;

static void *rig_array(size_t n, size_t size)
{
    return cli_allocate(n, size, "the rig and its poses");
}

/* ---- poses ---- */

static void look_for_reference(void *context, const fitting_batch *b)
{
    work *w = context;
    for (size_t i = 0; i < b->n && w->reference == w->poses.n; i++)
        if (!memcmp(b->values[i], w->h->body.reference, 3 * w->h->body.mesh.nv * sizeof(double)))
            w->reference = b->index[i];
}

static void read_poses(work *w, vg_source *s)
{
    fitting_collect(&w->poses, s, w->o->holdout, "fit a rig to");
    w->reference = w->poses.n;
    fitting_pass(&w->poses, NULL, look_for_reference, w);
    w->nsample = fitting_sample(&w->poses, SAMPLE, w->sample_at, w->sample);
}

/* ---- the skeleton ---- */

static void keep_motion(motion *m, const vg_frame *f, vg_joint_fitter *fitter)
{
    size_t joints = m->skeleton.njoints;
    if (m->n == m->cap) {
        m->cap = 2 * m->cap + 16;
        m->positions = cli_resize(m->positions, m->cap, 3 * joints * sizeof *m->positions, "the skeleton's motion");
        m->turns = cli_resize(m->turns, m->cap, 4 * joints * sizeof *m->turns, "the skeleton's motion");
    }
    memcpy(m->positions + 3 * joints * m->n, f->values, 3 * joints * sizeof *m->positions);
    memcpy(m->turns + 4 * joints * m->n++, driving_turns(fitter, f), 4 * joints * sizeof *m->turns);
}

static void read_skeleton(work *w)
{
    vg_err e;
    vg_source *s;
    vg_frame f = {0};
    vg_joint_fitter *fitter;
    if (vg_source_open(&s, &w->o->skeleton, 1, &e) < 0) cli_die(&e);
    vg_head *h = vg_source_head(s);
    if (!h->body.skeleton.njoints || h->kind != VG_VERTICES)
        cli_stop(VG_EINPUT, "'%s' holds no skeleton: give a BVH file, or lines of 'bone parent head tail'",
                 w->o->skeleton);
    if (vg_skeleton_copy(&w->given.skeleton, &h->body.skeleton, &e) < 0 ||
        vg_joint_fitter_new(&fitter, &w->given.skeleton, &e) < 0)
        cli_die(&e);
    while (cli_next(s, &f)) keep_motion(&w->given, &f, fitter);
    if (vg_head_merge_trace(w->h, h, &e) < 0) cli_die(&e);
    vg_joint_fitter_free(&fitter);
    vg_frame_clear(&f);
    vg_source_close(&s);
}

/* The root to where the user says, all joints along. */
static void move_root(const vg_skeleton *s, const double *at, double *positions)
{
    double shift[3];
    for (int k = 0; k < 3; k++) shift[k] = at[k] - positions[k];
    for (size_t j = 0; j < s->njoints; j++)
        for (size_t k = 0; k < 3; k++) positions[3 * j + k] += shift[k];
}

static void locate_root(work *w, double *positions)
{
    vg_err e;
    const motion *m = &w->given;
    const double *poses[SAMPLE], *at[SAMPLE], *turns[SAMPLE];
    double shift[3], spread, d = vg_diagonal(w->h->body.reference, w->h->body.mesh.nv);
    size_t joints = m->skeleton.njoints;
    for (size_t i = 0; i < w->nsample; i++) {
        poses[i] = w->sample[i];
        at[i] = m->positions + 3 * joints * w->sample_at[i], turns[i] = m->turns + 4 * joints * w->sample_at[i];
    }
    if (vg_rig_locate(&m->skeleton, w->h->body.mesh.nv, w->h->body.reference, w->nsample, poses, at, turns,
                      cli_threads(), shift, &spread, &e) < 0)
        cli_die(&e);
    for (size_t j = 0; j < joints; j++)
        for (size_t k = 0; k < 3; k++) positions[3 * j + k] += shift[k];
    cli_note("the root of the skeleton is at %.6g %.6g %.6g in the reference pose, the vertices agree to %.2g D",
             positions[0], positions[1], positions[2], d > 0 ? spread / d : 0);
    if (d > 0 && spread > 0.05 * d)
        cli_warn("the vertices disagree about the position of the skeleton in the reference pose (%.2g D): does its "
                 "motion belong to these poses? if not, --learn",
                 spread / d);
}

static void warn_outside(const work *w)
{
    const vg_rig *r = &w->h->body.rig;
    double low[3], high[3], d = vg_diagonal(w->h->body.reference, w->h->body.mesh.nv);
    size_t outside = 0;
    for (size_t v = 0; v < w->h->body.mesh.nv; v++)
        for (size_t k = 0; k < 3; k++) {
            double x = w->h->body.reference[3 * v + k];
            low[k] = v == 0 || x < low[k] ? x : low[k], high[k] = v == 0 || x > high[k] ? x : high[k];
        }
    for (size_t b = 0; b < r->nbones; b++) {
        const double *x = r->at + 3 * (size_t)r->bone[b];
        bool in = true;
        for (int k = 0; k < 3; k++) in &= x[k] > low[k] - 0.1 * d && x[k] < high[k] + 0.1 * d;
        outside += !in;
    }
    if (2 * outside > r->nbones)
        cli_warn(
            "%zu of %zu bones are outside the mesh in the reference pose: give the position of the root with "
            "--root-at",
            outside, r->nbones);
}

/* The skeleton in the reference pose of the mesh, and whether its motion is that of the poses. */
static void place_skeleton(work *w)
{
    vg_err e;
    const motion *m = &w->given;
    size_t joints = m->skeleton.njoints;
    double *positions = rig_array(3 * joints, sizeof *positions), *turns = rig_array(4 * joints, sizeof *turns);
    bool known = m->n == w->poses.n && !w->o->learn;
    vg_skeleton_pose(&m->skeleton, NULL, positions, turns);
    if (!known && !w->o->learn && m->n > 1)
        cli_stop(VG_EINPUT,
                 "'%s' has %zu frames and there are %zu poses: give one frame for each pose, or --learn the "
                 "motion from the poses",
                 w->o->skeleton, m->n, w->poses.n);
    if (known ? w->reference < w->poses.n : m->n == 1) {
        size_t frame = known ? w->reference : 0;
        memcpy(positions, m->positions + 3 * joints * frame, 3 * joints * sizeof *positions);
        memcpy(turns, m->turns + 4 * joints * frame, 4 * joints * sizeof *turns);
    } else if (known && !w->o->has_root) {
        locate_root(w, positions);
    }
    if (w->o->has_root) {
        move_root(&m->skeleton, w->o->root_at, positions);
    } else if (!known && m->n > 1) {
        cli_warn("the root of the skeleton is assumed at its offset, %g %g %g, in the reference pose: --root-at "
                 "changes this",
                 positions[0], positions[1], positions[2]);
    }
    if (vg_rig_make(&w->h->body.rig, &m->skeleton, positions, turns, &e) < 0) cli_die(&e);
    free(positions);
    free(turns);
    warn_outside(w);
    if (known) return;
    double miss, d = vg_diagonal(w->h->body.reference, w->h->body.mesh.nv);
    cli_working("learning how bones move");
    if (vg_rig_learn(&w->h->body.rig, w->h->body.mesh.nv, w->h->body.reference, w->nsample, (const double *const *)w->sample, cli_threads(), &miss, &e) < 0 ||
        vg_inverse_skin_new(&w->inverse, &w->h->body.rig, w->h->body.mesh.nv, w->h->body.reference, cli_threads(), &e) < 0)
        cli_die(&e);
    cli_note("the motion of the bones was learned from %zu poses: residual of skinning %.3g D", w->nsample,
             d > 0 ? miss / d : 0);
}

static void read_groups(work *w)
{
    vg_err e;
    size_t n;
    vg_skeleton s;
    char *text = cli_read_file(w->o->groups, &n), name[200];
    snprintf(name, sizeof name, "'%.190s'", w->o->groups);
    if (vg_joint_groups_read(&w->groups, text, n, 0, name, &e) < 0 ||
        vg_joint_groups_skeleton(&w->groups, w->h->body.mesh.nv, w->h->body.reference, &s, &e) < 0)
        cli_die(&e);
    double *positions = rig_array(3 * s.njoints, sizeof *positions), *turns = rig_array(4 * s.njoints, sizeof *turns);
    vg_skeleton_pose(&s, NULL, positions, turns);
    if (vg_rig_make(&w->h->body.rig, &s, positions, turns, &e) < 0) cli_die(&e);
    vg_skeleton_clear(&s);
    free(positions);
    free(turns);
    free(text);
}

/* Bones without a skeleton. */
static void find_bones(work *w)
{
    vg_err e;
    double miss, d = vg_diagonal(w->h->body.reference, w->h->body.mesh.nv);
    size_t nv = w->h->body.mesh.nv, wanted = (size_t)w->o->bones;
    if (vg_rig_decompose(&w->h->body.rig, nv, w->h->body.reference, wanted, w->nsample,
                         (const double *const *)w->sample, cli_threads(), &miss, &e) < 0 ||
        vg_free_bones_new(&w->free, &w->h->body.rig, nv, w->h->body.reference, cli_threads(), &e) < 0)
        cli_die(&e);
    if (w->h->body.rig.nbones < wanted)
        cli_note("%zu bones are all that the poses determine, %zu were requested", w->h->body.rig.nbones, wanted);
    cli_note("the bones were found in %zu poses: residual of skinning %.3g D", w->nsample, d > 0 ? miss / d : 0);
}

/* ---- the fit ---- */

static vg_rig_fitter *rig_fitter;

static void measure_transforms(work *w, const fitting_batch *b)
{
    const vg_rig *r = &w->h->body.rig;
    size_t joints = r->skeleton.njoints;
    size_t first = b->index[0]; /* all poses take part: their numbers follow one another */
    if (w->inverse) {
        vg_inverse_skin_fit(w->inverse, b->n, b->values, w->transforms + first);
        return;
    }
    if (w->free) {
        vg_free_bones_fit(w->free, b->n, b->values, w->transforms + first);
        return;
    }
    double *positions = NULL, *turns = NULL;
    if (w->o->groups) positions = rig_array(3 * joints, sizeof *positions), turns = rig_array(4 * joints, sizeof *turns);
    for (size_t i = 0; i < b->n; i++) {
        size_t k = first + i;
        if (w->o->groups) {
            vg_joint_groups_pose(&w->groups, w->h->body.reference, b->values[i], positions, turns);
            vg_rig_transforms(r, positions, turns, w->transforms[k]);
        } else {
            vg_rig_transforms(r, w->given.positions + 3 * joints * k, w->given.turns + 4 * joints * k,
                              w->transforms[k]);
        }
    }
    free(positions);
    free(turns);
}

static void add_fitted(void *context, const fitting_batch *b)
{
    work *w = context;
    const double *poses[FITTING_BATCH], *transforms[FITTING_BATCH];
    size_t count = 0;
    for (size_t i = 0; i < b->n; i++) {
        if (fitting_is_held_out(&w->poses, b->index[i])) continue;
        poses[count] = b->values[i], transforms[count++] = w->transforms[b->index[i]];
    }
    vg_rig_fitter_add(rig_fitter, count, poses, transforms);
}

static void fit_batch(void *context, const fitting_batch *b)
{
    work *w = context;
    for (size_t i = 0; i < b->n; i++)
        w->transforms[b->index[i]] = rig_array(7 * w->h->body.rig.nbones, sizeof(double));
    measure_transforms(w, b);
    add_fitted(w, b);
    cli_progress_of("poses fitted", b->index[b->n - 1] + 1, w->poses.n);
}

/* ---- the report ---- */

static vg_player *players[2];

static void judge_batch(void *context, const fitting_batch *b)
{
    static double *vertices[FITTING_BATCH];
    work *w = context;
    size_t nv = w->h->body.mesh.nv;
    for (size_t i = 0; i < b->n; i++)
        if (!vertices[i]) vertices[i] = rig_array(3 * nv, sizeof(double));
    for (int method = 0; method < 2; method++) {
        if (!players[method]) continue;
        vg_player_pose(players[method], b->n, (const double *const *)w->transforms + b->index[0], vertices);
        for (size_t i = 0; i < b->n; i++)
            fitting_compare(&w->errors[method][fitting_is_held_out(&w->poses, b->index[i])], b->values[i], vertices[i],
                            nv, false);
    }
}

/* Rows of the map: `share` of the envelope, the rest of skinning. */
static void mix_rows(vg_map *m, const vg_map *skinning, const double *share)
{
    size_t width = 4 * m->n;
    for (size_t v = 0; v < m->nv; v++)
        for (size_t i = v * width; i < (v + 1) * width; i++)
            m->weights[i] = skinning->weights[i] + share[v] * (m->weights[i] - skinning->weights[i]);
}

static void report_choice(const rig_choice *c)
{
    if (c->folds < 2) cli_say("mixed: skinning alone, since a single pose cannot be held out");
    else if (c->mean > 0)
        cli_say("mixed by %zu held-out blocks of poses: envelope %.0f %%, %zu bone%s per corner, ridge %g; skinning %.0f %%",
                c->folds, 100 * c->mean, c->bones_per_corner, c->bones_per_corner == 1 ? "" : "s", c->refine,
                100 * (1 - c->mean));
    else cli_say("mixed by %zu held-out blocks of poses: skinning alone", c->folds);
}

static void report_fit(work *w)
{
    vg_err e;
    static const char *const names[2][2] = {{"envelope, fitted", "envelope, left out"},
                                            {"skinning, fitted", "skinning, left out"}};
    static const char *const mixed[2] = {"mixed, fitted", "mixed, left out"};
    size_t nv = w->h->body.mesh.nv;
    double d = vg_diagonal(w->h->body.reference, nv);
    if (cli_quiet() || !(d > 0)) return;
    for (int i = 0; i < 2; i++)
        if (w->maps[i].n && vg_player_new(&players[i], &w->h->body, &w->maps[i], false, cli_threads(), &e) < 0) cli_die(&e);
    for (int i = 0; i < 4; i++) {
        fitting_errors *x = &w->errors[i / 2][i % 2];
        x->first = rig_array(nv, sizeof *x->first), x->second = rig_array(nv, sizeof *x->second);
    }
    fitting_pass(&w->poses, NULL, judge_batch, w);
    size_t bones = w->h->body.rig.nbones;
    cli_say("%zu bone%s, %zu vertices, %zu poses; errors in 1e-3 D:  mean  sigma largest", bones, bones == 1 ? "" : "s",
            nv, w->poses.n);
    for (int i = 0; i < 4; i++) {
        const fitting_errors *x = &w->errors[i / 2][i % 2];
        if (x->poses)
            cli_say("%-18s %6zu poses %#9.3g %#9.3g %#9.3g",
                    i < 2 && by_choice(w->o) ? mixed[i] : names[i / 2][i % 2], x->poses,
                    fitting_mean(x) / d * 1e3, fitting_sigma(x, nv) / d * 1e3, x->most / d * 1e3);
    }
    if (by_choice(w->o)) report_choice(&w->choice);
    for (int i = 0; i < 2; i++) vg_player_free(&players[i]);
}

/* The map by one method, and the weights of the bones, which are the same for both. */
static void finish_map(work *w, vg_rig_method method)
{
    vg_err e;
    vg_rig rig;
    cli_working("solving for the weights");
    if (vg_rig_fitter_finish(rig_fitter, method, &rig, &w->maps[method], &e) < 0) cli_die(&e);
    vg_head_put(w->h, &rig, "rig");
}

static void fit_rig(work *w)
{
    vg_err e;
    vg_head *h = w->h;
    vg_rig_options o = {.bones_per_corner = w->o->bones_per_corner ? (size_t)w->o->bones_per_corner : 2,
                        .hold = w->o->hold,
                        .refine = w->o->refine < 0 ? 0.003 : w->o->refine,
                        .threads = cli_threads()};
    if (vg_head_prepare_vectors(h, &e) < 0 || vg_rig_fitter_new(&rig_fitter, h, &o, &e) < 0) cli_die(&e);
    w->transforms = rig_array(w->poses.n, sizeof *w->transforms);
    fitting_pass(&w->poses, NULL, fit_batch, w);
    finish_map(w, VG_RIG_LBS);
    if (by_choice(w->o)) {
        rig_choose(&w->poses, w->transforms, &o, w->o->bones_per_corner > 0, w->o->refine >= 0, &w->choice);
        vg_rig_fitter_choose(rig_fitter, w->choice.bones_per_corner, w->choice.refine);
    }
    if (!by_skinning(w->o)) finish_map(w, VG_RIG_ENVELOPE);
    if (by_choice(w->o)) mix_rows(&w->maps[VG_RIG_ENVELOPE], &w->maps[VG_RIG_LBS], w->choice.share);
    vg_rig_fitter_free(&rig_fitter);
}

void rigging_run(vg_source *s, const rigging_options *o)
{
    static work w; /* lives until the end; the process releases it */
    w.o = o;
    w.h = vg_source_head(s);
    if (w.h->body.skeleton.njoints) cli_stop(VG_EINPUT, "the input is a skeleton: vg-fitmap takes poses of a mesh");
    if (!w.h->body.mesh.nf) cli_stop(VG_EINPUT, "the input has no faces");
    vg_rig_clear(&w.h->body.rig);
    vg_map_clear(&w.h->map);
    if (o->skeleton) read_skeleton(&w);
    read_poses(&w, s);
    if (!w.nsample) cli_stop(VG_EINPUT, "all poses are held out of the fit: raise --holdout");
    if (o->groups) read_groups(&w);
    else if (o->bones) find_bones(&w);
    else place_skeleton(&w);
    fit_rig(&w);
    report_fit(&w);
    vg_head_put(w.h, &w.maps[by_skinning(o) ? VG_RIG_LBS : VG_RIG_ENVELOPE], "map");
    fitting_clear(&w.poses);
}
