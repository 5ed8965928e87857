/* unpack.c: decompresses a range of a file for libarchive, and checks that a compressed file is complete, because
 * libarchive neither compares gzip's checksum nor looks beyond the end of what it unpacked. Archives and their
 * members are in archive.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/unpack.h"

#include <errno.h>
#include <stdlib.h>
#include <unistd.h>

int vgi_read_at(int fd, void *to, size_t n, int64_t off, size_t *got)
{
    for (*got = 0; *got < n;) {
        ssize_t more = pread(fd, (char *)to + *got, n - *got, (off_t)(off + (int64_t)*got));
        if (more < 0 && errno == EINTR) continue;
        if (more < 0) return -1;
        if (more == 0) break;
        *got += (size_t)more;
    }
    return 0;
}

/* ---- bytes for libarchive ---- */

static la_ssize_t tap_read(struct archive *la, void *context, const void **data)
{
    vgi_tap *t = context;
    int64_t left = t->size - t->pos;
    size_t got = 0, want = left < VGI_BLOCK ? (size_t)(left > 0 ? left : 0) : VGI_BLOCK;
    if (vgi_read_at(t->fd, t->block, want, t->base + t->pos, &got) < 0) {
        t->system_error = errno;
        archive_set_error(la, errno, "%s", strerror(errno));
        return -1;
    }
    t->pos += (int64_t)got;
    *data = t->block;
    return (la_ssize_t)got;
}

static la_int64_t tap_skip(struct archive *la, void *context, la_int64_t n)
{
    (void)la;
    vgi_tap *t = context;
    int64_t left = t->size - t->pos;
    if (n > left) n = left > 0 ? left : 0;
    t->pos += n;
    return n;
}

static la_int64_t tap_seek(struct archive *la, void *context, la_int64_t off, int whence)
{
    vgi_tap *t = context;
    int64_t from = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? t->pos : t->size, to;
    if (__builtin_add_overflow(from, off, &to) || to < 0) {
        archive_set_error(la, EINVAL, "it points before its own start");
        return ARCHIVE_FATAL;
    }
    return t->pos = to;
}

int vgi_tap_open(struct archive *la, vgi_tap *t)
{
    t->pos = 0;
    archive_read_set_read_callback(la, tap_read);
    archive_read_set_skip_callback(la, tap_skip);
    archive_read_set_seek_callback(la, tap_seek);
    archive_read_set_callback_data(la, t);
    return archive_read_open1(la);
}

static void sum_begin(vgi_sum *s)
{
    for (uint32_t i = 0; i < 256; i++) {
        uint32_t c = i;
        for (int k = 0; k < 8; k++) c = c & 1 ? c >> 1 ^ 0xedb88320u : c >> 1;
        s->table[0][i] = c;
    }
    for (int t = 1; t < 4; t++)
        for (uint32_t i = 0; i < 256; i++)
            s->table[t][i] = s->table[t - 1][i] >> 8 ^ s->table[0][s->table[t - 1][i] & 0xff];
    s->crc = 0xffffffffu;
    s->bytes = 0;
}

static void sum_add(vgi_sum *s, const unsigned char *p, size_t n)
{
    uint32_t c = s->crc;
    s->bytes += n;
    for (; n >= 4; n -= 4, p += 4) {
        c ^= vgi_get32(p);
        c = s->table[3][c & 0xff] ^ s->table[2][c >> 8 & 0xff] ^ s->table[1][c >> 16 & 0xff] ^ s->table[0][c >> 24];
    }
    while (n--) c = c >> 8 ^ s->table[0][(c ^ *p++) & 0xff];
    s->crc = c;
}

/* Whether gzip's trailer (CRC, length) agrees. */
bool vgi_sum_agrees(const vgi_sum *s, const unsigned char trailer[8])
{
    return vgi_get32(trailer) == ~s->crc && vgi_get32(trailer + 4) == (uint32_t)s->bytes;
}

/* Whatever the input contains, no programs are started and no other files opened: neither filters that run a command
 * nor the mtree format. */
static void allow_filters(struct archive *la)
{
    archive_read_support_filter_gzip(la);
    archive_read_support_filter_xz(la);
    archive_read_support_filter_zstd(la);
    archive_read_support_filter_bzip2(la);
    archive_read_support_filter_lz4(la);
    archive_read_support_filter_lzip(la);
    archive_read_support_filter_lzma(la);
    archive_read_support_filter_compress(la);
}

int vgi_unpacker_open(vgi_unpacker *u, vgi_tap *t, vg_err *e)
{
    struct archive_entry *entry;
    if (!u->sum && !(u->sum = vgi_array_raw(1, sizeof *u->sum, e))) return VG_ENOMEM;
    sum_begin(u->sum);
    if (!(u->la = archive_read_new())) return vg_fail(e, VG_ENOMEM, "not enough memory to unpack");
    allow_filters(u->la);
    archive_read_support_format_raw(u->la);
    archive_read_support_format_empty(u->la);
    if (vgi_tap_open(u->la, t) < ARCHIVE_WARN) return VG_EINPUT;
    int r = archive_read_next_header(u->la, &entry);
    return r == ARCHIVE_EOF || r >= ARCHIVE_WARN ? VG_OK : VG_EINPUT; /* EOF: the contents are empty */
}

void vgi_unpacker_close(vgi_unpacker *u)
{
    if (u->la) archive_read_free(u->la);
    u->la = NULL;
}

/* The next bytes; 0 at the end, negative if libarchive finds damage. */
la_ssize_t vgi_unpack_some(vgi_unpacker *u, const void **data)
{
    size_t n = 0;
    la_int64_t off;
    int r;
    do r = archive_read_data_block(u->la, data, &n, &off);
    while (r == ARCHIVE_OK && n == 0);
    if (r == ARCHIVE_EOF) return 0;
    if (r != ARCHIVE_OK) return -1;
    sum_add(u->sum, *data, n);
    return (la_ssize_t)n;
}

la_ssize_t vgi_unpacker_read(struct archive *la, void *context, const void **data)
{
    vgi_unpacker *u = context;
    la_ssize_t n = vgi_unpack_some(u, data);
    if (n < 0) {
        const char *why = archive_error_string(u->la);
        archive_set_error(la, archive_errno(u->la), "%s", why ? why : "truncated");
    }
    return n;
}

/* ---- completeness ---- */

/* Enough for files joined from several; a false match of the signature costs one attempt. */
enum { ATTEMPTS = 64 };

/* Unpack the range `part` of a gzip file; returns whether it is one complete stream. */
static bool gzip_part_whole(const vgi_tap *file, int64_t from, int64_t to)
{
    unsigned char *block = malloc(VGI_BLOCK), trailer[8];
    vgi_tap part = {.fd = file->fd, .base = file->base + from, .size = to - from, .block = block};
    vgi_unpacker u = {0};
    const void *data;
    la_ssize_t n = -1;
    size_t got = 0;
    if (block && vgi_unpacker_open(&u, &part, NULL) == VG_OK)
        while ((n = vgi_unpack_some(&u, &data)) > 0) continue;
    bool whole = n == 0 && vgi_read_at(part.fd, trailer, 8, part.base + part.size - 8, &got) == 0 && got == 8 &&
                 vgi_sum_agrees(u.sum, trailer);
    vgi_unpacker_close(&u);
    free(u.sum);
    free(block);
    return whole;
}

/* The next position after `from` where a gzip stream could start, or `end`. */
static int64_t next_gzip(const vgi_tap *file, unsigned char *block, int64_t from, int64_t end)
{
    for (size_t got; from < end; from += (int64_t)got - 2) {
        size_t want = end - from < VGI_BLOCK ? (size_t)(end - from) : VGI_BLOCK;
        if (vgi_read_at(file->fd, block, want, file->base + from, &got) < 0 || got < 3) break;
        const unsigned char *hit = memmem(block, got, "\x1f\x8b\x08", 3);
        if (hit) return from + (hit - block);
    }
    return end;
}

/* Several gzip streams joined into one file: each must agree with its own trailer. Called only if the file is not one
 * complete stream. */
bool vgi_gzip_parts_whole(const vgi_tap *file, int64_t end)
{
    enum { SHORTEST = 18 };
    unsigned char *block = malloc(VGI_BLOCK);
    bool whole = block != NULL;
    for (int64_t from = 0; whole && from < end;) {
        int64_t to = from + SHORTEST;
        whole = false;
        for (int i = 0; !whole && i < ATTEMPTS && to < end; i++) {
            to = next_gzip(file, block, to, end);
            whole = gzip_part_whole(file, from, to);
            if (!whole) to++;
        }
        from = to;
    }
    free(block);
    return whole;
}

bool vgi_zero_to_end(const vgi_tap *file, int64_t from)
{
    unsigned char *block = file->block;
    size_t got;
    while (vgi_read_at(file->fd, block, VGI_BLOCK, file->base + from, &got) == 0 && got > 0) {
        if (block[0] || memcmp(block, block + 1, got - 1)) return false;
        from += (int64_t)got;
    }
    return from >= file->size;
}
