/* io.h: shared by the files of lib/io: input bytes, numbers as text, the table of mesh formats, archives. Internal;
 * the public interface is in vg.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_IO_H
#define VG_IO_H

#include "core/core.h"
#include "core/nameless.h"

/* input.c: bytes from a descriptor or from memory, with lookahead */

typedef struct vgi_input vgi_input;
/* own: close it at the end */
int vgi_input_fd(vgi_input **in, int fd, bool own, const char *name, vg_err *e) VG_MUST_CHECK;
/* data is borrowed */
int vgi_input_memory(vgi_input **in, const void *data, size_t n, const char *name, vg_err *e) VG_MUST_CHECK;
/* vgi_input_file: open a file for reading; on failure VG_ESYS with its name. */
int vgi_input_file(vgi_input **in, const char *path, vg_err *e) VG_MUST_CHECK;
void vgi_input_free(vgi_input **in);
const char *vgi_input_name(const vgi_input *in);
const char *vgi_input_path(const vgi_input *in); /* path of the file it was opened from, or NULL */
/* vgi_input_peek: the next bytes without taking them, up to n <= 4096; *got is smaller only at the end of input. */
int vgi_input_peek(vgi_input *in, size_t n, const unsigned char **data, size_t *got, vg_err *e) VG_MUST_CHECK;
/* vgi_input_arrived: the bytes that can be had without waiting: *n of them at the address; SIZE_MAX: none has to be
 * waited for, as in a regular file. */
const unsigned char *vgi_input_arrived(const vgi_input *in, size_t *n);
/* vgi_input_ended: 1 at the end of input, 0 before, negative if it cannot be read. */
int vgi_input_ended(vgi_input *in, vg_err *e) VG_MUST_CHECK;
/* vgi_input_read: exactly n bytes; VG_ETRUNC if the input ends before. *got (may be NULL): number of bytes read. */
int vgi_input_read(vgi_input *in, void *to, size_t n, size_t *got, vg_err *e) VG_MUST_CHECK;
/* vgi_input_take: append exactly n bytes to b, which grows as they arrive, so that a wrong n costs no memory. */
int vgi_input_take(vgi_input *in, vg_bytes *b, size_t n, size_t *got, vg_err *e) VG_MUST_CHECK;
/* Limits of an input, so that a small file or an endless pipe cannot exhaust the machine. */
typedef struct vgi_limits {
    /* of an archive, unpacked; an input that is not a regular file may take up to the first limit in memory, and up
     * to the second in a temporary file */
    uint64_t member_bytes, total_bytes;
    size_t members;                     /* entries of any kind */
} vgi_limits;
extern const vgi_limits vgi_usual_limits;
void vgi_input_limit(vgi_input *in, const vgi_limits *limits); /* otherwise the defaults apply */
const vgi_limits *vgi_input_limits(const vgi_input *in);
/* vgi_input_slurp: append the rest of the input. */
int vgi_input_slurp(vgi_input *in, vg_bytes *b, vg_err *e) VG_MUST_CHECK;
/* A vg_reader over an input; takes ownership of the input, also on failure. */
int vgi_reader_open_input(vg_reader **r, vgi_input *in, vg_err *e) VG_MUST_CHECK;
/* Whether data starts like a stream. */
bool vgi_is_stream(const unsigned char *data, size_t n);

/* vgi_input_spool: copy the rest of an input that can be read only once into an unnamed file. */
int vgi_input_spool(vgi_input *in, int *fd, vg_err *e) VG_MUST_CHECK;

/* number.c: numbers as text, independent of the locale */

/* vgi_parse_double: the number at the start of [s, end): decimal, exponent, sign; "nan" and "inf" are accepted.
 * Correctly rounded. Returns the address after it, or NULL if there is none. */
const char *vgi_parse_double(const char *s, const char *end, double *x);
/* vgi_parse_int: the same for a decimal integer that fits in int64_t. */
const char *vgi_parse_int(const char *s, const char *end, int64_t *x);
/* vgi_print_float: the shortest text that reads back to the same binary32 as (float)x; returns its length, <= 16, no
 * terminator. */
size_t vgi_print_float(char *to, double x);
/* vgi_print_double: the same for binary64; at most 25 bytes. */
size_t vgi_print_double(char *to, double x);
size_t vgi_print_uint(char *to, uint64_t x); /* at most 20 bytes */

/* ---- plain.c: text files as plain UTF-8 ---- */

/* vgi_plain_text: skip a UTF-8 byte order mark; convert UTF-16 text into `own`, which is empty, and set *data to it.
 * Other text does not change. A part of a file is treated as the whole file would be. */
int vgi_plain_text(vg_bytes *own, const unsigned char **data, size_t *n, vg_err *e) VG_MUST_CHECK;
/* vgi_input_slurp_text: the rest of a text input, as plain UTF-8. */
int vgi_input_slurp_text(vgi_input *in, vg_bytes *b, vg_err *e) VG_MUST_CHECK;
size_t vgi_mark_bytes(const void *data, size_t n); /* length of a UTF-8 byte order mark, or 0 */
int vgi_append_letter(vg_bytes *to, uint32_t letter, vg_err *e) VG_MUST_CHECK; /* as UTF-8 */

/* mend.c: what a reader dropped or repaired */

void vgi_note(vg_note *to, const char *format, ...) VG_PRINTF(2, 3); /* add to the line */
/* looks.c: colours (opaque black at first) and texture coordinates (0 at first) of all vertices; vgi_end_texture: each corner
 * has that of its vertex. NaN marks a texture coordinate that is left out, with a note. */
int vgi_begin_colours(vg_model *m, vg_err *e) VG_MUST_CHECK;
int vgi_begin_texture(vg_model *m, vg_err *e) VG_MUST_CHECK;
int vgi_end_texture(vg_model *m, size_t corners, vg_err *e) VG_MUST_CHECK;
void vgi_note_dropped(vg_note *to, size_t faces);                    /* set by vgi_mend_faces */
/* vgi_mend_faces: like vg_mesh_check, but drops, shortens or cuts faces that name a vertex twice or have fewer
 * than 2 corners, until the mesh is valid. points: of its vertices; a (may be NULL): its labels and corner_tex are
 * updated. */
int vgi_mend_faces(vg_mesh *m, const double *points, vg_attributes *a, vg_note *notes, const char *subject,
                   vg_err *e) VG_MUST_CHECK;

/* lines.c: text with one item per line, whose fields are separated by blanks; '#' before a field starts a comment */

enum { VGI_FIELDS = 8, VGI_SUBJECT = 300 };

typedef struct vgi_field {
    const char *begin, *end;
} vgi_field;

typedef struct vgi_line {
    size_t number, n; /* line number, from 1; number of its fields, of which at most VGI_FIELDS are kept */
    vgi_field at[VGI_FIELDS];
    const char *begin, *end; /* the whole line with its comment */
} vgi_line;

typedef struct vgi_lines {
    const char *at, *end;
    size_t number;       /* of the last line taken */
    const char *subject; /* the name of the text in messages, with quotes; borrowed */
} vgi_lines;

vgi_lines vgi_lines_of(const void *data, size_t n, const char *subject);
/* vgi_quote: the name of this file in messages, in `subject`. */
const char *vgi_quote(const char *name, char subject[VGI_SUBJECT]);
/* vgi_lines_next: advance to the next line with content; false at the end. Blanks are space, tab, CR, comma and
 * semicolon. */
bool vgi_lines_next(vgi_lines *t, vgi_line *l);
/* vgi_line_number_of: the number of the line that p is in; LF, CR LF and CR end a line. */
size_t vgi_line_number_of(const char *data, const char *end, const char *p);
/* vgi_line_more: the next field at or after *at, which moves past it; for lines with any number of fields. */
bool vgi_line_more(const vgi_line *l, const char **at, vgi_field *f);
bool vgi_field_is(const vgi_field *f, const char *word);
bool vgi_field_number(const vgi_field *f, double *x); /* whether it is a finite number */
/* Convert a field, or VG_EINPUT naming the line. vertex: `base` is the number of the first one. */
int vgi_field_vertex(const vgi_lines *t, const vgi_line *l, const vgi_field *f, int base, uint32_t *vertex,
                     vg_err *e) VG_MUST_CHECK;
int vgi_line_vertex(const vgi_lines *t, const vgi_line *l, size_t field, int base, uint32_t *vertex,
                    vg_err *e) VG_MUST_CHECK;
int vgi_line_number(const vgi_lines *t, const vgi_line *l, size_t field, double *x, vg_err *e) VG_MUST_CHECK;
/* release with free() */
int vgi_line_name(const vgi_lines *t, const vgi_line *l, size_t field, char **name, vg_err *e) VG_MUST_CHECK;

/* format.c: the table of mesh formats; obj.c ply.c off.c stl.c: one format each */

enum { /* what a format keeps of a sequence besides positions; the program warns of the rest */
    VGI_KEEPS_FACES = 1,    /* split into triangles without VGI_KEEPS_POLYGONS */
    VGI_KEEPS_POLYGONS = 2,
    VGI_KEEPS_ORDER = 4,    /* vertices keep their numbers, including those in no face */
    VGI_KEEPS_TEXTURE = 8,
    VGI_KEEPS_LABELS = 16,
    VGI_KEEPS_NAMES = 32,   /* of frames */
    VGI_KEEPS_TIMES = 64,   /* of frames, any; a format that keeps some of them says so in warning() */
    VGI_KEEPS_SKELETON = 128,
    VGI_KEEPS_DOUBLES = 256, /* with full precision; otherwise doubles are refused */
    VGI_KEEPS_COLOURS = 1024, /* of vertices */
    VGI_KEEPS_ASSET = 512    /* materials, normals, skins; a format that keeps some of them says so in warning() */
};

typedef struct vgi_writing {
    const vg_mesh *mesh;
    const double *vertices;
    const double *shape; /* the pose by which polygons of all poses are split */
    const vg_attributes *attributes; /* may be NULL */
    bool full_precision;
    const vg_patches *patches; /* may be NULL: a colour per face, if the format supports it */
    const vg_bytes *rest;      /* the output of the format's `rest` for this sequence; NULL: compute it */
} vgi_writing;

typedef struct vgi_format {
    const char *name;   /* name for --format and NAME:format */
    const char *suffix; /* ".obj" */
    bool (*sniff)(const unsigned char *data, size_t n); /* from the first 4096 bytes, or all */
    /* read: fill *m, which is empty, from the whole file; on failure the caller clears it. `subject` is the name of
     * the file in messages, including quotes: "'a.obj'" or "'b.obj' in 'a.zip'"; messages add the line. The caller
     * checks the faces with vgi_mend_faces; NaN and Inf are refused here. Data that is not used cannot cause a
     * failure; it is noted in m->note. */
    int (*read)(vg_model *m, const char *data, size_t n, const char *subject, vg_err *e);
    /* write: append a file, up to the part that is the same for all poses of a sequence; rest: append that part.
     * NULL: there is none. */
    int (*write)(vg_bytes *out, const vgi_writing *w, vg_err *e);
    int (*rest)(vg_bytes *out, const vgi_writing *w, vg_err *e);
    unsigned keeps; /* VGI_KEEPS_... */
} vgi_format;

extern const vgi_format vgi_format_obj, vgi_format_ply, vgi_format_ply_ascii, vgi_format_ply_be, vgi_format_off,
    vgi_format_stl, vgi_format_stl_ascii;
/* obj.c: read an OBJ file as the format's read does, but without the note about objects as frames */
int vgi_obj_read(vg_model *m, const char *data, size_t n, const char *subject, vg_err *e) VG_MUST_CHECK;
/* objects.c: number of objects if the file consists of objects of one topology, else 0; whether they are numbered
 * like frames */
size_t vgi_obj_frames(const vg_model *m);
bool vgi_obj_numbered(const vg_model *m, size_t frames);
/* obj_write.c, ply_write.c: used by the tables in obj.c and ply.c */
int vgi_obj_write(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_obj_rest(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_ply_write_little(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_ply_write_text(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_ply_write_big(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_ply_rest_little(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_ply_rest_text(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_ply_rest_big(vg_bytes *out, const vgi_writing *w, vg_err *e);
const vgi_format *vgi_format_by_name(const char *name, size_t n);     /* NULL if unknown */
const vgi_format *vgi_format_by_suffix(const char *file_name);        /* case-insensitive; NULL if unknown */
const vgi_format *vgi_format_by_content(const unsigned char *data, size_t n);
const char *vgi_format_names(void); /* "obj, ply, ..." for messages */
/* vgi_model_read: vg_model_read for a file whose name in messages is `subject` (with quotes). format NULL:
 * detected from content, then from file_name. */
int vgi_model_read(vg_model *m, const void *data, size_t n, const vgi_format *format, const char *file_name,
                   const char *subject, vg_err *e) VG_MUST_CHECK;

/* sequence.c: the table of formats whose file holds a sequence; caches.c npy.c bvh.c ...: one format each */

/* An output file: bytes are buffered and written to a regular file from byte 0 on. Totals in a header are patched
 * in at the end. */
typedef struct vgi_output {
    int fd;
    const char *name; /* its name in messages; borrowed */
    vg_bytes waiting;
    uint64_t size;    /* number of bytes put */
} vgi_output;
int vgi_output_put(vgi_output *o, const void *data, size_t n, vg_err *e) VG_MUST_CHECK;
/* of bytes already put */
int vgi_output_patch(vgi_output *o, uint64_t off, const void *data, size_t n, vg_err *e) VG_MUST_CHECK;
int vgi_output_flush(vgi_output *o, vg_err *e) VG_MUST_CHECK;
enum { VGI_USES_AXES = 1, VGI_USES_OBJECTS = 2, VGI_USES_GLTF = 4 }; /* GLTF: animation, shapes, unwelded */

/* the first n bytes of a regular file */
int vgi_output_copy(vgi_output *o, int fd, uint64_t n, vg_err *e) VG_MUST_CHECK;
void vgi_output_clear(vgi_output *o);

typedef struct vgi_sequence_format {
    const char *name, *suffix;
    unsigned keeps;
    bool bare; /* read a file without faces as points */
    unsigned uses; /* the options of vg_reading that it has a use for */
    /* from the first 4096 bytes, or all; NULL: recognised by the name alone */
    bool (*sniff)(const unsigned char *data, size_t n);

    /* Reading. Memory grows only as bytes arrive, whatever the file claims: open reads the first frame before it
     * accepts a count. open: fill h, which is empty: kind, count, mesh.nv; and what the file states of faces,
     * attributes, skeleton, reference, reference_name. Without faces, they come from a file beside it. Without a
     * reference, it comes from there, or is the first pose. The caller checks the mesh. in is borrowed until close,
     * how for the call; subject is the name of the file in messages, including quotes, also borrowed. next: 1 with
     * the values of a shaped frame, its time, and its name (empty: it is named after the file); 0 once the file has
     * been read completely, with nothing after it. close releases what open allocated, also if open failed; it
     * accepts NULL. */
    int (*open)(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject,
                vg_err *e); /* NULL: cannot be read */
    int (*next)(void *state, vg_frame *f, vg_err *e);
    /* join (may be NULL): for a file that refers to joints by name. Called once before next with the skeleton (there
     * is one) and reference of the frames; open then does not set the mesh. `with` is borrowed for the call only. */
    int (*join)(void *state, const vg_head *with, vg_err *e);
    /* the number of frames that the file states; a single frame is named after the file. NULL: unknown */
    uint64_t (*frames)(const void *state);
    /* note (may be NULL): what open dropped or repaired, in one line; empty: nothing. */
    const char *(*note)(const void *state);
    void (*close)(void *state);

    /* Writing. kinds: the kinds of frames, 1 << VG_VERTICES and so on. h, o and out are borrowed until release. check
     * (may be NULL): whether this head can be written. end is called only after at least one put; the caller flushes.
     * warning (may be NULL): what was lost, after end; a text owned by the state, or NULL. */
    unsigned kinds;
    int (*check)(const vg_head *h, const char *output, vg_err *e);
    /* NULL: cannot be written */
    int (*begin)(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e);
    int (*put)(void *state, const vg_frame *f, vg_err *e);
    int (*end)(void *state, vg_err *e);
    const char *(*warning)(void *state);
    /* report (may be NULL): what was written, after end, in that state; *inexact: values were mixed or rounded beyond
     * binary32. */
    const char *(*report)(void *state, bool *inexact);
    void (*release)(void *state);
} vgi_sequence_format;

extern const vgi_sequence_format vgi_sequence_pc2, vgi_sequence_mdd, vgi_sequence_npy, vgi_sequence_npz,
    vgi_sequence_usda, vgi_sequence_bvh, vgi_sequence_glb, vgi_sequence_gltf, vgi_sequence_skeleton,
    vgi_sequence_joints;
extern const vgi_sequence_format vgi_sequence_objects; /* used on request only: not in the table */
const vgi_sequence_format *vgi_sequence_by_name(const char *name, size_t n);   /* NULL if unknown */
const vgi_sequence_format *vgi_sequence_by_suffix(const char *file_name);      /* case-insensitive; NULL if unknown */
const vgi_sequence_format *vgi_sequence_by_content(const unsigned char *data, size_t n);
/* vgi_packable: the sequence format of a file that can be a pose in a directory or archive, because it has faces;
 * otherwise NULL. */
const vgi_sequence_format *vgi_packable(const char *file_name);
const char *vgi_sequence_names(void); /* "pc2, mdd, ..." for messages: those that can be written */
const char *vgi_kinds_read(void); /* "OBJ, PLY, ...": all except streams and archives */

/* vgi_model_write: vg_model_write with a shape, which is not checked. */
int vgi_model_write(vg_bytes *out, const char *format, const vgi_writing *w, vg_err *e) VG_MUST_CHECK;

/* ---- names.c, operands.c: lists of names and their order; names of poses ---- */

typedef struct vgi_names {
    size_t n, cap;
    char **at;
} vgi_names;
void vgi_names_clear(vgi_names *names);
int vgi_names_add(vgi_names *names, const char *s, size_t n, vg_err *e) VG_MUST_CHECK;
void vgi_names_sort(vgi_names *names); /* in natural order */

/* A set of names. */
typedef struct vgi_name_set {
    vgi_names names;
    size_t *slots, nslots; /* hash table: positions in names + 1, 0 = free; nslots is a power of two */
} vgi_name_set;
/* vgi_name_set_add: 1 if it is new; 0 if the set contains it. */
int vgi_name_set_add(vgi_name_set *set, const char *name, vg_err *e) VG_MUST_CHECK;
/* vgi_name_set_place: its index in order of first use; adds it if it is new. */
int vgi_name_set_place(vgi_name_set *set, const char *name, size_t *at, vg_err *e) VG_MUST_CHECK;
void vgi_name_set_clear(vgi_name_set *set);

/* vgi_natural_compare: natural order: numbers by value, with decimals and negative numbers, other characters by
 * byte; ties by strcmp. */
int vgi_natural_compare(const char *a, const char *b);
/* vgi_to_utf8: n bytes of text as UTF-8: unchanged if valid, else read as Latin-1, which most old files use, with
 * '?' for zero bytes. Caller frees it. */
char *vgi_to_utf8(const char *s, size_t n, vg_err *e);
const char *vgi_base_name(const char *path); /* the part after the last '/' */
/* suffix of the first n bytes, preceded by something; case-insensitive */
bool vgi_has_suffix(const char *name, size_t n, const char *suffix);
/* length of name without ".gz" or another suffix of one compressed file */
size_t vgi_packed_stem(const char *name);
/* vgi_pose_name: the name of a pose from this file: "pose1" for "dir/pose1.obj.gz". Valid UTF-8; caller frees it;
 * NULL: out of memory. */
char *vgi_pose_name(const char *path, vg_err *e);

/* vgi_operand_files: add the files that an operand names: the file itself, the mesh files of a directory, or the
 * files that match a pattern. */
int vgi_operand_files(vgi_names *paths, const char *operand, vg_err *e) VG_MUST_CHECK;
/* vgi_directory_poses: add the paths of the files in a directory that hold one pose each, sorted. */
int vgi_directory_poses(vgi_names *paths, const char *path, vg_err *e) VG_MUST_CHECK;

/* archive.c, pack.c: read and write archives; with unpack.c, the files that use libarchive */

/* The mesh files of an archive, or a single compressed file, in natural order. */
typedef struct vgi_archive vgi_archive;
/* vgi_is_archive: whether data starts like an archive or a compressed file (first 4096 bytes, or all). */
bool vgi_is_archive(const unsigned char *data, size_t n);
/* vgi_may_be_archive: whether libarchive might read it as one of the rarer formats. For data that no other format
 * claims. */
bool vgi_may_be_archive(const unsigned char *data, size_t n);
int vgi_unknown_kind(const char *name, vg_err *e); /* the error for data of unknown format */
/* vgi_archive_open: list the files. fd is a regular file, read from byte `base` on; takes ownership of fd, also on
 * failure. Messages call the archive `name`. VG_EINPUT if it contains no mesh file. */
int vgi_archive_open(vgi_archive **a, int fd, int64_t base, const char *name, const vgi_limits *limits,
                     vg_err *e) VG_MUST_CHECK;
/* vgi_archive_open_for: the same for the members whose path `wanted` selects. */
int vgi_archive_open_for(vgi_archive **a, int fd, int64_t base, const char *name, bool (*wanted)(const char *path),
                         const vgi_limits *limits, vg_err *e) VG_MUST_CHECK;
/* vgi_archive_next: 1 with path (borrowed until the next call) and contents of the next file; 0 after the last
 * one. */
int vgi_archive_next(vgi_archive *a, const char **path, vg_bytes *data, vg_err *e) VG_MUST_CHECK;
void vgi_archive_close(vgi_archive **a);
/* vgi_unpack_stream: 1 if the file, read from byte `base` on, is a compressed stream: it is unpacked into an
 * unnamed file, *stream, at its start; 0 if it is anything else. fd is borrowed. */
int vgi_unpack_stream(int fd, int64_t base, const char *name, const vgi_limits *limits, int *stream,
                      vg_err *e) VG_MUST_CHECK;
/* Writing. The bytes depend only on names and contents. */
typedef struct vgi_packer vgi_packer;
bool vgi_packer_knows(const char *name, size_t n); /* whether it is a suffix of an archive that can be written */
const char *vgi_packer_suffixes(void);             /* ".zip .tar ..." for messages */
/* vgi_packer_open: the suffix of the first n bytes of `name` selects the kind of archive; messages use this name. fd is
 * borrowed. */
int vgi_packer_open(vgi_packer **p, int fd, const char *name, size_t n, vg_err *e) VG_MUST_CHECK;
/* vgi_packer_open_plain: a zip with uncompressed members, whatever its name. */
int vgi_packer_open_plain(vgi_packer **p, int fd, const char *name, vg_err *e) VG_MUST_CHECK;
int vgi_packer_add(vgi_packer *p, const char *path, const void *data, size_t n, vg_err *e) VG_MUST_CHECK;
/* Write a file in pieces: begin with its size, more until that is reached, finish. */
int vgi_packer_begin(vgi_packer *p, const char *path, uint64_t n, vg_err *e) VG_MUST_CHECK;
int vgi_packer_more(vgi_packer *p, const void *data, size_t n, vg_err *e) VG_MUST_CHECK;
int vgi_packer_finish(vgi_packer *p, vg_err *e) VG_MUST_CHECK;
int vgi_packer_end(vgi_packer *p, vg_err *e) VG_MUST_CHECK;
void vgi_packer_close(vgi_packer **p);

#endif
