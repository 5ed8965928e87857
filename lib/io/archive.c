/* archive.c: mesh files in and out of archives; the one file that knows libarchive.
 * Leaves out what the files mean: contents are bytes here.
 *
 * Reading lists the names first. When the archive has its mesh files in natural order, as nearly all do, a second
 * pass hands them out one by one; otherwise they are unpacked once into a file without a name. A compressed archive
 * is read by two readers of libarchive, one behind the other: the first unpacks, and its bytes are summed and read to
 * the last one before anything is handed out, because libarchive neither compares the checksum of gzip nor looks
 * behind the end mark of a tar.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <archive.h>
#include <archive_entry.h>
#include <errno.h>
#include <fcntl.h>
#include <locale.h>
#include <stdlib.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

/* A member is in memory as a whole; the total guards the time and the spool. Nobody's sequence comes near. */
const vgi_limits vgi_archive_limits = {
    .member_bytes = (uint64_t)16 << 30, .total_bytes = (uint64_t)64 << 30, .members = (size_t)1 << 24};

enum { BLOCK = 256 * 1024 };

/* libarchive turns names into the encoding of the thread's locale and loses what does not fit. Around every call that
 * touches names the thread speaks UTF-8, whatever the program's locale is; without such a locale on the machine,
 * ASCII names still work. */
static locale_t utf8_locale(void)
{
    return newlocale(LC_CTYPE_MASK, "C.UTF-8", (locale_t)0);
}

static locale_t enter_utf8(locale_t utf8)
{
    return utf8 ? uselocale(utf8) : (locale_t)0;
}

static void leave_utf8(locale_t before)
{
    if (before) uselocale(before);
}

/* ---- files without a name ---- */

int vgi_nameless_file(vg_err *e)
{
    const char *dir = getenv("TMPDIR");
    if (!dir || !*dir) dir = "/tmp";
    int fd = open(dir, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (fd >= 0) return fd;
    char path[4096]; /* not every file system knows O_TMPFILE */
    int n = snprintf(path, sizeof path, "%s/vg-XXXXXX", dir);
    if (n > 0 && (size_t)n < sizeof path && (fd = mkostemp(path, O_CLOEXEC)) >= 0) {
        unlink(path);
        return fd;
    }
    return vg_fail(e, VG_ESYS, "cannot make a temporary file in '%s': %s", dir, strerror(errno));
}

int vgi_spool(vgi_input *in, uint64_t limit, int *out, vg_err *e)
{
    unsigned char *block = vgi_array_raw(BLOCK, 1, e);
    if (!block) return VG_ENOMEM;
    int fd = vgi_nameless_file(e), r = fd < 0 ? fd : VG_OK;
    uint64_t total = 0;
    while (r == VG_OK) {
        size_t got = 0;
        r = vgi_input_read(in, block, BLOCK, &got, e);
        bool end = r == VG_ETRUNC;
        if (r < 0 && !end) break;
        total += got;
        r = total > limit ? vg_fail(e, VG_EINPUT, "'%s' is larger than %llu bytes", vgi_input_name(in),
                                    (unsigned long long)limit)
                          : vgi_write_all(fd, block, got, "temporary file", e);
        if (end) break;
    }
    free(block);
    if (r < 0 && fd >= 0) close(fd);
    else *out = fd;
    return r;
}

static int read_at(int fd, void *to, size_t n, int64_t off, size_t *got)
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

/* A range of a file. */
typedef struct tap {
    int fd;
    int64_t base, size, pos; /* pos from base */
    unsigned char *block;    /* BLOCK bytes, what libarchive looks at until the next call */
    int system_error;        /* errno of a read that failed */
} tap;

static la_ssize_t tap_read(struct archive *la, void *context, const void **data)
{
    tap *t = context;
    int64_t left = t->size - t->pos;
    size_t got = 0, want = left < BLOCK ? (size_t)(left > 0 ? left : 0) : BLOCK;
    if (read_at(t->fd, t->block, want, t->base + t->pos, &got) < 0) {
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
    tap *t = context;
    int64_t left = t->size - t->pos;
    if (n > left) n = left > 0 ? left : 0;
    t->pos += n;
    return n;
}

static la_int64_t tap_seek(struct archive *la, void *context, la_int64_t off, int whence)
{
    tap *t = context;
    int64_t from = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? t->pos : t->size, to;
    if (__builtin_add_overflow(from, off, &to) || to < 0) {
        archive_set_error(la, EINVAL, "it points before its own start");
        return ARCHIVE_FATAL;
    }
    return t->pos = to;
}

static int open_tap(struct archive *la, tap *t)
{
    t->pos = 0;
    archive_read_set_read_callback(la, tap_read);
    archive_read_set_skip_callback(la, tap_skip);
    archive_read_set_seek_callback(la, tap_seek);
    archive_read_set_callback_data(la, t);
    return archive_read_open1(la);
}

/* CRC-32 as gzip has it, four bytes at a time (Sarwate's table and three shifted by whole bytes). */
typedef struct sum {
    uint32_t table[4][256], crc;
    uint64_t bytes;
} sum;

static void sum_begin(sum *s)
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

static void sum_add(sum *s, const unsigned char *p, size_t n)
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

/* Does gzip's trailer (CRC, length) say the same? */
static bool sum_agrees(const sum *s, const unsigned char trailer[8])
{
    return vgi_get32(trailer) == ~s->crc && vgi_get32(trailer + 4) == (uint32_t)s->bytes;
}

/* A compressed file being unpacked. */
typedef struct unpacker {
    struct archive *la; /* NULL: not in use */
    sum *sum;
} unpacker;

/* No programs are started and no other files opened, whatever the input says: neither filters that run a command, nor
 * the mtree format. */
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

static void allow_formats(struct archive *la)
{
    archive_read_support_format_tar(la);
    archive_read_support_format_zip_seekable(la);
    archive_read_support_format_7zip(la);
    archive_read_support_format_cpio(la);
    archive_read_support_format_rar(la);
    archive_read_support_format_rar5(la);
    archive_read_support_format_cab(la);
    archive_read_support_format_lha(la);
    archive_read_support_format_xar(la);
    archive_read_support_format_iso9660(la);
    archive_read_support_format_empty(la);
    archive_read_support_format_raw(la);
}

static int unpacker_open(unpacker *u, tap *t, vg_err *e)
{
    struct archive_entry *entry;
    if (!u->sum && !(u->sum = vgi_array_raw(1, sizeof *u->sum, e))) return VG_ENOMEM;
    sum_begin(u->sum);
    if (!(u->la = archive_read_new())) return vg_fail(e, VG_ENOMEM, "not enough memory to unpack");
    allow_filters(u->la);
    archive_read_support_format_raw(u->la);
    archive_read_support_format_empty(u->la);
    if (open_tap(u->la, t) < ARCHIVE_WARN) return VG_EINPUT;
    int r = archive_read_next_header(u->la, &entry);
    return r == ARCHIVE_EOF || r >= ARCHIVE_WARN ? VG_OK : VG_EINPUT; /* EOF: nothing is packed in there */
}

static void unpacker_close(unpacker *u)
{
    if (u->la) archive_read_free(u->la);
    u->la = NULL;
}

/* The next bytes; 0 at the end, negative when libarchive finds damage. */
static la_ssize_t unpack_some(unpacker *u, const void **data)
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

static la_ssize_t unpacker_read(struct archive *la, void *context, const void **data)
{
    unpacker *u = context;
    la_ssize_t n = unpack_some(u, data);
    if (n < 0) {
        const char *why = archive_error_string(u->la);
        archive_set_error(la, archive_errno(u->la), "%s", why ? why : "truncated");
    }
    return n;
}

/* ---- the reader ---- */

typedef struct member {
    char *path;
    size_t index;     /* place among the mesh files of the archive */
    int64_t off;      /* in the spool */
    size_t bytes;
} member;

struct vgi_archive {
    char *name;
    bool (*wanted)(const char *path); /* which members are ours */
    vgi_limits limits;
    locale_t utf8;
    tap file;
    bool packed, gzip, single; /* compressed; by gzip; one file, no archive */
    unpacker unpacker;
    struct archive *la;
    vg_bytes path; /* of the current member, with terminator */
    member *members;
    size_t n, cap, next;
    uint64_t total;
    int spool; /* -1: members come from a second pass */
};

static bool starts(const unsigned char *data, size_t n, const char *magic, size_t m)
{
    return n >= m && !memcmp(data, magic, m);
}

static bool is_gzip(const unsigned char *data, size_t n)
{
    return starts(data, n, "\x1f\x8b", 2);
}

static bool is_packed(const unsigned char *data, size_t n)
{
    return is_gzip(data, n) || starts(data, n, "\xfd" "7zXZ", 5) || starts(data, n, "\x28\xb5\x2f\xfd", 4) ||
           starts(data, n, "BZh", 3) || starts(data, n, "\x04\x22\x4d\x18", 4) || starts(data, n, "LZIP\1", 5) ||
           starts(data, n, "\x5d\0\0", 3) || starts(data, n, "\x1f\x9d", 2);
}

bool vgi_is_archive(const unsigned char *data, size_t n)
{
    return is_packed(data, n) || starts(data, n, "PK\3\4", 4) || starts(data, n, "PK\5\6", 4) ||
           starts(data, n, "7z\xbc\xaf\x27\x1c", 6) || (n >= 262 && !memcmp(data + 257, "ustar", 5));
}

static int damaged(const vgi_archive *a, struct archive *la, const char *path, vg_err *e)
{
    const char *why = archive_error_string(la);
    if (a->file.system_error)
        return vg_fail(e, VG_ESYS, "cannot read '%s': %s", a->name, strerror(a->file.system_error));
    if (archive_errno(la) == ENOMEM) return vg_fail(e, VG_ENOMEM, "not enough memory to unpack '%s'", a->name);
    if (a->la && archive_read_has_encrypted_entries(a->la) == 1)
        return vg_fail(e, VG_EINPUT, "'%s' is encrypted: unpack it first", a->name);
    if (!why) why = "truncated";
    bool cut = strcasestr(why, "truncated") || strcasestr(why, "end of file") || strcasestr(why, "premature");
    int code = cut ? VG_ETRUNC : VG_EINPUT;
    if (path) return vg_fail(e, code, "'%s' in '%s' is damaged or cut short: %s", path, a->name, why);
    return vg_fail(e, code, "archive '%s' is damaged or cut short: %s", a->name, why);
}

static void walk_close(vgi_archive *a)
{
    if (a->la) archive_read_free(a->la);
    a->la = NULL;
    unpacker_close(&a->unpacker);
}

/* Start at the first member. */
static int walk_open(vgi_archive *a, vg_err *e)
{
    walk_close(a);
    a->total = 0;
    if (a->packed) {
        int r = unpacker_open(&a->unpacker, &a->file, e);
        if (r == VG_EINPUT) return damaged(a, a->unpacker.la, NULL, e);
        if (r < 0) return r;
    }
    if (!(a->la = archive_read_new())) return vg_fail(e, VG_ENOMEM, "not enough memory to unpack '%s'", a->name);
    allow_formats(a->la);
    int r;
    if (a->packed) {
        archive_read_set_read_callback(a->la, unpacker_read);
        archive_read_set_callback_data(a->la, &a->unpacker);
        r = archive_read_open1(a->la);
    } else {
        r = open_tap(a->la, &a->file);
    }
    return r < ARCHIVE_WARN ? damaged(a, a->la, NULL, e) : VG_OK;
}

/* Bytes unpacked so far, those passed over included. */
static int check_total(const vgi_archive *a, vg_err *e)
{
    uint64_t seen = a->packed ? a->unpacker.sum->bytes : a->total;
    if (seen <= a->limits.total_bytes) return VG_OK;
    return vg_fail(e, VG_EINPUT, "'%s' unpacks to more than %llu bytes", a->name,
                   (unsigned long long)a->limits.total_bytes);
}

static int too_large(const vgi_archive *a, vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "'%s' in '%s' unpacks to more than %llu bytes", (char *)a->path.data, a->name,
                   (unsigned long long)a->limits.member_bytes);
}

static int set_path(vgi_archive *a, const char *s, size_t n, vg_err *e)
{
    a->path.size = 0;
    int r = vgi_bytes_append(&a->path, s, n, e);
    return r < 0 ? r : vgi_bytes_append(&a->path, "", 1, e);
}

/* A path from an archive is only ever a name here, so all that "./" and "/" in front say is where it once lay. */
static int take_path(vgi_archive *a, struct archive_entry *entry, vg_err *e)
{
    locale_t before = enter_utf8(a->utf8);
    const char *s = archive_entry_pathname_utf8(entry);
    if (!s) s = archive_entry_pathname(entry);
    leave_utf8(before);
    if (!s) return vg_fail(e, VG_EINPUT, "'%s' has a member whose name cannot be read", a->name);
    while (*s == '/' || (s[0] == '.' && s[1] == '/')) s++;
    return set_path(a, s, strlen(s), e);
}

/* As in directories, hidden files are none of ours: archives made on a Mac have "._pose1.obj" beside "pose1.obj". */
static bool is_pose_name(const char *path)
{
    return *vgi_base_name(path) != '.' && vgi_format_by_suffix(path);
}

static bool is_mesh_name(const char *path)
{
    return is_pose_name(path) || (*vgi_base_name(path) != '.' && vgi_packable(path));
}

/* 1: a mesh file, whose contents can be read; 0: something else. */
static int judge_member(vgi_archive *a, struct archive_entry *entry, vg_err *e)
{
    if (archive_format(a->la) == ARCHIVE_FORMAT_RAW) {
        a->single = true;
        const char *base = vgi_base_name(a->name);
        int r = set_path(a, base, vgi_packed_stem(base), e);
        return r < 0 ? r : 1;
    }
    int r = take_path(a, entry, e);
    if (r < 0) return r;
    const char *path = (char *)a->path.data;
    if (!a->wanted(path)) return 0;
    if (archive_entry_hardlink(entry))
        return vg_fail(e, VG_EINPUT, "'%s' in '%s' is a link to another member: pack the files themselves "
                       "(tar --hard-dereference)", path, a->name);
    if (archive_entry_filetype(entry) != AE_IFREG) return 0;
    if (archive_entry_is_encrypted(entry))
        return vg_fail(e, VG_EINPUT, "'%s' in '%s' is encrypted: unpack it first", path, a->name);
    if (archive_entry_size_is_set(entry) && (uint64_t)archive_entry_size(entry) > a->limits.member_bytes)
        return too_large(a, e);
    return 1;
}

/* 1: at the next mesh file; 0: there is none. */
static int walk_next(vgi_archive *a, vg_err *e)
{
    for (;;) {
        struct archive_entry *entry;
        locale_t before = enter_utf8(a->utf8);
        int r = archive_read_next_header(a->la, &entry);
        leave_utf8(before);
        if (r == ARCHIVE_EOF) return 0;
        if (r < ARCHIVE_WARN) return damaged(a, a->la, NULL, e);
        if ((r = check_total(a, e)) < 0 || (r = judge_member(a, entry, e)) != 0) return r;
    }
}

static int read_member(vgi_archive *a, vg_bytes *data, vg_err *e)
{
    for (data->size = 0;;) {
        int r = vgi_bytes_reserve(data, data->size + BLOCK, e);
        if (r < 0) return r;
        la_ssize_t n = archive_read_data(a->la, data->data + data->size, data->cap - data->size);
        if (n < 0) return damaged(a, a->la, (char *)a->path.data, e);
        if (n == 0) return VG_OK;
        data->size += (size_t)n;
        a->total += (size_t)n;
        if (data->size > a->limits.member_bytes) return too_large(a, e);
        if ((r = check_total(a, e)) < 0) return r;
    }
}

/* ---- is all of it there? ---- */

/* Enough for files that were joined from several; a block boundary that is none in between costs one attempt. */
enum { ATTEMPTS = 64 };

/* Unpack the range `part` of a gzip file; is it whole and one stream? */
static bool gzip_part_whole(const vgi_archive *a, int64_t from, int64_t to)
{
    unsigned char *block = malloc(BLOCK), trailer[8];
    tap part = {.fd = a->file.fd, .base = a->file.base + from, .size = to - from, .block = block};
    unpacker u = {0};
    const void *data;
    la_ssize_t n = -1;
    size_t got = 0;
    if (block && unpacker_open(&u, &part, NULL) == VG_OK)
        while ((n = unpack_some(&u, &data)) > 0) continue;
    bool whole = n == 0 && read_at(part.fd, trailer, 8, part.base + part.size - 8, &got) == 0 && got == 8 &&
                 sum_agrees(u.sum, trailer);
    unpacker_close(&u);
    free(u.sum);
    free(block);
    return whole;
}

/* The next place behind `from` where a gzip stream could start, or `end`. */
static int64_t next_gzip(const vgi_archive *a, unsigned char *block, int64_t from, int64_t end)
{
    for (size_t got; from < end; from += (int64_t)got - 2) {
        size_t want = end - from < BLOCK ? (size_t)(end - from) : BLOCK;
        if (read_at(a->file.fd, block, want, a->file.base + from, &got) < 0 || got < 3) break;
        const unsigned char *hit = memmem(block, got, "\x1f\x8b\x08", 3);
        if (hit) return from + (hit - block);
    }
    return end;
}

/* Several gzip streams joined into one file: each must agree with its own trailer. Only reached when the file is not
 * one whole stream. */
static bool gzip_parts_whole(const vgi_archive *a, int64_t end)
{
    enum { SHORTEST = 18 };
    unsigned char *block = malloc(BLOCK);
    bool whole = block != NULL;
    for (int64_t from = 0; whole && from < end;) {
        int64_t to = from + SHORTEST;
        whole = false;
        for (int i = 0; !whole && i < ATTEMPTS && to < end; i++) {
            to = next_gzip(a, block, to, end);
            whole = gzip_part_whole(a, from, to);
            if (!whole) to++;
        }
        from = to;
    }
    free(block);
    return whole;
}

static bool zero_to_end(const vgi_archive *a, int64_t from)
{
    unsigned char *block = a->file.block;
    size_t got;
    while (read_at(a->file.fd, block, BLOCK, a->file.base + from, &got) == 0 && got > 0) {
        if (block[0] || memcmp(block, block + 1, got - 1)) return false;
        from += (int64_t)got;
    }
    return from >= a->file.size;
}

/* What follows the last member of a compressed archive: the rest of the packed data, and gzip's trailer. */
static int check_packed_end(vgi_archive *a, vg_err *e)
{
    unpacker *u = &a->unpacker;
    const void *data;
    la_ssize_t n;
    int r;
    while ((n = unpack_some(u, &data)) > 0)
        if ((r = check_total(a, e)) < 0) return r;
    if (n < 0) return damaged(a, u->la, NULL, e);
    if (!a->gzip) return VG_OK;
    unsigned char trailer[8];
    size_t got = 0;
    int64_t end = archive_filter_bytes(u->la, -1);
    if (end < 18 || read_at(a->file.fd, trailer, 8, a->file.base + end - 8, &got) < 0 || got < 8)
        return vg_fail(e, VG_ETRUNC, "'%s' is cut short", a->name);
    if (!sum_agrees(u->sum, trailer) && !gzip_parts_whole(a, end))
        return vg_fail(e, VG_EINPUT, "'%s' is damaged: its contents do not agree with its checksum", a->name);
    if (!zero_to_end(a, end)) return vg_fail(e, VG_EINPUT, "'%s' is damaged: it goes on behind its end", a->name);
    return VG_OK;
}

/* A tar that was cut between two members looks whole but for the blocks of zeros in the end. */
static int check_tar_end(const vgi_archive *a, vg_err *e)
{
    if ((archive_format(a->la) & ARCHIVE_FORMAT_BASE_MASK) != ARCHIVE_FORMAT_TAR) return VG_OK;
    unsigned char last[512], zeros[512] = {0};
    size_t got = 0;
    if (a->file.size < 512 || read_at(a->file.fd, last, 512, a->file.base + a->file.size - 512, &got) < 0 ||
        got < 512 || memcmp(last, zeros, 512) != 0)
        return vg_fail(e, VG_ETRUNC, "'%s' is cut short: the end mark of the archive is missing", a->name);
    return VG_OK;
}

/* ---- listing and order ---- */

static int add_member(vgi_archive *a, vg_err *e)
{
    if (a->n >= a->limits.members)
        return vg_fail(e, VG_EINPUT, "'%s' holds more than %zu mesh files", a->name, a->limits.members);
    int r = vgi_grow(&a->members, &a->cap, a->n + 1, sizeof *a->members, e);
    if (r < 0) return r;
    member m = {.path = vgi_copy_string((char *)a->path.data, a->path.size - 1, e), .index = a->n};
    if (!m.path) return VG_ENOMEM;
    a->members[a->n++] = m;
    return VG_OK;
}

static int not_an_archive(const vgi_archive *a, vg_err *e)
{
    unsigned char start[512];
    size_t got = 0;
    if (read_at(a->file.fd, start, sizeof start, a->file.base, &got) == 0 && vgi_is_archive(start, got))
        return vg_fail(e, VG_ETRUNC, "archive '%s' is damaged or cut short", a->name);
    return vg_fail(e, VG_EINPUT, "cannot tell what '%s' is: no stream, no archive, none of %s; export other kinds as one of them",
                   a->name, vgi_kinds_read());
}

/* Files of whole sequences count only where there are no mesh files, as in directories. */
static void prefer_poses(vgi_archive *a)
{
    size_t poses = 0, n = 0;
    if (a->single || a->wanted != is_mesh_name) return;
    for (size_t i = 0; i < a->n; i++) poses += is_pose_name(a->members[i].path);
    if (poses == 0) return;
    a->wanted = is_pose_name;
    for (size_t i = 0; i < a->n; i++) {
        if (is_pose_name(a->members[i].path)) a->members[n++] = a->members[i];
        else free(a->members[i].path);
    }
    a->n = n;
}

static int list_members(vgi_archive *a, vg_err *e)
{
    int r = walk_open(a, e);
    while (r == VG_OK && (r = walk_next(a, e)) > 0) {
        if (a->single && !a->packed) return not_an_archive(a, e);
        r = add_member(a, e);
    }
    if (r == VG_OK) r = a->packed ? check_packed_end(a, e) : check_tar_end(a, e);
    if (r == VG_OK && a->n == 0 && a->wanted != is_mesh_name)
        r = vg_fail(e, VG_EINPUT, "archive '%s' holds none of the files it should", a->name);
    else if (r == VG_OK && a->n == 0)
        r = vg_fail(e, VG_EINPUT, "archive '%s' holds no mesh file (%s)", a->name, vgi_kinds_read());
    if (r == VG_OK) prefer_poses(a);
    return r;
}

static bool in_order(const vgi_archive *a)
{
    for (size_t i = 1; i < a->n; i++)
        if (vgi_natural_compare(a->members[i - 1].path, a->members[i].path) > 0) return false;
    return true;
}

static int compare_members(const void *p, const void *q)
{
    const member *a = p, *b = q;
    int order = vgi_natural_compare(a->path, b->path);
    return order ? order : (a->index > b->index) - (a->index < b->index);
}

/* The next member of a walk must be the one that was listed. */
static int read_listed(vgi_archive *a, size_t i, vg_bytes *data, vg_err *e)
{
    int r = walk_next(a, e);
    if (r < 0) return r;
    if (r == 0 || strcmp((char *)a->path.data, a->members[i].path) != 0)
        return vg_fail(e, VG_EINPUT, "'%s' changed while it was read", a->name);
    return read_member(a, data, e);
}

static int unpack_all(vgi_archive *a, vg_err *e)
{
    vg_bytes data = {0};
    int64_t off = 0;
    int r = a->spool = vgi_nameless_file(e);
    if (r >= 0) r = walk_open(a, e);
    for (size_t i = 0; r == VG_OK && i < a->n; i++) {
        r = read_listed(a, i, &data, e);
        if (r == VG_OK) r = vgi_write_all(a->spool, data.data, data.size, "temporary file", e);
        a->members[i].off = off, a->members[i].bytes = data.size;
        off += (int64_t)data.size;
    }
    vg_bytes_clear(&data);
    walk_close(a);
    if (r == VG_OK) qsort(a->members, a->n, sizeof *a->members, compare_members);
    return r;
}

static int prepare(vgi_archive *a, const char *name, vg_err *e)
{
    struct stat st;
    unsigned char start[16];
    size_t got = 0;
    a->utf8 = utf8_locale();
    if (!(a->name = vgi_copy_string(name, strlen(name), e)) || !(a->file.block = vgi_array_raw(BLOCK, 1, e)))
        return VG_ENOMEM;
    if (fstat(a->file.fd, &st) < 0 || read_at(a->file.fd, start, sizeof start, a->file.base, &got) < 0)
        return vg_fail(e, VG_ESYS, "cannot read '%s': %s", name, strerror(errno));
    a->file.size = st.st_size > a->file.base ? st.st_size - a->file.base : 0;
    a->packed = is_packed(start, got);
    a->gzip = is_gzip(start, got);
    return VG_OK;
}

int vgi_archive_open(vgi_archive **a, int fd, int64_t base, const char *name, const vgi_limits *limits, vg_err *e)
{
    return vgi_archive_open_for(a, fd, base, name, is_mesh_name, limits, e);
}

int vgi_archive_open_for(vgi_archive **out, int fd, int64_t base, const char *name, bool (*wanted)(const char *path),
                         const vgi_limits *limits, vg_err *e)
{
    vgi_archive *a = *out = vgi_array(1, sizeof *a, e);
    if (!a) return close(fd), VG_ENOMEM;
    a->wanted = wanted;
    a->limits = *limits, a->file.fd = fd, a->file.base = base, a->spool = -1;
    int r = prepare(a, name, e);
    if (r == VG_OK) r = list_members(a, e);
    if (r == VG_OK) r = in_order(a) ? walk_open(a, e) : unpack_all(a, e);
    if (r < 0) vgi_archive_close(out);
    return r;
}

static int read_spooled(vgi_archive *a, const member *m, vg_bytes *data, vg_err *e)
{
    size_t got = 0;
    int r = vgi_bytes_reserve(data, m->bytes, e);
    if (r < 0) return r;
    if (read_at(a->spool, data->data, m->bytes, m->off, &got) < 0 || got < m->bytes)
        return vg_fail(e, VG_ESYS, "cannot read the temporary file of '%s'", a->name);
    data->size = got;
    return VG_OK;
}

int vgi_archive_next(vgi_archive *a, const char **path, vg_bytes *data, vg_err *e)
{
    if (a->next == a->n) return 0;
    const member *m = &a->members[a->next];
    int r = a->spool >= 0 ? read_spooled(a, m, data, e) : read_listed(a, a->next, data, e);
    if (r < 0) return r;
    *path = m->path;
    a->next++;
    return 1;
}

void vgi_archive_close(vgi_archive **archive)
{
    vgi_archive *a = *archive;
    if (!a) return;
    walk_close(a);
    for (size_t i = 0; i < a->n; i++) free(a->members[i].path);
    free(a->members);
    free(a->unpacker.sum);
    vg_bytes_clear(&a->path);
    if (a->spool >= 0) close(a->spool);
    if (a->utf8) freelocale(a->utf8);
    close(a->file.fd);
    free(a->file.block);
    free(a->name);
    free(a);
    *archive = NULL;
}

/* ---- the writer ---- */

/* The longest suffix first: ".tar.gz" also ends in what ".gz" would. */
static const struct packing {
    const char *suffix;
    int format, filter;
    bool stored; /* not compressed */
} packings[] = {
    {".zip", ARCHIVE_FORMAT_ZIP, ARCHIVE_FILTER_NONE, false},
    {".tar.gz", ARCHIVE_FORMAT_TAR, ARCHIVE_FILTER_GZIP, false},
    {".tgz", ARCHIVE_FORMAT_TAR, ARCHIVE_FILTER_GZIP, false},
    {".tar.xz", ARCHIVE_FORMAT_TAR, ARCHIVE_FILTER_XZ, false},
    {".txz", ARCHIVE_FORMAT_TAR, ARCHIVE_FILTER_XZ, false},
    {".tar.zst", ARCHIVE_FORMAT_TAR, ARCHIVE_FILTER_ZSTD, false},
    {".tar", ARCHIVE_FORMAT_TAR, ARCHIVE_FILTER_NONE, false},
    {".7z", ARCHIVE_FORMAT_7ZIP, ARCHIVE_FILTER_NONE, false},
};

/* Not told by a name, and with members as NumPy's savez writes them. */
static const struct packing plain_zip = {"", ARCHIVE_FORMAT_ZIP, ARCHIVE_FILTER_NONE, true};

struct vgi_packer {
    struct archive *la;
    struct archive_entry *entry;
    locale_t utf8;
    int fd;
    char *name;
    vg_err failure; /* of our own write, which libarchive only hears of */
};

static const struct packing *find_packing(const char *name, size_t n)
{
    for (size_t i = 0; i < sizeof packings / sizeof *packings; i++)
        if (vgi_has_suffix(name, n, packings[i].suffix)) return &packings[i];
    return NULL;
}

bool vgi_packer_knows(const char *name, size_t n)
{
    return find_packing(name, n) != NULL;
}

const char *vgi_packer_suffixes(void)
{
    return ".zip .tar .tar.gz .tgz .tar.xz .txz .tar.zst .7z";
}

/* libarchive is not told of a failure: it would then never free its buffers. What comes after one goes nowhere, and
 * check_packer says so. */
static la_ssize_t packer_write(struct archive *la, void *context, const void *data, size_t n)
{
    (void)la;
    vgi_packer *p = context;
    if (!p->failure.code) p->failure.code = vgi_write_all(p->fd, data, n, p->name, &p->failure);
    return (la_ssize_t)n;
}

/* ok: what libarchive thinks of its last call. */
static int check_packer(vgi_packer *p, bool ok, vg_err *e)
{
    if (p->failure.code) return vg_fail(e, p->failure.code, "%s", p->failure.message);
    if (ok) return VG_OK;
    const char *why = archive_error_string(p->la);
    if (archive_errno(p->la) == ENOMEM) return vg_fail(e, VG_ENOMEM, "not enough memory to write '%s'", p->name);
    return vg_fail(e, VG_ESYS, "cannot write '%s': %s", p->name, why ? why : "archive library failed");
}

static int configure(struct archive *la, const struct packing *k)
{
    int r;
    if (k->format == ARCHIVE_FORMAT_ZIP) {
        r = archive_write_set_format_zip(la);
        if (r == ARCHIVE_OK)
            r = k->stored ? archive_write_zip_set_compression_store(la)
                          : archive_write_zip_set_compression_deflate(la);
        if (r == ARCHIVE_OK) r = archive_write_set_format_option(la, "zip", "hdrcharset", "UTF-8");
    } else if (k->format == ARCHIVE_FORMAT_7ZIP) {
        r = archive_write_set_format_7zip(la);
    } else {
        r = archive_write_set_format_pax_restricted(la);
    }
    if (r == ARCHIVE_OK && k->filter != ARCHIVE_FILTER_NONE) r = archive_write_add_filter(la, k->filter);
    if (r == ARCHIVE_OK && k->filter == ARCHIVE_FILTER_GZIP)
        r = archive_write_set_filter_option(la, "gzip", "timestamp", NULL);
    if (r == ARCHIVE_OK) r = archive_write_set_bytes_in_last_block(la, 1);
    return r;
}

static int open_packer(vgi_packer **out, int fd, const char *name, size_t n, const struct packing *k, vg_err *e)
{
    vgi_packer *p = *out = vgi_array(1, sizeof *p, e);
    if (!p) return VG_ENOMEM;
    p->fd = fd, p->utf8 = utf8_locale();
    p->name = vgi_copy_string(name, n, e);
    p->entry = archive_entry_new();
    p->la = archive_write_new();
    int r = VG_OK;
    if (!p->name || !p->entry || !p->la) r = vg_fail(e, VG_ENOMEM, "not enough memory to write '%.*s'", (int)n, name);
    else if (!k)
        r = vg_fail(e, VG_EARG, "'%s' is no archive that can be written: %s can", p->name, vgi_packer_suffixes());
    if (r == VG_OK) {
        locale_t before = enter_utf8(p->utf8);
        bool ok = configure(p->la, k) == ARCHIVE_OK &&
                  archive_write_open2(p->la, p, NULL, packer_write, NULL, NULL) == ARCHIVE_OK;
        leave_utf8(before);
        r = check_packer(p, ok, e);
    }
    if (r < 0) vgi_packer_close(out);
    return r;
}

int vgi_packer_open(vgi_packer **p, int fd, const char *name, size_t n, vg_err *e)
{
    return open_packer(p, fd, name, n, find_packing(name, n), e);
}

int vgi_packer_open_plain(vgi_packer **p, int fd, const char *name, vg_err *e)
{
    return open_packer(p, fd, name, strlen(name), &plain_zip, e);
}

static bool begin_entry(vgi_packer *p, const char *path, uint64_t n)
{
    archive_entry_clear(p->entry);
    archive_entry_update_pathname_utf8(p->entry, path);
    archive_entry_set_filetype(p->entry, AE_IFREG);
    archive_entry_set_perm(p->entry, 0644);
    archive_entry_set_mtime(p->entry, 0, 0);
    archive_entry_set_size(p->entry, (la_int64_t)n);
    return archive_write_header(p->la, p->entry) == ARCHIVE_OK;
}

static bool add_data(vgi_packer *p, const unsigned char *data, size_t n)
{
    while (n > 0) {
        la_ssize_t done = archive_write_data(p->la, data, n);
        if (done <= 0) return false;
        data += done;
        n -= (size_t)done;
    }
    return true;
}

static bool add_entry(vgi_packer *p, const char *path, const unsigned char *data, size_t n)
{
    return begin_entry(p, path, n) && add_data(p, data, n) && archive_write_finish_entry(p->la) == ARCHIVE_OK;
}

int vgi_packer_begin(vgi_packer *p, const char *path, uint64_t n, vg_err *e)
{
    locale_t before = enter_utf8(p->utf8);
    bool ok = begin_entry(p, path, n);
    leave_utf8(before);
    return check_packer(p, ok, e);
}

int vgi_packer_more(vgi_packer *p, const void *data, size_t n, vg_err *e)
{
    return check_packer(p, add_data(p, data, n), e);
}

int vgi_packer_finish(vgi_packer *p, vg_err *e)
{
    return check_packer(p, archive_write_finish_entry(p->la) == ARCHIVE_OK, e);
}

int vgi_packer_add(vgi_packer *p, const char *path, const void *data, size_t n, vg_err *e)
{
    locale_t before = enter_utf8(p->utf8);
    bool ok = add_entry(p, path, data, n);
    leave_utf8(before);
    return check_packer(p, ok, e);
}

int vgi_packer_end(vgi_packer *p, vg_err *e)
{
    locale_t before = enter_utf8(p->utf8);
    bool ok = archive_write_close(p->la) == ARCHIVE_OK;
    leave_utf8(before);
    return check_packer(p, ok, e);
}

void vgi_packer_close(vgi_packer **packer)
{
    vgi_packer *p = *packer;
    if (!p) return;
    p->failure.code = VG_ESYS; /* freeing writes an end unless vgi_packer_end has: it goes nowhere */
    if (p->la) archive_write_free(p->la);
    archive_entry_free(p->entry);
    if (p->utf8) freelocale(p->utf8);
    free(p->name);
    free(p);
    *packer = NULL;
}
