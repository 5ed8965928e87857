/* stream.c: reader and writer of whole streams: which records may stand where, what is passed on, what stops.
 * Leaves out bytes of records (record.c) and of their contents (payload.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/payload.h"
#include "io/record.h"

#include <stdlib.h>

/* The header records, in the order they are written. */
enum { PROV, MESH, TEXC, LABL, SELE, LINK, ANCH, REFP, SKEL, CORR, PTCH, RIG, MAP, FORM, KNOWN };
static const struct {
    const char *tag;
    uint32_t flags;
    vgi_decoder *decode;
    vgi_encoder *encode; /* NULL: one record for each of several */
    bool repeats, needs_mesh;
} known[KNOWN] = {
    [PROV] = {"PROV", VGI_COPY_SAFE, vgi_prov_decode, NULL, true, false},
    [MESH] = {"MESH", VGI_CRITICAL, vgi_mesh_decode, vgi_mesh_encode, false, false},
    [TEXC] = {"TEXC", 0, vgi_texc_decode, vgi_texc_encode, false, true},
    [LABL] = {"LABL", 0, vgi_labl_decode, vgi_labl_encode, false, true},
    [SELE] = {"SELE", VGI_CRITICAL, vgi_sele_decode, vgi_sele_encode, false, true},
    [LINK] = {"LINK", VGI_CRITICAL, vgi_link_decode, vgi_link_encode, false, true},
    [ANCH] = {"ANCH", VGI_CRITICAL, vgi_anch_decode, vgi_anch_encode, false, true},
    [REFP] = {"REFP", VGI_CRITICAL, vgi_refp_decode, vgi_refp_encode, false, true},
    [SKEL] = {"SKEL", 0, vgi_skel_decode, vgi_skel_encode, false, true},
    [CORR] = {"CORR", VGI_CRITICAL, vgi_corr_decode, vgi_corr_encode, false, false},
    [PTCH] = {"PTCH", 0, vgi_ptch_decode, vgi_ptch_encode, false, true},
    [RIG] = {"RIG ", 0, vgi_rig_decode, vgi_rig_encode, false, true},
    [MAP] = {"MAP ", VGI_CRITICAL, vgi_map_decode, vgi_map_encode, false, true},
    [FORM] = {"FORM", VGI_CRITICAL, vgi_form_decode, vgi_form_encode, false, false},
};

/* ---- reader ---- */

struct vg_reader {
    vgi_input *in;
    vgi_tally tally;
    vg_head head;
    bool seen[KNOWN];
    vg_head form; /* kind, precision, counts of the frames as they come (no arrays): the caller may change `head` */
    vg_records tail;
    uint64_t frames;
    bool ended;
    vg_failure failure;
};

static void remember_form(vg_reader *r)
{
    r->form = (vg_head){.kind = r->head.kind,
                        .precision = r->head.precision,
                        .count = r->head.count,
                        .nanchors = r->head.nanchors,
                        .body.mesh.nv = r->head.body.mesh.nv,
                        .body.skeleton.njoints = r->head.body.skeleton.njoints};
}

static int keep_unknown(vg_reader *r, vg_record *record, vg_records *list, vg_err *e)
{
    if (record->flags & VGI_CRITICAL)
        return vg_fail(e, VG_EINPUT,
                       "'%s' needs a newer version of this program: it has a record '%s' that must be understood",
                       vgi_input_name(r->in), record->tag);
    if (!(record->flags & VGI_COPY_SAFE)) return VG_OK;
    size_t cap = list->n;
    int ok = vgi_grow(&list->at, &cap, list->n + 1, sizeof *list->at, e);
    if (ok < 0) return ok;
    list->at[list->n++] = *record;
    record->payload = (vg_bytes){0};
    return VG_OK;
}

static int find_known(const char *tag)
{
    for (int i = 0; i < KNOWN; i++)
        if (!strcmp(tag, known[i].tag)) return i;
    return -1;
}

static int stopped_by_failure(vg_reader *r, const vg_record *record, vg_err *e)
{
    char where[200];
    snprintf(where, sizeof where, "'%.150s': record FAIL", vgi_input_name(r->in));
    vgi_payload p = {record->payload.data, record->payload.size, where};
    vgi_failure_clear(&r->failure);
    return vgi_fail_decode(&r->failure, &p, vgi_input_name(r->in), e);
}

static int read_head_record(vg_reader *r, vg_record *record, vg_err *e)
{
    const char *name = vgi_input_name(r->in);
    int i = find_known(record->tag);
    if (!strcmp(record->tag, "FAIL")) return stopped_by_failure(r, record, e);
    if (!strcmp(record->tag, "FRAM")) return vg_fail(e, VG_EINPUT, "'%s' has a frame before its FORM record", name);
    if (!strcmp(record->tag, "SCAL")) return vg_fail(e, VG_EINPUT, "'%s': record SCAL must come after FORM", name);
    if (i < 0) return keep_unknown(r, record, &r->head.extra, e);
    if (r->seen[i] && !known[i].repeats) return vg_fail(e, VG_EINPUT, "'%s' has two %s records", name, record->tag);
    if (known[i].needs_mesh && !r->seen[MESH])
        return vg_fail(e, VG_EINPUT, "'%s': record %s must come after MESH", name, record->tag);
    r->seen[i] = true;
    char where[200];
    snprintf(where, sizeof where, "'%.150s': record %s", name, record->tag);
    vgi_payload p = {record->payload.data, record->payload.size, where};
    return known[i].decode(&p, &r->head, e);
}

static int read_head(vg_reader *r, vg_err *e)
{
    int ok = vgi_tally_init(&r->tally, e);
    if (ok == VG_OK) ok = vgi_record_begin_read(r->in, e);
    vg_record record = {.payload = {0}};
    while (ok == VG_OK && !r->seen[FORM]) {
        ok = vgi_record_read(r->in, &r->tally, &record, e);
        if (ok == 0) ok = vg_fail(e, VG_EINPUT, "'%s' has no FORM record", vgi_input_name(r->in));
        else if (ok > 0) ok = read_head_record(r, &record, e);
    }
    vg_bytes_clear(&record.payload);
    if (ok < 0) return ok;
    if (r->seen[MESH] && !r->head.body.reference)
        return vg_fail(e, VG_EINPUT, "'%s' has a MESH but no REFP record before FORM", vgi_input_name(r->in));
    if (!r->head.body.reference_name && !(r->head.body.reference_name = vgi_copy_string("", 0, e))) return VG_ENOMEM;
    remember_form(r);
    return VG_OK;
}

int vgi_reader_open_input(vg_reader **out, vgi_input *in, vg_err *e)
{
    vg_reader *r = *out = vgi_array(1, sizeof *r, e);
    if (!r) return vgi_input_free(&in), VG_ENOMEM;
    r->in = in;
    int ok = read_head(r, e);
    if (ok < 0) vg_reader_close(out);
    return ok;
}

int vg_reader_open(vg_reader **r, int fd, const char *name, vg_err *e)
{
    vgi_input *in;
    *r = NULL;
    int ok = vgi_input_fd(&in, fd, false, name, e);
    return ok < 0 ? ok : vgi_reader_open_input(r, in, e);
}

int vg_reader_open_memory(vg_reader **r, const void *data, size_t n, const char *name, vg_err *e)
{
    vgi_input *in;
    *r = NULL;
    int ok = vgi_input_memory(&in, data, n, name, e);
    return ok < 0 ? ok : vgi_reader_open_input(r, in, e);
}

vg_head *vg_reader_head(vg_reader *r)
{
    return &r->head;
}

vg_records *vg_reader_tail(vg_reader *r)
{
    return &r->tail;
}

static int read_scalars(const vg_reader *r, const vg_record *record, vg_frame *f, vg_err *e)
{
    char where[240];
    snprintf(where, sizeof where, "'%.150s': record SCAL of frame %llu", vgi_input_name(r->in),
             (unsigned long long)r->frames);
    vgi_payload p = {record->payload.data, record->payload.size, where};
    return vgi_scal_decode(&p, &r->form, f, e);
}

/* The frame's raw buffer takes part in reading, so that a large payload is read straight to where it stays. */
int vg_reader_next(vg_reader *r, vg_frame *f, vg_err *e)
{
    vg_records_clear(&f->extra);
    f->has_scalars = false;
    if (r->ended) return 0;
    vg_record record = {.payload = f->raw};
    vg_records before = {0};
    int ok;
    while ((ok = vgi_record_read(r->in, &r->tally, &record, e)) > 0) {
        if (!strcmp(record.tag, "FRAM")) break;
        if (!strcmp(record.tag, "FAIL")) ok = stopped_by_failure(r, &record, e);
        else if (!strcmp(record.tag, "SCAL")) ok = read_scalars(r, &record, f, e);
        else if (find_known(record.tag) == FORM)
            ok = vg_fail(e, VG_EINPUT, "'%s' has two FORM records", vgi_input_name(r->in));
        else if (find_known(record.tag) >= 0)
            ok = vg_fail(e, VG_EINPUT, "'%s': record %s must come before FORM", vgi_input_name(r->in), record.tag);
        else ok = keep_unknown(r, &record, &before, e);
        if (ok < 0) break;
    }
    f->raw = record.payload;
    if (ok == 0 && f->has_scalars)
        ok = vg_fail(e, VG_EINPUT, "'%s': no frame comes behind the last SCAL record", vgi_input_name(r->in));
    if (ok <= 0) {
        if (ok == 0) r->ended = true, r->tail = before;
        else vg_records_clear(&before);
        return ok;
    }
    f->extra = before;
    char where[200];
    snprintf(where, sizeof where, "'%.150s': frame %llu", vgi_input_name(r->in), (unsigned long long)r->frames);
    ok = vgi_fram_decode(f, &r->form, where, e);
    if (ok < 0) return ok;
    r->frames++;
    return 1;
}

const vg_failure *vg_reader_failure(const vg_reader *r)
{
    return r->failure.program ? &r->failure : NULL;
}

void vg_reader_close(vg_reader **r)
{
    if (!*r) return;
    vgi_failure_clear(&(*r)->failure);
    vgi_input_free(&(*r)->in);
    vgi_tally_clear(&(*r)->tally);
    vg_head_clear(&(*r)->head);
    vg_records_clear(&(*r)->tail);
    free(*r);
    *r = NULL;
}

/* ---- writer ---- */

struct vg_writer {
    int fd;
    char *name;
    const vg_head *head;
    vgi_tally tally;
    vg_bytes front, values; /* reused from record to record */
};

static int write_record(vg_writer *w, const char *tag, uint32_t flags, const vg_bytes *b, vg_err *e)
{
    vgi_part part = {b->data, b->size};
    return vgi_record_write(w->fd, w->name, &w->tally, tag, flags, &part, 1, e);
}

static int write_extra(vg_writer *w, const vg_records *list, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < list->n; i++)
        r = write_record(w, list->at[i].tag, list->at[i].flags, &list->at[i].payload, e);
    return r;
}

static int write_provenance(vg_writer *w, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < w->head->nprovenance; i++) {
        w->front.size = 0;
        r = vgi_prov_encode(&w->front, &w->head->provenance[i], e);
        if (r == VG_OK) r = write_record(w, known[PROV].tag, known[PROV].flags, &w->front, e);
    }
    return r;
}

static int write_head(vg_writer *w, vg_err *e)
{
    const vg_head *h = w->head;
    const bool mesh = h->body.reference != NULL;
    const bool present[KNOWN] = {[MESH] = mesh,
                                 [TEXC] = mesh && h->body.attributes.ntex > 0,
                                 [LABL] = mesh && h->body.attributes.nlabels > 0,
                                 [SELE] = mesh && h->has_selection,
                                 [LINK] = mesh && h->has_links,
                                 [ANCH] = mesh && h->nanchors > 0,
                                 [REFP] = mesh,
                                 [SKEL] = mesh && h->body.skeleton.njoints > 0,
                                 [CORR] = h->correspondence.first != NULL,
                                 [PTCH] = mesh && h->body.patches.n > 0,
                                 [RIG] = mesh && h->body.rig.skeleton.njoints > 0,
                                 [MAP] = mesh && h->map.n > 0,
                                 [FORM] = true};
    int r = vgi_record_begin_write(w->fd, w->name, e);
    if (r == VG_OK) r = write_provenance(w, e);
    for (int i = 0; r == VG_OK && i < KNOWN; i++) {
        if (!present[i]) continue;
        if (i == FORM) r = write_extra(w, &h->extra, e);
        w->front.size = 0;
        if (r == VG_OK) r = known[i].encode(&w->front, h, e);
        if (r == VG_OK) r = write_record(w, known[i].tag, known[i].flags, &w->front, e);
    }
    return r;
}

int vg_writer_open(vg_writer **out, int fd, const char *name, const vg_head *h, vg_err *e)
{
    vg_writer *w = *out = vgi_array(1, sizeof *w, e);
    if (!w) return VG_ENOMEM;
    w->fd = fd, w->head = h;
    int r = (w->name = vgi_copy_string(name, strlen(name), e)) ? vgi_tally_init(&w->tally, e) : VG_ENOMEM;
    if (r == VG_OK) r = write_head(w, e);
    if (r < 0) vg_writer_close(out);
    return r;
}

static int write_scalars(vg_writer *w, const vg_frame *f, vg_err *e)
{
    const vg_head *h = w->head;
    vgi_part parts[2];
    if (h->kind != VG_VERTICES || !f->has_scalars) return VG_OK;
    w->front.size = 0;
    int r = vgi_scal_encode(&w->front, f, e);
    if (r == VG_OK && !vgi_finite(f->scalars, h->body.mesh.nv))
        r = vg_fail(e, VG_EINPUT, "a '%s' of frame '%s' is not finite", f->scalars_name, f->name ? f->name : "");
    if (r == VG_OK)
        r = vgi_values_encode(&w->values, f->scalars, h->body.mesh.nv, h->precision, &parts[1].data, &parts[1].size,
                              e);
    if (r < 0) return r;
    parts[0] = (vgi_part){w->front.data, w->front.size};
    return vgi_record_write(w->fd, w->name, &w->tally, "SCAL", 0, parts, 2, e);
}

int vg_writer_put(vg_writer *w, const vg_frame *f, vg_err *e)
{
    const vg_head *h = w->head;
    size_t n = h->count * vg_kind_width(h->kind);
    vgi_part parts[2];
    int r = write_extra(w, &f->extra, e);
    if (r == VG_OK) r = write_scalars(w, f, e);
    if (r == VG_OK && !vgi_finite(f->values, n))
        r = vg_fail(e, VG_EINPUT, "frame '%s' holds a number that is not finite", f->name ? f->name : "");
    w->front.size = 0;
    if (r == VG_OK) r = vgi_fram_encode(&w->front, h, f, e);
    if (r == VG_OK) r = vgi_values_encode(&w->values, f->values, n, h->precision, &parts[1].data, &parts[1].size, e);
    if (r < 0) return r;
    parts[0] = (vgi_part){w->front.data, w->front.size};
    return vgi_record_write(w->fd, w->name, &w->tally, "FRAM", VGI_CRITICAL, parts, 2, e);
}

int vg_writer_end(vg_writer *w, const vg_records *tail, vg_err *e)
{
    int r = tail ? write_extra(w, tail, e) : VG_OK;
    return r < 0 ? r : vgi_record_end_write(w->fd, w->name, &w->tally, e);
}

void vg_writer_abandon(vg_writer *w, const char *program, int exit_status, const char *message)
{
    w->front.size = 0;
    if (vgi_fail_encode(&w->front, program, exit_status, message, NULL) == VG_OK)
        if (write_record(w, "FAIL", VGI_CRITICAL, &w->front, NULL) < 0) return; /* nothing more can be said */
}

void vg_writer_close(vg_writer **w)
{
    if (!*w) return;
    vgi_tally_clear(&(*w)->tally);
    vg_bytes_clear(&(*w)->front);
    vg_bytes_clear(&(*w)->values);
    free((*w)->name);
    free(*w);
    *w = NULL;
}
