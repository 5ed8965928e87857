/* pick.c: chooses the frames that best represent the others: pivoted Cholesky factorisation of their Gram matrix.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/blas.h"
#include "signal/root.h"
#include "signal/signal.h"

#include <math.h>
#include <stdlib.h>

/* Update the diagonal of the remainder of g, given the frames chosen so far. */
static void factor_step(size_t n, const double *g, double *l, size_t step, size_t pivot, double *left)
{
    double root = sqrt(left[pivot]);
    for (size_t i = 0; i < n; i++) {
        double sum = g[i * n + pivot];
        for (size_t k = 0; k < step; k++) sum -= l[k * n + i] * l[k * n + pivot];
        l[step * n + i] = root > 0 ? sum / root : 0;
    }
    for (size_t i = 0; i < n; i++) left[i] = fmax(left[i] - l[step * n + i] * l[step * n + i], 0);
    left[pivot] = 0;
}

int vg_signal_pick(const vg_body *body, double *poses, size_t n, size_t count, int threads, uint32_t *frames, double *left,
                   vg_err *e)
{
    size_t nv = body->mesh.nv, d = 3 * nv;
    int r = VG_ENOMEM;
    double *turn = vgi_array(n, 4 * sizeof *turn, e), *shift = vgi_array(n, 3 * sizeof *shift, e);
    double *g = vgi_array(n * n, sizeof *g, e), *l = vgi_array(n * count, sizeof *l, e), *rest = vgi_array(n, sizeof *rest, e);
    if (!turn || !shift || !g || !l || !rest) goto out;
    vgi_root_remove(n, nv, body->reference, poses, turn, shift);
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < d; c++) poses[i * d + c] -= body->reference[c];
    vgi_blas_alone();
    vgi_gram(n, d, poses, g, threads);
    vgi_blas_shared();
    double all = 0;
    for (size_t i = 0; i < n; i++) all += rest[i] = g[i * n + i];
    for (size_t step = 0; step < count; step++) {
        size_t pivot = 0;
        for (size_t i = 1; i < n; i++)
            if (rest[i] > rest[pivot]) pivot = i;
        double sum = 0;
        factor_step(n, g, l, step, pivot, rest);
        for (size_t i = 0; i < n; i++) sum += rest[i];
        frames[step] = (uint32_t)pivot;
        left[step] = all > 0 ? sqrt(sum / all) : 0;
    }
    r = VG_OK;
out:
    free(turn);
    free(shift);
    free(g);
    free(l);
    free(rest);
    return r;
}
