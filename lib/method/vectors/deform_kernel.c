/* deform_kernel.c: inner loop of deformation transfer.
 *
 * F = [u b n] is the frame of a corner in the deformed pose; k are the coordinates of the target's reference vector
 * in the frame of the source's reference corner, divided by |r|. The wanted vector a J r_t = (|d|/|r|) F_d F_r' r_t
 * is |d| (k_u u + k_b b + k_n n): one normalisation, one cross product and three multiply-adds per corner. Each lane
 * of a vector holds one pose, so nothing is shuffled. Degenerate corners are only detected here; deform.c handles
 * them.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/deform_kernel.h"
#include "numeric/wide_polar.h"

/* a face has no normal if |n| <= 1e-12 sum |d|^2; a corner has no frame if its vector is parallel to the face normal
 * to 1e-12 */
static const double flat2 = 1e-24;

static const vgi_polar_stop to_rounding = {.scaled = 4, .enough = 1e-16, .alone = true};

typedef struct vec {
    vgi_wide at[3];
} vec;

VGI_INLINE vgi_wide dot(vec a, vec b)
{
    return vgi_wide_dot(a.at, b.at);
}

VGI_INLINE vec cross(vec a, vec b)
{
    return (vec){{a.at[1] * b.at[2] - a.at[2] * b.at[1], a.at[2] * b.at[0] - a.at[0] * b.at[2],
                  a.at[0] * b.at[1] - a.at[1] * b.at[0]}};
}

VGI_INLINE vec times(vec a, vgi_wide s)
{
    return (vec){{a.at[0] * s, a.at[1] * s, a.at[2] * s}};
}

VGI_INLINE vec add(vec a, vec b)
{
    return (vec){{a.at[0] + b.at[0], a.at[1] + b.at[1], a.at[2] + b.at[2]}};
}

VGI_INLINE vec load_vec(const double *const *p, size_t i)
{
    vec v;
    vgi_gather_point(p, 3 * i, v.at);
    return v;
}

/* vectors of the face into w[0 .. r-1], and w[r] = w[0] */
VGI_INLINE void load_face(const vgi_transfer *t, const double *const *poses, uint32_t begin, size_t r, vec *w)
{
    if (t->vertices) {
        vec centre = {{{0}}};
        for (size_t i = 0; i < r; i++) {
            w[i] = load_vec(poses, t->vert[begin + i]);
            centre = add(centre, w[i]);
        }
        vec back = times(centre, vgi_same(-1.0 / (double)r));
        for (size_t i = 0; i < r; i++) w[i] = add(w[i], back);
    } else {
        for (size_t i = 0; i < r; i++) w[i] = load_vec(poses, begin + i);
    }
    w[r] = w[0];
}

/* Wanted vectors from the frames of the corners, in place in w. Returns the lanes in which a corner has no frame. */
VGI_INLINE vgi_mask by_pose(const vgi_transfer *t, uint32_t begin, size_t r, vec n, vec *w)
{
    vgi_mask bad = {0};
    for (size_t i = 0; i < r; i++) {
        const double *k = t->coordinates + 3 * (size_t)(begin + i);
        vgi_wide d2 = dot(w[i], w[i]), along = dot(n, w[i]), inverse = 1.0 / d2;
        /* m = n - (n.u) u; |m|^2 = 1 - (n.u)^2 */
        vec m = add(n, times(w[i], -along * inverse));
        vgi_wide m2 = dot(m, m);
        bad |= ~(d2 > vgi_same(t->shortest2)) | ~(m2 > vgi_same(flat2));
        m = times(m, vgi_roots(d2 / m2));                         /* |d| times the unit normal of the corner */
        vec b = times(cross(m, w[i]), vgi_roots(inverse));         /* n x u, times |d| */
        w[i] = add(times(w[i], vgi_same(k[0])), add(times(b, vgi_same(k[1])), times(m, vgi_same(k[2]))));
    }
    return bad;
}

/* Columns of sum d_k p_k'. */
VGI_INLINE void sum_products(const vgi_transfer *t, uint32_t begin, size_t r, const vec *w, vec y[3])
{
    for (size_t i = 0; i < r; i++)
#pragma GCC unroll 3
        for (int k = 0; k < 3; k++) y[k] = add(y[k], times(w[i], vgi_same(t->gradient[begin + i].p[k])));
}

/* Wanted vectors from the deformation gradient of the face, from w into g. */
VGI_INLINE void by_gradient(const vgi_transfer *t, size_t f, uint32_t begin, size_t r, vec n, const vec *w, vec *g)
{
    vec y[3] = {{{{0}}}};
    sum_products(t, begin, r, w, y);
    const vgi_gradient_face *face = &t->gradient_face[f];
    for (size_t i = 0; i < r; i++) {
        const double *b = t->gradient[begin + i].b;
        g[i] = times(n, vgi_same(face->q[0] * b[0] + face->q[1] * b[1] + face->q[2] * b[2]));
#pragma GCC unroll 3
        for (int k = 0; k < 3; k++) g[i] = add(g[i], times(y[k], vgi_same(b[k])));
        g[i] = add(g[i], times(w[i], vgi_same(face->rho)));
    }
}

/* Whether all vectors of the face are perpendicular to its normal: those of three vertices are. Vectors that come as such
 * need not fit together. */
VGI_INLINE bool is_flat(const vgi_transfer *t, size_t r)
{
    return r == 3 && t->vertices;
}

/* The rotation of such a triangle without iteration: y maps plane to plane, q the normal of one and n of the other, and for a
 * map of planes A the sum of A and its cofactors is a multiple of the rotation of its polar decomposition. */
VGI_INLINE void turn_triangle(const double q[3], vec n, const vec y[3], vgi_wide *turn)
{
    vec p[3], z[3];
    vgi_wide square = {0};
#pragma GCC unroll 3
    for (int k = 0; k < 3; k++) {
        int next = (k + 1) % 3, last = (k + 2) % 3;
        z[k] = add(times(y[next], vgi_same(q[last])), times(y[last], vgi_same(-q[next])));
        p[k] = add(y[k], cross(z[k], n));
        square += dot(p[k], p[k]);
    }
    square = vgi_roots(2.0 / square);
#pragma GCC unroll 3
    for (int i = 0; i < 3; i++)
#pragma GCC unroll 3
        for (int k = 0; k < 3; k++) turn[3 * i + k] = p[k].at[i] * square + n.at[i] * vgi_same(q[k]);
}

/* The rotation of the face: that of its deformation gradient. */
VGI_INLINE void turn_face(const vgi_transfer *t, size_t f, uint32_t begin, size_t r, vec n, const vec *w, vgi_wide *turn)
{
    vec y[3] = {{{{0}}}};
    vgi_wide m[9];
    sum_products(t, begin, r, w, y);
    const double *q = t->gradient_face[f].q;
    if (is_flat(t, r)) {
        turn_triangle(q, n, y, turn);
        return;
    }
#pragma GCC unroll 3
    for (int i = 0; i < 3; i++)
#pragma GCC unroll 3
        for (int k = 0; k < 3; k++) m[3 * i + k] = y[k].at[i] + n.at[i] * vgi_same(q[k]);
    vgi_wide_polar(m, turn, to_rounding);
}

/* The source's vectors, and what the target's differ by, turned by the mean of the rotations of face and corner; in
 * place in w. Returns the lanes in which a corner has no frame. */
VGI_INLINE vgi_mask by_offset(const vgi_transfer *t, size_t f, uint32_t begin, size_t r, vec n, vec *w)
{
    vgi_mask bad = {0};
    vgi_wide turn[9], scale = vgi_same(t->gradient_face[f].rho);
    turn_face(t, f, begin, r, n, w, turn);
    for (size_t i = 0; i < r; i++) {
        const double *k = t->coordinates + 3 * (size_t)(begin + i), *b = t->gradient[begin + i].b;
        vgi_wide d2 = dot(w[i], w[i]);
        vec u = times(w[i], vgi_roots(1.0 / d2)), m = n;
        bad |= ~(d2 > vgi_same(t->shortest2));
        if (!is_flat(t, r)) {
            m = add(n, times(u, -dot(n, u)));
            vgi_wide m2 = dot(m, m);
            bad |= ~(m2 > vgi_same(flat2));
            m = times(m, vgi_roots(1.0 / m2));
        }
        vec side = cross(m, u);
        w[i] = times(w[i], scale);
#pragma GCC unroll 3
        for (int a = 0; a < 3; a++)
            w[i].at[a] += 0.5 * (turn[3 * a] * vgi_same(b[0]) + turn[3 * a + 1] * vgi_same(b[1]) + turn[3 * a + 2] * vgi_same(b[2]) +
                                 u.at[a] * vgi_same(k[0]) + side.at[a] * vgi_same(k[1]) + m.at[a] * vgi_same(k[2]));
    }
    return bad;
}

/* Face f with r corners in the poses of one part. Returns the lanes with a degenerate corner. */
VGI_INLINE unsigned transfer_part(const vgi_transfer *t, size_t f, size_t r, size_t part, vec *w, vec *g,
                                  vgi_method method)
{
    uint32_t begin = t->start[f];
    size_t first = part * VGI_WIDTH;
    load_face(t, t->poses + first, begin, r, w);

    vec n = {{{0}}};
    vgi_wide spread = {0};
    for (size_t i = 0; i < r; i++) {
        n = add(n, cross(w[i], w[i + 1]));
        spread += dot(w[i], w[i]);
    }
    vgi_wide n2 = dot(n, n);
    vgi_mask bad = ~(n2 > flat2 * spread * spread);
    n = times(n, 1.0 / vgi_roots(n2));

    if (method == VGI_OFFSET) bad |= by_offset(t, f, begin, r, n, w);
    if (method == VGI_GRADIENT || method == VGI_BLEND) by_gradient(t, f, begin, r, n, w, g);
    if (method == VGI_POSE || method == VGI_BLEND) bad |= by_pose(t, begin, r, n, w);
    const vec *wanted = method == VGI_GRADIENT ? g : w;
    if (method == VGI_BLEND)
        for (size_t i = 0; i < r; i++) w[i] = times(add(w[i], g[i]), vgi_same(0.5));

    size_t lanes = vgi_part_lanes(t->lanes, part);
    for (size_t i = 0; i < r; i++) vgi_scatter_point(t->out + first, lanes, 3 * (begin + i), wanted[i].at);
    return (vgi_bits(bad) & ((1u << lanes) - 1)) << first;
}

/* With constant sizes the compiler unrolls this for triangles and quads. */
VGI_INLINE void transfer_face(const vgi_transfer *t, size_t f, size_t r, vec *w, vec *g, vgi_method method)
{
    unsigned bad = 0;
    for (size_t part = 0; part * VGI_WIDTH < t->lanes; part++) bad |= transfer_part(t, f, r, part, w, g, method);
    if (bad) t->bad(t->context, f, bad);
}

VGI_INLINE void transfer_by(const vgi_transfer *t, size_t first, size_t last, vec *w, size_t max_corners,
                            vgi_method method)
{
    vec a[5], b[5], *g = w + max_corners + 1;
    for (size_t f = first; f < last; f++) {
        size_t r = t->start[f + 1] - t->start[f];
        if (t->skip[f]) continue;
        if (r == 3) transfer_face(t, f, 3, a, b, method);
        else if (r == 4) transfer_face(t, f, 4, a, b, method);
        else transfer_face(t, f, r, w, g, method);
    }
}

static void transfer(const vgi_transfer *t, size_t first, size_t last, vgi_lane_point *room, size_t max_corners)
{
    vec *w = (vec *)(void *)room;
    switch (t->method) { /* switch here, so that each loop is compiled for its method */
    case VGI_POSE: return transfer_by(t, first, last, w, max_corners, VGI_POSE);
    case VGI_GRADIENT: return transfer_by(t, first, last, w, max_corners, VGI_GRADIENT);
    case VGI_BLEND: return transfer_by(t, first, last, w, max_corners, VGI_BLEND);
    case VGI_OFFSET: return transfer_by(t, first, last, w, max_corners, VGI_OFFSET);
    }
}

const vgi_deform_kernel VGI_OF_SET(vgi_deform_kernel) = {transfer};
