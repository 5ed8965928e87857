/* shape.c: the table of a network's parameters and their initial values.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/shape.h"
#include "core/random.h"

#include <math.h>
#include <stdio.h>

enum { MOST_HIDDEN = 4096 };

static bool put_parameter(vgi_shape *s, size_t *at, const char *name, size_t number, size_t rows, size_t columns)
{
    vgi_parameter *p = &s->parameter[s->nparameters++];
    size_t size;
    if (!vgi_mul(rows, columns, &size) || s->total > SIZE_MAX / 8 - size) return false;
    snprintf(p->name, sizeof p->name, "%s %zu", name, number + 1);
    p->at = *at = s->total, p->rows = rows, p->columns = columns;
    s->total += size;
    return true;
}

static bool put_mesh(vgi_shape *s)
{
    bool ok = true;
    size_t c = s->channels;
    for (size_t k = 0; k < s->convolutions; k++) {
        ok = ok && put_parameter(s, &s->own[k], "convolution own", k, c, c) && put_parameter(s, &s->mean[k], "convolution mean", k, c, c);
        ok = ok && put_parameter(s, &s->bias[k], "bias", k, c, 1) && put_parameter(s, &s->bias_back[k], "bias back", k, c, 1);
    }
    ok = ok && put_parameter(s, &s->full, "full", 0, s->numbers, s->latent);
    if (s->uncertain)
        ok = ok && put_parameter(s, &s->variance, "variance", 0, s->numbers, s->latent) &&
             put_parameter(s, &s->variance_bias, "variance bias", 0, s->latent, 1);
    return ok;
}

int vgi_shape_plan(vgi_shape *s, vg_err *e)
{
    bool ok = s->vertices > 0 && s->channels > 0 && s->channels <= 16 && s->hidden > 0 && s->hidden <= MOST_HIDDEN &&
              s->layers > 0 && s->layers <= VGI_NET_LAYERS && s->convolutions <= VGI_NET_CONVOLUTIONS &&
              vgi_mul(s->vertices, s->channels, &s->numbers) && s->numbers < INT32_MAX / 16;
    if (!ok) return vg_fail(e, VG_EARG, "a network of %zu layers of %zu for %zu numbers cannot be made", s->layers,
                            s->hidden, s->numbers);
    s->total = s->nparameters = 0;
    s->latent = s->front == VGI_FRONT_MESH ? s->hidden : s->numbers;
    if (s->front == VGI_FRONT_MESH) ok = put_mesh(s);
    else ok = put_parameter(s, &s->full, "output", 0, s->hidden, s->numbers) &&
              put_parameter(s, &s->full_bias, "output bias", 0, s->numbers, 1);
    for (size_t l = 0; l < s->layers; l++)
        ok = ok && put_parameter(s, &s->gates[l], "gates", l, vgi_shape_input(s, l) + s->hidden, 4 * s->hidden) &&
             put_parameter(s, &s->gates_bias[l], "gates bias", l, 4 * s->hidden, 1);
    return ok ? VG_OK : vg_fail(e, VG_EARG, "a network for %zu numbers is too large", s->numbers);
}

/* ---- initial values ---- */

static void fill_normal(float *p, size_t n, double deviation, vgi_random *r)
{
    for (size_t i = 0; i < n; i++) p[i] = (float)(deviation * vgi_random_normal(r));
}

static void fill_uniform(float *p, size_t n, double most, vgi_random *r)
{
    for (size_t i = 0; i < n; i++) p[i] = (float)(most * (2 * vgi_random_uniform(r) - 1));
}

static void add_diagonal(float *p, size_t n, double x)
{
    for (size_t i = 0; i < n; i++) p[i * n + i] += (float)x;
}

static void start_mesh(const vgi_shape *s, float *p, vgi_random *r)
{
    size_t c = s->channels;
    for (size_t k = 0; k < s->convolutions; k++) {
        fill_normal(p + s->own[k], c * c, 0.1, r);
        add_diagonal(p + s->own[k], c, 0.7);
        fill_normal(p + s->mean[k], c * c, 0.1, r);
        add_diagonal(p + s->mean[k], c, 0.2);
    }
    fill_normal(p + s->full, s->numbers * s->latent, 0.02, r);
    if (!s->uncertain) return;
    fill_normal(p + s->variance, s->numbers * s->latent, 0.001, r);
    for (size_t i = 0; i < s->latent; i++) p[s->variance_bias + i] = -4;
}

int vgi_shape_start(const vgi_shape *s, uint64_t seed, bool quiet, float *parameters, vg_err *e)
{
    if (!parameters) return vg_fail(e, VG_ENOMEM, "out of memory: %zu parameters", s->total);
    vgi_random r = vgi_random_start(seed, 0);
    double width = 1 / sqrt((double)s->hidden);
    memset(parameters, 0, s->total * sizeof *parameters);
    if (s->front == VGI_FRONT_MESH) start_mesh(s, parameters, &r);
    else fill_uniform(parameters + s->full, s->hidden * s->numbers, 0.3 * width * (quiet ? 0.01 : 1), &r);
    for (size_t l = 0; l < s->layers; l++) {
        fill_uniform(parameters + s->gates[l], (vgi_shape_input(s, l) + s->hidden) * 4 * s->hidden, width, &r);
        fill_uniform(parameters + s->gates_bias[l], 4 * s->hidden, width, &r);
        for (size_t i = 0; i < s->hidden; i++) parameters[s->gates_bias[l] + s->hidden + i] += 1; /* forget gates
                                                                                                     start nearly
                                                                                                     open */
    }
    return VG_OK;
}
