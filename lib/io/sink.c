/* sink.c: the door out for mesh files: one file, a numbered series, a directory, an archive, standard output.
 * Leaves out the text of a mesh file (format.c) and the bytes of an archive (archive.c).
 *
 * Everything is written beside its place under a temporary name and takes its final one in vg_sink_end; pipes and
 * devices, which cannot be replaced, are written where they are.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

enum kind { STDOUT, ONE_FILE, SERIES, DIRECTORY, ARCHIVE };

/* What the name of the output asks for. */
typedef struct plan {
    enum kind kind;
    const vgi_format *format;
    const char *name; /* the output without ":format": `length` bytes */
    size_t length;
    size_t at, behind; /* series: where %d starts, and where the name goes on */
    int width;         /* of the zero-padded number */
} plan;

/* A file on its way to its final name. */
typedef struct target {
    char *final, *temporary; /* temporary NULL: written in place */
    bool renamed;
} target;

struct vg_sink {
    plan plan;
    char *output; /* what plan.name points to */
    const vg_head *head; /* borrowed */
    bool full_precision;
    uint64_t number; /* of the next file of a series */
    uint64_t frames, temporaries;
    bool made_directory, ended;
    vg_bytes text, path; /* reused */
    vgi_names names;     /* frames in a directory or archive, to find the second of a name */
    size_t *slots, nslots; /* hash table: positions in names + 1, 0 = free; nslots is a power of two */
    target *targets;
    size_t ntargets, targets_cap;
    int fd; /* the one file or archive; -1 */
    vgi_packer *packer;
};

/* ---- the name of the output ---- */

static bool is_directory(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISDIR(st.st_mode);
}

/* "NAME:ply": does this name hold many files, so that what stands behind the colon chooses their format? */
static bool holds_many(const char *name, size_t n, vg_err *e)
{
    if (n == 0) return false;
    if (vgi_packer_knows(name, n) || name[n - 1] == '/') return true;
    char *copy = vgi_copy_string(name, n, e);
    bool yes = copy && is_directory(copy);
    free(copy);
    return yes;
}

static int unknown_format(const char *name, vg_err *e)
{
    return vg_fail(e, VG_EARG, "unknown format '%s': known are %s", name, vgi_format_names());
}

static int split_choice(plan *p, const char *output, vg_err *e)
{
    const char *colon = strrchr(output, ':');
    p->name = output;
    p->length = strlen(output);
    if (!colon || !holds_many(output, (size_t)(colon - output), e)) return VG_OK;
    if (!(p->format = vgi_format_by_name(colon + 1, strlen(colon + 1)))) return unknown_format(colon + 1, e);
    p->length = (size_t)(colon - output);
    return VG_OK;
}

static int bad_pattern(const char *output, vg_err *e)
{
    return vg_fail(e, VG_EARG,
                   "'%s' needs exactly one %%d or %%04d for the number of the pose (%%%% for a percent sign)",
                   output);
}

/* The one %d or %0Nd of a series. The name is never handed to printf. */
static int find_number(plan *p, vg_err *e)
{
    const char *s = p->name;
    int found = 0;
    for (size_t i = 0; i < p->length; i++) {
        if (s[i] != '%') continue;
        size_t start = i++;
        if (i < p->length && s[i] == '%') continue;
        int width = 0;
        if (i < p->length && s[i] == '0')
            for (i++; i < p->length && s[i] >= '0' && s[i] <= '9' && width < 100; i++)
                width = 10 * width + s[i] - '0';
        if (i >= p->length || s[i] != 'd' || width > 20 || found++) return bad_pattern(s, e);
        p->at = start, p->behind = i + 1, p->width = width;
    }
    return found ? VG_OK : bad_pattern(s, e);
}

static int unknown_kind(const char *output, vg_err *e)
{
    return vg_fail(e, VG_EARG,
                   "cannot tell the format of '%s': known are .obj .ply .off, archives %s, or name it with --format",
                   output, vgi_packer_suffixes());
}

static int tell_kind(plan *p, const char *output, vg_err *e)
{
    if (!strcmp(output, "-")) return p->kind = STDOUT, VG_OK;
    if (vgi_packer_knows(output, p->length)) return p->kind = ARCHIVE, VG_OK;
    if (p->length < strlen(output) || output[p->length - 1] == '/' || is_directory(output))
        return p->kind = DIRECTORY, VG_OK;
    if (!p->format && !(p->format = vgi_format_by_suffix(output))) return unknown_kind(output, e);
    if (!memchr(output, '%', p->length)) return p->kind = ONE_FILE, VG_OK;
    p->kind = SERIES;
    return find_number(p, e);
}

static int make_plan(plan *p, const char *output, const vg_sink_options *o, vg_err *e)
{
    *p = (plan){0};
    if (!*output) return vg_fail(e, VG_EARG, "the name of the output is empty");
    if (o->first_number < 0) return vg_fail(e, VG_EARG, "the first number must not be negative");
    int r = split_choice(p, output, e);
    if (r < 0) return r;
    if (o->format && !(p->format = vgi_format_by_name(o->format, strlen(o->format))))
        return unknown_format(o->format, e);
    r = tell_kind(p, output, e);
    if (!p->format) p->format = &vgi_format_obj;
    return r;
}

/* ---- what can be told without writing ---- */

/* The directory in which a file of this name would lie; free it. */
static char *parent_of(const char *path, size_t n, vg_err *e)
{
    while (n > 1 && path[n - 1] == '/') n--;
    while (n > 0 && path[n - 1] != '/') n--;
    while (n > 1 && path[n - 1] == '/') n--;
    return n ? vgi_copy_string(path, n, e) : vgi_copy_string(".", 1, e);
}

static int check_directory(const char *dir, const char *output, vg_err *e)
{
    struct stat st;
    if (stat(dir, &st) < 0 || access(dir, W_OK | X_OK) < 0)
        return vg_fail(e, VG_ESYS, "cannot write '%s': directory '%s': %s", output, dir, strerror(errno));
    if (!S_ISDIR(st.st_mode)) return vg_fail(e, VG_ESYS, "cannot write '%s': '%s' is no directory", output, dir);
    return VG_OK;
}

/* May the file be replaced, or written in place if it is a pipe or device? */
static int check_file(const char *path, vg_err *e)
{
    struct stat st;
    if (stat(path, &st) == 0 && S_ISDIR(st.st_mode))
        return vg_fail(e, VG_ESYS, "cannot write '%s': it is a directory", path);
    if (stat(path, &st) == 0 && !S_ISREG(st.st_mode))
        return access(path, W_OK) == 0 ? VG_OK : vg_fail(e, VG_ESYS, "cannot write '%s': %s", path, strerror(errno));
    char *real = realpath(path, NULL);
    char *dir = parent_of(real ? real : path, strlen(real ? real : path), e);
    int r = dir ? check_directory(dir, path, e) : VG_ENOMEM;
    free(real);
    free(dir);
    return r;
}

static int check_place(const plan *p, vg_err *e)
{
    if (p->kind == STDOUT) return VG_OK;
    char *name = vgi_copy_string(p->name, p->length, e), *dir = NULL;
    if (!name) return VG_ENOMEM;
    int r;
    if (p->kind == DIRECTORY && is_directory(name)) {
        r = check_directory(name, name, e);
    } else if (p->kind == DIRECTORY || p->kind == SERIES) {
        if (!(dir = parent_of(name, p->length, e))) r = VG_ENOMEM;
        else
            r = strchr(dir, '%') ? VG_OK
                                 : check_directory(dir, name, e); /* numbered directories are met when written */
    } else {
        r = check_file(name, e);
    }
    free(name);
    free(dir);
    return r;
}

int vg_sink_check(const char *output, const vg_sink_options *o, vg_err *e)
{
    plan p;
    int r = make_plan(&p, output, o, e);
    return r < 0 ? r : check_place(&p, e);
}

static int check_kind(const vg_head *h, const char *output, vg_err *e)
{
    if (h->kind == VG_VERTICES) return VG_OK;
    const char *advice = h->kind == VG_VECTORS ? "pipe it through vg-solve first"
                         : h->kind == VG_DEFORMATIONS
                             ? "apply them with vg-deform and pipe that through vg-solve first"
                             : "only vertices can be written as meshes";
    return vg_fail(e, VG_EARG, "cannot write '%s': the input holds %s: %s", output, vg_kind_name(h->kind), advice);
}

/* ---- temporary files ---- */

/* A name beside `final` that nobody has. mkstemp would do, but for the mode, which is the user's choice (umask). */
static int create_beside(vg_sink *s, const char *final, char **temporary, vg_err *e)
{
    char *dir = parent_of(final, strlen(final), e);
    size_t n = dir ? strlen(dir) + 64 : 0;
    char *path = dir ? vgi_array_raw(n, 1, e) : NULL;
    int fd = path ? -1 : VG_ENOMEM;
    for (int attempt = 0; path && fd < 0 && attempt < 1000; attempt++) {
        snprintf(path, n, "%s/.vg-%ld-%llu.tmp", dir, (long)getpid(), (unsigned long long)s->temporaries++);
        fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd < 0 && errno != EEXIST) break;
    }
    if (path && fd < 0) fd = vg_fail(e, VG_ESYS, "cannot create a file for '%s': %s", final, strerror(errno));
    if (fd < 0) free(path);
    else *temporary = path;
    free(dir);
    return fd;
}

/* Open what will be `path`: a descriptor, or negative. The target is remembered. A link is followed: what it points
 * to is replaced, not the link. */
static int open_target(vg_sink *s, const char *path, vg_err *e)
{
    struct stat st;
    int fd, r = vgi_grow(&s->targets, &s->targets_cap, s->ntargets + 1, sizeof *s->targets, e);
    if (r < 0) return r;
    bool exists = stat(path, &st) == 0;
    if (exists && S_ISDIR(st.st_mode)) return vg_fail(e, VG_ESYS, "cannot write '%s': it is a directory", path);
    char *real = exists ? realpath(path, NULL) : NULL;
    target t = {.final = real ? real : vgi_copy_string(path, strlen(path), e)};
    if (!t.final) return VG_ENOMEM;
    if (exists && !S_ISREG(st.st_mode)) {
        fd = open(path, O_WRONLY | O_CLOEXEC);
        if (fd < 0) fd = vg_fail(e, VG_ESYS, "cannot open '%s': %s", path, strerror(errno));
    } else {
        fd = create_beside(s, t.final, &t.temporary, e);
    }
    if (fd < 0) free(t.final);
    else s->targets[s->ntargets++] = t;
    return fd;
}

/* close(2) is where some file systems say that the disk is full. */
static int close_target(int fd, const char *name, vg_err *e)
{
    return close(fd) == 0 ? VG_OK : vg_fail(e, VG_ESYS, "cannot write to '%s': %s", name, strerror(errno));
}

static int rename_targets(vg_sink *s, vg_err *e)
{
    for (size_t i = 0; i < s->ntargets; i++) {
        target *t = &s->targets[i];
        if (t->temporary && rename(t->temporary, t->final) < 0)
            return vg_fail(e, VG_ESYS, "cannot write '%s': %s", t->final, strerror(errno));
        t->renamed = t->temporary != NULL;
    }
    return VG_OK;
}

/* Of a failed run nothing stays: half a series under final names would look like a whole one. */
static void remove_targets(vg_sink *s)
{
    for (size_t i = 0; i < s->ntargets; i++) {
        target *t = &s->targets[i];
        if (t->renamed) unlink(t->final);
        else if (t->temporary) unlink(t->temporary);
    }
    if (s->made_directory) rmdir(s->output);
}

/* ---- names of frames ---- */

static size_t hash_name(const char *s)
{
    uint64_t h = 14695981039346656037u; /* FNV-1a */
    for (; *s; s++) h = (h ^ (unsigned char)*s) * 1099511628211u;
    return (size_t)(h ^ h >> 32);
}

/* Where the name is in the table, or the free slot where it belongs. */
static size_t find_slot(const vg_sink *s, const char *name)
{
    size_t i = hash_name(name) & (s->nslots - 1);
    while (s->slots[i] && strcmp(s->names.at[s->slots[i] - 1], name) != 0) i = (i + 1) & (s->nslots - 1);
    return i;
}

static int grow_slots(vg_sink *s, vg_err *e)
{
    if (2 * (s->names.n + 1) <= s->nslots) return VG_OK;
    size_t n = s->nslots ? 2 * s->nslots : 64, *slots = vgi_array(n, sizeof *slots, e);
    if (!slots) return VG_ENOMEM;
    free(s->slots);
    s->slots = slots, s->nslots = n;
    for (size_t i = 0; i < s->names.n; i++) s->slots[find_slot(s, s->names.at[i])] = i + 1;
    return VG_OK;
}

static int take_name(vg_sink *s, const char *name, vg_err *e)
{
    if (!*name || !strcmp(name, ".") || !strcmp(name, "..") || strchr(name, '/'))
        return vg_fail(e, VG_EINPUT,
                       "frame %llu is called '%s', which is no file name: number the files with a pattern like "
                       "'pose-%%04d.obj'",
                       (unsigned long long)s->frames, name);
    int r = grow_slots(s, e);
    if (r < 0) return r;
    size_t slot = find_slot(s, name);
    if (s->slots[slot])
        return vg_fail(e, VG_EINPUT,
                       "two frames are called '%s': number the files with a pattern like 'pose-%%04d.obj'", name);
    if ((r = vgi_names_add(&s->names, name, strlen(name), e)) == VG_OK) s->slots[slot] = s->names.n;
    return r;
}

/* ---- the paths of files ---- */

static int append_unescaped(vg_bytes *path, const char *s, size_t n, vg_err *e)
{
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < n; i++) {
        if (s[i] == '%') i++; /* %% */
        r = vgi_bytes_append(path, &s[i], 1, e);
    }
    return r;
}

static int series_path(vg_sink *s, vg_err *e)
{
    const plan *p = &s->plan;
    char digits[24];
    size_t n = vgi_print_uint(digits, s->number);
    s->path.size = 0;
    int r = append_unescaped(&s->path, s->output, p->at, e);
    for (size_t i = n; r == VG_OK && i < (size_t)p->width; i++) r = vgi_bytes_append(&s->path, "0", 1, e);
    if (r == VG_OK) r = vgi_bytes_append(&s->path, digits, n, e);
    if (r == VG_OK) r = append_unescaped(&s->path, s->output + p->behind, p->length - p->behind, e);
    return r < 0 ? r : vgi_bytes_append(&s->path, "", 1, e);
}

/* "DIR/NAME.obj"; in an archive without the directory. */
static int named_path(vg_sink *s, const char *name, vg_err *e)
{
    const char *suffix = s->plan.format->suffix;
    size_t n = s->plan.kind == DIRECTORY ? s->plan.length : 0;
    s->path.size = 0;
    int r = vgi_bytes_append(&s->path, s->output, n, e);
    if (r == VG_OK && n && s->output[n - 1] != '/') r = vgi_bytes_append(&s->path, "/", 1, e);
    if (r == VG_OK) r = vgi_bytes_append(&s->path, name, strlen(name), e);
    return r < 0 ? r : vgi_bytes_append(&s->path, suffix, strlen(suffix) + 1, e);
}

/* ---- the door ---- */

static int make_directory(vg_sink *s, vg_err *e)
{
    if (mkdir(s->output, 0777) == 0) return s->made_directory = true, VG_OK;
    if (errno == EEXIST && is_directory(s->output)) return VG_OK;
    return vg_fail(e, VG_ESYS, "cannot make directory '%s': %s", s->output, strerror(errno));
}

static int open_place(vg_sink *s, vg_err *e)
{
    switch (s->plan.kind) {
    case DIRECTORY: return make_directory(s, e);
    case ONE_FILE:
    case ARCHIVE: s->fd = open_target(s, s->output, e); break;
    default: return VG_OK;
    }
    if (s->fd < 0) return s->fd;
    return s->plan.kind == ARCHIVE ? vgi_packer_open(&s->packer, s->fd, s->output, s->plan.length, e) : VG_OK;
}

int vg_sink_open(vg_sink **out, const char *output, const vg_head *h, const vg_sink_options *o, vg_err *e)
{
    vg_sink *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    s->fd = -1, s->head = h, s->full_precision = o->full_precision, s->number = (uint64_t)o->first_number;
    int r = make_plan(&s->plan, output, o, e);
    if (r == VG_OK) r = check_place(&s->plan, e);
    if (r == VG_OK) r = check_kind(h, output, e);
    if (r == VG_OK && !(s->output = vgi_copy_string(s->plan.name, s->plan.length, e))) r = VG_ENOMEM;
    if (r == VG_OK) r = open_place(s, e);
    if (r < 0) vg_sink_close(out);
    else s->plan.name = s->output;
    return r;
}

static int put_file(vg_sink *s, vg_err *e)
{
    const char *path = (char *)s->path.data;
    int fd = open_target(s, path, e);
    if (fd < 0) return fd;
    int r = vgi_write_all(fd, s->text.data, s->text.size, path, e);
    if (r < 0) return close(fd), r;
    return close_target(fd, path, e);
}

static int more_than_one(const vg_sink *s, vg_err *e)
{
    if (s->plan.kind == STDOUT)
        return vg_fail(e, VG_EARG,
                       "more than one pose does not fit onto standard output: name a pattern like 'pose-%%04d.obj', "
                       "a directory or an archive");
    const char *suffix = s->plan.format->suffix;
    size_t n = s->plan.length;
    if (vgi_has_suffix(s->output, n, suffix)) n -= strlen(suffix);
    return vg_fail(e, VG_EARG,
                   "more than one pose does not fit into '%s': use a pattern like '%.*s-%%04d%s', a directory or an "
                   "archive",
                   s->output, (int)n, s->output, suffix);
}

static int put_frame(vg_sink *s, const char *name, vg_err *e)
{
    int r;
    switch (s->plan.kind) {
    case SERIES:
        r = series_path(s, e);
        s->number++;
        return r < 0 ? r : put_file(s, e);
    case DIRECTORY:
        r = named_path(s, name, e);
        return r < 0 ? r : put_file(s, e);
    case ARCHIVE:
        r = named_path(s, name, e);
        return r < 0 ? r : vgi_packer_add(s->packer, (char *)s->path.data, s->text.data, s->text.size, e);
    default: /* one file: its text waits for vg_sink_end, so that a second frame leaves nothing in a pipe */
        return VG_OK;
    }
}

int vg_sink_put(vg_sink *s, const vg_frame *f, vg_err *e)
{
    const char *name = f->name ? f->name : "";
    enum kind kind = s->plan.kind;
    int r = VG_OK;
    if ((kind == ONE_FILE || kind == STDOUT) && s->frames > 0) return more_than_one(s, e);
    if (kind == DIRECTORY || kind == ARCHIVE) r = take_name(s, name, e);
    if (r < 0) return r;
    vg_err cause;
    s->text.size = 0;
    r = vg_model_write(&s->text, s->plan.format->name, &s->head->mesh, f->values, &s->head->attributes,
                       s->full_precision, &cause);
    if (r < 0) return vg_fail(e, r, "cannot write frame '%s' to '%s': %s", name, s->output, cause.message);
    if ((r = put_frame(s, name, e)) == VG_OK) s->frames++;
    return r;
}

static int end_single(vg_sink *s, vg_err *e)
{
    if (s->frames == 0) return vg_fail(e, VG_EINPUT, "there is no pose to be written to '%s'", s->output);
    int fd = s->plan.kind == STDOUT ? STDOUT_FILENO : s->fd;
    return vgi_write_all(fd, s->text.data, s->text.size, s->plan.kind == STDOUT ? "standard output" : s->output, e);
}

int vg_sink_end(vg_sink *s, vg_err *e)
{
    int r = VG_OK;
    if (s->plan.kind == ARCHIVE) r = vgi_packer_end(s->packer, e);
    else if (s->plan.kind == ONE_FILE || s->plan.kind == STDOUT) r = end_single(s, e);
    if (r == VG_OK && s->fd >= 0) {
        r = close_target(s->fd, s->output, e);
        s->fd = -1;
    }
    if (r == VG_OK) r = rename_targets(s, e);
    s->ended = r == VG_OK;
    return r;
}

void vg_sink_close(vg_sink **sink)
{
    vg_sink *s = *sink;
    if (!s) return;
    vgi_packer_close(&s->packer);
    if (s->fd >= 0) close(s->fd);
    if (!s->ended) remove_targets(s);
    for (size_t i = 0; i < s->ntargets; i++) {
        free(s->targets[i].final);
        free(s->targets[i].temporary);
    }
    free(s->targets);
    free(s->slots);
    vgi_names_clear(&s->names);
    vg_bytes_clear(&s->text);
    vg_bytes_clear(&s->path);
    free(s->output);
    free(s);
    *sink = NULL;
}
