/* components.c: chooses which components of the source take part in a registration. A head may come with teeth, gums,
 * lashes and eyes, while the target is skin alone. If all components were fitted to it, teeth would drive lips.
 *
 * Components with ties always take part and are fitted first. Each other component is then placed by the similarity
 * of the whole body. It joins if it explains part of the target: faces with matching normals that no fitted component
 * covers, or that the fitted components cover only from much farther away. The fit is in fit.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/pairs/register.h"

#include <stdlib.h>

enum { BLOCK = 128 };
static const double LIES_ON = 0.01;   /* in D: a target face within this distance of a fitted component is explained
                                         by it */
static const double REACH = 0.05;     /* in D: the largest distance of another component from the faces it explains */
static const double NEARER = 0.25;    /* ratio of distances below which a fitted component explains the same faces */
static const double COSINE = 0.5;     /* least cosine of the angle between normals that match */
static const double SHARE = 0.15;     /* least share of its own area that a component must explain */

typedef struct choice {
    const vgi_component_choice *in;
    vgi_surface *fitted, *riding;
    uint32_t *best; /* per target face: the face of another component that explains it, or UINT32_MAX */
} choice;

static void look_block(void *context, size_t block)
{
    choice *c = context;
    const vg_mesh *m = c->in->target;
    size_t end = (block + 1) * BLOCK < m->nf ? (block + 1) * BLOCK : m->nf;
    for (size_t g = block * BLOCK; g < end; g++) {
        const double *at = vgi_surface_centroids(c->in->target_surface) + 3 * g;
        const double *n = vgi_surface_normals(c->in->target_surface) + 3 * g;
        double sign = c->in->flipped ? -1 : 1, normal[3] = {sign * n[0], sign * n[1], sign * n[2]};
        double size = vgi_surface_sizes(c->in->target_surface)[g], limit = REACH * REACH;
        vgi_hit near, other;
        c->best[g] = UINT32_MAX;
        if (vgi_surface_nearest(c->fitted, at, normal, COSINE, LIES_ON * LIES_ON, &near) &&
            (!near.border || near.square <= size * size))
            limit = NEARER * NEARER * near.square;
        if (vgi_surface_nearest(c->riding, at, normal, COSINE, limit, &other) && !other.border)
            c->best[g] = other.face;
    }
}

/* Add the components that explain enough to those taken. */
static int judge_components(const choice *c, bool *taken, vg_err *e)
{
    const vgi_component_choice *in = c->in;
    double *own = vgi_array(in->n, sizeof *own, e), *explained = vgi_array(in->n, sizeof *explained, e);
    int r = own && explained ? VG_OK : VG_ENOMEM;
    for (size_t f = 0; f < in->source->nf && r == VG_OK; f++) {
        double size = vgi_surface_sizes(c->fitted)[f];
        own[in->label[in->source->vert[in->source->start[f]]]] += size * size;
    }
    for (size_t g = 0; g < in->target->nf && r == VG_OK; g++) {
        if (c->best[g] == UINT32_MAX) continue;
        double size = vgi_surface_sizes(in->target_surface)[g];
        explained[in->label[in->source->vert[in->source->start[c->best[g]]]]] += size * size;
    }
    for (size_t k = 0; k < in->n && r == VG_OK; k++)
        if (!taken[k]) taken[k] = own[k] > 0 && explained[k] >= SHARE * own[k];
    free(own);
    free(explained);
    return r;
}

int vgi_choose_components(const vgi_component_choice *in, bool *taken, vg_err *e)
{
    choice c = {.in = in};
    size_t nf = in->source->nf;
    bool *side = vgi_array(nf, sizeof *side, e);
    c.best = vgi_array_raw(in->target->nf, sizeof *c.best, e);
    int r = side && c.best ? VG_OK : VG_ENOMEM;
    vgi_take_faces(in->source, in->label, taken, side);
    if (r == VG_OK) r = vgi_surface_of(&c.fitted, in->source, in->points, side, e);
    for (size_t f = 0; f < nf && r == VG_OK; f++) side[f] = !side[f];
    if (r == VG_OK) r = vgi_surface_of(&c.riding, in->source, in->rest, side, e);
    if (r == VG_OK) {
        vgi_parallel(in->threads, (in->target->nf + BLOCK - 1) / BLOCK, look_block, &c);
        r = judge_components(&c, taken, e);
    }
    vgi_surface_free(&c.fitted);
    vgi_surface_free(&c.riding);
    free(side);
    free(c.best);
    return r;
}

void vgi_take_faces(const vg_mesh *m, const uint32_t *label, const bool *taken, bool *faces)
{
    for (size_t f = 0; faces && f < m->nf; f++) faces[f] = taken[label[m->vert[m->start[f]]]];
}
