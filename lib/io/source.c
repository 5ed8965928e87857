/* source.c: input: joins all operands into one head and a sequence of frames. Operands are expanded and examined in
 * items.c; streams, archives, mesh files and sequences (sequence_reader.c) are read elsewhere.
 *
 * All operands are examined first, so that a missing file or an incompatible stream is reported before any work. Mesh
 * files become poses in several threads, some before they are requested. Pipes are read only when it is their turn.
 * Errors are reported in input order.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/gltf_pack.h"
#include "io/items.h"
#include "io/smoothing.h"

#include <stdlib.h>

/* A mesh file that becomes a frame. */
typedef struct pose {
    char *path;          /* of the file, or of the member of an archive */
    const char *archive; /* borrowed; NULL: none */
    vg_bytes data;
    char *name;
    vg_model model;
    int result;
    vg_err error;
} pose;

enum { MOST_WAITING = 256 << 20 }; /* bytes of files; beyond this no further file is read ahead */

struct vg_source {
    vgi_items items;
    size_t next;         /* the next item to open */
    vg_reading reading;
    unsigned used;       /* VGI_USES_*, of the inputs opened so far */
    bool through;        /* a single stream: its head and frames are passed on unchanged */
    vg_head head;        /* of the joined sequence; the caller may change it */
    vg_head own;         /* the head of the frames: mesh, kind, count; for a skeleton also its joints and reference */
    char *own_name;      /* the input that defined the mesh, quoted for messages; NULL: none yet */
    vg_records tail;
    /* the current item: */
    vg_reader *reader;
    vgi_archive *archive;
    const char *archive_name;
    vg_bytes data;       /* a mesh file, or a member that holds a sequence */
    vgi_playing playing;
    /* pending poses: */
    pose *poses;
    size_t nposes;
    vgi_belt *belt;
    pose *first;         /* it defined the mesh and has not been returned yet; NULL: none */
    uint64_t waiting;    /* bytes of their files */
    int failed;          /* the error of reading ahead, reported after the pending poses */
    vg_err failure;
    char warning[VGI_SUBJECT + 2 * sizeof(vg_note)];
};

/* ---- one mesh for all inputs ---- */

/* Name of a file, or of a member of an archive, in messages. */
static char *subject_of(const char *archive, const char *path, vg_err *e)
{
    size_t n = strlen(path) + (archive ? strlen(archive) : 0) + 16;
    char *s = vgi_array_raw(n, 1, e);
    if (s && archive) snprintf(s, n, "'%s' in '%s'", path, archive);
    else if (s) snprintf(s, n, "'%s'", path);
    return s;
}

/* The name of a pose from that file; release with free(). */
static char *pose_of(const char *path, vg_err *e)
{
    return path == vgi_standard_input ? vgi_copy_string("stdin", 5, e) : vgi_pose_name(path, e);
}

/* Set the mesh that every further pose must have. */
static int settle_mesh(vg_source *s, const vg_mesh *mesh, const char *archive, const char *path, vg_err *e)
{
    int r = vg_mesh_copy(&s->own.body.mesh, mesh, e);
    if (r < 0) return r;
    free(s->own_name);
    s->own.kind = s->head.kind = VG_VERTICES;
    s->own.precision = s->head.precision = VG_F64;
    s->own.count = s->head.count = mesh->nv;
    return (s->own_name = subject_of(archive, path, e)) ? VG_OK : VG_ENOMEM;
}

/* Keep the skeleton, for files that name joints. */
static int keep_skeleton(vg_source *s, const vg_head *h, vg_err *e)
{
    if (!h->body.skeleton.njoints) return VG_OK;
    int r = vg_skeleton_copy(&s->own.body.skeleton, &h->body.skeleton, e);
    if (r == VG_OK && !(s->own.body.reference =
                            vgi_copy_array(h->body.reference, 3 * h->body.mesh.nv, sizeof *h->body.reference, e)))
        r = VG_ENOMEM;
    return r;
}

/* The head of a stream among several operands: the first one is used; of later ones only the provenance. */
static int join_head(vg_source *s, const vgi_item *it, const vg_head *h, vg_err *e)
{
    if (h->kind != VG_VERTICES)
        return vg_fail(e, VG_EINPUT, "'%s' holds %s: only streams of vertices can be joined with other inputs",
                       vgi_item_name(it), vg_head_form(h));
    if (s->own_name || it != s->items.at) return vg_head_merge_trace(&s->head, h, e);
    int r = vg_head_copy(&s->head, h, e);
    if (r == VG_OK) r = settle_mesh(s, &h->body.mesh, NULL, vgi_item_name(it), e);
    return r < 0 ? r : keep_skeleton(s, h, e);
}

/* Among several operands, streams define the mesh when they are examined. */
static int look_at_stream(vg_source *s, vgi_item *it, vg_err *e)
{
    if (s->own_name && s->items.n == 1)
        return vg_fail(e, VG_EARG, "'%s' is a stream, which has its own mesh: leave out --mesh", vgi_item_name(it));
    vg_reader *reader = NULL;
    int r = vgi_item_reader(&s->items, it, &reader, e);
    if (r < 0) return r;
    if (s->items.n == 1) {
        s->reader = reader;
        s->through = true;
        return VG_OK;
    }
    r = join_head(s, it, vg_reader_head(reader), e);
    if (it->regular && it->path) vg_reader_close(&reader);
    else it->reader = reader;
    return r;
}

static int open_archive(vg_source *s, vgi_item *it, vg_err *e)
{
    s->archive_name = vgi_item_name(it);
    return vgi_item_archive(&s->items, it, &s->archive, e);
}

/* Keep the first note about dropped data. */
static void note_left_out(vg_source *s, const char *subject, const char *note)
{
    if (*note && !*s->warning) snprintf(s->warning, sizeof s->warning, "%.290s: %.320s", subject, note);
}

static int take_over_model(vg_source *s, pose *p, vg_err *e)
{
    vg_model *m = &p->model;
    int r = settle_mesh(s, &m->mesh, p->archive, p->path, e);
    if (r < 0) return r;
    note_left_out(s, s->own_name, m->note.text);
    vg_head_put(&s->head, &m->mesh, "mesh");
    vg_head_put(&s->head, &m->attributes, "attributes");
    vg_note note = {0};
    if (!p->archive) r = vgi_take_materials(&s->head.body, p->path, &note, e);
    note_left_out(s, s->own_name, note.text);
    if (r < 0) return r;
    s->head.body.reference = vgi_copy_array(m->vertices, 3 * s->own.count, sizeof(double), e);
    s->head.body.reference_name = vgi_copy_string(p->name, strlen(p->name), e);
    if (!s->head.body.reference || !s->head.body.reference_name) return VG_ENOMEM;
    return vgi_obj_take_smoothing(&s->head.body, (const char *)p->data.data, p->data.size, e);
}

/* VG_EINPUT if the next input has other faces than the previous ones. */
static int check_joins(const vg_source *s, const vg_mesh *next, const char *subject, vg_err *e)
{
    int r = vg_mesh_same(&s->own.body.mesh, s->own_name, next, subject, e);
    size_t n = r < 0 && e ? strlen(e->message) : 0;
    if (n)
        snprintf(e->message + n, sizeof e->message - n, ": all poses of a sequence have the same vertices and faces");
    return r;
}

/* ---- mesh files ---- */

static int read_model(const vg_source *s, pose *p, vg_err *e)
{
    char *subject = subject_of(p->archive, p->path, e);
    if (!subject) return VG_ENOMEM;
    int r = VG_OK;
    if (vgi_is_stream(p->data.data, p->data.size))
        r = vg_fail(e, VG_EINPUT, "%s is a stream: take it out of the archive first", subject);
    if (r == VG_OK) r = vgi_model_read(&p->model, p->data.data, p->data.size, NULL, p->path, subject, e);
    if (r == VG_OK && s->own_name) r = check_joins(s, &p->model.mesh, subject, e);
    free(subject);
    return r;
}

/* Process a pose. */
static void make_pose(void *context, size_t place)
{
    const vg_source *s = context;
    pose *p = &s->poses[place];
    p->result = read_model(s, p, &p->error);
}

static int make_belt(vg_source *s, int threads, vg_err *e)
{
    size_t n = threads > 1 ? (size_t)threads + 1 : 1;
    if (!(s->poses = vgi_array(n, sizeof *s->poses, e))) return VG_ENOMEM;
    s->nposes = n;
    return vgi_belt_new(&s->belt, threads, n, make_pose, s, e);
}

/* Clear a pose, but keep its buffer if it is no larger than its share. */
static void clear_pose(const vg_source *s, pose *p)
{
    free(p->path);
    free(p->name);
    vg_model_clear(&p->model);
    p->path = p->name = NULL;
    if (p->data.cap > MOST_WAITING / s->nposes) vg_bytes_clear(&p->data);
}

/* Put the mesh file in s->data on the belt. */
static int put_pose(vg_source *s, const char *archive, const char *path, vg_err *e)
{
    pose *p = &s->poses[vgi_belt_place(s->belt)];
    vg_bytes spare = p->data;
    p->archive = archive;
    if (!(p->path = vgi_copy_string(path, strlen(path), e)) || !(p->name = pose_of(path, e))) return VG_ENOMEM;
    p->data = s->data;
    s->data = spare;
    s->waiting += p->data.size;
    vgi_belt_put(s->belt);
    return VG_OK;
}

static int take_pose(vg_source *s, pose **out, vg_err *e)
{
    pose *p = *out = &s->poses[vgi_belt_take(s->belt)];
    s->waiting -= p->data.size;
    if (p->result < 0 && e) *e = p->error;
    return p->result;
}

/* The first one defines the mesh, unless it is known. It is kept until its frame is returned. */
static int take_first(vg_source *s, vg_err *e)
{
    int r = take_pose(s, &s->first, e);
    return r < 0 ? r : take_over_model(s, s->first, e);
}

static int hand_out(vg_source *s, vg_frame *f, vg_err *e)
{
    pose *p = s->first;
    int r = p ? VG_OK : take_pose(s, &p, e);
    s->first = NULL;
    if (r == VG_OK) r = vg_frame_shape(f, &s->own, e);
    if (r == VG_OK) r = vg_frame_rename(f, p->name, e);
    if (r == VG_OK) {
        memcpy(f->values, p->model.vertices, 3 * s->own.count * sizeof *f->values);
        vg_records_clear(&f->extra);
        f->has_time = false;
        f->time = 0;
        r = 1;
    }
    clear_pose(s, p);
    return r;
}

static int open_mesh(vg_source *s, vgi_item *it, vg_err *e)
{
    vgi_input *in;
    int r = vgi_item_input(&s->items, it, &in, e);
    if (r < 0) return r;
    s->data.size = 0;
    r = vgi_input_slurp(in, &s->data, e);
    vgi_input_free(&in);
    return r < 0 ? r : put_pose(s, NULL, vgi_item_name(it), e);
}

static int open_stream(vg_source *s, vgi_item *it, vg_err *e)
{
    int r = vgi_item_reader(&s->items, it, &s->reader, e);
    if (r < 0) return r;
    const vg_head *h = vg_reader_head(s->reader);
    char *subject = subject_of(NULL, vgi_item_name(it), e);
    if (!subject) return VG_ENOMEM;
    r = s->own_name ? check_joins(s, &h->body.mesh, subject, e) : VG_OK;
    free(subject);
    return r;
}

/* ---- sequences ---- */

/* The sequence has no reference: its first pose becomes the reference and is also a frame. */
static int reference_from_first(vg_source *s, vg_err *e)
{
    vg_head *h = &s->head;
    const vg_frame *first = NULL;
    int r = vgi_play_first(&s->playing, &s->own, &first, e);
    if (r < 0) return r;
    h->body.reference = vgi_copy_array(first->values, 3 * h->body.mesh.nv, sizeof(double), e);
    h->body.reference_name = vgi_copy_string(first->name, strlen(first->name), e);
    return h->body.reference && h->body.reference_name ? VG_OK : VG_ENOMEM;
}

/* The sequence defines the mesh: its head becomes that of the source. */
static int take_over_head(vg_source *s, const char *archive, const char *path, vg_head *h, vg_err *e)
{
    vgi_playing *p = &s->playing;
    vg_kind kind = h->kind;
    vg_precision precision = h->precision;
    size_t count = h->count, width = h->width;
    if (kind != VG_VERTICES && (s->items.n > 1 || archive))
        return vg_fail(e, VG_EINPUT, "%s holds %s: only vertices can be joined with other inputs", p->subject,
                       vg_head_form(h));
    int r = p->format->keeps & VGI_KEEPS_FACES
                ? VG_OK
                : vgi_play_borrow_faces(p, path == vgi_standard_input ? NULL : path, h, e);
    if (r == VG_OK) r = settle_mesh(s, &h->body.mesh, archive, path, e);
    if (r < 0) return r;
    vg_head_move(&s->head, h);
    s->own.kind = kind, s->own.precision = precision, s->own.count = count, s->own.width = width;
    if (s->head.nanchors &&
        !(s->own.anchors = vgi_copy_array(s->head.anchors, s->head.nanchors, sizeof *s->head.anchors, e)))
        return VG_ENOMEM;
    s->own.nanchors = s->head.nanchors;
    if (s->head.body.reference && (r = keep_skeleton(s, &s->head, e)) < 0) return r;
    if (!s->head.body.reference) return reference_from_first(s, e);
    if (!s->head.body.reference_name) s->head.body.reference_name = vgi_copy_string(p->stem, strlen(p->stem), e);
    return s->head.body.reference_name ? VG_OK : VG_ENOMEM;
}

static int join_sequence(const vg_source *s, const vg_head *h, vg_err *e)
{
    const char *subject = s->playing.subject;
    if (s->playing.format->join) return s->playing.format->join(s->playing.state, &s->own, e);
    if (h->kind != VG_VERTICES)
        return vg_fail(e, VG_EINPUT, "%s holds %s: only vertices can be joined with a mesh or other inputs", subject,
                       vg_head_form(h));
    if (h->body.mesh.nf) return check_joins(s, &h->body.mesh, subject, e);
    return h->body.mesh.nv == s->own.body.mesh.nv
               ? VG_OK
               : vgi_different_count(h, subject, s->own.body.mesh.nv, s->own_name, e);
}

/* Start a sequence with the contents `in` (takes ownership): a file, or a member of an archive. */
static int play(vg_source *s, const vgi_sequence_format *format, vgi_input *in, const char *archive, const char *path,
                vg_err *e)
{
    vgi_playing *p = &s->playing;
    vg_head h = {0};
    s->used |= format->uses;
    int r = vgi_play_open(p, format, in, &s->reading, subject_of(archive, path, e), pose_of(path, e), &h, e);
    if (r == VG_OK && format->note) note_left_out(s, p->subject, format->note(p->state));
    if (r == VG_OK && format->join && !s->own.body.skeleton.njoints)
        r = vg_fail(e, VG_EINPUT, "%s holds joints by name: name the file of their skeleton with --mesh", p->subject);
    if (r == VG_OK) r = s->own_name ? join_sequence(s, &h, e) : take_over_head(s, archive, path, &h, e);
    vg_head_clear(&h);
    return r;
}

static int open_sequence(vg_source *s, vgi_item *it, vg_err *e)
{
    vgi_input *in;
    int r = vgi_item_input(&s->items, it, &in, e);
    return r < 0 ? r : play(s, it->sequence, in, NULL, vgi_item_name(it), e);
}

/* The member of an archive in s->data. */
static int play_member(vg_source *s, const vgi_sequence_format *format, const char *path, vg_err *e)
{
    vgi_input *in;
    int r = vgi_input_memory(&in, s->data.data, s->data.size, path, e);
    return r < 0 ? r : play(s, format, in, s->archive_name, path, e);
}

static int open_next(vg_source *s, vg_err *e)
{
    vgi_item *it = &s->items.at[s->next++];
    switch (it->content) {
    case VGI_STREAM: return open_stream(s, it, e);
    case VGI_ARCHIVE: return open_archive(s, it, e);
    case VGI_SEQUENCE: return open_sequence(s, it, e);
    default: return open_mesh(s, it, e);
    }
}

static int next_member(vg_source *s, vg_err *e)
{
    const char *path;
    int r = vgi_archive_next(s->archive, &path, &s->data, e);
    if (r == 0) vgi_archive_close(&s->archive);
    if (r <= 0) return r;
    const vgi_sequence_format *sequence = vgi_packable(path);
    if (s->reading.objects && vgi_format_by_suffix(path) == &vgi_format_obj) sequence = &vgi_sequence_objects;
    return sequence ? play_member(s, sequence, path, e) : put_pose(s, s->archive_name, path, e);
}

/* ---- interface ---- */

static int look_at(vg_source *s, vgi_item *it, vg_err *e)
{
    int r = vgi_item_look(&s->items, it, e);
    return r == VG_OK && it->content == VGI_STREAM ? look_at_stream(s, it, e) : r;
}

/* Open inputs until the mesh is known. Among several operands, streams define it when they are examined. */
static int find_mesh(vg_source *s, vg_err *e)
{
    int r = VG_OK;
    while (r == VG_OK && !s->through && !s->own_name && !vgi_belt_things(s->belt))
        r = s->archive ? next_member(s, e) : open_next(s, e);
    return r == VG_OK && vgi_belt_things(s->belt) ? take_first(s, e) : r;
}

static int settle_named_mesh(vg_source *s, const char *mesh, vg_err *e)
{
    vg_head from;
    vg_note note;
    int r = vg_load_with(&from, mesh, "mesh", NULL, &note, e);
    if (r == VG_OK) snprintf(s->warning, sizeof s->warning, "%s", note.text);
    if (r == VG_OK) r = settle_mesh(s, &from.body.mesh, NULL, mesh, e);
    if (r == VG_OK) r = keep_skeleton(s, &from, e);
    if (r == VG_OK) r = vg_head_merge_trace(&s->head, &from, e);
    static const char *const parts[] = {"mesh", "attributes", "asset", "skeleton", "reference"};
    for (size_t i = 0; r == VG_OK && i < sizeof parts / sizeof *parts; i++) vg_head_take(&s->head, &from, parts[i]);
    vg_head_clear(&from);
    return r;
}

/* first_only: only the first item is needed; the others are not opened. */
static int open_source(vg_source **out, const char *const *operands, size_t n, const vg_source_options *o,
                       bool first_only, vg_err *e)
{
    const char *mesh = o ? o->mesh : NULL;
    vg_source *s = *out = vgi_array(1, sizeof *s, e);
    if (!s) return VG_ENOMEM;
    vgi_items *items = &s->items;
    items->limits = vgi_usual_limits;
    if (o) s->reading = o->reading;
    items->objects = s->reading.objects;
    if (o && o->most_bytes) items->limits.member_bytes = items->limits.total_bytes = o->most_bytes;
    int r = n ? make_belt(s, o ? o->threads : 1, e) : vg_fail(e, VG_EARG, "no input is given");
    if (r == VG_OK && mesh) r = settle_named_mesh(s, mesh, e);
    for (size_t i = 0; r == VG_OK && i < n; i++) r = vgi_items_add(items, operands[i], e);
    if (first_only && items->n) vgi_items_keep(items, 1);
    for (size_t i = 0; r == VG_OK && i < items->n; i++) r = look_at(s, &items->at[i], e);
    if (r == VG_OK) r = find_mesh(s, e);
    if (r < 0) vg_source_close(out);
    return r;
}

int vg_source_open(vg_source **s, const char *const *operands, size_t n, vg_err *e)
{
    return open_source(s, operands, n, NULL, false, e);
}

int vg_source_open_with(vg_source **s, const char *const *operands, size_t n, const vg_source_options *o, vg_err *e)
{
    return open_source(s, operands, n, o, false, e);
}

const char *vg_source_warning(const vg_source *s)
{
    return *s->warning ? s->warning : NULL;
}

vg_head *vg_source_head(vg_source *s)
{
    return s->through ? vg_reader_head(s->reader) : &s->head;
}

const vg_failure *vg_source_failure(const vg_source *s)
{
    return s->reader ? vg_reader_failure(s->reader) : NULL;
}

vg_records *vg_source_tail(vg_source *s)
{
    return s->through ? vg_reader_tail(s->reader) : &s->tail;
}

static int append_records(vg_records *to, vg_records *from, vg_err *e)
{
    size_t cap = to->n;
    if (from->n == 0) return VG_OK;
    int r = vgi_grow(&to->at, &cap, to->n + from->n, sizeof *to->at, e);
    if (r < 0) return r;
    memcpy(to->at + to->n, from->at, from->n * sizeof *to->at);
    to->n += from->n;
    free(from->at); /* the payloads were moved */
    *from = (vg_records){0};
    return VG_OK;
}

static int end_reader(vg_source *s, vg_err *e)
{
    int r = append_records(&s->tail, vg_reader_tail(s->reader), e);
    vg_reader_close(&s->reader);
    return r;
}

/* Whether the next input may be read ahead: members of the open archive, and regular mesh files. */
static bool may_read_ahead(const vg_source *s)
{
    if (s->failed || vgi_belt_full(s->belt) || s->waiting >= MOST_WAITING) return false;
    if (s->playing.format || s->reader) return false;
    if (s->archive || s->next == s->items.n) return s->archive != NULL;
    const vgi_item *next = &s->items.at[s->next];
    return next->content == VGI_MESH && next->regular;
}

/* Advance by one input or frame: 1 with a frame; VG_OK: call again. There must be something left to read. */
static int step_source(vg_source *s, vg_frame *f, vg_err *e)
{
    if (s->playing.format) return vgi_play_next(&s->playing, &s->own, f, e);
    if (s->archive) return next_member(s, e);
    if (!s->reader) return open_next(s, e);
    int r = vg_reader_next(s->reader, f, e);
    return r == 0 ? end_reader(s, e) : r;
}

const char *vg_source_ignored(const vg_source *s)
{
    const vg_reading *o = &s->reading;
    const struct {
        const char *name;
        bool given;
        unsigned of;
    } all[] = {{"array_axes", o->array_axes, VGI_USES_AXES},
               {"objects", o->objects, VGI_USES_OBJECTS},
               {"animation", o->animation, VGI_USES_GLTF},
               {"shapes", o->shapes, VGI_USES_GLTF},
               {"unwelded", o->unwelded, VGI_USES_GLTF}};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        if (all[i].given && !(s->used & all[i].of)) return all[i].name;
    return NULL;
}

bool vg_source_may_wait(const vg_source *s)
{
    if (s->reader) return vg_reader_may_wait(s->reader);
    if (s->first) return false;
    for (size_t i = 0; i < s->items.n; i++)
        if (!s->items.at[i].regular) return true;
    return false;
}

int vg_source_next(vg_source *s, vg_frame *f, vg_err *e)
{
    if (s->through) return vg_reader_next(s->reader, f, e);
    for (;;) {
        if (s->first || (vgi_belt_things(s->belt) && !may_read_ahead(s))) return hand_out(s, f, e);
        if (s->failed) {
            if (e) *e = s->failure;
            return s->failed;
        }
        if (!s->playing.format && !s->reader && !s->archive && s->next == s->items.n) return 0;
        int r = step_source(s, f, &s->failure);
        if (r > 0) return r;
        s->failed = r; /* reported after the pending poses */
    }
}

void vg_source_close(vg_source **source)
{
    vg_source *s = *source;
    if (!s) return;
    vgi_items_clear(&s->items);
    vg_reader_close(&s->reader);
    vgi_archive_close(&s->archive);
    vgi_play_stop(&s->playing);
    vgi_belt_free(&s->belt);
    for (size_t i = 0; i < s->nposes; i++) {
        clear_pose(s, &s->poses[i]);
        vg_bytes_clear(&s->poses[i].data);
    }
    free(s->poses);
    vg_head_clear(&s->head);
    vg_head_clear(&s->own);
    vg_records_clear(&s->tail);
    vg_bytes_clear(&s->data);
    free(s->own_name);
    free(s);
    *source = NULL;
}

int vg_load_with(vg_head *h, const char *operand, const char *what, const vg_source_options *o, vg_note *note, vg_err *e)
{
    vg_source *s;
    char subject[420];
    *h = (vg_head){0};
    if (note) *note = (vg_note){0};
    int r = open_source(&s, &operand, 1, o, true, e);
    if (r < 0) return r;
    vg_head *from = vg_source_head(s);
    snprintf(subject, sizeof subject, "'%.400s'", operand);
    r = vg_head_need(from, what, subject, e);
    if (r == VG_OK && s->through) r = vg_head_copy(h, from, e);
    else if (r == VG_OK) vg_head_move(h, from);
    if (r == VG_OK && note && vg_source_warning(s)) vgi_note(note, "%s", vg_source_warning(s));
    vg_source_close(&s);
    return r;
}

int vg_load(vg_head *h, const char *operand, const char *what, vg_err *e)
{
    return vg_load_with(h, operand, what, NULL, NULL, e);
}
