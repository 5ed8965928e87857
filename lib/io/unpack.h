/* unpack.h: shared by the files that use libarchive: unpack.c, archive.c, pack.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_UNPACK_H
#define VG_UNPACK_H

#include "io/io.h"

#include <archive.h>
#include <archive_entry.h>
#include <locale.h>

enum { VGI_BLOCK = 256 * 1024 };

/* libarchive converts names to the encoding of the thread's locale and loses what does not fit. Around every call
 * that touches names the thread uses UTF-8, whatever the program's locale is; without such a locale on the machine,
 * ASCII names still work. */
static inline locale_t vgi_utf8_locale(void)
{
    return newlocale(LC_CTYPE_MASK, "C.UTF-8", (locale_t)0);
}

static inline locale_t vgi_enter_utf8(locale_t utf8)
{
    return utf8 ? uselocale(utf8) : (locale_t)0;
}

static inline void vgi_leave_utf8(locale_t before)
{
    if (before) uselocale(before);
}

/* vgi_read_at: up to n bytes from off on; *got is smaller only at the end of the file. 0, or -1 with errno. */
int vgi_read_at(int fd, void *to, size_t n, int64_t off, size_t *got) VG_MUST_CHECK;

/* A range of a file. */
typedef struct vgi_tap {
    int fd;
    int64_t base, size, pos; /* pos from base */
    unsigned char *block;    /* VGI_BLOCK bytes, which libarchive uses until the next call */
    int system_error;        /* errno of a failed read */
} vgi_tap;

/* vgi_tap_open: archive_read_open on the range, from its start. */
int vgi_tap_open(struct archive *la, vgi_tap *t);

/* CRC-32 as in gzip, four bytes at a time (Sarwate's table and three shifted by whole bytes). */
typedef struct vgi_sum {
    uint32_t table[4][256], crc;
    uint64_t bytes;
} vgi_sum;

/* vgi_sum_agrees: whether gzip's trailer (CRC, length) agrees. */
bool vgi_sum_agrees(const vgi_sum *s, const unsigned char trailer[8]);

/* A compressed file being unpacked. */
typedef struct vgi_unpacker {
    struct archive *la; /* NULL: not in use */
    vgi_sum *sum;
} vgi_unpacker;

/* vgi_unpacker_open: VG_EINPUT if libarchive refuses it; u->la has the reason. */
int vgi_unpacker_open(vgi_unpacker *u, vgi_tap *t, vg_err *e) VG_MUST_CHECK;
void vgi_unpacker_close(vgi_unpacker *u);
/* vgi_unpack_some: the next bytes; 0 at the end, negative if libarchive finds damage. */
la_ssize_t vgi_unpack_some(vgi_unpacker *u, const void **data);
/* vgi_unpacker_read: the same as a callback of a second libarchive reader. */
la_ssize_t vgi_unpacker_read(struct archive *la, void *context, const void **data);

/* vgi_gzip_parts_whole: whether the file up to end consists of several gzip streams, each of which agrees with its
 * own trailer. Called only if it is not one complete stream. */
bool vgi_gzip_parts_whole(const vgi_tap *file, int64_t end);
/* vgi_zero_to_end: whether there are only zeros from there on. */
bool vgi_zero_to_end(const vgi_tap *file, int64_t from);

#endif
