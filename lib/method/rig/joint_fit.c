/* joint_fit.c: finds the position of a skeleton's root in a mesh from poses of both.
 *
 * A vertex that is rigid with joint j lies at R (x - at_j) + p in every pose. R, p and x are known; at_j is known
 * except for a shift common to all joints. So each vertex estimates the shift as x - offset_j - mean of R' (y - p),
 * for the joint that it follows most rigidly.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"
#include "numeric/stats.h"

#include <math.h>
#include <stdlib.h>

enum { CHUNK = 128 };

typedef struct locating {
    const vg_skeleton *s;
    size_t nv, n;
    const double *reference, *rest;
    const double *const *poses, *const *positions;
    double *turns;   /* n x joints rotation matrices */
    double *opinion; /* 3 per vertex: its estimate of the shift */
    double *spread;  /* per vertex: root mean square deviation from rigid motion */
} locating;

static double try_joint(const locating *x, size_t v, size_t j, double mean[3])
{
    double square = 0;
    mean[0] = mean[1] = mean[2] = 0;
    for (size_t k = 0; k < x->n; k++) {
        const double *y = x->poses[k] + 3 * v, *p = x->positions[k] + 3 * j,
                     *r = x->turns + 9 * (k * x->s->njoints + j);
        const double d[3] = {y[0] - p[0], y[1] - p[1], y[2] - p[2]};
        for (int i = 0; i < 3; i++) {
            double back = r[i] * d[0] + r[3 + i] * d[1] + r[6 + i] * d[2];
            mean[i] += back, square += back * back;
        }
    }
    for (int i = 0; i < 3; i++) {
        mean[i] /= (double)x->n;
        square -= (double)x->n * mean[i] * mean[i];
    }
    return square;
}

static void ask_vertices(void *context, size_t task)
{
    locating *x = context;
    size_t first = task * CHUNK, last = first + CHUNK < x->nv ? first + CHUNK : x->nv;
    for (size_t v = first; v < last; v++) {
        double least = INFINITY, local[3];
        for (size_t j = 0; j < x->s->njoints; j++) {
            double square = x->s->joints[j].nchannels ? try_joint(x, v, j, local) : INFINITY;
            if (!(square < least)) continue;
            least = square;
            for (size_t i = 0; i < 3; i++)
                x->opinion[3 * v + i] = x->reference[3 * v + i] - x->rest[3 * j + i] - local[i];
        }
        x->spread[v] = least > 0 ? sqrt(least / (double)x->n) : 0;
    }
}

/* Median, per coordinate, of the better half of the vertices. */
static void median_shift(const locating *x, double *list, double shift[3], double *spread)
{
    size_t n = 0;
    memcpy(list, x->spread, x->nv * sizeof *list);
    double limit = vgi_median(list, x->nv);
    for (size_t i = 0; i < 3; i++) {
        n = 0;
        for (size_t v = 0; v < x->nv; v++)
            if (x->spread[v] <= limit) list[n++] = x->opinion[3 * v + i];
        shift[i] = vgi_median(list, n);
    }
    n = 0;
    for (size_t v = 0; v < x->nv; v++) {
        const double *o = x->opinion + 3 * v;
        if (x->spread[v] <= limit)
            list[n++] = sqrt((o[0] - shift[0]) * (o[0] - shift[0]) + (o[1] - shift[1]) * (o[1] - shift[1]) +
                             (o[2] - shift[2]) * (o[2] - shift[2]));
    }
    *spread = vgi_median(list, n);
}

int vg_rig_locate(const vg_skeleton *s, size_t nv, const double *reference, size_t n, const double *const *poses,
                  const double *const *positions, const double *const *turns, int threads, double shift[3],
                  double *spread, vg_err *e)
{
    size_t joints = s->njoints;
    if (!n || !nv || !joints)
        return vg_fail(e, VG_EINPUT, "there are no poses to find the root of the skeleton with");
    double *rest = vgi_array(3 * joints, sizeof *rest, e), *turned = vgi_array(4 * joints, sizeof *turned, e);
    double *list = vgi_array(nv, sizeof *list, e);
    locating x = {
        .s = s, .nv = nv, .n = n, .reference = reference, .rest = rest, .poses = poses, .positions = positions};
    x.turns = vgi_array(n, 9 * joints * sizeof *x.turns, e);
    x.opinion = vgi_array(nv, 3 * sizeof *x.opinion, e), x.spread = vgi_array(nv, sizeof *x.spread, e);
    bool ok = rest && turned && list && x.turns && x.opinion && x.spread;
    if (ok) {
        vg_skeleton_pose(s, NULL, rest, turned);
        for (size_t k = 0; k < n; k++)
            for (size_t j = 0; j < joints; j++) vg_quat_matrix(turns[k] + 4 * j, x.turns + 9 * (k * joints + j));
        vgi_parallel(threads, (nv + CHUNK - 1) / CHUNK, ask_vertices, &x);
        median_shift(&x, list, shift, spread);
    }
    free(rest);
    free(turned);
    free(list);
    free(x.turns);
    free(x.opinion);
    free(x.spread);
    return ok ? VG_OK : VG_ENOMEM;
}
