/* poisson.c: guidance in time: a sequence keeps its second differences and meets given poses at its keys (MATH 5; T
 * 4.1.2, 4.2.5).
 *
 * The Poisson equation in time, T_(k-1) - 2 T_k + T_(k+1) = the same of U with T given at the keys, has the same
 * matrix for every coordinate of every vertex. Between two keys its solution is U plus a function linear in k that
 * meets the keys (T 4.16). The choice of keys, and the storage of frames until the next key is known, are in
 * vg-poisson and spool.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"

#include <stdlib.h>

struct vg_guide {
    size_t n;               /* numbers per pose */
    int keys;               /* number of keys so far, at most 2; with 2 there is an interval */
    uint64_t from, to;      /* frames of the last two keys */
    double *before, *after; /* offsets at the keys */
};

int vg_guide_new(vg_guide **out, size_t nv, vg_err *e)
{
    vg_guide *g = *out = vgi_array(1, sizeof *g, e);
    if (!g) return VG_ENOMEM;
    if (vgi_mul(nv, 3, &g->n) && (g->before = vgi_array(g->n, sizeof *g->before, e)) &&
        (g->after = vgi_array(g->n, sizeof *g->after, e)))
        return VG_OK;
    vg_guide_free(out);
    return vg_fail(e, VG_ENOMEM, "not enough memory for the offsets of %zu vertices", nv);
}

void vg_guide_free(vg_guide **g)
{
    if (!*g) return;
    free((*g)->before);
    free((*g)->after);
    free(*g);
    *g = NULL;
}

void vg_guide_key(vg_guide *g, uint64_t frame, double *pose, const double *given)
{
    double *oldest = g->before;
    g->before = g->after, g->after = oldest;
    g->from = g->to, g->to = frame;
    if (g->keys < 2) g->keys++;
    for (size_t i = 0; i < g->n; i++) g->after[i] = given[i] - pose[i];
    memcpy(pose, given, g->n * sizeof *pose);
}

void vg_guide_apply(const vg_guide *g, uint64_t frame, double *pose)
{
    const double *a = g->before, *b = g->after;
    if (g->keys == 2 && frame < g->to) {
        /* written so that equal offsets give exactly that offset, and zero offsets give the pose bit for bit */
        double t = (double)(frame - g->from) / (double)(g->to - g->from);
        for (size_t i = 0; i < g->n; i++) pose[i] += a[i] + t * (b[i] - a[i]);
    } else if (g->keys) {
        for (size_t i = 0; i < g->n; i++) pose[i] += b[i];
    }
}
