/* map_kernel.c: what eight poses add to the sums that a map is fitted from.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/rig/map_kernel.h"
#include "core/wide.h"

/* Halves added to halves: the order is the same for every width. */
VGI_INLINE double across(const vgi_wide *parts)
{
    double x[VGI_LANES];
#pragma GCC unroll 4
    for (size_t p = 0; p < VGI_PARTS; p++) vgi_store(x + p * VGI_WIDTH, parts[p]);
    return (x[0] + x[4]) + (x[2] + x[6]) + ((x[1] + x[5]) + (x[3] + x[7]));
}

/* to += A' d, over all lanes; part p of vector k is d[3 p + k] */
VGI_INLINE void add_back(const double (*a)[VGI_LANES], const vgi_wide *d, double *to)
{
#pragma GCC unroll 3
    for (size_t k = 0; k < 3; k++) {
        vgi_wide sum[VGI_PARTS];
#pragma GCC unroll 4
        for (size_t p = 0; p < VGI_PARTS; p++) {
            size_t at = p * VGI_WIDTH;
            sum[p] = vgi_load(a[k] + at) * d[3 * p] + vgi_load(a[3 + k] + at) * d[3 * p + 1] +
                     vgi_load(a[6 + k] + at) * d[3 * p + 2];
        }
        to[k] += across(sum);
    }
}

static void face(const vgi_map_motion *m, const double *const *poses, const uint32_t *vert, size_t corners,
                 const vgi_lanes *face_turn, double *pull, double *turn)
{
    vgi_wide centre[3 * VGI_PARTS] = {{0}}, d[3 * VGI_PARTS];
    vgi_wide share = vgi_same(1 / (double)corners);
    for (size_t i = 0; i < corners; i++)
        for (size_t p = 0; p < VGI_PARTS; p++) {
            vgi_wide x[3];
            vgi_gather_point(poses + p * VGI_WIDTH, 3 * (size_t)vert[i], x);
            for (size_t k = 0; k < 3; k++) centre[3 * p + k] += x[k] * share;
        }
    for (size_t i = 0; i < corners; i++) {
        for (size_t p = 0; p < VGI_PARTS; p++) {
            vgi_gather_point(poses + p * VGI_WIDTH, 3 * (size_t)vert[i], d + 3 * p);
            for (size_t k = 0; k < 3; k++) d[3 * p + k] -= centre[3 * p + k];
        }
        add_back(m->a, d, pull + 3 * i);
    }
    for (size_t j = 0; j < 3; j++) {
        double column[3] = {0};
        for (size_t p = 0; p < VGI_PARTS; p++)
            for (size_t k = 0; k < 3; k++) d[3 * p + k] = vgi_load(face_turn[3 * k + j] + p * VGI_WIDTH);
        add_back(m->rotation, d, column);
        for (size_t i = 0; i < 3; i++) turn[3 * i + j] += column[i];
    }
}

static void vertex(const vgi_map_motion *m, size_t owner, const uint32_t *near, size_t n, const double *const *poses,
                   size_t v, double *want)
{
    vgi_wide d[3 * VGI_PARTS];
    for (size_t p = 0; p < VGI_PARTS; p++) {
        vgi_gather_point(poses + p * VGI_WIDTH, 3 * v, d + 3 * p);
        for (size_t k = 0; k < 3; k++) d[3 * p + k] -= vgi_load(m[owner].t[k] + p * VGI_WIDTH);
    }
    for (size_t s = 0; s < n; s++) add_back(m[near[s]].a, d, want + 3 * s);
}

const vgi_map_kernel VGI_OF_SET(vgi_map_kernel) = {face, vertex};
