/* vg-deform: measure how each vector of a sequence deforms, and do the same to another mesh.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "batch.h"
#include "joint_transfer.h"
#include "poses.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static struct {
    const char *onto, *correspondence, *root, *examples, *sculpted;
    size_t by_choice, pin_choice; /* of enum by and enum pin */
    driving_options driving;
} opts;

static const cli_option options[] = {
    {"onto", 0, "MESH", "apply to this mesh and write its vectors; without it, write the deformations",
     .text = &opts.onto, .reads = true},
    {"correspondence", 0, "FILE", "for a target with another connectivity: the output of vg-register",
     .text = &opts.correspondence, .reads = true, .needs = "onto"},
    {"by", 0, "auto|offset|blend|pose|gradient|shape",
     "what is transferred (default: expressions as sums of shapes; where limbs turn offset, with --correspondence gradient)", .choice = &opts.by_choice, .needs = "onto"},
    {"root", 0, "centroid|stay|V",
     "motion of the body: that of the centroid (default), none, or that of vertex V", .text = &opts.root,
     .needs = "onto"},
    {"pin", 0, "auto|always|none",
     "hold what does not move in the source: if it is much of the mesh (default), ...",
     .choice = &opts.pin_choice, .needs = "onto"},
    {"examples", 0, "POSES SCULPTED", "poses of the source, and the same poses of the target, which the transfer "
                                      "reproduces",
     .text = &opts.examples, .second = &opts.sculpted, .reads = true, .needs = "onto"},
    {"align", 0, "auto|none|all|NAMES",
     "two skeletons: make limbs that rest in other directions point alike: those of arms and legs that do (default), none, "
     "all joints, or joints of these names",
     .text = &opts.driving.align, .needs = "onto", .excludes = "correspondence"},
    {"joints", 0, "FILE", "two skeletons: pairs of a joint of the target and one of the sequence, a line each (default: by their names)",
     .text = &opts.driving.joints, .reads = true, .needs = "onto", .excludes = "correspondence"},
    {.name = NULL}};

static const cli_moved moved[] = {{"interpolate", "is now the program vg-interpolate: vg-interpolate 30"},
                                  {"at", "is now an option of vg-interpolate: vg-interpolate --at 0,0.5,1"},
                                  {"smooth", "is now an option of vg-interpolate: vg-interpolate --smooth 30"},
                                  {"map", "is now the program vg-play: vg-play MAP"},
                                  {"edit", "is now an option of vg-play: vg-play MAP --edit 'BONE x 45'"},
                                  {"rotations", "is now an option of vg-play: vg-play MAP --rotations"},
                                  {"transforms", "is now an option of vg-play: vg-play MAP --transforms"},
                                  {"live", "is now an option of vg-play: vg-play MAP --live"},
                                  {"sculpted", "is now the second value of --examples: --examples POSES SCULPTED"},
                                  {.name = NULL}};

static const cli_program program = {
    .name = "vg-deform",
    .synopsis = "[options] [FILE]",
    .summary = "measure the deformations of a sequence, and apply them to another mesh",
    .options = options,
    .moved = moved,
    .most_operands = 1,
    .writes_stream = true,
    .writes_vectors = true,
    .threaded = true};

enum { BATCH = 8, MOST_EXAMPLES = 1000 }; /* poses of one call: the lanes of the kernels */

/* How the output is computed from the poses. */
typedef enum way { MEASURE, APPLY, TRANSFER, CARRY, SHAPE, RIDE, JOINTS } way;
typedef enum by { BY_AUTO, BY_OFFSET, BY_BLEND, BY_POSE, BY_GRADIENT, BY_SHAPE } by;
typedef enum pin { PIN_AUTO, PIN_ALWAYS, PIN_NONE } pin;

typedef struct work {
    vg_head *h;               /* the source's until the output's is made of it */
    vg_head target;
    vg_head pairs;            /* holds the correspondence */
    bool turned;              /* the target is turned against the sequence, which is turned to it by this rotation */
    double turn[9];
    double *fitted;           /* of the correspondence: the source fitted to the target; NULL: it has none */
    vg_head source;           /* mesh and reference of the sequence, whose head gets the target's: the steps borrow
                                 them */
    vg_graph *from, *to;      /* graphs of source and target: the same one without a correspondence */
    way way;
    by by;
    vg_kind kind;             /* what comes in */
    vg_deformer *deformer;
    vg_sums *sums;            /* expressions onto a mesh of the same faces; NULL: there are none */
    vg_cross_transfer *carrier;
    vg_shaper *shaper;
    vg_rider *rider;
    joint_transfer *joints;   /* from one skeleton to another */
    vg_mover *mover;          /* NULL: poses are measured */
    vg_pinner *pinner;        /* NULL: nothing is held */
    vg_corrector *corrector;  /* NULL: there are no examples */
    bool *sculpted;           /* vertices that a sculpted pose moves: they are not held */
    uint32_t *held;           /* room for the others */
    vg_frame out[BATCH];
} work;

/* ---- options ---- */

static void parse_options(work *w)
{
    w->by = (by)opts.by_choice;
    if (w->by == BY_SHAPE && opts.correspondence)
        cli_usage("--by shape needs one connectivity: it takes no --correspondence");
    if (w->by == BY_SHAPE && opts.pin_choice == PIN_ALWAYS)
        cli_usage("--pin holds vertices while vg-solve looks for the others: --by shape finds all of them itself");
}

/* ---- where the body goes ---- */

static bool root_stays(void)
{
    return opts.root && !strcmp(opts.root, "stay");
}

/* --root V: the sequence's anchors give way to this one vertex, of both meshes. */
static void set_root(work *w)
{
    uint32_t *vertex;
    if (!opts.root || !strcmp(opts.root, "centroid") || root_stays()) return;
    if (opts.root[strspn(opts.root, "0123456789")] || cli_parse_vertices("--root", opts.root, &vertex) != 1)
        cli_usage("--root is 'centroid', 'stay' or the number of a vertex, not '%s'", opts.root);
    if (vertex[0] >= w->h->body.mesh.nv)
        cli_usage("--root names vertex %u, but there are %zu, counted from 0", vertex[0], w->h->body.mesh.nv);
    if (opts.correspondence)
        cli_usage("--root V needs one connectivity: with --correspondence it is 'centroid' or 'stay'");
    if (w->kind != VG_VERTICES)
        cli_usage("--root %u needs a sequence of vertices, this one holds %s", vertex[0], vg_head_form(w->h));
    free(w->h->anchors);
    w->h->anchors = vertex, w->h->nanchors = 1;
}

/* ---- frames ---- */

static void run_batch(work *w, size_t n, const double *const *in, double *const *out)
{
    switch (w->way) {
    case MEASURE: vg_deformer_measure(w->deformer, n, w->kind, in, out); break;
    case APPLY: vg_deformer_apply(w->deformer, n, in, out); break;
    case TRANSFER:
        vg_deformer_transfer(w->deformer, n, w->kind, in, out);
        if (w->sums) vg_sums_mix(w->sums, n, w->kind, in, out);
        break;
    case CARRY: vg_cross_transfer_apply(w->carrier, n, in, out); break;
    case SHAPE: vg_shaper_transfer(w->shaper, n, in, out); break;
    case JOINTS: break; /* in finish_frame */
    case RIDE:
        for (size_t i = 0; i < n; i++) vg_rider_apply(w->rider, in[i], out[i]);
        break;
    }
}

/* Vertices that stay in the source, but for those that a sculpted pose moves. */
static size_t leave_sculpted(work *w, const uint32_t *still, size_t n)
{
    size_t kept = 0;
    for (size_t i = 0; i < n; i++)
        if (!w->sculpted[still[i]]) w->held[kept++] = still[i];
    return kept;
}

/* Name, time and channels of a frame. */
static void finish_frame(work *w, vg_frame *in, vg_frame *out)
{
    vg_err e;
    const uint32_t *still;
    if (vg_frame_label(out, in, &e) < 0) cli_die(&e);
    if (w->way == JOINTS) joint_transfer_apply(w->joints, in, out);
    if (w->way == RIDE || w->way == JOINTS) return;
    if (w->mover) {
        vg_mover_move(w->mover, in, out);
    } else {
        memcpy(out->root, in->root, sizeof out->root);
        if (w->h->nanchors) memcpy(vg_frame_anchors(out), vg_frame_anchors(in), 3 * w->h->nanchors * sizeof(double));
    }
    if (w->way == SHAPE) vg_mover_place(w->mover, out->root, out->values);
    if (!w->pinner) return;
    size_t n = vg_pinner_find(w->pinner, in->values, &still);
    if (w->sculpted) n = leave_sculpted(w, still, n), still = w->held;
    if (vg_frame_pin(out, still, n, &e) < 0) cli_die(&e);
}

/* Turn n points of the sequence to the target. */
static void turn_points(const work *w, double *points, size_t n)
{
    const double *m = w->turn;
    for (double *p = points; w->turned && p < points + 3 * n; p += 3) {
        double x = p[0], y = p[1], z = p[2];
        for (int k = 0; k < 3; k++) p[k] = m[3 * k] * x + m[3 * k + 1] * y + m[3 * k + 2] * z;
    }
}

/* Frames of vertices carry neither root nor anchors: they are measured here, as vg-encode --vectors does. */
static void fill_body(const work *w, vg_frame *f)
{
    vg_err e;
    double *anchors;
    if (w->kind == VG_DEFORMATIONS || w->way == RIDE || w->way == JOINTS) return;
    turn_points(w, f->values, w->kind == VG_VERTICES ? w->from->faces.nv : vg_graph_corners(w->from));
    if (w->kind == VG_VECTORS) {
        turn_points(w, f->root, 1);
        turn_points(w, vg_frame_anchors(f), w->h->nanchors);
        return;
    }
    if (w->carrier) vg_cross_transfer_root(w->carrier, f->values, f->root);
    else vg_graph_root(w->from, f->values, f->root);
    if (vg_frame_make_anchors(f, w->h->nanchors, &anchors, &e) < 0) cli_die(&e);
    vg_graph_anchors(f->values, w->h->anchors, w->h->nanchors, anchors);
}

static void deform_batch(void *context, size_t n, vg_frame *in)
{
    work *w = context;
    const double *from[BATCH] = {NULL};
    double *to[BATCH] = {NULL};
    for (size_t i = 0; i < n; i++) {
        fill_body(w, &in[i]);
        from[i] = in[i].values, to[i] = w->out[i].values;
    }
    run_batch(w, n, from, to);
    for (size_t i = 0; i < n; i++) {
        if (w->corrector) vg_corrector_apply(w->corrector, from[i], to[i]);
        finish_frame(w, &in[i], &w->out[i]);
        cli_stream_put(&w->out[i]);
    }
}

static void warn_degenerate(void *context)
{
    const work *w = context;
    vg_deform_stats c = {0};
    if (w->deformer) c = vg_deformer_get_stats(w->deformer);
    if (c.corners)
        cli_warn("%llu corners without a direction took the rotation of their face (the first in face %llu)",
                 (unsigned long long)c.corners, (unsigned long long)c.first_face);
    if (!w->carrier) return;
    c = vg_cross_transfer_get_stats(w->carrier);
    if (c.corners)
        cli_warn("%llu times a face of the source had no direction and drove nothing (the first is face %llu)",
                 (unsigned long long)c.corners, (unsigned long long)c.first_face);
}

/* ---- setting up ---- */

static void check_kind(work *w)
{
    const char *advice = NULL;
    if (w->by == BY_AUTO && w->kind == VG_DEFORMATIONS) w->by = BY_POSE;
    if (w->kind == VG_FEATURES || w->kind == VG_COORDINATES) advice = "vg-deform takes vertices, vectors or deformations";
    else if (w->kind == VG_TRANSFORMS) advice = "convert them to vertices with 'vg-play MAP' first";
    else if (w->kind == VG_DEFORMATIONS && !opts.onto) advice = "name the mesh to apply them to with --onto";
    else if (w->kind == VG_DEFORMATIONS && w->by != BY_POSE) advice = "they go --by pose only";
    else if (w->kind != VG_VERTICES && (w->by == BY_SHAPE || opts.correspondence))
        advice = "--by shape and --correspondence need vertices";
    if (!advice) return;
    cli_stop(VG_EINPUT, "the input holds %s: %s", vg_head_form(w->h), advice);
}

/* A correspondence and its frame, the source as it was fitted to the target. */
static void load_pairs(work *w)
{
    vg_err e;
    vg_source *s;
    vg_frame f = {0};
    char name[420];
    snprintf(name, sizeof name, "'%.400s'", opts.correspondence);
    if (vg_source_open(&s, &opts.correspondence, 1, &e) < 0) cli_die(&e);
    const vg_head *h = vg_source_head(s);
    if (vg_head_need(h, "correspondence", name, &e) < 0 || vg_head_copy(&w->pairs, h, &e) < 0) cli_die(&e);
    if (h->kind == VG_VERTICES && h->count == h->correspondence.source_nv) {
        if (vg_frame_shape(&f, h, &e) < 0) cli_die(&e);
        int r = vg_source_next(s, &f, &e);
        if (r < 0) cli_die(&e);
        if (r > 0) {
            w->fitted = cli_allocate(3 * h->count, sizeof *w->fitted, "the fitted source");
            memcpy(w->fitted, f.values, 3 * h->count * sizeof *w->fitted);
        }
        vg_frame_clear(&f);
    }
    vg_source_close(&s);
}

static void load_target(work *w)
{
    if (opts.onto) cli_load(&w->target, opts.onto, "mesh");
    if (opts.correspondence) load_pairs(w);
}

static bool fits_target(const work *w, const vg_head *target)
{
    return vg_mesh_same(&w->h->body.mesh, "", &target->body.mesh, "", NULL) == VG_OK;
}

/* A GLB of the sequence's own vertices may have been welded in another way, by what touches in its only pose. */
static void weld_like_sequence(work *w)
{
    const vg_source_options like = {.reading.like = &w->h->body};
    struct stat st;
    vg_head again = {0};
    if (!opts.onto || opts.correspondence || fits_target(w, &w->target) || stat(opts.onto, &st) < 0 || !S_ISREG(st.st_mode))
        return;
    if (vg_load_with(&again, opts.onto, "mesh", &like, NULL, NULL) == VG_OK && fits_target(w, &again)) {
        vg_head_move(&w->target, &again);
    }
    vg_head_clear(&again);
}

/* What to do where the target is another mesh; of skeletons, joints pair by name or a rig is wanted. */
static const char *advise_other_mesh(const work *w)
{
    bool from = w->h->body.skeleton.njoints, to = w->target.body.skeleton.njoints;
    if (from && to) return ": a skeleton of other joints takes a sequence of vertices";
    if (from) return ": the input is a skeleton, and the target is none: vg-fitmap makes a rig, which vg-play drives";
    if (to) return ": the target is a skeleton, and the input is none: vg-fitmap --skeleton finds the motion of its bones";
    return ": pair them with vg-register and --correspondence";
}

/* The graphs: of a pair with one connectivity, the source's serves both. */
static void make_graphs(work *w)
{
    vg_err e;
    if (opts.correspondence) {
        w->h->selection.chosen = false; /* every face may drive one */
        w->target.selection.chosen = false;
        w->h->nanchors = 0;
        if (vg_head_prepare_vectors(&w->target, &e) < 0 || vg_head_graph(&w->to, &w->target, &e) < 0) cli_die(&e);
    } else if (opts.onto) {
        char name[200];
        snprintf(name, sizeof name, "'%.190s'", opts.onto);
        if (vg_mesh_same(&w->h->body.mesh, "the sequence", &w->target.body.mesh, name, &e) < 0) {
            size_t n = strlen(e.message);
            snprintf(e.message + n, sizeof e.message - n, "%s", advise_other_mesh(w));
            cli_die(&e);
        }
    }
    if (vg_head_prepare_vectors(w->h, &e) < 0 || vg_head_graph(&w->from, w->h, &e) < 0) cli_die(&e);
    if (!w->to) w->to = w->from;
}

/* A rotation within 15 degrees of one that exchanges axes becomes it: files differ in which axis is up, people in shape. */
static void snap_to_axes(double turn[9])
{
    static const double near = 0.966;
    double axes[9] = {0}, trace = 0;
    bool taken[3] = {false};
    for (int i = 0; i < 3; i++) {
        int most = 0;
        for (int k = 1; k < 3; k++)
            if (fabs(turn[3 * i + k]) > fabs(turn[3 * i + most])) most = k;
        if (taken[most]) return;
        taken[most] = true;
        axes[3 * i + most] = turn[3 * i + most] > 0 ? 1 : -1;
        trace += fabs(turn[3 * i + most]);
    }
    if ((trace - 1) / 2 > near) memcpy(turn, axes, sizeof axes);
}

/* A target that is the source with another axis up, or that looks another way, gets the motion turned along: blinks close on it.
 * Bodies in two poses are not laid on one another by a rotation. */
static void turn_source(work *w)
{
    enum { LEAST = 30 };
    static const double alike = 0.35;
    const double *to = opts.correspondence ? w->fitted : w->target.body.reference;
    double miss, angle;
    if (!opts.onto || !to || w->kind == VG_DEFORMATIONS || w->by == BY_SHAPE) return;
    angle = vg_points_turn(w->h->body.reference, to, w->h->body.mesh.nv, w->turn, &miss);
    w->turned = angle > LEAST && miss < alike;
    if (!w->turned) return;
    snap_to_axes(w->turn);
    turn_points(w, w->h->body.reference, w->h->body.mesh.nv);
    cli_warn("the target is turned by about %.0f degrees against the reference pose '%s': the motion is turned with it", angle,
             w->h->body.reference_name);
}

enum { SAMPLE = 4000 }; /* faces that are asked */

/* The graph of faces that are spread evenly over those of h. */
static vg_graph *sample_graph(const vg_head *h)
{
    vg_err e;
    vg_graph *g;
    size_t stride = h->body.mesh.nf / SAMPLE + 1;
    vg_selection some = {.chosen = true};
    some.faces = cli_allocate(h->body.mesh.nf / stride + 1, sizeof *some.faces, "a sample of the faces");
    for (size_t face = 0; face < h->body.mesh.nf; face += stride) some.faces[some.n++] = (uint32_t)face;
    if (vg_graph_new(&g, &h->body.mesh, &some, NULL, &e) < 0) cli_die(&e);
    free(some.faces);
    return g;
}

/* How far corners of the target are turned against those of the sequence's reference pose, in degrees: the angle that
 * has the mean of the squared sines of their halves. */
static double degrees_apart(const work *w)
{
    vg_err e;
    vg_deformer *d;
    vg_graph *g = sample_graph(w->h);
    size_t corners = vg_graph_corners(g);
    const double *pose = w->target.body.reference;
    double *q = cli_allocate(4 * corners, sizeof *q, "a sample of the faces"), sum = 0;
    if (vg_deformer_new(&d, g, w->h->body.reference, 1, &e) < 0) cli_die(&e);
    vg_deformer_measure(d, 1, VG_VERTICES, &pose, &q);
    for (size_t i = 0; i < 4 * corners; i += 4) {
        double u2 = q[i + 1] * q[i + 1] + q[i + 2] * q[i + 2] + q[i + 3] * q[i + 3];
        sum += u2 / (q[i] * q[i] + u2);
    }
    vg_deformer_free(&d);
    vg_graph_free(&g);
    free(q);
    return corners ? 360 / M_PI * asin(sqrt(fmin(sum / (double)corners, 1))) : 0;
}

/* Corners of bodies of different build that stand alike are 10 to 20 degrees apart, those of a man who stands and one
 * who walks 45. Faces that were paired are 12 to 33 degrees apart, of a target that has another axis up 64. */
static void warn_of_other_pose(const work *w)
{
    if (!opts.onto || cli_quiet()) return;
    double degrees = w->carrier ? vg_cross_transfer_turned(w->carrier) : degrees_apart(w), most = w->carrier ? 45 : 30;
    if (degrees > most)
        cli_warn(
            "the target is not in the reference pose '%s': they differ by %.0f degrees on average; give a reference "
            "in the target's pose with 'vg-encode --reference', or rotate the target",
            w->h->body.reference_name, degrees);
}

/* What follows the source as a whole: the body, and what does not move. */
static void make_followers(work *w)
{
    vg_err e;
    const vg_head *h = w->h;
    const vg_correspondence *pairs = opts.correspondence ? &w->pairs.correspondence : NULL;
    if (opts.pin_choice == PIN_ALWAYS && w->kind != VG_VERTICES)
        cli_usage("--pin needs a sequence of vertices, this one holds %s", vg_head_form(w->h));
    bool pins = w->kind == VG_VERTICES && (w->way == TRANSFER || w->way == CARRY) && opts.pin_choice != PIN_NONE;
    int r = VG_OK;
    if (opts.onto)
        r = vg_mover_new(&w->mover, w->from, w->source.body.reference, w->to, w->target.body.reference, h->anchors,
                         h->nanchors, root_stays(), &e);
    if (r == VG_OK && w->carrier) {
        double root[3];
        vg_cross_transfer_root(w->carrier, w->source.body.reference, root);
        vg_mover_follow(w->mover, root, vg_cross_transfer_size(w->carrier, true), vg_cross_transfer_size(w->carrier, false));
    }
    if (r == VG_OK && pins)
        r = vg_pinner_new(&w->pinner, w->from, w->source.body.reference, w->to, pairs, opts.pin_choice == PIN_ALWAYS, &e);
    if (r < 0) cli_die(&e);
}

static void find_sculpted(work *w, const poses *p)
{
    const vg_body *b = &w->target.body;
    double near = 1e-6 * vg_diagonal(b->reference, b->mesh.nv);
    w->sculpted = cli_allocate(b->mesh.nv, sizeof *w->sculpted, "examples");
    w->held = cli_allocate(b->mesh.nv, sizeof *w->held, "examples");
    for (size_t i = 0; i < p->n * p->numbers; i++)
        if (fabs(p->values[i] - b->reference[i % p->numbers]) > near) w->sculpted[i % p->numbers / 3] = true;
}

/* Plain transfer of the examples gives its error in them. */
static void make_corrector(work *w)
{
    vg_err e;
    if (!opts.examples) return;
    if (w->kind != VG_VERTICES || (w->way != TRANSFER && w->way != CARRY))
        cli_usage("--examples needs --onto, a sequence of vertices, and another way than --by shape");
    poses from = poses_load(opts.examples, MOST_EXAMPLES, &w->source.body.mesh, w->h);
    poses to = poses_load(opts.sculpted, MOST_EXAMPLES, &w->target.body.mesh, w->h);
    if (from.n != to.n || !from.n)
        cli_stop(VG_EINPUT, "'%s' has %zu poses and '%s' %zu: they must match", opts.examples, from.n, opts.sculpted, to.n);
    turn_points(w, from.values, from.n * from.numbers / 3);
    const double **source = cli_allocate(from.n, sizeof *source, "examples"), **target = cli_allocate(from.n, sizeof *target, "examples");
    double **made = cli_allocate(from.n, sizeof *made, "examples");
    for (size_t i = 0; i < from.n; i++) {
        source[i] = from.values + i * from.numbers, target[i] = to.values + i * to.numbers;
        made[i] = cli_allocate(3 * vg_graph_corners(w->to), sizeof(double), "examples");
        run_batch(w, 1, &source[i], &made[i]);
    }
    const vg_examples x = {from.n, source, target, (const double *const *)made};
    if (vg_corrector_new(&w->corrector, w->from, w->source.body.reference, w->to, w->target.body.reference, &x, cli_threads(), &e) < 0)
        cli_die(&e);
    if (w->pinner) find_sculpted(w, &to);
    for (size_t i = 0; i < from.n; i++) free(made[i]);
    free(made);
    free(source);
    free(target);
    poses_clear(&from);
    poses_clear(&to);
}

static void keep_source(work *w)
{
    vg_err e;
    const vg_body *from = &w->h->body;
    vg_body *to = &w->source.body;
    if (vg_mesh_copy(&to->mesh, &from->mesh, &e) < 0) cli_die(&e);
    to->reference = cli_allocate(3 * from->mesh.nv, sizeof *to->reference, "the mesh of the sequence");
    if (from->mesh.nv) memcpy(to->reference, from->reference, 3 * from->mesh.nv * sizeof *to->reference);
}

static vg_cross_transfer *make_carrier(const work *w, vg_method method)
{
    vg_err e;
    vg_cross_transfer *c;
    const double *target = w->target.body.reference;
    int r = vg_cross_transfer_new(&c, &w->source.body.mesh, w->source.body.reference, &w->pairs.correspondence, w->to, target,
                                  method, cli_threads(), &e);
    if (r == VG_OK && method == VG_BY_OFFSET && w->fitted) r = vg_cross_transfer_fitted(c, target, w->fitted, w->by == BY_AUTO, &e);
    if (r < 0) cli_die(&e);
    return c;
}

static void make_step(work *w)
{
    static const vg_method methods[] = {
        [BY_AUTO] = VG_BY_OFFSET, [BY_POSE] = VG_BY_POSE, [BY_SHAPE] = VG_BY_POSE, [BY_GRADIENT] = VG_BY_GRADIENT, [BY_BLEND] = VG_BY_BLEND,
        [BY_OFFSET] = VG_BY_OFFSET};
    vg_err e;
    const vg_head *t = &w->target;
    vg_method method = methods[w->by];
    int r = VG_OK;
    keep_source(w);
    w->way = !opts.onto ? MEASURE : opts.correspondence ? CARRY : w->by == BY_SHAPE ? SHAPE
             : w->kind == VG_DEFORMATIONS ? APPLY : TRANSFER;
    if (w->way == CARRY) {
        w->carrier = make_carrier(w, method);
    } else if (w->way == SHAPE) {
        r = vg_shaper_new(&w->shaper, w->to, w->source.body.reference, t->body.reference, cli_threads(), &e);
    } else {
        r = vg_deformer_new(&w->deformer, w->from, w->source.body.reference, cli_threads(), &e);
        double *vectors = cli_allocate(3 * vg_graph_corners(w->from), sizeof *vectors, "the mesh of the sequence");
        if (r == VG_OK && opts.onto) {
            vg_graph_vectors(w->from, t->body.reference, vectors);
            r = vg_deformer_target(w->deformer, vectors, method, &e);
        }
        free(vectors);
        if (r == VG_OK && w->way == TRANSFER && w->by == BY_AUTO)
            r = vg_sums_new(&w->sums, w->from, w->source.body.reference, t->body.reference, cli_threads(), &e);
    }
    if (r < 0) cli_die(&e);
    make_followers(w);
    make_corrector(w);
}

/* The output's head: the provenance and records of the sequence; mesh and reference of the target, and what its file
 * contains. */
static void make_head(work *w)
{
    vg_err e;
    vg_head *h = w->h, *t = &w->target;
    if (opts.onto) {
        if (vg_head_merge_trace(h, t, &e) < 0 || vg_head_merge_trace(h, &w->pairs, &e) < 0) cli_die(&e);
        vg_head_take(h, t, "reference");
        vg_head_take(h, t, "attributes");
        vg_head_take(h, t, "asset");
        vg_head_take(h, t, "skeleton");
    }
    vg_head_drop(h, "map"); /* not a property of the mesh */
    if (w->way == CARRY || w->way == RIDE || w->way == JOINTS) {
        vg_head_drop(h, "patches");
        vg_head_take(h, t, "mesh");
        vg_head_take(h, t, "links");
    }
    h->kind = w->way == MEASURE ? VG_DEFORMATIONS : w->way == SHAPE || w->way == RIDE || w->way == JOINTS ? VG_VERTICES : VG_VECTORS;
    h->count = h->kind == VG_VERTICES ? h->body.mesh.nv : vg_graph_corners(w->to);
}

/* A target that is bound to the sequence needs no vector graph. */
static void make_rider(work *w)
{
    vg_err e;
    vg_head *h = w->h;
    const vg_body *t = &w->target.body;
    if (opts.root || opts.examples || cli_given("by") || cli_given("pin"))
        cli_usage("'%s' binds the target to the sequence: --by, --root, --pin and --examples have no meaning", opts.correspondence);
    w->way = RIDE;
    keep_source(w);
    if (vg_rider_new(&w->rider, &w->source.body.mesh, w->source.body.reference, &w->pairs.correspondence, &t->mesh, t->reference,
                     cli_threads(), &e) < 0)
        cli_die(&e);
    vg_head_drop(h, "selection");
    vg_head_drop(h, "links");
    vg_head_drop(h, "anchors");
}

/* Two skeletons, unless they have the same joints and nothing is asked of their pairs. */
static bool pairs_joints(const work *w)
{
    const vg_skeleton *a = &w->h->body.skeleton, *b = &w->target.body.skeleton;
    bool asked = opts.driving.align || opts.driving.joints;
    if (!a->njoints || !b->njoints || w->kind != VG_VERTICES || opts.correspondence) {
        if (asked) cli_usage("--align and --joints are for a skeleton and poses of another one");
        return false;
    }
    bool same = a->njoints == b->njoints && fits_target(w, &w->target);
    for (size_t j = 0; same && j < a->njoints; j++) same = !strcmp(a->joints[j].name, b->joints[j].name);
    return asked || !same;
}

static void make_joints(work *w)
{
    vg_head *h = w->h;
    if (opts.examples || cli_given("by") || cli_given("pin") || (opts.root && !root_stays() && strcmp(opts.root, "centroid")))
        cli_usage("'%s' has other joints than the sequence: --by, --pin, --examples and --root V have no meaning", opts.onto);
    w->way = JOINTS;
    vg_head_drop(h, "selection");
    vg_head_drop(h, "links");
    vg_head_drop(h, "anchors");
    w->joints = joint_transfer_new(&opts.driving, &h->body.skeleton, &w->target.body, opts.onto, root_stays());
}

static void prepare_steps(work *w)
{
    weld_like_sequence(w);
    set_root(w);
    make_graphs(w);
    turn_source(w);
    make_step(w);
    warn_of_other_pose(w);
}

static void prepare(void *context, vg_head *h, vg_frame *in)
{
    work *w = context;
    vg_err e;
    w->h = h, w->kind = h->kind;
    check_kind(w);
    if (vg_is_bound(&w->pairs.correspondence)) make_rider(w);
    else if (pairs_joints(w)) make_joints(w);
    else prepare_steps(w);
    (void)in;
    make_head(w);
    for (size_t i = 0; i < BATCH; i++)
        if (vg_frame_shape(&w->out[i], h, &e) < 0) cli_die(&e);
}

int main(int argc, char **argv)
{
    static const step deform = {
        .batch = BATCH, .unit = "poses", .init = prepare, .process = deform_batch, .finish = warn_degenerate};
    static work w; /* lives until the end; the process releases it */
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    parse_options(&w);
    cli_expect_input(n);
    load_target(&w);
    step_run(&deform, &w, cli_source(operands, n));
    cli_finish(0);
}
