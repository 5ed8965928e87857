/* frame_pack.c: a frame as one run of bytes.
 * Leaves out where the bytes are kept (spool.c, poses.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/frame_pack.h"
#include "model/frame.h"

#include <errno.h>
#include <stdlib.h>
#include <unistd.h>

int vgi_packing_make(vgi_packing *p, const vg_head *h, bool values, vg_err *e)
{
    bool graph = h->kind == VG_VECTORS || h->kind == VG_DEFORMATIONS;
    *p = (vgi_packing){.h = h};
    if (vgi_mul(values ? h->count : 0, vg_kind_width(h->kind), &p->values) &&
        vgi_mul(graph ? h->nanchors : 0, 3, &p->anchors))
        return VG_OK;
    return vg_fail(e, VG_ENOMEM, "not enough memory for a frame of %zu elements", h->count);
}

static bool add(size_t *sum, size_t n, size_t size)
{
    size_t bytes;
    return vgi_mul(n, size, &bytes) && !__builtin_add_overflow(*sum, bytes, sum);
}

int vgi_pack_measure(const vgi_packing *s, const vg_frame *f, vgi_packed *to, vg_err *e)
{
    *to = (vgi_packed){.bytes = sizeof *to,
                  .name = strlen(f->name),
                  .records = f->extra.n,
                  .pins = f->npins,
                  .turns = f->nturns,
                  .time = f->time,
                  .has_time = f->has_time,
                  .root = {f->root[0], f->root[1], f->root[2]}};
    bool ok = add(&to->bytes, to->name, 1) && add(&to->bytes, to->pins, sizeof *f->pins) &&
              add(&to->bytes, to->turns, 4 * sizeof *f->turns) && add(&to->bytes, s->anchors, sizeof(double)) &&
              add(&to->bytes, s->values, sizeof(double));
    if (f->has_scalars) {
        to->scalars = s->h->body.mesh.nv;
        to->scalars_name = strlen(f->scalars_name) + 1, to->scalars_unit = strlen(f->scalars_unit) + 1;
        ok = ok && add(&to->bytes, to->scalars_name, 1) && add(&to->bytes, to->scalars_unit, 1) &&
             add(&to->bytes, to->scalars, sizeof(double));
    }
    for (size_t i = 0; ok && i < f->extra.n; i++)
        ok = add(&to->bytes, 1, sizeof(vg_record)) && add(&to->bytes, f->extra.at[i].payload.size, 1);
    return ok ? VG_OK : vg_fail(e, VG_ENOMEM, "not enough memory to hold frame '%s'", f->name);
}

static unsigned char *append(unsigned char *to, const void *from, size_t n)
{
    if (n) memcpy(to, from, n);
    return to + n;
}

void vgi_pack(const vgi_packing *s, const vg_frame *f, const vgi_packed *head, unsigned char *to)
{
    to = append(to, head, sizeof *head);
    to = append(to, f->name, head->name);
    for (size_t i = 0; i < head->records; i++) {
        to = append(to, &f->extra.at[i], sizeof f->extra.at[i]);
        to = append(to, f->extra.at[i].payload.data, f->extra.at[i].payload.size);
    }
    to = append(to, f->pins, head->pins * sizeof *f->pins);
    to = append(to, f->turns, head->turns * 4 * sizeof *f->turns);
    to = append(to, f->anchors, s->anchors * sizeof *f->anchors);
    to = append(to, f->values, s->values * sizeof *f->values);
    to = append(to, f->scalars_name, head->scalars_name);
    to = append(to, f->scalars_unit, head->scalars_unit);
    append(to, f->scalars, head->scalars * sizeof *f->scalars);
}

static const unsigned char *take(const unsigned char *from, void *to, size_t n)
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
        from = take(from, r, sizeof *r);
        size_t size = r->payload.size;
        r->payload = (vg_bytes){0};
        if (vgi_bytes_append(&r->payload, from, size, e) < 0) return vg_records_clear(to), NULL;
        from += size;
    }
    return from;
}

static const unsigned char *unpack_pins(const unsigned char *from, size_t n, vg_frame *f, vg_err *e)
{
    uint32_t *pins = vgi_array_raw(n, sizeof *pins, e);
    if (!pins) return NULL;
    from = take(from, pins, n * sizeof *pins);
    int r = vg_frame_pin(f, pins, n, e);
    free(pins);
    return r < 0 ? NULL : from;
}

static const unsigned char *unpack_turns(const unsigned char *from, size_t n, vg_frame *f, vg_err *e)
{
    double *turns = vgi_array_raw(n, 4 * sizeof *turns, e);
    if (!turns) return NULL;
    from = take(from, turns, n * 4 * sizeof *turns);
    int r = vg_frame_turn(f, turns, n, e);
    free(turns);
    return r < 0 ? NULL : from;
}

static int unpack_scalars(const unsigned char *from, const vgi_packed *head, vg_frame *f, vg_err *e)
{
    const char *name = (const char *)from, *unit = name + head->scalars_name;
    int r = vgi_frame_scalars(f, name, head->scalars_name - 1, unit, head->scalars_unit - 1, head->scalars, e);
    if (r == VG_OK)
        take(from + head->scalars_name + head->scalars_unit, f->scalars, head->scalars * sizeof *f->scalars);
    return r;
}

int vgi_unpack(const vgi_packing *s, const unsigned char *from, vg_frame *f, vg_err *e)
{
    vgi_packed head;
    from = take(from, &head, sizeof head);
    char *name = vgi_copy_string((const char *)from, head.name, e);
    int r = name ? vg_frame_rename(f, name, e) : VG_ENOMEM;
    free(name);
    if (r == VG_OK) r = vg_frame_shape(f, s->h, e);
    if (r < 0) return r;
    if (!(from = unpack_records(from + head.name, head.records, &f->extra, e))) return VG_ENOMEM;
    if (!(from = unpack_pins(from, head.pins, f, e))) return VG_ENOMEM;
    if (!(from = unpack_turns(from, head.turns, f, e))) return VG_ENOMEM;
    f->has_time = head.has_time, f->time = head.time;
    memcpy(f->root, head.root, sizeof f->root);
    from = take(from, f->anchors, s->anchors * sizeof *f->anchors);
    from = take(from, f->values, s->values * sizeof *f->values);
    return head.scalars_name ? unpack_scalars(from, &head, f, e) : VG_OK;
}

int vgi_pack_write(int fd, uint64_t off, const void *from, size_t n, const char *name, vg_err *e)
{
    for (size_t done = 0; done < n;) {
        ssize_t some = pwrite(fd, (const unsigned char *)from + done, n - done, (off_t)(off + done));
        if (some < 0 && errno == EINTR) continue;
        if (some < 0)
            return vg_fail(e, VG_ESYS, "cannot hold frame '%s' in a temporary file: %s: set TMPDIR to another place",
                           name, strerror(errno));
        done += (size_t)some;
    }
    return VG_OK;
}
