/* pack.c: writes archives. The bytes depend only on names and contents. Reading is in archive.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/unpack.h"

#include <errno.h>
#include <stdlib.h>

/* Longest suffix first: ".tar.gz" also ends in ".gz". */
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

/* Not selected by name; members are uncompressed, as NumPy's savez writes them. */
static const struct packing plain_zip = {"", ARCHIVE_FORMAT_ZIP, ARCHIVE_FILTER_NONE, true};

struct vgi_packer {
    struct archive *la;
    struct archive_entry *entry;
    locale_t utf8;
    int fd;
    char *name;
    vg_err failure; /* error of our own write callback */
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

/* A failure is not reported to libarchive, which would then never free its buffers. Later data is discarded, and
 * check_packer reports the failure. */
static la_ssize_t packer_write(struct archive *la, void *context, const void *data, size_t n)
{
    (void)la;
    vgi_packer *p = context;
    if (!p->failure.code) p->failure.code = vgi_write_all(p->fd, data, n, p->name, &p->failure);
    return (la_ssize_t)n;
}

/* ok: the result of the last call of libarchive. */
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
    p->fd = fd, p->utf8 = vgi_utf8_locale();
    p->name = vgi_copy_string(name, n, e);
    p->entry = archive_entry_new();
    p->la = archive_write_new();
    int r = VG_OK;
    if (!p->name || !p->entry || !p->la) r = vg_fail(e, VG_ENOMEM, "not enough memory to write '%.*s'", (int)n, name);
    else if (!k)
        r = vg_fail(e, VG_EARG, "'%s' is not an archive that can be written: %s can", p->name, vgi_packer_suffixes());
    if (r == VG_OK && k) {
        locale_t before = vgi_enter_utf8(p->utf8);
        bool ok = configure(p->la, k) == ARCHIVE_OK &&
                  archive_write_open2(p->la, p, NULL, packer_write, NULL, NULL) == ARCHIVE_OK;
        vgi_leave_utf8(before);
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
    locale_t before = vgi_enter_utf8(p->utf8);
    bool ok = begin_entry(p, path, n);
    vgi_leave_utf8(before);
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
    locale_t before = vgi_enter_utf8(p->utf8);
    bool ok = add_entry(p, path, data, n);
    vgi_leave_utf8(before);
    return check_packer(p, ok, e);
}

int vgi_packer_end(vgi_packer *p, vg_err *e)
{
    locale_t before = vgi_enter_utf8(p->utf8);
    bool ok = archive_write_close(p->la) == ARCHIVE_OK;
    vgi_leave_utf8(before);
    return check_packer(p, ok, e);
}

void vgi_packer_close(vgi_packer **packer)
{
    vgi_packer *p = *packer;
    if (!p) return;
    p->failure.code = VG_ESYS; /* freeing writes the end of the archive unless vgi_packer_end already has; it is
                                  discarded */
    if (p->la) archive_write_free(p->la);
    archive_entry_free(p->entry);
    if (p->utf8) freelocale(p->utf8);
    free(p->name);
    free(p);
    *packer = NULL;
}
