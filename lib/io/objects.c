/* objects.c: reads an OBJ file whose objects are the frames of a sequence: each 'o' begins a mesh with the same
 * number of vertices and the same faces as the first, numbered from its own first vertex. Statements and numbers are
 * in obj.c. In most files objects are parts of one mesh instead.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <stdlib.h>

/* Number of objects if each has faces; 0 if a face is outside all objects, or an object has no faces. */
static size_t count_objects(const vg_model *m)
{
    const vg_attributes *a = &m->attributes;
    uint64_t last = UINT64_MAX;
    size_t n = 0;
    for (size_t i = 0; i < a->nlabels; i++) {
        if (a->labels[i].kind != VG_LABEL_OBJECT) continue;
        if (a->labels[i].face >= m->mesh.nf || (n ? a->labels[i].face == last : a->labels[i].face != 0)) return 0;
        last = a->labels[i].face;
        n++;
    }
    return n;
}

/* Whether the object that begins at this face has the faces of the first one, shifted by `shift` vertices. */
static bool repeats_first(const vg_mesh *m, size_t face, size_t nf, size_t shift)
{
    const size_t from = m->start[face];
    for (size_t f = 0; f < nf; f++)
        if (m->start[face + f + 1] - from != m->start[f + 1]) return false;
    for (size_t c = 0; c < m->start[nf]; c++)
        if (m->vert[from + c] != m->vert[c] + shift) return false;
    return true;
}

/* The name of object i; borrowed. */
static const vg_label *find_object(const vg_model *m, size_t i)
{
    const vg_label *l = m->attributes.labels;
    while (l->kind != VG_LABEL_OBJECT || i-- > 0) l++;
    return l;
}

size_t vgi_obj_frames(const vg_model *m)
{
    const vg_mesh *mesh = &m->mesh;
    const size_t n = count_objects(m);
    if (n < 2 || mesh->nf % n || mesh->nv % n) return 0;
    const size_t nf = mesh->nf / n, nv = mesh->nv / n;
    for (size_t c = 0; c < mesh->start[nf]; c++)
        if (mesh->vert[c] >= nv) return 0;
    for (size_t i = 1; i < n; i++)
        if (find_object(m, i)->face != i * nf || !repeats_first(mesh, i * nf, nf, i * nv)) return 0;
    return n;
}

static size_t stem_of(const char *name)
{
    size_t n = strlen(name);
    while (n && name[n - 1] >= '0' && name[n - 1] <= '9') n--;
    return n;
}

bool vgi_obj_numbered(const vg_model *m, size_t frames)
{
    const char *before = find_object(m, 0)->text;
    const size_t stem = stem_of(before);
    if (!before[stem]) return false;
    for (size_t i = 1; i < frames; i++) {
        const char *name = find_object(m, i)->text;
        if (stem_of(name) != stem || strncmp(name, before, stem) != 0 || vgi_natural_compare(before, name) >= 0)
            return false;
        before = name;
    }
    return true;
}

/* ---- the sequence ---- */

typedef struct reading {
    vg_model m;        /* its mesh was moved out; the vertices are those of all frames */
    size_t nv, frames, next;
    char **names;      /* one per frame */
} reading;

static int keep_names(reading *x, vg_err *e)
{
    if (!(x->names = vgi_array(x->frames, sizeof *x->names, e))) return VG_ENOMEM;
    for (size_t i = 0; i < x->frames; i++) {
        const char *name = find_object(&x->m, i)->text;
        if (!(x->names[i] = vgi_copy_string(name, strlen(name), e))) return VG_ENOMEM;
    }
    return VG_OK;
}

/* Keep the attributes of the first object, without its name, which is that of a frame. */
static void cut_attributes(vg_attributes *a, size_t nf, size_t corners)
{
    size_t labels = 0, ntex = 0;
    for (size_t i = 0; i < a->nlabels; i++) {
        if (a->labels[i].kind != VG_LABEL_OBJECT && a->labels[i].face < nf) a->labels[labels++] = a->labels[i];
        else free(a->labels[i].text);
    }
    a->nlabels = labels;
    for (size_t c = 0; a->corner_tex && c < corners; c++)
        if (a->corner_tex[c] != UINT32_MAX && a->corner_tex[c] >= ntex) ntex = (size_t)a->corner_tex[c] + 1;
    a->ntex = ntex;
    if (ntex) return;
    free(a->tex);
    free(a->corner_tex);
    a->tex = NULL, a->corner_tex = NULL, a->tex_dim = 0;
}

static int take_objects(reading *x, vg_head *h, const char *subject, vg_err *e)
{
    vg_model *m = &x->m;
    if (!(x->frames = vgi_obj_frames(m)))
        return vg_fail(e, VG_EINPUT, "%s is not a sequence of objects: each 'o' must have as many vertices as the "
                                     "first, and the same faces",
                       subject);
    int r = keep_names(x, e);
    if (r < 0) return r;
    m->mesh.nf /= x->frames;
    m->mesh.nv /= x->frames;
    if (m->attributes.ncolours) m->attributes.ncolours = m->mesh.nv;
    cut_attributes(&m->attributes, m->mesh.nf, m->mesh.start[m->mesh.nf]);
    r = vgi_mend_faces(&m->mesh, m->vertices, &m->attributes, &m->note, subject, e);
    h->kind = VG_VERTICES;
    h->precision = VG_F64;
    h->count = x->nv = m->mesh.nv;
    h->body.mesh = m->mesh;
    h->body.attributes = m->attributes;
    m->mesh = (vg_mesh){0};
    m->attributes = (vg_attributes){0};
    return r;
}

static int open_objects(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject, vg_err *e)
{
    (void)how;
    reading *x = *state = vgi_array(1, sizeof *x, e);
    if (!x) return VG_ENOMEM;
    vg_bytes text = {0};
    int r = vgi_input_slurp_text(in, &text, e);
    if (r == VG_OK) r = vgi_obj_read(&x->m, (const char *)text.data, text.size, subject, e);
    vg_bytes_clear(&text);
    return r == VG_OK ? take_objects(x, h, subject, e) : r;
}

static int next_object(void *state, vg_frame *f, vg_err *e)
{
    reading *x = state;
    if (x->next == x->frames) return 0;
    memcpy(f->values, x->m.vertices + 3 * x->nv * x->next, 3 * x->nv * sizeof *f->values);
    int r = vg_frame_rename(f, x->names[x->next++], e);
    return r < 0 ? r : 1;
}

static uint64_t frames_of(const void *state)
{
    return ((const reading *)state)->frames;
}

static const char *note_of(const void *state)
{
    return ((const reading *)state)->m.note.text;
}

static void close_objects(void *state)
{
    reading *x = state;
    if (!x) return;
    for (size_t i = 0; x->names && i < x->frames; i++) free(x->names[i]);
    free(x->names);
    vg_model_clear(&x->m);
    free(x);
}

const vgi_sequence_format vgi_sequence_objects = {
    .name = "obj",
    .suffix = ".obj",
    .uses = VGI_USES_OBJECTS,
    .keeps = VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_ORDER | VGI_KEEPS_TEXTURE | VGI_KEEPS_COLOURS | VGI_KEEPS_LABELS | VGI_KEEPS_NAMES,
    .open = open_objects,
    .next = next_object,
    .frames = frames_of,
    .note = note_of,
    .close = close_objects};
