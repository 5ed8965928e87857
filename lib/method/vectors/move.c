/* move.c: position of the whole body in a transfer to another mesh (MATH 5). Vectors are in deform.c, transfer.c and
 * shape.c, vertices that stay in pin.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "method/vectors/face_rows.h"
#include "numeric/vec3.h"

#include <stdlib.h>

/* Ways, in diagonals of the source, up to which the ratio of small motions counts, and from which that of the sizes. */
static const double NEAR = 0.4, FAR = 1.4;

struct vg_mover {
    const vg_graph *to;
    double ratio; /* size of the target divided by that of the source; 0: the body stays */
    double near;  /* the same for small motions: people of two sizes nod and lean alike, but walk by their legs */
    double reach; /* the diagonal of the source */
    size_t nanchors;
    double source[3], target[3];             /* roots in the references */
    double *source_anchors, *target_anchors; /* positions in the references */
};

int vg_mover_new(vg_mover **out, const vg_graph *from, const double *source, const vg_graph *to, const double *target,
                 const uint32_t *anchors, size_t nanchors, bool stay, vg_err *e)
{
    double before = vg_diagonal(source, from->faces.nv), after = vg_diagonal(target, to->faces.nv);
    vg_mover *m = *out = vgi_array(1, sizeof *m, e);
    if (!m) return VG_ENOMEM;
    m->to = to, m->nanchors = nanchors;
    m->near = m->ratio = stay ? 0 : before > 0 ? after / before : 1;
    m->reach = before;
    vg_graph_root(from, source, m->source);
    vg_graph_root(to, target, m->target);
    m->source_anchors = vgi_array(nanchors, 3 * sizeof *m->source_anchors, e);
    m->target_anchors = vgi_array(nanchors, 3 * sizeof *m->target_anchors, e);
    if (!m->source_anchors || !m->target_anchors) {
        vg_mover_free(out);
        return VG_ENOMEM;
    }
    vg_graph_anchors(source, anchors, nanchors, m->source_anchors);
    vg_graph_anchors(target, anchors, nanchors, m->target_anchors);
    return VG_OK;
}

void vg_mover_free(vg_mover **m)
{
    if (!*m) return;
    free((*m)->source_anchors);
    free((*m)->target_anchors);
    free(*m);
    *m = NULL;
}

static void go(const vg_mover *m, const double *source, const double *target, const double *now, double *to)
{
    double way[3];
    vgi_subtract(now, source, way);
    double x = m->reach > 0 ? (vgi_length(way) / m->reach - NEAR) / (FAR - NEAR) : 1, far = fmin(fmax(x, 0), 1);
    double ratio = m->near + far * far * (3 - 2 * far) * (m->ratio - m->near);
    for (int k = 0; k < 3; k++) to[k] = target[k] + (ratio > 0 ? ratio * way[k] : 0);
}

void vg_mover_move(const vg_mover *m, const vg_frame *in, vg_frame *out)
{
    const double *from = vg_frame_anchors(in);
    double *to = vg_frame_anchors(out);
    go(m, m->source, m->target, in->root, out->root);
    for (size_t i = 0; i < 3 * m->nanchors; i += 3)
        go(m, m->source_anchors + i, m->target_anchors + i, from + i, to + i);
}

void vg_mover_follow(vg_mover *m, const double root[3], double near, double ratio)
{
    memcpy(m->source, root, sizeof m->source);
    if (m->ratio > 0) m->near = near, m->ratio = ratio;
}

void vg_mover_place(const vg_mover *m, const double root[3], double *vertices)
{
    vgi_keep_root(m->to, vertices, root);
}
