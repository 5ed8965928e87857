/* targets.c: files that are replaced as a whole: each is written to a temporary name beside its final one, and all
 * are renamed together, or removed. All output of the library and the programs uses this. Contents are written in
 * sink.c, by the writer of streams and by the programs.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/sink.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

char *vgi_parent_directory(const char *path, size_t n, vg_err *e)
{
    while (n > 1 && path[n - 1] == '/') n--;
    while (n > 0 && path[n - 1] != '/') n--;
    while (n > 1 && path[n - 1] == '/') n--;
    return n ? vgi_copy_string(path, n, e) : vgi_copy_string(".", 1, e);
}

int vgi_check_directory(const char *dir, const char *output, vg_err *e)
{
    struct stat st;
    if (stat(dir, &st) < 0 || access(dir, W_OK | X_OK) < 0)
        return vg_fail(e, VG_ESYS, "cannot write '%s': directory '%s': %s", output, dir, strerror(errno));
    if (!S_ISDIR(st.st_mode)) return vg_fail(e, VG_ESYS, "cannot write '%s': '%s' is not a directory", output, dir);
    return VG_OK;
}

/* 1 with *st if the path can be written or replaced; 0 if nothing exists there; negative for a directory, or a
 * dangling link, which a file would replace. */
static int look_at_path(const char *path, struct stat *st, vg_err *e)
{
    struct stat link;
    bool exists = stat(path, st) == 0;
    if (!exists && errno != ENOENT) return vg_fail(e, VG_ESYS, "cannot write '%s': %s", path, strerror(errno));
    if (exists && S_ISDIR(st->st_mode)) return vg_fail(e, VG_ESYS, "cannot write '%s': it is a directory", path);
    if (!exists && lstat(path, &link) == 0)
        return vg_fail(e, VG_ESYS, "cannot write '%s': it is a link to a file that does not exist", path);
    return exists;
}

int vg_target_check(const char *path, vg_err *e)
{
    struct stat st;
    int exists = look_at_path(path, &st, e);
    if (exists < 0) return exists;
    if (exists && !S_ISREG(st.st_mode))
        return access(path, W_OK) == 0 ? VG_OK : vg_fail(e, VG_ESYS, "cannot write '%s': %s", path, strerror(errno));
    char *real = realpath(path, NULL);
    char *dir = vgi_parent_directory(real ? real : path, strlen(real ? real : path), e);
    int r = dir ? vgi_check_directory(dir, path, e) : VG_ENOMEM;
    free(real);
    free(dir);
    return r;
}

/* Create a file with an unused name beside its final place. mkstemp would ignore the umask. The target stores the
 * name before the file exists, so that vg_targets_remove misses no file. */
static int create_beside(vg_targets *t, vg_target *target, vg_err *e)
{
    const char *final = target->final;
    char *dir = vgi_parent_directory(final, strlen(final), e);
    size_t n = dir ? strlen(dir) + 64 : 0;
    char *path = dir ? vgi_array_raw(n, 1, e) : NULL;
    int fd = path ? -1 : VG_ENOMEM;
    if (path) *path = 0, target->temporary = path;
    for (int attempt = 0; path && fd < 0 && attempt < 1000; attempt++) {
        snprintf(path, n, "%s/.vg-%ld-%llu.tmp", dir, (long)getpid(), (unsigned long long)t->temporaries++);
        fd = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd < 0 && errno != EEXIST) break;
    }
    if (path && fd < 0) fd = vg_fail(e, VG_ESYS, "cannot create a file for '%s': %s", final, strerror(errno));
    if (fd < 0) target->temporary = NULL, free(path);
    free(dir);
    return fd;
}

static int make_room(vg_targets *t, vg_err *e)
{
    if (t->n < t->cap) return VG_OK;
    size_t cap = t->cap ? 2 * t->cap : 16;
    vg_target *grown = vgi_array(cap, sizeof *grown, e), *old = t->at;
    if (!grown) return VG_ENOMEM;
    if (t->n) memcpy(grown, old, t->n * sizeof *grown);
    t->at = grown, t->cap = cap;
    free(old);
    return VG_OK;
}

int vg_targets_open(vg_targets *t, const char *path, vg_err *e)
{
    struct stat st;
    int fd, r = make_room(t, e), exists = r < 0 ? r : look_at_path(path, &st, e);
    if (exists < 0) return exists;
    char *real = exists ? realpath(path, NULL) : NULL;
    vg_target *target = &t->at[t->n];
    *target = (vg_target){.final = real ? real : vgi_copy_string(path, strlen(path), e)};
    if (!target->final) return VG_ENOMEM;
    t->n++;
    if (exists && !S_ISREG(st.st_mode)) {
        fd = open(path, O_WRONLY | O_NOCTTY | O_CLOEXEC);
        if (fd < 0) fd = vg_fail(e, VG_ESYS, "cannot open '%s': %s", path, strerror(errno));
    } else {
        fd = create_beside(t, target, e);
        if (fd >= 0 && exists && fchmod(fd, st.st_mode & 07777) < 0) {
            /* a file system without permissions: not an error */
        }
    }
    if (fd < 0) t->n--, free(target->final);
    return fd;
}

int vg_targets_name(vg_targets *t, size_t i, const char *path, vg_err *e)
{
    struct stat st;
    int exists = look_at_path(path, &st, e);
    if (exists < 0) return exists;
    char *real = exists ? realpath(path, NULL) : NULL;
    if (!real && !(real = vgi_copy_string(path, strlen(path), e))) return VG_ENOMEM;
    free(t->at[i].final);
    t->at[i].final = real;
    return VG_OK;
}

bool vg_targets_in_place(const vg_targets *t)
{
    return !t->at[t->n - 1].temporary;
}

int vg_target_close(int fd, const char *name, vg_err *e)
{
    return close(fd) == 0 ? VG_OK : vg_fail(e, VG_ESYS, "cannot write to '%s': %s", name, strerror(errno));
}

int vg_targets_rename(vg_targets *t, vg_err *e)
{
    for (size_t i = 0; i < t->n; i++) {
        vg_target *target = &t->at[i];
        if (target->temporary && rename(target->temporary, target->final) < 0)
            return vg_fail(e, VG_ESYS, "cannot write '%s': %s", target->final, strerror(errno));
        target->renamed = target->temporary != NULL;
    }
    return VG_OK;
}

void vg_targets_remove(const vg_targets *t)
{
    for (size_t i = 0; i < t->n; i++) {
        const vg_target *target = &t->at[i];
        if (target->renamed) unlink(target->final);
        else if (target->temporary) unlink(target->temporary);
    }
}

void vg_targets_clear(vg_targets *t)
{
    vg_targets old = *t;
    *t = (vg_targets){0}; /* first of all, because vg_targets_remove may be called from a signal handler */
    for (size_t i = 0; i < old.n; i++) {
        free(old.at[i].final);
        free(old.at[i].temporary);
    }
    free(old.at);
}
