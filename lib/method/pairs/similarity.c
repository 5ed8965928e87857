/* similarity.c: size, rotation and place of one set of points relative to another one.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/similarity.h"
#include "numeric/polar.h"
#include "numeric/vec3.h"

#include <math.h>

static const double OWN_SIZE = 1.25; /* sizes that differ by less may be those of two people, measured in one unit */
static const double COPY = 1e-3;     /* of their size: both are one shape, in two sizes */

double vgi_similarity_fit(vgi_similarity *s, const double *from, const double *to, const double *weight, size_t n)
{
    double sum = 0, a[3] = {0}, b[3] = {0}, S[9] = {0}, aa = 0, bb = 0, q[4], turned[3], along = 0;
    for (size_t i = 0; i < n; i++) {
        double w = weight ? weight[i] : 1;
        sum += w;
        vgi_add_scaled(a, w, from + 3 * i), vgi_add_scaled(b, w, to + 3 * i);
    }
    if (!(sum > 0)) return -1;
    vgi_divide(a, sum), vgi_divide(b, sum);
    for (size_t i = 0; i < n; i++) {
        double w = weight ? weight[i] : 1, x[3], y[3];
        vgi_subtract(from + 3 * i, a, x), vgi_subtract(to + 3 * i, b, y);
        for (size_t k = 0; k < 3; k++) aa += w * x[k] * x[k], bb += w * y[k] * y[k];
        vgi_add_outer(S, w, y, x);
    }
    if (!(aa > 0) || !(bb > 0)) return -1;
    vgi_best_turn(S, q);
    vg_quat_matrix(q, s->rotation);
    s->scale = sqrt(bb / aa);
    vgi_multiply_vector(s->rotation, a, turned);
    memcpy(s->shift, b, sizeof s->shift), vgi_add_scaled(s->shift, -s->scale, turned);
    for (int k = 0; k < 9; k++) along += S[k] * s->rotation[k];
    return sqrt(fmax(2 - 2 * along / sqrt(aa * bb), 0));
}

void vgi_similarity_apply(const vgi_similarity *s, const double x[3], double y[3])
{
    vgi_multiply_vector(s->rotation, x, y);
    vgi_scale(y, s->scale), vgi_add(y, s->shift);
}

/* Heads of people differ by a tenth, but a lid or a lip moves as far on both (MATH 5): sizes that are near a power of ten
 * are those of a unit, unless the shapes are the same. */
double vgi_motion_size(const double *from, const double *to, const double *weight, size_t n)
{
    vgi_similarity s;
    double miss = vgi_similarity_fit(&s, from, to, weight, n);
    if (miss < 0) return 1;
    double unit = pow(10, round(log10(s.scale)));
    bool people = miss > COPY && s.scale < OWN_SIZE * unit && s.scale * OWN_SIZE > unit;
    return people ? unit : s.scale;
}

double vg_points_turn(const double *from, const double *to, size_t n, double turn[9], double *miss)
{
    vgi_similarity s = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    double left = vgi_similarity_fit(&s, from, to, NULL, n);
    memcpy(turn, s.rotation, sizeof s.rotation);
    *miss = left < 0 ? 1 : left;
    return left < 0 ? 0 : 180 / M_PI * acos(fmax(-1, fmin((turn[0] + turn[4] + turn[8] - 1) / 2, 1)));
}
