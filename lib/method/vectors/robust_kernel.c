/* robust_kernel.c: energy and gradient of the absolute misfit for eight poses at once, and the vector sums that the
 * search (robust.c) needs. All of it is bound by memory: misfits are binary32, which is sufficient for the residuals
 * of nearly consistent vectors, and work on a row is combined while the row is in registers.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/robust_kernel.h"

#include "core/wide.h"

/* One misfit per lane of a vector. */
typedef float narrow __attribute__((vector_size(4 * VGI_WIDTH), may_alias));

/* Three numbers per lane of a vector. */
typedef struct point {
    vgi_wide at[3];
} point;

VGI_INLINE vgi_wide row_piece(const vgi_row *x, int k, size_t part)
{
    return vgi_load(x->xyz[k] + part * VGI_WIDTH);
}

VGI_INLINE void put_piece(vgi_row *x, int k, size_t part, vgi_wide value)
{
    vgi_store(x->xyz[k] + part * VGI_WIDTH, value);
}

VGI_INLINE point load_point(const vgi_row *x, size_t part)
{
    return (point){{row_piece(x, 0, part), row_piece(x, 1, part), row_piece(x, 2, part)}};
}

VGI_INLINE point load_misfit(const float *m, size_t part)
{
    const narrow *at = (const narrow *)m + part;
    return (point){{__builtin_convertvector(at[0], vgi_wide), __builtin_convertvector(at[VGI_PARTS], vgi_wide),
                    __builtin_convertvector(at[2 * VGI_PARTS], vgi_wide)}};
}

VGI_INLINE void add_to(vgi_row *x, size_t part, vgi_wide w, const point *a)
{
#pragma GCC unroll 3
    for (int k = 0; k < 3; k++) put_piece(x, k, part, row_piece(x, k, part) + w * a->at[k]);
}

/* q = M e, M the metric of r - 1 corners. */
VGI_INLINE void weigh_misfits(const double *metric, size_t n, const point *e, point *q)
{
    for (size_t i = 0; i < n; i++) q[i] = (point){{{0}}};
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < i; j++) {
            double m = *metric++;
#pragma GCC unroll 3
            for (int k = 0; k < 3; k++) q[i].at[k] += m * e[j].at[k], q[j].at[k] += m * e[i].at[k];
        }
        double m = *metric++;
#pragma GCC unroll 3
        for (int k = 0; k < 3; k++) q[i].at[k] += m * e[i].at[k];
    }
}

/* The same for a star: weight (I - 11'/r), e of the first corner being 0. */
VGI_INLINE void weigh_star(double weight, size_t n, const point *e, point *q)
{
    point mean = {{{0}}};
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) mean.at[k] += e[i].at[k];
    for (int k = 0; k < 3; k++) mean.at[k] /= (double)(n + 1);
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) q[i].at[k] = weight * (e[i].at[k] - mean.at[k]);
}

typedef struct face_job {
    const vgi_robust_faces *f;
    const float *misfit;
    const vgi_row *u;
    const double *soft2; /* NULL: compute the energy alone */
    vgi_row *g;
} face_job;

/* Face f with n + 1 corners for one part of the lanes. e, q: workspace of n points. */
VGI_INLINE void face(const face_job *j, size_t f, size_t n, size_t i, point *e, point *q, vgi_wide *energy, vgi_wide *weight)
{
    const uint32_t *row = j->f->row + j->f->start[f];
    const float *misfit = j->misfit + 3 * VGI_LANES * (j->f->start[f] - f);
    const double *metric = j->f->metric + j->f->entry[f];
    point first = load_point(&j->u[row[0]], i), sum = {{{0}}};
    for (size_t c = 0; c < n; c++) {
        point to = load_point(&j->u[row[c + 1]], i);
        e[c] = load_misfit(misfit + 3 * VGI_LANES * c, i);
#pragma GCC unroll 3
        for (int k = 0; k < 3; k++) e[c].at[k] += to.at[k] - first.at[k];
    }
    if (j->f->star[f]) weigh_star(*metric, n, e, q);
    else weigh_misfits(metric, n, e, q);
    vgi_wide square = vgi_same(0);
    for (size_t c = 0; c < n; c++) square += vgi_wide_dot(e[c].at, q[c].at);
    if (!j->soft2) {
        *energy += vgi_roots(vgi_either(square > 0, square, vgi_same(0)));
        return;
    }
    vgi_wide absolute = vgi_roots(square + vgi_load(j->soft2 + i * VGI_WIDTH)), w = 1 / absolute;
    *energy += absolute;
    *weight += w;
    for (size_t c = 0; c < n; c++) {
#pragma GCC unroll 3
        for (int k = 0; k < 3; k++) sum.at[k] += q[c].at[k];
        add_to(&j->g[row[c + 1]], i, w, &q[c]);
    }
    add_to(&j->g[row[0]], i, -w, &sum);
}

static void energy(const vgi_robust_faces *f, const float *misfit, const vgi_row *u, const double *soft2, vgi_row *g,
                   vgi_row *room, vgi_robust_sums *sums)
{
    const face_job j = {f, misfit, u, soft2, g};
    vgi_wide energy[VGI_PARTS] = {{0}}, weight[VGI_PARTS] = {{0}};
    point *e = (point *)(void *)room, e3[3], q3[3];
    for (size_t i = 0; i < f->n; i++) {
        size_t n = f->start[i + 1] - f->start[i] - 1;
        for (size_t part = 0; part < VGI_PARTS; part++) {
            if (n == 3) face(&j, i, 3, part, e3, q3, &energy[part], &weight[part]);
            else if (n == 2) face(&j, i, 2, part, e3, q3, &energy[part], &weight[part]);
            else face(&j, i, n, part, e, e + n, &energy[part], &weight[part]);
        }
    }
    for (size_t part = 0; part < VGI_PARTS; part++) {
        vgi_store(sums->energy + part * VGI_WIDTH, energy[part]);
        vgi_store(sums->weight + part * VGI_WIDTH, weight[part]);
    }
}

static void direction_products(size_t n, const vgi_row *g, const vgi_row *gn, const vgi_row *z, const vgi_row *zn,
                     const vgi_row *d, vgi_robust_products *p)
{
    for (size_t part = 0; part < VGI_PARTS; part++) {
        vgi_wide dy = vgi_same(0), yv = dy, dg = dy, yz = dy, gz = dy;
        for (size_t r = 0; r < n; r++)
#pragma GCC unroll 3
            for (int k = 0; k < 3; k++) {
                vgi_wide gnow = row_piece(&gn[r], k, part), znow = row_piece(&zn[r], k, part), way = row_piece(&d[r], k, part);
                vgi_wide y = gnow - row_piece(&g[r], k, part), v = znow - row_piece(&z[r], k, part);
                dy += way * y, yv += y * v, dg += way * gnow, yz += y * znow, gz += gnow * znow;
            }
        vgi_store(p->dy + part * VGI_WIDTH, dy), vgi_store(p->yv + part * VGI_WIDTH, yv);
        vgi_store(p->dg + part * VGI_WIDTH, dg), vgi_store(p->yz + part * VGI_WIDTH, yz);
        vgi_store(p->gz + part * VGI_WIDTH, gz);
    }
}

static void turn_direction(size_t n, const vgi_lanes *abc, const vgi_row *z, const vgi_row *zn, vgi_row *d)
{
    for (size_t r = 0; r < n; r++)
#pragma GCC unroll 4
        for (size_t part = 0; part < VGI_PARTS; part++) {
            vgi_wide a = vgi_load(abc[0] + part * VGI_WIDTH), b = vgi_load(abc[1] + part * VGI_WIDTH);
            vgi_wide c = vgi_load(abc[2] + part * VGI_WIDTH);
#pragma GCC unroll 3
            for (int k = 0; k < 3; k++)
                put_piece(&d[r], k, part, a * row_piece(&d[r], k, part) + b * row_piece(&z[r], k, part) + c * row_piece(&zn[r], k, part));
        }
}

static void step_rows(size_t n, const vgi_row *u, const vgi_lanes t, const vgi_row *d, vgi_row *to)
{
    for (size_t r = 0; r < n; r++)
#pragma GCC unroll 4
        for (size_t part = 0; part < VGI_PARTS; part++)
#pragma GCC unroll 3
            for (int k = 0; k < 3; k++)
                put_piece(&to[r], k, part, row_piece(&u[r], k, part) + vgi_load(t + part * VGI_WIDTH) * row_piece(&d[r], k, part));
}

static void scale_rows(size_t n, const vgi_lanes factor, vgi_row *x)
{
    for (size_t r = 0; r < n; r++)
#pragma GCC unroll 4
        for (size_t part = 0; part < VGI_PARTS; part++)
#pragma GCC unroll 3
            for (int k = 0; k < 3; k++) put_piece(&x[r], k, part, vgi_load(factor + part * VGI_WIDTH) * row_piece(&x[r], k, part));
}

static void interleave(size_t n, const float *const *from, float *to)
{
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < VGI_LANES; k++) to[VGI_LANES * i + k] = from[k][i];
}

const vgi_robust_kernel VGI_OF_SET(vgi_robust_kernel) = {interleave, energy, direction_products, turn_direction, step_rows, scale_rows};
