/* frame_pack.c: a frame as one block of bytes. spool.c and poses.c store the blocks.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/frame_pack.h"
#include "model/frame.h"

#include <errno.h>
#include <stdlib.h>
#include <unistd.h>

int vgi_packing_make(vgi_packing *p, const vg_head *h, bool values, vg_err *e)
{
    *p = (vgi_packing){.h = h};
    if (vgi_mul(values ? h->count : 0, vg_head_width(h), &p->values)) return VG_OK;
    return vg_fail(e, VG_ENOMEM, "not enough memory for a frame of %zu elements", h->count);
}

static bool add_size(size_t *sum, size_t n, size_t size)
{
    size_t bytes;
    return vgi_mul(n, size, &bytes) && !__builtin_add_overflow(*sum, bytes, sum);
}

/* The header of a channel's texts and numbers. */
typedef struct channel_front {
    size_t name, unit, element, width, count;
    vg_precision precision;
    bool list;
} channel_front;

static channel_front front_of(const vg_channel *c)
{
    return (channel_front){.name = strlen(c->name), .unit = strlen(c->unit), .element = strlen(c->element_name),
                           .width = c->width, .count = c->count, .precision = c->precision,
                           .list = c->vertices != NULL};
}

/* Size of the numbers or of the list in bytes. */
static size_t data_of(const channel_front *c)
{
    return c->width * c->count * (c->list ? sizeof(uint32_t) : sizeof(double));
}

int vgi_pack_measure(const vgi_packing *s, const vg_frame *f, vgi_packed *to, vg_err *e)
{
    *to = (vgi_packed){.bytes = sizeof *to,
                       .name = strlen(f->name),
                       .records = f->extra.n,
                       .channels = f->nchannels,
                       .time = f->time,
                       .has_time = f->has_time,
                       .root = {f->root[0], f->root[1], f->root[2]}};
    bool ok = add_size(&to->bytes, to->name, 1) && add_size(&to->bytes, s->values, sizeof(double));
    for (size_t i = 0; ok && i < f->nchannels; i++) {
        channel_front c = front_of(&f->channels[i]);
        ok = add_size(&to->bytes, 1, sizeof c) && add_size(&to->bytes, c.name, 1) && add_size(&to->bytes, c.unit, 1) &&
             add_size(&to->bytes, c.element, 1) && add_size(&to->bytes, data_of(&c), 1);
    }
    for (size_t i = 0; ok && i < f->extra.n; i++)
        ok = add_size(&to->bytes, 1, sizeof(vg_record)) && add_size(&to->bytes, f->extra.at[i].payload.size, 1);
    return ok ? VG_OK : vg_fail(e, VG_ENOMEM, "not enough memory to hold frame '%s'", f->name);
}

static unsigned char *append_bytes(unsigned char *to, const void *from, size_t n)
{
    if (n) memcpy(to, from, n);
    return to + n;
}

static unsigned char *pack_channel(const vg_channel *c, unsigned char *to)
{
    channel_front head = front_of(c);
    to = append_bytes(to, &head, sizeof head);
    to = append_bytes(to, c->name, head.name);
    to = append_bytes(to, c->unit, head.unit);
    to = append_bytes(to, c->element_name, head.element);
    return append_bytes(to, head.list ? (const void *)c->vertices : c->numbers, data_of(&head));
}

void vgi_pack(const vgi_packing *s, const vg_frame *f, const vgi_packed *head, unsigned char *to)
{
    to = append_bytes(to, head, sizeof *head);
    to = append_bytes(to, f->name, head->name);
    for (size_t i = 0; i < head->records; i++) {
        to = append_bytes(to, &f->extra.at[i], sizeof f->extra.at[i]);
        to = append_bytes(to, f->extra.at[i].payload.data, f->extra.at[i].payload.size);
    }
    for (size_t i = 0; i < head->channels; i++) to = pack_channel(&f->channels[i], to);
    append_bytes(to, f->values, s->values * sizeof *f->values);
}

static const unsigned char *take_bytes(const unsigned char *from, void *to, size_t n)
{
    if (n) memcpy(to, from, n);
    return from + n;
}

static const unsigned char *unpack_records(const unsigned char *from, size_t n, vg_records *to, vg_err *e)
{
    vg_records_clear(to);
    if (n && !(to->at = vgi_array(n, sizeof *to->at, e))) return NULL;
    for (; to->n < n; to->n++) {
        vg_record *r = &to->at[to->n];
        from = take_bytes(from, r, sizeof *r);
        size_t size = r->payload.size;
        r->payload = (vg_bytes){0};
        if (vgi_bytes_append(&r->payload, from, size, e) < 0) return vg_records_clear(to), NULL;
        from += size;
    }
    return from;
}

static const unsigned char *unpack_channel(const unsigned char *from, vg_frame *f, vg_err *e)
{
    channel_front head;
    vg_channel *c;
    from = take_bytes(from, &head, sizeof head);
    vgi_channel_texts t = {.name_bytes = head.name, .unit_bytes = head.unit, .element_bytes = head.element};
    t.name = (const char *)from, t.unit = t.name + head.name, t.element = t.unit + head.unit;
    if (vgi_frame_add(f, &t, head.width, head.count, &c, e) < 0) return NULL;
    c->precision = head.precision;
    from += head.name + head.unit + head.element;
    return take_bytes(from, head.list ? (void *)c->vertices : c->numbers, data_of(&head));
}

int vgi_unpack(const vgi_packing *s, const unsigned char *from, vg_frame *f, vg_err *e)
{
    vgi_packed head;
    from = take_bytes(from, &head, sizeof head);
    char *name = vgi_copy_string((const char *)from, head.name, e);
    int r = name ? vg_frame_rename(f, name, e) : VG_ENOMEM;
    free(name);
    if (r == VG_OK) r = vg_frame_shape(f, s->h, e);
    if (r < 0) return r;
    if (!(from = unpack_records(from + head.name, head.records, &f->extra, e))) return VG_ENOMEM;
    vg_frame_drop_all(f);
    for (size_t i = 0; i < head.channels; i++)
        if (!(from = unpack_channel(from, f, e))) return VG_ENOMEM;
    f->has_time = head.has_time, f->time = head.time;
    memcpy(f->root, head.root, sizeof f->root);
    take_bytes(from, f->values, s->values * sizeof *f->values);
    return VG_OK;
}

int vgi_pack_write(int fd, uint64_t off, const void *from, size_t n, const char *name, vg_err *e)
{
    for (size_t done = 0; done < n;) {
        ssize_t some = pwrite(fd, (const unsigned char *)from + done, n - done, (off_t)(off + done));
        if (some < 0 && errno == EINTR) continue;
        if (some < 0)
            return vg_fail(e, VG_ESYS, "cannot hold frame '%s' in a temporary file: %s: set TMPDIR to another "
                                       "directory",
                           name, strerror(errno));
        done += (size_t)some;
    }
    return VG_OK;
}
