/* incidence.c: lists of the corners around each vertex, by counting sort. The mesh must be valid.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/incidence.h"

#include <stdlib.h>

int vgi_incidence_make(vgi_incidence *x, const vg_mesh *m, vg_err *e)
{
    size_t corners = vg_mesh_corners(m);
    x->first = vgi_array(m->nv + 1, sizeof *x->first, e);
    x->corner = vgi_array_raw(corners, sizeof *x->corner, e);
    x->face = vgi_array_raw(corners, sizeof *x->face, e);
    if (!x->first || !x->corner || !x->face) {
        vgi_incidence_clear(x);
        return VG_ENOMEM;
    }
    for (size_t c = 0; c < corners; c++) x->first[m->vert[c]]++;
    uint32_t before = 0; /* number of corners of the vertices before v */
    for (size_t v = 0; v <= m->nv; v++) {
        uint32_t count = x->first[v];
        x->first[v] = before;
        before += count;
    }
    /* filling moves first[v] to the end of v's list, where the next list begins */
    for (size_t f = 0; f < m->nf; f++)
        for (uint32_t c = m->start[f]; c < m->start[f + 1]; c++) {
            uint32_t at = x->first[m->vert[c]]++;
            x->corner[at] = c;
            x->face[at] = (uint32_t)f;
        }
    memmove(x->first + 1, x->first, m->nv * sizeof *x->first);
    x->first[0] = 0;
    return VG_OK;
}

void vgi_incidence_clear(vgi_incidence *x)
{
    free(x->first);
    free(x->corner);
    free(x->face);
    *x = (vgi_incidence){0};
}
