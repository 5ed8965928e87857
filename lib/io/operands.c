/* operands.c: the files that an operand names: the file itself, the mesh files of a directory, or all that match a
 * quoted pattern. They are read in source.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <dirent.h>
#include <errno.h>
#include <glob.h>
#include <sys/stat.h>

enum worth { NOTHING, WHOLE_SEQUENCE, ONE_POSE };

static enum worth judge_file(DIR *dir, const char *name)
{
    char stem[NAME_MAX + 1];
    struct stat st;
    size_t n = vgi_packed_stem(name);
    if (*name == '.' || n >= sizeof stem) return NOTHING;
    memcpy(stem, name, n);
    stem[n] = 0;
    enum worth worth = vgi_format_by_suffix(stem) ? ONE_POSE : vgi_packable(stem) ? WHOLE_SEQUENCE : NOTHING;
    return worth && fstatat(dirfd(dir), name, &st, 0) == 0 && S_ISREG(st.st_mode) ? worth : NOTHING;
}

/* Files that hold a sequence are used only if there are no mesh files, because a skeleton or an array beside meshes
 * describes the same poses. */
static int list_files(vgi_names *names, DIR *dir, vg_err *e)
{
    enum worth best = WHOLE_SEQUENCE;
    struct dirent *d;
    int r = VG_OK;
    while (r == VG_OK && (errno = 0, d = readdir(dir))) {
        enum worth worth = judge_file(dir, d->d_name);
        if (worth > best) {
            vgi_names_clear(names);
            best = worth;
        }
        if (worth == best) r = vgi_names_add(names, d->d_name, strlen(d->d_name), e);
    }
    return r;
}

/* full: "DIR/NAME", without terminator */
static int join_path(vg_bytes *full, const char *dir, const char *name, vg_err *e)
{
    size_t n = strlen(dir);
    while (n > 1 && dir[n - 1] == '/') n--;
    full->size = 0;
    int r = vgi_bytes_append(full, dir, n, e);
    if (r == VG_OK && dir[n - 1] != '/') r = vgi_bytes_append(full, "/", 1, e);
    return r < 0 ? r : vgi_bytes_append(full, name, strlen(name), e);
}

int vgi_directory_poses(vgi_names *paths, const char *path, vg_err *e)
{
    DIR *dir = opendir(path);
    struct dirent *d;
    vg_bytes full = {0};
    int r = dir ? VG_OK : vg_fail(e, VG_ESYS, "cannot open directory '%s': %s", path, strerror(errno));
    while (r == VG_OK && (d = readdir(dir))) {
        if (judge_file(dir, d->d_name) != ONE_POSE) continue;
        r = join_path(&full, path, d->d_name, e);
        if (r == VG_OK) r = vgi_names_add(paths, (char *)full.data, full.size, e);
    }
    if (dir) closedir(dir);
    vg_bytes_clear(&full);
    vgi_names_sort(paths);
    return r;
}

static int list_directory(vgi_names *names, const char *path, vg_err *e)
{
    DIR *dir = opendir(path);
    if (!dir) return vg_fail(e, VG_ESYS, "cannot open directory '%s': %s", path, strerror(errno));
    int r = list_files(names, dir, e);
    if (r == VG_OK && errno) r = vg_fail(e, VG_ESYS, "cannot read directory '%s': %s", path, strerror(errno));
    closedir(dir);
    if (r == VG_OK && names->n == 0)
        r = vg_fail(e, VG_EINPUT, "directory '%s' holds no mesh file (%s)", path, vgi_kinds_read());
    vgi_names_sort(names);
    return r;
}

static int add_directory(vgi_names *paths, const char *path, vg_err *e)
{
    vgi_names names = {0};
    vg_bytes full = {0};
    int r = list_directory(&names, path, e);
    for (size_t i = 0; r == VG_OK && i < names.n; i++) {
        r = join_path(&full, path, names.at[i], e);
        if (r == VG_OK) r = vgi_names_add(paths, (char *)full.data, full.size, e);
    }
    vg_bytes_clear(&full);
    vgi_names_clear(&names);
    return r;
}

static int add_existing(vgi_names *paths, const char *path, const struct stat *st, vg_err *e)
{
    return S_ISDIR(st->st_mode) ? add_directory(paths, path, e) : vgi_names_add(paths, path, strlen(path), e);
}

static int list_pattern(vgi_names *names, const char *pattern, vg_err *e)
{
    glob_t g = {0};
    int found = glob(pattern, GLOB_NOSORT, NULL, &g), r = VG_OK;
    if (found == GLOB_NOSPACE) r = vg_fail(e, VG_ENOMEM, "not enough memory for the files of '%s'", pattern);
    else if (found != 0) r = vg_fail(e, VG_ESYS, "no file matches '%s'", pattern);
    for (size_t i = 0; r == VG_OK && i < g.gl_pathc; i++)
        r = vgi_names_add(names, g.gl_pathv[i], strlen(g.gl_pathv[i]), e);
    globfree(&g);
    vgi_names_sort(names);
    return r;
}

static int add_pattern(vgi_names *paths, const char *pattern, vg_err *e)
{
    vgi_names names = {0};
    struct stat st;
    int r = list_pattern(&names, pattern, e);
    for (size_t i = 0; r == VG_OK && i < names.n; i++) {
        if (stat(names.at[i], &st) < 0) r = vg_fail(e, VG_ESYS, "cannot open '%s': %s", names.at[i], strerror(errno));
        else r = add_existing(paths, names.at[i], &st, e);
    }
    vgi_names_clear(&names);
    return r;
}

int vgi_operand_files(vgi_names *paths, const char *operand, vg_err *e)
{
    struct stat st;
    if (stat(operand, &st) == 0) return add_existing(paths, operand, &st, e);
    if (errno == ENOENT && strpbrk(operand, "*?[")) return add_pattern(paths, operand, e);
    return vg_fail(e, VG_ESYS, "cannot open '%s': %s", operand, strerror(errno));
}
