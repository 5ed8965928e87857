/* form.c: the table of the forms of frames, and of the elements that values belong to. A new form is one line in the
 * table and one number in vg_kind; its meaning is up to the programs that use it.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/form.h"

static const char *const element_names[VG_ELEMENTS] = {
    [VG_OF_UNKNOWN] = "unknown", [VG_OF_VERTEX] = "vertex", [VG_OF_CORNER] = "corner", [VG_OF_JOINT] = "joint",
    [VG_OF_TRANSFORM] = "transform", [VG_OF_ANCHOR] = "anchor", [VG_OF_FRAME] = "frame",
    [VG_OF_COMPONENT] = "component", [VG_OF_LIST] = "vertex list"};

static const struct {
    const char *name;
    vg_element element;
    size_t width; /* 0: any */
} forms[VG_KINDS] = {
    [VG_OTHER] = {"unknown", VG_OF_UNKNOWN, 0},
    [VG_VERTICES] = {"vertices", VG_OF_VERTEX, 3},
    [VG_VECTORS] = {"vectors", VG_OF_CORNER, 3},
    [VG_DEFORMATIONS] = {"deformations", VG_OF_CORNER, 4},
    [VG_TRANSFORMS] = {"transforms", VG_OF_TRANSFORM, 7},
    [VG_FEATURES] = {"features", VG_OF_VERTEX, 0},
    [VG_COORDINATES] = {"coordinates", VG_OF_FRAME, 0}};

static vg_kind is_known(vg_kind k)
{
    return (unsigned)k < VG_KINDS ? k : VG_OTHER;
}

const char *vg_element_name(vg_element e)
{
    return element_names[(unsigned)e < VG_ELEMENTS ? e : VG_OF_UNKNOWN];
}

vg_element vgi_element_find(const char *name)
{
    for (int i = VG_OF_UNKNOWN + 1; i < VG_ELEMENTS; i++)
        if (!strcmp(name, element_names[i])) return (vg_element)i;
    return VG_OF_UNKNOWN;
}

vg_kind vgi_form_find(const char *name)
{
    for (int i = VG_OTHER + 1; i < VG_KINDS; i++)
        if (!strcmp(name, forms[i].name)) return (vg_kind)i;
    return VG_OTHER;
}

size_t vg_kind_width(vg_kind k)
{
    return forms[is_known(k)].width;
}

const char *vg_kind_name(vg_kind k)
{
    return forms[is_known(k)].name;
}

vg_element vg_kind_element(vg_kind k)
{
    return forms[is_known(k)].element;
}

size_t vg_head_width(const vg_head *h)
{
    size_t fixed = vg_kind_width(h->kind);
    return fixed ? fixed : h->width;
}

const char *vg_head_form(const vg_head *h)
{
    return h->kind == VG_OTHER && h->form ? h->form : vg_kind_name(h->kind);
}

vg_element vg_head_element(const vg_head *h)
{
    return h->kind == VG_OTHER && h->form_element ? vgi_element_find(h->form_element) : vg_kind_element(h->kind);
}

static size_t graph_corners(const vg_head *h)
{
    const vg_mesh *m = &h->body.mesh;
    size_t corners = 2 * h->links.n;
    if (!h->selection.chosen) return corners + vg_mesh_corners(m);
    for (size_t i = 0; i < h->selection.n; i++) corners += m->start[h->selection.faces[i] + 1] - m->start[h->selection.faces[i]];
    return corners;
}

size_t vg_head_elements(const vg_head *h, vg_element e)
{
    switch (e) {
    case VG_OF_VERTEX: return h->body.mesh.nv;
    case VG_OF_CORNER: return graph_corners(h);
    case VG_OF_JOINT: return h->body.skeleton.njoints;
    case VG_OF_ANCHOR: return h->nanchors;
    case VG_OF_FRAME: return 1;
    case VG_OF_TRANSFORM: return vg_head_element(h) == VG_OF_TRANSFORM ? h->count : SIZE_MAX;
    default: return SIZE_MAX;
    }
}

int vgi_form_copy(vg_head *to, const vg_head *from, vg_err *e)
{
    if (from->form && !(to->form = vgi_copy_string(from->form, strlen(from->form), e))) return VG_ENOMEM;
    if (!from->form_element) return VG_OK;
    to->form_element = vgi_copy_string(from->form_element, strlen(from->form_element), e);
    return to->form_element ? VG_OK : VG_ENOMEM;
}

vgi_form vgi_form_of(const vg_head *h)
{
    vgi_form f = {.kind = h->kind, .precision = h->precision, .width = vg_head_width(h), .count = h->count,
                  .on_corners = vg_head_element(h) == VG_OF_CORNER};
    for (int i = 0; i < VG_ELEMENTS; i++) f.elements[i] = vg_head_elements(h, (vg_element)i);
    return f;
}
