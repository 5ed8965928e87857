/* payload.c: what is in each kind of record, both directions side by side (fmt/STREAM.md, section 3).
 * Leaves out skeletons, rigs, patches and maps (payload_rig.c), numbers of vertices (payload_scal.c), record headers
 * and checksums (record.c) and the order of records (stream.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/cursor.h"

#include <math.h>
#include <stdlib.h>

/* ---- PROV ---- */

static int decode_arguments(cursor *c, vg_provenance *v, uint32_t nargs, const vgi_payload *p, vg_err *e)
{
    int r = VG_OK;
    size_t cap = 0;
    v->program = take_text(c, take32(c), p, &r, e);
    if (v->program) v->version = take_text(c, take32(c), p, &r, e);
    while (r == VG_OK && v->nargs < nargs) {
        if ((r = vgi_grow(&v->args, &cap, v->nargs + 1, sizeof *v->args, e)) < 0) break;
        char *text = take_text(c, take32(c), p, &r, e);
        if (text) v->args[v->nargs++] = text;
    }
    return r;
}

int vgi_prov_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    size_t cap = h->nprovenance;
    int r = vgi_grow(&h->provenance, &cap, h->nprovenance + 1, sizeof *h->provenance, e);
    if (r < 0) return r;
    /* counted at once, so that clearing h frees it in any case */
    vg_provenance *v = &h->provenance[h->nprovenance++];
    *v = (vg_provenance){0};
    cursor c = start(p);
    uint32_t nparents = take32(&c), nargs = take32(&c);
    const unsigned char *parents = take_array(&c, nparents, 4);
    if (c.bad) return wrong(p, "it is shorter than its counts say", e);
    v->parents = vgi_array_raw(nparents, sizeof *v->parents, e);
    if (!v->parents) return VG_ENOMEM;
    copy32(v->parents, parents, nparents);
    v->nparents = nparents;
    for (size_t i = 0; i < nparents; i++)
        if (v->parents[i] >= h->nprovenance - 1) return wrong(p, "it names a parent that does not come before it", e);
    if ((r = decode_arguments(&c, v, nargs, p, e)) < 0) return r;
    return left(&c) ? wrong(p, "bytes are left over", e) : VG_OK;
}

int vgi_prov_encode(vg_bytes *b, const vg_provenance *v, vg_err *e)
{
    int r = put32(b, (uint32_t)v->nparents, e);
    if (r == VG_OK) r = put32(b, (uint32_t)v->nargs, e);
    if (r == VG_OK) r = vgi_indices_encode(b, v->parents, v->nparents, e);
    if (r == VG_OK) r = put_string(b, v->program, e);
    if (r == VG_OK) r = put_string(b, v->version, e);
    for (size_t i = 0; r == VG_OK && i < v->nargs; i++) r = put_string(b, v->args[i], e);
    return r;
}

/* ---- MESH ---- */

int vgi_mesh_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    uint64_t nv = take64(&c), nf = take64(&c), corners = 0;
    const unsigned char *sizes = take_array(&c, nf, 4);
    if (c.bad) return wrong(p, "it is shorter than its counts say", e);
    if (nv >= UINT32_MAX || nf >= UINT32_MAX) return wrong(p, "more than 2^32 - 2 vertices or faces", e);
    vg_mesh *m = &h->body.mesh;
    m->start = vgi_array_raw((size_t)nf + 1, sizeof *m->start, e);
    if (!m->start) return VG_ENOMEM;
    m->start[0] = 0;
    for (size_t f = 0; f < nf; f++) {
        corners += vgi_get32(sizes + 4 * f);
        if (corners >= UINT32_MAX) return wrong(p, "more than 2^32 - 2 corners", e);
        m->start[f + 1] = (uint32_t)corners;
    }
    const unsigned char *vert = take_array(&c, corners, 4);
    if (c.bad || left(&c)) return wrong(p, "its length and its counts do not agree", e);
    m->vert = vgi_array_raw((size_t)corners, sizeof *m->vert, e);
    if (!m->vert) return VG_ENOMEM;
    copy32(m->vert, vert, (size_t)corners);
    m->nv = (size_t)nv, m->nf = (size_t)nf;
    return vg_mesh_check(m, p->where, e);
}

int vgi_mesh_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    const vg_mesh *m = &h->body.mesh;
    int r = put64(b, m->nv, e);
    if (r == VG_OK) r = put64(b, m->nf, e);
    if (r == VG_OK) r = vgi_bytes_reserve(b, b->size + 4 * (m->nf + vg_mesh_corners(m)), e);
    for (size_t f = 0; r == VG_OK && f < m->nf; f++) r = put32(b, m->start[f + 1] - m->start[f], e);
    return r < 0 ? r : vgi_indices_encode(b, m->vert, vg_mesh_corners(m), e);
}

/* ---- TEXC, LABL ---- */

int vgi_texc_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    vg_attributes *a = &h->body.attributes;
    size_t corners = vg_mesh_corners(&h->body.mesh);
    uint32_t dim = take32(&c), zero = take32(&c);
    uint64_t nt = take64(&c);
    if (c.bad || dim < 1 || dim > 3 || zero) return wrong(p, "a texture coordinate must have 1 to 3 numbers", e);
    const unsigned char *tex = take_array(&c, nt, 8 * (size_t)dim), *corner = take_array(&c, corners, 4);
    if (c.bad || left(&c)) return wrong(p, "its length and its counts do not agree", e);
    a->tex = vgi_array_raw((size_t)nt * dim, sizeof *a->tex, e);
    a->corner_tex = vgi_array_raw(corners, sizeof *a->corner_tex, e);
    if (!a->tex || !a->corner_tex) return VG_ENOMEM;
    a->tex_dim = dim;
    copy_doubles(a->tex, tex, (size_t)nt * dim);
    copy32(a->corner_tex, corner, corners);
    a->ntex = (size_t)nt;
    if (!vgi_finite(a->tex, a->ntex * dim)) return wrong(p, "a number is not finite", e);
    for (size_t i = 0; i < corners; i++)
        if (a->corner_tex[i] >= nt && a->corner_tex[i] != UINT32_MAX)
            return wrong(p, "a corner names a texture coordinate that is not there", e);
    return VG_OK;
}

int vgi_texc_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    const vg_attributes *a = &h->body.attributes;
    int r = put32(b, a->tex_dim, e);
    if (r == VG_OK) r = put32(b, 0, e);
    if (r == VG_OK) r = put64(b, a->ntex, e);
    if (r == VG_OK) r = put_doubles(b, a->tex, a->ntex * a->tex_dim, e);
    return r < 0 ? r : vgi_indices_encode(b, a->corner_tex, vg_mesh_corners(&h->body.mesh), e);
}

int vgi_labl_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    vg_attributes *a = &h->body.attributes;
    size_t cap = 0;
    int r = VG_OK;
    while (r == VG_OK && left(&c)) {
        uint64_t face = take64(&c);
        uint32_t kind = take32(&c), n = take32(&c);
        if (c.bad) return wrong(p, "it ends inside a label", e);
        if (face > h->body.mesh.nf || (a->nlabels && face < a->labels[a->nlabels - 1].face))
            return wrong(p, "labels are not in the order of their faces", e);
        if (kind < VG_LABEL_OBJECT || kind > VG_LABEL_LIBRARY) return wrong(p, "a label is of unknown kind", e);
        char *text = take_text(&c, n, p, &r, e);
        if (!text) return r;
        r = vgi_grow(&a->labels, &cap, a->nlabels + 1, sizeof *a->labels, e);
        if (r < 0) free(text);
        else a->labels[a->nlabels++] = (vg_label){.face = face, .kind = kind, .text = text};
        if (r == VG_OK && !take_padding(&c, -n & 7)) return wrong(p, "padding is missing or not zero", e);
    }
    return r;
}

int vgi_labl_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    const vg_attributes *a = &h->body.attributes;
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < a->nlabels; i++) {
        r = put64(b, a->labels[i].face, e);
        if (r == VG_OK) r = put32(b, a->labels[i].kind, e);
        if (r == VG_OK) r = put_string(b, a->labels[i].text, e);
        if (r == VG_OK) r = put_padding(b, 0, e);
    }
    return r;
}

/* ---- SELE, LINK, ANCH: lists of indices ---- */

static int decode_indices(const vgi_payload *p, size_t multiple, uint32_t **list, size_t *n, vg_err *e)
{
    if (p->size % (4 * multiple)) return wrong(p, "its length is no whole number of entries", e);
    *list = vgi_array_raw(p->size / 4, sizeof **list, e);
    if (!*list) return VG_ENOMEM;
    copy32(*list, p->data, p->size / 4);
    *n = p->size / 4 / multiple;
    return VG_OK;
}

int vgi_sele_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    h->has_selection = true;
    int r = decode_indices(p, 1, &h->selected, &h->nselected, e);
    return r < 0 ? r : check_ascending(p, h->selected, h->nselected, h->body.mesh.nf, e);
}

int vgi_anch_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    int r = decode_indices(p, 1, &h->anchors, &h->nanchors, e);
    return r < 0 ? r : check_ascending(p, h->anchors, h->nanchors, h->body.mesh.nv, e);
}

int vgi_link_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    h->has_links = true;
    int r = decode_indices(p, 2, &h->links, &h->nlinks, e);
    for (size_t i = 0; r == VG_OK && i < h->nlinks; i++) {
        uint32_t a = h->links[2 * i], b = h->links[2 * i + 1];
        if (a >= h->body.mesh.nv || b >= h->body.mesh.nv) return wrong(p, "an index is out of range", e);
        if (a == b) return wrong(p, "a link joins a vertex to itself", e);
    }
    return r;
}

int vgi_indices_encode(vg_bytes *b, const uint32_t *x, size_t n, vg_err *e)
{
    int r = vgi_bytes_reserve(b, b->size + 4 * n, e);
    if (r < 0) return r;
    for (size_t i = 0; i < n; i++) vgi_put32(b->data + b->size + 4 * i, x[i]);
    b->size += 4 * n;
    return VG_OK;
}

int vgi_sele_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    return vgi_indices_encode(b, h->selected, h->nselected, e);
}

int vgi_link_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    return vgi_indices_encode(b, h->links, 2 * h->nlinks, e);
}

int vgi_anch_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    return vgi_indices_encode(b, h->anchors, h->nanchors, e);
}

/* ---- REFP, FORM ---- */

int vgi_refp_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    int r = VG_OK;
    uint32_t n = take32(&c), zero = take32(&c);
    if (c.bad || zero) return wrong(p, "it is too short, or reserved bytes are not zero", e);
    if (!(h->body.reference_name = take_text(&c, n, p, &r, e))) return r;
    if (!take_padding(&c, -n & 7)) return wrong(p, "padding is missing or not zero", e);
    const unsigned char *xyz = take_array(&c, 3 * (uint64_t)h->body.mesh.nv, 8);
    if (c.bad || left(&c)) return wrong(p, "its length does not fit the number of vertices", e);
    h->body.reference = vgi_array_raw(3 * h->body.mesh.nv, sizeof *h->body.reference, e);
    if (!h->body.reference) return VG_ENOMEM;
    copy_doubles(h->body.reference, xyz, 3 * h->body.mesh.nv);
    return vgi_finite(h->body.reference, 3 * h->body.mesh.nv) ? VG_OK : wrong(p, "a position is not finite", e);
}

int vgi_refp_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    const char *name = h->body.reference_name ? h->body.reference_name : "";
    if (!vgi_finite(h->body.reference, 3 * h->body.mesh.nv))
        return vg_fail(e, VG_EINPUT, "the reference pose holds a number that is not finite");
    int r = put32(b, (uint32_t)strlen(name), e);
    if (r == VG_OK) r = put32(b, 0, e);
    if (r == VG_OK) r = vgi_bytes_append(b, name, strlen(name), e);
    if (r == VG_OK) r = put_padding(b, 0, e);
    return r < 0 ? r : put_doubles(b, h->body.reference, 3 * h->body.mesh.nv, e);
}

/* Elements that a frame of this kind must have on h's mesh, selection and links. */
static size_t graph_count(const vg_head *h, vg_kind kind)
{
    const vg_mesh *m = &h->body.mesh;
    if (kind == VG_VERTICES) return m->nv;
    if (!h->has_selection) return vg_mesh_corners(m) + 2 * h->nlinks;
    size_t corners = 2 * h->nlinks;
    for (size_t i = 0; i < h->nselected; i++) corners += m->start[h->selected[i] + 1] - m->start[h->selected[i]];
    return corners;
}

/* Why frames of h->count elements do not go with what stands before them; NULL: they do. */
static const char *refuse_form(const vg_head *h)
{
    if (h->map.ncorners && h->map.ncorners != graph_count(h, VG_VECTORS))
        return "the corners of record MAP do not fit the mesh";
    if (h->map.n && h->map.kind == VG_MAP_PATCHES && h->map.n != h->body.patches.n)
        return "record MAP has not as many patches as record PTCH";
    if (h->kind == VG_TRANSFORMS) return NULL;
    if (!h->body.reference) return "a MESH and a REFP record must come before it";
    if (h->kind != VG_VERTICES && !h->has_links) return "a LINK record must come before it";
    return h->count != graph_count(h, h->kind) ? "its count does not fit the mesh" : NULL;
}

int vgi_form_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    uint32_t kind = take32(&c), precision = take32(&c);
    uint64_t count = take64(&c);
    if (c.bad || left(&c)) return wrong(p, "it has a wrong length", e);
    if (kind < VG_VERTICES || kind > VG_TRANSFORMS) return wrong(p, "frames are of unknown kind", e);
    if (precision != VG_F32 && precision != VG_F64) return wrong(p, "numbers are of unknown precision", e);
    h->kind = (vg_kind)kind, h->precision = (vg_precision)precision, h->count = (size_t)count;
    const char *why = refuse_form(h);
    return why ? wrong(p, why, e) : VG_OK;
}

int vgi_form_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    const char *why = refuse_form(h);
    if (why) return vg_fail(e, VG_EINPUT, "record FORM cannot be written: %s", why);
    int r = put32(b, h->kind, e);
    if (r == VG_OK) r = put32(b, h->precision, e);
    return r < 0 ? r : put64(b, h->count, e);
}

/* ---- CORR ---- */

static int check_pairs(const vgi_payload *p, const vg_correspondence *c, vg_err *e)
{
    if (!vgi_finite(c->distance, c->target_nf)) return wrong(p, "a distance or mark is out of range", e);
    for (size_t f = 0; f < c->target_nf; f++) {
        double sum = 0;
        if (c->first[f] >= c->first[f + 1]) return wrong(p, "a target face is driven by none", e);
        for (uint32_t i = c->first[f]; i < c->first[f + 1]; i++) {
            if (c->source[i] >= c->source_nf) return wrong(p, "a source face is out of range", e);
            if (!(c->weight[i] > 0)) return wrong(p, "a weight is not positive", e);
            sum += c->weight[i];
        }
        if (!(sum > 1 - 1e-9 && sum < 1 + 1e-9)) return wrong(p, "the weights of a face do not sum to 1", e);
        if (!(c->distance[f] >= 0 && c->distance[f] < INFINITY) || c->matched[f] > 1)
            return wrong(p, "a distance or mark is out of range", e);
    }
    return VG_OK;
}

int vgi_corr_decode(const vgi_payload *p, vg_head *h, vg_err *e)
{
    cursor c = start(p);
    vg_correspondence *k = &h->correspondence;
    k->source_nv = (size_t)take64(&c), k->source_nf = (size_t)take64(&c), k->source_digest = take64(&c);
    k->target_nv = (size_t)take64(&c), k->target_nf = (size_t)take64(&c), k->target_digest = take64(&c);
    uint64_t pairs = take64(&c);
    if (c.bad || k->target_nf >= UINT32_MAX || pairs >= UINT32_MAX) return wrong(p, "its counts are out of range", e);
    const unsigned char *first = take_array(&c, (uint64_t)k->target_nf + 1, 4), *source = take_array(&c, pairs, 4);
    if (c.bad || !take_padding(&c, -(4 * (k->target_nf + 1 + pairs)) & 7))
        return wrong(p, "its length and counts do not agree", e);
    const unsigned char *weight = take_array(&c, pairs, 8), *distance = take_array(&c, k->target_nf, 8);
    const unsigned char *matched = take_array(&c, k->target_nf, 1);
    if (c.bad || !take_padding(&c, -k->target_nf & 7) || left(&c))
        return wrong(p, "its length and counts do not agree", e);
    size_t nf = k->target_nf, n = (size_t)pairs;
    k->first = vgi_array_raw(nf + 1, sizeof *k->first, e), k->source = vgi_array_raw(n, sizeof *k->source, e);
    k->weight = vgi_array_raw(n, sizeof *k->weight, e), k->distance = vgi_array_raw(nf, sizeof *k->distance, e);
    k->matched = vgi_copy_array(matched, nf, 1, e);
    if (!k->first || !k->source || !k->weight || !k->distance || !k->matched) return VG_ENOMEM;
    copy32(k->first, first, nf + 1);
    copy32(k->source, source, n);
    copy_doubles(k->weight, weight, n);
    copy_doubles(k->distance, distance, nf);
    for (size_t f = 0; f < nf; f++)
        if (k->first[f] > k->first[f + 1]) return wrong(p, "its lists of pairs are not in order", e);
    if (k->first[0] != 0 || k->first[nf] != n) return wrong(p, "its lists of pairs are not in order", e);
    return check_pairs(p, k, e);
}

int vgi_corr_encode(vg_bytes *b, const vg_head *h, vg_err *e)
{
    const vg_correspondence *c = &h->correspondence;
    size_t pairs = c->first[c->target_nf];
    const uint64_t head[7] = {c->source_nv,     c->source_nf, c->source_digest, c->target_nv, c->target_nf,
                              c->target_digest, pairs};
    int r = VG_OK;
    for (int i = 0; r == VG_OK && i < 7; i++) r = put64(b, head[i], e);
    if (r == VG_OK) r = vgi_indices_encode(b, c->first, c->target_nf + 1, e);
    if (r == VG_OK) r = vgi_indices_encode(b, c->source, pairs, e);
    if (r == VG_OK) r = put_padding(b, 0, e);
    if (r == VG_OK) r = put_doubles(b, c->weight, pairs, e);
    if (r == VG_OK) r = put_doubles(b, c->distance, c->target_nf, e);
    if (r == VG_OK) r = vgi_bytes_append(b, c->matched, c->target_nf, e);
    return r < 0 ? r : put_padding(b, 0, e);
}

/* ---- FRAM ---- */

enum { HAS_TIME = 1u, HAS_PINS = 2u, HAS_TURNS = 4u };

static bool on_graph(const vg_head *h)
{
    return h->kind == VG_VECTORS || h->kind == VG_DEFORMATIONS;
}

static int take_pins(cursor *c, vg_frame *f, const vg_head *h, const vgi_payload *p, vg_err *e)
{
    uint32_t n = take32(c), zero = take32(c);
    const unsigned char *pins = take_array(c, n, 4);
    if (c->bad || zero || n == 0 || !take_padding(c, n % 2 * 4))
        return wrong(p, "its list of pins is cut or malformed", e);
    int r = vgi_grow(&f->pins, &f->pins_cap, n, sizeof *f->pins, e);
    if (r < 0) return r;
    copy32(f->pins, pins, n);
    f->npins = n;
    return check_ascending(p, f->pins, n, h->body.mesh.nv, e);
}

/* Are these the vertices of a skeleton, whose joints can say how they have turned? */
static bool may_turn(const vg_head *h)
{
    return h->kind == VG_VERTICES && h->body.skeleton.njoints > 0;
}

static int take_turns(cursor *c, vg_frame *f, size_t njoints, const vgi_payload *p, vg_err *e)
{
    const unsigned char *turns = take_array(c, njoints, 32);
    if (c->bad) return wrong(p, "it ends before its turns", e);
    int r = vgi_grow(&f->turns, &f->turns_cap, 4 * njoints, sizeof *f->turns, e);
    if (r < 0) return r;
    copy_doubles(f->turns, turns, 4 * njoints);
    f->nturns = njoints;
    return are_turns(f->turns, njoints) ? VG_OK : wrong(p, "a turn is no unit quaternion", e);
}

/* Deformations and transforms start with a quaternion. */
static bool has_zero_quaternion(const vg_head *h, const double *values)
{
    size_t width = vg_kind_width(h->kind);
    for (size_t i = 0; width > 3 && i < h->count; i++) {
        const double *q = values + i * width;
        bool zero = h->precision == VG_F64
                        ? q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0
                        : (float)q[0] == 0 && (float)q[1] == 0 && (float)q[2] == 0 && (float)q[3] == 0;
        if (zero) return true;
    }
    return false;
}

static int take_values(cursor *c, vg_frame *f, const vg_head *h, const vgi_payload *p, vg_err *e)
{
    size_t n, width = vg_kind_width(h->kind);
    if (!vgi_mul(h->count, width, &n)) return wrong(p, "its length does not fit the count of FORM", e);
    const unsigned char *data = take_array(c, n, h->precision);
    if (c->bad || left(c)) return wrong(p, "its length does not fit the count of FORM", e);
    if (h->precision == VG_F64 && NATIVE && (uintptr_t)data % _Alignof(double) == 0) {
        f->values = (double *)(uintptr_t)data;
    } else {
        int r = vgi_grow(&f->values_own, &f->values_cap, n, sizeof *f->values, e);
        if (r < 0) return r;
        f->values = f->values_own;
        if (h->precision == VG_F64) copy_doubles(f->values, data, n);
        else copy_floats(f->values, data, n);
    }
    return VG_OK;
}

int vgi_fram_decode(vg_frame *f, const vg_head *h, const char *where, vg_err *e)
{
    vgi_payload p = {f->raw.data, f->raw.size, where};
    cursor c = start(&p);
    uint32_t n = take32(&c), flags = take32(&c);
    double time = take_double(&c);
    if (c.bad || (flags & ~(HAS_TIME | HAS_PINS | HAS_TURNS)) || (flags & HAS_PINS && h->kind != VG_VECTORS) ||
        (flags & HAS_TURNS && !may_turn(h)))
        return wrong(&p, "it is too short, or unknown flags are set", e);
    if (!vgi_finite(&time, 1) || (!(flags & HAS_TIME) && time != 0))
        return wrong(&p, "its time is not finite, or set without its flag", e);
    const char *name = (const char *)take(&c, n);
    if (!name || !vgi_is_utf8(name, n)) return wrong(&p, "its name is longer than the record, or no UTF-8", e);
    int r = vgi_grow(&f->name, &f->name_cap, (size_t)n + 1, 1, e);
    if (r < 0) return r;
    memcpy(f->name, name, n);
    f->name[n] = 0;
    f->has_time = flags & HAS_TIME, f->time = time, f->npins = 0, f->nturns = 0;
    if (!take_padding(&c, -n & 7)) return wrong(&p, "padding is missing or not zero", e);
    if (on_graph(h)) {
        const unsigned char *root = take(&c, 24), *anchors = take_array(&c, h->nanchors, 24);
        if (c.bad) return wrong(&p, "it ends before its root and anchors", e);
        if ((r = vgi_grow(&f->anchors, &f->anchors_cap, 3 * h->nanchors, sizeof *f->anchors, e)) < 0) return r;
        copy_doubles(f->root, root, 3);
        copy_doubles(f->anchors, anchors, 3 * h->nanchors);
        if (!vgi_finite(f->root, 3) || !vgi_finite(f->anchors, 3 * h->nanchors))
            return wrong(&p, "its root or an anchor is not finite", e);
    }
    if (flags & HAS_PINS && (r = take_pins(&c, f, h, &p, e)) < 0) return r;
    if (flags & HAS_TURNS && (r = take_turns(&c, f, h->body.skeleton.njoints, &p, e)) < 0) return r;
    if ((r = take_values(&c, f, h, &p, e)) < 0) return r;
    if (!vgi_finite(f->values, h->count * vg_kind_width(h->kind))) return wrong(&p, "a value is not finite", e);
    return has_zero_quaternion(h, f->values) ? wrong(&p, "a quaternion is zero", e) : VG_OK;
}

/* Turns of other joints than the head's are those of a skeleton that was replaced: they are left out. */
static bool has_turns(const vg_head *h, const vg_frame *f)
{
    return may_turn(h) && f->nturns == h->body.skeleton.njoints;
}

/* What a reader would refuse is not written. The values' own finiteness is vg_writer_put's to check. */
static int check_frame(const vg_head *h, const vg_frame *f, vg_err *e)
{
    const char *name = f->name ? f->name : "";
    bool finite = !f->has_time || vgi_finite(&f->time, 1);
    if (on_graph(h)) finite = finite && vgi_finite(f->root, 3) && vgi_finite(f->anchors, 3 * h->nanchors);
    if (!finite) return vg_fail(e, VG_EINPUT, "frame '%s' has a time, root or anchor that is not finite", name);
    if (has_zero_quaternion(h, f->values))
        return vg_fail(e, VG_EINPUT, "frame '%s' shrinks something to nothing: a quaternion is zero", name);
    if (has_turns(h, f) && !are_turns(f->turns, f->nturns))
        return vg_fail(e, VG_EINPUT, "frame '%s' has a joint whose turn is no unit quaternion", name);
    return VG_OK;
}

int vgi_fram_encode(vg_bytes *b, const vg_head *h, const vg_frame *f, vg_err *e)
{
    const char *name = f->name ? f->name : "";
    double time = f->has_time ? f->time : 0;
    int r = check_frame(h, f, e);
    if (r == VG_OK) r = put32(b, (uint32_t)strlen(name), e);
    bool pins = h->kind == VG_VECTORS && f->npins > 0, turns = has_turns(h, f);
    if (r == VG_OK)
        r = put32(b, (f->has_time ? HAS_TIME : 0u) | (pins ? HAS_PINS : 0u) | (turns ? HAS_TURNS : 0u), e);
    if (r == VG_OK) r = put_doubles(b, &time, 1, e);
    if (r == VG_OK) r = vgi_bytes_append(b, name, strlen(name), e);
    if (r == VG_OK) r = put_padding(b, 0, e);
    if (r == VG_OK && on_graph(h)) {
        r = put_doubles(b, f->root, 3, e);
        if (r == VG_OK) r = put_doubles(b, f->anchors, 3 * h->nanchors, e);
    }
    if (r == VG_OK && pins) {
        r = put32(b, (uint32_t)f->npins, e);
        if (r == VG_OK) r = put32(b, 0, e);
        if (r == VG_OK) r = vgi_indices_encode(b, f->pins, f->npins, e);
        if (r == VG_OK) r = put_padding(b, 0, e);
    }
    if (r == VG_OK && turns) r = put_doubles(b, f->turns, 4 * f->nturns, e);
    return r;
}

int vgi_values_encode(vg_bytes *b, const double *x, size_t n, vg_precision precision, const void **data,
                      size_t *bytes, vg_err *e)
{
    *bytes = n * (size_t)precision;
    *data = x;
    if (precision == VG_F64 && NATIVE) return VG_OK;
    b->size = 0;
    int r = vgi_bytes_reserve(b, *bytes, e);
    if (r < 0) return r;
    *data = b->data;
    if (precision == VG_F64) return put_doubles(b, x, n, e);
    for (size_t i = 0; i < n; i++) {
        float y = (float)x[i];
        if (!(y - y == 0)) return vg_fail(e, VG_EINPUT, "%g does not fit into binary32: write binary64", x[i]);
        vgi_put32(b->data + 4 * i, vgi_float_bits(y));
    }
    return VG_OK;
}

/* ---- FAIL ---- */

int vgi_fail_decode(vg_failure *f, const vgi_payload *p, const char *stream, vg_err *e)
{
    cursor c = start(p);
    int r = VG_OK;
    f->status = take32(&c);
    f->program = take_text(&c, take32(&c), p, &r, e);
    f->message = f->program ? take_text(&c, take32(&c), p, &r, e) : NULL;
    if (f->message && left(&c)) r = wrong(p, "bytes are left over", e);
    else if (f->message)
        return vg_fail(e, VG_ETRUNC, "'%s' was cut short: %s failed with status %u: %s", stream, f->program,
                       f->status, f->message);
    vgi_failure_clear(f);
    return r;
}

void vgi_failure_clear(vg_failure *f)
{
    free(f->program);
    free(f->message);
    *f = (vg_failure){0};
}

int vgi_fail_encode(vg_bytes *b, const char *program, int status, const char *message, vg_err *e)
{
    int r = put32(b, (uint32_t)status, e);
    if (r == VG_OK) r = put_string(b, program, e);
    return r < 0 ? r : put_string(b, message, e);
}
