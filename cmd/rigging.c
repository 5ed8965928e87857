/* rigging.c: --skeleton and --groups of vg-fitmap: poses and what is known of a skeleton become a rig and its map.
 * Leaves out maps of patches (vg-fitmap.c) and driving a rig (playback.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "rigging.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { METHOD_NOT_GIVEN = 2 };

struct rigging_options rigging = {.method = METHOD_NOT_GIVEN, .bones_per_corner = 2, .refine = 0.003};

enum { BATCH = 32, SAMPLE = 32 };
static const size_t in_memory = (size_t)256 << 20; /* bytes of poses that wait for the next pass */

bool rigging_wanted(void)
{
    return rigging.skeleton || rigging.groups || rigging.bones;
}

static bool by_skinning(void)
{
    return rigging.method == VG_RIG_LBS;
}

void rigging_take_root(const char *text, void *context)
{
    (void)context;
    rigging.has_root = cli_parse_numbers(text, rigging.root_at, 3) == 3;
    if (!rigging.has_root) cli_usage("option '--root-at' needs X,Y,Z, not '%s'", text);
}

/* ---- what is at hand ---- */

/* Poses of a skeleton, frame after frame. */
typedef struct motion {
    vg_skeleton skeleton;
    size_t n, cap;
    double *positions, *turns; /* n x 3 and 4 per joint */
} motion;

typedef struct errors {
    double sum, most;
    uint64_t poses;
    double *first, *second; /* per vertex: sums of the error and of its square */
} errors;

typedef struct work {
    vg_head *h;
    long holdout;
    vg_spool *spool;           /* all poses, for the next pass */
    uint64_t total, reference; /* poses; the first that is the reference, total: none is */
    size_t nsample;            /* of the poses that are fitted, evenly spaced: */
    uint64_t stride, sample_at[2 * SAMPLE];
    double *sample[2 * SAMPLE];
    motion given;
    vg_joint_groups groups;
    vg_inverse_skin *inverse; /* NULL: motions are known, or bones are free */
    vg_free_bones *free;      /* NULL: bones have a skeleton */
    double **transforms; /* of each pose */
    vg_map skinning;     /* linear blend skinning as a map, beside the envelope */
    errors errors[2][2]; /* envelope, skinning; fitted, left out */
} work;

static bool is_left_out(const work *w, uint64_t i)
{
    return w->holdout && i % (uint64_t)w->holdout == (uint64_t)w->holdout - 1;
}

static void *room(size_t n, size_t size)
{
    return cli_allocate(n, size, "the rig and its poses");
}

/* ---- poses ---- */

/* Keeps every stride-th of the fitted poses; when there is no room, every second of these. */
static void sample_pose(work *w, uint64_t i, const double *pose)
{
    size_t bytes = 3 * w->h->body.mesh.nv * sizeof *pose;
    if (is_left_out(w, i) || i % w->stride) return;
    if (w->nsample == 2 * SAMPLE) {
        size_t n = 0;
        w->stride *= 2;
        for (size_t k = 0; k < w->nsample; k++) {
            if (w->sample_at[k] % w->stride == 0) {
                w->sample_at[n] = w->sample_at[k];
                double *kept = w->sample[k];
                w->sample[k] = w->sample[n], w->sample[n++] = kept;
            }
        }
        w->nsample = n;
        if (i % w->stride) return;
    }
    double **to = &w->sample[w->nsample];
    if (!*to) *to = room(3 * w->h->body.mesh.nv, sizeof **to);
    w->sample_at[w->nsample++] = i;
    memcpy(*to, pose, bytes);
}

static void read_poses(work *w, vg_source *s)
{
    vg_err e;
    vg_frame f = {0};
    bool found = false;
    if (vg_spool_new(&w->spool, w->h, in_memory, &e) < 0) cli_die(&e);
    for (w->stride = 1; cli_next(s, &f); w->total++) {
        if (vg_spool_put(w->spool, &f, &e) < 0) cli_die(&e);
        if (!found && !memcmp(f.values, w->h->body.reference, 3 * w->h->body.mesh.nv * sizeof *f.values))
            found = true, w->reference = w->total;
        sample_pose(w, w->total, f.values);
        cli_progress("poses", w->total + 1);
    }
    if (!found) w->reference = w->total;
    vg_frame_clear(&f);
    if (!w->total) cli_stop(VG_EINPUT, "the input has no poses to fit a rig to");
}

/* All poses once more, in batches; they go back into the spool. */
static void pass(work *w, void (*step)(work *w, uint64_t first, size_t n, const vg_frame *frames))
{
    static vg_frame frames[BATCH];
    vg_err e;
    for (uint64_t first = 0; first < w->total;) {
        size_t n = 0;
        for (; n < BATCH && first + n < w->total; n++) {
            int r = vg_spool_next(w->spool, &frames[n], &e);
            if (r < 0 || vg_spool_put(w->spool, &frames[n], &e) < 0) cli_die(&e);
        }
        step(w, first, n, frames);
        first += n;
    }
}

/* ---- the skeleton ---- */

static void keep_motion(motion *m, const vg_frame *f, vg_joint_fitter *fitter)
{
    size_t joints = m->skeleton.njoints, which;
    const double *turns = f->turns;
    if (m->n == m->cap) {
        m->cap = 2 * m->cap + 16;
        m->positions = cli_resize(m->positions, m->cap, 3 * joints * sizeof *m->positions, "the skeleton's motion");
        m->turns = cli_resize(m->turns, m->cap, 4 * joints * sizeof *m->turns, "the skeleton's motion");
    }
    if (!f->nturns) {
        vg_joint_fitter_fit(fitter, f->values, NULL, NULL, &which);
        turns = vg_joint_fitter_turns(fitter);
    }
    memcpy(m->positions + 3 * joints * m->n, f->values, 3 * joints * sizeof *m->positions);
    memcpy(m->turns + 4 * joints * m->n++, turns, 4 * joints * sizeof *m->turns);
}

static void read_skeleton(work *w)
{
    vg_err e;
    vg_source *s;
    vg_frame f = {0};
    vg_joint_fitter *fitter;
    if (vg_source_open(&s, &rigging.skeleton, 1, &e) < 0) cli_die(&e);
    vg_head *h = vg_source_head(s);
    if (!h->body.skeleton.njoints || h->kind != VG_VERTICES)
        cli_stop(VG_EINPUT, "'%s' holds no skeleton: give a BVH file, or lines of 'bone parent head tail'",
                 rigging.skeleton);
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
    const double *poses[2 * SAMPLE], *at[2 * SAMPLE], *turns[2 * SAMPLE];
    double shift[3], spread, d = vg_diagonal(w->h->body.reference, w->h->body.mesh.nv);
    size_t joints = m->skeleton.njoints;
    for (size_t i = 0; i < w->nsample; i++) {
        poses[i] = w->sample[i];
        at[i] = m->positions + 3 * joints * w->sample_at[i], turns[i] = m->turns + 4 * joints * w->sample_at[i];
    }
    if (vg_rig_locate(&m->skeleton, w->h->body.mesh.nv, w->h->body.reference, w->nsample, poses, at, turns,
                      cli.threads, shift, &spread, &e) < 0)
        cli_die(&e);
    for (size_t j = 0; j < joints; j++)
        for (size_t k = 0; k < 3; k++) positions[3 * j + k] += shift[k];
    cli_note("the root of the skeleton is at %.6g %.6g %.6g in the reference pose, the vertices agree to %.2g D",
             positions[0], positions[1], positions[2], d > 0 ? spread / d : 0);
    if (d > 0 && spread > 0.05 * d)
        cli_warn("the vertices do not agree about where the skeleton is in the reference pose (%.2g D): does its "
                 "motion belong to these "
                 "poses? if not, --learn",
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
            "%zu of %zu bones are outside of the mesh in the reference pose: say where the root is with --root-at",
            outside, r->nbones);
}

/* The skeleton in the reference pose of the mesh, and whether its motion is that of the poses. */
static void place_skeleton(work *w)
{
    vg_err e;
    const motion *m = &w->given;
    size_t joints = m->skeleton.njoints;
    double *positions = room(3 * joints, sizeof *positions), *turns = room(4 * joints, sizeof *turns);
    bool known = m->n == w->total && !rigging.learn;
    vg_skeleton_pose(&m->skeleton, NULL, positions, turns);
    if (!known && !rigging.learn && m->n > 1)
        cli_stop(VG_EINPUT,
                 "'%s' has %zu frames and there are %llu poses: give one frame for each pose, or --learn the "
                 "motion from the poses",
                 rigging.skeleton, m->n, (unsigned long long)w->total);
    if (known ? w->reference < w->total : m->n == 1) {
        size_t frame = known ? (size_t)w->reference : 0;
        memcpy(positions, m->positions + 3 * joints * frame, 3 * joints * sizeof *positions);
        memcpy(turns, m->turns + 4 * joints * frame, 4 * joints * sizeof *turns);
    } else if (known && !rigging.has_root) {
        locate_root(w, positions);
    }
    if (rigging.has_root) {
        move_root(&m->skeleton, rigging.root_at, positions);
    } else if (!known && m->n > 1) {
        cli_warn("the root of the skeleton is taken to be at its offset, %g %g %g, in the reference pose: --root-at "
                 "says otherwise",
                 positions[0], positions[1], positions[2]);
    }
    if (vg_rig_make(&w->h->body.rig, &m->skeleton, positions, turns, &e) < 0) cli_die(&e);
    free(positions);
    free(turns);
    warn_outside(w);
    if (known) return;
    double miss, d = vg_diagonal(w->h->body.reference, w->h->body.mesh.nv);
    if (vg_rig_learn(w->h, w->nsample, (const double *const *)w->sample, cli.threads, &miss, &e) < 0 ||
        vg_inverse_skin_new(&w->inverse, &w->h->body.rig, w->h->body.mesh.nv, w->h->body.reference, cli.threads, &e) < 0)
        cli_die(&e);
    cli_note("the motion of the bones is learned from %zu poses: what skinning leaves is %.3g D", w->nsample,
             d > 0 ? miss / d : 0);
}

static void read_groups(work *w)
{
    vg_err e;
    size_t n;
    vg_skeleton s;
    char *text = cli_read_file(rigging.groups, &n), name[200];
    snprintf(name, sizeof name, "'%.190s'", rigging.groups);
    if (vg_joint_groups_read(&w->groups, text, n, 0, name, &e) < 0 ||
        vg_joint_groups_skeleton(&w->groups, w->h->body.mesh.nv, w->h->body.reference, &s, &e) < 0)
        cli_die(&e);
    double *positions = room(3 * s.njoints, sizeof *positions), *turns = room(4 * s.njoints, sizeof *turns);
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
    size_t nv = w->h->body.mesh.nv, wanted = (size_t)rigging.bones;
    if (vg_rig_decompose(&w->h->body.rig, nv, w->h->body.reference, wanted, w->nsample,
                         (const double *const *)w->sample, cli.threads, &miss, &e) < 0 ||
        vg_free_bones_new(&w->free, &w->h->body.rig, nv, w->h->body.reference, cli.threads, &e) < 0)
        cli_die(&e);
    if (w->h->body.rig.nbones < wanted)
        cli_note("%zu bones are all that the poses tell apart, %zu were asked for", w->h->body.rig.nbones, wanted);
    cli_note("the bones are found in %zu poses: what skinning leaves is %.3g D", w->nsample, d > 0 ? miss / d : 0);
}

/* ---- the fit ---- */

static vg_rig_fitter *fitter;

static void measure_transforms(work *w, uint64_t first, size_t n, const vg_frame *frames)
{
    const vg_rig *r = &w->h->body.rig;
    size_t joints = r->skeleton.njoints;
    const double *poses[BATCH];
    for (size_t i = 0; i < n; i++) poses[i] = frames[i].values;
    if (w->inverse) {
        vg_inverse_skin_fit(w->inverse, n, poses, w->transforms + first);
        return;
    }
    if (w->free) {
        vg_free_bones_fit(w->free, n, poses, w->transforms + first);
        return;
    }
    double *positions = NULL, *turns = NULL;
    if (rigging.groups) positions = room(3 * joints, sizeof *positions), turns = room(4 * joints, sizeof *turns);
    for (size_t i = 0; i < n; i++) {
        size_t k = (size_t)first + i;
        if (rigging.groups) {
            vg_joint_groups_pose(&w->groups, w->h->body.reference, poses[i], positions, turns);
            vg_rig_transforms(r, positions, turns, w->transforms[k]);
        } else {
            vg_rig_transforms(r, w->given.positions + 3 * joints * k, w->given.turns + 4 * joints * k,
                              w->transforms[k]);
        }
    }
    free(positions);
    free(turns);
}

static void fit_batch(work *w, uint64_t first, size_t n, const vg_frame *frames)
{
    const double *poses[BATCH], *transforms[BATCH];
    size_t count = 0;
    for (size_t i = 0; i < n; i++) w->transforms[first + i] = room(7 * w->h->body.rig.nbones, sizeof(double));
    measure_transforms(w, first, n, frames);
    for (size_t i = 0; i < n; i++) {
        if (is_left_out(w, first + i)) continue;
        poses[count] = frames[i].values, transforms[count++] = w->transforms[first + i];
    }
    vg_rig_fitter_add(fitter, count, poses, transforms);
    cli_progress("poses fitted", first + n);
}

/* ---- the report ---- */

static vg_player *players[2];

static void compare(errors *x, const double *truth, const double *result, size_t nv)
{
    for (size_t v = 0; v < nv; v++) {
        double square = 0;
        for (size_t k = 0; k < 3; k++)
            square += (truth[3 * v + k] - result[3 * v + k]) * (truth[3 * v + k] - result[3 * v + k]);
        double far = sqrt(square);
        x->sum += far / (double)nv, x->first[v] += far, x->second[v] += square;
        if (far > x->most) x->most = far;
    }
    x->poses++;
}

static void judge_batch(work *w, uint64_t first, size_t n, const vg_frame *frames)
{
    static double *vertices[BATCH];
    size_t nv = w->h->body.mesh.nv;
    for (size_t i = 0; i < n; i++)
        if (!vertices[i]) vertices[i] = room(3 * nv, sizeof(double));
    for (int method = 0; method < 2; method++) {
        if (!players[method]) continue;
        vg_player_pose(players[method], n, (const double *const *)w->transforms + first, vertices);
        for (size_t i = 0; i < n; i++)
            compare(&w->errors[method][is_left_out(w, first + i)], frames[i].values, vertices[i], nv);
    }
}

/* The largest over the vertices of the standard deviation over the poses (T 5.36). */
static double sigma(const errors *x, size_t nv)
{
    double most = 0, n = (double)x->poses;
    for (size_t v = 0; v < nv; v++) {
        double mean = x->first[v] / n, variance = x->second[v] / n - mean * mean;
        if (variance > most) most = variance;
    }
    return sqrt(most);
}

static void report(work *w)
{
    vg_err e;
    static vg_head skinning; /* h with another map */
    static const char *const names[2][2] = {{"envelope, fitted", "envelope, left out"},
                                            {"skinning, fitted", "skinning, left out"}};
    size_t nv = w->h->body.mesh.nv;
    double d = vg_diagonal(w->h->body.reference, nv);
    if (cli.quiet || !(d > 0)) return;
    skinning = *w->h;
    if (!by_skinning()) skinning.map = w->skinning;
    if ((!by_skinning() && vg_player_new(&players[0], w->h, false, cli.threads, &e) < 0) ||
        vg_player_new(&players[1], &skinning, false, cli.threads, &e) < 0)
        cli_die(&e);
    for (int i = 0; i < 4; i++) {
        errors *x = &w->errors[i / 2][i % 2];
        x->first = room(nv, sizeof *x->first), x->second = room(nv, sizeof *x->second);
    }
    pass(w, judge_batch);
    cli_say("%zu bones, %zu vertices, %llu poses; errors in 1e-3 D:  mean  sigma largest", w->h->body.rig.nbones, nv,
            (unsigned long long)w->total);
    for (int i = 0; i < 4; i++) {
        const errors *x = &w->errors[i / 2][i % 2];
        if (x->poses)
            cli_say("%-18s %6llu poses %#9.3g %#9.3g %#9.3g", names[i / 2][i % 2], (unsigned long long)x->poses,
                    x->sum / (double)x->poses / d * 1e3, sigma(x, nv) / d * 1e3, x->most / d * 1e3);
    }
    for (int i = 0; i < 2; i++) vg_player_free(&players[i]);
}

static void fit(work *w, double hold)
{
    vg_err e;
    vg_head *h = w->h;
    const vg_rig_options o = {.bones_per_corner = (size_t)rigging.bones_per_corner,
                              .hold = hold,
                              .refine = rigging.refine,
                              .threads = cli.threads};
    if (vg_rig_fitter_new(&fitter, h, &o, &e) < 0) cli_die(&e);
    w->transforms = room((size_t)w->total, sizeof *w->transforms);
    pass(w, fit_batch);
    if (vg_rig_fitter_finish(fitter, VG_RIG_LBS, &e) < 0) cli_die(&e);
    if (!by_skinning()) {
        w->skinning = h->map;
        h->map = (vg_map){0};
        if (vg_rig_fitter_finish(fitter, VG_RIG_ENVELOPE, &e) < 0) cli_die(&e);
    }
    vg_rig_fitter_free(&fitter);
}

void rigging_run(vg_source *s, double hold, long holdout)
{
    static work w; /* lives until the end: what it holds goes with the process */
    if (rigging.method == METHOD_NOT_GIVEN) rigging.method = rigging.bones ? VG_RIG_LBS : VG_RIG_ENVELOPE;
    w.h = vg_source_head(s), w.holdout = holdout;
    if (w.h->body.skeleton.njoints) cli_stop(VG_EINPUT, "the input is a skeleton: vg-fitmap takes poses of a mesh");
    if (!w.h->body.mesh.nf) cli_stop(VG_EINPUT, "the input has no faces");
    vg_rig_clear(&w.h->body.rig);
    vg_map_clear(&w.h->map);
    if (rigging.skeleton) read_skeleton(&w);
    read_poses(&w, s);
    if (!w.nsample) cli_stop(VG_EINPUT, "all poses are left out of the fit: raise --holdout");
    if (rigging.groups) read_groups(&w);
    else if (rigging.bones) find_bones(&w);
    else place_skeleton(&w);
    fit(&w, hold);
    report(&w);
    vg_spool_free(&w.spool);
}
