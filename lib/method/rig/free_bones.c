/* free_bones.c: fits the motions of bones without a skeleton to poses given as vertices.
 *
 * Linear blend skinning is linear in the 3 x 4 matrices T_j = [R_j t_j] of the bones, which map (p - at_j, 1) to the
 * pose. Summed over all vertices the squared distance is the quadratic tr(T G T') - 2 tr(T B') in T = [T_1 T_2 ...].
 * G depends on the weights alone; B takes one pass over the pose. The quadratic is minimised bone by bone, each with
 * the best rotation and translation for fixed other bones (Le and Deng 2012), until no bone rotates any more.
 * Bones connected by a skeleton are in inverse_skin.c, weights in decompose.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/free_bones.h"
#include "numeric/polar.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

enum { BLOCK = 8, SWEEPS = 100 };

struct vg_free_bones {
    size_t nv, n;
    int threads;
    double *at;       /* 3 n */
    uint32_t *bone;   /* VG_SKIN per vertex */
    double *local;    /* 4 per bone of a vertex: its weight times (p - at, 1) */
    double *g;        /* 4 n x 4 n */
    size_t *first;    /* n + 1: the bones that share vertices with bone j are near[first[j]] .. near[first[j + 1] - 1] */
    uint32_t *near;
    double *own;      /* 16 n: per bone the sum of weight (p - at, 1) (p - at, 1)' */
    double *space;    /* BLOCK times the workspace */
};

/* Workspace of one pose. */
typedef struct working {
    double *t, *b, *left; /* 12 n each, as 3 x 4 n: T, B, B - T G */
} working;

static working working_at(const vg_free_bones *x, size_t i)
{
    double *p = x->space + i * 36 * x->n;
    return (working){p, p + 12 * x->n, p + 24 * x->n};
}

static void make_quadratic(vg_free_bones *x, const double *weight)
{
    size_t width = 4 * x->n;
    for (size_t v = 0; v < x->nv; v++)
        for (size_t s = VG_SKIN * v; s < VG_SKIN * v + VG_SKIN; s++) {
            if (!(weight[s] > 0)) continue;
            const double *a = x->local + 4 * s;
            double *own = x->own + 16 * (size_t)x->bone[s];
            for (size_t i = 0; i < 4; i++)
                for (size_t k = 0; k < 4; k++) own[4 * i + k] += a[i] * a[k] / weight[s];
            for (size_t u = VG_SKIN * v; u < VG_SKIN * v + VG_SKIN; u++) {
                if (!(weight[u] > 0)) continue;
                const double *b = x->local + 4 * u;
                double *g = x->g + 4 * x->bone[s] * width + 4 * (size_t)x->bone[u];
                for (size_t i = 0; i < 4; i++)
                    for (size_t k = 0; k < 4; k++) g[i * width + k] += a[i] * b[k];
            }
        }
}

/* The blocks of G that are not zero, row by row. */
static int find_near(vg_free_bones *x, vg_err *e)
{
    size_t n = x->n, count = 0, width = 4 * n;
    bool *shared = vgi_array(n, n * sizeof *shared, e);
    if (!shared) return VG_ENOMEM;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) count += shared[j * n + i] = x->g[(4 * j + 3) * width + 4 * i + 3] > 0;
    if ((x->near = vgi_array(count, sizeof *x->near, e)))
        for (size_t j = 0; j < n; j++) {
            x->first[j + 1] = x->first[j];
            for (size_t i = 0; i < n; i++)
                if (shared[j * n + i]) x->near[x->first[j + 1]++] = (uint32_t)i;
        }
    free(shared);
    return x->near ? VG_OK : VG_ENOMEM;
}

int vg_free_bones_new(vg_free_bones **out, const vg_rig *r, size_t nv, const double *reference, int threads, vg_err *e)
{
    *out = NULL;
    if (!r->nbones || !r->skin_bone) return vg_fail(e, VG_EINPUT, "there is no rig with weights");
    size_t n = r->nbones;
    vg_free_bones *x = *out = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    x->nv = nv, x->n = n, x->threads = threads;
    x->at = vgi_array(3 * n, sizeof *x->at, e);
    x->bone = vgi_copy_array(r->skin_bone, VG_SKIN * nv, sizeof *x->bone, e);
    x->local = vgi_array(VG_SKIN * nv, 4 * sizeof *x->local, e);
    x->g = vgi_array(4 * n, 4 * n * sizeof *x->g, e), x->own = vgi_array(16 * n, sizeof *x->own, e);
    x->space = vgi_array(BLOCK, 36 * n * sizeof *x->space, e), x->first = vgi_array(n + 1, sizeof *x->first, e);
    if (!x->at || !x->first || !x->bone || !x->local || !x->g || !x->own || !x->space) {
        vg_free_bones_free(out);
        return VG_ENOMEM;
    }
    for (size_t b = 0; b < n; b++) memcpy(x->at + 3 * b, r->at + 3 * (size_t)r->bone[b], 3 * sizeof *x->at);
    for (size_t s = 0; s < VG_SKIN * nv; s++) {
        const double *p = reference + 3 * (s / VG_SKIN), *at = x->at + 3 * (size_t)x->bone[s], w = r->skin_weight[s];
        vgi_subtract(p, at, x->local + 4 * s), vgi_scale(x->local + 4 * s, w);
        x->local[4 * s + 3] = w;
    }
    make_quadratic(x, r->skin_weight);
    int done = find_near(x, e);
    if (done < 0) vg_free_bones_free(out);
    return done;
}

void vg_free_bones_free(vg_free_bones **out)
{
    vg_free_bones *x = *out;
    if (!x) return;
    free(x->at);
    free(x->bone);
    free(x->local);
    free(x->g);
    free(x->own);
    free(x->first);
    free(x->near);
    free(x->space);
    free(x);
    *out = NULL;
}

/* ---- one pose ---- */

/* B of a pose relative to its centroid. */
static void load_pose(const vg_free_bones *x, const double *pose, const double centre[3], working *w)
{
    size_t width = 4 * x->n;
    memset(w->b, 0, 3 * width * sizeof *w->b);
    for (size_t s = 0; s < VG_SKIN * x->nv; s++) {
        const double *y = pose + 3 * (s / VG_SKIN), *q = x->local + 4 * s;
        if (!(q[3] > 0)) continue;
        for (size_t c = 0; c < 3; c++) {
            double *b = w->b + c * width + 4 * (size_t)x->bone[s], d = y[c] - centre[c];
            for (size_t k = 0; k < 4; k++) b[k] += d * q[k];
        }
    }
}

/* The rotation and translation t (3 x 4, row stride `to`) that minimise tr(t g t') - 2 tr(t m'), g 4 x 4. */
static void place_bone(const double *g, size_t stride, const double m[12], double *t, size_t to)
{
    double centred[9], r[9], w = g[3 * stride + 3];
    for (size_t c = 0; c < 3; c++)
        for (size_t k = 0; k < 3; k++) centred[3 * c + k] = m[4 * c + k] - m[4 * c + 3] * g[3 * stride + k] / w;
    vgi_fit_rotation(centred, r);
    for (size_t c = 0; c < 3; c++) {
        for (size_t k = 0; k < 3; k++) t[c * to + k] = r[3 * c + k];
        t[c * to + 3] = (m[4 * c + 3] - vgi_dot(r + 3 * c, g + 3 * stride)) / w;
    }
}

/* Fit each bone alone, as if no other bone moved its vertices. A bone without vertices follows the whole body. */
static void start_alone(const vg_free_bones *x, working *w)
{
    size_t width = 4 * x->n;
    for (size_t j = 0; j < x->n; j++) {
        double m[12], *t = w->t + 4 * j;
        for (size_t i = 0; i < 12; i++) m[i] = w->b[i / 4 * width + 4 * j + i % 4];
        if (x->own[16 * j + 15] > 0) place_bone(x->own + 16 * j, 4, m, t, width);
        else
            for (size_t i = 0; i < 12; i++) t[i / 4 * width + i % 4] = i % 5 == 0;
    }
}

/* B - T G loses d (3 x 4) in the columns of bone j. */
static void deduct(const vg_free_bones *x, working *w, size_t j, const double d[12])
{
    size_t width = 4 * x->n;
    for (size_t q = x->first[j]; q < x->first[j + 1]; q++) {
        const double *g = x->g + 4 * j * width + 4 * (size_t)x->near[q];
        double *left = w->left + 4 * (size_t)x->near[q];
        for (size_t c = 0; c < 3; c++, left += width)
            for (size_t k = 0; k < 4; k++)
                left[k] -= d[4 * c] * g[k] + d[4 * c + 1] * g[width + k] + d[4 * c + 2] * g[2 * width + k] +
                           d[4 * c + 3] * g[3 * width + k];
    }
}

static void find_left(const vg_free_bones *x, working *w)
{
    size_t width = 4 * x->n;
    memcpy(w->left, w->b, 3 * width * sizeof *w->left);
    for (size_t j = 0; j < x->n; j++) {
        double t[12];
        for (size_t i = 0; i < 12; i++) t[i] = w->t[i / 4 * width + 4 * j + i % 4];
        deduct(x, w, j, t);
    }
}

/* Fit bone j with the other bones fixed. Returns the largest change of its rotation. */
static double improve_bone(const vg_free_bones *x, working *w, size_t j)
{
    size_t width = 4 * x->n;
    const double *g = x->g + 4 * j * width + 4 * j;
    double m[12], d[12], old[12], *t = w->t + 4 * j, most = 0;
    for (size_t i = 0; i < 12; i++) old[i] = t[i / 4 * width + i % 4];
    for (size_t c = 0; c < 3; c++)
        for (size_t k = 0; k < 4; k++) {
            m[4 * c + k] = w->left[c * width + 4 * j + k];
            for (size_t i = 0; i < 4; i++) m[4 * c + k] += old[4 * c + i] * g[i * width + k];
        }
    place_bone(g, width, m, t, width);
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < 4; i++) {
            d[4 * c + i] = t[c * width + i] - old[4 * c + i];
            if (i < 3) most = fmax(most, fabs(d[4 * c + i]));
        }
    deduct(x, w, j, d);
    return most;
}

typedef struct fitting {
    const vg_free_bones *x;
    const double *const *poses;
    double *const *transforms;
    bool begun;
} fitting;

/* Initialise T with the given transforms. */
static void continue_from(const vg_free_bones *x, const double *transforms, const double centre[3], working *w)
{
    size_t width = 4 * x->n;
    for (size_t j = 0; j < x->n; j++) {
        const double *q = transforms + 7 * j;
        double a[9];
        vg_quat_matrix(q, a);
        for (size_t c = 0; c < 3; c++) {
            double *t = w->t + c * width + 4 * j;
            memcpy(t, a + 3 * c, 3 * sizeof *t);
            t[3] = vgi_dot(a + 3 * c, x->at + 3 * j) + q[4 + c] - centre[c];
        }
    }
}

static void fit_pose(void *context, size_t k)
{
    static const double still = 1e-6; /* radians, approximately: a smaller change ends the iteration */
    const fitting *f = context;
    const vg_free_bones *x = f->x;
    size_t width = 4 * x->n;
    working w = working_at(x, k);
    double centre[3], most = 1;
    vg_centroid(f->poses[k], x->nv, centre);
    load_pose(x, f->poses[k], centre, &w);
    if (f->begun) continue_from(x, f->transforms[k], centre, &w);
    else start_alone(x, &w);
    find_left(x, &w);
    for (int sweep = 0; sweep < SWEEPS && most > still; sweep++) {
        most = 0;
        for (size_t j = 0; j < x->n; j++)
            if (x->own[16 * j + 15] > 0) most = fmax(most, improve_bone(x, &w, j));
    }
    for (size_t j = 0; j < x->n; j++) {
        double r[9], *to = f->transforms[k] + 7 * j;
        for (size_t c = 0; c < 3; c++) memcpy(r + 3 * c, w.t + c * width + 4 * j, 3 * sizeof *r);
        vg_quat_from_matrix(r, to);
        for (size_t c = 0; c < 3; c++)
            to[4 + c] = w.t[c * width + 4 * j + 3] + centre[c] - vgi_dot(r + 3 * c, x->at + 3 * j);
    }
}

void vgi_free_bones_continue(vg_free_bones *x, size_t n, const double *const *poses, double *const *transforms,
                             bool begun)
{
    for (size_t first = 0; first < n; first += BLOCK) {
        fitting f = {x, poses + first, transforms + first, begun};
        vgi_parallel(x->threads, n - first < BLOCK ? n - first : BLOCK, fit_pose, &f);
    }
}

void vg_free_bones_fit(vg_free_bones *x, size_t n, const double *const *poses, double *const *transforms)
{
    vgi_free_bones_continue(x, n, poses, transforms, false);
}
