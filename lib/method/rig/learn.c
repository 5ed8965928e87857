/* learn.c: fits weights and motions of bones alternately, on all vertices or a subset. The fits themselves are in
 * skin.c, inverse_skin.c and free_bones.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/learn.h"
#include "method/rig/skin.h"
#include "numeric/stats.h"

#include <math.h>
#include <stdlib.h>

enum { ROUNDS = 30 };

int vgi_learning_gather(vgi_learning *l, size_t nv, const double *reference, size_t n, const double *const *poses,
                        size_t most, vg_err *e)
{
    size_t step = (nv + most - 1) / most;
    l->n = n, l->nv = (nv + step - 1) / step;
    l->reference = vgi_array_raw(3 * l->nv, sizeof *l->reference, e);
    l->poses = vgi_array(n, sizeof *l->poses, e);
    l->left = vgi_array(l->nv, sizeof *l->left, e);
    bool ok = l->reference && l->poses && l->left;
    for (size_t i = 0; ok && i < n; i++) ok = (l->poses[i] = vgi_array_raw(3 * l->nv, sizeof(double), e)) != NULL;
    if (!ok) return VG_ENOMEM;
    for (size_t v = 0; v < l->nv; v++) {
        memcpy(l->reference + 3 * v, reference + 3 * step * v, 3 * sizeof(double));
        for (size_t i = 0; i < n; i++) memcpy(l->poses[i] + 3 * v, poses[i] + 3 * step * v, 3 * sizeof(double));
    }
    return VG_OK;
}

void vgi_learning_clear(vgi_learning *l)
{
    free(l->rig.skin_bone);
    free(l->rig.skin_weight);
    free(l->reference);
    for (size_t i = 0; l->poses && i < l->n; i++) free(l->poses[i]);
    free(l->poses);
    free(l->left);
    vgi_rig_sums_clear(&l->sums);
    l->rig.skin_bone = NULL, l->rig.skin_weight = NULL, l->reference = NULL, l->poses = NULL, l->left = NULL;
}

int vgi_learning_weights(vgi_learning *l, double *miss, vg_err *e)
{
    vgi_rig_sums *s = &l->sums;
    int r = s->nv ? VG_OK : vgi_rig_sums_make(s, l->nv, l->rig.nbones, l->at, NULL, e);
    if (r < 0) return r;
    vgi_rig_sums_restart(s);
    vgi_rig_sums_add(s, l->n, (const double *const *)l->poses, (const double *const *)l->transforms, l->threads);
    r = vgi_skin_fit(&l->rig, s, l->reference, l->threads, l->left, e);
    if (r == VG_OK) *miss = vgi_mean(l->left, l->nv);
    return r;
}

int vgi_learning_alternate(vgi_learning *l, int (*motions)(vgi_learning *, void *, bool, vg_err *), void *context,
                           bool begun, double *miss, vg_err *e)
{
    int r = VG_OK;
    double before = INFINITY;
    for (int round = 0; r == VG_OK && round < ROUNDS; round++) {
        r = motions(l, context, begun, e);
        if (r == VG_OK) r = vgi_learning_weights(l, miss, e);
        if (r == VG_OK && !(*miss < 0.996 * before)) break;
        before = *miss, begun = true;
    }
    return r;
}

void vgi_learning_keep(vgi_learning *l, vg_rig *r)
{
    free(r->skin_bone);
    free(r->skin_weight);
    r->skin_bone = l->rig.skin_bone, r->skin_weight = l->rig.skin_weight;
    l->rig.skin_bone = NULL, l->rig.skin_weight = NULL;
}
