/* branch.c: chooses the whole turns of rotation vectors (MATH 12). All vectors axis * (angle + 2 pi k) represent one
 * rotation; k is chosen so that neighbours agree.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/branch.h"
#include "net/heap.h"
#include "numeric/vec3.h"

#include <stdlib.h>

static const double pi = 3.14159265358979323846, none = 1e-9;
enum { SWEEPS = 20 };

/* the vector of w's rotation nearest to target */
static void near(const double w[3], const double target[3], double out[3])
{
    double angle = vgi_length(w), far = vgi_length(target), axis[3];
    if (angle < none) {
        double turns = far > none ? 2 * pi * round(far / (2 * pi)) / far : 0; /* any axis is possible: use that of the
                                                                                 target */
        for (int k = 0; k < 3; k++) out[k] = turns != 0 ? turns * target[k] : w[k];
        return;
    }
    vgi_divided(w, angle, axis);
    double k = round((vgi_dot(target, axis) - angle) / (2 * pi)), length = angle + 2 * pi * k;
    for (int i = 0; i < 3; i++) out[i] = k != 0 ? axis[i] * length : w[i];
}

/* ---- the first pose ---- */

/* the angle between the rotations of two vectors */
static double angle_between(const double *a, const double *b)
{
    double qa[4], qb[4], la[4] = {0, a[0] / 2, a[1] / 2, a[2] / 2}, lb[4] = {0, b[0] / 2, b[1] / 2, b[2] / 2};
    vg_quat_exp(la, qa);
    vg_quat_exp(lb, qb);
    double c = fabs(qa[0] * qb[0] + qa[1] * qb[1] + qa[2] * qb[2] + qa[3] * qb[3]);
    return 2 * acos(fmin(c, 1));
}

/* Prim's tree from the centre: each vertex takes the branch nearest to its parent's. */
static void grow_tree(const vgi_rings *g, uint32_t centre, double *w, size_t stride, vgi_heap *h, double *key,
                 uint32_t *parent)
{
    key[centre] = 0, parent[centre] = centre;
    vgi_heap_lower(h, centre);
    while (h->n) {
        uint32_t v = vgi_heap_take(h);
        key[v] = -1; /* in the tree */
        if (parent[v] != v) near(w + stride * v, w + stride * parent[v], w + stride * v);
        for (uint32_t i = g->first[v]; i < g->first[v + 1]; i++) {
            uint32_t to = g->to[i];
            if (key[to] < 0) continue;
            double angle = angle_between(w + stride * v, w + stride * to);
            if (!(angle < key[to])) continue;
            key[to] = angle, parent[to] = v;
            vgi_heap_lower(h, to);
        }
    }
}

int vgi_branch_first(const vgi_rings *g, double *w, size_t stride, vg_err *e)
{
    double *key = vgi_array_raw(g->nv, sizeof *key, e);
    uint32_t *heap = vgi_array_raw(g->nv, 2 * sizeof *heap, e), *parent = vgi_array_raw(g->nv, sizeof *parent, e);
    int r = key && heap && parent ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        vgi_heap h = {0, heap, heap + g->nv, key};
        for (size_t v = 0; v < g->nv; v++) key[v] = INFINITY, h.place[v] = UINT32_MAX;
        for (size_t p = 0; p < g->nparts; p++) grow_tree(g, g->centre[p], w, stride, &h, key, parent);
    }
    free(key);
    free(heap);
    free(parent);
    return r;
}

/* ---- later poses ---- */

/* cost of a vector relative to its neighbours, and to that of the previous pose */
static double cost(const vgi_rings *g, size_t v, const double x[3], const double *w, size_t stride,
                   const double *before)
{
    double sum = 0;
    for (uint32_t i = g->first[v]; i < g->first[v + 1]; i++) sum += vgi_square(x, w + stride * g->to[i]);
    return before ? sum + (double)(g->first[v + 1] - g->first[v]) * vgi_square(x, before) : sum;
}

/* Try other whole turns and keep them if they cost less. */
static bool improve(const vgi_rings *g, size_t v, double *w, size_t stride, const double *before)
{
    double mean[3] = {0, 0, 0}, n = (double)(g->first[v + 1] - g->first[v]), x[3], *own = w + stride * v;
    if (!(n > 0)) return false;
    for (uint32_t i = g->first[v]; i < g->first[v + 1]; i++)
        for (size_t k = 0; k < 3; k++) mean[k] += w[stride * g->to[i] + k] / n;
    near(own, mean, x);
    if (vgi_square(x, own) < 1) return false;
    if (!(cost(g, v, x, w, stride, before) < cost(g, v, own, w, stride, before) - 1e-9)) return false;
    memcpy(own, x, sizeof x);
    return true;
}

static size_t jumps(const vgi_rings *g, const double *w, size_t stride)
{
    size_t n = 0;
    for (size_t v = 0; v < g->nv; v++)
        for (uint32_t i = g->first[v]; i < g->first[v + 1]; i++)
            n += g->to[i] > v && vgi_square(w + stride * v, w + stride * g->to[i]) > pi * pi;
    return n;
}

size_t vgi_branch_settle(const vgi_rings *g, double *w, size_t stride, const double *before, size_t before_stride)
{
    double most = 0;
    for (size_t v = 0; v < g->nv; v++) most = fmax(most, vgi_dot(w + stride * v, w + stride * v));
    if (most < pi * pi / 4) return 0; /* no mean of neighbours can be nearer to another branch */
    bool changed = true;
    for (int sweep = 0; sweep < SWEEPS && changed; sweep++) {
        changed = false;
        for (size_t v = 0; v < g->nv; v++)
            changed |= improve(g, v, w, stride, before ? before + before_stride * v : NULL);
    }
    return jumps(g, w, stride);
}

size_t vgi_branch_next(const vgi_rings *g, double *w, size_t stride, const double *before, size_t before_stride)
{
    for (size_t v = 0; v < g->nv; v++) near(w + stride * v, before + before_stride * v, w + stride * v);
    return vgi_branch_settle(g, w, stride, before, before_stride);
}
