/* vg/io.h: files: streams, mesh files, archives.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_IO_H
#define VG_PART_IO_H

#include "vg/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The stream (fmt/STREAM.md). A reader takes it from a descriptor or from memory and checks every byte. */
typedef struct vg_reader vg_reader;
/* vg_reader_open: read everything up to the FORM record. fd is borrowed; vg_reader_next reads it to the END mark.
 * `name` is used in messages. */
int vg_reader_open(vg_reader **r, int fd, const char *name, vg_err *e) VG_MUST_CHECK;
int vg_reader_open_memory(vg_reader **r, const void *data, size_t n, const char *name, vg_err *e) VG_MUST_CHECK;
/* vg_reader_head: the head that was read. The caller may change it: a filter hands it to its writer. */
vg_head *vg_reader_head(vg_reader *r);
/* The FAIL record: why the writer of the stream gave up. */
typedef struct vg_failure {
    char *program; /* NULL: there is none */
    uint32_t status; /* exit status */
    char *message; /* one line */
} vg_failure;

/* vg_reader_next: 1 and the next frame; 0 after the END mark, if nothing follows it; negative on damage. */
int vg_reader_next(vg_reader *r, vg_frame *f, vg_err *e) VG_MUST_CHECK;
/* vg_reader_may_wait: whether vg_reader_next may have to wait for its input. */
bool vg_reader_may_wait(const vg_reader *r);
vg_records *vg_reader_tail(vg_reader *r); /* unknown records after the last frame; valid once vg_reader_next has
                                             returned 0 */
/* vg_reader_failure: the reason for VG_ETRUNC, if the stream gives one; else NULL. Borrowed until close. */
const vg_failure *vg_reader_failure(const vg_reader *r);
void vg_reader_close(vg_reader **r);

typedef struct vg_writer vg_writer;
/* vg_writer_open: write everything up to FORM. fd is borrowed. h is borrowed until close and must not change. */
int vg_writer_open(vg_writer **w, int fd, const char *name, const vg_head *h, vg_err *e) VG_MUST_CHECK;
/* vg_writer_put: small frames are collected and written together, up to 256 KiB; but frames that come more than a
 * millisecond apart are written as they come. */
int vg_writer_put(vg_writer *w, const vg_frame *f, vg_err *e) VG_MUST_CHECK;
/* vg_writer_flush: write what was collected. Before waiting for anything (vg_reader_may_wait), so that the reader of the
 * stream need not wait too. */
int vg_writer_flush(vg_writer *w, vg_err *e) VG_MUST_CHECK;
/* vg_writer_end: write remaining unknown records (may be NULL) and END, and flush. A stream without END is
 * incomplete. */
int vg_writer_end(vg_writer *w, const vg_records *tail, vg_err *e) VG_MUST_CHECK;
/* vg_writer_abandon: write a FAIL record that names the program and the cause. Best effort; END must not follow. */
void vg_writer_abandon(vg_writer *w, const char *program, int exit_status, const char *message);
void vg_writer_close(vg_writer **w);

/* A sequence to be read. Operands are streams, mesh files, files that hold a whole sequence (point caches, arrays,
 * ...), archives of mesh files, directories, or "-" (standard input, any of these). The format is detected from
 * the content, for OBJ also from the name. The mesh files of directories and archives are read in natural order
 * ("pose2" before "pose10"); other files there are skipped. A single stream is passed on as it is; several
 * operands are joined into one sequence of vertices of one mesh. The first pose is the reference unless a stream
 * or sequence has its own. */
typedef struct vg_source vg_source;

/* Options for files that hold more, or less, than a sequence of vertices. All zero: the defaults. */
typedef struct vg_reading {
    const char *array_axes; /* NPZ: the meaning of the axes of positions: "fvx" (frames, vertices, x y z), "vxf",
                               ...; NULL: detected from their lengths, the faces and the reference */
    bool objects;           /* OBJ: each object is a frame, all of one topology */
    const char *animation;  /* glTF: the animation of this name; NULL: all, one after another */
    double fps;             /* glTF: frames per second, from the first key to the last; 0: a frame at each key */
    bool shapes;            /* glTF: morph targets, whatever animations there are */
    bool unwelded;          /* glTF: keep the vertices of the file, split at seams */
    const vg_body *like;    /* glTF: a body whose welding is used by files with as many vertices as its own file,
                               if they make the same faces. NULL: each file is welded by itself */
} vg_reading;

int vg_source_open(vg_source **s, const char *const *operands, size_t n, vg_err *e) VG_MUST_CHECK;
typedef struct vg_source_options {
    const char *mesh;    /* the operand that gives faces and reference pose to operands without any (point caches,
                            arrays); NULL: the previous operand, or the file of the same name ending in .obj or
                            .ply */
    uint64_t most_bytes; /* limit of the unpacked size of an archive, a compressed file, or a file from a pipe that
                            is not a stream; 0: 1 GiB per file, 64 GiB in all */
    int threads;         /* parse this many mesh files at a time and read one ahead, within 256 MiB. A pipe is not
                            read before its data is needed. 0 or 1: one after another */
    vg_reading reading;
} vg_source_options;
/* vg_source_open_with: o may be NULL. */
int vg_source_open_with(vg_source **s, const char *const *operands, size_t n, const vg_source_options *o,
                        vg_err *e) VG_MUST_CHECK;
/* vg_source_warning: one line on what was dropped from the input that holds the mesh; NULL: nothing. Borrowed
 * until close. */
const char *vg_source_warning(const vg_source *s);
/* vg_source_ignored: after the last frame, the first member of vg_reading that was set although no input was of a format that uses
 * it (of array_axes, objects, animation, shapes, unwelded); NULL: none. */
const char *vg_source_ignored(const vg_source *s);
vg_head *vg_source_head(vg_source *s);
int vg_source_next(vg_source *s, vg_frame *f, vg_err *e) VG_MUST_CHECK;
bool vg_source_may_wait(const vg_source *s); /* as vg_reader_may_wait */
vg_records *vg_source_tail(vg_source *s);
const vg_failure *vg_source_failure(const vg_source *s); /* as vg_reader_failure */
void vg_source_close(vg_source **s);

/* vg_load: the head of one operand, which must hold `what` (vg_head_need); otherwise VG_EINPUT with the operand's
 * name. The reference is the operand's reference pose: the only pose of a mesh file, the pose without rotations of
 * a BVH, the reference of a stream, the first pose of an archive or directory. Frames are not read. */
int vg_load(vg_head *h, const char *operand, const char *what, vg_err *e) VG_MUST_CHECK;
/* vg_load_with: the same with options (may be NULL); what was dropped from the mesh goes into *note (may be NULL). */
int vg_load_with(vg_head *h, const char *operand, const char *what, const vg_source_options *o, vg_note *note,
                 vg_err *e) VG_MUST_CHECK;

/* A queue of frames: in memory up to a limit, beyond it in an unnamed file in $TMPDIR (or /tmp). */
typedef struct vg_spool vg_spool;
typedef struct vg_spool_stats {
    uint64_t most_frames; /* the largest number that waited */
    uint64_t file_bytes;  /* the largest size of the file; 0: there was none */
} vg_spool_stats;

/* vg_spool_new: h describes the frames; borrowed until free. limit: bytes of frames kept in memory. */
int vg_spool_new(vg_spool **s, const vg_head *h, size_t limit, vg_err *e) VG_MUST_CHECK;
void vg_spool_free(vg_spool **s);
/* vg_spool_put: append a complete copy of f. vg_spool_next: 1 and the oldest frame; 0 if the queue is empty. */
int vg_spool_put(vg_spool *s, const vg_frame *f, vg_err *e) VG_MUST_CHECK;
int vg_spool_next(vg_spool *s, vg_frame *f, vg_err *e) VG_MUST_CHECK;
vg_spool_stats vg_spool_get_stats(const vg_spool *s);

/* A store of all frames of a sequence with random access: in memory up to a limit, beyond it in an unnamed file in
 * $TMPDIR (or /tmp). Several threads may read at once. */
typedef struct vg_poses vg_poses;
typedef struct vg_poses_stats {
    uint64_t memory_bytes, file_bytes; /* bytes of the frames in each */
} vg_poses_stats;

/* vg_poses_new: h describes the frames; borrowed until free. limit: bytes of frames kept in memory. */
int vg_poses_new(vg_poses **p, const vg_head *h, size_t limit, vg_err *e) VG_MUST_CHECK;
void vg_poses_free(vg_poses **p);
/* vg_poses_add: append a complete copy of f. */
int vg_poses_add(vg_poses *p, const vg_frame *f, vg_err *e) VG_MUST_CHECK;
size_t vg_poses_count(const vg_poses *p);
/* vg_poses_values: set *values to the values of frame i < count (head.count * vg_head_width(head) numbers). A
 * frame in the file is read into `room`, which must be large enough. Borrowed until the next _add, and until
 * `room` is reused. */
int vg_poses_values(const vg_poses *p, size_t i, double *room, const double **values, vg_err *e) VG_MUST_CHECK;
/* vg_poses_frame: frame i with its name, time and all channels. */
int vg_poses_frame(const vg_poses *p, size_t i, vg_frame *f, vg_err *e) VG_MUST_CHECK;
vg_poses_stats vg_poses_get_stats(const vg_poses *p);

/* Files that are replaced as a whole. Each is written under a temporary name in the same directory; all are
 * renamed together when they are complete, or removed. A replaced file keeps its permissions. A link is followed:
 * the file it points to is replaced, not the link. Pipes and devices cannot be replaced and are written directly. */
typedef struct vg_target {
    char *final, *temporary; /* temporary NULL: written directly */
    bool renamed;
} vg_target;

typedef struct vg_targets { /* always consistent: vg_targets_remove may be called by a signal handler */
    vg_target *at;
    size_t n, cap;
    uint64_t temporaries; /* number of temporary names tried */
} vg_targets;

/* vg_target_check: can `path` be written or replaced? A directory, a link that leads nowhere, or a directory without
 * permission is VG_ESYS. */
int vg_target_check(const char *path, vg_err *e) VG_MUST_CHECK;
/* vg_targets_open: open a file that will become `path`. Returns its descriptor, or a negative status. */
int vg_targets_open(vg_targets *t, const char *path, vg_err *e) VG_MUST_CHECK;
/* vg_targets_name: change the final name of target i, before vg_targets_rename. */
int vg_targets_name(vg_targets *t, size_t i, const char *path, vg_err *e) VG_MUST_CHECK;
/* vg_targets_in_place: is the file that was opened last a pipe or a device? */
bool vg_targets_in_place(const vg_targets *t);
/* vg_target_close: close a descriptor; messages call the file `name`. Some file systems report a full disk only
 * here. */
int vg_target_close(int fd, const char *name, vg_err *e) VG_MUST_CHECK;
int vg_targets_rename(vg_targets *t, vg_err *e) VG_MUST_CHECK;
/* vg_targets_remove: unlink the files, also those already renamed, because half a series would look complete.
 * Calls only unlink. */
void vg_targets_remove(const vg_targets *t);
void vg_targets_clear(vg_targets *t); /* forget the files and keep them */

/* The output of a sequence: one mesh file, a '%04d' pattern, a directory ("out/"), an archive, or one file that
 * holds the whole sequence. The name chooses, and is checked at once; "NAME:ply" chooses the format inside an
 * archive or directory, and `format` (may be NULL) overrides both. Everything is written under temporary names and
 * renamed by vg_sink_end. The frames of a directory or archive are read back in the order in which they were put:
 * if their names do not sort in that order, or are no file names, the files get a number in front. */
typedef struct vg_sink vg_sink;
typedef struct vg_sink_options {
    const char *format;  /* "obj", "pc2", ...; NULL: by the name */
    bool full_precision; /* numbers read back to the same binary64, not binary32 */
    long first_number;   /* the number of the first file of a pattern */
    const char *mesh;    /* path of the mesh of a file without faces; NULL: NAME.obj beside it, which must not be
                            another mesh */
    bool no_mesh;        /* nowhere */
    bool drop_loose;     /* drop the vertices that are in no face */
    size_t most_targets; /* GLB, glTF: the largest number of morph targets. 0: as many as the tolerance needs; up
                            to 100 frames are targets themselves */
    double morph_tolerance; /* GLB, glTF: the largest error of a vertex when frames are combined from fewer
                               targets, in D. 0: 0.001 */
    bool no_normals;     /* GLB, glTF: leave out normals that the input does not have; viewers show such a mesh faceted */
    bool shapes;         /* GLB, glTF: each frame is a morph target, without an animation */
    bool quantize;       /* GLB, glTF: positions of 16 bits and normals of 8 (KHR_mesh_quantization); vertices only */
    const char *name;    /* GLB, glTF: the name of the animation; NULL: from its frames */
    bool replace;        /* if a directory or a pattern has mesh files of an earlier set, remove those that are not
                            overwritten once all is written; otherwise such files are an error before any work */
    int threads;         /* this many mesh files are made at a time, and one more waits, in at most 256 MiB, but always
                            two; their errors are reported by a later call. 0 or 1: each at once */
} vg_sink_options;
/* vg_sink_check: can this name and format be written? Call it before any work. */
int vg_sink_check(const char *output, const vg_sink_options *o, vg_err *e) VG_MUST_CHECK;
int vg_sink_open(vg_sink **s, const char *output, const vg_head *h, const vg_sink_options *o,
                 vg_err *e) VG_MUST_CHECK;
/* a frame of vertices; arrays take any kind */
int vg_sink_put(vg_sink *s, const vg_frame *f, vg_err *e) VG_MUST_CHECK;
int vg_sink_end(vg_sink *s, vg_err *e) VG_MUST_CHECK;
/* vg_sink_discard: remove the files, unless vg_sink_end has renamed them. For the handler of a signal that ends
 * the program: it calls only unlink and rmdir, and does not change the sink. */
void vg_sink_discard(const vg_sink *s);
/* vg_sink_warning: line i of what the output cannot hold, after vg_sink_end; NULL: no more. Borrowed until close. */
const char *vg_sink_warning(const vg_sink *s, size_t i);
/* vg_sink_report: one line on the file that was written, after vg_sink_end: its bytes, and how exact it is; NULL: nothing to
 * say. *inexact: frames were mixed, or numbers rounded beyond binary32. Borrowed until close. */
const char *vg_sink_report(const vg_sink *s, bool *inexact);
void vg_sink_close(vg_sink **s); /* without _end, nothing is left behind */

/* A mesh file in memory, read or written as a whole. */
typedef struct vg_model {
    vg_mesh mesh;
    double *vertices;
    vg_attributes attributes;
    vg_note note; /* what reading dropped or repaired */
} vg_model;

void vg_model_clear(vg_model *m);
/* vg_model_read: format NULL: detected from content, then from the name. Messages call the file `name`. */
int vg_model_read(vg_model *m, const void *data, size_t n, const char *format, const char *name,
                  vg_err *e) VG_MUST_CHECK;
/* vg_model_write: append to out. attributes may be NULL. */
int vg_model_write(vg_bytes *out, const char *format, const vg_mesh *mesh, const double *vertices,
                   const vg_attributes *attributes, bool full_precision, vg_err *e) VG_MUST_CHECK;

#ifdef __cplusplus
}
#endif
#endif
