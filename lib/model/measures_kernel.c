/* measures_kernel.c: inner loop of the comparison of two poses face by face.
 * Eight faces of one size are side by side in lanes, so that only gathering depends on where their vertices are. A
 * face that does not count is a lane of zeros. Each lane has its own sums, which are merged at the end, so that they
 * do not depend on the vector width. Vertices, and the use of the sums, are in measures.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/measures_kernel.h"
#include "core/wide.h"

/* A face has a normal if its area exceeds this times D times its perimeter; below that, the area is rounding error. */
static const double FLAT = 1e-14;

typedef struct wide_running {
    vgi_wide n, mean, squares, max;
} wide_running;

/* Properties of the faces of one part of eight, in one pose. */
typedef struct shape {
    vgi_wide centroid[3], normal[3], area; /* normal and area are 0 where undefined */
    vgi_mask ok;                           /* whether they are defined */
} shape;

VGI_INLINE vgi_wide at_most(vgi_wide x, double most)
{
    return vgi_either(x < vgi_same(most), x, vgi_same(most));
}

/* vert: the vertices of one corner of the faces */
VGI_INLINE void load_corner(const double *points, const uint32_t *vert, vgi_wide to[3])
{
    const double *p[VGI_WIDTH];
#pragma GCC unroll 8
    for (int i = 0; i < VGI_WIDTH; i++) p[i] = points + 3 * (size_t)vert[i];
    vgi_gather_point(p, 0, to);
}

/* ones: 1 where the value counts, else 0; share: 1 / n, n the number of values including this one. */
VGI_INLINE void add_values(wide_running *l, vgi_wide value, vgi_mask which, vgi_wide ones, vgi_wide share)
{
    vgi_wide d = vgi_only(which, value - l->mean);
    l->n += ones;
    l->mean += d * share;
    l->squares += d * vgi_only(which, value - l->mean);
    l->max = vgi_either(which & (value > l->max), value, l->max);
}

VGI_INLINE vgi_wide next_share(const wide_running *l)
{
    return 1.0 / (l->n + 1.0);
}

static void merge_lanes(vgi_running *r, const wide_running *l)
{
    for (int part = 0; part < VGI_PARTS; part++)
        for (int i = 0; i < VGI_WIDTH; i++) {
            const vgi_running lane = {l[part].n[i], l[part].mean[i], l[part].squares[i], l[part].max[i]};
            vgi_running_merge(r, &lane);
        }
}

/* Perimeters, which most faces do not need. */
VGI_INLINE vgi_wide perimeters(const uint32_t *vert, size_t r, const double *points)
{
    vgi_wide sum = {0}, a[3], b[3];
    load_corner(points, vert + (r - 1) * VGI_LANES, a);
    for (size_t i = 0; i < r; i++) {
        load_corner(points, vert + i * VGI_LANES, b);
        for (int k = 0; k < 3; k++) a[k] -= b[k];
        sum += vgi_roots(vgi_wide_dot(a, a));
        for (int k = 0; k < 3; k++) a[k] = b[k];
    }
    return sum;
}

/* Newell's normals: the sum of the cross products of successive corner vectors, here relative to the centroid. */
VGI_INLINE void shape_of(const uint32_t *vert, size_t r, double diagonal, const double *points, shape *s)
{
    vgi_wide n[3] = {{0}}, edges = {0}, a[3], b[3], sum[3] = {{0}};
    for (size_t i = 0; i < r; i++) {
        load_corner(points, vert + i * VGI_LANES, b);
        for (int k = 0; k < 3; k++) sum[k] += b[k];
    }
    load_corner(points, vert + (r - 1) * VGI_LANES, a);
    for (int k = 0; k < 3; k++) s->centroid[k] = sum[k] * (1 / (double)r), a[k] -= s->centroid[k];
    for (size_t i = 0; i < r; i++) {
        load_corner(points, vert + i * VGI_LANES, b);
        for (int k = 0; k < 3; k++) b[k] -= s->centroid[k];
        n[0] += a[1] * b[2] - a[2] * b[1];
        n[1] += a[2] * b[0] - a[0] * b[2];
        n[2] += a[0] * b[1] - a[1] * b[0];
        for (int k = 0; k < 3; k++) edges += (b[k] - a[k]) * (b[k] - a[k]), a[k] = b[k];
    }
    vgi_wide length = vgi_roots(vgi_wide_dot(n, n)), half = 0.5 * length;
    double least = FLAT * diagonal;
    /* the perimeter is at most the square root of r times the sum of squared edges */
    s->ok = half * half > 1.001 * least * least * (double)r * edges;
    if (vgi_bits(~s->ok)) s->ok |= half > least * perimeters(vert, r, points);
    vgi_wide scale = vgi_only(s->ok, 1.0 / length);
    s->area = vgi_only(s->ok, half);
    for (int k = 0; k < 3; k++) s->normal[k] = scale * n[k];
}

/* Mean over the corners of |unit corner vector . normal|. A corner at the centroid has no direction and does not
 * count. */
VGI_INLINE vgi_wide planarity_of(const uint32_t *vert, size_t r, const double *points, const shape *s)
{
    vgi_wide sum = {0}, n = {0}, w[3];
    for (size_t i = 0; i < r; i++) {
        load_corner(points, vert + i * VGI_LANES, w);
        for (int k = 0; k < 3; k++) w[k] -= s->centroid[k];
        vgi_wide length = vgi_roots(vgi_wide_dot(w, w));
        vgi_mask directed = length > vgi_same(0);
        sum += vgi_only(directed, vgi_absolute(vgi_wide_dot(w, s->normal)) / length);
        n += vgi_only(directed, vgi_same(1));
    }
    return at_most(vgi_only(n > vgi_same(0), sum / n), 1);
}

/* 1 - a.b of two unit vectors, as half the squared distance of their ends: accurate near 0, and 0 for equal
 * vectors. */
VGI_INLINE vgi_wide normals_apart(const vgi_wide a[3], const vgi_wide b[3])
{
    vgi_wide d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return at_most(0.5 * vgi_wide_dot(d, d), 2);
}

VGI_INLINE void count_planarity(uint64_t histogram[10], vgi_wide p, vgi_mask which)
{
    for (int i = 0; i < VGI_WIDTH; i++) histogram[p[i] < 1 ? (int)(10 * p[i]) : 9] += (uint64_t)(which[i] & 1);
}

typedef struct sums {
    wide_running orientation, area, planarity[2];
} sums;

/* The faces of one part; `there`: lanes that hold a face. */
VGI_INLINE void measure_part(const uint32_t *vert, size_t r, vgi_mask there, double diagonal,
                             const double *const poses[2], sums *now, vgi_face_sums *all)
{
    shape s[2];
#pragma GCC unroll 2
    for (int i = 0; i < 2; i++) {
        shape_of(vert, r, diagonal, poses[i], &s[i]);
        s[i].ok &= there;
        if (r < 4) continue;
        vgi_wide p = planarity_of(vert, r, poses[i], &s[i]);
        add_values(&now->planarity[i], p, s[i].ok, vgi_only(s[i].ok, vgi_same(1)), next_share(&now->planarity[i]));
        count_planarity(all->planarity_histogram[i], p, s[i].ok);
    }
    /* if the result has collapsed a face, it has no normal there: N.N~ is 0, and all of its area is wrong */
    vgi_wide ones = vgi_only(s[0].ok, vgi_same(1)), share = next_share(&now->area);
    vgi_wide change = vgi_absolute(1.0 - s[1].area / s[0].area);
    vgi_wide apart = vgi_either(s[1].ok, normals_apart(s[0].normal, s[1].normal), vgi_same(1));
    add_values(&now->orientation, apart, s[0].ok, ones, share);
    add_values(&now->area, change, s[0].ok, ones, share);
}

/* Lane numbers of one part. */
VGI_INLINE vgi_wide lane_numbers(size_t part)
{
    static const double number[VGI_LANES] = {0, 1, 2, 3, 4, 5, 6, 7};
    return vgi_load(number + part * VGI_WIDTH);
}

/* Called with a constant r for triangles and quads. */
VGI_INLINE void measure_faces(const vgi_face_class *c, size_t r, double diagonal, const double *const poses[2],
                              vgi_face_sums *all)
{
    sums now[VGI_PARTS];
    memset(now, 0, sizeof now);
    for (size_t f = 0; f < c->faces; f += VGI_LANES)
        for (size_t part = 0; part < VGI_PARTS && f + part * VGI_WIDTH < c->faces; part++)
            measure_part(c->corners + f * r + part * VGI_WIDTH, r, lane_numbers(part) < vgi_same((double)(c->faces - f)),
                         diagonal, poses, &now[part], all);
    wide_running orientation[VGI_PARTS], area[VGI_PARTS], planarity[2][VGI_PARTS];
    for (size_t part = 0; part < VGI_PARTS; part++) {
        orientation[part] = now[part].orientation, area[part] = now[part].area;
        for (int i = 0; i < 2; i++) planarity[i][part] = now[part].planarity[i];
    }
    merge_lanes(&all->orientation, orientation);
    merge_lanes(&all->area, area);
    for (int i = 0; i < 2; i++) merge_lanes(&all->planarity[i], planarity[i]);
}

static void faces(const vgi_face_class *c, double diagonal, const double *const poses[2], vgi_face_sums *s)
{
    if (c->r == 3) measure_faces(c, 3, diagonal, poses, s);
    else if (c->r == 4) measure_faces(c, 4, diagonal, poses, s);
    else measure_faces(c, c->r, diagonal, poses, s);
}

const vgi_measures_kernel VGI_OF_SET(vgi_measures_kernel) = {faces};
