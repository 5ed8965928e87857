/* measures_kernel.c: the inner loop of measuring: how far the faces of two poses are apart.
 * Eight faces of one size stand side by side in the lanes of a vector, so nothing but gathering depends on where
 * their vertices are; a face that does not count is a lane of zeros. Leaves out vertices, and what becomes of the sums
 * (measures.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/measures_kernel.h"

#include <math.h>

#define INLINE static inline __attribute__((always_inline))

/* A face has a normal when its area exceeds this times D times its perimeter: below, it is rounding. */
static const double FLAT = 1e-14;

typedef struct lane_running {
    vgi_lanes n, mean, squares, max;
} lane_running;

/* What eight faces are in one pose. */
typedef struct shape {
    vgi_lanes centroid[3], normal[3], area; /* normal and area are 0 without a normal */
    vgi_mask ok;                            /* have one */
} shape;

INLINE vgi_lanes only(vgi_mask which, vgi_lanes x)
{
    return (vgi_lanes)((vgi_mask)x & which);
}

INLINE vgi_lanes absolute(vgi_lanes x)
{
    return (vgi_lanes)((vgi_mask)x & INT64_MAX);
}

INLINE vgi_lanes at_most(vgi_lanes x, double most)
{
    vgi_mask less = x < most;
    return only(less, x) + only(~less, (vgi_lanes){0} + most);
}

INLINE bool any(vgi_mask m)
{
    int64_t bits = 0;
    for (int i = 0; i < VGI_LANES; i++) bits |= m[i];
    return bits;
}

INLINE vgi_lanes dot(const vgi_lanes a[3], const vgi_lanes b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

INLINE void load(const double *points, const uint32_t *vert, vgi_lanes to[3])
{
    const double *p[VGI_LANES];
    for (int i = 0; i < VGI_LANES; i++) p[i] = points + 3 * (size_t)vert[i];
    for (size_t k = 0; k < 3; k++) to[k] = vgi_gather(p, k);
}

/* ones: 1 where the value counts, else 0; share: 1 / n, the value counted. */
INLINE void lanes_add(lane_running *l, vgi_lanes value, vgi_mask which, vgi_lanes ones, vgi_lanes share)
{
    vgi_lanes d = only(which, value - l->mean);
    l->n += ones;
    l->mean += d * share;
    l->squares += d * only(which, value - l->mean);
    vgi_mask more = which & (value > l->max);
    l->max = only(more, value) + only(~more, l->max);
}

INLINE vgi_lanes next_share(const lane_running *l)
{
    return 1.0 / (l->n + 1.0);
}

static void merge_lanes(vgi_running *r, const lane_running *l)
{
    for (int i = 0; i < VGI_LANES; i++) {
        const vgi_running lane = {l->n[i], l->mean[i], l->squares[i], l->max[i]};
        vgi_running_merge(r, &lane);
    }
}

/* Perimeters; most faces do without. */
INLINE vgi_lanes perimeters(const uint32_t *vert, size_t r, const double *points)
{
    vgi_lanes sum = {0}, a[3], b[3];
    load(points, vert + (r - 1) * VGI_LANES, a);
    for (size_t i = 0; i < r; i++) {
        load(points, vert + i * VGI_LANES, b);
        for (int k = 0; k < 3; k++) a[k] -= b[k];
        sum += vgi_lane_roots(dot(a, a));
        for (int k = 0; k < 3; k++) a[k] = b[k];
    }
    return sum;
}

/* Normals are Newell's: the sum of the cross products of successive corner vectors, here those from the centroid. */
INLINE void shape_of(const uint32_t *vert, size_t r, double diagonal, const double *points, shape *s)
{
    vgi_lanes n[3] = {{0}, {0}, {0}}, edges = {0}, a[3], b[3];
    for (int k = 0; k < 3; k++) s->centroid[k] = (vgi_lanes){0};
    for (size_t i = 0; i < r; i++) {
        load(points, vert + i * VGI_LANES, b);
        for (int k = 0; k < 3; k++) s->centroid[k] += b[k];
    }
    load(points, vert + (r - 1) * VGI_LANES, a);
    for (int k = 0; k < 3; k++) s->centroid[k] *= 1 / (double)r, a[k] -= s->centroid[k];
    for (size_t i = 0; i < r; i++) {
        load(points, vert + i * VGI_LANES, b);
        for (int k = 0; k < 3; k++) b[k] -= s->centroid[k];
        n[0] += a[1] * b[2] - a[2] * b[1];
        n[1] += a[2] * b[0] - a[0] * b[2];
        n[2] += a[0] * b[1] - a[1] * b[0];
        for (int k = 0; k < 3; k++) edges += (b[k] - a[k]) * (b[k] - a[k]), a[k] = b[k];
    }
    vgi_lanes length = vgi_lane_roots(dot(n, n)), half = 0.5 * length;
    double least = FLAT * diagonal;
    /* the perimeter is no longer than the root of r times the squared edges */
    s->ok = half * half > 1.001 * least * least * (double)r * edges;
    if (any(~s->ok)) s->ok |= half > least * perimeters(vert, r, points);
    vgi_lanes scale = only(s->ok, 1.0 / length);
    s->area = only(s->ok, half);
    for (int k = 0; k < 3; k++) s->normal[k] = scale * n[k];
}

/* Mean over the corners of |unit corner vector . normal|; a corner at the centroid has no direction: not counted. */
INLINE vgi_lanes planarity_of(const uint32_t *vert, size_t r, const double *points, const shape *s)
{
    vgi_lanes sum = {0}, n = {0}, w[3];
    for (size_t i = 0; i < r; i++) {
        load(points, vert + i * VGI_LANES, w);
        for (int k = 0; k < 3; k++) w[k] -= s->centroid[k];
        vgi_lanes length = vgi_lane_roots(dot(w, w));
        vgi_mask directed = length > 0;
        sum += only(directed, absolute(dot(w, s->normal)) / length);
        n += only(directed, (vgi_lanes){0} + 1.0);
    }
    return at_most(only(n > 0, sum / n), 1);
}

/* 1 - a.b of two unit vectors, as half the squared distance of their ends: exact near 0, and 0 for equal ones. */
INLINE vgi_lanes normals_apart(const vgi_lanes a[3], const vgi_lanes b[3])
{
    vgi_lanes d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return at_most(0.5 * dot(d, d), 2);
}

INLINE void count_planarity(uint64_t histogram[10], vgi_lanes p, vgi_mask which)
{
    for (int i = 0; i < VGI_LANES; i++) histogram[p[i] < 1 ? (int)(10 * p[i]) : 9] += (uint64_t)(which[i] & 1);
}

/* Called with a constant r for triangles and quads. */
INLINE void measure_faces(const vgi_face_class *c, size_t r, double diagonal, const double *const poses[2],
                          vgi_face_sums *sums)
{
    lane_running orientation = {{0}, {0}, {0}, {0}}, area = orientation, planarity[2] = {orientation, orientation};
    const vgi_lanes one = (vgi_lanes){0} + 1.0, number = {0, 1, 2, 3, 4, 5, 6, 7};
    for (size_t f = 0; f < c->faces; f += VGI_LANES) {
        const uint32_t *vert = c->corners + f * r;
        vgi_mask there = number < (double)(c->faces - f);
        shape s[2];
        for (int i = 0; i < 2; i++) {
            shape_of(vert, r, diagonal, poses[i], &s[i]);
            s[i].ok &= there;
            if (r < 4) continue;
            vgi_lanes p = planarity_of(vert, r, poses[i], &s[i]);
            lanes_add(&planarity[i], p, s[i].ok, only(s[i].ok, one), next_share(&planarity[i]));
            count_planarity(sums->planarity_histogram[i], p, s[i].ok);
        }
        /* a result that collapsed a face has no normal there: N.N~ is 0, and all of its area is wrong */
        vgi_lanes ones = only(s[0].ok, one), share = next_share(&area);
        vgi_lanes change = absolute(1.0 - s[1].area / s[0].area);
        vgi_lanes apart = only(s[1].ok, normals_apart(s[0].normal, s[1].normal)) + only(~s[1].ok, one);
        lanes_add(&orientation, apart, s[0].ok, ones, share);
        lanes_add(&area, change, s[0].ok, ones, share);
    }
    merge_lanes(&sums->orientation, &orientation);
    merge_lanes(&sums->area, &area);
    for (int i = 0; i < 2; i++) merge_lanes(&sums->planarity[i], &planarity[i]);
}

INLINE void measure_class(const vgi_face_class *c, double diagonal, const double *const poses[2], vgi_face_sums *s)
{
    if (c->r == 3) measure_faces(c, 3, diagonal, poses, s);
    else if (c->r == 4) measure_faces(c, 4, diagonal, poses, s);
    else measure_faces(c, c->r, diagonal, poses, s);
}

#if defined(__x86_64__)
__attribute__((target("avx512f,avx512dq,fma"))) static void
measure_avx512(const vgi_face_class *c, double diagonal, const double *const poses[2], vgi_face_sums *s)
{
    measure_class(c, diagonal, poses, s);
}

__attribute__((target("avx2,fma"))) static void
measure_avx2(const vgi_face_class *c, double diagonal, const double *const poses[2], vgi_face_sums *s)
{
    measure_class(c, diagonal, poses, s);
}
#endif

void vgi_measure_faces(const vgi_face_class *c, double diagonal, const double *const poses[2], vgi_face_sums *s)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
        return measure_avx512(c, diagonal, poses, s);
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return measure_avx2(c, diagonal, poses, s);
#endif
    measure_class(c, diagonal, poses, s);
}
