/* vg-solve: reconstruct vertices from vectors, one factorisation for all poses.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "cli.h"

#include <stdlib.h>
#include <string.h>

static struct {
    const char *weights;
} opts;

static const cli_option options[] = {
    {"weights", 0, "uniform|area", "every corner counts alike (default), or by the reference surface's metric", .text = &opts.weights},
    {NULL}};

static const cli_program program = {
    .name = "vg-solve",
    .synopsis = "[options] [FILE]",
    .summary = "reconstruct vertices from vectors: one factorisation, many poses per solve",
    .options = options,
    .most_operands = 1,
    .writes_stream = true,
    .threaded = true};

/* Poses that wait for a solve. Their vectors are not kept: a pose costs 6 numbers a vertex, not 3 a corner. */
typedef struct batch {
    size_t n, most;
    vg_frame *frame; /* values: first guess, then vertices */
    double **rhs, **x;
    const double **anchors, **roots;
} batch;

static void make_batch(batch *b, size_t most, const vg_head *out)
{
    vg_err e = {.code = VG_ENOMEM, .message = "not enough memory for a batch of poses"};
    *b = (batch){.most = most, .frame = calloc(most, sizeof *b->frame), .rhs = calloc(most, sizeof *b->rhs),
                 .x = calloc(most, sizeof *b->x), .anchors = calloc(most, sizeof *b->anchors),
                 .roots = calloc(most, sizeof *b->roots)};
    if (!b->frame || !b->rhs || !b->x || !b->anchors || !b->roots) cli_die(&e);
    for (size_t i = 0; i < most; i++) {
        if (!(b->rhs[i] = calloc(3 * out->mesh.nv + 1, sizeof *b->rhs[i]))) cli_die(&e);
        if (vg_frame_shape(&b->frame[i], out, &e) < 0) cli_die(&e);
        b->x[i] = b->frame[i].values, b->anchors[i] = b->frame[i].anchors, b->roots[i] = b->frame[i].root;
    }
}

static void free_batch(batch *b)
{
    for (size_t i = 0; i < b->most; i++) vg_frame_clear(&b->frame[i]), free(b->rhs[i]);
    free(b->frame);
    free(b->rhs);
    free(b->x);
    free(b->anchors);
    free(b->roots);
}

static void solve_batch(vg_solver *solver, batch *b)
{
    vg_solver_solve(solver, b->n, (const double *const *)b->rhs, b->x, b->anchors, b->roots);
    for (size_t i = 0; i < b->n; i++) cli_stream_put(&b->frame[i]);
    b->n = 0;
}

static vg_weights parse_weights(void)
{
    if (!opts.weights || !strcmp(opts.weights, "uniform")) return VG_WEIGHTS_UNIFORM;
    if (!strcmp(opts.weights, "area")) return VG_WEIGHTS_AREA;
    cli_usage("--weights is 'uniform' or 'area', not '%s'", opts.weights);
}

static void run(vg_source *s, vg_head *h)
{
    vg_err e;
    vg_graph *g;
    vg_solver *solver;
    vg_kind kind = h->kind;
    if (kind != VG_VECTORS && kind != VG_VERTICES) {
        vg_fail(&e, VG_EINPUT, "the input holds %s, vg-solve takes vectors: apply them with 'vg-deform --onto MESH'",
                vg_kind_name(kind));
        cli_die(&e);
    }
    if (vg_head_prepare_vectors(h, &e) < 0 || vg_graph_new(&g, h, &e) < 0 ||
        vg_solver_new(&solver, g, h->anchors, h->nanchors, h->reference, parse_weights(), cli.threads, &e) < 0)
        cli_die(&e);
    vg_solver_facts facts = vg_solver_get_facts(solver);
    cli_note("%zu unknowns, %zu entries in the factor, analysed in %.3f s, factorized in %.3f s", facts.unknowns,
             facts.factor_entries, facts.analyse_seconds, facts.factor_seconds);

    double *vectors = kind == VG_VERTICES ? malloc((3 * vg_graph_corners(g) + 1) * sizeof *vectors) : NULL;
    h->kind = VG_VERTICES, h->count = h->mesh.nv;
    batch b;
    make_batch(&b, vg_solver_batch(solver), h);
    cli_stream_open(h);
    vg_frame in = {0};
    uint64_t n = 0;
    int r;
    while ((r = vg_source_next(s, &in, &e)) > 0) {
        vg_frame *f = &b.frame[b.n];
        if (vg_frame_label(f, &in, &e) < 0) cli_die(&e);
        if (kind == VG_VECTORS) {
            for (int k = 0; k < 3; k++) f->root[k] = in.root[k];
            for (size_t k = 0; k < 3 * h->nanchors; k++) f->anchors[k] = in.anchors[k];
        } else {
            if (!vectors) cli_die(&(vg_err){VG_ENOMEM, "not enough memory for the vectors of a pose"});
            vg_graph_vectors(g, in.values, vectors);
            vg_graph_root(g, in.values, f->root);
            vg_graph_anchors(in.values, h->anchors, h->nanchors, f->anchors);
        }
        vg_solver_load(solver, kind == VG_VECTORS ? in.values : vectors, f->anchors, f->values, b.rhs[b.n]);
        if (++b.n == b.most) solve_batch(solver, &b);
        cli_progress("poses", ++n);
    }
    if (r < 0) cli_die(&e);
    solve_batch(solver, &b);
    free(vectors);
    free_batch(&b);
    vg_frame_clear(&in);
    vg_solver_free(&solver);
    vg_graph_free(&g);
}

int main(int argc, char **argv)
{
    char **operands;
    size_t n = cli_start(&program, argc, argv, &operands);
    vg_source *s = cli_source(operands, n);
    run(s, vg_source_head(s));
    cli_stream_end(vg_source_tail(s));
    vg_source_close(&s);
    cli_finish(0);
}
