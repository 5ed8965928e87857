/* examples.c: transfer that reproduces a few sculpted poses: plain transfer plus a correction for its error in them.
 *
 * A pose of the source has coordinates with respect to the examples, by least squares over the logarithms of its
 * corners' rotations and stretches (MATH 11), without rigid motion of the body. The error of plain transfer in an
 * example is stored per corner of the target, in the frame of that corner, and rotates with the corner. So examples
 * are reproduced exactly, and other poses keep their detail. The transfer itself is elsewhere.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/lapack.h"
#include "numeric/vec3.h"
#include "signal/root.h"

#include <math.h>
#include <stdlib.h>

struct vg_corrector {
    const vg_graph *source, *target;
    double *reference;        /* reference of the source */
    vg_deformer *of_source, *of_target;
    size_t n, from, to;       /* number of examples; of corners of source and target */
    double *weight;           /* per corner of the source: square root of its share of the surface */
    double *feature;          /* n x 4 from */
    double *factor;           /* n x n: Cholesky factor of the examples' products */
    double *miss;             /* n x 3 to: in the frames of the corners */
    double *pose, *quaternions, *now, *x; /* workspace of one pose: vertices, rotations, features, coordinates */
};

void vg_corrector_free(vg_corrector **out)
{
    vg_corrector *c = *out;
    if (!c) return;
    vg_deformer_free(&c->of_source);
    vg_deformer_free(&c->of_target);
    free(c->reference);
    free(c->weight);
    free(c->feature);
    free(c->factor);
    free(c->miss);
    free(c->pose);
    free(c->quaternions);
    free(c->now);
    free(c->x);
    free(c);
    *out = NULL;
}

static void set_weights(vg_corrector *c)
{
    const vg_graph *g = c->source;
    double *vectors = c->now;
    vg_graph_vectors(g, c->reference, vectors);
    for (size_t f = 0; f < g->faces.nf; f++) {
        double normal[3];
        size_t first = g->faces.start[f], r = g->faces.start[f + 1] - first;
        vgi_area_vector(vectors + 3 * first, r, normal);
        for (size_t i = first; i < first + r; i++) c->weight[i] = sqrt(vgi_length(normal) / 2 / (double)r);
    }
}

/* Rotations and stretches of a pose's corners, without the rigid motion of the body. */
static void measure_feature(vg_corrector *c, const double *pose, double *feature)
{
    size_t nv = c->source->faces.nv;
    double turn[4], shift[3];
    memcpy(c->pose, pose, 3 * nv * sizeof *pose);
    vgi_root_remove(1, nv, c->reference, c->pose, turn, shift);
    vg_deformer_measure(c->of_source, 1, VG_VERTICES, (const double *const *)&c->pose, &c->quaternions);
    for (size_t i = 0; i < c->from; i++) {
        double l[4], *f = feature + 4 * i, *q = c->quaternions + 4 * i, w = c->weight[i];
        double positive[4] = {q[0], q[1], q[2], q[3]};
        for (int k = 0; k < 4 && q[0] < 0; k++) positive[k] = -q[k];
        vg_quat_log(positive, l);
        f[0] = w * sqrt(3) * 2 * l[0];
        for (int k = 1; k < 4; k++) f[k] = w * M_SQRT2 * 2 * l[k];
    }
}

static int factor(vg_corrector *c, vg_err *e)
{
    double most = 0;
    bool definite;
    for (size_t i = 0; i < c->n; i++) {
        for (size_t j = 0; j <= i; j++)
            c->factor[i * c->n + j] = vgi_inner(c->feature + 4 * c->from * i, c->feature + 4 * c->from * j, 4 * c->from);
        most = fmax(most, c->factor[i * c->n + i]);
    }
    definite = vgi_spd_factor(c->n, c->factor);
    for (size_t i = 0; i < c->n && definite; i++) /* the component of example i outside the span of those before it */
        definite = c->factor[i * c->n + i] * c->factor[i * c->n + i] > 1e-10 * most;
    if (definite) return VG_OK;
    return vg_fail(e, VG_EINPUT, "the examples are not independent: one of them is the reference pose, or is a "
                                 "combination of the others");
}

/* Rotations of the target's corners, from its vectors. */
static void turns_of(vg_corrector *c, const double *vectors)
{
    vg_deformer_measure(c->of_target, 1, VG_VECTORS, &vectors, &c->quaternions);
    for (size_t i = 0; i < c->to; i++) {
        double *q = c->quaternions + 4 * i, size = sqrt(vgi_inner(q, q, 4));
        for (int k = 0; k < 4; k++) q[k] = size > 0 ? q[k] / size : k == 0;
    }
}

/* Store the error of plain transfer in example j. */
static void keep_miss(vg_corrector *c, size_t j, const double *wanted, const double *transferred)
{
    turns_of(c, transferred);
    for (size_t i = 0; i < c->to; i++) {
        const double *q = c->quaternions + 4 * i, *w = wanted + 3 * i, *t = transferred + 3 * i;
        vg_quat_apply((double[]){q[0], -q[1], -q[2], -q[3]}, (double[]){w[0] - t[0], w[1] - t[1], w[2] - t[2]},
                      c->miss + 3 * (j * c->to + i));
    }
}

static int make_room(vg_corrector *c, vg_err *e)
{
    size_t most = c->from > c->to ? c->from : c->to;
    return (c->weight = vgi_array(c->from, sizeof(double), e)) &&
           (c->feature = vgi_array(c->n * c->from, 4 * sizeof(double), e)) &&
           (c->factor = vgi_array(c->n * c->n, sizeof(double), e)) &&
           (c->miss = vgi_array(c->n * c->to, 3 * sizeof(double), e)) &&
           (c->pose = vgi_array(c->source->faces.nv, 3 * sizeof(double), e)) &&
           (c->quaternions = vgi_array(most, 4 * sizeof(double), e)) &&
           (c->now = vgi_array(most, 4 * sizeof(double), e)) && (c->x = vgi_array(c->n, sizeof(double), e)) ? VG_OK
                                                                                                           : VG_ENOMEM;
}

int vg_corrector_new(vg_corrector **out, const vg_graph *source, const double *source_reference, const vg_graph *target,
                     const double *target_reference, const vg_examples *examples, int threads, vg_err *e)
{
    vg_corrector *c = *out = vgi_array(1, sizeof *c, e);
    if (!c) return VG_ENOMEM;
    c->source = source, c->target = target, c->n = examples->n;
    c->from = vg_graph_corners(source), c->to = vg_graph_corners(target);
    int r = make_room(c, e);
    if (r == VG_OK && !(c->reference = vgi_copy_array(source_reference, source->faces.nv, 3 * sizeof(double), e))) r = VG_ENOMEM;
    if (r == VG_OK) r = vg_deformer_new(&c->of_source, source, source_reference, threads, e);
    if (r == VG_OK) r = vg_deformer_new(&c->of_target, target, target_reference, threads, e);
    if (r == VG_OK) {
        set_weights(c);
        for (size_t j = 0; j < c->n; j++) measure_feature(c, examples->source[j], c->feature + 4 * c->from * j);
        r = factor(c, e);
    }
    for (size_t j = 0; r == VG_OK && j < c->n; j++) {
        vg_graph_vectors(target, examples->target[j], c->now);
        keep_miss(c, j, c->now, examples->transferred[j]);
    }
    if (r < 0) vg_corrector_free(out);
    return r;
}

void vg_corrector_apply(vg_corrector *c, const double *pose, double *vectors)
{
    measure_feature(c, pose, c->now);
    for (size_t j = 0; j < c->n; j++) c->x[j] = vgi_inner(c->now, c->feature + 4 * c->from * j, 4 * c->from);
    vgi_spd_solve(c->n, c->factor, 1, c->x);
    turns_of(c, vectors);
    for (size_t i = 0; i < c->to; i++) {
        double sum[3] = {0, 0, 0}, turned[3];
        for (size_t j = 0; j < c->n; j++)
            vgi_add_scaled(sum, c->x[j], c->miss + 3 * (j * c->to + i));
        vg_quat_apply(c->quaternions + 4 * i, sum, turned);
        vgi_add(vectors + 3 * i, turned);
    }
}
