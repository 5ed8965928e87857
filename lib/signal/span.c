/* span.c: shapes as sums of example poses (C 4.3), and the same sums of another body's poses.
 *
 * Fitting needs orthonormal vectors; a signal of examples stores the differences between examples, so that those of
 * another body can replace them. The Cholesky factor of the differences' products converts between both.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/span.h"
#include "numeric/vec3.h"
#include "numeric/blas.h"
#include "numeric/lapack.h"
#include "signal/root.h"

#include <math.h>
#include <stdlib.h>

void vgi_span_clear(vgi_span *s)
{
    free(s->home);
    free(s->difference);
    free(s->factor);
    free(s->offset);
    *s = (vgi_span){0};
}

/* ---- orthonormal vectors from examples ---- */

static void subtract_first(size_t n, size_t d, const double *from, double *rows)
{
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < d; c++) rows[i * d + c] -= from[c];
}

static int take_differences(vgi_span *s, const double *examples, int threads, vg_err *e)
{
    size_t d = s->d, m = s->m;
    double most = 0;
    if (!(s->home = vgi_copy_array(examples, d, sizeof *s->home, e)) ||
        !(s->difference = vgi_copy_array(examples + d, m * d, sizeof *s->difference, e)) ||
        !(s->factor = vgi_array(m * m, sizeof *s->factor, e)) || !(s->offset = vgi_array(m, sizeof *s->offset, e)))
        return VG_ENOMEM;
    subtract_first(m, d, s->home, s->difference);
    vgi_gram(m, d, s->difference, s->factor, threads);
    for (size_t j = 0; j < m; j++) most = fmax(most, s->factor[j * m + j]);
    bool definite = vgi_spd_factor(m, s->factor);
    for (size_t j = 0; j < m && definite; j++) definite = s->factor[j * m + j] * s->factor[j * m + j] > 1e-10 * most;
    return definite ? VG_OK
                    : vg_fail(e, VG_EINPUT, "the examples are not independent: one of them is the first one, or is a "
                                            "combination of the others");
}

/* Coordinates of the frames in the orthonormal vectors, and their mean. */
static void measure_coordinates(vgi_span *s, vgi_basis *b)
{
    size_t n = b->n, m = s->m;
    vgi_product_double_transposed(n, m, s->d, b->centred, s->d, b->vectors, s->d, b->x, m);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < m; j++) s->offset[j] += b->x[i * m + j] / (double)n;
    subtract_first(n, m, s->offset, b->x);
}

static void move_mean(const vgi_span *s, vgi_basis *b)
{
    size_t d = s->d;
    memset(b->mean, 0, d * sizeof *b->mean);
    for (size_t j = 0; j < s->m; j++)
        for (size_t c = 0; c < d; c++) b->mean[c] += s->offset[j] * b->vectors[j * d + c];
    subtract_first(b->n, d, b->mean, b->centred);
    for (size_t c = 0; c < d; c++) b->mean[c] += s->home[c];
}

int vgi_span_make(vgi_span *s, vgi_basis *b, double *poses, size_t n, size_t d, const double *examples, size_t count,
                  int threads, vg_err *e)
{
    *s = (vgi_span){.d = d, .m = count - 1};
    *b = (vgi_basis){.n = n, .d = d, .rank = s->m, .centred = poses};
    vgi_blas_alone();
    int r = take_differences(s, examples, threads, e);
    if (r == VG_OK) {
        b->mean = vgi_array(d, sizeof *b->mean, e);
        b->vectors = vgi_copy_array(s->difference, s->m * d, sizeof *b->vectors, e);
        b->x = vgi_array(n * s->m, sizeof *b->x, e);
        b->value = vgi_array(s->m, sizeof *b->value, e);
        r = b->mean && b->vectors && b->x && b->value ? VG_OK : VG_ENOMEM;
    }
    if (r == VG_OK) {
        vgi_solve_lower_stripe(s->m, s->factor, d, b->vectors, d);
        subtract_first(n, d, s->home, b->centred);
        measure_coordinates(s, b);
        move_mean(s, b);
    } else {
        vgi_basis_clear(b);
        vgi_span_clear(s);
    }
    vgi_blas_shared();
    return r;
}

int vgi_span_project(const vgi_basis *b, double **poses, vg_err *e)
{
    if (!(*poses = vgi_array(b->n * b->d, sizeof **poses, e))) return VG_ENOMEM;
    vgi_product_double(b->n, b->d, b->rank, b->x, b->rank, b->vectors, b->d, *poses, b->d);
    return VG_OK;
}

/* Rows y of orthonormal coordinates correspond to rows x of coordinates in the differences: x L = y. */
void vgi_span_coordinates(const vgi_span *s, size_t n, double *x)
{
    size_t m = s->m;
    for (size_t i = 0; i < n; i++) {
        double *row = x + i * m;
        for (size_t j = 0; j < m; j++) row[j] += s->offset[j];
        vgi_solve_lower_transposed(m, s->factor, 1, row);
    }
}

/* ---- another body ---- */

/* The centroid moves as that of the source does, scaled by the bodies' sizes. */
static void move_root(vg_signal *s, const double *from, size_t nfrom, const double *to, size_t nto)
{
    double a[3], b[3], moved[3], before = vg_diagonal(from, nfrom), ratio = before > 0 ? vg_diagonal(to, nto) / before : 1;
    vg_centroid(from, nfrom, a);
    vg_centroid(to, nto, b);
    for (size_t i = 0; i < s->n; i++) {
        double *shift = s->shift + 3 * i, way[3];
        vg_quat_apply(s->turn + 4 * i, a, moved);
        vgi_sum(moved, shift, way), vgi_deduct(way, a), vgi_scale(way, ratio);
        vg_quat_apply(s->turn + 4 * i, b, moved);
        vgi_sum(b, way, shift), vgi_deduct(shift, moved);
    }
}

/* Rotate each pose back as the example that it replaces was, about its centroid, which moves to `home`. */
static void turn_back(const vg_signal *s, const double *reference, double *poses, size_t n, size_t nv)
{
    double home[3], centre[3], moved[3];
    vg_centroid(reference, nv, home);
    for (size_t i = 0; i < n; i++) {
        const double *q = s->home_turn + 4 * i, back[4] = {q[0], -q[1], -q[2], -q[3]};
        double *pose = poses + 3 * nv * i, shift[3];
        vg_centroid(pose, nv, centre);
        vg_quat_apply(back, centre, moved);
        vgi_subtract(home, moved, shift);
        vgi_root_apply(back, shift, nv, pose);
    }
}

int vg_signal_onto(vg_signal *s, const vg_body *from, const vg_body *to, double *poses, size_t n, vg_err *e)
{
    size_t d = 3 * to->mesh.nv;
    int r = VG_EINPUT;
    if (!s->examples) vg_fail(e, r, "the signal's shapes are not sums of examples: fit it with vg-fitsignal "
                                    "--examples");
    else if (n != s->m + 1)
        vg_fail(e, r, "there are %zu poses, but the signal has %zu examples: they must match", n, s->m + 1);
    else r = VG_OK;
    if (r == VG_OK && s->nturns) turn_back(s, to->reference, poses, n, to->mesh.nv);
    double *mean = r == VG_OK ? vgi_copy_array(poses, d, sizeof *mean, e) : NULL;
    if (r == VG_OK && !mean) r = VG_ENOMEM;
    if (r < 0) {
        free(poses);
        return r;
    }
    if (s->rooted) move_root(s, from->reference, from->mesh.nv, to->reference, to->mesh.nv);
    subtract_first(n - 1, d, mean, poses + d);
    memmove(poses, poses + d, (n - 1) * d * sizeof *poses);
    free(s->mean);
    free(s->basis);
    free(s->basis_single);
    free(s->basis_short);
    free(s->basis_unit);
    s->basis_single = NULL, s->basis_short = NULL, s->basis_unit = NULL;
    s->mean = mean, s->basis = poses, s->bits = 64, s->d = d;
    return VG_OK;
}
