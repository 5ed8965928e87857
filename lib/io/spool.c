/* spool.c: frames that wait for their turn, first in, first out: in memory up to a limit, behind it in a file
 * without a name. Leaves out what they wait for. A frame is one run of bytes, the same in memory and in the file,
 * which nobody else reads.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"
#include "model/frame.h"

#include <errno.h>
#include <stdlib.h>
#include <unistd.h>

/* What precedes a frame's name, records, pins, turns, anchors, values and scalars. */
typedef struct front {
    size_t bytes; /* of the whole frame, this included */
    size_t name, records, pins, turns;
    size_t scalars, scalars_name, scalars_unit; /* 0 numbers, or those of the mesh; their texts with terminators */
    double time, root[3];
    bool has_time;
} front;

typedef struct held {
    struct held *next;
    unsigned char bytes[];
} held;

struct vg_spool {
    const vg_head *h;
    size_t anchors, values; /* numbers of a frame */
    size_t limit, used;     /* bytes in memory */
    held *first, *last;
    int fd;                 /* -1: no file was needed yet */
    uint64_t read, written; /* places in the file; equal: nothing is in it */
    vg_bytes frame;         /* one frame on its way into or out of the file */
    vg_spool_facts facts;
    uint64_t waiting;
};

int vg_spool_new(vg_spool **out, const vg_head *h, size_t limit, vg_err *e)
{
    vg_spool *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    bool graph = h->kind == VG_VECTORS || h->kind == VG_DEFORMATIONS;
    *s = (vg_spool){.h = h, .limit = limit, .fd = -1};
    if (vgi_mul(h->count, vg_kind_width(h->kind), &s->values) && vgi_mul(graph ? h->nanchors : 0, 3, &s->anchors))
        return VG_OK;
    vg_spool_free(out);
    return vg_fail(e, VG_ENOMEM, "not enough memory for a frame of %zu elements", h->count);
}

static void drop_first(vg_spool *s)
{
    held *node = s->first;
    s->first = node->next;
    if (!s->first) s->last = NULL;
    free(node);
}

void vg_spool_free(vg_spool **out)
{
    vg_spool *s = *out;
    if (!s) return;
    while (s->first) drop_first(s);
    if (s->fd >= 0) close(s->fd);
    vg_bytes_clear(&s->frame);
    free(s);
    *out = NULL;
}

vg_spool_facts vg_spool_get_facts(const vg_spool *s)
{
    return s->facts;
}

/* ---- a frame as bytes ---- */

static bool add(size_t *sum, size_t n, size_t size)
{
    size_t bytes;
    return vgi_mul(n, size, &bytes) && !__builtin_add_overflow(*sum, bytes, sum);
}

static int measure(const vg_spool *s, const vg_frame *f, front *to, vg_err *e)
{
    *to = (front){.bytes = sizeof *to,
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

static void pack(const vg_spool *s, const vg_frame *f, const front *head, unsigned char *to)
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

static int unpack_scalars(const unsigned char *from, const front *head, vg_frame *f, vg_err *e)
{
    const char *name = (const char *)from, *unit = name + head->scalars_name;
    int r = vgi_frame_scalars(f, name, head->scalars_name - 1, unit, head->scalars_unit - 1, head->scalars, e);
    if (r == VG_OK)
        take(from + head->scalars_name + head->scalars_unit, f->scalars, head->scalars * sizeof *f->scalars);
    return r;
}

static int unpack(const vg_spool *s, const unsigned char *from, vg_frame *f, vg_err *e)
{
    front head;
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

/* ---- in and out ---- */

static int keep_in_memory(vg_spool *s, const vg_frame *f, const front *head, vg_err *e)
{
    held *node = head->bytes < SIZE_MAX - sizeof *node ? malloc(sizeof *node + head->bytes) : NULL;
    if (!node) return vg_fail(e, VG_ENOMEM, "not enough memory to hold frame '%s'", f->name);
    node->next = NULL;
    pack(s, f, head, node->bytes);
    if (s->last) s->last->next = node;
    else s->first = node;
    s->last = node;
    s->used += head->bytes;
    return VG_OK;
}

static int keep_in_file(vg_spool *s, const vg_frame *f, const front *head, vg_err *e)
{
    if (s->fd < 0 && (s->fd = vgi_nameless_file(e)) < 0) return s->fd;
    s->frame.size = 0;
    int r = vgi_bytes_reserve(&s->frame, head->bytes, e);
    if (r < 0) return r;
    pack(s, f, head, s->frame.data);
    for (size_t done = 0; done < head->bytes;) {
        ssize_t n = pwrite(s->fd, s->frame.data + done, head->bytes - done, (off_t)(s->written + done));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0)
            return vg_fail(e, VG_ESYS, "cannot hold frame '%s' in a temporary file: %s: set TMPDIR to another place",
                           f->name, strerror(errno));
        done += (size_t)n;
    }
    s->written += head->bytes;
    if (s->written > s->facts.file_bytes) s->facts.file_bytes = s->written;
    return VG_OK;
}

/* What is in memory is older than what is in the file: once the file is begun,
 * it takes all until it is empty again. */
int vg_spool_put(vg_spool *s, const vg_frame *f, vg_err *e)
{
    front head;
    int r = measure(s, f, &head, e);
    if (r < 0) return r;
    bool fits = s->read == s->written && head.bytes <= s->limit && s->used <= s->limit - head.bytes;
    r = fits ? keep_in_memory(s, f, &head, e) : keep_in_file(s, f, &head, e);
    if (r < 0) return r;
    if (++s->waiting > s->facts.most_frames) s->facts.most_frames = s->waiting;
    return VG_OK;
}

static int read_back(vg_spool *s, size_t n, vg_err *e)
{
    int r = vgi_bytes_reserve(&s->frame, n, e);
    return r < 0 ? r : vgi_read_back(s->fd, s->read, s->frame.data, n, e);
}

static int take_from_file(vg_spool *s, vg_frame *f, vg_err *e)
{
    front head;
    int r = read_back(s, sizeof head, e);
    if (r < 0) return r;
    memcpy(&head, s->frame.data, sizeof head);
    r = read_back(s, head.bytes, e);
    if (r == VG_OK) r = unpack(s, s->frame.data, f, e);
    if (r < 0) return r;
    s->read += head.bytes;
    if (s->read < s->written) return VG_OK;
    s->read = s->written = 0;
    return ftruncate(s->fd, 0) ? vg_fail(e, VG_ESYS, "cannot empty a temporary file: %s", strerror(errno)) : VG_OK;
}

static int take_from_memory(vg_spool *s, vg_frame *f, vg_err *e)
{
    front head;
    memcpy(&head, s->first->bytes, sizeof head);
    int r = unpack(s, s->first->bytes, f, e);
    if (r < 0) return r;
    s->used -= head.bytes;
    drop_first(s);
    return VG_OK;
}

int vg_spool_next(vg_spool *s, vg_frame *f, vg_err *e)
{
    if (!s->waiting) return 0;
    int r = s->first ? take_from_memory(s, f, e) : take_from_file(s, f, e);
    if (r < 0) return r;
    s->waiting--;
    return 1;
}
