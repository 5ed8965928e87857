/* rig_sums.c: the sums over poses to which weights and corners of a rig are fitted, one matrix product per block of
 * poses. skin.c and envelope.c use them.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/rig_sums.h"
#include "numeric/blas.h"

#include <math.h>
#include <stdlib.h>

enum { BLOCK = 32, ROWS = 128, FACES = 32 }; /* poses, vertices and faces per product */

int vgi_rig_sums_make(vgi_rig_sums *s, size_t nv, size_t n, const double *at, const vgi_turns *turns, vg_err *e)
{
    *s = (vgi_rig_sums){.nv = nv, .n = n, .turns = turns};
    if (n > INT32_MAX / 4) return vg_fail(e, VG_EINPUT, "a skeleton of %zu bones is too large", n);
    s->at = vgi_copy_array(at, 3 * n, sizeof *s->at, e);
    s->cross = vgi_array(4 * n, 4 * n * sizeof *s->cross, e);
    s->pull = vgi_array(nv, 4 * n * sizeof *s->pull, e);
    s->square = vgi_array(nv, sizeof *s->square, e);
    s->motions = vgi_array(3 * BLOCK, 4 * n * sizeof *s->motions, e);
    s->turned = vgi_array(3 * BLOCK, 3 * n * sizeof *s->turned, e);
    s->transposed = vgi_array(4 * n, 3 * BLOCK * sizeof *s->transposed, e);
    s->origin = vgi_array(BLOCK, sizeof *s->origin, e);
    bool ok = s->at && s->cross && s->pull && s->square && s->motions && s->turned && s->transposed && s->origin;
    if (ok && turns) {
        s->turn = vgi_array(3 * turns->nf, 3 * n * sizeof *s->turn, e);
        ok = s->turn != NULL;
    }
    if (ok) return VG_OK;
    vgi_rig_sums_clear(s);
    return VG_ENOMEM;
}

void vgi_rig_sums_clear(vgi_rig_sums *s)
{
    free(s->at);
    free(s->cross);
    free(s->pull);
    free(s->square);
    free(s->turn);
    free(s->motions);
    free(s->turned);
    free(s->transposed);
    free(s->origin);
    *s = (vgi_rig_sums){0};
}

void vgi_rig_sums_restart(vgi_rig_sums *s)
{
    s->poses = 0;
}

typedef struct adding {
    vgi_rig_sums *s;
    double kept; /* 0 for the first poses: sums are written, not read; otherwise 1 */
    size_t count;
    const double *const *poses;
} adding;

/* Store the T of all bones in pose k as three rows of `motions`, and their A. */
static void place_motions(vgi_rig_sums *s, size_t k, const double *transforms)
{
    for (size_t j = 0; j < s->n; j++) {
        const double *q = transforms + 7 * j, *x = s->at + 3 * j;
        double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], root = sqrt(square), a[9];
        const double unit[4] = {q[0] / root, q[1] / root, q[2] / root, q[3] / root};
        vg_quat_matrix(unit, a);
        for (size_t c = 0; c < 3; c++) {
            double *row = s->motions + (3 * k + c) * 4 * s->n + 4 * j,
                   *turned = s->turned + (3 * k + c) * 3 * s->n + 3 * j;
            for (size_t i = 0; i < 3; i++) turned[i] = row[i] = square * a[3 * c + i];
            row[3] = row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + q[4 + c] - s->origin[k][c];
        }
    }
}

static void add_vertices(void *context, size_t task)
{
    const adding *a = context;
    vgi_rig_sums *s = a->s;
    size_t first = task * ROWS, rows = s->nv - first < ROWS ? s->nv - first : ROWS, width = 3 * a->count;
    double y[ROWS * 3 * BLOCK];
    for (size_t v = 0; v < rows; v++) {
        double sum = 0;
        for (size_t k = 0; k < a->count; k++)
            for (size_t c = 0; c < 3; c++) {
                double d = a->poses[k][3 * (first + v) + c] - s->origin[k][c];
                y[v * width + 3 * k + c] = d, sum += d * d;
            }
        s->square[first + v] = a->kept * s->square[first + v] + sum;
    }
    vgi_gemm_double(false, false, rows, 4 * s->n, width, y, width, s->motions, 4 * s->n, a->kept, s->pull + first * 4 * s->n,
                    4 * s->n);
}

static void add_faces(void *context, size_t task)
{
    const adding *a = context;
    vgi_rig_sums *s = a->s;
    size_t first = task * FACES, faces = s->turns->nf - first < FACES ? s->turns->nf - first : FACES,
           width = 3 * a->count;
    double f[3 * FACES * 3 * BLOCK];
    for (size_t i = 0; i < faces; i++) {
        for (size_t k = 0; k < a->count; k += VGI_LANES) {
            const double *poses[VGI_LANES];
            vgi_lanes turn[9];
            for (size_t l = 0; l < VGI_LANES; l++) poses[l] = a->poses[k + l < a->count ? k + l : a->count - 1];
            vgi_turns_measure(s->turns, first + i, poses, turn);
            for (size_t l = 0; l < VGI_LANES && k + l < a->count; l++)
                for (size_t c = 0; c < 3; c++)
                    for (size_t q = 0; q < 3; q++) f[(3 * i + q) * width + 3 * (k + l) + c] = turn[3 * c + q][l];
        }
    }
    vgi_gemm_double(false, false, 3 * faces, 3 * s->n, width, f, width, s->turned, 3 * s->n, a->kept,
                    s->turn + 3 * first * 3 * s->n, 3 * s->n);
}

static void add_cross(void *context, size_t task)
{
    const adding *a = context;
    vgi_rig_sums *s = a->s;
    size_t first = task * ROWS, rows = 4 * s->n - first < ROWS ? 4 * s->n - first : ROWS, width = 3 * a->count;
    vgi_gemm_double(false, false, rows, 4 * s->n, width, s->transposed + first * width, width, s->motions, 4 * s->n, a->kept,
                    s->cross + first * 4 * s->n, 4 * s->n);
}

void vgi_rig_sums_add(vgi_rig_sums *s, size_t count, const double *const *poses, const double *const *transforms,
                      int threads)
{
    vgi_blas_alone();
    for (size_t first = 0; first < count; first += BLOCK) {
        adding a = {s, s->poses ? 1 : 0, count - first < BLOCK ? count - first : BLOCK, poses + first};
        for (size_t k = 0; k < a.count; k++) {
            vg_centroid(a.poses[k], s->nv, s->origin[k]);
            place_motions(s, k, transforms[first + k]);
        }
        for (size_t i = 0; i < 4 * s->n; i++)
            for (size_t r = 0; r < 3 * a.count; r++)
                s->transposed[i * 3 * a.count + r] = s->motions[r * 4 * s->n + i];
        vgi_parallel(threads, (s->nv + ROWS - 1) / ROWS, add_vertices, &a);
        vgi_parallel(threads, (4 * s->n + ROWS - 1) / ROWS, add_cross, &a);
        if (s->turns) vgi_parallel(threads, (s->turns->nf + FACES - 1) / FACES, add_faces, &a);
        s->poses += a.count;
    }
    vgi_blas_shared();
}
