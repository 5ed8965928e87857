/* network.c: a trained network as an artefact: whether its sizes agree, and which mesh it belongs to. Its layers are
 * in lib/net.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/artefact.h"

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

static const char *refuse_sizes(const vg_network *n)
{
    bool linear = n->model == VG_NETWORK_AUTO || n->model == VG_NETWORK_PCA;
    if ((unsigned)n->model > VG_NETWORK_CONV) return "its model is not known";
    if ((unsigned)n->direction > VG_FORWARD) return "its direction is not known";
    if (n->width != 9 && n->width != 12) return "its features are not 9 or 12 numbers";
    if (!n->rank || !n->parts || !n->step) return "a count is 0";
    if (n->numbers != (linear ? n->rank : n->nv * n->width)) return "its frames have a wrong number of numbers";
    if (n->sets != (n->direction == VG_SEPARATE ? 2 : 1)) return "its sets of parameters do not suit its direction";
    return linear && n->uncertain ? "a network of coordinates has no variance" : NULL;
}

static const char *refuse_numbers(const vg_network *n)
{
    if (!(n->diagonal > 0)) return "the diagonal is not above 0";
    for (int i = 0; i < 2; i++)
        if (!(n->high[i] > n->low[i])) return "a range is empty";
    for (size_t i = 0; i < 2 * n->rank; i++)
        if (!(n->scale[i] > 0)) return "a scale is not above 0";
    for (size_t i = 0; i < n->rank; i++)
        if (!(n->range[i] <= n->range[n->rank + i])) return "a range of coordinates is empty";
    return n->phase > 1 ? "its phase of training is not known" : NULL;
}

int vgi_check_network(vg_head *h, void *artefact, const char *where, vg_err *e)
{
    const vg_network *n = artefact;
    const char *why = refuse_sizes(n);
    if (!why) why = refuse_numbers(n);
    return why ? vgi_wrong(where, why, e) : vg_network_fits(n, &h->body.mesh, where, e);
}
