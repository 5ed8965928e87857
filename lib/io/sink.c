/* sink.c: the door out: one mesh file, a numbered series, a directory, an archive, standard output, or one file that
 * holds the whole sequence.
 * Leaves out the text of a mesh file (format.c), the bytes of a sequence (sequence.c) and those of an archive
 * (pack.c).
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

enum kind { STDOUT, ONE_FILE, SERIES, DIRECTORY, ARCHIVE, SEQUENCE };

/* What the name of the output asks for. */
typedef struct plan {
    enum kind kind;
    const vgi_format *format;
    const vgi_sequence_format *sequence; /* SEQUENCE */
    bool to_stdout;                      /* which goes there */
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
    /* a sequence: */
    vg_sink_options options;
    void *state;
    vgi_output out;      /* fd: the file itself, or a nameless one when that is a pipe, which cannot be patched */
    char *mesh;          /* where its mesh went; NULL: nowhere */
    const vgi_format *mesh_format;
    /* without the vertices that are in no face: */
    vg_head slim;        /* head points to it then */
    uint32_t *kept;      /* its vertices; NULL: all are kept */
    vg_frame slim_frame;
    size_t loose;        /* vertices in no face */
    bool names_lost, times_lost;
    char scalars_lost[80]; /* what comes with the vertices: no format keeps it */
    vgi_names warnings;
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
    return vg_fail(e, VG_EARG, "unknown format '%s': known are %s, %s", name, vgi_format_names(),
                   vgi_sequence_names());
}

static int holds_all(const char *output, const vgi_sequence_format *f, const char *what, vg_err *e)
{
    return vg_fail(e, VG_EARG, "cannot write '%s': a %s file holds all poses: %s", output, f->name, what);
}

static const vgi_sequence_format *writable_sequence(const vgi_sequence_format *f)
{
    return f && f->begin ? f : NULL;
}

static int split_choice(plan *p, const char *output, vg_err *e)
{
    const char *colon = strrchr(output, ':');
    p->name = output;
    p->length = strlen(output);
    if (!colon || !holds_many(output, (size_t)(colon - output), e)) return VG_OK;
    const vgi_sequence_format *sequence = vgi_sequence_by_name(colon + 1, strlen(colon + 1));
    if (writable_sequence(sequence)) return holds_all(output, sequence, "name one file", e);
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
                   "cannot tell the format of '%s': known are %s, %s, archives %s; a directory ends in '/'", output,
                   vgi_format_names(), vgi_sequence_names(), vgi_packer_suffixes());
}

/* One file, whatever its name: it is not numbered. */
static int tell_sequence(plan *p, const char *output, vg_err *e)
{
    p->kind = SEQUENCE;
    p->to_stdout = !strcmp(output, "-");
    if (vgi_packer_knows(output, p->length))
        return holds_all(output, p->sequence, "it does not go into an archive", e);
    if (output[p->length - 1] == '/' || is_directory(output))
        return holds_all(output, p->sequence, "name one file", e);
    if (memchr(output, '%', p->length)) return holds_all(output, p->sequence, "leave out the %d", e);
    return VG_OK;
}

static int tell_kind(plan *p, const char *output, vg_err *e)
{
    if (p->sequence) return tell_sequence(p, output, e);
    if (!strcmp(output, "-")) return p->kind = STDOUT, VG_OK;
    if (vgi_packer_knows(output, p->length)) return p->kind = ARCHIVE, VG_OK;
    if (p->length < strlen(output) || output[p->length - 1] == '/' || is_directory(output))
        return p->kind = DIRECTORY, VG_OK;
    if (!p->format && (p->sequence = writable_sequence(vgi_sequence_by_suffix(output))))
        return tell_sequence(p, output, e);
    if (!p->format && !(p->format = vgi_format_by_suffix(output))) return unknown_kind(output, e);
    if (!memchr(output, '%', p->length)) return p->kind = ONE_FILE, VG_OK;
    p->kind = SERIES;
    return find_number(p, e);
}

/* Does the file need a mesh beside it? */
static bool lacks_faces(const plan *p)
{
    return p->kind == SEQUENCE && !(p->sequence->keeps & VGI_KEEPS_FACES);
}

static int check_mesh_option(const plan *p, const vg_sink_options *o, vg_err *e)
{
    if (!o->mesh && !o->no_mesh) return VG_OK;
    if (o->mesh && o->no_mesh) return vg_fail(e, VG_EARG, "--mesh and --no-mesh exclude each other");
    if (!lacks_faces(p))
        return vg_fail(e, VG_EARG, "'%.*s' holds its faces itself: leave out %s", (int)p->length, p->name,
                       o->mesh ? "--mesh" : "--no-mesh");
    const vgi_format *f = o->mesh ? vgi_format_by_suffix(o->mesh) : NULL;
    if (o->mesh && !(f && f->keeps & VGI_KEEPS_ORDER))
        return vg_fail(e, VG_EARG, "cannot write the mesh '%s': its name must end in .obj, .ply or .off", o->mesh);
    return VG_OK;
}

static int make_plan(plan *p, const char *output, const vg_sink_options *o, vg_err *e)
{
    *p = (plan){0};
    if (!*output) return vg_fail(e, VG_EARG, "the name of the output is empty");
    if (o->first_number < 0) return vg_fail(e, VG_EARG, "the first number must not be negative");
    int r = split_choice(p, output, e);
    if (r < 0) return r;
    if (o->format) {
        p->sequence = writable_sequence(vgi_sequence_by_name(o->format, strlen(o->format)));
        p->format = vgi_format_by_name(o->format, strlen(o->format));
        if (!p->format && !p->sequence) return unknown_format(o->format, e);
    }
    r = tell_kind(p, output, e);
    if (!p->format) p->format = &vgi_format_obj;
    if (r == VG_OK && o->full_precision &&
        !((p->sequence ? p->sequence->keeps : p->format->keeps) & VGI_KEEPS_DOUBLES))
        r = vg_fail(e, VG_EARG, "cannot write '%s' in full precision: %s holds binary32 only", output,
                    p->sequence ? p->sequence->name : p->format->name);
    if (r == VG_OK && o->most_targets && p->sequence != &vgi_sequence_glb && p->sequence != &vgi_sequence_gltf)
        r = vg_fail(e, VG_EARG, "--max-targets is for GLB and glTF: '%s' has no morph targets", output);
    return r < 0 ? r : check_mesh_option(p, o, e);
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
    if (p->kind == STDOUT || p->to_stdout) return VG_OK;
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
    if (r == VG_OK) r = check_place(&p, e);
    return r == VG_OK && o->mesh ? check_file(o->mesh, e) : r;
}

static int check_kind(const plan *p, const vg_head *h, const char *output, vg_err *e)
{
    const vgi_sequence_format *f = p->sequence;
    if (f ? f->kinds >> h->kind & 1 : h->kind == VG_VERTICES) return f && f->check ? f->check(h, output, e) : VG_OK;
    const char *advice = "make vertices of them with 'vg-deform --map MAP' first, or of a rig's a skin in a .glb";
    if (h->kind == VG_VECTORS) advice = "pipe it through 'vg-solve' first";
    if (h->kind == VG_DEFORMATIONS)
        advice = "apply them with 'vg-deform --onto MESH' and pipe that through 'vg-solve' first";
    return vg_fail(e, VG_EINPUT, "cannot write '%s': the input holds %s: %s", output, vg_kind_name(h->kind), advice);
}

/* ---- temporary files ---- */

/* A file beside t->final under a name that nobody has. mkstemp would do, but for the mode, which is the user's choice
 * (umask). The target knows the name before there is a file, so that vg_sink_discard misses none. */
static int create_beside(vg_sink *s, target *t, vg_err *e)
{
    const char *final = t->final;
    char *dir = parent_of(final, strlen(final), e);
    size_t n = dir ? strlen(dir) + 64 : 0;
    char *path = dir ? vgi_array_raw(n, 1, e) : NULL;
    int fd = path ? -1 : VG_ENOMEM;
    if (path) *path = 0, t->temporary = path;
    for (int attempt = 0; path && fd < 0 && attempt < 1000; attempt++) {
        snprintf(path, n, "%s/.vg-%ld-%llu.tmp", dir, (long)getpid(), (unsigned long long)s->temporaries++);
        fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd < 0 && errno != EEXIST) break;
    }
    if (path && fd < 0) fd = vg_fail(e, VG_ESYS, "cannot create a file for '%s': %s", final, strerror(errno));
    if (fd < 0) t->temporary = NULL, free(path);
    free(dir);
    return fd;
}

/* One more target. The list is whole at any moment, for vg_sink_discard may look at it from a signal's handler. */
static int make_room(vg_sink *s, vg_err *e)
{
    if (s->ntargets < s->targets_cap) return VG_OK;
    size_t cap = s->targets_cap ? 2 * s->targets_cap : 16;
    target *grown = vgi_array(cap, sizeof *grown, e), *old = s->targets;
    if (!grown) return VG_ENOMEM;
    if (s->ntargets) memcpy(grown, old, s->ntargets * sizeof *grown);
    s->targets = grown, s->targets_cap = cap;
    free(old);
    return VG_OK;
}

/* Open what will be `path`: a descriptor, or negative. The target is remembered. A link is followed: what it points
 * to is replaced, not the link. */
static int open_target(vg_sink *s, const char *path, vg_err *e)
{
    struct stat st;
    int fd, r = make_room(s, e);
    if (r < 0) return r;
    bool exists = stat(path, &st) == 0;
    if (exists && S_ISDIR(st.st_mode)) return vg_fail(e, VG_ESYS, "cannot write '%s': it is a directory", path);
    char *real = exists ? realpath(path, NULL) : NULL;
    target *t = &s->targets[s->ntargets];
    *t = (target){.final = real ? real : vgi_copy_string(path, strlen(path), e)};
    if (!t->final) return VG_ENOMEM;
    s->ntargets++;
    if (exists && !S_ISREG(st.st_mode)) {
        fd = open(path, O_WRONLY | O_CLOEXEC);
        if (fd < 0) fd = vg_fail(e, VG_ESYS, "cannot open '%s': %s", path, strerror(errno));
    } else {
        fd = create_beside(s, t, e);
    }
    if (fd < 0) s->ntargets--, free(t->final);
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
static void remove_targets(const vg_sink *s)
{
    for (size_t i = 0; i < s->ntargets; i++) {
        const target *t = &s->targets[i];
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

/* ---- files ---- */

static int put_file(vg_sink *s, const char *path, vg_err *e)
{
    int fd = open_target(s, path, e);
    if (fd < 0) return fd;
    int r = vgi_write_all(fd, s->text.data, s->text.size, path, e);
    if (r < 0) return close(fd), r;
    return close_target(fd, path, e);
}

static int make_directory(vg_sink *s, vg_err *e)
{
    if (mkdir(s->output, 0777) == 0) return s->made_directory = true, VG_OK;
    if (errno == EEXIST && is_directory(s->output)) return VG_OK;
    return vg_fail(e, VG_ESYS, "cannot make directory '%s': %s", s->output, strerror(errno));
}

/* A pipe cannot be patched: what goes there waits in a file without a name. */
static int open_sequence(vg_sink *s, vg_err *e)
{
    s->fd = s->plan.to_stdout ? -1 : open_target(s, s->output, e);
    if (s->fd < 0 && !s->plan.to_stdout) return s->fd;
    bool patchable = s->fd >= 0 && s->targets[s->ntargets - 1].temporary;
    s->out.name = s->output;
    s->out.fd = patchable ? s->fd : vgi_nameless_file(e);
    return s->out.fd < 0 ? s->out.fd : s->plan.sequence->begin(&s->state, s->head, &s->options, &s->out, e);
}

static int open_place(vg_sink *s, vg_err *e)
{
    switch (s->plan.kind) {
    case SEQUENCE: return open_sequence(s, e);
    case DIRECTORY: return make_directory(s, e);
    case ONE_FILE:
    case ARCHIVE: s->fd = open_target(s, s->output, e); break;
    default: return VG_OK;
    }
    if (s->fd < 0) return s->fd;
    return s->plan.kind == ARCHIVE ? vgi_packer_open(&s->packer, s->fd, s->output, s->plan.length, e) : VG_OK;
}

/* ---- the mesh beside a sequence ---- */

static bool same_singles(const double *a, const double *b, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if ((float)a[i] != (float)b[i]) return false;
    return true;
}

/* Nobody named this file, so what is there stays: it may be the very mesh, or else the user must choose. */
static int keep_mesh(const vg_sink *s, vg_err *e)
{
    vg_head there = {0};
    int r = vg_load_mesh(&there, s->mesh, NULL);
    bool same = r == VG_OK && vg_mesh_same(&there.mesh, "", &s->head->mesh, "", NULL) == VG_OK &&
                same_singles(there.reference, s->head->reference, 3 * there.mesh.nv);
    vg_head_clear(&there);
    if (same) return VG_OK;
    return vg_fail(e, VG_EARG,
                   "'%s', which goes with '%s', is there already and is not the reference pose: choose where "
                   "the mesh goes with --mesh, or --no-mesh",
                   s->mesh, s->output);
}

static int choose_mesh(vg_sink *s, const vg_sink_options *o, vg_err *e)
{
    const char *from = o->mesh ? o->mesh : s->output, *suffix = s->plan.sequence->suffix;
    size_t n = strlen(from);
    s->mesh_format = o->mesh ? vgi_format_by_suffix(o->mesh) : &vgi_format_obj;
    if (!o->mesh && vgi_has_suffix(from, n, suffix)) n -= strlen(suffix);
    if (!(s->mesh = vgi_array(n + 8, 1, e))) return VG_ENOMEM;
    memcpy(s->mesh, from, n);
    if (!o->mesh) memcpy(s->mesh + n, ".obj", 4);
    return VG_OK;
}

static int put_mesh(vg_sink *s, const vg_sink_options *o, vg_err *e)
{
    struct stat st;
    if (!lacks_faces(&s->plan) || o->no_mesh || (s->plan.to_stdout && !o->mesh)) return VG_OK;
    int r = choose_mesh(s, o, e);
    if (r < 0) return r;
    if (!o->mesh && stat(s->mesh, &st) == 0) return keep_mesh(s, e);
    s->text.size = 0;
    r = vg_model_write(&s->text, s->mesh_format->name, &s->head->mesh, s->head->reference, &s->head->attributes,
                       s->full_precision, e);
    return r < 0 ? r : put_file(s, s->mesh, e);
}

/* ---- vertices in no face ---- */

static int find_loose(vg_sink *s, bool **attached, vg_err *e)
{
    const vg_mesh *m = &s->head->mesh;
    bool *seen = *attached = vgi_array(m->nv, sizeof *seen, e);
    if (!seen) return VG_ENOMEM;
    for (size_t c = 0; c < vg_mesh_corners(m); c++) seen[m->vert[c]] = true;
    for (size_t v = 0; v < m->nv; v++) s->loose += !seen[v];
    return VG_OK;
}

/* The head without its loose vertices; the others close up. */
static int slim_head(vg_sink *s, const bool *attached, vg_err *e)
{
    const vg_head *h = s->head;
    size_t nv = h->mesh.nv, n = 0;
    uint32_t *number = vgi_array_raw(nv, sizeof *number, e);
    vg_head *to = &s->slim;
    int r = number ? vg_head_copy(to, h, e) : VG_ENOMEM;
    if (r == VG_OK && !(s->kept = vgi_array_raw(nv - s->loose, sizeof *s->kept, e))) r = VG_ENOMEM;
    if (r == VG_OK) {
        for (size_t v = 0; v < nv; v++) {
            if (!attached[v]) continue;
            memcpy(to->reference + 3 * n, h->reference + 3 * v, 3 * sizeof *to->reference);
            s->kept[n] = (uint32_t)v;
            number[v] = (uint32_t)n++;
        }
        for (size_t c = 0; c < vg_mesh_corners(&h->mesh); c++) to->mesh.vert[c] = number[h->mesh.vert[c]];
        to->mesh.nv = to->count = n;
        vg_skeleton_clear(&to->skeleton); /* its joints are vertices */
        s->head = to;
    }
    free(number);
    return r;
}

static int drop_loose(vg_sink *s, bool drop, vg_err *e)
{
    bool *attached = NULL;
    if (s->head->kind != VG_VERTICES)
        return drop ? vg_fail(e, VG_EARG, "--drop-loose is for vertices: the input holds %s",
                              vg_kind_name(s->head->kind))
                    : VG_OK;
    int r = find_loose(s, &attached, e);
    if (r == VG_OK && drop && s->loose == s->head->mesh.nv && s->loose)
        r = vg_fail(e, VG_EARG, "--drop-loose would leave nothing: no vertex is in a face");
    if (r == VG_OK && drop && s->loose) r = slim_head(s, attached, e);
    if (r == VG_OK && drop) s->loose = 0;
    free(attached);
    return r;
}

static int slim_pose(vg_sink *s, const vg_frame *f, vg_err *e)
{
    vg_frame *to = &s->slim_frame;
    int r = vg_frame_shape(to, s->head, e);
    if (r == VG_OK) r = vg_frame_rename(to, f->name ? f->name : "", e);
    if (r < 0) return r;
    to->has_time = f->has_time, to->time = f->time;
    for (size_t i = 0; i < s->head->count; i++)
        memcpy(to->values + 3 * i, f->values + 3 * (size_t)s->kept[i], 3 * sizeof *to->values);
    return VG_OK;
}

/* ---- what is not kept ---- */

static bool has_faces_of(const vg_mesh *m, size_t least, size_t most)
{
    for (size_t f = 0; f < m->nf; f++) {
        size_t n = m->start[f + 1] - m->start[f];
        if (n >= least && n <= most) return true;
    }
    return false;
}

static int add_loss(vg_bytes *line, const char *what, vg_err *e)
{
    int r = line->size ? vgi_bytes_append(line, "; ", 2, e) : VG_OK;
    return r < 0 ? r : vgi_bytes_append(line, what, strlen(what), e);
}

/* The sequence's own words come behind what can be told by its head. */
static int list_losses(const vg_sink *s, vg_bytes *line, vg_err *e)
{
    const vgi_sequence_format *f = s->plan.sequence;
    const vg_head *h = s->head;
    unsigned keeps = f ? f->keeps : s->plan.format->keeps;
    if (s->mesh)
        keeps |= s->mesh_format->keeps &
                 (VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_TEXTURE | VGI_KEEPS_LABELS);
    char scalars[120];
    snprintf(scalars, sizeof scalars, "the '%s' of the vertices", s->scalars_lost);
    bool faces = keeps & VGI_KEEPS_FACES, triangles = faces && !(keeps & VGI_KEEPS_POLYGONS);
    const struct {
        bool lost;
        const char *what;
    } all[] = {{!faces && h->mesh.nf, "the faces"},
               {triangles && has_faces_of(&h->mesh, 4, SIZE_MAX), "polygons, which became triangles"},
               {triangles && has_faces_of(&h->mesh, 2, 2), "line segments"},
               {!(keeps & VGI_KEEPS_ORDER), "the numbers of the vertices, and those in no face"},
               {!(keeps & VGI_KEEPS_TEXTURE) && h->attributes.ntex, "texture coordinates"},
               {!(keeps & VGI_KEEPS_LABELS) && h->attributes.nlabels, "groups and materials"},
               {!(keeps & VGI_KEEPS_SKELETON) && h->skeleton.njoints, "the skeleton"},
               {f && !(keeps & VGI_KEEPS_NAMES) && s->names_lost && s->frames > 1, "the names of the frames"},
               {f && !(keeps & VGI_KEEPS_TIMES) && s->times_lost, "the times of the frames"},
               {*s->scalars_lost, scalars}};
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < sizeof all / sizeof *all; i++)
        if (all[i].lost) r = add_loss(line, all[i].what, e);
    const char *own = f && f->warning ? f->warning(s->state) : NULL;
    return r == VG_OK && own ? add_loss(line, own, e) : r;
}

static int warn_of_losses(vg_sink *s, vg_err *e)
{
    vg_bytes line = {0};
    int r = list_losses(s, &line, e);
    if (r == VG_OK && line.size) {
        s->text.size = 0;
        r = vgi_bytes_append(&s->text, "not kept in '", 13, e);
        if (r == VG_OK) r = vgi_bytes_append(&s->text, s->output, strlen(s->output), e);
        if (r == VG_OK) r = vgi_bytes_append(&s->text, "': ", 3, e);
        if (r == VG_OK) r = vgi_bytes_append(&s->text, line.data, line.size, e);
        if (r == VG_OK) r = vgi_names_add(&s->warnings, (char *)s->text.data, s->text.size, e);
    }
    vg_bytes_clear(&line);
    return r;
}

static int warn_of_loose(vg_sink *s, vg_err *e)
{
    char text[160];
    if (!lacks_faces(&s->plan) || s->plan.sequence->bare || !s->loose || s->head->mesh.nf == 0) return VG_OK;
    int n = snprintf(text, sizeof text,
                     "%zu vertices are in no face: programs that drop them from the mesh, as Blender "
                     "does, then refuse the cache (--drop-loose)",
                     s->loose);
    return vgi_names_add(&s->warnings, text, (size_t)n, e);
}

const char *vg_sink_warning(const vg_sink *s, size_t i)
{
    return i < s->warnings.n ? s->warnings.at[i] : NULL;
}

/* ---- opening ---- */

int vg_sink_open(vg_sink **out, const char *output, const vg_head *h, const vg_sink_options *o, vg_err *e)
{
    vg_sink *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    s->fd = s->out.fd = -1, s->head = h, s->options = *o;
    s->full_precision = o->full_precision, s->number = (uint64_t)o->first_number;
    int r = make_plan(&s->plan, output, o, e);
    if (r == VG_OK) r = check_place(&s->plan, e);
    if (r == VG_OK) r = check_kind(&s->plan, h, output, e);
    if (r == VG_OK && !(s->output = vgi_copy_string(s->plan.name, s->plan.length, e))) r = VG_ENOMEM;
    if (r == VG_OK) r = drop_loose(s, o->drop_loose, e);
    if (r == VG_OK) r = put_mesh(s, o, e);
    if (r == VG_OK) r = open_place(s, e);
    if (r < 0) vg_sink_close(out);
    else s->plan.name = s->output;
    return r;
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
        return r < 0 ? r : put_file(s, (char *)s->path.data, e);
    case DIRECTORY:
        r = named_path(s, name, e);
        return r < 0 ? r : put_file(s, (char *)s->path.data, e);
    case ARCHIVE:
        r = named_path(s, name, e);
        return r < 0 ? r : vgi_packer_add(s->packer, (char *)s->path.data, s->text.data, s->text.size, e);
    default: /* one file: its text waits for vg_sink_end, so that a second frame leaves nothing in a pipe */
        return VG_OK;
    }
}

/* Is it what a reader would call the frame that comes next, of whichever file? */
static bool is_counted_name(const vg_sink *s, const char *name)
{
    char number[32];
    size_t n = (size_t)snprintf(number, sizeof number, ".%04llu", (unsigned long long)s->frames + 1);
    return strlen(name) > n && !strcmp(name + strlen(name) - n, number);
}

static int put_into_sequence(vg_sink *s, const vg_frame *f, vg_err *e)
{
    const char *name = f->name ? f->name : "";
    vg_err cause;
    int r = s->plan.sequence->put(s->state, f, &cause);
    if (r < 0) return vg_fail(e, r, "cannot write frame '%s' to '%s': %s", name, s->output, cause.message);
    if (*name && !s->names_lost) s->names_lost = !is_counted_name(s, name);
    s->times_lost |= f->has_time;
    s->frames++;
    return VG_OK;
}

int vg_sink_put(vg_sink *s, const vg_frame *f, vg_err *e)
{
    const char *name = f->name ? f->name : "";
    enum kind kind = s->plan.kind;
    int r = VG_OK;
    if (f->has_scalars && !*s->scalars_lost)
        snprintf(s->scalars_lost, sizeof s->scalars_lost, "%s", f->scalars_name);
    if (s->kept) {
        if ((r = slim_pose(s, f, e)) < 0) return r;
        f = &s->slim_frame;
    }
    if (kind == SEQUENCE) return put_into_sequence(s, f, e);
    if ((kind == ONE_FILE || kind == STDOUT) && s->frames > 0) return more_than_one(s, e);
    if (kind == DIRECTORY || kind == ARCHIVE) r = take_name(s, name, e);
    if (r < 0) return r;
    vg_err cause;
    s->text.size = 0;
    const vgi_writing w = {&s->head->mesh, f->values, s->head->reference, &s->head->attributes, s->full_precision,
                           &s->head->patches};
    r = vgi_model_write(&s->text, s->plan.format->name, &w, &cause);
    if (r < 0) return vg_fail(e, r, "cannot write frame '%s' to '%s': %s", name, s->output, cause.message);
    if ((r = put_frame(s, name, e)) == VG_OK) s->frames++;
    return r;
}

static int no_pose(const vg_sink *s, vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "there is no pose to be written to '%s'", s->output);
}

static int end_sequence(vg_sink *s, vg_err *e)
{
    if (s->frames == 0) return no_pose(s, e);
    int r = s->plan.sequence->end(s->state, e);
    if (r == VG_OK) r = vgi_output_flush(&s->out, e);
    if (r < 0 || s->out.fd == s->fd) return r;
    vgi_output to = {.fd = s->plan.to_stdout ? STDOUT_FILENO : s->fd,
                     .name = s->plan.to_stdout ? "standard output" : s->output};
    r = vgi_output_copy(&to, s->out.fd, s->out.size, e);
    if (r == VG_OK) r = vgi_output_flush(&to, e);
    vgi_output_clear(&to);
    return r;
}

static int end_single(vg_sink *s, vg_err *e)
{
    if (s->frames == 0) return no_pose(s, e);
    int fd = s->plan.kind == STDOUT ? STDOUT_FILENO : s->fd;
    return vgi_write_all(fd, s->text.data, s->text.size, s->plan.kind == STDOUT ? "standard output" : s->output, e);
}

int vg_sink_end(vg_sink *s, vg_err *e)
{
    int r = VG_OK;
    if (s->plan.kind == SEQUENCE) r = end_sequence(s, e);
    else if (s->plan.kind == ARCHIVE) r = vgi_packer_end(s->packer, e);
    else if (s->plan.kind == ONE_FILE || s->plan.kind == STDOUT) r = end_single(s, e);
    if (r == VG_OK && s->fd >= 0) {
        if (s->out.fd == s->fd) s->out.fd = -1;
        r = close_target(s->fd, s->output, e);
        s->fd = -1;
    }
    if (r == VG_OK && s->frames) r = warn_of_losses(s, e);
    if (r == VG_OK) r = warn_of_loose(s, e);
    if (r == VG_OK) r = rename_targets(s, e);
    s->ended = r == VG_OK;
    return r;
}

void vg_sink_discard(const vg_sink *s)
{
    if (s && !s->ended) remove_targets(s);
}

void vg_sink_close(vg_sink **sink)
{
    vg_sink *s = *sink;
    if (!s) return;
    if (!s->ended) remove_targets(s);
    *sink = NULL; /* before anything is freed: vg_sink_discard may come at any moment */
    vgi_packer_close(&s->packer);
    if (s->state) s->plan.sequence->release(s->state);
    if (s->out.fd >= 0 && s->out.fd != s->fd) close(s->out.fd);
    vgi_output_clear(&s->out);
    if (s->fd >= 0) close(s->fd);
    for (size_t i = 0; i < s->ntargets; i++) {
        free(s->targets[i].final);
        free(s->targets[i].temporary);
    }
    free(s->targets);
    free(s->slots);
    vgi_names_clear(&s->names);
    vgi_names_clear(&s->warnings);
    vg_head_clear(&s->slim);
    vg_frame_clear(&s->slim_frame);
    free(s->kept);
    free(s->mesh);
    vg_bytes_clear(&s->text);
    vg_bytes_clear(&s->path);
    free(s->output);
    free(s);
}
