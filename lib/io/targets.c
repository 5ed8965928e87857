/* targets.c: files on their way to their final names: each is written beside its place under a temporary one, and all
 * are renamed together, or removed.
 * Leaves out what is written into them (sink.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/sink.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

/* A file beside its final place under a name that nobody has. mkstemp would do, but for the mode, which is the user's
 * choice (umask). The target knows the name before there is a file, so that vgi_targets_remove misses none. */
static int create_beside(vgi_targets *t, vgi_target *target, vg_err *e)
{
    const char *final = target->final;
    char *dir = vgi_parent_directory(final, strlen(final), e);
    size_t n = dir ? strlen(dir) + 64 : 0;
    char *path = dir ? vgi_array_raw(n, 1, e) : NULL;
    int fd = path ? -1 : VG_ENOMEM;
    if (path) *path = 0, target->temporary = path;
    for (int attempt = 0; path && fd < 0 && attempt < 1000; attempt++) {
        snprintf(path, n, "%s/.vg-%ld-%llu.tmp", dir, (long)getpid(), (unsigned long long)t->temporaries++);
        fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd < 0 && errno != EEXIST) break;
    }
    if (path && fd < 0) fd = vg_fail(e, VG_ESYS, "cannot create a file for '%s': %s", final, strerror(errno));
    if (fd < 0) target->temporary = NULL, free(path);
    free(dir);
    return fd;
}

static int make_room(vgi_targets *t, vg_err *e)
{
    if (t->n < t->cap) return VG_OK;
    size_t cap = t->cap ? 2 * t->cap : 16;
    vgi_target *grown = vgi_array(cap, sizeof *grown, e), *old = t->at;
    if (!grown) return VG_ENOMEM;
    if (t->n) memcpy(grown, old, t->n * sizeof *grown);
    t->at = grown, t->cap = cap;
    free(old);
    return VG_OK;
}

int vgi_target_look(const char *path, struct stat *st, vg_err *e)
{
    struct stat link;
    bool exists = stat(path, st) == 0;
    if (!exists && errno != ENOENT) return vg_fail(e, VG_ESYS, "cannot write '%s': %s", path, strerror(errno));
    if (exists && S_ISDIR(st->st_mode)) return vg_fail(e, VG_ESYS, "cannot write '%s': it is a directory", path);
    if (!exists && lstat(path, &link) == 0)
        return vg_fail(e, VG_ESYS, "cannot write '%s': it is a link to a file that is not there", path);
    return exists;
}

int vgi_targets_open(vgi_targets *t, const char *path, vg_err *e)
{
    struct stat st;
    int fd, r = make_room(t, e), exists = r < 0 ? r : vgi_target_look(path, &st, e);
    if (exists < 0) return exists;
    char *real = exists ? realpath(path, NULL) : NULL;
    vgi_target *target = &t->at[t->n];
    *target = (vgi_target){.final = real ? real : vgi_copy_string(path, strlen(path), e)};
    if (!target->final) return VG_ENOMEM;
    t->n++;
    if (exists && !S_ISREG(st.st_mode)) {
        fd = open(path, O_WRONLY | O_CLOEXEC);
        if (fd < 0) fd = vg_fail(e, VG_ESYS, "cannot open '%s': %s", path, strerror(errno));
    } else {
        fd = create_beside(t, target, e);
    }
    if (fd < 0) t->n--, free(target->final);
    return fd;
}

bool vgi_targets_in_place(const vgi_targets *t)
{
    return !t->at[t->n - 1].temporary;
}

/* close(2) is where some file systems say that the disk is full. */
int vgi_target_close(int fd, const char *name, vg_err *e)
{
    return close(fd) == 0 ? VG_OK : vg_fail(e, VG_ESYS, "cannot write to '%s': %s", name, strerror(errno));
}

int vgi_targets_rename(vgi_targets *t, vg_err *e)
{
    for (size_t i = 0; i < t->n; i++) {
        vgi_target *target = &t->at[i];
        if (target->temporary && rename(target->temporary, target->final) < 0)
            return vg_fail(e, VG_ESYS, "cannot write '%s': %s", target->final, strerror(errno));
        target->renamed = target->temporary != NULL;
    }
    return VG_OK;
}

void vgi_targets_remove(const vgi_targets *t)
{
    for (size_t i = 0; i < t->n; i++) {
        const vgi_target *target = &t->at[i];
        if (target->renamed) unlink(target->final);
        else if (target->temporary) unlink(target->temporary);
    }
}

void vgi_targets_clear(vgi_targets *t)
{
    for (size_t i = 0; i < t->n; i++) {
        free(t->at[i].final);
        free(t->at[i].temporary);
    }
    free(t->at);
    *t = (vgi_targets){0};
}
