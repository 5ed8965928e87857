/* transfer_kernel.c: deformation gradients of polygons, their rotations, and vectors that follow them, in lanes of
 * poses.
 * Leaves out which faces drive which (transfer.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/transfer_kernel.h"
#include "numeric/polar.h"

#include <math.h>

#define INLINE static inline __attribute__((always_inline))
#if defined(__x86_64__)
#define AVX512 __attribute__((target("avx512f,avx512dq,fma")))
#define AVX2 __attribute__((target("avx2,fma")))
#endif

INLINE void measure_map(const vgi_source *s, size_t f, vgi_map *map, unsigned char *bad)
{
    uint32_t begin = s->start[f], end = s->start[f + 1];
    vgi_lanes first[3], before[3], n[3] = {{0}, {0}, {0}}, spread = {0};
    vgi_map d = {{{0}, {0}, {0}, {0}, {0}, {0}, {0}, {0}, {0}}};
    /* p sums to 0 over the face, so any point will do for a centre; the first corner keeps numbers small */
    for (size_t i = 0; i < 3; i++) {
        first[i] = vgi_gather(s->poses, 3 * (size_t)s->vert[begin] + i);
        before[i] = (vgi_lanes){0};
    }
    for (uint32_t c = begin + 1; c < end; c++) {
        vgi_lanes x[3];
        for (int i = 0; i < 3; i++) {
            x[i] = vgi_gather(s->poses, 3 * (size_t)s->vert[c] + (size_t)i) - first[i];
            spread += x[i] * x[i];
            for (int j = 0; j < 3; j++) d.m[3 * i + j] += x[i] * s->p[3 * (size_t)c + (size_t)j];
        }
        n[0] += before[1] * x[2] - before[2] * x[1];
        n[1] += before[2] * x[0] - before[0] * x[2];
        n[2] += before[0] * x[1] - before[1] * x[0];
        for (int i = 0; i < 3; i++) before[i] = x[i];
    }
    vgi_lanes n2 = n[0] * n[0] + n[1] * n[1] + n[2] * n[2], root = vgi_lane_roots(vgi_lane_roots(n2));
    vgi_mask none = ~(n2 > 1e-24 * spread * spread);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) d.m[3 * i + j] += n[i] / root * s->q[3 * f + (size_t)j];
    *map = d;
    *bad = (unsigned char)vgi_lane_bits(none);
}

INLINE void measure_maps(const vgi_source *s, size_t first, size_t last, vgi_map *maps, unsigned char *bad)
{
    for (size_t f = first; f < last; f++)
        if (!s->slow[f]) measure_map(s, f, &maps[f], &bad[f]);
}

/* x := (x / scale + scale x^-T) / 2 */
INLINE vgi_lanes newton_step(vgi_lanes *x)
{
    vgi_lanes c[9], det = vgi_lane_cofactors(x, c); /* c: det x^-T */
    vgi_lanes size = vgi_lane_squares(x), inverse_size = vgi_lane_squares(c), change = {0};
    /* the scale that balances Frobenius norms of x and x^-T */
    vgi_lanes abs_det = {0};
    for (int k = 0; k < VGI_LANES; k++) abs_det[k] = fabs(det[k]);
    vgi_lanes g = vgi_lane_roots(vgi_lane_roots(inverse_size / size) / abs_det), a = 0.5 * g, b = 0.5 / (g * det);
    for (int i = 0; i < 9; i++) {
        vgi_lanes y = a * x[i] + b * c[i];
        change += (y - x[i]) * (y - x[i]);
        x[i] = y;
    }
    return change;
}

/* Lanes in which a is flat, or inside out (what opposite turns leave of one another): no step of Newton's leads from
 * there to a rotation. */
INLINE unsigned unsound(const vgi_lanes *x)
{
    static const double thin = 1e-12; /* determinant of a matrix of norm 1 */
    vgi_lanes c[9], det = vgi_lane_cofactors(x, c), size = vgi_lane_squares(x);
    return vgi_lane_bits(~(det > thin * size * vgi_lane_roots(size)));
}

INLINE void polar(const vgi_map *a, vgi_map *r)
{
    enum { MOST = 20 };
    unsigned bad = unsound(a->m);
    *r = *a;
    for (int k = 0; bad >> k; k++) /* they wait at the identity */
        for (int i = 0; (bad >> k & 1) && i < 9; i++) r->m[i][k] = i % 4 == 0;
    for (int step = 0; step < MOST; step++) {
        vgi_lanes change = newton_step(r->m);
        double most = 0;
        for (int k = 0; k < VGI_LANES; k++) most = change[k] > most ? change[k] : most;
        if (most < 1e-20) break; /* quadratic: the next change would be below rounding */
    }
    for (int k = 0; bad >> k; k++) {
        if (!(bad >> k & 1)) continue;
        double one[9], turn[9];
        for (int i = 0; i < 9; i++) one[i] = a->m[i][k];
        vgi_fit_rotation(one, turn);
        for (int i = 0; i < 9; i++) r->m[i][k] = turn[i];
    }
}

INLINE void apply(const vgi_map *a, const double *r, vgi_lanes d[3])
{
    for (int i = 0; i < 3; i++) d[i] = a->m[3 * i] * r[0] + a->m[3 * i + 1] * r[1] + a->m[3 * i + 2] * r[2];
}

INLINE void follow_face(const vgi_map *d, vgi_follow how, const double *vectors, size_t r, double *const *out,
                        size_t offset, size_t lanes)
{
    vgi_map turn = *d;
    if (how != VGI_FOLLOW_GRADIENT) polar(d, &turn);
    for (size_t c = 0; c < r; c++) {
        const double *v = vectors + 3 * c;
        double length2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        vgi_lanes w[3], t[3];
        if (how == VGI_FOLLOW_RIGID) {
            apply(&turn, v, w);
        } else {
            apply(d, v, w);
            if (how != VGI_FOLLOW_GRADIENT) {
                apply(&turn, v, t);
                vgi_lanes stretch =
                    vgi_lane_roots((w[0] * w[0] + w[1] * w[1] + w[2] * w[2]) / (length2 > 0 ? length2 : 1));
                for (int i = 0; i < 3; i++) {
                    t[i] *= stretch;
                    w[i] = how == VGI_FOLLOW_BLEND ? 0.5 * (t[i] + w[i]) : t[i];
                }
            }
        }
        for (size_t k = 0; k < lanes; k++)
            for (size_t i = 0; i < 3; i++) out[k][offset + 3 * c + i] = w[i][k];
    }
}

#if defined(__x86_64__)
AVX512 static void measure_avx512(const vgi_source *s, size_t first, size_t last, vgi_map *maps, unsigned char *bad)
{
    measure_maps(s, first, last, maps, bad);
}

AVX2 static void measure_avx2(const vgi_source *s, size_t first, size_t last, vgi_map *maps, unsigned char *bad)
{
    measure_maps(s, first, last, maps, bad);
}

AVX512 static void follow_avx512(const vgi_map *d, vgi_follow how, const double *vectors, size_t r,
                                 double *const *out, size_t offset, size_t lanes)
{
    follow_face(d, how, vectors, r, out, offset, lanes);
}

AVX2 static void follow_avx2(const vgi_map *d, vgi_follow how, const double *vectors, size_t r, double *const *out,
                             size_t offset, size_t lanes)
{
    follow_face(d, how, vectors, r, out, offset, lanes);
}

static bool has_avx512(void)
{
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
}

static bool has_avx2(void)
{
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
}
#endif

void vgi_measure_maps(const vgi_source *s, size_t first, size_t last, vgi_map *maps, unsigned char *bad)
{
#if defined(__x86_64__)
    if (has_avx512()) return measure_avx512(s, first, last, maps, bad);
    if (has_avx2()) return measure_avx2(s, first, last, maps, bad);
#endif
    measure_maps(s, first, last, maps, bad);
}

void vgi_polar(const vgi_map *a, vgi_map *rotation)
{
    polar(a, rotation);
}

void vgi_follow_face(const vgi_map *d, vgi_follow how, const double *vectors, size_t r, double *const *out,
                     size_t offset, size_t lanes)
{
#if defined(__x86_64__)
    if (has_avx512()) return follow_avx512(d, how, vectors, r, out, offset, lanes);
    if (has_avx2()) return follow_avx2(d, how, vectors, r, out, offset, lanes);
#endif
    follow_face(d, how, vectors, r, out, offset, lanes);
}
