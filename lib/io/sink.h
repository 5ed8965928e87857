/* sink.h: what sink.c is made of: the plan of an output (sink_plan.c), files that take their final names in the end
 * (targets.c), and a sequence without the vertices that are in no face (slim.c).
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_SINK_H
#define VG_SINK_H

#include "io/io.h"

/* ---- sink_plan.c: what the name of the output asks for ---- */

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
    size_t at, behind; /* series: where %d starts, and where the name goes on */
    int width;         /* of the zero-padded number */
} vgi_plan;

/* vgi_plan_make: name is output, borrowed. */
int vgi_plan_make(vgi_plan *p, const char *output, const vg_sink_options *o, vg_err *e) VG_MUST_CHECK;
/* vgi_plan_check_place: can a file be made there? */
int vgi_plan_check_place(const vgi_plan *p, vg_err *e) VG_MUST_CHECK;
/* vgi_plan_check_head: can frames of this head be written so? */
int vgi_plan_check_head(const vgi_plan *p, const vg_head *h, const char *output, vg_err *e) VG_MUST_CHECK;
/* vgi_plan_lacks_faces: does the file need a mesh beside it? */
bool vgi_plan_lacks_faces(const vgi_plan *p);
bool vgi_is_directory(const char *path);
/* vgi_parent_directory: the one in which a file of this name (n bytes) would lie; free it. */
char *vgi_parent_directory(const char *path, size_t n, vg_err *e);

/* ---- targets.c: files that are written beside their place and take their final names together ---- */

typedef struct vgi_target {
    char *final, *temporary; /* temporary NULL: written in place */
    bool renamed;
} vgi_target;

typedef struct vgi_targets { /* whole at any moment: vgi_targets_remove may come from a signal's handler */
    vgi_target *at;
    size_t n, cap;
    uint64_t temporaries; /* names tried */
} vgi_targets;

/* vgi_target_look: 1 and *st when there is something that can be written or replaced, 0 when there is nothing;
 * negative when there is a directory, or a link that leads nowhere, in whose place a file would come. */
struct stat;
int vgi_target_look(const char *path, struct stat *st, vg_err *e) VG_MUST_CHECK;
/* vgi_targets_open: open what will be `path`: a descriptor, or negative. A link is followed: what it points to is
 * replaced, not the link. Pipes and devices, which cannot be replaced, are opened where they are. */
int vgi_targets_open(vgi_targets *t, const char *path, vg_err *e) VG_MUST_CHECK;
/* vgi_targets_in_place: is the file that was opened last a pipe or a device? */
bool vgi_targets_in_place(const vgi_targets *t);
/* vgi_target_close: close a descriptor; messages call the file `name`. */
int vgi_target_close(int fd, const char *name, vg_err *e) VG_MUST_CHECK;
int vgi_targets_rename(vgi_targets *t, vg_err *e) VG_MUST_CHECK;
/* vgi_targets_remove: the files; under final names too, for half a series would look like a whole one. Nothing but
 * system calls. */
void vgi_targets_remove(const vgi_targets *t);
void vgi_targets_clear(vgi_targets *t); /* the list */

/* ---- slim.c: a sequence without its loose vertices, those in no face ---- */

typedef struct vgi_slim {
    uint32_t *kept; /* the vertices that stay; NULL: all do */
    vg_head head;   /* of those; the others close up */
    vg_frame frame; /* the last one */
} vgi_slim;

/* vgi_count_loose: how many vertices are in no face. */
int vgi_count_loose(const vg_mesh *m, size_t *loose, vg_err *e) VG_MUST_CHECK;
/* vgi_slim_make: for frames of vertices; VG_EARG when nothing would be left. */
int vgi_slim_make(vgi_slim *s, const vg_head *h, vg_err *e) VG_MUST_CHECK;
/* vgi_slim_take: fill s->frame from a frame of the whole head. */
int vgi_slim_take(vgi_slim *s, const vg_frame *f, vg_err *e) VG_MUST_CHECK;
void vgi_slim_clear(vgi_slim *s);

#endif
