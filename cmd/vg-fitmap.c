/* vg-fitmap: fit a map from the motions of patches or bones to the vertices of a body.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "fitting.h"
#include "rigging.h"

#include <stdlib.h>
#include <string.h>

static struct {
    const char *patches;
    rigging_options rig; /* hold and holdout: of maps of patches, too */
} opts = {.rig = {.method = RIGGING_METHOD_NOT_GIVEN, .refine = -1, .hold = 0.03}};

static const cli_option options[] = {
    {"patches", 0, "FILE", "the patches, from vg-segment; default: those of the input", .text = &opts.patches,
     .reads = true, .excludes = "skeleton|groups|bones"},
    {"skeleton", 0, "FILE", "a skeleton drives the mesh: BVH, a stream of it, or lines of text",
     .text = &opts.rig.skeleton, .reads = true, .excludes = "groups|bones"},
    {"groups", 0, "FILE", "a skeleton drives the mesh: each joint is the mean of some of its vertices",
     .text = &opts.rig.groups, .reads = true, .excludes = "bones"},
    {"bones", 0, "N", "no skeleton: find N independent bones and their motions in the poses",
     .integer = &opts.rig.bones, .least = 1, .most = 65536},
    {"learn", 0, NULL, "with --skeleton: learn its motion from the poses, not from the file",
     .flag = &opts.rig.learn, .needs = "skeleton"},
    {"root-at", 0, "X,Y,Z", "with --skeleton: the position of its root in the reference pose",
     .take = rigging_take_root, .context = &opts.rig, .needs = "skeleton"},
    {"method", 0, "envelope|lbs|auto",
     "with bones: vectors and held vertices, linear blend skinning alone, or, vertex by vertex, the mixture that best "
     "predicts held-out poses (default)",
     .choice = &opts.rig.method, .needs = "skeleton|groups|bones"},
    {"bones-per-corner", 0, "N", "with bones: how many bones drive a corner, 1 or 2 (default 2)",
     .integer = &opts.rig.bones_per_corner, .least = 1, .most = 2, .needs = "skeleton|groups|bones"},
    {"refine", 0, "RIDGE",
     "with bones: the ridge of the regression of the residual on the bones (default 0.003; 0: none)",
     .number = &opts.rig.refine, .least = 0, .most = 1e6, .needs = "skeleton|groups|bones"},
    {"holdout", 0, "N", "leave every Nth pose out of the fit, and report the error there", .integer = &opts.rig.holdout,
     .least = 2, .most = 1000000000},
    {"hold", 0, "SHARE", "share of the vertices that follow their patch or bones exactly (default 0.03)",
     .number = &opts.rig.hold, .least = 0, .most = 1},
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
    cli_load(&from, opts.patches, "patches");
    if (vg_mesh_same(&h->body.mesh, "the sequence", &from.body.mesh, name, &e) < 0 ||
        vg_head_merge_trace(h, &from, &e) < 0)
        cli_die(&e);
    vg_head_take(h, &from, "patches");
    vg_head_clear(&from);
}

typedef struct patch_fit {
    const fitting *f;
    vg_map_fitter *fitter;
    vg_player *player;
    double *transforms[FITTING_BATCH], *vertices[FITTING_BATCH];
    fitting_errors errors[2][2]; /* given motions, rotations alone; fitted, left out */
} patch_fit;

static bool is_fitted(void *context, size_t i)
{
    return !fitting_is_held_out(((const patch_fit *)context)->f, i);
}

static void add_batch(void *context, const fitting_batch *b)
{
    vg_err e;
    if (vg_map_fitter_add(((patch_fit *)context)->fitter, b->n, b->values, &e) < 0) cli_die(&e);
}

/* ---- the report ---- */

static void judge_batch(void *context, const fitting_batch *b)
{
    patch_fit *x = context;
    vg_player_measure(x->player, b->n, b->values, x->transforms);
    for (int way = 0; way < 2; way++) {
        for (size_t i = 0; i < b->n && way == 1; i++) vg_player_place(x->player, x->transforms[i]);
        vg_player_pose(x->player, b->n, (const double *const *)x->transforms, x->vertices);
        for (size_t i = 0; i < b->n; i++)
            fitting_compare(&x->errors[way][fitting_is_held_out(x->f, b->index[i])], b->values[i], x->vertices[i],
                            x->f->h->body.mesh.nv, true);
    }
}

static void report_errors(const fitting_errors *x, double d, const char *what, const char *which)
{
    if (x->poses)
        cli_say("%s, %s: mean error %.3g D, largest %.3g D, %zu poses", which, what, fitting_mean(x) / d, x->most / d,
                x->poses);
}

static void report_fit(patch_fit *x)
{
    vg_err e;
    const vg_head *h = x->f->h;
    double d = vg_diagonal(h->body.reference, h->body.mesh.nv);
    if (cli_quiet() || !(d > 0)) return;
    if (vg_player_new(&x->player, &h->body, &h->map, false, cli_threads(), &e) < 0) cli_die(&e);
    for (size_t i = 0; i < FITTING_BATCH; i++) {
        x->transforms[i] = cli_allocate(7 * h->map.n, sizeof(double), "the report");
        x->vertices[i] = cli_allocate(3 * h->body.mesh.nv, sizeof(double), "the report");
    }
    fitting_pass(x->f, NULL, judge_batch, x);
    for (size_t i = 0; i < FITTING_BATCH; i++) {
        free(x->transforms[i]);
        free(x->vertices[i]);
    }
    vg_player_free(&x->player);
    for (int left = 0; left < 2; left++) {
        const char *which = left ? "left out" : "fitted";
        report_errors(&x->errors[0][left], d, "patch motions given", which);
        report_errors(&x->errors[1][left], d, "rotations alone", which);
    }
}

static void fit_patches(vg_source *s)
{
    vg_err e;
    vg_head *h = vg_source_head(s);
    cli_need_vertices(h, "the input");
    if (rigging_wanted(&opts.rig)) {
        rigging_run(s, &opts.rig);
        return;
    }
    take_patches(h);
    fitting f;
    patch_fit x = {.f = &f};
    vg_patches pieces;
    vg_map map;
    if (vg_head_prepare_vectors(h, &e) < 0 || vg_map_fitter_new(&x.fitter, h, opts.rig.hold, cli_threads(), &e) < 0)
        cli_die(&e);
    fitting_collect(&f, s, opts.rig.holdout, "fit a map to");
    fitting_pass(&f, is_fitted, add_batch, &x);
    cli_working("solving for the map");
    if (vg_map_fitter_finish(x.fitter, &pieces, &map, &e) < 0) cli_die(&e);
    vg_map_fitter_free(&x.fitter);
    if (pieces.n != h->body.patches.n)
        cli_note("%zu patches are in %zu pieces, each of which is a patch of the map", h->body.patches.n, pieces.n);
    vg_head_put(h, &pieces, "patches");
    vg_head_put(h, &map, "map");
    report_fit(&x);
    fitting_clear(&f);
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    vg_source *s = cli_source(operands, n);
    fit_patches(s);
    cli_stream_open(vg_source_head(s));
    cli_stream_end(vg_source_tail(s));
    vg_source_close(&s);
    cli_finish(0);
}
