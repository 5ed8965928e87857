/* look.c: finds what a sheet is centred on, by number or name. The camera is in sheet.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "view/sheet.h"

#include <math.h>
#include <stdlib.h>

static int one_vertex(uint32_t v, uint32_t **vertices, size_t *n, vg_err *e)
{
    *vertices = vgi_array_raw(1, sizeof **vertices, e);
    if (!*vertices) return VG_ENOMEM;
    **vertices = v;
    *n = 1;
    return VG_OK;
}

/* Parse a number without trailing text. Vertices beyond UINT32_MAX do not exist. */
static bool is_number(const char *what, size_t *v)
{
    size_t length = strlen(what);
    *v = length <= 10 ? (size_t)strtoull(what, NULL, 10) : SIZE_MAX;
    return length > 0 && strspn(what, "0123456789") == length;
}

static uint32_t nearest_vertex(const vg_body *b, const double at[3])
{
    double least = INFINITY;
    uint32_t found = 0;
    for (size_t v = 0; v < b->mesh.nv; v++) {
        const double *p = b->reference + 3 * v, x = p[0] - at[0], y = p[1] - at[1], z = p[2] - at[2];
        const double far = x * x + y * y + z * z;
        if (far < least) least = far, found = (uint32_t)v;
    }
    return found;
}

/* The vertex of the joint with that name; false if there is none. */
static bool find_joint(const vg_body *b, const char *name, uint32_t *v)
{
    const bool rigged = b->rig.skeleton.njoints > 0;
    const vg_skeleton *s = rigged ? &b->rig.skeleton : &b->skeleton;
    for (size_t j = 0; j < s->njoints; j++)
        if (!strcmp(s->joints[j].name, name)) {
            *v = rigged ? nearest_vertex(b, b->rig.at + 3 * j) : (uint32_t)j;
            return true;
        }
    return false;
}

/* Mark the vertices of the faces with labels of this kind and name. Returns their number. */
static size_t mark_part(const vg_body *b, uint32_t kind, const char *name, bool *marked)
{
    const vg_attributes *a = &b->attributes;
    size_t label = 0, n = 0;
    bool inside = false;
    for (size_t f = 0; f < b->mesh.nf; f++) {
        for (; label < a->nlabels && a->labels[label].face <= f; label++)
            if (a->labels[label].kind == kind) inside = !strcmp(a->labels[label].text, name);
        for (size_t c = b->mesh.start[f]; inside && c < b->mesh.start[f + 1]; c++) {
            n += !marked[b->mesh.vert[c]];
            marked[b->mesh.vert[c]] = true;
        }
    }
    return n;
}

static int find_part(const vg_body *b, const char *name, uint32_t **vertices, size_t *n, vg_err *e)
{
    static const uint32_t kinds[] = {VG_LABEL_OBJECT, VG_LABEL_GROUP, VG_LABEL_MATERIAL};
    bool *marked = vgi_array(b->mesh.nv, sizeof *marked, e);
    if (!marked) return VG_ENOMEM;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds && !*n; i++) *n = mark_part(b, kinds[i], name, marked);
    int r = VG_OK;
    if (*n) {
        *vertices = vgi_array_raw(*n, sizeof **vertices, e);
        r = *vertices ? VG_OK : VG_ENOMEM;
        for (size_t v = 0, k = 0; v < b->mesh.nv && r == VG_OK; v++)
            if (marked[v]) (*vertices)[k++] = (uint32_t)v;
    }
    free(marked);
    return r;
}

int vg_look_find(const vg_body *b, const char *what, uint32_t **vertices, size_t *n, vg_err *e)
{
    size_t number;
    uint32_t v;
    *vertices = NULL;
    *n = 0;
    if (is_number(what, &number)) {
        if (number >= b->mesh.nv) return vg_fail(e, VG_EARG, "there is no vertex %.40s: it has %zu", what, b->mesh.nv);
        return one_vertex((uint32_t)number, vertices, n, e);
    }
    if (b->mesh.nv && find_joint(b, what, &v)) return one_vertex(v, vertices, n, e);
    int r = find_part(b, what, vertices, n, e);
    if (r == VG_OK && !*n)
        return vg_fail(e, VG_EARG, "there is no joint, object, group or material '%.200s'", what);
    return r;
}

int vg_sheet_look_at(vg_sheet *s, size_t i, const uint32_t *vertices, size_t n, vg_err *e)
{
    vgi_row *q = s->at + i;
    if (i >= s->nsequences || !n) return vg_fail(e, VG_EARG, "sequence %zu has nothing to look at", i);
    for (size_t k = 0; k < n; k++)
        if (vertices[k] >= q->head->body.mesh.nv) return vg_fail(e, VG_EARG, "there is no vertex %u", vertices[k]);
    free(q->look);
    q->look = vgi_copy_array(vertices, n, sizeof *vertices, e);
    q->nlook = q->look ? n : 0;
    return q->look ? VG_OK : VG_ENOMEM;
}
