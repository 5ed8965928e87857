/* network.c: the layers that a network declares, and the meaning of its numbers. It is run in runner.c and trained in
 * train.c; the artefact is in model/network.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "net/network.h"

#include <math.h>

static const double reach = 0.95; /* normalised numbers of the training frames lie within -reach .. reach */

int vgi_network_shape(const vg_network *n, vgi_shape *s, vg_err *e)
{
    bool linear = vgi_network_is_linear(n);
    *s = (vgi_shape){.front = linear ? VGI_FRONT_LINEAR : VGI_FRONT_MESH,
                     .vertices = linear ? n->numbers : n->nv,
                     .channels = linear ? 1 : n->width,
                     .hidden = n->hidden,
                     .layers = n->layers,
                     .convolutions = n->model == VG_NETWORK_CONV ? n->convolutions : 0,
                     .uncertain = n->uncertain};
    if (vgi_shape_plan(s, e) < 0) return VG_EINPUT;
    if (n->nparameters && n->nparameters != s->total)
        return vg_fail(e, VG_EINPUT, "a network of %zu parameters has layers of %zu", n->nparameters, s->total);
    return VG_OK;
}

/* ---- meaning of the numbers ---- */

void vgi_network_normalise(const vg_network *n, const double *features, double *x)
{
    for (size_t i = 0; i < n->nv * n->width; i++) {
        size_t k = i % n->width, group = k >= 3;
        double q = k >= 9 ? features[i] / n->diagonal : features[i];
        x[i] = (q - n->low[group]) / (n->high[group] - n->low[group]) * (2 * reach) - reach;
    }
}

void vgi_network_features(const vg_network *n, const double *x, double *features)
{
    for (size_t i = 0; i < n->nv * n->width; i++) {
        size_t k = i % n->width, group = k >= 3;
        double q = (x[i] + reach) / (2 * reach) * (n->high[group] - n->low[group]) + n->low[group];
        features[i] = k >= 9 ? q * n->diagonal : q;
    }
}

void vgi_network_encode(const vg_network *n, const double *x, double *c)
{
    size_t d = n->nv * n->width;
    for (size_t k = 0; k < n->rank; k++) {
        double sum = 0;
        for (size_t i = 0; i < d; i++) sum += (double)n->basis[k * d + i] * (x[i] - n->mean[i]);
        c[k] = sum;
    }
}

void vgi_network_decode(const vg_network *n, const double *c, double *x)
{
    size_t d = n->nv * n->width;
    memcpy(x, n->mean, d * sizeof *x);
    for (size_t k = 0; k < n->rank; k++)
        for (size_t i = 0; i < d; i++) x[i] += c[k] * (double)n->basis[k * d + i];
}

double vgi_network_span(const vg_network *n)
{
    double sum = 0;
    for (size_t i = 0; i < n->rank; i++) sum += (n->range[n->rank + i] - n->range[i]) * (n->range[n->rank + i] - n->range[i]);
    return sqrt(sum);
}
