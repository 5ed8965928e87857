/* items.c: input: the files that operands name, and their kinds. Directories and patterns are expanded in operands.c;
 * contents are read in source.c.
 *
 * Each item is examined before any is read. A file is reopened when it is read; an input that can be read only once
 * (standard input, a pipe named by the shell) stays open in between.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/items.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

const char vgi_standard_input[] = "standard input";

const char *vgi_item_name(const vgi_item *it)
{
    return it->path ? it->path : vgi_standard_input;
}

static int add_item(vgi_items *items, const char *path, vg_err *e)
{
    vgi_item it = {0};
    int r = vgi_grow(&items->at, &items->cap, items->n + 1, sizeof *items->at, e);
    if (r < 0) return r;
    if (path && !(it.path = vgi_copy_string(path, strlen(path), e))) return VG_ENOMEM;
    items->at[items->n++] = it;
    return VG_OK;
}

static int add_standard_input(vgi_items *items, vg_err *e)
{
    if (items->stdin_named) return vg_fail(e, VG_EARG, "standard input ('-') can be named only once");
    items->stdin_named = true;
    return add_item(items, NULL, e);
}

int vgi_items_add(vgi_items *items, const char *operand, vg_err *e)
{
    if (!strcmp(operand, "-")) return add_standard_input(items, e);
    vgi_names paths = {0};
    int r = vgi_operand_files(&paths, operand, e);
    for (size_t i = 0; r == VG_OK && i < paths.n; i++) r = add_item(items, paths.at[i], e);
    vgi_names_clear(&paths);
    return r;
}

static void clear_item(vgi_item *it)
{
    free(it->path);
    vgi_input_free(&it->input);
    vg_reader_close(&it->reader);
}

void vgi_items_keep(vgi_items *items, size_t n)
{
    while (items->n > n) clear_item(&items->at[--items->n]);
}

void vgi_items_clear(vgi_items *items)
{
    vgi_items_keep(items, 0);
    free(items->at);
    *items = (vgi_items){0};
}

/* ---- kind of an item ---- */

int vgi_item_input(const vgi_items *items, vgi_item *it, vgi_input **in, vg_err *e)
{
    if (it->input) {
        *in = it->input;
        it->input = NULL;
        return VG_OK;
    }
    int r = it->path ? vgi_input_file(in, it->path, e) : vgi_input_fd(in, STDIN_FILENO, false, vgi_standard_input, e);
    if (r == VG_OK) vgi_input_limit(*in, &items->limits);
    return r;
}

static void note_file(vgi_item *it)
{
    struct stat st;
    bool known = (it->path ? stat(it->path, &st) : fstat(STDIN_FILENO, &st)) == 0;
    it->regular = known && S_ISREG(st.st_mode);
    if (it->path || !it->regular) return;
    it->base = lseek(STDIN_FILENO, 0, SEEK_CUR);
    it->regular = it->base >= 0;
}

static const vgi_format *mesh_format(const vgi_item *it, const unsigned char *data, size_t n)
{
    const vgi_format *f = vgi_format_by_content(data, n);
    return f || !it->path ? f : vgi_format_by_suffix(it->path);
}

/* Files that are certainly not meshes are recognised first, because a tar may begin with the name of a mesh, and a
 * compressed file may have the name of one. Unknown data is left to libarchive, which knows more formats than are
 * recognised here. Of a pipe it sees only the start, because otherwise the disk would fill with it first. */
static int judge_start(const vgi_items *items, vgi_item *it, const unsigned char *data, size_t n, vg_err *e)
{
    const vgi_sequence_format *named = it->path ? vgi_sequence_by_suffix(it->path) : NULL;
    const vgi_format *mesh;
    if (vgi_is_stream(data, n)) it->content = VGI_STREAM;
    else if ((it->sequence = vgi_sequence_by_content(data, n))) it->content = VGI_SEQUENCE;
    else if (vgi_is_archive(data, n)) it->content = VGI_ARCHIVE;
    else if (named && named->open) it->content = VGI_SEQUENCE, it->sequence = named;
    else if ((mesh = mesh_format(it, data, n))) {
        it->sequence = items->objects && mesh == &vgi_format_obj ? &vgi_sequence_objects : NULL;
        it->content = it->sequence ? VGI_SEQUENCE : VGI_MESH;
    }
    else if (it->regular || vgi_may_be_archive(data, n)) it->content = VGI_ARCHIVE;
    else return vgi_unknown_kind(vgi_item_name(it), e);
    return VG_OK;
}

static int tell_content(const vgi_items *items, vgi_item *it, vgi_input *in, vg_err *e)
{
    const unsigned char *data;
    vg_bytes own = {0};
    size_t n;
    /* enough for a stream: does not block on a program that writes frame by frame */
    int r = vgi_input_peek(in, 8, &data, &n, e);
    if (r == VG_OK && !vgi_is_stream(data, n)) r = vgi_input_peek(in, 4096, &data, &n, e);
    if (r < 0) return r;
    if (n == 0 && !it->path)
        return vg_fail(e, VG_ETRUNC, "standard input is empty: did the program before it fail?");
    if (n == 0) return vg_fail(e, VG_ETRUNC, "'%s' is empty", it->path);
    r = vgi_plain_text(&own, &data, &n, e);
    if (r == VG_OK) r = judge_start(items, it, data, n, e);
    vg_bytes_clear(&own);
    return r;
}

static int open_file(const vgi_item *it, vg_err *e)
{
    int fd = it->path ? open(it->path, O_RDONLY | O_CLOEXEC) : fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 3);
    return fd < 0 ? vg_fail(e, VG_ESYS, "cannot open '%s': %s", vgi_item_name(it), strerror(errno)) : fd;
}

/* Convert a compressed stream to one that can be read once: *in (NULL if the file is reopened later). */
static int unpack_stream(const vgi_items *items, vgi_item *it, vgi_input **in, vg_err *e)
{
    int fd = -1, stream, r = VG_OK;
    if (it->regular) r = fd = open_file(it, e);
    else r = vgi_input_spool(*in, &fd, e);
    if (r >= 0) r = vgi_unpack_stream(fd, it->regular ? it->base : 0, vgi_item_name(it), &items->limits, &stream, e);
    if (r == 1) {
        it->content = VGI_STREAM, it->regular = false;
        vgi_input_free(in);
        r = vgi_input_fd(in, stream, true, vgi_item_name(it), e);
    } else if (r == 0 && !it->regular) {
        vgi_input_free(in);
        if (lseek(fd, 0, SEEK_SET) < 0)
            r = vg_fail(e, VG_ESYS, "cannot read '%s': %s", vgi_item_name(it), strerror(errno));
        else r = vgi_input_fd(in, fd, true, vgi_item_name(it), e), fd = -1;
        if (r == VG_OK) vgi_input_limit(*in, &items->limits);
    }
    if (fd >= 0) close(fd);
    return r;
}

int vgi_item_look(const vgi_items *items, vgi_item *it, vg_err *e)
{
    vgi_input *in = NULL;
    note_file(it);
    int r = vgi_item_input(items, it, &in, e);
    if (r < 0) return r;
    r = tell_content(items, it, in, e);
    if (r == VG_OK && it->content == VGI_ARCHIVE) r = unpack_stream(items, it, &in, e);
    /* standard input was read from: its bytes are in `in`, even if the file could be read again */
    if (r < 0 || (it->regular && it->path)) vgi_input_free(&in);
    else it->input = in;
    return r;
}

/* ---- contents ---- */

int vgi_item_reader(const vgi_items *items, vgi_item *it, vg_reader **reader, vg_err *e)
{
    if (it->reader) {
        *reader = it->reader;
        it->reader = NULL;
        return VG_OK;
    }
    vgi_input *in;
    int r = vgi_item_input(items, it, &in, e);
    return r < 0 ? r : vgi_reader_open_input(reader, in, e);
}

int vgi_item_archive(const vgi_items *items, vgi_item *it, vgi_archive **archive, vg_err *e)
{
    int fd = -1, r = VG_OK;
    if (!it->regular) {
        vgi_input *in;
        if ((r = vgi_item_input(items, it, &in, e)) < 0) return r;
        r = vgi_input_spool(in, &fd, e);
        vgi_input_free(&in);
    } else {
        r = fd = open_file(it, e);
    }
    return r < 0 ? r : vgi_archive_open(archive, fd, it->base, vgi_item_name(it), &items->limits, e);
}
