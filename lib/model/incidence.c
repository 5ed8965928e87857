/* incidence.c: lists of the corners around each vertex, by counting sort. The mesh must be valid.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/incidence.h"

#include <stdlib.h>

int vgi_incidence_make(vgi_incidence *x, size_t nv, size_t nf, const uint32_t *start, const uint32_t *vert, vg_err *e)
{
    size_t corners = nf ? start[nf] : 0;
    x->first = vgi_array(nv + 1, sizeof *x->first, e);
    x->corner = vgi_array_raw(corners, sizeof *x->corner, e);
    x->face = vgi_array_raw(corners, sizeof *x->face, e);
    if (!x->first || !x->corner || !x->face) {
        vgi_incidence_clear(x);
        return VG_ENOMEM;
    }
    for (size_t c = 0; c < corners; c++) x->first[vert[c]]++;
    uint32_t before = 0; /* corners of the vertices before v */
    for (size_t v = 0; v <= nv; v++) {
        uint32_t count = x->first[v];
        x->first[v] = before;
        before += count;
    }
    /* filling moves first[v] to the end of v's list, which is where the next list begins */
    for (size_t f = 0; f < nf; f++)
        for (uint32_t c = start[f]; c < start[f + 1]; c++) {
            uint32_t at = x->first[vert[c]]++;
            x->corner[at] = c;
            x->face[at] = (uint32_t)f;
        }
    memmove(x->first + 1, x->first, nv * sizeof *x->first);
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
