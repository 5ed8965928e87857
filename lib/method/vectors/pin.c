/* pin.c: pins: vertices of a target that must stay because all faces that drive theirs stay. The frame lists them
 * (vg_frame_pin) and the reconstruction holds them.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"

#include <math.h>
#include <stdlib.h>

static const double still = 1e-6; /* in D: a vertex nearer to its reference position does not move */
enum { MUCH = 10 };               /* vertices are pinned only if at least this share of the source stays */

struct vg_pinner {
    const vg_graph *from, *to;
    const vg_correspondence *pairs; /* NULL: face by face */
    const double *reference;        /* of the source */
    double least;
    bool always;
    bool *moves, *face_moves; /* in the current pose: per source vertex and face */
    bool *free;               /* per target vertex: not pinned */
    uint32_t *list;
};

int vg_pinner_new(vg_pinner **out, const vg_graph *from, const double *source, const vg_graph *to,
                  const vg_correspondence *pairs, bool always, vg_err *e)
{
    vg_pinner *p = *out = vgi_array(1, sizeof *p, e);
    if (!p) return VG_ENOMEM;
    p->from = from, p->to = to, p->pairs = pairs, p->reference = source, p->always = always;
    p->least = still * vg_diagonal(source, from->faces.nv);
    p->moves = vgi_array(from->faces.nv, sizeof *p->moves, e);
    p->face_moves = vgi_array(from->faces.nf, sizeof *p->face_moves, e);
    p->free = vgi_array(to->faces.nv, sizeof *p->free, e);
    p->list = vgi_array(to->faces.nv, sizeof *p->list, e);
    if (p->moves && p->face_moves && p->free && p->list) return VG_OK;
    vg_pinner_free(out);
    return VG_ENOMEM;
}

void vg_pinner_free(vg_pinner **p)
{
    if (!*p) return;
    free((*p)->moves);
    free((*p)->face_moves);
    free((*p)->free);
    free((*p)->list);
    free(*p);
    *p = NULL;
}

/* Mark the vertices that move. Returns the number of source vertices that stay. */
static size_t mark_moving(vg_pinner *p, const double *pose)
{
    size_t n = 0;
    for (size_t v = 0; v < p->from->faces.nv; v++) {
        p->moves[v] = false;
        for (size_t k = 3 * v; k < 3 * v + 3; k++) p->moves[v] |= !(fabs(pose[k] - p->reference[k]) <= p->least);
        n += !p->moves[v];
    }
    return n;
}

static void mark_moving_faces(vg_pinner *p)
{
    const vg_graph *g = p->from;
    for (size_t f = 0; f < g->faces.nf; f++) {
        p->face_moves[f] = false;
        for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++) p->face_moves[f] |= p->moves[g->faces.vert[c]];
    }
}

static bool driven_by_moving(const vg_pinner *p, size_t face)
{
    const vg_correspondence *k = p->pairs;
    if (!k) return p->face_moves[face];
    for (uint32_t i = k->first[face]; i < k->first[face + 1]; i++)
        if (p->face_moves[k->source[i]]) return true;
    return false;
}

size_t vg_pinner_find(vg_pinner *p, const double *pose, const uint32_t **vertices)
{
    const vg_graph *g = p->to;
    size_t n = 0, staying = mark_moving(p, pose);
    *vertices = p->list;
    if (!staying || (!p->always && staying < p->from->faces.nv / MUCH)) return 0;
    mark_moving_faces(p);
    memset(p->free, 0, g->faces.nv * sizeof *p->free);
    for (size_t f = 0; f < g->faces.nf - g->nlinks; f++) {
        if (!driven_by_moving(p, f)) continue;
        for (uint32_t c = g->faces.start[f]; c < g->faces.start[f + 1]; c++) p->free[g->faces.vert[c]] = true;
    }
    for (size_t v = 0; v < g->faces.nv; v++)
        if (g->in_face[v] && !p->free[v]) p->list[n++] = (uint32_t)v;
    return n;
}
