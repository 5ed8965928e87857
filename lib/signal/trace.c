/* trace.c: the curve of a signal as a fine polyline, with the distance of its shapes from a smooth motion, and its
 * self-crossings. Drawing is in view/pose_plane.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/blas.h"
#include "signal/curve.h"

#include <math.h>
#include <stdlib.h>

void vg_trace_clear(vg_trace *t)
{
    free(t->position);
    free(t->deviation);
    free(t->crossing);
    *t = (vg_trace){0};
}

int vgi_curve_crossings(const vgi_curve *c, size_t parts, double **times, size_t *count, vg_err *e)
{
    size_t points = (c->n - 1) * parts + 1;
    vgi_crossing *list = NULL;
    double *p = vgi_array(points, 2 * sizeof *p, e);
    *times = NULL, *count = 0;
    if (!p) return VG_ENOMEM;
    for (size_t i = 0; i < points; i++) vgi_curve_at(c, 1 + (double)i / (double)parts, p + 2 * i);
    int r = vgi_crossings(points, p, &list, count, e);
    free(p);
    if (r == VG_OK && !(*times = vgi_array(*count, 2 * sizeof **times, e))) r = VG_ENOMEM;
    for (size_t i = 0; r == VG_OK && i < *count; i++) {
        (*times)[2 * i] = 1 + (list[i].a - 1) / (double)parts;
        (*times)[2 * i + 1] = 1 + (list[i].b - 1) / (double)parts;
    }
    free(list);
    return r;
}

/* Products of the basis vectors, with which lengths of shapes follow from coordinates. */
static int make_products(const vg_signal *s, double **products, vg_err *e)
{
    size_t m = s->m, d = s->d;
    double *h = vgi_array(m * d, sizeof *h, e);
    int r = h && (*products = vgi_array(m * m, sizeof **products, e)) ? VG_OK : VG_ENOMEM;
    for (size_t j = 0; r == VG_OK && j < m; j++) vgi_signal_vector(s, j, h + j * d);
    vgi_blas_alone();
    if (r == VG_OK && m) vgi_gram(m, d, h, *products, 1);
    vgi_blas_shared();
    free(h);
    return r;
}

static double length_of(size_t m, const double *products, const double *x)
{
    double sum = 0;
    for (size_t i = 0; i < m; i++)
        for (size_t j = 0; j < m; j++) sum += x[i] * products[i * m + j] * x[j];
    return sqrt(fmax(sum, 0));
}

static int measure_trace(vg_trace *t, const vg_signal *s, vg_sampler *p, vg_err *e)
{
    size_t n = s->n, m = s->m;
    double *products = NULL, *second = vgi_array(n * m, sizeof *second, e), *room = vgi_array(n + 2 * m, sizeof *room, e);
    int r = second && room ? make_products(s, &products, e) : VG_ENOMEM;
    if (r == VG_OK) vgi_natural_make(n, m, s->coordinate, second, room);
    for (size_t i = 0; r == VG_OK && i < t->n; i++) {
        double time = 1 + (double)i / (double)t->parts, *x = room, *smooth = room + m;
        vg_sampler_position(p, time, t->position + 2 * i);
        vg_sampler_coordinates(p, 1, t->position + 2 * i, x);
        vgi_natural_at(n, m, s->coordinate, second, time, smooth);
        for (size_t c = 0; c < m; c++) x[c] -= smooth[c];
        t->deviation[i] = length_of(m, products, x) / sqrt(fmax((double)s->d / 3, 1));
    }
    free(products);
    free(second);
    free(room);
    return r;
}

int vg_signal_trace(vg_trace *t, const vg_signal *s, size_t parts, vg_err *e)
{
    vgi_curve curve = {0};
    vg_sampler *p = NULL;
    *t = (vg_trace){.parts = parts, .n = (s->n - 1) * parts + 1};
    int r = vg_sampler_new(&p, s, false, e);
    if (r == VG_OK && (!(t->position = vgi_array(t->n, 2 * sizeof *t->position, e)) ||
                       !(t->deviation = vgi_array(t->n, sizeof *t->deviation, e))))
        r = VG_ENOMEM;
    if (r == VG_OK) r = measure_trace(t, s, p, e);
    if (r == VG_OK) r = vgi_signal_curve(s, &curve, e);
    if (r == VG_OK) r = vgi_curve_crossings(&curve, parts, &t->crossing, &t->ncrossings, e);
    vgi_curve_clear(&curve);
    vg_sampler_free(&p);
    if (r < 0) vg_trace_clear(t);
    return r;
}
