/* guide_pose.c: guidance over the pose: the offsets of the keys are mixed by the similarity of a pose to their poses.
 *
 * The error of a transferred sequence depends on the pose, not on time. V_k are the poses of the keys and V that of a
 * frame, centroids at 0. The weights w (sum 1) make sum w_k V_k the nearest point to V in the affine span of the
 * keys; the frame moves by sum w_k e_k, e_k without its mean. The means, which tell where the body is, go by weights in
 * time: a way that drifts does not depend on the pose. Weights in time (poisson.c) are mixed in where sum |w_k| would exceed 2, and
 * used alone where the keys' poses are affinely dependent (two of them are alike). Guidance in time is in poisson.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/lapack.h"
#include "numeric/vec3.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

static const double LEAST_PIVOT = 1e-8; /* least part of V_k - V_0 outside the span of the previous keys, squared,
                                           relative to the whole */
static const double MOST_WEIGHT = 2;    /* largest sum of |w| */

typedef struct pose_key {
    uint64_t frame;
    double *given, *offset; /* n each; the offset without its mean */
    double shift[3];        /* the mean of the offset */
    double *from_first;     /* n: V_k - V_0; for the first key, V_0 */
    double centre[3];       /* of the pose */
} pose_key;

struct vg_pose_guide {
    size_t n;               /* numbers per pose */
    size_t nkeys, cap;
    pose_key *key;
    double *product;        /* cap x cap: products of V_k - V_0, from key 1 on; lower triangle */
    double *factor;         /* (nkeys - 1)^2: Cholesky factor of the products */
    bool factored;
    bool spans;             /* the keys' poses are affinely independent */
    double *weight, *timed; /* cap */
    double *from_pose;      /* n: V - V_0 of the current frame */
};

int vg_pose_guide_new(vg_pose_guide **out, size_t nv, size_t keys, vg_err *e)
{
    vg_pose_guide *g = *out = vgi_array(1, sizeof *g, e);
    if (!g) return VG_ENOMEM;
    bool fits = vgi_mul(nv, 3, &g->n);
    g->cap = keys;
    g->key = vgi_array(keys, sizeof *g->key, e);
    g->product = vgi_array(keys, keys * sizeof *g->product, e);
    g->factor = vgi_array(keys, keys * sizeof *g->factor, e);
    g->weight = vgi_array(keys, sizeof *g->weight, e);
    g->timed = vgi_array(keys, sizeof *g->timed, e);
    g->from_pose = fits ? vgi_array(g->n, sizeof *g->from_pose, e) : NULL;
    bool there = g->from_pose && g->key && g->product && g->factor && g->weight && g->timed;
    for (size_t k = 0; k < keys && there; k++) {
        pose_key *x = &g->key[k];
        x->given = vgi_array(g->n, sizeof *x->given, e);
        x->offset = vgi_array(g->n, sizeof *x->offset, e);
        x->from_first = vgi_array(g->n, sizeof *x->from_first, e);
        there = x->given && x->offset && x->from_first;
    }
    if (there) return VG_OK;
    vg_pose_guide_free(out);
    return vg_fail(e, VG_ENOMEM, "not enough memory for %zu given poses of %zu vertices", keys, nv);
}

void vg_pose_guide_free(vg_pose_guide **out)
{
    vg_pose_guide *g = *out;
    if (!g) return;
    for (size_t k = 0; k < g->cap && g->key; k++) {
        free(g->key[k].given);
        free(g->key[k].offset);
        free(g->key[k].from_first);
    }
    free(g->key);
    free(g->product);
    free(g->factor);
    free(g->weight);
    free(g->timed);
    free(g->from_pose);
    free(g);
    *out = NULL;
}

/* pose - its centroid - V_0 */
static double away(const vg_pose_guide *g, const double *pose, const double centre[3], size_t i)
{
    return pose[i] - centre[i % 3] - (g->nkeys ? g->key[0].from_first[i] : 0);
}

static void factor_products(vg_pose_guide *g)
{
    size_t m = g->nkeys - 1; /* key 0 has no row */
    for (size_t i = 0; i < m; i++) memcpy(g->factor + i * m, g->product + i * g->cap, (i + 1) * sizeof *g->factor);
    g->spans = m == 0 || vgi_spd_factor(m, g->factor);
    for (size_t i = 0; i < m && g->spans; i++) {
        double pivot = g->factor[i * m + i];
        g->spans = pivot * pivot > LEAST_PIVOT * g->product[i * g->cap + i];
    }
    g->factored = true;
}

void vg_pose_guide_key(vg_pose_guide *g, uint64_t frame, const double *pose, const double *given)
{
    assert(g->nkeys < g->cap);
    pose_key *x = &g->key[g->nkeys];
    x->frame = frame;
    vg_centroid(pose, g->n / 3, x->centre);
    for (size_t i = 0; i < g->n; i++) {
        x->from_first[i] = away(g, pose, x->centre, i);
        x->offset[i] = given[i] - pose[i];
        x->given[i] = given[i];
    }
    for (size_t j = 1; j <= g->nkeys; j++)
        g->product[(g->nkeys - 1) * g->cap + j - 1] = vgi_inner(x->from_first, g->key[j].from_first, g->n);
    vg_centroid(x->offset, g->n / 3, x->shift);
    for (size_t i = 0; i < g->n; i++) x->offset[i] -= x->shift[i % 3];
    g->nkeys++, g->factored = false;
}

/* Linear between the two keys around a frame; the nearest key alone before the first and after the last. */
static void weigh_in_time(vg_pose_guide *g, uint64_t frame)
{
    size_t after = 0;
    while (after < g->nkeys && g->key[after].frame < frame) after++;
    for (size_t k = 0; k < g->nkeys; k++) g->timed[k] = 0;
    if (after == 0 || after == g->nkeys) {
        g->timed[after ? after - 1 : 0] = 1;
        return;
    }
    uint64_t a = g->key[after - 1].frame, b = g->key[after].frame;
    g->timed[after] = (double)(frame - a) / (double)(b - a);
    g->timed[after - 1] = 1 - g->timed[after];
}

/* Coordinates of a pose in the keys, by least squares. */
static void weigh_over_pose(vg_pose_guide *g, const double *pose)
{
    double centre[3], *w = g->weight, *d = g->from_pose;
    size_t m = g->nkeys - 1;
    vg_centroid(pose, g->n / 3, centre);
    for (size_t i = 0; i < g->n; i++) d[i] = away(g, pose, centre, i);
    for (size_t j = 1; j <= m; j++) w[j] = vgi_inner(g->key[j].from_first, d, g->n);
    if (m) vgi_spd_solve(m, g->factor, 1, w + 1);
    w[0] = 1;
    for (size_t j = 1; j <= m; j++) w[0] -= w[j];
}

static double size_at(const vg_pose_guide *g, double share)
{
    double sum = 0;
    for (size_t k = 0; k < g->nkeys; k++) sum += fabs(g->timed[k] + share * (g->weight[k] - g->timed[k]));
    return sum;
}

/* Largest share of the pose weights, mixed with those in time, for which sum |w| is at most MOST_WEIGHT. The sum is
 * convex in the share and 1 at share 0. */
static double share_of_pose(const vg_pose_guide *g)
{
    if (!g->spans) return 0;
    if (size_at(g, 1) <= MOST_WEIGHT) return 1;
    double low = 0, high = 1;
    for (int i = 0; i < 50; i++) {
        double middle = (low + high) / 2;
        if (size_at(g, middle) > MOST_WEIGHT) high = middle;
        else low = middle;
    }
    return low;
}

void vg_pose_guide_apply(vg_pose_guide *g, uint64_t frame, double *pose)
{
    if (!g->nkeys) return;
    if (!g->factored) factor_products(g);
    weigh_in_time(g, frame);
    for (size_t k = 0; k < g->nkeys; k++)
        if (g->key[k].frame == frame) {
            memcpy(pose, g->key[k].given, g->n * sizeof *pose);
            return;
        }
    if (g->spans) weigh_over_pose(g, pose);
    double share = share_of_pose(g);
    for (size_t k = 0; k < g->nkeys; k++) {
        double w = g->spans ? g->timed[k] + share * (g->weight[k] - g->timed[k]) : g->timed[k];
        const pose_key *x = &g->key[k];
        for (size_t i = 0; i < g->n; i++) pose[i] += w * x->offset[i] + g->timed[k] * x->shift[i % 3];
    }
}
