/* network.c: a trained network as an artefact: whether its sizes agree, and which mesh it belongs to. Its layers are
 * in lib/net.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/artefact.h"

#include <stdlib.h>

const char *vg_network_model_name(vg_network_model m)
{
    static const char *const names[] = {"none", "auto", "pca", "fc", "conv"};
    return (unsigned)m <= VG_NETWORK_CONV ? names[m] : "unknown";
}

void vg_network_clear(vg_network *n)
{
    vgi_fields_clear(&vgi_artefacts[VGI_NETW], n);
    *n = (vg_network){0};
}

int vg_network_copy(vg_network *to, const vg_network *from, vg_err *e)
{
    *to = (vg_network){0};
    return from->model ? vgi_fields_copy(&vgi_artefacts[VGI_NETW], to, from, NULL, e) : VG_OK;
}

int vg_network_fits(const vg_network *n, const vg_mesh *m, const char *subject, vg_err *e)
{
    if (n->nv != m->nv)
        return vg_fail(e, VG_EINPUT, "%s has %zu vertices where the network's mesh has %zu", subject, m->nv, n->nv);
    if (vg_mesh_digest(m) != n->mesh_digest)
        return vg_fail(e, VG_EINPUT, "%s has other faces than the network's mesh", subject);
    return VG_OK;
}

/* Greatest counts that the format permits (fmt/STREAM.md, 3.21); with these, no product of counts overflows. */
enum { MOST_LAYERS = 8, MOST_HIDDEN = 4096, MOST_CONVOLUTIONS = 8, MOST_NUMBERS = (1 << 27) - 2, MOST_STEP = 1 << 16 };

static bool is_linear(const vg_network *n)
{
    return n->model == VG_NETWORK_AUTO || n->model == VG_NETWORK_PCA;
}

/* The parameters of a set: in the order of the table of 3.21. */
static uint64_t count_parameters(const vg_network *n)
{
    uint64_t c = n->width, h = n->hidden, all = 0;
    if (is_linear(n)) all = (h + 1) * n->numbers;
    else all = n->convolutions * (2 * c * c + 2 * c) + n->numbers * h + (n->uncertain ? (n->numbers + 1) * h : 0);
    for (size_t l = 0; l < n->layers; l++) all += ((l == 0 && is_linear(n) ? n->numbers : h) + h + 1) * 4 * h;
    return all;
}

static const char *refuse_layers(const vg_network *n)
{
    if (n->numbers > MOST_NUMBERS) return "its frames have too many numbers";
    if (n->layers < 1 || n->layers > MOST_LAYERS) return "its layers are not 1 to 8";
    if (n->hidden < 1 || n->hidden > MOST_HIDDEN) return "its layers have not 1 to 4096 cells";
    if (n->convolutions > (n->model == VG_NETWORK_CONV ? MOST_CONVOLUTIONS : 0)) return "it has too many convolutions";
    return n->nparameters == count_parameters(n) ? NULL : "its parameters are not those of its layers";
}

static const char *refuse_sizes(const vg_network *n)
{
    bool linear = is_linear(n);
    if (n->model < VG_NETWORK_AUTO || n->model > VG_NETWORK_CONV) return "its model is not known";
    if ((unsigned)n->direction > VG_FORWARD) return "its direction is not known";
    if (n->width != 9 && n->width != 12) return "its features are not 9 or 12 numbers";
    if (!n->rank || !n->parts || !n->step) return "a count is 0";
    if (n->numbers != (linear ? n->rank : n->nv * n->width)) return "its frames have a wrong number of numbers";
    if (n->sets != (n->direction == VG_SEPARATE ? 2 : 1)) return "its sets of parameters do not match its direction";
    if (linear && n->uncertain) return "a network of coordinates has no variance";
    return n->step > MOST_STEP ? "its step is too large" : refuse_layers(n);
}

static bool is_error(double x)
{
    return x >= 0 || x == -1; /* -1: not measured */
}

static const char *refuse_numbers(const vg_network *n)
{
    bool measured = is_error(n->best_error);
    for (size_t i = 0; i < 2 * VG_NETWORK_METHODS * VG_NETWORK_FRAMES; i++) measured = measured && is_error(n->errors[i]);
    if (!measured) return "an error is below 0";
    if (!(n->diagonal > 0)) return "the diagonal is not above 0";
    for (int i = 0; i < 2; i++)
        if (!(n->high[i] > n->low[i])) return "a range is empty";
    for (size_t i = 0; i < 2 * n->rank; i++)
        if (!(n->scale[i] > 0)) return "a scale is not above 0";
    for (size_t i = 0; i < n->rank; i++)
        if (!(n->range[i] <= n->range[n->rank + i])) return "a range of coordinates is empty";
    return n->phase > 1 ? "its phase of training is not known" : NULL;
}

static int check_parts(const vg_network *n, const vg_mesh *m, const char *where, vg_err *e)
{
    size_t parts = 0;
    uint32_t *label = vgi_array_raw(m->nv, sizeof *label, e);
    int r = label ? vg_mesh_components(m, label, &parts, e) : VG_ENOMEM;
    free(label);
    return r == VG_OK && parts != n->parts ? vgi_wrong(where, "the mesh has another number of components", e) : r;
}

static const char *refuse_curve(const vg_network *n)
{
    if (n->ncurve_block > n->ncurve) return "its curve is shorter than its part beside a validation block";
    for (size_t i = 0; i < n->ncurve; i++) {
        const float *x = n->curve + 3 * i;
        if (x[0] < 0 || x[1] < 0 || !is_error(x[2])) return "a number of its curve is below 0";
    }
    return is_error(n->curve_start) ? NULL : "a number of its curve is below 0";
}

int vgi_check_network(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_network *n = artefact;
    const char *why = refuse_sizes(n);
    if (!why) why = refuse_numbers(n);
    if (!why) why = refuse_curve(n);
    if (why) return vgi_wrong(where, why, e);
    int r = vg_network_fits(n, &h->body.mesh, where, e);
    return r == VG_OK ? check_parts(n, &h->body.mesh, where, e) : r;
}
