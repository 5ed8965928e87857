/* io.h: what the files of lib/io share: bytes in, numbers as text, the table of mesh formats, archives.
 * Internal; what a C program may call is in vg.h.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_IO_H
#define VG_IO_H

#include "core/core.h"

/* ---- input.c: bytes from a descriptor or from memory, with a look ahead ---- */

typedef struct vgi_input vgi_input;
/* own: close it in the end */
int vgi_input_fd(vgi_input **in, int fd, bool own, const char *name, vg_err *e) VG_MUST_CHECK;
/* data is borrowed */
int vgi_input_memory(vgi_input **in, const void *data, size_t n, const char *name, vg_err *e) VG_MUST_CHECK;
/* vgi_input_file: open a file for reading; VG_ESYS naming it when it cannot be. */
int vgi_input_file(vgi_input **in, const char *path, vg_err *e) VG_MUST_CHECK;
void vgi_input_free(vgi_input **in);
const char *vgi_input_name(const vgi_input *in);
const char *vgi_input_path(const vgi_input *in); /* of the file it was opened from; NULL: it is none */
/* vgi_input_peek: the next bytes without taking them, up to n <= 4096; *got is less only at the end of input. */
int vgi_input_peek(vgi_input *in, size_t n, const unsigned char **data, size_t *got, vg_err *e) VG_MUST_CHECK;
/* vgi_input_ended: 1 when nothing is left, 0 when something is, negative when it cannot be read. */
int vgi_input_ended(vgi_input *in, vg_err *e) VG_MUST_CHECK;
/* vgi_input_read: exactly n bytes; VG_ETRUNC when the input ends before. *got (may be NULL): how many came. */
int vgi_input_read(vgi_input *in, void *to, size_t n, size_t *got, vg_err *e) VG_MUST_CHECK;
/* vgi_input_take: append exactly n bytes to b, which grows as they arrive (a false n costs no memory). */
int vgi_input_take(vgi_input *in, vg_bytes *b, size_t n, size_t *got, vg_err *e) VG_MUST_CHECK;
/* What an input may hold, so that a small file cannot fill a machine, nor a pipe that never ends. */
typedef struct vgi_limits {
    uint64_t member_bytes, total_bytes; /* unpacked, of an archive; an input that is no regular file as a whole may be
                                           slurped up to the first and spooled up to the second */
    size_t members;                     /* entries of any kind */
} vgi_limits;
extern const vgi_limits vgi_usual_limits;
void vgi_input_limit(vgi_input *in, const vgi_limits *limits); /* else the usual ones */
const vgi_limits *vgi_input_limits(const vgi_input *in);
/* vgi_input_slurp: append all that is left. */
int vgi_input_slurp(vgi_input *in, vg_bytes *b, vg_err *e) VG_MUST_CHECK;
/* vg_reader over an input; the reader takes the input over, also when it fails. */
int vgi_reader_open_input(vg_reader **r, vgi_input *in, vg_err *e) VG_MUST_CHECK;
/* Does data start like a stream? */
bool vgi_is_stream(const unsigned char *data, size_t n);

/* vgi_nameless_file: a new file without a name in $TMPDIR (or /tmp), for reading and writing; its descriptor. */
int vgi_nameless_file(vg_err *e) VG_MUST_CHECK;
/* vgi_read_back: n bytes of such a file, from off on; VG_ESYS when they are not to be had. */
int vgi_read_back(int fd, uint64_t off, void *to, size_t n, vg_err *e) VG_MUST_CHECK;
/* vgi_input_spool: copy what is left of an input that can be read only once into a file without a name. */
int vgi_input_spool(vgi_input *in, int *fd, vg_err *e) VG_MUST_CHECK;
/* vgi_write_all: write n bytes to fd, whatever the interruptions; VG_ESYS naming `name`. */
int vgi_write_all(int fd, const void *data, size_t n, const char *name, vg_err *e) VG_MUST_CHECK;

/* ---- number.c: numbers as text, whatever the locale ---- */

/* vgi_parse_double: the number at the start of [s, end): decimal, exponent, sign; "nan" and "inf" are read as such.
 * The result is correctly rounded. Returns the first byte behind it, or NULL when there is none. */
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

/* vgi_plain_text: step over the mark of UTF-8; text in UTF-16 is converted into `own`, which is empty, and *data points
 * there. Anything else stays as it is. A part of a file is treated as the whole would be. */
int vgi_plain_text(vg_bytes *own, const unsigned char **data, size_t *n, vg_err *e) VG_MUST_CHECK;
/* vgi_input_slurp_text: all that is left, of a text, as plain UTF-8. */
int vgi_input_slurp_text(vgi_input *in, vg_bytes *b, vg_err *e) VG_MUST_CHECK;
size_t vgi_mark_bytes(const void *data, size_t n); /* of the mark of UTF-8 in front; 0: there is none */
int vgi_append_letter(vg_bytes *to, uint32_t letter, vg_err *e) VG_MUST_CHECK; /* as UTF-8 */

/* ---- mend.c: what a reader left out or put right ---- */

void vgi_note(vg_note *to, const char *format, ...) VG_PRINTF(2, 3); /* add to the line */
void vgi_note_dropped(vg_note *to, size_t faces);                    /* as vgi_mend_faces says it */
/* vgi_mend_faces: vg_mesh_check, but faces that name a vertex twice or have fewer than 2 corners are left out, shortened
 * or cut until the mesh is valid. points: of its vertices; a (may be NULL): its labels and corner_tex move along. */
int vgi_mend_faces(vg_mesh *m, const double *points, vg_attributes *a, vg_note *notes, const char *subject,
                   vg_err *e) VG_MUST_CHECK;

/* ---- lines.c: text of fields between blanks, a thing per line; '#' in front of a field begins a comment ---- */

enum { VGI_FIELDS = 8, VGI_SUBJECT = 300 };

typedef struct vgi_field {
    const char *begin, *end;
} vgi_field;

typedef struct vgi_line {
    size_t number, n; /* of the line, from 1; of its fields, of which no more than VGI_FIELDS are kept */
    vgi_field at[VGI_FIELDS];
    const char *begin, *end; /* the whole line, comment included */
} vgi_line;

typedef struct vgi_lines {
    const char *at, *end;
    size_t number;       /* of the last line taken */
    const char *subject; /* how messages call the text, quotes included; borrowed */
} vgi_lines;

vgi_lines vgi_lines_of(const void *data, size_t n, const char *subject);
/* vgi_quote: how messages call a file of this name; in `subject`. */
const char *vgi_quote(const char *name, char subject[VGI_SUBJECT]);
/* vgi_lines_next: the next line that says something; false at the end. Blanks are space, tab, CR,
 * comma and semicolon. */
bool vgi_lines_next(vgi_lines *t, vgi_line *l);
/* vgi_line_more: the next field at or behind *at, which goes on behind it; for lines of any number of fields. */
bool vgi_line_more(const vgi_line *l, const char **at, vgi_field *f);
bool vgi_field_is(const vgi_field *f, const char *word);
bool vgi_field_number(const vgi_field *f, double *x); /* is it one, and finite? */
/* A field as what it has to be, or VG_EINPUT naming the line. vertex: `base` is the number of the first one. */
int vgi_field_vertex(const vgi_lines *t, const vgi_line *l, const vgi_field *f, int base, uint32_t *vertex,
                     vg_err *e) VG_MUST_CHECK;
int vgi_line_vertex(const vgi_lines *t, const vgi_line *l, size_t field, int base, uint32_t *vertex,
                    vg_err *e) VG_MUST_CHECK;
int vgi_line_number(const vgi_lines *t, const vgi_line *l, size_t field, double *x, vg_err *e) VG_MUST_CHECK;
/* free it */
int vgi_line_name(const vgi_lines *t, const vgi_line *l, size_t field, char **name, vg_err *e) VG_MUST_CHECK;

/* ---- format.c: the table of mesh formats; obj.c ply.c off.c stl.c: one each ---- */

enum { /* what a format keeps of a sequence beside its numbers; of what it does not, the program warns */
    VGI_KEEPS_FACES = 1,    /* which are split into triangles without VGI_KEEPS_POLYGONS */
    VGI_KEEPS_POLYGONS = 2,
    VGI_KEEPS_ORDER = 4,    /* vertices keep their numbers, those in no face too */
    VGI_KEEPS_TEXTURE = 8,
    VGI_KEEPS_LABELS = 16,
    VGI_KEEPS_NAMES = 32,   /* of frames */
    VGI_KEEPS_TIMES = 64,   /* of frames, any; a format that keeps only some says so in warning() */
    VGI_KEEPS_SKELETON = 128,
    VGI_KEEPS_DOUBLES = 256, /* when full precision is asked for, which is refused otherwise */
    VGI_KEEPS_ASSET = 512    /* materials, normals, skins; a format that keeps only some says so in warning() */
};

typedef struct vgi_writing {
    const vg_mesh *mesh;
    const double *vertices;
    const double *shape; /* a pose by which polygons are split, where they must be: the same for all poses of a
                            sequence */
    const vg_attributes *attributes; /* may be NULL */
    bool full_precision;
    const vg_patches *patches; /* may be NULL: a colour for each face, where the format has them */
    const vg_bytes *rest;      /* what the format's `rest` gives for this sequence, made before; NULL: it is made */
} vgi_writing;

typedef struct vgi_format {
    const char *name;   /* what --format and NAME:format call it */
    const char *suffix; /* ".obj" */
    bool (*sniff)(const unsigned char *data, size_t n); /* does it start like one? (first 4096 bytes or all) */
    /* read: fill *m, which is empty, from the whole file; on failure the caller clears it. `subject` is how messages
     * call the file, quotes included: "'a.obj'" or "'b.obj' in 'a.zip'"; they add the line. The faces
     * are checked by the caller with vgi_mend_faces; NaN and Inf are refused here. What is not used cannot stop it: it
     * goes into m->note. */
    int (*read)(vg_model *m, const char *data, size_t n, const char *subject, vg_err *e);
    /* write: append a file, up to what is the same for all poses of a sequence; rest: append that. NULL: nothing is. */
    int (*write)(vg_bytes *out, const vgi_writing *w, vg_err *e);
    int (*rest)(vg_bytes *out, const vgi_writing *w, vg_err *e);
    unsigned keeps; /* VGI_KEEPS_... */
} vgi_format;

extern const vgi_format vgi_format_obj, vgi_format_ply, vgi_format_ply_ascii, vgi_format_ply_be, vgi_format_off,
    vgi_format_stl, vgi_format_stl_ascii;
/* obj_write.c, ply_write.c: for the tables in obj.c and ply.c */
int vgi_obj_write(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_obj_rest(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_ply_write_little(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_ply_write_text(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_ply_write_big(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_ply_rest_little(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_ply_rest_text(vg_bytes *out, const vgi_writing *w, vg_err *e);
int vgi_ply_rest_big(vg_bytes *out, const vgi_writing *w, vg_err *e);
const vgi_format *vgi_format_by_name(const char *name, size_t n);     /* NULL: none */
const vgi_format *vgi_format_by_suffix(const char *file_name);        /* case does not matter; NULL: none */
const vgi_format *vgi_format_by_content(const unsigned char *data, size_t n);
const char *vgi_format_names(void); /* "obj, ply, ..." for messages */
/* vgi_model_read: vg_model_read for a file that messages call `subject` (quotes included). format NULL: told by
 * content, then by file_name. */
int vgi_model_read(vg_model *m, const void *data, size_t n, const vgi_format *format, const char *file_name,
                   const char *subject, vg_err *e) VG_MUST_CHECK;

/* ---- sequence.c: the table of formats whose one file holds a sequence; caches.c npy.c bvh.c ...: each one ---- */

/* The bytes of a file that is being made: collected, and written from byte 0 on of a regular file. What a header says
 * of the whole is set at last, by patching. */
typedef struct vgi_output {
    int fd;
    const char *name; /* what messages call it, borrowed */
    vg_bytes waiting;
    uint64_t size;    /* of all that was put */
} vgi_output;
int vgi_output_put(vgi_output *o, const void *data, size_t n, vg_err *e) VG_MUST_CHECK;
/* of what was put */
int vgi_output_patch(vgi_output *o, uint64_t off, const void *data, size_t n, vg_err *e) VG_MUST_CHECK;
int vgi_output_flush(vgi_output *o, vg_err *e) VG_MUST_CHECK;
/* the first n bytes of a regular file */
int vgi_output_copy(vgi_output *o, int fd, uint64_t n, vg_err *e) VG_MUST_CHECK;
void vgi_output_clear(vgi_output *o);

typedef struct vgi_sequence_format {
    const char *name, *suffix;
    unsigned keeps;
    bool bare; /* a file without faces is read all the same, as points */
    /* the first 4096 bytes or all; NULL: nothing tells it but its name */
    bool (*sniff)(const unsigned char *data, size_t n);

    /* Reading. Whatever the file says, memory grows only as bytes arrive: open has the first frame at hand before it
     * gives a count. open: fill h, which is empty: kind, count, mesh.nv; what the file knows of faces, attributes,
     * skeleton, reference, reference_name. No faces: they come from beside. No reference: it is the one from there,
     * or the first pose. The caller checks the mesh. in is borrowed until close, how for the call; subject is how
     * messages call the file, quotes included, borrowed too. next: 1 and values of a frame that has been shaped, its time, and its name
     * (left empty, it is called after the file); 0 when the file is read to its end, nothing behind it. close takes
     * what open made, also when open failed, and NULL. */
    int (*open)(void **state, vg_head *h, vgi_input *in, const vg_reading *how, const char *subject,
                vg_err *e); /* NULL: only written */
    int (*next)(void *state, vg_frame *f, vg_err *e);
    /* join (else NULL): for a file that says by name which joint is meant. Called once before next with the skeleton
     * (there is one) and reference that the frames are of; open then says nothing of the mesh.
     * `with` is borrowed for the call only. */
    int (*join)(void *state, const vg_head *with, vg_err *e);
    /* how many the file announces; a single one is called like the file. NULL: unknown */
    uint64_t (*frames)(const void *state);
    /* note (may be NULL): what open left out or put right, one line, empty when it was nothing. */
    const char *(*note)(const void *state);
    void (*close)(void *state);

    /* Writing. kinds: which kinds of frames, 1 << VG_VERTICES and so on. h, o and out are borrowed until release.
     * check (may be NULL): can this head be written? end comes only after at least one put; the caller flushes.
     * warning (may be NULL): what was lost, after end; a text that lives in the state, or NULL. */
    unsigned kinds;
    int (*check)(const vg_head *h, const char *output, vg_err *e);
    /* NULL: only read */
    int (*begin)(void **state, const vg_head *h, const vg_sink_options *o, vgi_output *out, vg_err *e);
    int (*put)(void *state, const vg_frame *f, vg_err *e);
    int (*end)(void *state, vg_err *e);
    const char *(*warning)(void *state);
    void (*release)(void *state);
} vgi_sequence_format;

extern const vgi_sequence_format vgi_sequence_pc2, vgi_sequence_mdd, vgi_sequence_npy, vgi_sequence_npz,
    vgi_sequence_usda, vgi_sequence_bvh, vgi_sequence_glb, vgi_sequence_gltf, vgi_sequence_skeleton,
    vgi_sequence_joints;
const vgi_sequence_format *vgi_sequence_by_name(const char *name, size_t n);   /* NULL: none */
const vgi_sequence_format *vgi_sequence_by_suffix(const char *file_name);      /* case does not matter; NULL: none */
const vgi_sequence_format *vgi_sequence_by_content(const unsigned char *data, size_t n);
/* vgi_packable: the sequence format, or NULL, of a file that can stand for poses in a directory or archive:
 * it brings its faces. */
const vgi_sequence_format *vgi_packable(const char *file_name);
const char *vgi_sequence_names(void); /* "pc2, mdd, ..." for messages, those that are written */
const char *vgi_kinds_read(void); /* "OBJ, PLY, ..." for messages: all that is read, but for streams and archives */

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

/* Names each of which is there once. */
typedef struct vgi_name_set {
    vgi_names names;
    size_t *slots, nslots; /* hash table: positions in names + 1, 0 = free; nslots is a power of two */
} vgi_name_set;
/* vgi_name_set_add: 1: it is new; 0: it was there. */
int vgi_name_set_add(vgi_name_set *set, const char *name, vg_err *e) VG_MUST_CHECK;
/* vgi_name_set_place: which one it is, in the order in which they came; it is added when it is new. */
int vgi_name_set_place(vgi_name_set *set, const char *name, size_t *at, vg_err *e) VG_MUST_CHECK;
void vgi_name_set_clear(vgi_name_set *set);

/* vgi_natural_compare: order of names as people expect it: numbers by value, decimals and negative ones too, the rest by
 * byte; ties by strcmp. */
int vgi_natural_compare(const char *a, const char *b);
/* vgi_to_utf8: n bytes of text as UTF-8: as they are, or else each taken for the letter that it is in Latin-1, which
 * most old files are in, and a zero byte for '?'. Free it. */
char *vgi_to_utf8(const char *s, size_t n, vg_err *e);
const char *vgi_base_name(const char *path); /* behind the last '/' */
/* of the first n bytes, with something before it; any case */
bool vgi_has_suffix(const char *name, size_t n, const char *suffix);
/* length of name without ".gz" or another suffix of one compressed file */
size_t vgi_packed_stem(const char *name);
/* vgi_pose_name: what a pose from this file is called: "dir/pose1.obj.gz" is "pose1". Valid UTF-8; free it; NULL: no
 * memory. */
char *vgi_pose_name(const char *path, vg_err *e);

/* vgi_operand_files: add the files that an operand names: itself, the mesh files of a directory, or those that match
 * a pattern. */
int vgi_operand_files(vgi_names *paths, const char *operand, vg_err *e) VG_MUST_CHECK;
/* vgi_directory_poses: add the paths of the files in a directory that hold one pose each, sorted. */
int vgi_directory_poses(vgi_names *paths, const char *path, vg_err *e) VG_MUST_CHECK;

/* ---- archive.c, pack.c: files out of archives and into them; with unpack.c, the files that know libarchive ---- */

/* The mesh files of an archive, or the single one that was compressed without an archive, in natural order. */
typedef struct vgi_archive vgi_archive;
/* vgi_is_archive: does data start like an archive or a compressed file? (first 4096 bytes or all) */
bool vgi_is_archive(const unsigned char *data, size_t n);
/* vgi_may_be_archive: could libarchive take it for one of the rarer kinds, too? Of what nothing else claims. */
bool vgi_may_be_archive(const unsigned char *data, size_t n);
int vgi_unknown_kind(const char *name, vg_err *e); /* the failure of what is nothing that is known */
/* vgi_archive_open: list what is there. fd is a regular file that is read from byte `base` on; it is taken over, also
 * on failure. name is what messages call the archive. VG_EINPUT when there is no mesh file in it. */
int vgi_archive_open(vgi_archive **a, int fd, int64_t base, const char *name, const vgi_limits *limits,
                     vg_err *e) VG_MUST_CHECK;
/* vgi_archive_open_for: the same for those members whose path is wanted. */
int vgi_archive_open_for(vgi_archive **a, int fd, int64_t base, const char *name, bool (*wanted)(const char *path),
                         const vgi_limits *limits, vg_err *e) VG_MUST_CHECK;
/* vgi_archive_next: 1, path (borrowed until the next call) and contents of the next file; 0 behind the last one. */
int vgi_archive_next(vgi_archive *a, const char **path, vg_bytes *data, vg_err *e) VG_MUST_CHECK;
void vgi_archive_close(vgi_archive **a);
/* vgi_unpack_stream: 1 when the file, read from byte `base` on, is a stream that was compressed without an archive:
 * unpacked whole into a file without a name, *stream, at its start; 0 when it is something else. fd is borrowed. */
int vgi_unpack_stream(int fd, int64_t base, const char *name, const vgi_limits *limits, int *stream,
                      vg_err *e) VG_MUST_CHECK;
/* Writing. The bytes depend on names and contents only. */
typedef struct vgi_packer vgi_packer;
bool vgi_packer_knows(const char *name, size_t n); /* do the first n bytes of name end like an archive we write? */
const char *vgi_packer_suffixes(void);             /* ".zip .tar ..." for messages */
/* vgi_packer_open: the suffix of the first n bytes of `name` selects the kind of archive; messages use this name. fd is
 * borrowed. */
int vgi_packer_open(vgi_packer **p, int fd, const char *name, size_t n, vg_err *e) VG_MUST_CHECK;
/* vgi_packer_open_plain: a zip whose members are stored as they are, whatever its name. */
int vgi_packer_open_plain(vgi_packer **p, int fd, const char *name, vg_err *e) VG_MUST_CHECK;
int vgi_packer_add(vgi_packer *p, const char *path, const void *data, size_t n, vg_err *e) VG_MUST_CHECK;
/* A file in pieces: begin with its size, more until that is reached, finish. */
int vgi_packer_begin(vgi_packer *p, const char *path, uint64_t n, vg_err *e) VG_MUST_CHECK;
int vgi_packer_more(vgi_packer *p, const void *data, size_t n, vg_err *e) VG_MUST_CHECK;
int vgi_packer_finish(vgi_packer *p, vg_err *e) VG_MUST_CHECK;
int vgi_packer_end(vgi_packer *p, vg_err *e) VG_MUST_CHECK;
void vgi_packer_close(vgi_packer **p);

#endif
