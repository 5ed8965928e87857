/* vg-fitmap: fit a map from the motions of patches or bones to the vertices of a body.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "rigging.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct {
    const char *patches;
    long holdout;
    double hold;
} opts = {.hold = 0.03};

static const cli_option options[] = {
    {"patches", 0, "FILE", "the patches: what vg-segment wrote; default: those of the input", .text = &opts.patches,
     .reads = true, .excludes = "skeleton|groups|bones"},
    {"skeleton", 0, "FILE", "a skeleton drives the mesh: BVH, a stream of it, or lines of text",
     .text = &rigging.skeleton, .reads = true, .excludes = "groups|bones"},
    {"groups", 0, "FILE", "a skeleton drives the mesh: each joint is the mean of some of its vertices",
     .text = &rigging.groups, .reads = true, .excludes = "bones"},
    {"bones", 0, "N", "no skeleton: find N bones that move freely, with their motions, in the poses",
     .integer = &rigging.bones, .least = 1, .most = 65536},
    {"learn", 0, NULL, "with --skeleton: find its motion from the poses, whatever motion it comes with",
     .flag = &rigging.learn, .needs = "skeleton"},
    {"root-at", 0, "X,Y,Z", "with --skeleton: where its root is in the reference pose",
     .take = rigging_take_root, .needs = "skeleton"},
    {"method", 0, "envelope|lbs",
     "with bones: vectors and held vertices (default), or linear blend skinning alone",
     .choice = &rigging.method, .needs = "skeleton|groups|bones"},
    {"bones-per-corner", 0, "N", "with bones: how many bones drive a corner, 1 or 2 (default 2)",
     .integer = &rigging.bones_per_corner, .least = 1, .most = 2, .needs = "skeleton|groups|bones"},
    {"refine", 0, "RIDGE",
     "with bones: the ridge with which bones take up what is left (default 0.003; 0: they do not)",
     .number = &rigging.refine, .least = 0, .most = 1e6, .needs = "skeleton|groups|bones"},
    {"holdout", 0, "N", "leave every Nth pose out of the fit, and report the error there", .integer = &opts.holdout,
     .least = 2, .most = 1000000000},
    {"hold", 0, "SHARE", "of the vertices, those that go where their patch or bones take them (default 0.03)",
     .number = &opts.hold, .least = 0, .most = 1},
    {.name = NULL}};

static const cli_moved moved[] = {{"retarget", "is now the program vg-retarget: vg-retarget --onto MESH MAP"},
                                  {"morph", "is now an option of vg-retarget: vg-retarget --onto MESH --morph 0.5 MAP"},
                                  {.name = NULL}};

static const cli_program program = {
    .name = "vg-fitmap",
    .synopsis = "[options] [FILE ...]",
    .summary = "fit a map from the motions of patches or bones to vertices",
    .options = options,
    .moved = moved,
    .most_operands = SIZE_MAX,
    .writes_stream = true,
    .writes_map = true,
    .threaded = true};

enum { BATCH = 32 };
static const size_t in_memory = (size_t)256 << 20; /* bytes of poses that wait for the second pass */

/* ---- fitting ---- */

static void take_patches(vg_head *h)
{
    vg_err e;
    vg_head from = {0};
    char name[200];
    if (!opts.patches) {
        if (!h->body.patches.n) cli_usage("the input has no patches: name them with --patches, made by vg-segment");
        return;
    }
    snprintf(name, sizeof name, "'%.190s'", opts.patches);
    if (vg_load(&from, opts.patches, "patches", &e) < 0 ||
        vg_mesh_same(&h->body.mesh, "the sequence", &from.body.mesh, name, &e) < 0 ||
        vg_head_merge_trace(h, &from, &e) < 0)
        cli_die(&e);
    vg_patches_clear(&h->body.patches);
    h->body.patches = from.body.patches;
    from.body.patches = (vg_patches){0};
    vg_head_clear(&from);
}

static bool is_left_out(uint64_t i)
{
    return opts.holdout && i % (uint64_t)opts.holdout == (uint64_t)opts.holdout - 1;
}

/* Poses that are fitted to go to the fitter; all go to the spool, for the report. */
static uint64_t read_poses(vg_source *s, vg_map_fitter *f, vg_spool *spool)
{
    static vg_frame frames[8];
    const double *poses[8];
    vg_err e;
    uint64_t total = 0;
    size_t n = 0;
    while (cli_next(s, &frames[n])) {
        if (vg_spool_put(spool, &frames[n], &e) < 0) cli_die(&e);
        cli_progress("poses", total + 1);
        if (is_left_out(total++)) continue;
        poses[n] = frames[n].values;
        if (++n < 8) continue;
        if (vg_map_fitter_add(f, n, poses, &e) < 0) cli_die(&e);
        n = 0;
    }
    if (vg_map_fitter_add(f, n, poses, &e) < 0) cli_die(&e);
    for (size_t i = 0; i < 8; i++) vg_frame_clear(&frames[i]);
    return total;
}

/* ---- the report ---- */

/* Sums over vertices of the distance between poses whose centroids have been laid on one another. */
typedef struct errors {
    double sum, most;
    uint64_t poses;
} errors;

static void compare(errors *x, const double *truth, const double *result, size_t nv)
{
    double a[3], b[3];
    vg_centroid(truth, nv, a);
    vg_centroid(result, nv, b);
    for (size_t v = 0; v < nv; v++) {
        double square = 0;
        for (size_t k = 0; k < 3; k++) {
            double d = (truth[3 * v + k] - a[k]) - (result[3 * v + k] - b[k]);
            square += d * d;
        }
        double far = sqrt(square);
        x->sum += far / (double)nv;
        if (far > x->most) x->most = far;
    }
    x->poses++;
}

typedef struct judging {
    const vg_head *h;
    vg_player *player;
    vg_frame truth[BATCH];
    double *transforms[BATCH], *vertices[BATCH];
    errors x[2][2]; /* given motions, rotations alone; fitted, left out */
} judging;

static void judge_batch(judging *j, size_t n, uint64_t first)
{
    const double *truth[BATCH];
    for (size_t i = 0; i < n; i++) truth[i] = j->truth[i].values;
    vg_player_measure(j->player, n, truth, j->transforms);
    for (int way = 0; way < 2; way++) {
        for (size_t i = 0; i < n && way == 1; i++) vg_player_place(j->player, j->transforms[i]);
        vg_player_pose(j->player, n, (const double *const *)j->transforms, j->vertices);
        for (size_t i = 0; i < n; i++)
            compare(&j->x[way][is_left_out(first + i)], truth[i], j->vertices[i], j->h->body.mesh.nv);
    }
}

static void describe(const errors *x, double d, const char *what, const char *which)
{
    if (x->poses)
        cli_say("%s, %s: mean error %.3g D, largest %.3g D, %llu poses", which, what, x->sum / (double)x->poses / d,
                x->most / d, (unsigned long long)x->poses);
}

static void report(const vg_head *h, vg_spool *spool)
{
    static judging j;
    vg_err e;
    double d = vg_diagonal(h->body.reference, h->body.mesh.nv);
    if (cli.quiet || !(d > 0)) return;
    j.h = h;
    if (vg_player_new(&j.player, h, false, cli.threads, &e) < 0) cli_die(&e);
    for (size_t i = 0; i < BATCH; i++) {
        j.transforms[i] = cli_allocate(7 * h->map.n, sizeof(double), "the report");
        j.vertices[i] = cli_allocate(3 * h->body.mesh.nv, sizeof(double), "the report");
    }
    uint64_t first = 0;
    int r;
    do {
        size_t n = 0;
        while (n < BATCH && (r = vg_spool_next(spool, &j.truth[n], &e)) > 0) n++;
        if (r < 0) cli_die(&e);
        judge_batch(&j, n, first);
        first += n;
    } while (r > 0);
    for (size_t i = 0; i < BATCH; i++) {
        vg_frame_clear(&j.truth[i]);
        free(j.transforms[i]);
        free(j.vertices[i]);
    }
    vg_player_free(&j.player);
    for (int left = 0; left < 2; left++) {
        const char *which = left ? "left out" : "fitted";
        describe(&j.x[0][left], d, "patch motions given", which);
        describe(&j.x[1][left], d, "rotations alone", which);
    }
}

static void fit(vg_source *s)
{
    vg_err e;
    vg_head *h = vg_source_head(s);
    cli_need_vertices(h, "the input");
    if (rigging_wanted()) {
        rigging_run(s, opts.hold, opts.holdout);
        return;
    }
    take_patches(h);
    size_t before = h->body.patches.n;
    vg_map_fitter *f;
    vg_spool *spool;
    if (vg_map_fitter_new(&f, h, opts.hold, cli.threads, &e) < 0 || vg_spool_new(&spool, h, in_memory, &e) < 0)
        cli_die(&e);
    if (h->body.patches.n != before)
        cli_note("%zu patches are in %zu pieces, each of which is a patch of the map", before, h->body.patches.n);
    if (!read_poses(s, f, spool)) cli_stop(VG_EINPUT, "the input has no poses to fit a map to");
    if (vg_map_fitter_finish(f, &e) < 0) cli_die(&e);
    vg_map_fitter_free(&f);
    report(h, spool);
    vg_spool_free(&spool);
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    vg_source *s = cli_source(operands, n);
    fit(s);
    cli_stream_open(vg_source_head(s));
    cli_stream_end(vg_source_tail(s));
    vg_source_close(&s);
    cli_finish(0);
}
