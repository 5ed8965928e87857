/* sink.c: output: one mesh file, a numbered series, a directory, an archive, standard output, or one file that holds
 * the whole sequence. Output names are parsed in sink_plan.c, temporary files are in targets.c, the text of a mesh
 * file in format.c, the bytes of a sequence in sequence.c and those of an archive in pack.c.
 *
 * Everything is written to a temporary name beside its final one and renamed in vg_sink_end; pipes and devices, which
 * cannot be replaced, are written directly.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/sink.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

/* A frame that becomes a mesh file: any thread can format and write it. Members of an archive, and the single file,
 * are written by the caller's thread in frame order. */
typedef struct piece {
    char *name;
    double *values;
    vg_bytes path, text;
    int fd; /* the file to which the text is written, closed afterwards; -1: none */
    int result;
    vg_err error;
} piece;

/* Limit for unfinished pieces: this many bytes, but always two pieces. */
enum { MOST_WAITING = 256 << 20, TEXT_OF_VERTEX = 48 };

struct vg_sink {
    vgi_plan plan;
    char *output; /* storage of plan.name */
    const vg_head *head; /* borrowed */
    bool full_precision;
    uint64_t number; /* of the next file of a series */
    uint64_t frames;
    bool made_directory, ended;
    vgi_file_names names; /* of the files in a directory or archive, or of a series */
    vgi_names earlier;    /* paths that --replace removes */
    vg_targets targets;
    int fd; /* the single file or archive; -1: none */
    vgi_packer *packer;
    /* mesh files: */
    vgi_belt *belt;      /* of pieces; NULL before the first frame */
    piece *pieces;
    size_t npieces;
    vg_bytes rest;       /* the part that is the same in every file */
    /* a sequence: */
    vg_sink_options options;
    void *state;
    vgi_output out;      /* fd: the file itself; for a pipe, which cannot be patched, an unnamed file */
    char *mesh;          /* path of its mesh; NULL: none */
    const vgi_format *mesh_format;
    vgi_slim slim;       /* head points into it if vertices are dropped */
    size_t loose;        /* number of written vertices that are in no face */
    bool names_lost, times_lost;
    char scalars_lost[80]; /* vertex channels, which no format keeps */
    vgi_names warnings;
    char *report; /* NULL: nothing to say */
    bool inexact;
};

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

static int series_path(const vg_sink *s, vg_bytes *path, vg_err *e)
{
    const vgi_plan *p = &s->plan;
    char digits[24];
    size_t n = vgi_print_uint(digits, s->number);
    path->size = 0;
    int r = append_unescaped(path, s->output, p->at, e);
    for (size_t i = n; r == VG_OK && i < (size_t)p->width; i++) r = vgi_bytes_append(path, "0", 1, e);
    if (r == VG_OK) r = vgi_bytes_append(path, digits, n, e);
    if (r == VG_OK) r = append_unescaped(path, s->output + p->behind, p->length - p->behind, e);
    return r < 0 ? r : vgi_bytes_append(path, "", 1, e);
}

/* "DIR/NAME.obj"; in an archive without the directory. */
static int file_path(const vg_sink *s, const vg_bytes *file, vg_bytes *path, vg_err *e)
{
    size_t n = s->plan.kind == VGI_PLAN_DIRECTORY ? s->plan.length : 0;
    path->size = 0;
    int r = vgi_bytes_append(path, s->output, n, e);
    if (r == VG_OK && n && s->output[n - 1] != '/') r = vgi_bytes_append(path, "/", 1, e);
    return r < 0 ? r : vgi_bytes_append(path, file->data, file->size, e);
}

/* ---- files ---- */

static void remove_files(const vg_sink *s)
{
    vg_targets_remove(&s->targets);
    if (s->made_directory) rmdir(s->output);
}

static int write_and_close(int fd, const vg_bytes *text, const char *path, vg_err *e)
{
    int r = vgi_write_all(fd, text->data, text->size, path, e);
    if (r < 0) return close(fd), r;
    return vg_target_close(fd, path, e);
}

static int make_directory(vg_sink *s, vg_err *e)
{
    if (mkdir(s->output, 0777) == 0) return s->made_directory = true, VG_OK;
    if (errno == EEXIST && vgi_is_directory(s->output)) return VG_OK;
    return vg_fail(e, VG_ESYS, "cannot make directory '%s': %s", s->output, strerror(errno));
}

/* A pipe cannot be patched, so its bytes are collected in an unnamed file. */
static int open_patchable(vg_sink *s, vg_err *e)
{
    s->fd = s->plan.to_stdout ? -1 : vg_targets_open(&s->targets, s->output, e);
    if (s->fd < 0 && !s->plan.to_stdout) return s->fd;
    bool patchable = s->fd >= 0 && !vg_targets_in_place(&s->targets);
    s->out.name = s->output;
    s->out.fd = patchable ? s->fd : vgi_nameless_file(e);
    return s->out.fd < 0 ? s->out.fd : VG_OK;
}

static int open_sequence(vg_sink *s, vg_err *e)
{
    int r = open_patchable(s, e);
    return r < 0 ? r : s->plan.sequence->begin(&s->state, s->head, &s->options, &s->out, e);
}

static int open_archive(vg_sink *s, vg_err *e)
{
    int r = open_patchable(s, e);
    return r < 0 ? r : vgi_packer_open(&s->packer, s->out.fd, s->output, s->plan.length, e);
}

static int open_place(vg_sink *s, vg_err *e)
{
    switch (s->plan.kind) {
    case VGI_PLAN_SEQUENCE: return open_sequence(s, e);
    case VGI_PLAN_DIRECTORY: return make_directory(s, e);
    case VGI_PLAN_ARCHIVE: return open_archive(s, e);
    case VGI_PLAN_SERIES: return VG_OK;
    default: break;
    }
    if (s->plan.to_stdout) return VG_OK;
    s->fd = vg_targets_open(&s->targets, s->output, e);
    return s->fd < 0 ? s->fd : VG_OK;
}

/* ---- the mesh beside a sequence ---- */

static bool same_singles(const double *a, const double *b, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if ((float)a[i] != (float)b[i]) return false;
    return true;
}

/* The user did not name this file, so an existing one is not replaced. */
static int keep_mesh(const vg_sink *s, vg_err *e)
{
    vg_head there = {0};
    int r = vg_load(&there, s->mesh, "mesh", NULL);
    bool same = r == VG_OK && vg_mesh_same(&there.body.mesh, "", &s->head->body.mesh, "", NULL) == VG_OK &&
                same_singles(there.body.reference, s->head->body.reference, 3 * there.body.mesh.nv);
    vg_head_clear(&there);
    if (same) return VG_OK;
    return vg_fail(e, VG_EARG,
                   "'%s', the mesh for '%s', exists and is not the reference pose: choose another file with --mesh, "
                   "or use --no-mesh",
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
    if (!vgi_plan_lacks_faces(&s->plan) || o->no_mesh || (s->plan.to_stdout && !o->mesh)) return VG_OK;
    int r = choose_mesh(s, o, e);
    if (r < 0) return r;
    if (!o->mesh && stat(s->mesh, &st) == 0) return keep_mesh(s, e);
    vg_bytes text = {0};
    int fd = -1;
    r = vg_model_write(&text, s->mesh_format->name, &s->head->body.mesh, s->head->body.reference,
                       &s->head->body.attributes, s->full_precision, e);
    if (r == VG_OK) r = fd = vg_targets_open(&s->targets, s->mesh, e);
    if (r >= 0) r = write_and_close(fd, &text, s->mesh, e);
    vg_bytes_clear(&text);
    return r;
}

/* ---- vertices in no face ---- */

static int drop_loose(vg_sink *s, bool drop, vg_err *e)
{
    if (s->head->kind != VG_VERTICES)
        return drop ? vg_fail(e, VG_EARG, "--drop-loose is for vertices: the input holds %s",
                              vg_head_form(s->head))
                    : VG_OK;
    if (!drop) return vgi_count_loose(&s->head->body.mesh, &s->loose, e);
    int r = vgi_slim_make(&s->slim, s->head, e);
    if (r == VG_OK && s->slim.kept) s->head = &s->slim.head;
    return r;
}

/* ---- losses ---- */

/* What the head, the frames and the format say of what is lost. */
static int list_losses(const vg_sink *s, vg_bytes *line, vg_err *e)
{
    const vgi_sequence_format *f = s->plan.sequence;
    vgi_losses x = {.head = s->head,
                    .keeps = f ? f->keeps : s->plan.format->keeps,
                    .names = f && s->names_lost && s->frames > 1,
                    .times = f && s->times_lost,
                    .scalars = s->scalars_lost,
                    .own = f && f->warning ? f->warning(s->state) : NULL};
    if (s->mesh)
        x.keeps |= s->mesh_format->keeps &
                   (VGI_KEEPS_FACES | VGI_KEEPS_POLYGONS | VGI_KEEPS_TEXTURE | VGI_KEEPS_LABELS | VGI_KEEPS_COLOURS);
    return vgi_losses_list(&x, line, e);
}

static int warn_of_losses(vg_sink *s, vg_err *e)
{
    vg_bytes line = {0}, text = {0};
    int r = list_losses(s, &line, e);
    if (r == VG_OK && line.size) {
        r = vgi_bytes_append(&text, "not kept in '", 13, e);
        if (r == VG_OK) r = vgi_bytes_append(&text, s->output, strlen(s->output), e);
        if (r == VG_OK) r = vgi_bytes_append(&text, "': ", 3, e);
        if (r == VG_OK) r = vgi_bytes_append(&text, line.data, line.size, e);
        if (r == VG_OK) r = vgi_names_add(&s->warnings, (char *)text.data, text.size, e);
    }
    vg_bytes_clear(&line);
    vg_bytes_clear(&text);
    return r;
}

static int warn_of_loose(vg_sink *s, vg_err *e)
{
    char text[160];
    if (!vgi_plan_lacks_faces(&s->plan) || s->plan.sequence->bare || !s->loose || s->head->body.mesh.nf == 0)
        return VG_OK;
    int n = snprintf(text, sizeof text,
                     "%zu vertices are in no face: programs that drop them from the mesh, as Blender "
                     "does, then refuse the cache (--drop-loose)",
                     s->loose);
    return vgi_names_add(&s->warnings, text, (size_t)n, e);
}

/* The bytes as they are written; what the format says of them follows. */
static int make_report(vg_sink *s, vg_err *e)
{
    const vgi_sequence_format *f = s->plan.sequence;
    const char *own = f && f->report ? f->report(s->state, &s->inexact) : NULL;
    if (!own) return VG_OK;
    const size_t room = strlen(s->output) + strlen(own) + 60;
    if (!(s->report = vgi_array_raw(room, 1, e))) return VG_ENOMEM;
    snprintf(s->report, room, "'%s' has %" PRIu64 " bytes, %s", s->output, s->out.size, own);
    return VG_OK;
}

const char *vg_sink_report(const vg_sink *s, bool *inexact)
{
    *inexact = s->inexact;
    return s->report;
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
    int r = vgi_plan_make(&s->plan, output, o, e);
    if (r == VG_OK) r = vgi_plan_check_place(&s->plan, e);
    if (r == VG_OK) r = vgi_plan_check_head(&s->plan, h, output, e);
    if (r == VG_OK) r = vgi_earlier_list(&s->earlier, &s->plan, o, e);
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
    if (s->plan.to_stdout)
        return vg_fail(e, VG_EARG,
                       "standard output takes one pose: use a pattern like 'pose-%%04d.obj', a directory or an "
                       "archive");
    const char *suffix = s->plan.format->suffix;
    size_t n = s->plan.length;
    if (vgi_has_suffix(s->output, n, suffix)) n -= strlen(suffix);
    return vg_fail(e, VG_EARG,
                   "'%s' takes one pose: use a pattern like '%.*s-%%04d%s', a directory or an archive",
                   s->output, (int)n, s->output, suffix);
}

/* Whether a reader would give the next frame this name by counting. */
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

/* ---- frames that become mesh files ---- */

static vgi_writing writing_of(const vg_sink *s, const double *values)
{
    const vg_head *h = s->head;
    return (vgi_writing){&h->body.mesh,
                         values,
                         h->body.reference,
                         &h->body.attributes,
                         s->full_precision,
                         &h->body.patches,
                         s->rest.size ? &s->rest : NULL};
}

static int unwritable(const vg_sink *s, const char *name, int code, const vg_err *cause, vg_err *e)
{
    return vg_fail(e, code, "cannot write frame '%s' to '%s': %s", name, s->output, cause->message);
}

/* Process a piece. */
static void make_piece(void *context, size_t place)
{
    const vg_sink *s = context;
    piece *p = &s->pieces[place];
    const vgi_writing w = writing_of(s, p->values);
    vg_err cause;
    p->text.size = 0;
    p->result = vgi_model_write(&p->text, s->plan.format->name, &w, &cause);
    if (p->result < 0) {
        unwritable(s, p->name, p->result, &cause, &p->error);
        if (p->fd >= 0) close(p->fd);
    } else if (p->fd >= 0) {
        p->result = write_and_close(p->fd, &p->text, (char *)p->path.data, &p->error);
    }
    p->fd = -1;
}

static int make_rest(vg_sink *s, const vg_frame *first, vg_err *e)
{
    const vgi_writing w = writing_of(s, first->values);
    vg_err cause;
    if (!s->plan.format->rest || s->plan.kind == VGI_PLAN_FILE) return VG_OK;
    int r = s->plan.format->rest(&s->rest, &w, &cause);
    return r < 0 ? unwritable(s, first->name ? first->name : "", r, &cause, e) : r;
}

/* With one thread each piece is finished before the next one is added. */
static int start_belt(vg_sink *s, const vg_frame *first, vg_err *e)
{
    int r = make_rest(s, first, e), threads = s->options.threads;
    if (r < 0) return r;
    size_t nv = s->head->body.mesh.nv, n = threads > 1 ? (size_t)threads + 1 : 1;
    size_t room = MOST_WAITING / ((3 * sizeof(double) + TEXT_OF_VERTEX) * (nv + 1) + s->rest.size);
    if (n > 2 && n > room) n = room < 2 ? 2 : room;
    if (!(s->pieces = vgi_array(n, sizeof *s->pieces, e))) return VG_ENOMEM;
    s->npieces = n;
    for (size_t i = 0; i < n; i++) {
        s->pieces[i].fd = -1;
        if (!(s->pieces[i].values = vgi_array_raw(3 * nv, sizeof(double), e))) return VG_ENOMEM;
    }
    return vgi_belt_new(&s->belt, threads, n, make_piece, s, e);
}

static int finish_oldest(vg_sink *s, vg_err *e)
{
    piece *p = &s->pieces[vgi_belt_take(s->belt)];
    if (p->result < 0 && e) *e = p->error;
    if (p->result < 0 || s->plan.kind != VGI_PLAN_ARCHIVE) return p->result;
    return vgi_packer_add(s->packer, (char *)p->path.data, p->text.data, p->text.size, e);
}

/* Choose the output of the piece. Its file is opened here, in frame order. */
static int place_piece(vg_sink *s, piece *p, vg_err *e)
{
    bool series = s->plan.kind == VGI_PLAN_SERIES;
    if (s->plan.kind == VGI_PLAN_FILE)
        return VG_OK; /* its text is kept until vg_sink_end, so that an error in a second frame leaves nothing in the
                         pipe */
    int r = series ? series_path(s, &p->path, e) : file_path(s, &s->names.file, &p->path, e);
    if (r == VG_OK && series) r = vgi_file_names_series(&s->names, (char *)p->path.data, e);
    s->number += series;
    if (r < 0 || s->plan.kind == VGI_PLAN_ARCHIVE) return r;
    p->fd = vg_targets_open(&s->targets, (char *)p->path.data, e);
    return p->fd < 0 ? p->fd : VG_OK;
}

static int put_piece(vg_sink *s, const vg_frame *f, const char *name, vg_err *e)
{
    int r = s->belt ? VG_OK : start_belt(s, f, e);
    if (r < 0) return r;
    piece *p = &s->pieces[vgi_belt_place(s->belt)];
    free(p->name);
    if (!(p->name = vgi_copy_string(name, strlen(name), e))) return VG_ENOMEM;
    memcpy(p->values, f->values, 3 * s->head->body.mesh.nv * sizeof *p->values);
    if ((r = place_piece(s, p, e)) < 0) return r;
    vgi_belt_put(s->belt);
    return vgi_belt_full(s->belt) ? finish_oldest(s, e) : VG_OK;
}

static int finish_pieces(vg_sink *s, vg_err *e)
{
    int r = VG_OK;
    while (r == VG_OK && s->belt && vgi_belt_things(s->belt)) r = finish_oldest(s, e);
    return r;
}

/* ---- numbers as prefixes of names ---- */

/* Rename files of a directory, which still have temporary names. */
static int renumber_files(vg_sink *s, vg_err *e)
{
    vg_bytes file = {0}, path = {0};
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < s->frames; i++) {
        r = vgi_file_name_numbered(&file, i, s->names.frames.at[i], s->plan.format->suffix, e);
        if (r == VG_OK) r = file_path(s, &file, &path, e);
        if (r == VG_OK) r = vg_targets_name(&s->targets, i, (char *)path.data, e);
    }
    vg_bytes_clear(&file);
    vg_bytes_clear(&path);
    return r;
}

/* Copy the members written so far, in order, to the restarted archive. */
static int pack_again(vg_sink *s, vgi_archive *from, vg_err *e)
{
    vg_bytes file = {0}, data = {0};
    const char *path;
    int r = VG_OK;
    for (size_t i = 0; r == VG_OK && i < s->frames; i++) {
        r = vgi_archive_next(from, &path, &data, e);
        if (r == 0) r = vg_fail(e, VG_ESYS, "cannot read back '%s'", s->output);
        if (r > 0) r = vgi_file_name_numbered(&file, i, s->names.frames.at[i], s->plan.format->suffix, e);
        if (r == VG_OK) r = vgi_packer_add(s->packer, (char *)file.data, data.data, data.size, e);
    }
    vg_bytes_clear(&file);
    vg_bytes_clear(&data);
    return r;
}

static int renumber_members(vg_sink *s, vg_err *e)
{
    const vgi_limits none = {.member_bytes = UINT64_MAX, .total_bytes = UINT64_MAX, .members = SIZE_MAX};
    vgi_archive *from = NULL;
    int copy = vgi_nameless_file(e), r = copy < 0 ? copy : vgi_packer_end(s->packer, e);
    vgi_output to = {.fd = copy, .name = s->output};
    vgi_packer_close(&s->packer);
    off_t size = lseek(s->out.fd, 0, SEEK_END);
    if (r == VG_OK) r = vgi_output_copy(&to, s->out.fd, (uint64_t)size, e);
    if (r == VG_OK) r = vgi_output_flush(&to, e);
    vgi_output_clear(&to);
    if (r == VG_OK && (ftruncate(s->out.fd, 0) < 0 || lseek(s->out.fd, 0, SEEK_SET) < 0))
        r = vg_fail(e, VG_ESYS, "cannot write to '%s': %s", s->output, strerror(errno));
    if (r == VG_OK) r = vgi_packer_open(&s->packer, s->out.fd, s->output, s->plan.length, e);
    if (r < 0 && copy >= 0) close(copy);
    if (r == VG_OK) r = vgi_archive_open(&from, copy, 0, s->output, &none, e);
    if (r == VG_OK) r = pack_again(s, from, e);
    vgi_archive_close(&from);
    return r;
}

/* The name of the next frame's file. */
static int name_file(vg_sink *s, const char *name, vg_err *e)
{
    int begins = vgi_file_names_next(&s->names, name, s->plan.format->suffix, e);
    if (begins <= 0 || s->frames == 0) return begins < 0 ? begins : VG_OK;
    int r = finish_pieces(s, e);
    if (r < 0) return r;
    return s->plan.kind == VGI_PLAN_ARCHIVE ? renumber_members(s, e) : renumber_files(s, e);
}

int vg_sink_put(vg_sink *s, const vg_frame *f, vg_err *e)
{
    const char *name = f->name ? f->name : "";
    vgi_plan_kind kind = s->plan.kind;
    int r = VG_OK;
    const vg_channel *scalars = vg_frame_scalars(f);
    if (scalars && !*s->scalars_lost) snprintf(s->scalars_lost, sizeof s->scalars_lost, "%s", scalars->name);
    if (s->slim.kept) {
        if ((r = vgi_slim_take(&s->slim, f, e)) < 0) return r;
        f = &s->slim.frame;
    }
    if (kind == VGI_PLAN_SEQUENCE) return put_into_sequence(s, f, e);
    if (kind == VGI_PLAN_FILE && s->frames > 0) return more_than_one(s, e);
    if (kind == VGI_PLAN_DIRECTORY || kind == VGI_PLAN_ARCHIVE) r = name_file(s, name, e);
    if (r == VG_OK) r = put_piece(s, f, name, e);
    if (r == VG_OK) s->frames++;
    return r;
}

static int place_fd(const vg_sink *s)
{
    return s->plan.to_stdout ? STDOUT_FILENO : s->fd;
}

static const char *place_name(const vg_sink *s)
{
    return s->plan.to_stdout ? "standard output" : s->output;
}

static int no_pose(const vg_sink *s, vg_err *e)
{
    return vg_fail(e, VG_EINPUT, "there is no pose to write to '%s'", s->output);
}

/* Copy the collected bytes to the pipe. */
static int copy_out(vg_sink *s, vg_err *e)
{
    if (s->out.fd == s->fd) return VG_OK;
    off_t size = lseek(s->out.fd, 0, SEEK_END);
    vgi_output to = {.fd = place_fd(s), .name = place_name(s)};
    int r = vgi_output_copy(&to, s->out.fd, (uint64_t)size, e);
    if (r == VG_OK) r = vgi_output_flush(&to, e);
    vgi_output_clear(&to);
    return r;
}

static int end_sequence(vg_sink *s, vg_err *e)
{
    if (s->frames == 0) return no_pose(s, e);
    int r = s->plan.sequence->end(s->state, e);
    if (r == VG_OK) r = vgi_output_flush(&s->out, e);
    return r < 0 ? r : copy_out(s, e);
}

static int end_archive(vg_sink *s, vg_err *e)
{
    int r = vgi_packer_end(s->packer, e);
    return r < 0 ? r : copy_out(s, e);
}

static int end_single(vg_sink *s, vg_err *e)
{
    if (s->frames == 0) return no_pose(s, e);
    const vg_bytes *text = &s->pieces[0].text;
    return vgi_write_all(place_fd(s), text->data, text->size, place_name(s), e);
}

int vg_sink_end(vg_sink *s, vg_err *e)
{
    int r = finish_pieces(s, e);
    if (r < 0) return r;
    if (s->plan.kind == VGI_PLAN_SEQUENCE) r = end_sequence(s, e);
    else if (s->plan.kind == VGI_PLAN_ARCHIVE) r = end_archive(s, e);
    else if (s->plan.kind == VGI_PLAN_FILE) r = end_single(s, e);
    if (r == VG_OK && s->fd >= 0) {
        if (s->out.fd == s->fd) s->out.fd = -1;
        r = vg_target_close(s->fd, s->output, e);
        s->fd = -1;
    }
    if (r == VG_OK && s->frames) r = warn_of_losses(s, e);
    if (r == VG_OK && s->frames) r = make_report(s, e);
    if (r == VG_OK) r = warn_of_loose(s, e);
    if (r == VG_OK && s->names.numbered) r = vgi_file_names_warn(&s->names, s->plan.format->suffix, &s->warnings, e);
    if (r == VG_OK) r = vg_targets_rename(&s->targets, e);
    if (r == VG_OK) r = vgi_earlier_remove(&s->earlier, &s->targets, e);
    s->ended = r == VG_OK;
    return r;
}

void vg_sink_discard(const vg_sink *s)
{
    if (s && !s->ended) remove_files(s);
}

static void clear_pieces(vg_sink *s)
{
    for (size_t i = 0; i < s->npieces; i++) {
        piece *p = &s->pieces[i];
        free(p->name);
        free(p->values);
        vg_bytes_clear(&p->path);
        vg_bytes_clear(&p->text);
        if (p->fd >= 0) close(p->fd); /* it was never created */
    }
    free(s->pieces);
    vg_bytes_clear(&s->rest);
}

void vg_sink_close(vg_sink **sink)
{
    vg_sink *s = *sink;
    if (!s) return;
    vgi_belt_free(&s->belt);
    if (!s->ended) remove_files(s);
    *sink = NULL; /* first of all, because vg_sink_discard may be called from a signal handler */
    clear_pieces(s);
    vgi_packer_close(&s->packer);
    if (s->state) s->plan.sequence->release(s->state);
    if (s->out.fd >= 0 && s->out.fd != s->fd) close(s->out.fd);
    vgi_output_clear(&s->out);
    if (s->fd >= 0) close(s->fd);
    vg_targets_clear(&s->targets);
    vgi_file_names_clear(&s->names);
    vgi_names_clear(&s->earlier);
    vgi_names_clear(&s->warnings);
    vgi_slim_clear(&s->slim);
    free(s->mesh);
    free(s->report);
    free(s->output);
    free(s);
}
