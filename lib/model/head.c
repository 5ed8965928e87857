/* head.c: the description of a sequence before its frames: allocation, copying, release. Frames are in frame.c, their
 * forms in form.c, files in io, computation in method.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/artefact.h"
#include "model/form.h"

#include <assert.h>
#include <stdlib.h>

/* ---- loops over the table of records ---- */

static void clear_parts(void *of, const int *entries, size_t n)
{
    for (size_t i = 0; i < n; i++) vgi_fields_clear(&vgi_artefacts[entries[i]], of);
}

/* *to is zeroed first, and stays zero on failure. */
static int copy_parts(void *to, const void *from, size_t size, const int *entries, size_t n, const vg_mesh *mesh,
                      vg_err *e)
{
    memset(to, 0, size);
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < n; i++) r = vgi_fields_copy(&vgi_artefacts[entries[i]], to, from, mesh, e);
    if (r < 0) clear_parts(to, entries, n), memset(to, 0, size);
    return r;
}

void vg_mesh_take(vg_mesh *to, vg_mesh *from)
{
    vgi_fields_move(&vgi_artefacts[VGI_MESH], to, from);
}

static const int attributes_parts[] = {VGI_TEXC, VGI_LABL, VGI_COLV}, rig_parts[] = {VGI_RIG, VGI_SKIN};

void vg_attributes_clear(vg_attributes *a)
{
    clear_parts(a, attributes_parts, 3);
}

void vg_asset_clear(vg_asset *a)
{
    vgi_fields_clear(&vgi_artefacts[VGI_ASST], a);
}

int vg_attributes_copy(vg_attributes *to, const vg_attributes *from, const vg_mesh *mesh, vg_err *e)
{
    return copy_parts(to, from, sizeof *to, attributes_parts, 3, mesh, e);
}

void vg_skeleton_clear(vg_skeleton *s)
{
    vgi_fields_clear(&vgi_artefacts[VGI_SKEL], s);
}

int vg_skeleton_copy(vg_skeleton *to, const vg_skeleton *from, vg_err *e)
{
    return vgi_fields_copy(&vgi_artefacts[VGI_SKEL], to, from, NULL, e);
}

void vg_correspondence_clear(vg_correspondence *c)
{
    vgi_fields_clear(&vgi_artefacts[VGI_CORR], c);
}

int vg_correspondence_copy(vg_correspondence *to, const vg_correspondence *from, vg_err *e)
{
    return vgi_fields_copy(&vgi_artefacts[VGI_CORR], to, from, NULL, e);
}

void vg_patches_clear(vg_patches *p)
{
    vgi_fields_clear(&vgi_artefacts[VGI_PTCH], p);
}

int vg_patches_copy(vg_patches *to, const vg_patches *from, size_t nf, vg_err *e)
{
    vg_mesh counts = {.nf = nf};
    return vgi_fields_copy(&vgi_artefacts[VGI_PTCH], to, from, &counts, e);
}

void vg_rig_clear(vg_rig *r)
{
    clear_parts(r, rig_parts, 2);
}

int vg_rig_copy(vg_rig *to, const vg_rig *from, size_t nv, vg_err *e)
{
    vg_mesh counts = {.nv = nv};
    return copy_parts(to, from, sizeof *to, rig_parts, 2, &counts, e);
}

void vg_map_clear(vg_map *m)
{
    vgi_fields_clear(&vgi_artefacts[VGI_MAP], m);
}

int vg_map_copy(vg_map *to, const vg_map *from, vg_err *e)
{
    return vgi_fields_copy(&vgi_artefacts[VGI_MAP], to, from, NULL, e);
}

void vg_signal_clear(vg_signal *s)
{
    vgi_fields_clear(&vgi_artefacts[VGI_SIGN], s);
}

void vg_records_clear(vg_records *r)
{
    for (size_t i = 0; i < r->n; i++) vg_bytes_clear(&r->at[i].payload);
    free(r->at);
    *r = (vg_records){0};
}

static int copy_records(vg_records *to, const vg_records *from, vg_err *e)
{
    *to = (vg_records){0};
    if (from->n == 0) return VG_OK;
    if (!(to->at = vgi_array(from->n, sizeof *to->at, e))) return VG_ENOMEM;
    for (; to->n < from->n; to->n++) {
        vg_record *r = &to->at[to->n];
        *r = from->at[to->n];
        r->payload = (vg_bytes){0};
        if (vgi_bytes_append(&r->payload, from->at[to->n].payload.data, from->at[to->n].payload.size, e) < 0) {
            vg_records_clear(to);
            return VG_ENOMEM;
        }
    }
    return VG_OK;
}

/* ---- provenance ---- */

static void clear_provenance(vg_provenance *p)
{
    vgi_fields_clear(&vgi_artefacts[VGI_PROV], p);
}

/* A copy of s with '?' for bytes that are not valid UTF-8. */
static char *clean_string(const char *s, vg_err *e)
{
    size_t n = strlen(s);
    char *copy = vgi_copy_string(s, n, e);
    if (!copy || vgi_is_utf8(copy, n)) return copy;
    for (size_t i = 0; i < n;) {
        size_t length = 1;
        while (length < 4 && i + length <= n && !vgi_is_utf8(copy + i, length)) length++;
        if (i + length <= n && vgi_is_utf8(copy + i, length)) i += length;
        else copy[i++] = '?';
    }
    return copy;
}

static int fill_provenance(vg_provenance *p, const char *program, const char *version, size_t argc, char *const *argv,
                           size_t nparents, vg_err *e)
{
    *p = (vg_provenance){0};
    p->program = clean_string(program, e);
    p->version = clean_string(version, e);
    p->args = vgi_array(argc, sizeof *p->args, e);
    p->parents = vgi_array(nparents, sizeof *p->parents, e);
    bool ok = p->program && p->version && p->args && p->parents;
    for (; ok && p->nargs < argc; p->nargs++)
        if (!(p->args[p->nargs] = clean_string(argv[p->nargs], e))) ok = false;
    p->nparents = nparents;
    if (ok) return VG_OK;
    clear_provenance(p);
    return VG_ENOMEM;
}

static int append_provenance(vg_head *h, vg_provenance *p, vg_err *e)
{
    void *place;
    int r = vgi_artefact_append(&vgi_artefacts[VGI_PROV], h, &place, e);
    if (r < 0) clear_provenance(p);
    else memcpy(place, p, sizeof *p);
    return r;
}

/* The parents of the new process are the records that no later record names as a parent. */
int vg_head_trace(vg_head *h, const char *program, int argc, char *const *argv, vg_err *e)
{
    bool *has_child = vgi_array(h->nprovenance, sizeof *has_child, e);
    if (!has_child) return VG_ENOMEM;
    size_t ends = h->nprovenance;
    for (size_t i = 0; i < h->nprovenance; i++)
        for (size_t k = 0; k < h->provenance[i].nparents; k++) {
            bool *c = &has_child[h->provenance[i].parents[k]];
            if (!*c) ends--, *c = true;
        }
    vg_provenance p;
    int r = fill_provenance(&p, program, VG_VERSION, (size_t)argc, argv, ends, e);
    if (r == VG_OK) {
        size_t n = 0;
        for (size_t i = 0; i < h->nprovenance; i++)
            if (!has_child[i]) p.parents[n++] = (uint32_t)i;
        r = append_provenance(h, &p, e);
    }
    free(has_child);
    return r;
}

int vg_head_merge_trace(vg_head *h, const vg_head *other, vg_err *e)
{
    size_t base = h->nprovenance;
    for (size_t i = 0; i < other->nprovenance; i++) {
        vg_provenance p;
        int r = vgi_fields_copy(&vgi_artefacts[VGI_PROV], &p, &other->provenance[i], NULL, e);
        if (r < 0) return r;
        for (size_t k = 0; k < p.nparents; k++) p.parents[k] += (uint32_t)base;
        if ((r = append_provenance(h, &p, e)) < 0) return r;
    }
    return VG_OK;
}

/* ---- body ---- */

static void *in_body(const vgi_artefact *t, const vg_body *b)
{
    return (char *)(uintptr_t)b + t->at;
}

void vg_body_clear(vg_body *b)
{
    for (size_t i = 0; i < VGI_ARTEFACTS; i++)
        if (vgi_artefacts[i].in_body) vgi_fields_clear(&vgi_artefacts[i], in_body(&vgi_artefacts[i], b));
    *b = (vg_body){0};
}

int vg_body_copy(vg_body *to, const vg_body *from, vg_err *e)
{
    *to = (vg_body){0};
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < VGI_ARTEFACTS; i++) {
        const vgi_artefact *t = &vgi_artefacts[i];
        if (t->in_body) r = vgi_fields_copy(t, in_body(t, to), in_body(t, from), &from->mesh, e);
    }
    if (r == VG_OK && !to->reference_name && !(to->reference_name = vgi_copy_string("", 0, e))) r = VG_ENOMEM;
    if (r < 0) vg_body_clear(to);
    return r;
}

void vg_body_take(vg_body *to, vg_body *from)
{
    vg_body_clear(to);
    *to = *from;
    *from = (vg_body){0};
}

/* ---- head ---- */

void vg_head_clear(vg_head *h)
{
    vg_body_clear(&h->body);
    for (size_t i = 0; i < VGI_ARTEFACTS; i++) {
        const vgi_artefact *t = &vgi_artefacts[i];
        if (t->in_body) continue;
        size_t n = t->each ? vgi_artefact_count(t, h) : 1;
        for (size_t k = 0; k < n; k++) vgi_fields_clear(t, vgi_artefact_in(t, h, k));
    }
    free(h->provenance);
    free(h->form);
    free(h->form_element);
    vg_records_clear(&h->extra);
    *h = (vg_head){0};
}

int vg_head_copy(vg_head *to, const vg_head *from, vg_err *e)
{
    *to = (vg_head){.selection.chosen = from->selection.chosen, .links.chosen = from->links.chosen, .kind = from->kind,
                    .width = from->width, .precision = from->precision, .count = from->count};
    int r = vg_body_copy(&to->body, &from->body, e);
    if (r == VG_OK) r = vgi_form_copy(to, from, e);
    for (size_t i = 0; r == VG_OK && i < VGI_ARTEFACTS; i++) {
        const vgi_artefact *t = &vgi_artefacts[i];
        if (t->in_body || t->each) continue;
        r = vgi_fields_copy(t, vgi_artefact_in(t, to, 0), vgi_artefact_in(t, from, 0), &from->body.mesh, e);
    }
    if (r == VG_OK) r = vg_head_merge_trace(to, from, e);
    if (r == VG_OK) r = copy_records(&to->extra, &from->extra, e);
    if (r < 0) vg_head_clear(to);
    return r;
}

void vg_head_move(vg_head *to, vg_head *from)
{
    vg_head_clear(to);
    *to = *from;
    *from = (vg_head){0};
}

static bool *mark_of(const vgi_artefact *t, const vg_head *h)
{
    return (bool *)(uintptr_t)((const char *)h + t->mark_at);
}

/* what == NULL: any that has a name. */
static bool is_called(const vgi_artefact *t, const char *what)
{
    return t->name && (!what || !strcmp(t->name, what));
}

void vg_head_take(vg_head *to, vg_head *from, const char *what)
{
    for (size_t i = 0; i < VGI_ARTEFACTS; i++) {
        const vgi_artefact *t = &vgi_artefacts[i];
        if (!is_called(t, what)) continue;
        vgi_fields_move(t, vgi_artefact_in(t, to, 0), vgi_artefact_in(t, from, 0));
        if (t->marks) *mark_of(t, to) = *mark_of(t, from), *mark_of(t, from) = false;
    }
}

/* Records that share a name, such as RIG and SKIN, have their fields in one struct. */
void vg_head_put(vg_head *to, void *from, const char *what)
{
    for (size_t i = 0; i < VGI_ARTEFACTS; i++) {
        const vgi_artefact *t = &vgi_artefacts[i];
        if (!is_called(t, what)) continue;
        assert(t->size);
        vgi_fields_move(t, vgi_artefact_in(t, to, 0), from);
    }
}

void vg_head_take_out(void *to, vg_head *from, const char *what)
{
    const vgi_artefact *first = vgi_artefact_by_name(what);
    assert(first && first->size);
    memset(to, 0, first->size);
    for (size_t i = 0; i < VGI_ARTEFACTS; i++)
        if (is_called(&vgi_artefacts[i], what))
            vgi_fields_move(&vgi_artefacts[i], to, vgi_artefact_in(&vgi_artefacts[i], from, 0));
}

void vg_head_drop(vg_head *h, const char *what)
{
    for (size_t i = 0; i < VGI_ARTEFACTS; i++) {
        const vgi_artefact *t = &vgi_artefacts[i];
        if (!is_called(t, what)) continue;
        vgi_fields_clear(t, vgi_artefact_in(t, h, 0));
        if (t->marks) *mark_of(t, h) = false;
    }
}

int vg_head_need(const vg_head *h, const char *what, const char *subject, vg_err *e)
{
    const vgi_artefact *t = vgi_artefact_by_name(what);
    if (!t) return vg_fail(e, VG_EARG, "there is no such thing as a '%s' in a stream", what);
    bool empty = t == &vgi_artefacts[VGI_MESH] && !h->body.mesh.nv;
    if (vgi_artefact_count(t, h) && !empty) return VG_OK;
    return vg_fail(e, VG_EINPUT, "%s holds no %s%s%s", subject, what, t->advice ? ": " : "", t->advice ? t->advice : "");
}
