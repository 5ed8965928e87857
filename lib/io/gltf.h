/* gltf.h: shared by the glTF files: a file as JSON with its buffers, and accessors into them.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_H
#define VG_GLTF_H

#include "io/io.h"
#include "io/json.h"

enum { VGI_GLTF_HEADER = 12, VGI_GLTF_CHUNK = 8, VGI_GLTF_JSON = 0x4E4F534A, VGI_GLTF_BIN = 0x004E4942 };

enum { VGI_GLTF_BYTE = 5120, VGI_GLTF_UBYTE, VGI_GLTF_SHORT, VGI_GLTF_USHORT, VGI_GLTF_UINT = 5125, VGI_GLTF_FLOAT };

enum {
    VGI_GLTF_POINTS,
    VGI_GLTF_LINES,
    VGI_GLTF_LINE_LOOP,
    VGI_GLTF_LINE_STRIP,
    VGI_GLTF_TRIANGLES,
    VGI_GLTF_STRIP,
    VGI_GLTF_FAN
};

/* Extras that our own files contain. Of the mesh: the sizes of the faces, as pairs of a count and a size; the
 * triangles of a face are consecutive, and the first one begins with the face's first corner. Of the animation: names
 * of frames. */
#define VGI_GLTF_FACES "vg_faces"
#define VGI_GLTF_FRAMES "vg_frames"
/* Extras that identify vertices copied for texture coordinates: the number of originals, which come first, and for
 * each copy its original. In an asset of a character: the number of vertices, and for each vertex of the file the one
 * it represents; present only if different vertices coincide at rest. */
#define VGI_GLTF_VERTICES "vg_vertices"
/* The name of the pose without shapes, before the shapes of a file without animation. */
#define VGI_GLTF_BASE "base"

typedef struct vgi_gltf_buffer {
    const unsigned char *data;
    size_t size;
    vg_bytes own; /* decoded data, or data read from an external file */
} vgi_gltf_buffer;

typedef struct vgi_gltf {
    const char *subject; /* borrowed */
    vg_bytes file;
    vgi_json *json;
    size_t nbuffers, buffers_cap;
    size_t given; /* number of buffers in the file; those after them are decompressed */
    vgi_gltf_buffer *buffers;
} vgi_gltf;

/* vgi_gltf_open: read a whole .glb or .gltf file with the buffers it needs. The caller clears it, also on failure. */
int vgi_gltf_open(vgi_gltf *g, vgi_input *in, const char *subject, vg_err *e) VG_MUST_CHECK;
void vgi_gltf_clear(vgi_gltf *g);
/* gltf_unpack.c: replace compressed data by additional buffers. */
int vgi_gltf_unpack(vgi_gltf *g, vg_err *e) VG_MUST_CHECK;
bool vgi_gltf_is_fallback(const vgi_json *buffer); /* for readers that cannot decompress; it may have no bytes */
size_t vgi_gltf_component_bytes(int component);    /* 0 if invalid */
size_t vgi_gltf_width(const char *type);           /* numbers per element of this type, e.g. "VEC3"; 0 if NULL or
                                                      invalid */
/* vgi_gltf_bad: VG_EINPUT, prefixed with the name of the file. */
int vgi_gltf_bad(const vgi_gltf *g, vg_err *e, const char *format, ...) VG_PRINTF(3, 4);

/* An accessor: count elements of `width` numbers. Nothing is copied, so that many accessors of the same bytes cost
 * nothing. */
typedef struct vgi_accessor {
    size_t count, width, stride;
    const unsigned char *data; /* NULL: zeros */
    int component;
    bool normalized;
    size_t nsparse; /* replaced elements, ascending */
    const unsigned char *sparse, *replaced;
    int sparse_component;
} vgi_accessor;

/* vgi_gltf_accessor: the one with number `ref`; it must have this width, and this count unless 0. what is for
 * messages. Without a given count, its own count must be backed by bytes. */
int vgi_gltf_accessor(const vgi_gltf *g, const vgi_json *ref, size_t width, size_t count, const char *what,
                      vgi_accessor *a, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_any_accessor: of any width and count that is valid. */
int vgi_gltf_any_accessor(const vgi_gltf *g, const vgi_json *ref, vgi_accessor *a, vg_err *e) VG_MUST_CHECK;
size_t vgi_accessor_bytes(const vgi_accessor *a); /* per element */
/* vgi_gltf_view_bytes: all bytes of the buffer view with number `ref`. */
int vgi_gltf_view_bytes(const vgi_gltf *g, const vgi_json *ref, const unsigned char **data, size_t *n,
                        vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_read_beside: a whole external file, beside or below the one that `in` reads. */
int vgi_gltf_read_beside(const vgi_gltf *g, vgi_input *in, const char *uri, vg_bytes *to, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_is_understood: an extension that changes no position, or that is supported. */
bool vgi_gltf_is_understood(const char *extension);
void vgi_accessor_get(const vgi_accessor *a, size_t i, double *to); /* width numbers */
bool vgi_accessor_is_index(const vgi_accessor *a);                  /* integers from 0 on */

/* vgi_gltf_item: the element with number `ref` of the file's list `list`. VG_EINPUT if there is none. */
int vgi_gltf_item(const vgi_gltf *g, const vgi_json *ref, const char *list, const vgi_json **item, size_t *number,
                  vg_err *e) VG_MUST_CHECK;

/* vgi_gltf_note_extensions: report those that may change geometry and are ignored. */
void vgi_gltf_note_extensions(const vgi_gltf *g, vg_note *note);

/* ---- gltf_play.c, gltf_write.c: for the tables in gltf.c ---- */
int vgi_gltf_play(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject, vg_err *e);
int vgi_gltf_next(void *state, vg_frame *f, vg_err *e);
uint64_t vgi_gltf_frames(const void *state);
const char *vgi_gltf_note(const void *state);
void vgi_gltf_close(void *state);

int vgi_gltf_check(const vg_head *h, const char *output, vg_err *e);
int vgi_gltf_begin(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, bool binary, vg_err *e);
int vgi_gltf_put(void *state, const vg_frame *f, vg_err *e);
int vgi_gltf_end(void *state, vg_err *e);
const char *vgi_gltf_warning(void *state);
const char *vgi_gltf_report(void *state, bool *inexact);
void vgi_gltf_release(void *state);

#endif
