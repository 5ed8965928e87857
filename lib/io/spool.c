/* spool.c: a queue of frames, first in, first out: in memory up to a limit, beyond it in an unnamed file. The bytes
 * of a frame are in frame_pack.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/frame_pack.h"

#include <errno.h>
#include <stdlib.h>
#include <unistd.h>

typedef struct held {
    struct held *next;
    unsigned char bytes[];
} held;

struct vg_spool {
    vgi_packing packing;
    size_t limit, used;     /* bytes in memory */
    held *first, *last;
    int fd;                 /* -1: not created yet */
    uint64_t read, written; /* positions in the file; equal: it is empty */
    vg_bytes frame;         /* one frame on its way to or from the file */
    vg_spool_stats stats;
    uint64_t waiting;
};

int vg_spool_new(vg_spool **out, const vg_head *h, size_t limit, vg_err *e)
{
    vg_spool *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    *s = (vg_spool){.limit = limit, .fd = -1};
    int r = vgi_packing_make(&s->packing, h, true, e);
    if (r < 0) vg_spool_free(out);
    return r;
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

vg_spool_stats vg_spool_get_stats(const vg_spool *s)
{
    return s->stats;
}

/* ---- in and out ---- */

static int keep_in_memory(vg_spool *s, const vg_frame *f, const vgi_packed *head, vg_err *e)
{
    held *node = head->bytes < SIZE_MAX - sizeof *node ? malloc(sizeof *node + head->bytes) : NULL;
    if (!node) return vg_fail(e, VG_ENOMEM, "not enough memory to hold frame '%s'", f->name);
    node->next = NULL;
    vgi_pack(&s->packing, f, head, node->bytes);
    if (s->last) s->last->next = node;
    else s->first = node;
    s->last = node;
    s->used += head->bytes;
    return VG_OK;
}

static int keep_in_file(vg_spool *s, const vg_frame *f, const vgi_packed *head, vg_err *e)
{
    if (s->fd < 0 && (s->fd = vgi_nameless_file(e)) < 0) return s->fd;
    s->frame.size = 0;
    int r = vgi_bytes_reserve(&s->frame, head->bytes, e);
    if (r < 0) return r;
    vgi_pack(&s->packing, f, head, s->frame.data);
    if ((r = vgi_pack_write(s->fd, s->written, s->frame.data, head->bytes, f->name, e)) < 0) return r;
    s->written += head->bytes;
    if (s->written > s->stats.file_bytes) s->stats.file_bytes = s->written;
    return VG_OK;
}

/* Frames in memory are older than those in the file: once the file is in use, all new frames go there until it is
 * empty again. */
int vg_spool_put(vg_spool *s, const vg_frame *f, vg_err *e)
{
    vgi_packed head;
    int r = vgi_pack_measure(&s->packing, f, &head, e);
    if (r < 0) return r;
    bool fits = s->read == s->written && head.bytes <= s->limit && s->used <= s->limit - head.bytes;
    r = fits ? keep_in_memory(s, f, &head, e) : keep_in_file(s, f, &head, e);
    if (r < 0) return r;
    if (++s->waiting > s->stats.most_frames) s->stats.most_frames = s->waiting;
    return VG_OK;
}

static int read_back(vg_spool *s, size_t n, vg_err *e)
{
    int r = vgi_bytes_reserve(&s->frame, n, e);
    return r < 0 ? r : vgi_read_back(s->fd, s->read, s->frame.data, n, e);
}

static int take_from_file(vg_spool *s, vg_frame *f, vg_err *e)
{
    vgi_packed head;
    int r = read_back(s, sizeof head, e);
    if (r < 0) return r;
    memcpy(&head, s->frame.data, sizeof head);
    r = read_back(s, head.bytes, e);
    if (r == VG_OK) r = vgi_unpack(&s->packing, s->frame.data, f, e);
    if (r < 0) return r;
    s->read += head.bytes;
    if (s->read < s->written) return VG_OK;
    s->read = s->written = 0;
    return ftruncate(s->fd, 0) ? vg_fail(e, VG_ESYS, "cannot empty a temporary file: %s", strerror(errno)) : VG_OK;
}

static int take_from_memory(vg_spool *s, vg_frame *f, vg_err *e)
{
    vgi_packed head;
    memcpy(&head, s->first->bytes, sizeof head);
    int r = vgi_unpack(&s->packing, s->first->bytes, f, e);
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
