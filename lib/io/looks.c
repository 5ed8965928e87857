/* looks.c: colours and texture coordinates of files that have one of each at a vertex: PLY and OFF.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <math.h>
#include <stdlib.h>

int vgi_begin_colours(vg_model *m, vg_err *e)
{
    vg_attributes *a = &m->attributes;
    if (!(a->colours = vgi_array(m->mesh.nv, 4, e))) return VG_ENOMEM;
    a->ncolours = m->mesh.nv;
    for (size_t v = 0; v < a->ncolours; v++) a->colours[4 * v + 3] = 255;
    return VG_OK;
}

int vgi_begin_texture(vg_model *m, vg_err *e)
{
    vg_attributes *a = &m->attributes;
    if (!(a->tex = vgi_array(m->mesh.nv, 2 * sizeof *a->tex, e))) return VG_ENOMEM;
    a->ntex = m->mesh.nv, a->tex_dim = 2;
    return VG_OK;
}

/* Texture coordinates that are not finite become 0; returns their number. bad: one for each. */
static size_t clear_bad(vg_attributes *a, bool *bad)
{
    size_t n = 0;
    for (size_t i = 0; i < a->ntex; i++) {
        double *x = a->tex + 2 * i;
        bad[i] = !isfinite(x[0]) || !isfinite(x[1]);
        if (bad[i]) x[0] = x[1] = 0, n++;
    }
    return n;
}

int vgi_end_texture(vg_model *m, size_t corners, vg_err *e)
{
    vg_attributes *a = &m->attributes;
    if (!a->ntex) return VG_OK;
    bool *bad = vgi_array_raw(a->ntex, sizeof *bad, e);
    a->corner_tex = vgi_array_raw(corners, sizeof *a->corner_tex, e);
    if (!bad || !a->corner_tex) {
        free(bad);
        return VG_ENOMEM;
    }
    const size_t n = clear_bad(a, bad);
    for (size_t c = 0; c < corners; c++) {
        const uint32_t v = m->mesh.vert[c];
        a->corner_tex[c] = v < a->ntex && !bad[v] ? v : UINT32_MAX;
    }
    free(bad);
    if (n) vgi_note(&m->note, "left out %zu texture coordinates that are not finite numbers", n);
    return VG_OK;
}
