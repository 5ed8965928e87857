/* head.c: what is known of a sequence before its frames, and the frame itself: making, copying, releasing.
 * Leaves out how either is written down (io) and what is computed from it (method).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/frame.h"
#include "model/map.h"

#include <stdlib.h>

void vg_attributes_clear(vg_attributes *a)
{
    free(a->tex);
    free(a->corner_tex);
    for (size_t i = 0; i < a->nlabels; i++) free(a->labels[i].text);
    free(a->labels);
    *a = (vg_attributes){0};
}

int vg_attributes_copy(vg_attributes *to, const vg_attributes *from, const vg_mesh *mesh, vg_err *e)
{
    *to = (vg_attributes){.ntex = from->ntex, .tex_dim = from->tex_dim};
    if (from->ntex) {
        to->tex = vgi_copy_array(from->tex, from->ntex * from->tex_dim, sizeof *to->tex, e);
        to->corner_tex = vgi_copy_array(from->corner_tex, vg_mesh_corners(mesh), sizeof *to->corner_tex, e);
        if (!to->tex || !to->corner_tex) goto failed;
    }
    if (from->nlabels && !(to->labels = vgi_array(from->nlabels, sizeof *to->labels, e))) goto failed;
    for (; to->nlabels < from->nlabels; to->nlabels++) {
        const vg_label *l = &from->labels[to->nlabels];
        char *text = vgi_copy_string(l->text, strlen(l->text), e);
        if (!text) goto failed;
        to->labels[to->nlabels] = (vg_label){.face = l->face, .kind = l->kind, .text = text};
    }
    return VG_OK;
failed:
    vg_attributes_clear(to);
    return VG_ENOMEM;
}

void vg_skeleton_clear(vg_skeleton *s)
{
    for (size_t i = 0; i < s->njoints; i++) free(s->joints[i].name);
    free(s->joints);
    *s = (vg_skeleton){0};
}

int vg_skeleton_copy(vg_skeleton *to, const vg_skeleton *from, vg_err *e)
{
    *to = (vg_skeleton){0};
    if (!(to->joints = vgi_array(from->njoints, sizeof *to->joints, e))) return VG_ENOMEM;
    for (; to->njoints < from->njoints; to->njoints++) {
        const vg_joint *j = &from->joints[to->njoints];
        char *name = vgi_copy_string(j->name, strlen(j->name), e);
        if (!name) {
            vg_skeleton_clear(to);
            return VG_ENOMEM;
        }
        to->joints[to->njoints] = *j;
        to->joints[to->njoints].name = name;
    }
    return VG_OK;
}

void vg_correspondence_clear(vg_correspondence *c)
{
    free(c->first);
    free(c->source);
    free(c->weight);
    free(c->distance);
    free(c->matched);
    *c = (vg_correspondence){0};
}

int vg_correspondence_copy(vg_correspondence *to, const vg_correspondence *from, vg_err *e)
{
    *to = *from;
    to->first = NULL, to->source = NULL, to->weight = NULL, to->distance = NULL, to->matched = NULL;
    if (!from->first) return VG_OK;
    size_t nf = from->target_nf, pairs = from->first[nf];
    to->first = vgi_copy_array(from->first, nf + 1, sizeof *to->first, e);
    to->source = vgi_copy_array(from->source, pairs, sizeof *to->source, e);
    to->weight = vgi_copy_array(from->weight, pairs, sizeof *to->weight, e);
    to->distance = vgi_copy_array(from->distance, nf, sizeof *to->distance, e);
    to->matched = vgi_copy_array(from->matched, nf, sizeof *to->matched, e);
    if (to->first && to->source && to->weight && to->distance && to->matched) return VG_OK;
    vg_correspondence_clear(to);
    return VG_ENOMEM;
}

void vg_patches_clear(vg_patches *p)
{
    free(p->of_face);
    *p = (vg_patches){0};
}

static int copy_patches(vg_patches *to, const vg_patches *from, size_t nf, vg_err *e)
{
    *to = (vg_patches){0};
    if (!from->n) return VG_OK;
    if (!(to->of_face = vgi_copy_array(from->of_face, nf, sizeof *to->of_face, e))) return VG_ENOMEM;
    to->n = from->n;
    return VG_OK;
}

size_t vgi_map_arrays(vg_map *m, vgi_map_array list[VGI_MAP_ARRAYS])
{
    bool bones = m->kind == VG_MAP_BONES;
    size_t placed = bones ? 0 : m->nheld;
    const vgi_map_array all[VGI_MAP_ARRAYS] = {
        {(void **)&m->weights, m->nv, 4, true, true},
        {(void **)&m->place, m->n, 3, true, true},
        {(void **)&m->centre, m->n, 3, false, true},
        {(void **)&m->home_centre, m->n, 3, false, true},
        {(void **)&m->share, m->n, 1, false, true},
        {(void **)&m->home, m->has_home ? m->nv : 0, 3, false, true},
        {(void **)&m->joint_at, m->njoints, 3, false, true},
        {(void **)&m->joint_weight, m->njoints, 1, false, true},
        {(void **)&m->corner, m->ncorners, 4 * m->per_corner, false, true},
        {(void **)&m->held_at, placed, 3, false, true},
        {(void **)&m->joint, m->njoints, 2, false, false},
        {(void **)&m->held, m->nheld, 1, false, false},
        {(void **)&m->held_patch, placed, 1, false, false},
        {(void **)&m->corner_bone, bones ? m->ncorners : 0, m->per_corner, false, false}};
    memcpy(list, all, sizeof all);
    return VGI_MAP_ARRAYS;
}

size_t vgi_map_array_length(const vg_map *m, const vgi_map_array *a)
{
    size_t n;
    if (!vgi_mul(a->count, a->width, &n) || (a->per_transform && !vgi_mul(n, m->n, &n))) return SIZE_MAX;
    return n;
}

void vg_map_clear(vg_map *m)
{
    vgi_map_array list[VGI_MAP_ARRAYS];
    size_t n = vgi_map_arrays(m, list);
    for (size_t i = 0; i < n; i++) free(*list[i].at);
    for (size_t i = 0; i < m->nnames; i++) free(m->names[i]);
    free(m->names);
    *m = (vg_map){0};
}

static int copy_map(vg_map *to, const vg_map *from, vg_err *e)
{
    vg_map source = *from;
    vgi_map_array a[VGI_MAP_ARRAYS], b[VGI_MAP_ARRAYS];
    *to = *from;
    to->nnames = 0, to->names = NULL;
    size_t n = vgi_map_arrays(&source, a);
    vgi_map_arrays(to, b);
    for (size_t i = 0; i < n; i++) *b[i].at = NULL;
    if (!from->n) return VG_OK;
    bool ok = true;
    for (size_t i = 0; ok && i < n; i++) {
        if (*a[i].at)
            ok = (*b[i].at = vgi_copy_array(*a[i].at, vgi_map_array_length(from, &a[i]),
                                            a[i].real ? sizeof(double) : sizeof(uint32_t), e));
    }
    if (ok && from->nnames) ok = (to->names = vgi_array(from->nnames, sizeof *to->names, e));
    for (; ok && to->nnames < from->nnames; to->nnames++)
        if (!(to->names[to->nnames] = vgi_copy_string(from->names[to->nnames], strlen(from->names[to->nnames]), e)))
            ok = false;
    if (ok) return VG_OK;
    vg_map_clear(to);
    return VG_ENOMEM;
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

static const struct { size_t width; const char *name; } kinds[] = {
    [VG_VERTICES] = {3, "vertices"}, [VG_VECTORS] = {3, "vectors"},
    [VG_DEFORMATIONS] = {4, "deformations"}, [VG_TRANSFORMS] = {7, "transforms"}};

static bool is_kind(vg_kind k)
{
    return k >= VG_VERTICES && k <= VG_TRANSFORMS;
}

size_t vg_kind_width(vg_kind k)
{
    return is_kind(k) ? kinds[k].width : 0;
}

const char *vg_kind_name(vg_kind k)
{
    return is_kind(k) ? kinds[k].name : "unknown";
}

/* ---- provenance ---- */

static void clear_provenance(vg_provenance *p)
{
    free(p->program);
    free(p->version);
    for (size_t i = 0; i < p->nargs; i++) free(p->args[i]);
    free(p->args);
    free(p->parents);
    *p = (vg_provenance){0};
}

/* A copy of s in which bytes that are not part of valid UTF-8 stand as '?'. */
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
    size_t cap = h->nprovenance;
    int r = vgi_grow(&h->provenance, &cap, h->nprovenance + 1, sizeof *p, e);
    if (r < 0) clear_provenance(p);
    else h->provenance[h->nprovenance++] = *p;
    return r;
}

/* Records that no later record names as a parent are the ends of their lines: the new process continues them all. */
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
        const vg_provenance *from = &other->provenance[i];
        vg_provenance p;
        int r = fill_provenance(&p, from->program, from->version, from->nargs, from->args, from->nparents, e);
        if (r < 0) return r;
        for (size_t k = 0; k < from->nparents; k++) p.parents[k] = from->parents[k] + (uint32_t)base;
        if ((r = append_provenance(h, &p, e)) < 0) return r;
    }
    return VG_OK;
}

/* ---- body ---- */

void vg_body_clear(vg_body *b)
{
    vg_mesh_clear(&b->mesh);
    free(b->reference);
    free(b->reference_name);
    vg_attributes_clear(&b->attributes);
    vg_skeleton_clear(&b->skeleton);
    vg_patches_clear(&b->patches);
    vg_rig_clear(&b->rig);
    *b = (vg_body){0};
}

int vg_body_copy(vg_body *to, const vg_body *from, vg_err *e)
{
    *to = (vg_body){0};
    const char *name = from->reference_name ? from->reference_name : "";
    bool ok = vg_mesh_copy(&to->mesh, &from->mesh, e) == VG_OK &&
              vg_attributes_copy(&to->attributes, &from->attributes, &from->mesh, e) == VG_OK &&
              vg_skeleton_copy(&to->skeleton, &from->skeleton, e) == VG_OK &&
              copy_patches(&to->patches, &from->patches, from->mesh.nf, e) == VG_OK &&
              vg_rig_copy(&to->rig, &from->rig, from->mesh.nv, e) == VG_OK &&
              (to->reference_name = vgi_copy_string(name, strlen(name), e));
    if (ok && from->reference)
        ok = (to->reference = vgi_copy_array(from->reference, 3 * from->mesh.nv, sizeof *to->reference, e));
    if (ok) return VG_OK;
    vg_body_clear(to);
    return VG_ENOMEM;
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
    vg_correspondence_clear(&h->correspondence);
    vg_map_clear(&h->map);
    free(h->selected);
    free(h->links);
    free(h->anchors);
    for (size_t i = 0; i < h->nprovenance; i++) clear_provenance(&h->provenance[i]);
    free(h->provenance);
    vg_records_clear(&h->extra);
    *h = (vg_head){0};
}

int vg_head_copy(vg_head *to, const vg_head *from, vg_err *e)
{
    *to = (vg_head){.has_selection = from->has_selection, .has_links = from->has_links, .kind = from->kind,
                    .precision = from->precision, .count = from->count};
    bool ok = vg_body_copy(&to->body, &from->body, e) == VG_OK &&
              vg_correspondence_copy(&to->correspondence, &from->correspondence, e) == VG_OK &&
              copy_map(&to->map, &from->map, e) == VG_OK;
    if (ok && (ok = (to->selected = vgi_copy_array(from->selected, from->nselected, sizeof *to->selected, e))))
        to->nselected = from->nselected;
    if (ok && (ok = (to->links = vgi_copy_array(from->links, 2 * from->nlinks, sizeof *to->links, e))))
        to->nlinks = from->nlinks;
    if (ok && (ok = (to->anchors = vgi_copy_array(from->anchors, from->nanchors, sizeof *to->anchors, e))))
        to->nanchors = from->nanchors;
    ok = ok && vg_head_merge_trace(to, from, e) == VG_OK && copy_records(&to->extra, &from->extra, e) == VG_OK;
    if (ok) return VG_OK;
    vg_head_clear(to);
    return VG_ENOMEM;
}

/* ---- frame ---- */

void vg_frame_clear(vg_frame *f)
{
    free(f->name);
    free(f->anchors);
    free(f->pins);
    free(f->turns);
    free(f->scalars_name);
    free(f->scalars_unit);
    free(f->scalars);
    free(f->values_own);
    vg_bytes_clear(&f->raw);
    vg_records_clear(&f->extra);
    *f = (vg_frame){0};
}

int vg_frame_shape(vg_frame *f, const vg_head *h, vg_err *e)
{
    size_t n, anchors;
    if (!vgi_mul(h->count, vg_kind_width(h->kind), &n) || !vgi_mul(h->nanchors, 3, &anchors))
        return vg_fail(e, VG_ENOMEM, "not enough memory for a frame of %zu elements", h->count);
    int r = vgi_grow(&f->values_own, &f->values_cap, n, sizeof *f->values, e);
    if (r == VG_OK) r = vgi_grow(&f->anchors, &f->anchors_cap, anchors, sizeof *f->anchors, e);
    if (r == VG_OK) f->values = f->values_own;
    f->has_scalars = false;
    return r;
}

int vg_frame_pin(vg_frame *f, const uint32_t *vertices, size_t n, vg_err *e)
{
    int r = vgi_grow(&f->pins, &f->pins_cap, n, sizeof *f->pins, e);
    if (r < 0) return r;
    if (n) memcpy(f->pins, vertices, n * sizeof *f->pins);
    f->npins = n;
    return VG_OK;
}

int vg_frame_turn(vg_frame *f, const double *turns, size_t njoints, vg_err *e)
{
    int r = vgi_grow(&f->turns, &f->turns_cap, 4 * njoints, sizeof *f->turns, e);
    if (r < 0) return r;
    if (njoints) memcpy(f->turns, turns, 4 * njoints * sizeof *f->turns);
    f->nturns = njoints;
    return VG_OK;
}

int vg_frame_rename(vg_frame *f, const char *name, vg_err *e)
{
    size_t n = strlen(name) + 1;
    int r = vgi_grow(&f->name, &f->name_cap, n, 1, e);
    if (r == VG_OK) memcpy(f->name, name, n);
    return r;
}

static int put_text(char **to, size_t *cap, const char *text, size_t n, vg_err *e)
{
    int r = vgi_grow(to, cap, n + 1, 1, e);
    if (r < 0) return r;
    if (n) memcpy(*to, text, n);
    (*to)[n] = 0;
    return VG_OK;
}

int vgi_frame_scalars(vg_frame *f, const char *name, size_t name_bytes, const char *unit, size_t unit_bytes,
                      size_t nv, vg_err *e)
{
    f->has_scalars = false;
    int r = put_text(&f->scalars_name, &f->scalars_name_cap, name, name_bytes, e);
    if (r == VG_OK) r = put_text(&f->scalars_unit, &f->scalars_unit_cap, unit, unit_bytes, e);
    if (r == VG_OK) r = vgi_grow(&f->scalars, &f->scalars_cap, nv, sizeof *f->scalars, e);
    f->has_scalars = r == VG_OK;
    return r;
}

int vg_frame_scalars(vg_frame *f, const char *name, const char *unit, const double *numbers, size_t nv, vg_err *e)
{
    int r = vgi_frame_scalars(f, name, strlen(name), unit, strlen(unit), nv, e);
    if (r == VG_OK && nv) memcpy(f->scalars, numbers, nv * sizeof *numbers);
    return r;
}

int vg_frame_label(vg_frame *f, vg_frame *from, vg_err *e)
{
    f->has_time = from->has_time;
    f->has_scalars = false;
    f->time = from->time;
    vg_records_clear(&f->extra);
    f->extra = from->extra;
    from->extra = (vg_records){0};
    return vg_frame_rename(f, from->name ? from->name : "", e);
}
