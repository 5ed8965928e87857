/* gltf_write.h: a glTF file being written; shared by gltf_write.c, gltf_faces.c, gltf_morph.c, gltf_cast.c and
 * gltf_skin.c. gltf_write.c writes the file; a mesh moves in it in one of two manners.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_GLTF_WRITE_H
#define VG_GLTF_WRITE_H

#include "io/gltf.h"
#include "io/gltf_character.h"
#include "io/gltf_normals.h"
#include "io/gltf_quantize.h"
#include "io/gltf_seams.h"
#include "io/gltf_whole.h"

enum { VGI_GLTF_ITEM = 4, VGI_GLTF_POINT = 12 }; /* bytes of a number, and of three */

/* ---- gltf_faces.c: faces as triangles and lines ---- */
typedef struct vgi_gltf_run { /* faces of one material */
    size_t triangles, lines;  /* bytes of indices before this run */
    const char *material;     /* its name; NULL: none */
} vgi_gltf_run;

enum { VGI_GLTF_MOST_RUNS = 256 };

typedef struct vgi_gltf_shape {
    vg_bytes triangles, lines; /* indices of 32 bits */
    size_t nruns, runs_cap;
    vgi_gltf_run *run;         /* nruns, plus an end marker */
    vg_bytes runs;             /* for VGI_GLTF_FACES: count, size, count, size, ... as text */
} vgi_gltf_shape;
/* vgi_gltf_shape_make: a (may be NULL): its labels give the materials; more than VGI_GLTF_MOST_RUNS runs become
 * one. */
int vgi_gltf_shape_make(vgi_gltf_shape *s, const vg_mesh *m, const double *reference, const vg_attributes *a,
                        vg_err *e) VG_MUST_CHECK;
void vgi_gltf_shape_clear(vgi_gltf_shape *s);

/* ---- gltf_write.c ---- */
typedef struct vgi_gltf_writing vgi_gltf_writing;

/* How the mesh moves. begin allocates `own` before the first frame; put stores a frame in the spool. describe is
 * called once all frames are stored, after the views and accessors of faces and times: it adds its own, and writes
 * scene, nodes, meshes and animation. emit writes the bytes of its views, in order. warning (may be NULL) reports
 * lost; report how exact the file is, true: not to binary32. release takes own, NULL too. */
typedef struct vgi_gltf_manner {
    int (*begin)(vgi_gltf_writing *w, const vg_sink_options *o, vg_err *e);
    int (*put)(vgi_gltf_writing *w, const vg_frame *f, vg_err *e);
    int (*describe)(vgi_gltf_writing *w, vg_err *e);
    int (*emit)(vgi_gltf_writing *w, vg_err *e);
    void (*warning)(const vgi_gltf_writing *w, char *to, size_t room);
    bool (*report)(const vgi_gltf_writing *w, char *to, size_t room);
    void (*release)(void *own);
    const char *too_big; /* advice for the message */
    bool splits;         /* several animations are possible */
} vgi_gltf_manner;
extern const vgi_gltf_manner vgi_gltf_by_morphs, vgi_gltf_by_skin;

typedef struct vgi_gltf_take {
    size_t first, count;  /* frames */
    size_t stem;          /* length of the common prefix of the names; 0: none */
    bool timed;           /* they have times valid for an animation */
    size_t moments;       /* number of their accessor */
} vgi_gltf_take;

struct vgi_gltf_writing {
    const vgi_gltf_manner *manner;
    void *own;                 /* of the manner */
    vgi_output *out, spool;    /* spool: stored frames, in an unnamed file */
    const vg_head *h;
    bool binary;
    bool shapes;               /* no animation is wanted */
    bool still;                /* none is written */
    const char *clip;          /* name of the animation; NULL: from the frames */
    size_t frames;
    vgi_names names;
    double *times;             /* NaN: none */
    size_t times_cap;
    vgi_gltf_take *takes;      /* at the end: frames 0 to frames - 1, divided into animations */
    size_t ntakes;
    bool times_lost;
    vgi_gltf_character *character; /* its nodes, materials and attributes are written; NULL: none */
    bool quantized;
    vgi_gltf_whole *whole;     /* the character's own animations or shapes, as long as they may be those of the frames; or NULL */
    bool as_it_was;            /* known at the end: its whole document is written; with whole alone, its animations */
    vg_bytes asset;            /* what of its bytes is written */
    vgi_gltf library;          /* of materials, without meshes; json NULL: none */
    vgi_name_set materials;    /* names of those written */
    vgi_gltf_seams seams;      /* vertices of the file */
    vgi_gltf_normals normals;  /* n == 0: none, or those of the character */
    float *base;               /* the reference pose as it will be read back, seams.n points */
    vgi_gltf_shape shape;
    vg_bytes json, views, accessors; /* text */
    size_t nviews, naccessors, bytes;
    size_t triangles, lines, texture, colours; /* numbers of their accessors; empty ones have none */
    unsigned char carry[3];    /* base64: bytes of an incomplete group of three */
    size_t ncarry;
    char warning[400], report[200];
};

/* How the three numbers of a point lie in the file: binary32, or normalised whole numbers of 16 or 8 bits. */
typedef enum vgi_gltf_numbers { VGI_GLTF_FLOATS, VGI_GLTF_SHORTS, VGI_GLTF_BYTES, VGI_GLTF_KINDS } vgi_gltf_numbers;
typedef struct vgi_gltf_kind {
    int component;
    size_t bytes, stride; /* of a point, and with what fills it up to a multiple of 4 */
} vgi_gltf_kind;
static const vgi_gltf_kind vgi_gltf_kinds[VGI_GLTF_KINDS] = {{VGI_GLTF_FLOAT, 12, 12}, {VGI_GLTF_SHORT, 6, 8}, {VGI_GLTF_BYTE, 3, 4}};

/* Vertices of the file that a primitive of a mesh refers to. */
typedef struct vgi_gltf_list {
    size_t first, count;
    bool normals, tangents; /* tangents: morph targets have some */
    size_t position, normal; /* their accessors */
    const vgi_gltf_grid *grid; /* its positions are whole numbers; NULL: they are binary32 */
} vgi_gltf_list;

/* ---- gltf_cast.c: the nodes, meshes and materials of a character ---- */
/* vgi_gltf_say_cast: write all members of the file that the writer does not generate. A list for each part of the
 * character's scene; target: the accessor of the positions of morph target t of list l, followed by that of its
 * morph targets, a text in brackets. grids: that nodes and skins apply; ngrids may be 0. */
typedef struct vgi_gltf_cast {
    const vgi_gltf_list *lists;
    size_t targets;
    size_t (*target)(const void *context, size_t t, size_t l);
    const void *context;
    const vgi_json *names;
    bool own_targets;   /* those that the file has, and their weights, stay */
    bool shapes;        /* targets are shapes, with the default weights of those that the file has */
    const vgi_gltf_grid *grids;
    size_t ngrids;
} vgi_gltf_cast;
/* vgi_gltf_trim_cast: drop what is not written again from the document of the character, and gather the bytes of the rest. */
int vgi_gltf_trim_cast(vgi_gltf_writing *w, bool quantized, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_trim_whole, vgi_gltf_say_whole: the same for a file with animations and targets of its own. */
int vgi_gltf_trim_whole(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK;
int vgi_gltf_say_whole(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK;
int vgi_gltf_say_cast(vgi_gltf_writing *w, const vgi_gltf_cast *k, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_say_elements: write the elements of a list of a file as text. */
int vgi_gltf_say_elements(const vgi_json *document, const char *list, vg_bytes *to, size_t *n,
                          vg_err *e) VG_MUST_CHECK;
int vgi_gltf_say_cast_asset(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK;

/* ---- gltf_library.c: materials of a mesh that has only their names, and of a library if there is one ---- */
int vgi_gltf_find_materials(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK;
int vgi_gltf_describe_library(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK;
int vgi_gltf_say_materials(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK; /* "materials":[...], and the lists that they need */
size_t vgi_gltf_material(const vgi_gltf_writing *w, const char *name);

int vgi_gltf_say(vg_bytes *to, vg_err *e, const char *format, ...) VG_PRINTF(3, 4);
int vgi_gltf_say_text(vg_bytes *to, const char *s, vg_err *e) VG_MUST_CHECK; /* in quotes */
int vgi_gltf_say_numbers(vg_bytes *to, const char *before, const double *p, size_t n, const char *behind,
                         vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_say_names: "KEY":[names of n frames from `first` on]. */
int vgi_gltf_say_names(vgi_gltf_writing *w, const char *key, size_t first, size_t n, vg_err *e) VG_MUST_CHECK;

/* ---- gltf_takes.c: division into animations, with names and times ---- */
/* vgi_gltf_find_takes: one for all frames; or, with split, one for each name prefix: "Walk.0001", "Walk.0002",
 * "Run.0001". */
int vgi_gltf_find_takes(vgi_gltf_writing *w, bool split, vg_err *e) VG_MUST_CHECK;
int vgi_gltf_describe_times(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK;
int vgi_gltf_emit_times(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK;
int vgi_gltf_say_take_name(vgi_gltf_writing *w, const vgi_gltf_take *t, vg_err *e) VG_MUST_CHECK; /* in quotes */

/* vgi_gltf_say_primitives: "primitives":[...], one for each kind of face; moving: text for attributes and targets. */
int vgi_gltf_say_primitives(vgi_gltf_writing *w, const vg_bytes *moving, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_say_seams: originals of the copies, for extras, with a leading comma; nothing without copies. */
int vgi_gltf_say_seams(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_say_attributes: of a mesh that is no character: texture coordinates and colours, a comma in front of each. */
int vgi_gltf_say_attributes(vgi_gltf_writing *w, vg_bytes *to, vg_err *e) VG_MUST_CHECK;
int vgi_gltf_say_mesh_name(vgi_gltf_writing *w, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_view: a view of the next bytes of the buffer; more: additional JSON. */
int vgi_gltf_view(vgi_gltf_writing *w, size_t bytes, const char *more, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_say_accessor: an accessor into the last view; bounds (may be NULL): minimum and maximum, `width` numbers
 * each. Its number is w->naccessors before the call. */
int vgi_gltf_say_accessor(vgi_gltf_writing *w, size_t off, int component, size_t count, const char *type,
                          const double *bounds, size_t width, vg_err *e) VG_MUST_CHECK;

void vgi_gltf_put_single(unsigned char *to, float x);
float vgi_gltf_get_single(const unsigned char *p);
/* vgi_gltf_emit_points: n points of three numbers each, as numbers of this kind. apart: each starts at a multiple of 4 bytes;
 * else only the end is filled up to one. */
int vgi_gltf_emit_points(vgi_gltf_writing *w, vgi_gltf_numbers kind, const float *p, size_t n, bool apart,
                         vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_emit: write bytes of the buffer, raw or as base64. */
int vgi_gltf_emit(vgi_gltf_writing *w, const unsigned char *p, size_t n, vg_err *e) VG_MUST_CHECK;
int vgi_gltf_emit_singles(vgi_gltf_writing *w, const float *p, size_t n, vg_err *e) VG_MUST_CHECK;
/* vgi_gltf_load: read n bytes of the spool. */
int vgi_gltf_load(const vgi_gltf_writing *w, uint64_t off, unsigned char *to, size_t n, vg_err *e) VG_MUST_CHECK;
void vgi_gltf_bounds(const float *p, size_t points, double bounds[6]); /* least x y z, most x y z */

#endif
