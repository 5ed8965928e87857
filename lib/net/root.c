/* root.c: predicts the root of a locomotion: turn and shift of the root from frame to frame are functions of the
 * body's pose and its change, fitted by ridge regression.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/root.h"
#include "numeric/blas.h"
#include "numeric/lapack.h"
#include "numeric/vec3.h"

#include <math.h>
#include <stdlib.h>

static const double ridge = 1e-3, change_weight = 10;

static void unturn(const double q[4], const double x[3], double y[3])
{
    const double back[4] = {q[0], -q[1], -q[2], -q[3]};
    vg_quat_apply(back, x, y);
}

/* The numbers of vgi_root_predict, measured. */
static void measure_step(const vg_network *n, size_t main_part, const double root[4], const double *centroids,
                    const double next_root[4], const double *next_centroids, double *steps)
{
    double back[4] = {root[0], -root[1], -root[2], -root[3]}, q[4], l[4], shift[3];
    vg_quat_multiply(back, next_root, q);
    if (q[0] < 0)
        for (int k = 0; k < 4; k++) q[k] = -q[k];
    vg_quat_log(q, l);
    vgi_scaled(2, l + 1, steps);
    for (size_t k = 0; k < 3; k++)
        shift[k] = (next_centroids[3 * main_part + k] - centroids[3 * main_part + k]) / n->diagonal;
    unturn(root, shift, steps + 3);
    for (size_t p = 0, at = 6; p < n->parts; p++) {
        if (p == main_part) continue;
        for (size_t k = 0; k < 3; k++)
            shift[k] = (next_centroids[3 * p + k] - next_centroids[3 * main_part + k]) / n->diagonal;
        unturn(next_root, shift, steps + at);
        at += 3;
    }
}

void vgi_root_move(const vg_network *n, size_t main_part, const double *steps, double root[4], double *centroids)
{
    double l[4] = {0, steps[0] / 2, steps[1] / 2, steps[2] / 2}, q[4], shift[3], length = 0;
    vg_quat_apply(root, steps + 3, shift);
    vgi_add_scaled(centroids + 3 * main_part, n->diagonal, shift);
    vg_quat_exp(l, q);
    vg_quat_multiply(root, q, root);
    for (int k = 0; k < 4; k++) length += root[k] * root[k];
    for (int k = 0; k < 4; k++) root[k] /= sqrt(length);
    for (size_t p = 0, at = 6; p < n->parts; p++) {
        if (p == main_part) continue;
        vg_quat_apply(root, steps + at, shift);
        for (size_t k = 0; k < 3; k++)
            centroids[3 * p + k] = centroids[3 * main_part + k] + n->diagonal * shift[k];
        at += 3;
    }
}

static void regressors(const vg_network *n, const double *c, const double *before, double *z)
{
    size_t k = n->rank;
    double size = n->scale[0];
    for (size_t i = 0; i < k; i++) {
        z[i] = c[i] / size;
        z[k + i] = change_weight * (c[i] - before[i]) / size;
    }
    z[2 * k] = 1;
}

void vgi_root_predict(const vg_network *n, const double *c, const double *before, double *steps)
{
    size_t w = vgi_network_roots(n), k = n->rank;
    double size = n->scale[0];
    for (size_t j = 0; j < w; j++) steps[j] = n->root[2 * k * w + j];
    for (size_t i = 0; i < k; i++)
        for (size_t j = 0; j < w; j++)
            steps[j] += c[i] / size * n->root[i * w + j] +
                        change_weight * (c[i] - before[i]) / size * n->root[(k + i) * w + j];
}

int vgi_root_fit(const vgi_dataset *s, vg_network *n, vg_err *e)
{
    size_t k = s->rank, rows = 2 * k + 1, w = vgi_network_roots(n), row = 0, all = vgi_spans_frames(&s->train);
    double *z = vgi_array_raw(all * (rows + w) + rows * rows, sizeof *z, e);
    n->root = vgi_array(rows * w, sizeof *n->root, e);
    if (!z || !n->root) return free(z), VG_ENOMEM;
    double *y = z + all * rows, *a = y + all * w;
    for (size_t i = 0; i < s->train.n; i++)
        for (size_t t = s->train.at[i].first; t + 1 < s->train.at[i].end; t++, row++) {
            regressors(n, s->coordinates + (t + 1) * k, s->coordinates + t * k, z + row * rows);
            measure_step(n, s->main_part, s->roots + 4 * t, s->centroids + 3 * s->parts * t, s->roots + 4 * (t + 1),
                           s->centroids + 3 * s->parts * (t + 1), y + row * w);
        }
    memset(a, 0, rows * rows * sizeof *a);
    if (row) {
        vgi_product_transposed_double(rows, rows, row, z, rows, z, rows, a, rows);
        vgi_product_transposed_double(rows, w, row, z, rows, y, w, n->root, w);
    }
    for (size_t i = 0; i < rows; i++) a[i * rows + i] += ridge * (double)(row ? row : 1) * (i < 2 * k ? 1 : 1e-6);
    int r = vgi_spd_factor(rows, a) ? VG_OK : vg_fail(e, VG_EINPUT, "the frames do not determine the steps of the "
                                                                    "root");
    if (r == VG_OK) vgi_spd_solve(rows, a, w, n->root);
    free(z);
    return r;
}
