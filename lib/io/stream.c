/* stream.c: reader and writer of whole streams: the order of records, what is passed on, what is an error. The bytes
 * of records are in record.c, payloads in payload.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/artefact_io.h"
#include "io/payload.h"
#include "io/record.h"

#include <stdlib.h>

/* ---- reader ---- */

struct vg_reader {
    vgi_input *in;
    vgi_tally tally;
    vg_head head;
    bool seen[VGI_ARTEFACTS], formed; /* header records; FORM */
    vgi_form form; /* of the frames as they arrive; the caller may change `head` */
    vg_records tail;
    uint64_t frames;
    bool ended;
    vg_failure failure;
};

static int keep_unknown(vg_reader *s, vg_record *record, vg_records *list, vg_err *e)
{
    if (record->flags & VGI_CRITICAL)
        return vg_fail(e, VG_EINPUT,
                       "'%s' needs a newer version of this program: it has a record '%s' that must be understood",
                       vgi_input_name(s->in), record->tag);
    if (!(record->flags & VGI_COPY_SAFE)) return VG_OK;
    size_t cap = list->n;
    int r = vgi_grow(&list->at, &cap, list->n + 1, sizeof *list->at, e);
    if (r < 0) return r;
    list->at[list->n++] = *record;
    record->payload = (vg_bytes){0};
    return VG_OK;
}

static int stopped_by_failure(vg_reader *s, const vg_record *record, vg_err *e)
{
    char where[200];
    snprintf(where, sizeof where, "'%.150s': record FAIL", vgi_input_name(s->in));
    vgi_payload p = {record->payload.data, record->payload.size, where};
    vgi_failure_clear(&s->failure);
    return vgi_fail_decode(&s->failure, &p, vgi_input_name(s->in), e);
}

static bool seen(const vg_reader *s, const vgi_artefact *t)
{
    return s->seen[t - vgi_artefacts];
}

static int read_known(vg_reader *s, const vgi_artefact *t, const vgi_payload *p, vg_err *e)
{
    const char *name = vgi_input_name(s->in);
    if (seen(s, t) && !t->each) return vg_fail(e, VG_EINPUT, "'%s' has two %s records", name, t->tag);
    if (t->needs && !seen(s, vgi_artefact_by_tag(t->needs)))
        return vg_fail(e, VG_EINPUT, "'%s': record %s must come after %s", name, t->tag, t->needs);
    s->seen[t - vgi_artefacts] = true;
    int r = vgi_artefact_decode(t, p, &s->head, e);
    if (r == VG_EINPUT && vgi_is_earlier_provenance(t, p))
        return vg_fail(e, VG_EINPUT, "'%s' was written by an earlier version of this program, whose streams have a "
                                     "different layout: make it again from its sources", name);
    return r;
}

static int read_head_record(vg_reader *s, vg_record *record, vg_err *e)
{
    const char *name = vgi_input_name(s->in);
    char where[200];
    snprintf(where, sizeof where, "'%.150s': record %s", name, record->tag);
    vgi_payload p = {record->payload.data, record->payload.size, where};
    const vgi_artefact *t = vgi_artefact_by_tag(record->tag);
    if (t) return read_known(s, t, &p, e);
    if (!strcmp(record->tag, "FORM")) {
        s->formed = true;
        return vgi_form_decode(&p, &s->head, e);
    }
    if (!strcmp(record->tag, "FAIL")) return stopped_by_failure(s, record, e);
    if (!strcmp(record->tag, "FRAM")) return vg_fail(e, VG_EINPUT, "'%s' has a frame before its FORM record", name);
    return keep_unknown(s, record, &s->head.extra, e);
}

/* The numbers of a shape, other than vertices, and its turns follow from the graph, which any order of records gives. */
static int check_shapes(const vg_reader *s, vg_err *e)
{
    const vg_head *h = &s->head;
    vg_graph *g = NULL;
    vg_unshaper *u = NULL;
    vg_err why = {0};
    if (!h->signal.n || h->signal.space == VG_SPACE_VERTICES) return VG_OK;
    int r = vg_head_graph(&g, h, e);
    if (r == VG_OK && (r = vg_unshaper_new(&u, &h->signal, g, h->body.reference, &why)) < 0)
        r = vg_fail(e, why.code, "'%.150s': record SIGN: %.300s", vgi_input_name(s->in), why.message);
    vg_unshaper_free(&u);
    vg_graph_free(&g);
    return r;
}

static int read_head(vg_reader *s, vg_err *e)
{
    int r = vgi_tally_init(&s->tally, e);
    if (r == VG_OK) r = vgi_record_begin_read(s->in, e);
    vg_record record = {.payload = {0}};
    while (r == VG_OK && !s->formed) {
        r = vgi_record_read(s->in, &s->tally, &record, e);
        if (r == 0) r = vg_fail(e, VG_EINPUT, "'%s' has no FORM record", vgi_input_name(s->in));
        else if (r > 0) r = read_head_record(s, &record, e);
    }
    vg_bytes_clear(&record.payload);
    if (r < 0) return r;
    if (s->seen[VGI_MESH] && !s->head.body.reference)
        return vg_fail(e, VG_EINPUT, "'%s' has a MESH but no REFP record before FORM", vgi_input_name(s->in));
    if (!s->head.body.reference_name && !(s->head.body.reference_name = vgi_copy_string("", 0, e))) return VG_ENOMEM;
    s->form = vgi_form_of(&s->head);
    return check_shapes(s, e);
}

int vgi_reader_open_input(vg_reader **out, vgi_input *in, vg_err *e)
{
    vg_reader *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return vgi_input_free(&in), VG_ENOMEM;
    s->in = in;
    int r = read_head(s, e);
    if (r < 0) vg_reader_close(out);
    return r;
}

int vg_reader_open(vg_reader **s, int fd, const char *name, vg_err *e)
{
    vgi_input *in;
    *s = NULL;
    int r = vgi_input_fd(&in, fd, false, name, e);
    return r < 0 ? r : vgi_reader_open_input(s, in, e);
}

int vg_reader_open_memory(vg_reader **s, const void *data, size_t n, const char *name, vg_err *e)
{
    vgi_input *in;
    *s = NULL;
    int r = vgi_input_memory(&in, data, n, name, e);
    return r < 0 ? r : vgi_reader_open_input(s, in, e);
}

vg_head *vg_reader_head(vg_reader *s)
{
    return &s->head;
}

vg_records *vg_reader_tail(vg_reader *s)
{
    return &s->tail;
}

/* A large payload is read directly into the frame's raw buffer, where it stays. */
int vg_reader_next(vg_reader *s, vg_frame *f, vg_err *e)
{
    vg_records_clear(&f->extra);
    if (s->ended) return 0;
    vg_record record = {.payload = f->raw};
    vg_records before = {0};
    int r;
    while ((r = vgi_record_read(s->in, &s->tally, &record, e)) > 0) {
        if (!strcmp(record.tag, "FRAM")) break;
        if (!strcmp(record.tag, "FAIL")) r = stopped_by_failure(s, &record, e);
        else if (!strcmp(record.tag, "FORM"))
            r = vg_fail(e, VG_EINPUT, "'%s' has two FORM records", vgi_input_name(s->in));
        else if (vgi_artefact_by_tag(record.tag))
            r = vg_fail(e, VG_EINPUT, "'%s': record %s must come before FORM", vgi_input_name(s->in), record.tag);
        else r = keep_unknown(s, &record, &before, e);
        if (r < 0) break;
    }
    f->raw = record.payload;
    if (r <= 0) {
        if (r == 0) s->ended = true, s->tail = before;
        else vg_records_clear(&before);
        return r;
    }
    f->extra = before;
    char where[200];
    snprintf(where, sizeof where, "'%.150s': frame %llu", vgi_input_name(s->in), (unsigned long long)s->frames);
    r = vgi_fram_decode(f, &s->form, where, e);
    if (r < 0) return r;
    s->frames++;
    return 1;
}

bool vg_reader_may_wait(const vg_reader *s)
{
    return !s->ended && vgi_record_may_wait(s->in);
}

const vg_failure *vg_reader_failure(const vg_reader *s)
{
    return s->failure.program ? &s->failure : NULL;
}

void vg_reader_close(vg_reader **s)
{
    if (!*s) return;
    vgi_failure_clear(&(*s)->failure);
    vgi_input_free(&(*s)->in);
    vgi_tally_clear(&(*s)->tally);
    vg_head_clear(&(*s)->head);
    vg_records_clear(&(*s)->tail);
    free(*s);
    *s = NULL;
}

/* ---- writer ---- */

struct vg_writer {
    char *name;
    const vg_head *head;
    vgi_form form;
    vgi_recorder out;
    vg_bytes front, values; /* reused from record to record */
};

static int write_record(vg_writer *w, const char *tag, uint32_t flags, const vg_bytes *b, vg_err *e)
{
    vgi_part part = {b->data, b->size};
    return vgi_record_write(&w->out, tag, flags, &part, 1, e);
}

static int write_extra(vg_writer *w, const vg_records *list, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < list->n; i++)
        r = write_record(w, list->at[i].tag, list->at[i].flags, &list->at[i].payload, e);
    return r;
}

static int write_artefacts(vg_writer *w, const vgi_artefact *t, vg_err *e)
{
    size_t n = vgi_artefact_count(t, w->head);
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < n; i++) {
        w->front.size = 0;
        r = vgi_artefact_encode(t, &w->front, w->head, i, e);
        if (r == VG_OK) r = write_record(w, t->tag, t->flags, &w->front, e);
    }
    return r;
}

static int write_head(vg_writer *w, vg_err *e)
{
    int r = VG_OK;
    for (int i = 0; r == VG_OK && i < VGI_ARTEFACTS; i++) r = write_artefacts(w, &vgi_artefacts[i], e);
    if (r == VG_OK) r = write_extra(w, &w->head->extra, e);
    w->front.size = 0;
    if (r == VG_OK) r = vgi_form_encode(&w->front, w->head, e);
    if (r == VG_OK) r = write_record(w, "FORM", VGI_CRITICAL, &w->front, e);
    return r < 0 ? r : vgi_recorder_flush(&w->out, e);
}

int vg_writer_open(vg_writer **out, int fd, const char *name, const vg_head *h, vg_err *e)
{
    vg_writer *w = *out = vgi_array(1, sizeof *w, e);
    if (!w) return VG_ENOMEM;
    w->head = h, w->form = vgi_form_of(h);
    int r = (w->name = vgi_copy_string(name, strlen(name), e)) ? vgi_recorder_init(&w->out, fd, w->name, e) : VG_ENOMEM;
    if (r == VG_OK) r = write_head(w, e);
    if (r < 0) vg_writer_close(out);
    return r;
}

int vg_writer_put(vg_writer *w, const vg_frame *f, vg_err *e)
{
    const vgi_form *h = &w->form;
    size_t n = h->count * h->width;
    vgi_part parts[2];
    int r = write_extra(w, &f->extra, e);
    if (r == VG_OK && !vgi_finite(f->values, n))
        r = vg_fail(e, VG_EINPUT, "frame '%s' holds a number that is not finite", f->name ? f->name : "");
    w->front.size = 0;
    if (r == VG_OK) r = vgi_fram_encode(&w->front, h, f, e);
    if (r == VG_OK) r = vgi_values_encode(&w->values, f->values, n, h->precision, &parts[1].data, &parts[1].size, e);
    if (r < 0) return r;
    parts[0] = (vgi_part){w->front.data, w->front.size};
    return vgi_record_write(&w->out, "FRAM", VGI_CRITICAL, parts, 2, e);
}

int vg_writer_flush(vg_writer *w, vg_err *e)
{
    return vgi_recorder_flush(&w->out, e);
}

int vg_writer_end(vg_writer *w, const vg_records *tail, vg_err *e)
{
    int r = tail ? write_extra(w, tail, e) : VG_OK;
    return r < 0 ? r : vgi_record_end_write(&w->out, e);
}

void vg_writer_abandon(vg_writer *w, const char *program, int exit_status, const char *message)
{
    w->front.size = 0;
    if (w->out.failed || vgi_fail_encode(&w->front, program, exit_status, message, NULL) < 0) return;
    if (write_record(w, "FAIL", VGI_CRITICAL, &w->front, NULL) == VG_OK && vgi_recorder_flush(&w->out, NULL) == VG_OK)
        return;
    /* nothing more can be reported */
}

void vg_writer_close(vg_writer **w)
{
    if (!*w) return;
    vgi_recorder_clear(&(*w)->out);
    vg_bytes_clear(&(*w)->front);
    vg_bytes_clear(&(*w)->values);
    free((*w)->name);
    free(*w);
    *w = NULL;
}
