/* signal_kernel.c: the inner loops of fitting a signal: pulls between points of a layout, and products of rows. Sums
 * have eight lanes that are merged at the end, so that they do not depend on the vector width.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "signal/signal_kernel.h"
#include "core/wide.h"

#include <math.h>
#include <string.h>

typedef struct eight {
    vgi_wide part[VGI_PARTS];
} eight;

VGI_INLINE double sum_of(const eight *e)
{
    double lane[VGI_LANES];
#pragma GCC unroll 8
    for (int p = 0; p < VGI_PARTS; p++) vgi_store(lane + VGI_WIDTH * p, e->part[p]);
    return ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
}

/* ---- layouts ---- */

VGI_INLINE void pull_one(vgi_pull *p, size_t j)
{
    double u = p->at[0] - p->x[j], v = p->at[1] - p->y[j], d = sqrt(u * u + v * v), w = p->want[j];
    double pull = w / (d > p->least ? d : p->least);
    p->stress += (d - w) * (d - w);
    p->sum[0] += pull * u, p->sum[1] += pull * v;
    p->bx[j] -= pull * u, p->by[j] -= pull * v;
}

static void all_pull(vgi_pull *p)
{
    const vgi_wide x = vgi_same(p->at[0]), y = vgi_same(p->at[1]), least = vgi_same(p->least);
    eight stress = {{{0}}}, sx = {{{0}}}, sy = {{{0}}};
    size_t j = 0;
    for (; j + VGI_LANES <= p->count; j += VGI_LANES)
#pragma GCC unroll 8
        for (size_t k = 0; k < VGI_PARTS; k++) {
            size_t at = j + VGI_WIDTH * k;
            vgi_wide u = x - vgi_load(p->x + at), v = y - vgi_load(p->y + at), d = vgi_roots(u * u + v * v);
            vgi_wide w = vgi_load(p->want + at), over = d - w, pull = w / vgi_either(d > least, d, least);
            u *= pull, v *= pull;
            stress.part[k] += over * over;
            sx.part[k] += u, sy.part[k] += v;
            vgi_store(p->bx + at, vgi_load(p->bx + at) - u);
            vgi_store(p->by + at, vgi_load(p->by + at) - v);
        }
    p->stress = sum_of(&stress), p->sum[0] = sum_of(&sx), p->sum[1] = sum_of(&sy);
    for (; j < p->count; j++) pull_one(p, j);
}

/* ---- products of rows ---- */

/* Products with v of four rows, n apart. */
VGI_INLINE void products_of_four(const double *a, size_t n, const double *v, double t[4])
{
    const vgi_wide zero = vgi_same(0);
    eight s[4];
    size_t i = 0;
#pragma GCC unroll 4
    for (size_t r = 0; r < 4; r++)
#pragma GCC unroll 8
        for (size_t k = 0; k < VGI_PARTS; k++) s[r].part[k] = zero;
    for (; i + VGI_LANES <= n; i += VGI_LANES)
#pragma GCC unroll 8
        for (size_t k = 0; k < VGI_PARTS; k++) {
            vgi_wide x = vgi_load(v + i + VGI_WIDTH * k);
#pragma GCC unroll 4
            for (size_t r = 0; r < 4; r++) s[r].part[k] += vgi_load(a + r * n + i + VGI_WIDTH * k) * x;
        }
    for (size_t r = 0; r < 4; r++) {
        t[r] = sum_of(&s[r]);
        for (size_t rest = i; rest < n; rest++) t[r] += a[r * n + rest] * v[rest];
    }
}

/* sum += the four rows, n apart, times t; the four after them are fetched meanwhile. */
VGI_INLINE void add_four(const double *a, size_t n, const double t[4], double *restrict sum)
{
    size_t i = 0;
    for (; i + VGI_LANES <= n; i += VGI_LANES) {
#pragma GCC unroll 4
        for (size_t r = 4; r < 8; r++) __builtin_prefetch(a + r * n + i);
#pragma GCC unroll 8
        for (size_t k = 0; k < VGI_PARTS; k++) {
            const double *at = a + i + VGI_WIDTH * k;
            vgi_wide s = vgi_load(sum + i + VGI_WIDTH * k);
#pragma GCC unroll 4
            for (size_t r = 0; r < 4; r++) s += vgi_same(t[r]) * vgi_load(at + r * n);
            vgi_store(sum + i + VGI_WIDTH * k, s);
        }
    }
    for (; i < n; i++)
        for (size_t r = 0; r < 4; r++) sum[i] += t[r] * a[r * n + i];
}

static void all_project(const double *q, size_t rows, size_t n, double *v, double *c)
{
    size_t j = 0;
    for (; j + 4 <= rows; j += 4) {
        double t[4], back[4];
        products_of_four(q + j * n, n, v, t);
        for (size_t k = 0; k < 4; k++) c[j + k] += t[k], back[k] = -t[k];
        add_four(q + j * n, n, back, v);
    }
    for (; j < rows; j++) {
        const double *a = q + j * n;
        double t = 0;
        for (size_t i = 0; i < n; i++) t += a[i] * v[i];
        c[j] += t;
        for (size_t i = 0; i < n; i++) v[i] -= t * a[i];
    }
}

/* Rows are read from memory once: the four are still near when they are added. */
static void all_through(size_t n, size_t m, const double *v, const double *a, double *product, double *sum)
{
    size_t c = 0;
    memset(sum, 0, n * sizeof *sum);
    for (; c + 4 <= m; c += 4) {
        products_of_four(a + c * n, n, v, product + c);
        add_four(a + c * n, n, product + c, sum);
    }
    for (; c < m; c++) {
        product[c] = 0;
        for (size_t i = 0; i < n; i++) product[c] += a[c * n + i] * v[i];
        for (size_t i = 0; i < n; i++) sum[i] += product[c] * a[c * n + i];
    }
}

static void all_distances(const double *x, const double *others, size_t count, size_t stride, size_t m, double *square)
{
    for (size_t j = 0; j < count; j++) {
        const double *y = others + j * stride;
        eight sum = {{{0}}};
        size_t c = 0;
        for (; c + VGI_LANES <= m; c += VGI_LANES)
#pragma GCC unroll 8
            for (size_t k = 0; k < VGI_PARTS; k++) {
                vgi_wide d = vgi_load(x + c + VGI_WIDTH * k) - vgi_load(y + c + VGI_WIDTH * k);
                sum.part[k] += d * d;
            }
        square[j] = sum_of(&sum);
        for (; c < m; c++) square[j] += (x[c] - y[c]) * (x[c] - y[c]);
    }
}

const vgi_signal_kernel VGI_OF_SET(vgi_signal_kernel) = {all_pull, all_project, all_through, all_distances};
