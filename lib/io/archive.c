/* archive.c: reads mesh files from archives. Contents are only bytes here. Compressed single files are in unpack.c,
 * writing is in pack.c.
 *
 * Reading lists the names first. If the archive has its mesh files in natural order, as nearly all do, a second pass
 * returns them one by one; otherwise they are unpacked once into an unnamed file. A compressed archive is read by two
 * libarchive readers in series: the first unpacks, and its bytes are summed and read to the end before anything is
 * returned. The reason is that libarchive neither compares gzip's checksum nor looks beyond the end mark of a tar.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/unpack.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- one member after another ---- */

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

typedef struct member {
    char *path;
    size_t index;     /* index among the mesh files of the archive */
    int64_t off;      /* in the spool */
    size_t bytes;
} member;

struct vgi_archive {
    char *name;
    bool (*wanted)(const char *path); /* selects the members to read */
    vgi_limits limits;
    locale_t utf8;
    vgi_tap file;
    bool packed, gzip, single; /* compressed; by gzip; a single file, not an archive */
    vgi_unpacker unpacker;
    struct archive *la;
    vg_bytes path; /* of the current member, with terminator */
    member *members;
    size_t n, cap, next;
    uint64_t total;  /* bytes unpacked in this pass */
    size_t entries;  /* members visited */
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

/* Formats with a signature. libarchive takes unknown data for raw data, and zeros for the end of a tar. */
bool vgi_may_be_archive(const unsigned char *data, size_t n)
{
    struct archive_entry *entry;
    if (n == 0 || !data[0]) return false;
    struct archive *la = archive_read_new();
    if (!la) return true;
    allow_formats(la);
    bool raw = archive_read_open_memory(la, data, n) == ARCHIVE_OK &&
               archive_read_next_header(la, &entry) >= ARCHIVE_WARN && archive_format(la) == ARCHIVE_FORMAT_RAW;
    archive_read_free(la);
    return !raw;
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
    int r = cut ? VG_ETRUNC : VG_EINPUT;
    if (path) return vg_fail(e, r, "'%s' in '%s' is damaged or cut short: %s", path, a->name, why);
    return vg_fail(e, r, "archive '%s' is damaged or cut short: %s", a->name, why);
}

static void walk_close(vgi_archive *a)
{
    if (a->la) archive_read_free(a->la);
    a->la = NULL;
    vgi_unpacker_close(&a->unpacker);
}

/* Start at the first member. */
static int walk_open(vgi_archive *a, vg_err *e)
{
    walk_close(a);
    a->total = a->entries = 0;
    if (a->packed) {
        int r = vgi_unpacker_open(&a->unpacker, &a->file, e);
        if (r == VG_EINPUT) return damaged(a, a->unpacker.la, NULL, e);
        if (r < 0) return r;
    }
    if (!(a->la = archive_read_new())) return vg_fail(e, VG_ENOMEM, "not enough memory to unpack '%s'", a->name);
    allow_formats(a->la);
    int r;
    if (a->packed) {
        archive_read_set_read_callback(a->la, vgi_unpacker_read);
        archive_read_set_callback_data(a->la, &a->unpacker);
        r = archive_read_open1(a->la);
    } else {
        r = vgi_tap_open(a->la, &a->file);
    }
    return r < ARCHIVE_WARN ? damaged(a, a->la, NULL, e) : VG_OK;
}

/* Limit the bytes unpacked so far, including those of skipped members. */
static int check_total(const vgi_archive *a, vg_err *e)
{
    uint64_t seen = a->packed ? a->unpacker.sum->bytes : a->total;
    if (seen <= a->limits.total_bytes) return VG_OK;
    return vg_fail(e, VG_EINPUT, "'%s' unpacks to more than %llu bytes: allow more with 'vg-encode --max-bytes'",
                   a->name, (unsigned long long)a->limits.total_bytes);
}

static int too_large(const vgi_archive *a, vg_err *e)
{
    return vg_fail(e, VG_EINPUT,
                   "'%s' in '%s' unpacks to more than %llu bytes: allow more with 'vg-encode --max-bytes'",
                   (char *)a->path.data, a->name, (unsigned long long)a->limits.member_bytes);
}

static int set_path(vgi_archive *a, const char *s, size_t n, vg_err *e)
{
    a->path.size = 0;
    int r = vgi_bytes_append(&a->path, s, n, e);
    return r < 0 ? r : vgi_bytes_append(&a->path, "", 1, e);
}

/* Paths from an archive are used only as names, so a leading "./" or "/" is dropped. */
static int take_path(vgi_archive *a, struct archive_entry *entry, vg_err *e)
{
    locale_t before = vgi_enter_utf8(a->utf8);
    const char *s = archive_entry_pathname_utf8(entry);
    if (!s) s = archive_entry_pathname(entry);
    vgi_leave_utf8(before);
    if (!s) return vg_fail(e, VG_EINPUT, "'%s' has a member whose name cannot be read", a->name);
    while (*s == '/' || (s[0] == '.' && s[1] == '/')) s++;
    return set_path(a, s, strlen(s), e);
}

/* Hidden files are skipped, as in directories: archives made on a Mac have "._pose1.obj" beside "pose1.obj". */
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

/* A skipped member must still be unpacked if several are packed as one. */
static void pass_over(vgi_archive *a, struct archive_entry *entry)
{
    switch (archive_format(a->la)) {
    case ARCHIVE_FORMAT_7ZIP:
    case ARCHIVE_FORMAT_RAR:
    case ARCHIVE_FORMAT_RAR_V5:
    case ARCHIVE_FORMAT_CAB:
        if (archive_entry_size(entry) > 0 &&
            __builtin_add_overflow(a->total, (uint64_t)archive_entry_size(entry), &a->total))
            a->total = UINT64_MAX;
    }
}

/* 1: at the next mesh file; 0: at the end. */
static int walk_next(vgi_archive *a, vg_err *e)
{
    for (;;) {
        struct archive_entry *entry;
        locale_t before = vgi_enter_utf8(a->utf8);
        int r = archive_read_next_header(a->la, &entry);
        vgi_leave_utf8(before);
        if (r == ARCHIVE_EOF) return 0;
        if (r < ARCHIVE_WARN) return damaged(a, a->la, NULL, e);
        if (++a->entries > a->limits.members)
            return vg_fail(e, VG_EINPUT, "'%s' holds more than %zu files", a->name, a->limits.members);
        if ((r = judge_member(a, entry, e)) == 0) pass_over(a, entry);
        int within = r < 0 ? r : check_total(a, e);
        if (within < 0 || r > 0) return within < 0 ? within : r;
    }
}

static int read_member(vgi_archive *a, vg_bytes *data, vg_err *e)
{
    for (data->size = 0;;) {
        int r = vgi_bytes_reserve(data, data->size + VGI_BLOCK, e);
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

/* ---- completeness ---- */

/* Read the rest of a compressed archive: packed data, and gzip's trailer. */
static int check_packed_end(vgi_archive *a, vg_err *e)
{
    vgi_unpacker *u = &a->unpacker;
    const void *data;
    la_ssize_t n;
    int r;
    while ((n = vgi_unpack_some(u, &data)) > 0)
        if ((r = check_total(a, e)) < 0) return r;
    if (n < 0) return damaged(a, u->la, NULL, e);
    if (!a->gzip) return VG_OK;
    unsigned char trailer[8];
    size_t got = 0;
    int64_t end = archive_filter_bytes(u->la, -1);
    if (end < 18 || vgi_read_at(a->file.fd, trailer, 8, a->file.base + end - 8, &got) < 0 || got < 8)
        return vg_fail(e, VG_ETRUNC, "'%s' is cut short", a->name);
    if (!vgi_sum_agrees(u->sum, trailer) && !vgi_gzip_parts_whole(&a->file, end))
        return vg_fail(e, VG_EINPUT, "'%s' is damaged: its contents do not agree with its checksum", a->name);
    if (!vgi_zero_to_end(&a->file, end))
        return vg_fail(e, VG_EINPUT, "'%s' is damaged: data follows its end", a->name);
    return VG_OK;
}

/* A tar that was cut between two members lacks only the zero blocks at the end. */
static int check_tar_end(const vgi_archive *a, vg_err *e)
{
    if ((archive_format(a->la) & ARCHIVE_FORMAT_BASE_MASK) != ARCHIVE_FORMAT_TAR) return VG_OK;
    unsigned char last[512], zeros[512] = {0};
    size_t got = 0;
    if (a->file.size < 512 || vgi_read_at(a->file.fd, last, 512, a->file.base + a->file.size - 512, &got) < 0 ||
        got < 512 || memcmp(last, zeros, 512) != 0)
        return vg_fail(e, VG_ETRUNC, "'%s' is cut short: the end mark of the archive is missing", a->name);
    return VG_OK;
}

/* ---- listing and order ---- */

static int add_member(vgi_archive *a, vg_err *e)
{
    int r = vgi_grow(&a->members, &a->cap, a->n + 1, sizeof *a->members, e);
    if (r < 0) return r;
    member m = {.path = vgi_copy_string((char *)a->path.data, a->path.size - 1, e), .index = a->n};
    if (!m.path) return VG_ENOMEM;
    a->members[a->n++] = m;
    return VG_OK;
}

int vgi_unknown_kind(const char *name, vg_err *e)
{
    return vg_fail(e, VG_EINPUT,
                   "cannot tell what '%s' is: not a stream, not an archive, none of %s; export it as one of these",
                   name, vgi_kinds_read());
}

static int holds_no_mesh(const vgi_archive *a, vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "archive '%s' holds no mesh file (%s)", a->name, vgi_kinds_read());
}

/* libarchive does not recognise a zip without members. */
static int not_an_archive(const vgi_archive *a, vg_err *e)
{
    unsigned char start[512];
    size_t got = 0;
    bool read = vgi_read_at(a->file.fd, start, sizeof start, a->file.base, &got) == 0;
    if (read && a->file.size == 22 && starts(start, got, "PK\5\6", 4)) return holds_no_mesh(a, e);
    if (read && vgi_is_archive(start, got))
        return vg_fail(e, VG_ETRUNC, "archive '%s' is damaged or cut short", a->name);
    return vgi_unknown_kind(a->name, e);
}

/* Files that hold a sequence are read only if there are no mesh files, as in directories. */
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
        r = vg_fail(e, VG_EINPUT, "archive '%s' holds none of the listed files", a->name);
    else if (r == VG_OK && a->n == 0)
        r = holds_no_mesh(a, e);
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

/* The second pass must find the members that were listed. */
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

static int make_reader(vgi_archive *a, const char *name, vg_err *e)
{
    struct stat st;
    unsigned char start[16];
    size_t got = 0;
    a->utf8 = vgi_utf8_locale();
    if (!(a->name = vgi_copy_string(name, strlen(name), e)) || !(a->file.block = vgi_array_raw(VGI_BLOCK, 1, e)))
        return VG_ENOMEM;
    if (fstat(a->file.fd, &st) < 0 || vgi_read_at(a->file.fd, start, sizeof start, a->file.base, &got) < 0)
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
    int r = make_reader(a, name, e);
    if (r == VG_OK) r = list_members(a, e);
    if (r == VG_OK) r = in_order(a) ? walk_open(a, e) : unpack_all(a, e);
    if (r < 0) vgi_archive_close(out);
    return r;
}

/* ---- a compressed stream ---- */

/* Whether this is a compressed stream. */
static bool begins_like_stream(const vgi_archive *a)
{
    unsigned char start[8];
    const void *data;
    size_t got = 0;
    vgi_tap file = a->file;
    vgi_unpacker u = {0};
    if (a->packed && vgi_unpacker_open(&u, &file, NULL) == VG_OK)
        for (la_ssize_t n; got < sizeof start && (n = vgi_unpack_some(&u, &data)) > 0;) {
            size_t some = (size_t)n < sizeof start - got ? (size_t)n : sizeof start - got;
            memcpy(start + got, data, some);
            got += some;
        }
    vgi_unpacker_close(&u);
    free(u.sum);
    return vgi_is_stream(start, got);
}

static int copy_unpacked(vgi_archive *a, int to, vg_err *e)
{
    const void *data;
    la_ssize_t n;
    int r = vgi_unpacker_open(&a->unpacker, &a->file, e);
    if (r == VG_EINPUT) return damaged(a, a->unpacker.la, NULL, e);
    while (r == VG_OK && (n = vgi_unpack_some(&a->unpacker, &data)) != 0) {
        if (n < 0) return damaged(a, a->unpacker.la, NULL, e);
        r = check_total(a, e);
        if (r == VG_OK) r = vgi_write_all(to, data, (size_t)n, "temporary file", e);
    }
    return r == VG_OK ? check_packed_end(a, e) : r;
}

int vgi_unpack_stream(int fd, int64_t base, const char *name, const vgi_limits *limits, int *stream, vg_err *e)
{
    vgi_archive *a = vgi_array(1, sizeof *a, e);
    *stream = -1;
    if (!a) return VG_ENOMEM;
    a->limits = *limits, a->file.base = base, a->spool = -1;
    int r = a->file.fd = fcntl(fd, F_DUPFD_CLOEXEC, 3);
    if (r < 0) r = vg_fail(e, VG_ESYS, "cannot read '%s': %s", name, strerror(errno));
    if (r >= 0) r = make_reader(a, name, e);
    if (r == VG_OK && begins_like_stream(a)) {
        r = *stream = vgi_nameless_file(e);
        if (r >= 0) r = copy_unpacked(a, *stream, e);
        if (r == VG_OK) r = lseek(*stream, 0, SEEK_SET) == 0 ? 1 : VG_ESYS;
        if (r < 0 && *stream >= 0) close(*stream), *stream = -1;
    }
    vgi_archive_close(&a);
    return r;
}

static int read_spooled(vgi_archive *a, const member *m, vg_bytes *data, vg_err *e)
{
    int r = vgi_bytes_reserve(data, m->bytes, e);
    if (r == VG_OK) r = vgi_read_back(a->spool, (uint64_t)m->off, data->data, m->bytes, e);
    if (r == VG_OK) data->size = m->bytes;
    return r;
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
    if (a->file.fd >= 0) close(a->file.fd);
    free(a->file.block);
    free(a->name);
    free(a);
    *archive = NULL;
}
