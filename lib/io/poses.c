/* poses.c: a store of all frames of a sequence with random access: in memory up to a limit, beyond it in an unnamed
 * file. The values of a frame are stored separately from its other data, so that passes over the values copy nothing.
 * Queues of frames are in spool.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/frame_pack.h"

#include <stdlib.h>
#include <unistd.h>

/* One frame: its values, then its other data, packed. */
typedef struct kept {
    unsigned char *bytes; /* NULL: they are in the file */
    uint64_t off;         /* offset there */
    size_t packed;        /* bytes of the other data */
} kept;

struct vg_poses {
    vgi_packing packing;
    size_t value_bytes; /* per frame */
    size_t limit;
    kept *at;
    size_t n, cap;
    int fd; /* -1: not created yet */
    vg_poses_stats stats;
};

int vg_poses_new(vg_poses **out, const vg_head *h, size_t limit, vg_err *e)
{
    vg_poses *p = *out = vgi_array(1, sizeof *p, e);
    if (!p) return VG_ENOMEM;
    *p = (vg_poses){.limit = limit, .fd = -1};
    int r = vgi_packing_make(&p->packing, h, false, e);
    if (r == VG_OK && !vgi_mul(h->count, vg_head_width(h) * sizeof(double), &p->value_bytes))
        r = vg_fail(e, VG_ENOMEM, "not enough memory for a frame of %zu elements", h->count);
    if (r < 0) vg_poses_free(out);
    return r;
}

void vg_poses_free(vg_poses **out)
{
    vg_poses *p = *out;
    if (!p) return;
    for (size_t i = 0; i < p->n; i++) free(p->at[i].bytes);
    if (p->fd >= 0) close(p->fd);
    free(p->at);
    free(p);
    *out = NULL;
}

size_t vg_poses_count(const vg_poses *p)
{
    return p->n;
}

vg_poses_stats vg_poses_get_stats(const vg_poses *p)
{
    return p->stats;
}

static int keep_in_file(vg_poses *p, const vg_frame *f, kept *k, size_t bytes, vg_err *e)
{
    int r = p->fd < 0 ? p->fd = vgi_nameless_file(e) : VG_OK;
    k->off = p->stats.file_bytes;
    if (r >= 0) r = vgi_pack_write(p->fd, k->off, k->bytes, bytes, f->name, e);
    free(k->bytes);
    k->bytes = NULL;
    if (r == VG_OK) p->stats.file_bytes += bytes;
    return r;
}

int vg_poses_add(vg_poses *p, const vg_frame *f, vg_err *e)
{
    vgi_packed head;
    kept k = {0};
    size_t bytes;
    int r = vgi_grow(&p->at, &p->cap, p->n + 1, sizeof *p->at, e);
    if (r == VG_OK) r = vgi_pack_measure(&p->packing, f, &head, e);
    if (r < 0) return r;
    if (__builtin_add_overflow(p->value_bytes, head.bytes, &bytes) || !(k.bytes = malloc(bytes)))
        return vg_fail(e, VG_ENOMEM, "not enough memory to hold frame '%s'", f->name);
    k.packed = head.bytes;
    if (p->value_bytes) memcpy(k.bytes, f->values, p->value_bytes);
    vgi_pack(&p->packing, f, &head, k.bytes + p->value_bytes);
    if (bytes > p->limit || p->stats.memory_bytes > p->limit - bytes) {
        if ((r = keep_in_file(p, f, &k, bytes, e)) < 0) return r;
    } else {
        p->stats.memory_bytes += bytes;
    }
    p->at[p->n++] = k;
    return VG_OK;
}

int vg_poses_values(const vg_poses *p, size_t i, double *room, const double **values, vg_err *e)
{
    const kept *k = &p->at[i];
    *values = k->bytes ? (const double *)(const void *)k->bytes : room;
    return k->bytes ? VG_OK : vgi_read_back(p->fd, k->off, room, p->value_bytes, e);
}

int vg_poses_frame(const vg_poses *p, size_t i, vg_frame *f, vg_err *e)
{
    const kept *k = &p->at[i];
    unsigned char *packed = k->bytes ? k->bytes + p->value_bytes : vgi_array_raw(k->packed, 1, e);
    int r = packed ? VG_OK : VG_ENOMEM;
    if (r == VG_OK && !k->bytes) r = vgi_read_back(p->fd, k->off + p->value_bytes, packed, k->packed, e);
    if (r == VG_OK) r = vgi_unpack(&p->packing, packed, f, e);
    if (!k->bytes) free(packed);
    if (r < 0 || !p->value_bytes) return r;
    if (!k->bytes) return vgi_read_back(p->fd, k->off, f->values, p->value_bytes, e);
    memcpy(f->values, k->bytes, p->value_bytes);
    return VG_OK;
}
