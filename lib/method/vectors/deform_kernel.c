/* deform_kernel.c: the inner loop of deformation transfer.
 *
 * With the frame F = [u b n] of a corner in the deformed pose and the coordinates k of the target's reference vector
 * in the frame of the source's reference corner, the wanted vector a J r_t = (|d|/|r|) F_d F_r' r_t is |d| (k_u u +
 * k_b b + k_n n), k already divided by |r|: one normalisation, one cross product and three multiply-adds a corner.
 * Poses stand side by side in the lanes of a vector, so nothing has to be shuffled. Leaves out degenerate corners: it
 * only finds them (deform.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/deform_kernel.h"

#include <math.h>

#define INLINE static inline __attribute__((always_inline))

/* the face has no normal when |n| <= 1e-12 sum |d|^2, a corner no frame when it stands on its face's normal to
 * 1e-12 */
static const double flat2 = 1e-24;

INLINE vgi_lanes dot(vgi_vec a, vgi_vec b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

INLINE vgi_vec cross(vgi_vec a, vgi_vec b)
{
    return (vgi_vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

INLINE vgi_vec times(vgi_vec a, vgi_lanes s)
{
    return (vgi_vec){a.x * s, a.y * s, a.z * s};
}

INLINE vgi_vec add(vgi_vec a, vgi_vec b)
{
    return (vgi_vec){a.x + b.x, a.y + b.y, a.z + b.z};
}

INLINE vgi_vec load(const double *const *p, size_t i)
{
    return (vgi_vec){vgi_gather(p, 3 * i), vgi_gather(p, 3 * i + 1), vgi_gather(p, 3 * i + 2)};
}

/* vectors of the face into w[0 .. r-1], and w[r] = w[0] */
INLINE void load_face(const vgi_transfer *t, uint32_t begin, size_t r, vgi_vec *w)
{
    if (t->vertices) {
        vgi_vec centre = {{0}, {0}, {0}};
        for (size_t i = 0; i < r; i++) {
            w[i] = load(t->poses, t->vert[begin + i]);
            centre = add(centre, w[i]);
        }
        vgi_vec back = times(centre, (vgi_lanes){0} - 1.0 / (double)r);
        for (size_t i = 0; i < r; i++) w[i] = add(w[i], back);
    } else {
        for (size_t i = 0; i < r; i++) w[i] = load(t->poses, begin + i);
    }
    w[r] = w[0];
}

INLINE vgi_lanes same(double x)
{
    return (vgi_lanes){0} + x;
}

/* Wanted vectors by the corners' frames, w in place; returns which lanes have a corner without a frame. */
INLINE vgi_mask by_pose(const vgi_transfer *t, uint32_t begin, size_t r, vgi_vec n, vgi_vec *w)
{
    vgi_mask bad = {0};
    for (size_t i = 0; i < r; i++) {
        const double *k = t->coordinates + 3 * (size_t)(begin + i);
        vgi_lanes d2 = dot(w[i], w[i]), length = vgi_lane_roots(d2), along = dot(n, w[i]);
        /* m = n - (n.u) u; |m|^2 = 1 - (n.u)^2 */
        vgi_vec m = add(n, times(w[i], -along / d2));
        vgi_lanes m2 = dot(m, m);
        bad |= ~(d2 > t->shortest2) | ~(m2 > flat2);
        m = times(m, length / vgi_lane_roots(m2));            /* |d| times the unit normal of the corner */
        vgi_vec b = times(cross(m, w[i]), 1.0 / length); /* n x u, times |d| */
        w[i] = add(times(w[i], same(k[0])), add(times(b, same(k[1])), times(m, same(k[2]))));
    }
    return bad;
}

/* Wanted vectors by the face's deformation gradient, out of w into g. */
INLINE void by_gradient(const vgi_transfer *t, size_t f, uint32_t begin, size_t r, vgi_vec n, const vgi_vec *w,
                        vgi_vec *g)
{
    vgi_vec y[3] = {{{0}, {0}, {0}}, {{0}, {0}, {0}}, {{0}, {0}, {0}}}; /* columns of sum d_k p_k' */
    for (size_t i = 0; i < r; i++)
        for (int k = 0; k < 3; k++) y[k] = add(y[k], times(w[i], same(t->gradient[begin + i].p[k])));
    const vgi_gradient_face *face = &t->gradient_face[f];
    for (size_t i = 0; i < r; i++) {
        const double *b = t->gradient[begin + i].b;
        g[i] = times(n, same(face->q[0] * b[0] + face->q[1] * b[1] + face->q[2] * b[2]));
        for (int k = 0; k < 3; k++) g[i] = add(g[i], times(y[k], same(b[k])));
        g[i] = add(g[i], times(w[i], same(face->rho)));
    }
}

INLINE void transfer_face(const vgi_transfer *t, size_t f, vgi_vec *w, vgi_vec *g, vgi_method method)
{
    uint32_t begin = t->start[f];
    size_t r = t->start[f + 1] - begin;
    load_face(t, begin, r, w);

    vgi_vec n = {{0}, {0}, {0}};
    vgi_lanes spread = {0};
    for (size_t i = 0; i < r; i++) {
        n = add(n, cross(w[i], w[i + 1]));
        spread += dot(w[i], w[i]);
    }
    vgi_lanes n2 = dot(n, n);
    vgi_mask bad = ~(n2 > flat2 * spread * spread);
    n = times(n, 1.0 / vgi_lane_roots(n2));

    if (method != VGI_POSE) by_gradient(t, f, begin, r, n, w, g);
    if (method != VGI_GRADIENT) bad |= by_pose(t, begin, r, n, w);
    const vgi_vec *wanted = method == VGI_GRADIENT ? g : w;
    if (method == VGI_BLEND)
        for (size_t i = 0; i < r; i++) w[i] = times(add(w[i], g[i]), same(0.5));

    for (size_t k = 0; k < t->lanes; k++) {
        double *to = t->out[k] + 3 * (size_t)begin;
        for (size_t i = 0; i < r; i++)
            to[3 * i] = wanted[i].x[k], to[3 * i + 1] = wanted[i].y[k], to[3 * i + 2] = wanted[i].z[k];
    }
    unsigned which = vgi_lane_bits(bad) & (0xffu >> (VGI_LANES - t->lanes));
    if (which) t->bad(t->context, f, which);
}

INLINE void transfer_faces(const vgi_transfer *t, size_t first, size_t last, vgi_vec *w, vgi_vec *g)
{
    switch (t->method) { /* once, so that each loop is compiled for its method */
    case VGI_POSE:
        for (size_t f = first; f < last; f++)
            if (!t->skip[f]) transfer_face(t, f, w, g, VGI_POSE);
        break;
    case VGI_GRADIENT:
        for (size_t f = first; f < last; f++)
            if (!t->skip[f]) transfer_face(t, f, w, g, VGI_GRADIENT);
        break;
    case VGI_BLEND:
        for (size_t f = first; f < last; f++)
            if (!t->skip[f]) transfer_face(t, f, w, g, VGI_BLEND);
        break;
    }
}

#if defined(__x86_64__)
__attribute__((target("avx512f,avx512dq,fma"))) static void transfer_avx512(const vgi_transfer *t, size_t first,
                                                                            size_t last, vgi_vec *w, vgi_vec *g)
{
    transfer_faces(t, first, last, w, g);
}

__attribute__((target("avx2,fma"))) static void transfer_avx2(const vgi_transfer *t, size_t first, size_t last,
                                                              vgi_vec *w, vgi_vec *g)
{
    transfer_faces(t, first, last, w, g);
}
#endif

void vgi_transfer_faces(const vgi_transfer *t, size_t first, size_t last, vgi_vec *w, size_t max_corners)
{
    vgi_vec *g = w + max_corners + 1;
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
        return transfer_avx512(t, first, last, w, g);
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return transfer_avx2(t, first, last, w, g);
#endif
    transfer_faces(t, first, last, w, g);
}
