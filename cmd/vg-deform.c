/* vg-deform: measure how each vector of a sequence deforms, and do the same to another mesh.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"

#include <stdlib.h>
#include <string.h>

static struct {
    const char *onto, *root, *by;
} opts;

static const cli_option options[] = {
    {"onto", 0, "MESH", "apply to this mesh and write its vectors; without it, write the deformations", .text = &opts.onto},
    {"by", 0, "pose|gradient|blend", "what is carried over: the turn and stretch of each corner (default), ...", .text = &opts.by},
    {"root", 0, "WHERE", "where the body goes: centroid (default), stay, or the number of a vertex to follow",
     .text = &opts.root},
    {NULL}};

static const cli_program program = {
    .name = "vg-deform",
    .synopsis = "[options] [FILE]",
    .summary = "measure how each vector of a sequence deforms, and do the same to another mesh",
    .options = options,
    .most_operands = 1,
    .writes_stream = true,
    .threaded = true};

enum { BATCH = 8 }; /* poses of one call: the lanes of the kernel */

/* Where the whole body goes (MATH 5): at the target's reference place plus `ratio` times the way the source has gone. */
typedef struct root_motion {
    bool stay;
    uint32_t *vertex; /* --root V: the one anchor; NULL: the sequence's own anchors, if any */
    double ratio;
    double source[3], target[3];          /* roots of the references */
    double *source_anchors, *target_anchors; /* positions in the references */
} root_motion;

static double *positions(const double *vertices, const uint32_t *list, size_t n)
{
    double *p = malloc((3 * n + 1) * sizeof *p);
    if (!p) cli_die(&(vg_err){VG_ENOMEM, "not enough memory for the anchors"});
    vg_graph_anchors(vertices, list, n, p);
    return p;
}

static void parse_root(root_motion *m, const vg_head *h)
{
    *m = (root_motion){0};
    if (!opts.root || !strcmp(opts.root, "centroid")) return;
    if ((m->stay = !strcmp(opts.root, "stay"))) return;
    if (cli_parse_vertices("--root", opts.root, &m->vertex) != 1)
        cli_usage("--root is 'centroid', 'stay' or one vertex number, not '%s'", opts.root);
    if (m->vertex[0] >= h->mesh.nv) cli_usage("--root names vertex %u of %zu", m->vertex[0], h->mesh.nv);
}

/* before h's reference becomes the target's */
static void compare_references(root_motion *m, const vg_graph *g, const vg_head *h, const vg_head *target)
{
    double before = vg_diagonal(h->reference, h->mesh.nv), after = vg_diagonal(target->reference, h->mesh.nv);
    m->ratio = before > 0 ? after / before : 1;
    vg_graph_root(g, h->reference, m->source);
    vg_graph_root(g, target->reference, m->target);
    m->source_anchors = positions(h->reference, h->anchors, h->nanchors);
    m->target_anchors = positions(target->reference, h->anchors, h->nanchors);
}

static void move(const root_motion *m, const double *source, const double *target, const double *now, double *to)
{
    for (int k = 0; k < 3; k++) to[k] = target[k] + (m->stay ? 0 : m->ratio * (now[k] - source[k]));
}

static void move_body(const root_motion *m, const vg_head *h, const vg_frame *in, vg_frame *out)
{
    move(m, m->source, m->target, in->root, out->root);
    for (size_t i = 0; i < h->nanchors; i++)
        move(m, m->source_anchors + 3 * i, m->target_anchors + 3 * i, in->anchors + 3 * i, out->anchors + 3 * i);
}

/* The head becomes the target's: its reference, its attributes, its provenance beside ours. */
static void take_target(vg_head *h, vg_head *target)
{
    vg_err e;
    if (vg_head_merge_trace(h, target, &e) < 0) cli_die(&e);
    free(h->reference);
    free(h->reference_name);
    vg_attributes_clear(&h->attributes);
    h->reference = target->reference, h->reference_name = target->reference_name, h->attributes = target->attributes;
    target->reference = NULL, target->reference_name = NULL, target->attributes = (vg_attributes){0};
}

typedef struct work {
    vg_source *s;
    vg_head *h;
    vg_graph *g;
    vg_deformer *d;
    vg_kind from;      /* what comes in */
    bool onto;
    vg_method method;
    root_motion root;
    size_t n;          /* poses in hand */
    vg_frame in[BATCH], out[BATCH];
} work;

static void deform_batch(work *w)
{
    const double *in[BATCH];
    double *out[BATCH];
    for (size_t i = 0; i < w->n; i++) in[i] = w->in[i].values, out[i] = w->out[i].values;
    if (!w->onto) vg_deformer_measure(w->d, w->n, w->from, in, out);
    else if (w->from == VG_DEFORMATIONS) vg_deformer_apply(w->d, w->n, in, out);
    else vg_deformer_transfer(w->d, w->n, w->from, in, out);
    for (size_t i = 0; i < w->n; i++) {
        vg_err e;
        if (vg_frame_label(&w->out[i], &w->in[i], &e) < 0) cli_die(&e);
        if (w->onto) {
            move_body(&w->root, w->h, &w->in[i], &w->out[i]);
        } else {
            memcpy(w->out[i].root, w->in[i].root, sizeof w->out[i].root);
            if (w->h->nanchors) memcpy(w->out[i].anchors, w->in[i].anchors, 3 * w->h->nanchors * sizeof(double));
        }
        cli_stream_put(&w->out[i]);
    }
    w->n = 0;
}

/* Frames of vertices carry neither root nor anchors: they are measured here, as vg-encode --vectors does. */
static void fill_body(const work *w, vg_frame *f)
{
    if (w->from != VG_VERTICES) return;
    vg_graph_root(w->g, f->values, f->root);
    vg_graph_anchors(f->values, w->h->anchors, w->h->nanchors, f->anchors);
}

static void deform_all(work *w)
{
    vg_err e;
    uint64_t n = 0;
    int r;
    while ((r = vg_source_next(w->s, &w->in[w->n], &e)) > 0) {
        fill_body(w, &w->in[w->n]);
        if (++w->n == BATCH) deform_batch(w);
        cli_progress("poses", ++n);
    }
    if (r < 0) cli_die(&e);
    deform_batch(w);
}

static void warn_degenerate(const work *w)
{
    vg_deform_counts c = vg_deformer_counts(w->d);
    if (c.corners)
        cli_warn("%llu corners without a direction took the turn of their face (the first in face %llu)",
                 (unsigned long long)c.corners, (unsigned long long)c.first_face);
}

/* --root V: the sequence's anchors give way to this one. */
static void set_root_anchor(work *w)
{
    if (!w->root.vertex) return;
    if (w->from != VG_VERTICES)
        cli_usage("--root %u needs a sequence of vertices, this one holds %s", w->root.vertex[0], vg_kind_name(w->from));
    free(w->h->anchors);
    w->h->anchors = w->root.vertex, w->h->nanchors = 1;
}

static void prepare(work *w, vg_head *target)
{
    vg_err e;
    vg_head *h = w->h;
    w->from = h->kind, w->onto = opts.onto != NULL;
    if (h->kind == VG_TRANSFORMS || (h->kind == VG_DEFORMATIONS && !opts.onto)) {
        vg_fail(&e, VG_EINPUT, "the input holds %s: %s", vg_kind_name(h->kind),
                h->kind == VG_TRANSFORMS ? "they need a map" : "name the mesh to apply them to with --onto");
        cli_die(&e);
    }
    parse_root(&w->root, h);
    set_root_anchor(w);
    if (vg_head_prepare_vectors(h, &e) < 0 || vg_graph_new(&w->g, h, &e) < 0 ||
        vg_deformer_new(&w->d, w->g, h->reference, cli.threads, &e) < 0)
        cli_die(&e);
    for (size_t i = 0; i < BATCH && w->from == VG_VERTICES; i++)
        if (vg_frame_shape(&w->in[i], h, &e) < 0) cli_die(&e);
    if (w->onto) {
        double *vectors = malloc((3 * vg_graph_corners(w->g) + 1) * sizeof *vectors);
        if (!vectors) cli_die(&(vg_err){VG_ENOMEM, "not enough memory for the target's vectors"});
        vg_graph_vectors(w->g, target->reference, vectors);
        if (vg_deformer_target(w->d, vectors, w->method, &e) < 0) cli_die(&e);
        free(vectors);
        compare_references(&w->root, w->g, h, target);
        take_target(h, target);
    }
    h->kind = w->onto ? VG_VECTORS : VG_DEFORMATIONS;
    h->count = vg_graph_corners(w->g);
    for (size_t i = 0; i < BATCH; i++)
        if (vg_frame_shape(&w->out[i], h, &e) < 0) cli_die(&e);
}

static void clear(work *w)
{
    for (size_t i = 0; i < BATCH; i++) vg_frame_clear(&w->in[i]), vg_frame_clear(&w->out[i]);
    vg_deformer_free(&w->d);
    vg_graph_free(&w->g);
    free(w->root.source_anchors);
    free(w->root.target_anchors);
    vg_source_close(&w->s);
}

static vg_method parse_method(void)
{
    static const char *const names[] = {[VG_BY_POSE] = "pose", [VG_BY_GRADIENT] = "gradient", [VG_BY_BLEND] = "blend"};
    if (!opts.by) return VG_BY_POSE;
    if (!opts.onto) cli_usage("--by needs --onto");
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (!strcmp(opts.by, names[i])) return (vg_method)i;
    cli_usage("--by is 'pose', 'gradient' or 'blend', not '%s'", opts.by);
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    vg_err e;
    vg_head target = {0};
    if (opts.root && !opts.onto) cli_usage("--root needs --onto");
    if (opts.onto && vg_load_mesh(&target, opts.onto, &e) < 0) cli_die(&e);

    work w = {.method = parse_method(), .s = cli_source(operands, n)};
    w.h = vg_source_head(w.s);
    if (opts.onto && vg_mesh_same(&w.h->mesh, "the sequence", &target.mesh, "the target", &e) < 0) cli_die(&e);
    prepare(&w, &target);
    vg_head_clear(&target);
    cli_stream_open(w.h);
    deform_all(&w);
    warn_degenerate(&w);
    cli_stream_end(vg_source_tail(w.s));
    clear(&w);
    cli_finish(0);
}
