/* sink.h: what sink.c is made of: the plan of an output (sink_plan.c), and a sequence without the vertices that are in
 * no face (slim.c).
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
/* vgi_parent_directory: the directory of the file `path` (n bytes); free it. Also in targets.c. */
char *vgi_parent_directory(const char *path, size_t n, vg_err *e);
/* vgi_check_directory: can files be made in `dir`? Messages say that `output` cannot be written. */
int vgi_check_directory(const char *dir, const char *output, vg_err *e) VG_MUST_CHECK;

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
