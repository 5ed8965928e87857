/* sequence.c: the table of formats that hold a whole sequence in one file, and the output buffer of such a file. The
 * formats are in caches.c, npy.c, npz.c, usda.c, skeleton_text.c and others; files are opened in source.c and sink.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <errno.h>
#include <stdlib.h>
#include <unistd.h>

static const vgi_sequence_format *const formats[] = {
    &vgi_sequence_pc2, &vgi_sequence_mdd, &vgi_sequence_npy,  &vgi_sequence_npz,      &vgi_sequence_usda,
    &vgi_sequence_bvh, &vgi_sequence_glb, &vgi_sequence_gltf, &vgi_sequence_skeleton, &vgi_sequence_joints};
enum { FORMATS = sizeof formats / sizeof *formats };

const vgi_sequence_format *vgi_sequence_by_name(const char *name, size_t n)
{
    for (size_t i = 0; i < FORMATS; i++)
        if (strlen(formats[i]->name) == n && !memcmp(formats[i]->name, name, n)) return formats[i];
    return NULL;
}

const vgi_sequence_format *vgi_sequence_by_suffix(const char *file_name)
{
    size_t n = strlen(file_name);
    for (size_t i = 0; i < FORMATS; i++)
        if (vgi_has_suffix(file_name, n, formats[i]->suffix)) return formats[i];
    return NULL;
}

const vgi_sequence_format *vgi_packable(const char *file_name)
{
    const vgi_sequence_format *f = vgi_sequence_by_suffix(file_name);
    return f && f->open && f->keeps & VGI_KEEPS_FACES ? f : NULL;
}

const vgi_sequence_format *vgi_sequence_by_content(const unsigned char *data, size_t n)
{
    for (size_t i = 0; i < FORMATS; i++)
        if (formats[i]->sniff && formats[i]->sniff(data, n)) return formats[i];
    return NULL;
}

const char *vgi_sequence_names(void)
{
    return "pc2, mdd, npy, npz, usda, bvh, glb, gltf";
}

const char *vgi_kinds_read(void)
{
    return "OBJ, PLY, OFF, STL, GLB, glTF, BVH, skeletons as text, PC2, MDD, NPY, NPZ";
}

/* ---- output ---- */

enum { BLOCK = 1 << 20 };

int vgi_output_flush(vgi_output *o, vg_err *e)
{
    int r = vgi_write_all(o->fd, o->waiting.data, o->waiting.size, o->name, e);
    o->waiting.size = 0;
    return r;
}

int vgi_output_put(vgi_output *o, const void *data, size_t n, vg_err *e)
{
    int r = vgi_bytes_append(&o->waiting, data, n, e);
    o->size += n;
    return r == VG_OK && o->waiting.size >= BLOCK ? vgi_output_flush(o, e) : r;
}

static int write_at(const vgi_output *o, uint64_t off, const unsigned char *p, size_t n, vg_err *e)
{
    while (n > 0) {
        ssize_t done = pwrite(o->fd, p, n, (off_t)off);
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) return vg_fail(e, VG_ESYS, "cannot write to '%s': %s", o->name, strerror(errno));
        p += done, off += (uint64_t)done, n -= (size_t)done;
    }
    return VG_OK;
}

int vgi_output_patch(vgi_output *o, uint64_t off, const void *data, size_t n, vg_err *e)
{
    const unsigned char *p = data;
    uint64_t written = o->size - o->waiting.size;
    size_t before = off >= written ? 0 : written - off < n ? (size_t)(written - off) : n;
    int r = write_at(o, off, p, before, e);
    if (before < n) memcpy(o->waiting.data + (off + before - written), p + before, n - before);
    return r;
}

int vgi_output_copy(vgi_output *o, int fd, uint64_t n, vg_err *e)
{
    unsigned char *block = vgi_array_raw(BLOCK, 1, e);
    int r = block ? VG_OK : VG_ENOMEM;
    for (uint64_t off = 0; r == VG_OK && off < n; off += BLOCK) {
        size_t some = n - off < BLOCK ? (size_t)(n - off) : BLOCK;
        r = vgi_read_back(fd, off, block, some, e);
        if (r == VG_OK) r = vgi_output_put(o, block, some, e);
    }
    free(block);
    return r;
}

void vgi_output_clear(vgi_output *o)
{
    vg_bytes_clear(&o->waiting);
    *o = (vgi_output){.fd = -1};
}
