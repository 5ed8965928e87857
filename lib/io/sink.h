/* sink.h: the parts of sink.c: the plan of an output (sink_plan.c), what it does not keep (losses.c), names of files
 * (file_names.c), files of an earlier set (earlier.c), and a sequence without the vertices that are in no face (slim.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SINK_H
#define VG_SINK_H

#include "io/io.h"

/* ---- sink_plan.c: the meaning of the output's name ---- */

typedef enum vgi_plan_kind {
    VGI_PLAN_FILE,
    VGI_PLAN_SERIES,
    VGI_PLAN_DIRECTORY,
    VGI_PLAN_ARCHIVE,
    VGI_PLAN_SEQUENCE
} vgi_plan_kind;

typedef struct vgi_plan {
    vgi_plan_kind kind;
    const vgi_format *format;
    const vgi_sequence_format *sequence; /* VGI_PLAN_SEQUENCE */
    bool to_stdout; /* VGI_PLAN_FILE, VGI_PLAN_SEQUENCE */
    const char *name; /* the output without ":format": `length` bytes */
    size_t length;
    size_t at, behind; /* series: start of %d, and start of the rest of the name */
    int width;         /* of the zero-padded number */
} vgi_plan;

/* vgi_plan_make: name is output, borrowed. */
int vgi_plan_make(vgi_plan *p, const char *output, const vg_sink_options *o, vg_err *e) VG_MUST_CHECK;
/* vgi_plan_check_place: check that a file can be created there. */
int vgi_plan_check_place(const vgi_plan *p, vg_err *e) VG_MUST_CHECK;
/* vgi_plan_check_head: check that frames of this head can be written in that format. */
int vgi_plan_check_head(const vgi_plan *p, const vg_head *h, const char *output, vg_err *e) VG_MUST_CHECK;
/* vgi_plan_lacks_faces: whether the file needs a mesh beside it. */
bool vgi_plan_lacks_faces(const vgi_plan *p);
bool vgi_is_directory(const char *path);
/* vgi_parent_directory: the directory of the file `path` (n bytes); release with free(). Also used in targets.c. */
char *vgi_parent_directory(const char *path, size_t n, vg_err *e);
/* vgi_check_directory: check that files can be created in `dir`. Messages say that `output` cannot be written. */
int vgi_check_directory(const char *dir, const char *output, vg_err *e) VG_MUST_CHECK;

/* ---- losses.c: what an output does not keep ---- */

typedef struct vgi_losses {
    const vg_head *head;
    unsigned keeps;      /* what the formats of the output keep */
    bool names, times;   /* of frames, lost unless they are kept */
    const char *scalars; /* the channel of vertices that is lost; empty: none */
    const char *own;     /* what the format itself reports; NULL: nothing */
} vgi_losses;

/* vgi_losses_list: append what is lost: first what follows from the head, then what the format reports. */
int vgi_losses_list(const vgi_losses *x, vg_bytes *line, vg_err *e) VG_MUST_CHECK;

/* ---- file_names.c: names of files, ascending in natural order, in which readers take them ---- */

typedef struct vgi_file_names {
    vgi_names frames;      /* the names of all frames so far */
    vg_bytes file;         /* of the last frame: its file name, with terminator */
    bool numbered;         /* files have a number as prefix: "0003_name.obj" */
    size_t first_numbered; /* the frame whose name required this */
    vg_bytes last;         /* the file name, or the path of a series, that the next must follow */
} vgi_file_names;

/* vgi_file_names_next: set t->file for the next frame. 1: numbering starts with this frame, so that the files of all
 * earlier frames must be renamed; 0: otherwise. */
int vgi_file_names_next(vgi_file_names *t, const char *name, const char *suffix, vg_err *e) VG_MUST_CHECK;
/* vgi_file_name_numbered: "0003_name.obj"; '/' and '\' in the name become '_'. */
int vgi_file_name_numbered(vg_bytes *file, uint64_t number, const char *name, const char *suffix,
                           vg_err *e) VG_MUST_CHECK;
/* vgi_file_names_series: VG_EARG unless `path` sorts after the previous one. */
int vgi_file_names_series(vgi_file_names *t, const char *path, vg_err *e) VG_MUST_CHECK;
/* vgi_file_names_warn: report that files are numbered, if they are. */
int vgi_file_names_warn(const vgi_file_names *t, const char *suffix, vgi_names *warnings, vg_err *e) VG_MUST_CHECK;
void vgi_file_names_clear(vgi_file_names *t);

/* ---- earlier.c: mesh files of an earlier run, which would be read together with the new ones ---- */

/* vgi_earlier_list: list the mesh files that are in the directory, or that match the pattern from the first number
 * on; VG_EARG if there are any and they may not be replaced. */
int vgi_earlier_list(vgi_names *paths, const vgi_plan *p, const vg_sink_options *o, vg_err *e) VG_MUST_CHECK;
/* vgi_earlier_remove: remove those that were not written again. */
int vgi_earlier_remove(const vgi_names *paths, const vg_targets *t, vg_err *e) VG_MUST_CHECK;

/* ---- slim.c: a sequence without its loose vertices, those in no face ---- */

typedef struct vgi_slim {
    uint32_t *kept; /* the vertices that are kept; NULL: all */
    vg_head head;   /* of those, renumbered */
    vg_frame frame; /* the latest one */
} vgi_slim;

/* vgi_count_loose: number of vertices that are in no face. */
int vgi_count_loose(const vg_mesh *m, size_t *loose, vg_err *e) VG_MUST_CHECK;
/* vgi_slim_make: for frames of vertices; VG_EARG if no vertex would be left. */
int vgi_slim_make(vgi_slim *s, const vg_head *h, vg_err *e) VG_MUST_CHECK;
/* vgi_slim_take: fill s->frame from a frame of the whole head. */
int vgi_slim_take(vgi_slim *s, const vg_frame *f, vg_err *e) VG_MUST_CHECK;
void vgi_slim_clear(vgi_slim *s);

#endif
