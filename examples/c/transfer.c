/* transfer POSES TARGET OUT: the poses of one body for another one of the same connectivity: what
 *     vg-encode POSES | vg-deform --onto TARGET --by pose --pin none | vg-solve --fit squares | vg-decode -o OUT
 * does, in one process, a pose at a time, for a program that has other things to do with it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include <stdio.h>
#include <stdlib.h>
#include <vg.h>

typedef struct transfer {
    vg_source *source;
    vg_head target;
    vg_graph *graph;     /* of both: they have the same faces */
    vg_deformer *deformer;
    vg_mover *mover;
    vg_solver *solver;
    vg_sink *sink;
    double *vectors, *rhs;
    vg_frame in, out, root; /* root: where the target's pose goes */
} transfer;

static double *numbers(size_t n, vg_err *e)
{
    double *x = calloc(n + 1, sizeof *x);
    if (!x) vg_fail(e, VG_ENOMEM, "not enough memory");
    return x;
}

/* Once: the graph, the reference vectors of the target, the factor of the solver. */
static int prepare(transfer *t, const char *poses, const char *target, const char *output, vg_err *e)
{
    int r = vg_source_open(&t->source, &poses, 1, e);
    if (r == VG_OK) r = vg_load(&t->target, target, "mesh", e);
    if (r < 0) return r;
    vg_head *h = vg_source_head(t->source);
    const double *home = h->body.reference, *reference = t->target.body.reference;
    if (h->kind != VG_VERTICES) return vg_fail(e, VG_EINPUT, "'%s' holds %s, not vertices", poses, vg_head_form(h));
    r = vg_mesh_same(&h->body.mesh, poses, &t->target.body.mesh, target, e);
    if (r == VG_OK) r = vg_head_prepare_vectors(h, e);
    if (r == VG_OK) r = vg_head_graph(&t->graph, h, e);
    if (r < 0) return r;
    t->vectors = numbers(3 * vg_graph_corners(t->graph), e), t->rhs = numbers(3 * h->count, e);
    if (!t->vectors || !t->rhs) return VG_ENOMEM;
    vg_graph_vectors(t->graph, reference, t->vectors);
    r = vg_deformer_new(&t->deformer, t->graph, home, 1, e);
    if (r == VG_OK) r = vg_deformer_target(t->deformer, t->vectors, VG_BY_POSE, e);
    if (r == VG_OK) r = vg_mover_new(&t->mover, t->graph, home, t->graph, reference, NULL, 0, false, e);
    if (r == VG_OK) r = vg_solver_new(&t->solver, t->graph, NULL, 0, reference, VG_WEIGHTS_AREA, 1, e);
    if (r == VG_OK) r = vg_frame_shape(&t->out, h, e);
    return r == VG_OK ? vg_sink_open(&t->sink, output, &t->target, &(vg_sink_options){0}, e) : r;
}

/* For each pose: deform, say where the body goes, solve. */
static int next(transfer *t, vg_err *e)
{
    int r = vg_source_next(t->source, &t->in, e);
    if (r <= 0) return r;
    const double *pose = t->in.values, *vectors = t->vectors, *rhs = t->rhs, *root = t->root.root;
    vg_graph_root(t->graph, pose, t->in.root);
    vg_mover_move(t->mover, &t->in, &t->root);
    vg_deformer_transfer(t->deformer, 1, VG_VERTICES, &pose, &t->vectors);
    vg_solver_load(t->solver, 1, &vectors, NULL, &t->out.values, &t->rhs);
    vg_solver_solve(t->solver, 1, &rhs, &t->out.values, NULL, &root);
    r = vg_frame_label(&t->out, &t->in, e);
    if (r == VG_OK) r = vg_sink_put(t->sink, &t->out, e);
    return r < 0 ? r : 1;
}

static void finish(transfer *t)
{
    vg_sink_close(&t->sink);
    vg_solver_free(&t->solver);
    vg_mover_free(&t->mover);
    vg_deformer_free(&t->deformer);
    vg_graph_free(&t->graph);
    vg_source_close(&t->source);
    vg_head_clear(&t->target);
    vg_frame_clear(&t->in);
    vg_frame_clear(&t->out);
    vg_frame_clear(&t->root);
    free(t->vectors);
    free(t->rhs);
}

int main(int argc, char **argv)
{
    transfer t = {0};
    vg_err e;
    if (argc != 4) return fprintf(stderr, "usage: transfer POSES TARGET OUT\n"), 2;
    int r = prepare(&t, argv[1], argv[2], argv[3], &e);
    while (r >= 0 && (r = next(&t, &e)) > 0) continue;
    if (r == VG_OK) r = vg_sink_end(t.sink, &e);
    if (r < 0) fprintf(stderr, "transfer: %s\n", e.message);
    finish(&t);
    return vg_exit_status(r);
}
