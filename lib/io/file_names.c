/* file_names.c: the file names of frames in a directory or archive. Readers sort files in natural order, so names
 * must ascend in that order; if the names of the frames do not, files get a number as prefix. Files are written in
 * sink.c; names.c defines the order.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/sink.h"

#include <stdlib.h>

int vgi_file_name_numbered(vg_bytes *file, uint64_t number, const char *name, const char *suffix, vg_err *e)
{
    char digits[32];
    int n = snprintf(digits, sizeof digits, "%04llu_", (unsigned long long)number);
    file->size = 0;
    int r = vgi_bytes_append(file, digits, (size_t)n, e);
    if (r == VG_OK) r = vgi_bytes_append(file, name, strlen(name), e);
    for (size_t i = (size_t)n; r == VG_OK && i < file->size; i++)
        if (strchr("/\\", file->data[i])) file->data[i] = '_';
    return r < 0 ? r : vgi_bytes_append(file, suffix, strlen(suffix) + 1, e);
}

/* Whether this is a possible file name that readers take for a pose. In a zip they may read '\' as '/'. */
static bool is_file_name(const char *name)
{
    return *name && *name != '.' && !strpbrk(name, "/\\");
}

/* Remember `file` as the last one; false if it does not sort after the previous one. */
static int check_order(vgi_file_names *t, const char *file, bool *follows, vg_err *e)
{
    *follows = !t->last.size || vgi_natural_compare((char *)t->last.data, file) < 0;
    t->last.size = 0;
    return vgi_bytes_append(&t->last, file, strlen(file) + 1, e);
}

int vgi_file_names_next(vgi_file_names *t, const char *name, const char *suffix, vg_err *e)
{
    bool follows = false;
    t->file.size = 0;
    int r = vgi_names_add(&t->frames, name, strlen(name), e);
    if (r == VG_OK && !t->numbered && is_file_name(name)) {
        r = vgi_bytes_append(&t->file, name, strlen(name), e);
        if (r == VG_OK) r = vgi_bytes_append(&t->file, suffix, strlen(suffix) + 1, e);
        if (r == VG_OK) r = check_order(t, (char *)t->file.data, &follows, e);
    }
    if (r < 0 || follows) return r;
    bool begins = !t->numbered;
    if (begins) t->first_numbered = t->frames.n - 1;
    t->numbered = true;
    r = vgi_file_name_numbered(&t->file, t->frames.n - 1, name, suffix, e);
    return r < 0 ? r : begins;
}

int vgi_file_names_series(vgi_file_names *t, const char *path, vg_err *e)
{
    bool follows;
    int r = check_order(t, path, &follows, e);
    if (r < 0 || follows) return r;
    return vg_fail(e, VG_EARG,
                   "'%s' would sort before the file of the previous frame (digits after a point are decimals, those "
                   "after '_-' are negative): choose another pattern",
                   path);
}

int vgi_file_names_warn(const vgi_file_names *t, const char *suffix, vgi_names *warnings, vg_err *e)
{
    static const char text[] = "the names of the frames do not sort in frame order: files get a number as prefix, "
                               "such as '";
    vg_bytes file = {0}, line = {0};
    if (!t->numbered) return VG_OK;
    int r = vgi_file_name_numbered(&file, t->first_numbered, t->frames.at[t->first_numbered], suffix, e);
    if (r == VG_OK) r = vgi_bytes_append(&line, text, sizeof text - 1, e);
    if (r == VG_OK) r = vgi_bytes_append(&line, file.data, file.size - 1, e);
    if (r == VG_OK) r = vgi_bytes_append(&line, "'", 1, e);
    if (r == VG_OK) r = vgi_names_add(warnings, (char *)line.data, line.size, e);
    vg_bytes_clear(&file);
    vg_bytes_clear(&line);
    return r;
}

void vgi_file_names_clear(vgi_file_names *t)
{
    vgi_names_clear(&t->frames);
    vg_bytes_clear(&t->file);
    vg_bytes_clear(&t->last);
    *t = (vgi_file_names){0};
}
