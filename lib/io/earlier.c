/* earlier.c: finds mesh files of an earlier set where a new set is to be written. Those that are not overwritten
 * would be read as frames of the new set. The set is written in sink.c.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/sink.h"

#include <errno.h>
#include <glob.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

/* Quote a part of a pattern such as "pose-%04d.obj" for glob(3); "%%" is a percent sign. */
static int append_literal(vg_bytes *to, const char *s, size_t n, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < n; i++) {
        if (s[i] == '%') i++;
        if (strchr("*?[\\", s[i])) r = vgi_bytes_append(to, "\\", 1, e);
        if (r == VG_OK) r = vgi_bytes_append(to, &s[i], 1, e);
    }
    return r;
}

static size_t literal_length(const char *s, size_t n)
{
    size_t length = 0;
    for (size_t i = 0; i < n; i++, length++) i += s[i] == '%';
    return length;
}

/* Whether the part of the path between `before` and `after` bytes is a number from `first` on. */
static bool has_number(const char *path, size_t before, size_t after, uint64_t first)
{
    size_t n = strlen(path);
    if (n <= before + after || strspn(path + before, "0123456789") < n - before - after) return false;
    errno = 0;
    unsigned long long number = strtoull(path + before, NULL, 10);
    return errno || number >= first;
}

static int list_series(vgi_names *paths, const vgi_plan *p, uint64_t first, vg_err *e)
{
    vg_bytes pattern = {0};
    glob_t g = {0};
    const char *behind = p->name + p->behind;
    size_t before = literal_length(p->name, p->at), nbehind = p->length - p->behind;
    size_t after = literal_length(behind, nbehind);
    int r = append_literal(&pattern, p->name, p->at, e);
    if (r == VG_OK) r = vgi_bytes_append(&pattern, "*", 1, e);
    if (r == VG_OK) r = append_literal(&pattern, behind, nbehind, e);
    if (r == VG_OK) r = vgi_bytes_append(&pattern, "", 1, e);
    int found = r == VG_OK ? glob((char *)pattern.data, 0, NULL, &g) : 0;
    if (found == GLOB_NOSPACE) r = vg_fail(e, VG_ENOMEM, "not enough memory for the files of '%s'", p->name);
    struct stat st;
    for (size_t i = 0; r == VG_OK && found == 0 && i < g.gl_pathc; i++)
        if (has_number(g.gl_pathv[i], before, after, first) && !stat(g.gl_pathv[i], &st) && S_ISREG(st.st_mode))
            r = vgi_names_add(paths, g.gl_pathv[i], strlen(g.gl_pathv[i]), e);
    globfree(&g);
    vg_bytes_clear(&pattern);
    return r;
}

static int list_directory(vgi_names *paths, const vgi_plan *p, vg_err *e)
{
    char *dir = vgi_copy_string(p->name, p->length, e);
    int r = !dir ? VG_ENOMEM : vgi_is_directory(dir) ? vgi_directory_poses(paths, dir, e) : VG_OK;
    free(dir);
    return r;
}

int vgi_earlier_list(vgi_names *paths, const vgi_plan *p, const vg_sink_options *o, vg_err *e)
{
    int r = VG_OK;
    if (p->kind == VGI_PLAN_DIRECTORY) r = list_directory(paths, p, e);
    if (p->kind == VGI_PLAN_SERIES) r = list_series(paths, p, (uint64_t)o->first_number, e);
    if (r < 0 || o->replace || !paths->n) return r;
    return vg_fail(e, VG_EARG,
                   "there %s already at '%.*s', such as '%s', which would be read with the new ones: write elsewhere, "
                   "or replace the set with --replace",
                   paths->n == 1 ? "is a mesh file" : "are mesh files", (int)p->length, p->name, paths->at[0]);
}

static int compare_paths(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

int vgi_earlier_remove(const vgi_names *paths, const vg_targets *t, vg_err *e)
{
    vgi_names written = {0};
    int r = VG_OK;
    if (!paths->n) return VG_OK;
    for (size_t i = 0; r == VG_OK && i < t->n; i++) {
        char *real = realpath(t->at[i].final, NULL);
        if (real) r = vgi_names_add(&written, real, strlen(real), e);
        free(real);
    }
    if (r == VG_OK && written.n) qsort(written.at, written.n, sizeof *written.at, compare_paths);
    for (size_t i = 0; r == VG_OK && i < paths->n; i++) {
        char *real = realpath(paths->at[i], NULL);
        bool kept = real && written.n && bsearch(&real, written.at, written.n, sizeof real, compare_paths);
        if (!kept && unlink(paths->at[i]) < 0 && errno != ENOENT)
            r = vg_fail(e, VG_ESYS, "cannot remove '%s': %s", paths->at[i], strerror(errno));
        free(real);
    }
    vgi_names_clear(&written);
    return r;
}
