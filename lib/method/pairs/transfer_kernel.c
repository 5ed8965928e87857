/* transfer_kernel.c: deformation gradients of polygons, their means, their rotations, and vectors that follow them,
 * in lanes of poses. Drivers are chosen in transfer.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/transfer_kernel.h"
#include "numeric/wide_face.h"
#include "numeric/wide_polar.h"

static const vgi_polar_stop to_rounding = {.scaled = 4, .enough = 1e-16, .alone = true};

VGI_INLINE void load_map(const vgi_map *map, size_t part, vgi_wide *m)
{
#pragma GCC unroll 9
    for (int i = 0; i < 9; i++) m[i] = vgi_load(map->m[i] + part * VGI_WIDTH);
}

VGI_INLINE void store_map(vgi_map *map, size_t part, const vgi_wide *m)
{
#pragma GCC unroll 9
    for (int i = 0; i < 9; i++) vgi_store(map->m[i] + part * VGI_WIDTH, m[i]);
}

/* Returns the lanes in which the face has no normal. */
VGI_INLINE unsigned measure_part(const vgi_source *s, size_t f, size_t part, vgi_map *map)
{
    size_t begin = s->start[f];
    vgi_wide n[3] = {{0}}, spread = {0}, d[9] = {{0}};
    vgi_wide_face(s->poses + part * VGI_WIDTH, s->vert + begin, s->start[f + 1] - begin, s->p + 3 * begin, d, n, &spread);
    vgi_wide n2 = vgi_wide_dot(n, n), share = 1.0 / vgi_roots(vgi_roots(n2));
#pragma GCC unroll 3
    for (int i = 0; i < 3; i++)
#pragma GCC unroll 3
        for (int j = 0; j < 3; j++) d[3 * i + j] += n[i] * share * vgi_same(s->q[3 * f + (size_t)j]);
    store_map(map, part, d);
    return vgi_bits(~(n2 > 1e-24 * spread * spread)) << part * VGI_WIDTH;
}

static void measure_maps(const vgi_source *s, size_t first, size_t last, vgi_map *maps, unsigned char *bad)
{
    for (size_t f = first; f < last; f++) {
        if (s->slow[f]) continue;
        unsigned none = 0;
        for (size_t part = 0; part < VGI_PARTS; part++) none |= measure_part(s, f, part, &maps[f]);
        bad[f] = (unsigned char)none;
    }
}

static void add_but(const vgi_map *map, double w, unsigned bad, vgi_map *sum, vgi_lanes weight)
{
    for (int lane = 0; lane < VGI_LANES; lane++) {
        if (bad >> lane & 1) continue;
        for (int e = 0; e < 9; e++) sum->m[e][lane] += w * map->m[e][lane];
        weight[lane] += w;
    }
}

static void add_maps(const vgi_drivers *d, size_t first, size_t last, vgi_map *sum, vgi_lanes weight)
{
    for (size_t i = first; i < last; i++) {
        const vgi_map *map = &d->maps[d->source[i]];
        unsigned bad = d->bad[d->source[i]];
        if (bad) {
            add_but(map, d->weight[i], bad, sum, weight);
            continue;
        }
        vgi_wide w = vgi_same(d->weight[i]);
        double *to = (double *)sum;
        for (size_t at = 0; at < 9 * VGI_LANES; at += VGI_WIDTH)
            vgi_store(to + at, vgi_load(to + at) + w * vgi_load((const double *)map + at));
        for (size_t at = 0; at < VGI_LANES; at += VGI_WIDTH) vgi_store(weight + at, vgi_load(weight + at) + w);
    }
}

static void finish_mean(vgi_map *sum, const vgi_lanes weight)
{
    for (size_t part = 0; part < VGI_PARTS; part++) {
        vgi_wide m[9], w = vgi_load(weight + part * VGI_WIDTH), share = 1.0 / w;
        vgi_mask some = w > vgi_same(0);
        load_map(sum, part, m);
#pragma GCC unroll 9
        for (int i = 0; i < 9; i++) m[i] = vgi_either(some, m[i] * share, vgi_same(i % 4 == 0));
        store_map(sum, part, m);
    }
}

static void polar(const vgi_map *a, vgi_map *rotation)
{
    for (size_t part = 0; part < VGI_PARTS; part++) {
        vgi_wide m[9], x[9];
        load_map(a, part, m);
        vgi_wide_polar(m, x, to_rounding);
        store_map(rotation, part, x);
    }
}

VGI_INLINE void apply_map(const vgi_wide *a, const double *r, vgi_wide d[3])
{
#pragma GCC unroll 3
    for (int i = 0; i < 3; i++)
        d[i] = a[3 * i] * vgi_same(r[0]) + a[3 * i + 1] * vgi_same(r[1]) + a[3 * i + 2] * vgi_same(r[2]);
}

/* Transform one vector by the map d and its rotation. */
VGI_INLINE void follow_vector(const vgi_wide *d, const vgi_wide *turn, vgi_follow how, const double *v, vgi_wide w[3])
{
    if (how == VGI_FOLLOW_RIGID) return apply_map(turn, v, w);
    apply_map(d, v, w);
    if (how == VGI_FOLLOW_GRADIENT) return;
    double length2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    vgi_wide t[3], stretch = vgi_roots(vgi_wide_dot(w, w) * vgi_same(1 / (length2 > 0 ? length2 : 1)));
    apply_map(turn, v, t);
#pragma GCC unroll 3
    for (int i = 0; i < 3; i++) {
        t[i] *= stretch;
        w[i] = how == VGI_FOLLOW_BLEND ? 0.5 * (t[i] + w[i]) : t[i];
    }
}

static void follow_vectors(const vgi_map *map, vgi_follow how, const double *vectors, size_t r, double *const *out,
                   size_t offset, size_t lanes)
{
    for (size_t part = 0; part * VGI_WIDTH < lanes; part++) {
        vgi_wide d[9], turn[9] = {{0}}, w[3];
        load_map(map, part, d);
        if (how != VGI_FOLLOW_GRADIENT) vgi_wide_polar(d, turn, to_rounding);
        for (size_t c = 0; c < r; c++) {
            follow_vector(d, turn, how, vectors + 3 * c, w);
            vgi_scatter_point(out + part * VGI_WIDTH, vgi_part_lanes(lanes, part), offset + 3 * c, w);
        }
    }
}

const vgi_transfer_kernel VGI_OF_SET(vgi_transfer_kernel) = {measure_maps, add_maps, finish_mean, polar, follow_vectors};
