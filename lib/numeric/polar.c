/* polar.c: the rotation nearest to a matrix: Newton's iteration for the polar decomposition (Higham 1986)
 * where it converges to a rotation, the largest eigenvector of Horn's 4 x 4 matrix (1987) where the matrix is flat,
 * thin or turns things inside out.
 * Leaves out what the matrices are made of, but for the rotations of faces.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/polar.h"
#include "numeric/vec3.h"
#include "numeric/turn.h"

#include <math.h>
#include <stdlib.h>

#define INLINE static inline __attribute__((always_inline))
static const double thin = 1e-3; /* determinant of a matrix of norm 1 below which Newton is not asked */

static double squares(const double x[9])
{
    double s = 0;
    for (int i = 0; i < 9; i++) s += x[i] * x[i];
    return s;
}

static void newton(double x[9])
{
    enum { MOST = 30 };
    double change = 1;
    for (int step = 0; step < MOST && change > 1e-20; step++) {
        double c[9], det = vgi_cofactors(x, c), g = sqrt(sqrt(squares(c) / squares(x)) / det);
        change = 0;
        for (int i = 0; i < 9; i++) {
            double y = 0.5 * (g * x[i] + c[i] / (g * det));
            change += (y - x[i]) * (y - x[i]);
            x[i] = y;
        }
    }
}

/* The largest eigenvector of Horn's matrix: for any m. Of several best rotations the one that turns least. */
static void horn(const double m[9], double r[9])
{
    static const double little = 0.25e-12, unturned[4] = {1, 0, 0, 0};
    double q[4];
    vgi_best_turn_near(m, little, unturned, q);
    vg_quat_matrix(q, r);
}

void vgi_fit_rotation(const double m[9], double r[9])
{
    double size = sqrt(squares(m)), c[9];
    for (int i = 0; i < 9; i++) r[i] = i % 4 == 0;
    if (!(size > 0 && size < INFINITY)) return;
    double x[9];
    for (int i = 0; i < 9; i++) x[i] = m[i] / size;
    if (vgi_cofactors(x, c) > thin) {
        newton(x);
        memcpy(r, x, sizeof x);
    } else {
        horn(x, r);
    }
}

/* ---- faces ---- */

int vgi_turns_make(vgi_turns *t, size_t nf, const uint32_t *start, const uint32_t *vert, const double *reference,
                   vg_err *e)
{
    *t = (vgi_turns){.start = start, .vert = vert, .nf = nf};
    t->vector = vgi_array(3 * (size_t)start[nf], sizeof *t->vector, e);
    t->normal = vgi_array(3 * nf, sizeof *t->normal, e);
    if (!t->vector || !t->normal) return vgi_turns_clear(t), VG_ENOMEM;
    for (size_t f = 0; f < nf; f++) {
        size_t begin = start[f], r = start[f + 1] - begin;
        double centre[3] = {0, 0, 0}, *w = t->vector + 3 * begin, n[3], spread = 0;
        for (size_t i = 0; i < r; i++)
            for (size_t k = 0; k < 3; k++) centre[k] += reference[3 * (size_t)vert[begin + i] + k] / (double)r;
        for (size_t i = 0; i < r; i++)
            for (size_t k = 0; k < 3; k++) {
                w[3 * i + k] = reference[3 * (size_t)vert[begin + i] + k] - centre[k];
                spread += w[3 * i + k] * w[3 * i + k];
            }
        vgi_area_vector(w, r, n);
        double length = vgi_length(n);
        for (size_t k = 0; k < 3; k++)
            t->normal[3 * f + k] = length > 1e-12 * spread ? n[k] / length * (0.5 * spread) : 0;
    }
    return VG_OK;
}

void vgi_turns_clear(vgi_turns *t)
{
    free(t->vector);
    free(t->normal);
    *t = (vgi_turns){0};
}

/* sum of d r' over the corners, and of the unit normals (times the weight that the reference's carries) */
INLINE void face_matrix(const vgi_turns *t, size_t f, const double *const *poses, vgi_lanes *m)
{
    uint32_t begin = t->start[f], end = t->start[f + 1];
    vgi_lanes first[3], before[3], n[3] = {{0}, {0}, {0}}, spread = {0};
    for (size_t i = 0; i < 3; i++) {
        first[i] = vgi_gather(poses, 3 * (size_t)t->vert[begin] + i);
        before[i] = (vgi_lanes){0};
    }
    for (int i = 0; i < 9; i++) m[i] = (vgi_lanes){0};
    for (uint32_t c = begin + 1; c < end; c++) {
        vgi_lanes x[3];
        const double *r = t->vector + 3 * (size_t)c; /* they sum to 0 over the face: any point will do for a centre */
        for (size_t i = 0; i < 3; i++) {
            x[i] = vgi_gather(poses, 3 * (size_t)t->vert[c] + i) - first[i];
            spread += x[i] * x[i];
            for (size_t k = 0; k < 3; k++) m[3 * i + k] += x[i] * r[k];
        }
        n[0] += before[1] * x[2] - before[2] * x[1];
        n[1] += before[2] * x[0] - before[0] * x[2];
        n[2] += before[0] * x[1] - before[1] * x[0];
        for (int i = 0; i < 3; i++) before[i] = x[i];
    }
    vgi_lanes n2 = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    vgi_mask sound = n2 > 1e-24 * spread * spread;
    vgi_lanes length = vgi_lane_roots(n2);
    for (int k = 0; k < VGI_LANES; k++) length[k] = sound[k] ? 1 / length[k] : 0;
    for (size_t i = 0; i < 3; i++)
        for (size_t k = 0; k < 3; k++) m[3 * i + k] += n[i] * length * t->normal[3 * f + k];
}

INLINE void measure(const vgi_turns *t, size_t f, const double *const *poses, vgi_lanes *x)
{
    enum { MOST = 16 };
    vgi_lanes m[9], c[9];
    face_matrix(t, f, poses, m);
    vgi_lanes size2 = vgi_lane_squares(m);
    for (int k = 0; k < VGI_LANES; k++) size2[k] = size2[k] > 0 ? 1 / size2[k] : 0;
    vgi_lanes shrink = vgi_lane_roots(size2) * 1.7320508075688772;
    for (int i = 0; i < 9; i++) x[i] = m[i] * shrink;
    vgi_lanes det = vgi_lane_cofactors(x, c);
    vgi_mask good = det > 5.2 * thin;
    for (int i = 0; i < 9; i++) /* lanes that Newton is not for wait at the identity */
        for (int k = 0; k < VGI_LANES; k++) x[i][k] = good[k] ? x[i][k] : i % 4 == 0;
    for (int step = 0; step < MOST; step++) {
        det = vgi_lane_cofactors(x, c);
        vgi_lanes a = {0}, b, change = {0};
        if (step < 4) {
            vgi_lanes g = vgi_lane_roots(vgi_lane_roots(vgi_lane_squares(c) / vgi_lane_squares(x)) / det);
            a = 0.5 * g, b = 0.5 / (g * det);
        } else {
            a += 0.5, b = 0.5 / det;
        }
        for (int i = 0; i < 9; i++) {
            vgi_lanes y = a * x[i] + b * c[i];
            change += (y - x[i]) * (y - x[i]);
            x[i] = y;
        }
        double most = 0;
        for (int k = 0; k < VGI_LANES; k++) most = change[k] > most ? change[k] : most;
        if (most < 1e-12) break; /* quadratic: what is left is below 1e-11 */
    }
    for (int k = 0; k < VGI_LANES; k++) {
        if (good[k]) continue;
        double one[9], r[9];
        for (int i = 0; i < 9; i++) one[i] = m[i][k];
        vgi_fit_rotation(one, r);
        for (int i = 0; i < 9; i++) x[i][k] = r[i];
    }
}

#if defined(__x86_64__)
__attribute__((target("avx512f,avx512dq,fma"))) static void measure_avx512(const vgi_turns *t, size_t f,
                                                                           const double *const *poses, vgi_lanes *x)
{
    measure(t, f, poses, x);
}

__attribute__((target("avx2,fma"))) static void measure_avx2(const vgi_turns *t, size_t f, const double *const *poses,
                                                             vgi_lanes *x)
{
    measure(t, f, poses, x);
}
#endif

void vgi_turns_measure(const vgi_turns *t, size_t f, const double *const *poses, vgi_lanes rotation[9])
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
        return measure_avx512(t, f, poses, rotation);
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return measure_avx2(t, f, poses, rotation);
#endif
    measure(t, f, poses, rotation);
}
