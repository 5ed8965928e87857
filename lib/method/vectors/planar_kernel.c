/* planar_kernel.c: the steps of conjugate gradients for eight poses at once (see planar.c). All of them are bound by
 * memory, so work on a row is combined while the row is in registers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/planar_kernel.h"
#include "core/wide.h"

/* A row is PIECES vectors; piece i holds part i % VGI_PARTS of the poses. */
enum { PIECES = 3 * VGI_PARTS };

VGI_INLINE vgi_wide row_piece(const vgi_row *a, size_t i)
{
    return vgi_load((const double *)a + i * VGI_WIDTH);
}

VGI_INLINE void put_piece(vgi_row *a, size_t i, vgi_wide x)
{
    vgi_store((double *)a + i * VGI_WIDTH, x);
}

VGI_INLINE vgi_wide dot_part(const vgi_row *a, const vgi_row *b, size_t part)
{
    vgi_wide sum = row_piece(a, part) * row_piece(b, part);
    sum += row_piece(a, VGI_PARTS + part) * row_piece(b, VGI_PARTS + part);
    return sum + row_piece(a, 2 * VGI_PARTS + part) * row_piece(b, 2 * VGI_PARTS + part);
}

/* One face: m.t_c is h_c = m.p_c minus their mean. It adds (m.t_c) m to y_c, because the matrix from v to t is a
 * projector. */
VGI_INLINE void face_part(const uint32_t *row, size_t corners, const vgi_row *m, const vgi_row *p, vgi_row *y,
                          vgi_wide *h, vgi_wide *sum, size_t part)
{
    vgi_wide mean = {0};
    for (size_t c = 0; c < corners; c++) {
        h[c] = dot_part(m, &p[row[c]], part);
        mean += h[c];
    }
    mean *= 1 / (double)corners;
    for (size_t c = 0; c < corners; c++) {
        vgi_wide t = h[c] - mean;
        vgi_row *to = &y[row[c]];
#pragma GCC unroll 3
        for (size_t k = part; k < PIECES; k += VGI_PARTS) put_piece(to, k, row_piece(to, k) + t * row_piece(m, k));
        *sum += t * t;
    }
}

static void planar_product(const vgi_planar_faces *f, const vgi_row *normals, const vgi_row *p, vgi_row *y, vgi_lanes *room,
                    vgi_lanes pPp)
{
    vgi_wide sum[VGI_PARTS] = {{0}}, *h = (vgi_wide *)(void *)room;
    for (size_t i = 0; i < f->n; i++) {
        size_t corners = f->start[i + 1] - f->start[i];
        const uint32_t *row = f->row + f->start[i];
#pragma GCC unroll 4
        for (size_t part = 0; part < VGI_PARTS; part++) {
            vgi_wide four[4];
            if (corners == 4) face_part(row, 4, &normals[i], p, y, four, &sum[part], part); /* in registers */
            else face_part(row, corners, &normals[i], p, y, h, &sum[part], part);
        }
    }
    for (size_t part = 0; part < VGI_PARTS; part++) vgi_store(pPp + part * VGI_WIDTH, sum[part]);
}

VGI_INLINE void load_lanes(const vgi_lanes x, vgi_wide *to)
{
#pragma GCC unroll 4
    for (size_t part = 0; part < VGI_PARTS; part++) to[part] = vgi_load(x + part * VGI_WIDTH);
}

static void turn_direction(size_t n, const vgi_row *z, const vgi_row *r, const vgi_lanes beta, vgi_row *p, vgi_row *s,
                 vgi_lanes ps)
{
    vgi_wide b[VGI_PARTS], sum[VGI_PARTS] = {{0}};
    load_lanes(beta, b);
    for (size_t i = 0; i < n; i++)
#pragma GCC unroll 12
        for (size_t k = 0; k < PIECES; k++) {
            vgi_wide pk = row_piece(&z[i], k) + b[k % VGI_PARTS] * row_piece(&p[i], k);
            vgi_wide sk = row_piece(&r[i], k) + b[k % VGI_PARTS] * row_piece(&s[i], k);
            put_piece(&p[i], k, pk), put_piece(&s[i], k, sk);
            sum[k % VGI_PARTS] += pk * sk;
        }
    for (size_t part = 0; part < VGI_PARTS; part++) vgi_store(ps + part * VGI_WIDTH, sum[part]);
}

static void advance_rows(size_t n, const vgi_lanes alpha, const vgi_lanes gamma, const vgi_row *p, const vgi_row *s,
                    vgi_row *y, vgi_row *x, vgi_row *r, vgi_row *z)
{
    vgi_wide a[VGI_PARTS], g[VGI_PARTS];
    load_lanes(alpha, a);
    load_lanes(gamma, g);
    for (size_t i = 0; i < n; i++)
#pragma GCC unroll 12
        for (size_t k = 0; k < PIECES; k++) {
            size_t part = k % VGI_PARTS;
            vgi_wide left = row_piece(&r[i], k) - (a[part] * row_piece(&s[i], k) + g[part] * row_piece(&y[i], k));
            put_piece(&x[i], k, row_piece(&x[i], k) + a[part] * row_piece(&p[i], k));
            put_piece(&r[i], k, left), put_piece(&z[i], k, left), put_piece(&y[i], k, vgi_same(0));
        }
}

static void dot_rows(size_t n, const vgi_row *a, const vgi_row *b, vgi_lanes ab)
{
    vgi_wide sum[VGI_PARTS] = {{0}};
    for (size_t i = 0; i < n; i++)
#pragma GCC unroll 4
        for (size_t part = 0; part < VGI_PARTS; part++) sum[part] += dot_part(&a[i], &b[i], part);
    for (size_t part = 0; part < VGI_PARTS; part++) vgi_store(ab + part * VGI_WIDTH, sum[part]);
}

static void largest(size_t n, const vgi_row *a, vgi_lanes most)
{
    vgi_wide now[VGI_PARTS] = {{0}};
    for (size_t i = 0; i < n; i++)
#pragma GCC unroll 12
        for (size_t k = 0; k < PIECES; k++) {
            vgi_wide x = vgi_absolute(row_piece(&a[i], k)), *to = &now[k % VGI_PARTS];
            *to = vgi_either(x > *to, x, *to);
        }
    for (size_t part = 0; part < VGI_PARTS; part++) vgi_store(most + part * VGI_WIDTH, now[part]);
}

static void scale_rows(size_t n, const vgi_lanes factor, const vgi_row *a, vgi_row *to)
{
    vgi_wide f[VGI_PARTS];
    load_lanes(factor, f);
    for (size_t i = 0; i < n; i++)
#pragma GCC unroll 12
        for (size_t k = 0; k < PIECES; k++) put_piece(&to[i], k, f[k % VGI_PARTS] * row_piece(&a[i], k));
}

const vgi_planar_kernel VGI_OF_SET(vgi_planar_kernel) = {planar_product, turn_direction, advance_rows, dot_rows, largest, scale_rows};
