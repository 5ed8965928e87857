/* artefact.c: operations on the table of header records: find, count, clear, copy, move. The table is in records.c,
 * the bytes in io/artefact_io.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "model/artefact.h"

#include <stdlib.h>

const vgi_artefact *vgi_artefact_by_tag(const char *tag)
{
    for (size_t i = 0; i < VGI_ARTEFACTS; i++)
        if (!strcmp(vgi_artefacts[i].tag, tag)) return &vgi_artefacts[i];
    return NULL;
}

const vgi_artefact *vgi_artefact_by_name(const char *name)
{
    for (size_t i = 0; i < VGI_ARTEFACTS; i++)
        if (vgi_artefacts[i].name && !strcmp(vgi_artefacts[i].name, name)) return &vgi_artefacts[i];
    return NULL;
}

void *vgi_artefact_in(const vgi_artefact *t, const vg_head *h, size_t i)
{
    const char *base = t->in_body ? (const char *)&h->body : (const char *)h;
    char *at = (char *)(uintptr_t)(base + t->at);
    return t->each ? *(char **)(void *)at + i * t->each : at;
}

static size_t *count_of(const vgi_artefact *t, const vg_head *h)
{
    return (size_t *)(uintptr_t)((const char *)h + t->count_at);
}

size_t vgi_artefact_count(const vgi_artefact *t, const vg_head *h)
{
    if (t->each) return *count_of(t, h);
    if (t->needs && !vgi_artefact_count(vgi_artefact_by_tag(t->needs), h)) return 0;
    const unsigned char *member = (const unsigned char *)h + t->present_at;
    for (size_t i = 0; i < t->present_size; i++)
        if (member[i]) return 1;
    return 0;
}

int vgi_artefact_append(const vgi_artefact *t, vg_head *h, void **artefact, vg_err *e)
{
    size_t *n = count_of(t, h), cap = *n;
    void *list = (char *)h + t->at;
    int r = vgi_grow(list, &cap, *n + 1, t->each, e);
    if (r < 0) return r;
    *artefact = vgi_artefact_in(t, h, *n);
    memset(*artefact, 0, t->each);
    (*n)++;
    return VG_OK;
}

/* ---- fields ---- */

static void **pointer_of(const vgi_member *f, const void *artefact)
{
    return (void **)(uintptr_t)((const char *)artefact + f->at);
}

size_t vgi_type_size(vgi_type type)
{
    static const size_t sizes[] = {
        [VGI_U8] = 1, [VGI_U32] = 4, [VGI_U64] = 8, [VGI_F32] = 4, [VGI_F64] = 8, [VGI_TEXT] = 0};
    return sizes[type];
}

size_t vgi_member_elements(const vgi_member *f, const void *artefact, const vg_mesh *mesh)
{
    size_t n;
    if (!f->length) return 1;
    return vgi_mul(f->length(artefact, mesh), f->width, &n) ? n : SIZE_MAX;
}

static void free_texts(const vgi_member *f, char *array, size_t n)
{
    for (size_t i = 0; array && i < n; i++) free(*(char **)(void *)(array + i * f->size + f->row_at));
}

/* The texts of a list must be released before the struct is cleared, because their number is a member of it. */
static void free_all_texts(const vgi_artefact *t, void *artefact)
{
    for (size_t i = 0; i < t->nfields; i++) {
        const vgi_member *f = &t->fields[i];
        if (f->type == VGI_TEXT && f->length) free_texts(f, *pointer_of(f, artefact), f->length(artefact, NULL));
    }
}

void vgi_fields_clear(const vgi_artefact *t, void *artefact)
{
    free_all_texts(t, artefact);
    for (size_t i = 0; i < t->nfields; i++) {
        const vgi_member *f = &t->fields[i];
        if (f->length || f->type == VGI_TEXT) {
            free(*pointer_of(f, artefact));
            *pointer_of(f, artefact) = NULL;
        } else {
            memset((char *)artefact + f->at, 0, f->size);
        }
    }
}

static size_t place_size(const vgi_member *f)
{
    return f->length || f->type == VGI_TEXT ? sizeof(void *) : f->size;
}

/* Columns of one array share its pointer: move all of them before clearing any. */
void vgi_fields_move(const vgi_artefact *t, void *to, void *from)
{
    vgi_fields_clear(t, to);
    for (size_t i = 0; i < t->nfields; i++)
        memcpy((char *)to + t->fields[i].at, (char *)from + t->fields[i].at, place_size(&t->fields[i]));
    for (size_t i = 0; i < t->nfields; i++) memset((char *)from + t->fields[i].at, 0, place_size(&t->fields[i]));
}

/* Replace the pointers in a copied list of texts by copies of the texts. */
static int copy_texts(const vgi_member *f, char *array, size_t n, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; i < n; i++) {
        char **text = (char **)(void *)(array + i * f->size + f->row_at);
        if (*text) *text = r == VG_OK ? vgi_copy_string(*text, strlen(*text), e) : NULL;
        if (!*text) r = VG_ENOMEM;
    }
    return r;
}

/* A column shares its array with the other columns of the rows: the first one copies the whole array. */
static int copy_array(const vgi_member *f, void *to, const void *from, const vg_mesh *mesh, vg_err *e)
{
    void **target = pointer_of(f, to), *source = *pointer_of(f, from);
    size_t n = f->rows ? f->length(from, mesh) : vgi_member_elements(f, from, mesh);
    if (!source) return VG_OK;
    if (!*target) {
        if (!(*target = vgi_copy_array(source, n, f->size, e))) return VG_ENOMEM;
    }
    return f->type == VGI_TEXT ? copy_texts(f, *target, n, e) : VG_OK;
}

/* The last column of the rows is their text. Until then the copy holds pointers of the original, which must not
 * survive a failure. */
static int copy_field(const vgi_member *f, void *to, const void *from, const vg_mesh *mesh, vg_err *e)
{
    if (f->length) return copy_array(f, to, from, mesh, e);
    if (f->type != VGI_TEXT) {
        memcpy((char *)to + f->at, (const char *)from + f->at, f->size);
        return VG_OK;
    }
    const char *text = *pointer_of(f, from);
    if (!text) return VG_OK;
    return (*pointer_of(f, to) = vgi_copy_string(text, strlen(text), e)) ? VG_OK : VG_ENOMEM;
}

int vgi_fields_copy(const vgi_artefact *t, void *to, const void *from, const vg_mesh *mesh, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; i < t->nfields; i++)
        if (t->fields[i].length || t->fields[i].type == VGI_TEXT) *pointer_of(&t->fields[i], to) = NULL;
    for (size_t i = 0; r == VG_OK && i < t->nfields; i++) r = copy_field(&t->fields[i], to, from, mesh, e);
    if (r < 0) vgi_fields_clear(t, to);
    return r;
}

/* ---- shared by checks ---- */

int vgi_wrong(const char *where, const char *what, vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "%s: %s", where, what);
}

bool vgi_are_turns(const double *q, size_t n)
{
    for (size_t i = 0; i < n; i++, q += 4) {
        double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
        if (!(square >= 1 - 2e-6 && square <= 1 + 2e-6)) return false;
    }
    return true;
}

int vgi_check_ascending(const char *where, const uint32_t *list, size_t n, size_t limit, vg_err *e)
{
    for (size_t i = 0; i < n; i++) {
        if (list[i] >= limit) return vgi_wrong(where, "an index is out of range", e);
        if (i && list[i] <= list[i - 1]) return vgi_wrong(where, "indices are not ascending", e);
    }
    return VG_OK;
}
