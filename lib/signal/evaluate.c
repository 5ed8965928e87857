/* evaluate.c: evaluates a signal at any time: curve, surface, shapes.
 *
 * Shapes are products of a batch of coordinates with the basis. In binary32, where BLAS does it, the batch always has the
 * same size, so that a shape does not depend on the others in it. Signals are fitted in fit.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "numeric/blas.h"
#include "signal/curve.h"
#include "signal/rows_kernel.h"
#include "signal/root.h"
#include "signal/signal.h"

#include <math.h>
#include <stdlib.h>

enum { STRIPE = 512 }; /* numbers of a shape */

struct vg_sampler {
    const vg_signal *s;
    vgi_plate plate;
    vgi_curve curve;
    double *coefficients; /* l x m */
    double *functions, *packed, *room;   /* batch x l; batch x l or m; l or m x VGI_TILE */
    double *turn_second, *shift_second; /* of the root */
    bool single;
    double *basis;                        /* m x d */
    float *basis_single, *x_single, *shape_single; /* m x d, batch x m, batch x stripe */
    bool borrowed;                         /* the basis is borrowed from the signal */
};

/* ---- data of the signal ---- */

int vgi_signal_curve(const vg_signal *s, vgi_curve *c, vg_err *e)
{
    *c = (vgi_curve){.n = s->n, .k = s->k};
    if (!(c->t = vgi_copy_array(s->parameter, s->n, sizeof *c->t, e)) ||
        !(c->slope = vgi_array(s->n, sizeof *c->slope, e)) || !(c->knot = vgi_array(s->k + 4, sizeof *c->knot, e)) ||
        !(c->control = vgi_copy_array(s->control, s->k, 2 * sizeof *c->control, e))) {
        vgi_curve_clear(c);
        return VG_ENOMEM;
    }
    memcpy(c->knot + 1, s->knot, (s->k + 2) * sizeof *s->knot);
    c->knot[0] = c->knot[1];
    c->knot[s->k + 3] = c->knot[s->k + 2];
    vgi_monotone_slopes(s->n, NULL, c->t, c->slope);
    return VG_OK;
}

int vgi_signal_set_curve(vg_signal *s, const vgi_curve *c, vg_err *e)
{
    double *knot = vgi_copy_array(c->knot + 1, c->k + 2, sizeof *knot, e);
    double *control = vgi_copy_array(c->control, c->k, 2 * sizeof *control, e);
    if (!knot || !control) {
        free(knot);
        free(control);
        return VG_ENOMEM;
    }
    free(s->knot);
    free(s->control);
    s->knot = knot, s->control = control, s->k = c->k;
    return VG_OK;
}

void vgi_signal_vector(const vg_signal *s, size_t j, double *h)
{
    size_t d = s->d;
    if (s->bits == 64) memcpy(h, s->basis + j * d, d * sizeof *h);
    for (size_t c = 0; c < d && s->bits == 32; c++) h[c] = (double)s->basis_single[j * d + c];
    for (size_t c = 0; c < d && s->bits == 16; c++) {
        const uint8_t *p = s->basis_short + 2 * (j * d + c);
        h[c] = s->basis_unit[j] * (double)(int16_t)(uint16_t)(p[0] | p[1] << 8);
    }
}

/* ---- construction ---- */

static int take_basis(vg_sampler *p, vg_err *e)
{
    const vg_signal *s = p->s;
    size_t size, room = (size_t)VG_SAMPLER_BATCH * STRIPE;
    if (!vgi_mul(s->m, s->d, &size))
        return vg_fail(e, VG_ENOMEM, "a basis of %zu x %zu numbers is too large", s->m, s->d);
    if (!p->single && s->bits == 64 && s->m) p->basis = s->basis, p->borrowed = true;
    else if (p->single && s->bits == 32 && s->m) p->basis_single = s->basis_single, p->borrowed = true;
    else if (p->single) p->basis_single = vgi_array_raw(size, sizeof(float), e);
    else p->basis = vgi_array_raw(size, sizeof(double), e);
    double *row = vgi_array_raw(s->d, sizeof *row, e);
    if ((!p->basis && !p->basis_single) || !row) {
        free(row);
        return VG_ENOMEM;
    }
    for (size_t j = 0; j < s->m && !p->borrowed; j++) {
        vgi_signal_vector(s, j, p->single ? row : p->basis + j * s->d);
        for (size_t c = 0; c < s->d && p->single; c++) p->basis_single[j * s->d + c] = (float)row[c];
    }
    free(row);
    if (p->single)
        return (p->x_single = vgi_array(VG_SAMPLER_BATCH, (s->m + 1) * sizeof(float), e)) &&
               (p->shape_single = vgi_array_raw(room, sizeof(float), e)) ? VG_OK : VG_ENOMEM;
    return VG_OK;
}

static int take_root(vg_sampler *p, vg_err *e)
{
    const vg_signal *s = p->s;
    if (!s->rooted) return VG_OK;
    double *room = vgi_array(s->n, sizeof *room, e);
    p->turn_second = vgi_array(s->n, 4 * sizeof *p->turn_second, e);
    p->shift_second = vgi_array(s->n, 3 * sizeof *p->shift_second, e);
    int r = room && p->turn_second && p->shift_second ? VG_OK : VG_ENOMEM;
    if (r == VG_OK) {
        vgi_natural_make(s->n, 4, s->turn, p->turn_second, room);
        vgi_natural_make(s->n, 3, s->shift, p->shift_second, room);
    }
    free(room);
    return r;
}

static int take_rooms(vg_sampler *p, vg_err *e)
{
    size_t l = p->plate.l, depth = l > p->s->m ? l : p->s->m + 1;
    return (p->coefficients = vgi_array(l * p->s->m + 1, sizeof(double), e)) &&
           (p->functions = vgi_array(l, VG_SAMPLER_BATCH * sizeof(double), e)) &&
           (p->packed = vgi_array(vgi_packed(VG_SAMPLER_BATCH, depth), sizeof(double), e)) &&
           (p->room = vgi_array_raw(depth, VGI_TILE * sizeof(double), e)) ? VG_OK : VG_ENOMEM;
}

int vg_sampler_new(vg_sampler **out, const vg_signal *s, bool single, vg_err *e)
{
    vg_sampler *p = *out = vgi_array(1, sizeof *p, e);
    if (!p) return VG_ENOMEM;
    p->s = s;
    p->single = single;
    vgi_blas_alone();
    int r = vgi_plate_make(&p->plate, s->n, s->position, s->site, s->l, e);
    if (r < 0 || take_rooms(p, e) < 0 || vgi_signal_curve(s, &p->curve, e) < 0 || take_basis(p, e) < 0 || take_root(p, e) < 0) {
        vg_sampler_free(out);
        return VG_ENOMEM;
    }
    vgi_plate_solve(&p->plate, p->plate.l, s->m, s->coordinate, s->m, p->coefficients);
    return VG_OK;
}

void vg_sampler_free(vg_sampler **out)
{
    vg_sampler *p = *out;
    if (!p) return;
    vgi_blas_shared();
    vgi_plate_clear(&p->plate);
    vgi_curve_clear(&p->curve);
    if (!p->borrowed) {
        free(p->basis);
        free(p->basis_single);
    }
    free(p->coefficients);
    free(p->functions);
    free(p->turn_second);
    free(p->shift_second);
    free(p->packed);
    free(p->x_single);
    free(p->room);
    free(p->shape_single);
    free(p);
    *out = NULL;
}

/* ---- evaluation ---- */

void vg_sampler_position(const vg_sampler *p, double time, double at[2])
{
    vgi_curve_at(&p->curve, time, at);
}

/* to (n rows of width numbers) := a (n x depth) b + add */
static void multiply(vg_sampler *p, size_t n, size_t depth, const double *a, size_t width, const double *b, const double *add,
                     double *const *to)
{
    vgi_pack_rows(n, depth, a, p->packed);
    vgi_rows_kernel_now()->multiply(&(vgi_product){.rows = n, .depth = depth, .end = width, .a = p->packed, .b = b,
                                                   .ldb = width, .add = add, .to = to, .room = p->room});
}

void vg_sampler_coordinates(vg_sampler *p, size_t n, const double *at, double *x)
{
    size_t m = p->s->m, l = p->plate.l;
    double *to[VG_SAMPLER_BATCH];
    for (size_t i = 0; i < n; i++) {
        vgi_plate_functions(&p->plate, l, at + 2 * i, p->functions + i * l);
        to[i] = x + i * m;
    }
    if (m) multiply(p, n, l, p->functions, m, p->coefficients, NULL, to);
}

static void shapes_single(vg_sampler *p, size_t n, const double *x, double *const *shapes)
{
    size_t m = p->s->m, d = p->s->d;
    for (size_t i = 0; i < n * m; i++) p->x_single[i] = (float)x[i];
    for (size_t first = 0; first < d; first += STRIPE) {
        size_t width = d - first < STRIPE ? d - first : STRIPE;
        const double *mean = p->s->mean + first;
        vgi_product_single(VG_SAMPLER_BATCH, width, m, p->x_single, m, p->basis_single + first, d, p->shape_single, width);
        for (size_t i = 0; i < n; i++) {
            const float *from = p->shape_single + i * width;
            for (size_t c = 0; c < width; c++) shapes[i][first + c] = mean[c] + (double)from[c];
        }
    }
}

void vg_sampler_shapes(vg_sampler *p, size_t n, const double *x, double *const *shapes)
{
    size_t m = p->s->m, d = p->s->d;
    if (p->single && m) {
        shapes_single(p, n, x, shapes);
        return;
    }
    for (size_t i = 0; i < n && !m; i++) memcpy(shapes[i], p->s->mean, d * sizeof(double));
    if (!m) return;
    multiply(p, n, m, x, d, p->basis, p->s->mean, shapes);
}

bool vg_sampler_root(const vg_sampler *p, double time, double turn[4], double shift[3])
{
    const vg_signal *s = p->s;
    double size = 0;
    if (!s->rooted) return false;
    vgi_natural_at(s->n, 4, s->turn, p->turn_second, time, turn);
    vgi_natural_at(s->n, 3, s->shift, p->shift_second, time, shift);
    for (int k = 0; k < 4; k++) size += turn[k] * turn[k];
    for (int k = 0; k < 4; k++) turn[k] = size > 0 ? turn[k] / sqrt(size) : k == 0;
    return true;
}

void vg_sampler_place(const vg_sampler *p, double time, size_t nv, double *vertices)
{
    double turn[4], shift[3];
    if (vg_sampler_root(p, time, turn, shift)) vgi_root_apply(turn, shift, nv, vertices);
}
