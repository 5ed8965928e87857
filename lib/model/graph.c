/* graph.c: the vector graph of a sequence: the faces that have vectors, and the vectors of a pose (T 3.1). Faces are
 * chosen in select.c, links in link.c; deformations are in deform.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "core/core.h"
#include "numeric/vec3.h"

#include <stdlib.h>

static void mark_attached(vg_graph *g)
{
    size_t corners = vg_graph_corners(g);
    for (size_t c = 0; c < corners; c++) {
        bool *in = &g->in_face[g->faces.vert[c]];
        g->attached += !*in;
        *in = true;
    }
    for (size_t f = 0; f < g->faces.nf; f++) {
        size_t size = g->faces.start[f + 1] - g->faces.start[f];
        if (size > g->max_corners) g->max_corners = size;
    }
}

/* selected, links: NULL for all faces, no links. */
static void fill_faces(vg_graph *g, const vg_mesh *m, const uint32_t *selected, const vg_links *links)
{
    uint32_t at = 0;
    size_t faces = g->faces.nf - g->nlinks;
    for (size_t i = 0; i < faces; i++) {
        size_t f = selected ? selected[i] : i;
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) g->faces.vert[at++] = m->vert[c];
        g->faces.start[i + 1] = at;
    }
    for (size_t i = 0; links && i < links->n; i++) {
        g->faces.vert[at++] = links->pairs[2 * i];
        g->faces.vert[at++] = links->pairs[2 * i + 1];
        g->faces.start[faces + i + 1] = at;
    }
}

int vg_graph_new(vg_graph **out, const vg_mesh *m, const vg_selection *selection, const vg_links *links, vg_err *e)
{
    const bool some = selection && selection->chosen;
    size_t faces = some ? selection->n : m->nf, nlinks = links ? links->n : 0, corners = 2 * nlinks;
    for (size_t i = 0; i < faces; i++) {
        size_t f = some ? selection->faces[i] : i;
        corners += m->start[f + 1] - m->start[f];
    }
    if (corners >= UINT32_MAX) return vg_fail(e, VG_EINPUT, "too many corners: %zu (the limit is 2^32 - 2)", corners);

    vg_graph *g = *out = vgi_array(1, sizeof *g, e);
    if (!g) return VG_ENOMEM;
    g->faces.nv = m->nv, g->faces.nf = faces + nlinks, g->nlinks = nlinks;
    g->faces.start = vgi_array(g->faces.nf + 1, sizeof *g->faces.start, e);
    g->faces.vert = vgi_array(corners, sizeof *g->faces.vert, e);
    g->in_face = vgi_array(g->faces.nv, sizeof *g->in_face, e);
    if (!g->faces.start || !g->faces.vert || !g->in_face) return vg_graph_free(out), VG_ENOMEM;
    fill_faces(g, m, some ? selection->faces : NULL, links);
    mark_attached(g);
    return VG_OK;
}

int vg_head_graph(vg_graph **g, const vg_head *h, vg_err *e)
{
    return vg_graph_new(g, &h->body.mesh, &h->selection, &h->links, e);
}

void vg_graph_free(vg_graph **g)
{
    if (!*g) return;
    free((*g)->faces.start);
    free((*g)->faces.vert);
    free((*g)->in_face);
    free(*g);
    *g = NULL;
}

size_t vg_graph_corners(const vg_graph *g)
{
    return g->faces.start[g->faces.nf];
}

void vg_graph_vectors(const vg_graph *g, const double *vertices, double *vectors)
{
    for (size_t f = 0; f < g->faces.nf; f++) {
        uint32_t begin = g->faces.start[f], end = g->faces.start[f + 1];
        double centre[3] = {0, 0, 0}, share = 1.0 / (double)(end - begin);
        for (uint32_t c = begin; c < end; c++)
            vgi_add(centre, vertices + 3 * (size_t)g->faces.vert[c]);
        vgi_scale(centre, share);
        for (uint32_t c = begin; c < end; c++)
            vgi_subtract(vertices + 3 * (size_t)g->faces.vert[c], centre, vectors + 3 * (size_t)c);
    }
}

void vg_graph_root(const vg_graph *g, const double *vertices, double root[3])
{
    double sum[3] = {0, 0, 0};
    for (size_t v = 0; v < g->faces.nv; v++)
        if (g->in_face[v])
            vgi_add(sum, vertices + 3 * v);
    for (int k = 0; k < 3; k++) root[k] = g->attached ? sum[k] / (double)g->attached : 0;
}

void vg_graph_anchors(const double *vertices, const uint32_t *anchors, size_t n, double *positions)
{
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) positions[3 * i + k] = vertices[3 * (size_t)anchors[i] + k];
}
