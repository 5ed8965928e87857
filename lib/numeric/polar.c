/* polar.c: the rotation nearest to a matrix: Newton's iteration for the polar decomposition (Higham 1986)
 * where it converges to a rotation, the largest eigenvector of Horn's 4 x 4 matrix (1987) where the matrix is flat,
 * thin or turns things inside out.
 * Leaves out the rotations of faces, eight poses at a time (polar_kernel.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/polar.h"
#include "numeric/vec3.h"
#include "numeric/turn.h"

#include <math.h>
#include <stdlib.h>

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
