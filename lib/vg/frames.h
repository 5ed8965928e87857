/* vg/frames.h: a sequence: its head, the artefacts that a head can hold, its frames.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_FRAMES_H
#define VG_PART_FRAMES_H

#include "vg/body.h"
#include "vg/signal.h"
#include "vg/network.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The faces of a source mesh that drive each face of a target mesh (MATH 9). */
typedef struct vg_correspondence {
    size_t source_nv, source_nf, target_nv, target_nf;
    uint64_t source_digest, target_digest; /* vg_mesh_digest of both */
    uint32_t *first;    /* target_nf + 1; NULL: there is no correspondence. first[f] < first[f + 1]: every face is
                           driven */
    uint32_t *source;   /* pairs of target face f: source[first[f]] .. source[first[f + 1] - 1] */
    double *weight;     /* of each pair, > 0; the weights of one target face sum to 1 */
    double *distance;   /* target_nf: distance from its centroid to that of the matched source face, after fitting,
                           in mesh units of the target */
    uint8_t *matched;   /* target_nf: 1: matched; 0: follows the nearest matched face; 2, for all faces or none:
                           the target is bound to the source (vg_bind) */
} vg_correspondence;

void vg_correspondence_clear(vg_correspondence *c);
int vg_correspondence_copy(vg_correspondence *to, const vg_correspondence *from, vg_err *e) VG_MUST_CHECK;

/* What drives a map: the transforms of patches, or of the bones of a rig. */
typedef enum vg_map_kind { VG_MAP_PATCHES = 1, VG_MAP_BONES = 2 } vg_map_kind;

/* Vertices as a linear function of transforms (MATH 7; T 6.3): with transform p taking x to A_p x + t_p, vertex v
 * is at sum over p of A_p e_vp + tau_vp t_p. The parts of the operator are kept, so that it can be made for
 * another body. */
typedef struct vg_map {
    size_t n;            /* transforms; 0: there is no map */
    size_t nv;           /* vertices, those of the mesh */
    vg_map_kind kind;
    double *weights;     /* nv x 4n: e_vp and tau_vp for each p */
    double *place;       /* n x 3n: if only the A are known, t_p - root = sum over j of A_j times three numbers */
    double *centre;      /* n points: of each patch in the reference pose */
    double *home_centre; /* the same on the body that poses are measured on */
    double *share;       /* n, sum 1: root = sum of share_p (A_p centre_p + t_p) */
    double size;         /* size of this body relative to the one that poses are measured on */
    bool has_home;       /* set if poses are measured on another body: */
    double *home;        /* its reference pose, nv points; NULL: the mesh's own */
    size_t nhinges;      /* pairs of adjacent patches; none for bones, which have a skeleton */
    uint32_t *hinge;     /* two patches each */
    double *hinge_at;    /* the point in the reference pose that both should move alike */
    double *hinge_weight;
    size_t ncorners;     /* corners of the vector graph; 0: vertices follow the skin of the rig alone */
    size_t per_corner;   /* transforms that drive a corner: 1, or 2 bones */
    double *corner;      /* per_corner quaternions each: the vector of the corner is the sum of A_p Q r Q* over its
                            p */
    uint32_t *corner_bone; /* bones: per_corner p for each corner; patches: NULL, p is that of the face */
    size_t nheld;        /* vertices held at the position given by their patch, or by the skin of the rig */
    uint32_t *held;      /* ascending */
    uint32_t *held_patch; /* patches only */
    double *held_at;     /* patches only: the point in the reference pose that the patch moves there */
    size_t nnames;       /* 0 or n */
    char **names;
} vg_map;

void vg_map_clear(vg_map *m);
int vg_map_copy(vg_map *to, const vg_map *from, vg_err *e) VG_MUST_CHECK;

/* One process that took part in making a stream. parents are positions in the same list, each before its own. */
typedef struct vg_provenance {
    char *program, *version;
    size_t nargs;
    char **args;
    size_t nparents;
    uint32_t *parents;
} vg_provenance;

/* A record of the stream that this version does not know and passes on. */
typedef struct vg_record {
    char tag[5];
    uint32_t flags;
    vg_bytes payload;
} vg_record;

typedef struct vg_records {
    size_t n;
    vg_record *at;
} vg_records;

void vg_records_clear(vg_records *r);

/* The element that values belong to. */
typedef enum vg_element {
    VG_OF_UNKNOWN = 0, /* an element that this version does not know */
    VG_OF_VERTEX,      /* of the mesh */
    VG_OF_CORNER,      /* of the vector graph */
    VG_OF_JOINT,       /* of the skeleton of the mesh */
    VG_OF_TRANSFORM,   /* of frames of transforms */
    VG_OF_ANCHOR,
    VG_OF_FRAME,       /* the whole frame: always one */
    VG_OF_COMPONENT,   /* of the mesh or its selection */
    VG_OF_LIST,        /* a list of vertices of the mesh, ascending, instead of numbers */
    VG_ELEMENTS
} vg_element;

const char *vg_element_name(vg_element e); /* "vertex", "corner", ..., "vertex list"; "unknown" */

/* The form of frames: the meaning of their values. A stream gives name, element and width; this version knows
 * these forms (table in model/form.c). */
typedef enum vg_kind {
    VG_OTHER = 0,         /* a form that this version does not know: vg_head.form is its name */
    VG_VERTICES = 1,      /* 3 numbers per vertex: position */
    VG_VECTORS = 2,       /* 3 per corner of the vector graph: from the face's centroid to the vertex */
    VG_DEFORMATIONS = 3,  /* 4 per corner of the vector graph: quaternion w x y z, squared length = scale */
    VG_TRANSFORMS = 4,    /* 7 per bone or patch: quaternion w x y z as above, then translation */
    VG_FEATURES = 5,      /* vg_head.width per vertex */
    VG_COORDINATES = 6,   /* vg_head.width per frame, which has one element */
    VG_KINDS
} vg_kind;

size_t vg_kind_width(vg_kind k);         /* 3, 3, 4, 7; 0: given by the head */
const char *vg_kind_name(vg_kind k);     /* "vertices", ... ; "unknown" */
vg_element vg_kind_element(vg_kind k);

typedef enum vg_precision { VG_F32 = 4, VG_F64 = 8 } vg_precision;

/* Everything that a stream says before its frames. Frames carry vertices of the body's mesh, values on its vector
 * graph (see vg_graph), or transforms. */
typedef struct vg_head {
    vg_body body;
    vg_correspondence correspondence; /* a stream of vg-register: mesh and reference are the source's, its frame is
                                         fitted to the target */
    vg_map map;           /* a stream of vg-fitmap */
    vg_signal signal;     /* a stream of vg-fitsignal */
    vg_network network;   /* a stream of vg-train */
    vg_selection selection;
    vg_links links;
    size_t nanchors;
    uint32_t *anchors;    /* vertices (ascending) whose position each frame of vectors or deformations gives */
    size_t nprovenance;
    vg_provenance *provenance;
    vg_records extra;     /* unknown records, in order */
    vg_kind kind;
    char *form;           /* VG_OTHER: the form's name */
    char *form_element;   /* VG_OTHER: what its elements are called */
    size_t width;         /* numbers per element, for forms whose width is not fixed; see vg_head_width */
    vg_precision precision;
    size_t count;         /* elements of a frame: nv, corners of the graph, number of transforms, 1 */
} vg_head;

size_t vg_head_width(const vg_head *h);          /* numbers per element of a frame */
const char *vg_head_form(const vg_head *h);      /* the name of any form */
vg_element vg_head_element(const vg_head *h);
/* vg_head_elements: the number of such elements in a frame; SIZE_MAX: unknown. */
size_t vg_head_elements(const vg_head *h, vg_element e);

void vg_head_clear(vg_head *h);
int vg_head_copy(vg_head *to, const vg_head *from, vg_err *e) VG_MUST_CHECK;
/* vg_head_move: all of *from into *to, whose former content is released; *from becomes empty. */
void vg_head_move(vg_head *to, vg_head *from);

/* vg_head_take: move one thing from one head to another, by its name: "mesh", "attributes", "asset", "reference" (with its
 * name), "skeleton", "patches", "rig" (with its skin), "selection", "links", "anchors", "correspondence", "map", "signal",
 * "network"; NULL: all of them. What `to` had of it is released; `from` has none afterwards. */
void vg_head_take(vg_head *to, vg_head *from, const char *what);
/* vg_head_put: the same from the struct of the thing alone: a vg_map for "map", a vg_rig for "rig", and so on. */
void vg_head_put(vg_head *to, void *from, const char *what);
/* vg_head_take_out: the other way round: the struct `to`, which need not be initialised, gets what `from` has. */
void vg_head_take_out(void *to, vg_head *from, const char *what);
/* vg_head_drop: release one thing, by its name. */
void vg_head_drop(vg_head *h, const char *what);
/* vg_head_need: VG_OK if h holds it; else VG_EINPUT: "<subject> holds no map: make one with vg-fitmap". */
int vg_head_need(const vg_head *h, const char *what, const char *subject, vg_err *e) VG_MUST_CHECK;

/* vg_head_trace: append the record of this process. Its parents are the records that no other names as a parent: the
 * last of the stream's own, and of every one that vg_head_merge_trace has put before it. argv is argc strings; bytes
 * that are no UTF-8 become '?'. */
int vg_head_trace(vg_head *h, const char *program, int argc, char *const *argv, vg_err *e) VG_MUST_CHECK;

/* vg_head_merge_trace: put the provenance of a second input before that of this process (call before
 * vg_head_trace). */
int vg_head_merge_trace(vg_head *h, const vg_head *other, vg_err *e) VG_MUST_CHECK;

/* Data of a frame beside its values: `width` numbers for each element, or a list of vertices. Some names have a
 * meaning (fmt/STREAM.md, section 3.12): "anchors", "pins", "turns". */
typedef struct vg_channel {
    char *name, *unit;   /* UTF-8: "error", never ""; "D", or "" */
    vg_element element;
    char *element_name;  /* its name in the stream, even if the element is unknown */
    size_t width, count; /* numbers of an element; elements */
    double *numbers;     /* count * width; NULL: it is a list */
    uint32_t *vertices;  /* of VG_OF_LIST: count; else NULL */
    vg_precision precision; /* precision in a stream; 0: that of the values */
    vg_bytes texts, data; /* private: storage of the pointers above */
} vg_channel;

/* One pose. The struct is reused from frame to frame; its arrays grow and stay. */
typedef struct vg_frame {
    char *name; /* UTF-8, never NULL in a frame that was read */
    bool has_time;
    double time; /* seconds */
    double root[3];  /* forms on corners: mean of the vertices that are in the vector graph */
    size_t nchannels;
    vg_channel *channels;
    double *values;  /* head.count * vg_head_width(head) */
    vg_records extra; /* unknown records that came before this frame */
    /* private to the reader and to vg_frame_*: */
    vg_bytes raw;
    size_t name_cap, values_cap, channels_cap;
    double *values_own;
} vg_frame;

void vg_frame_clear(vg_frame *f);
/* vg_frame_shape: allocate the values, and the anchors of forms on corners; contents undefined, no other channels. */
int vg_frame_shape(vg_frame *f, const vg_head *h, vg_err *e) VG_MUST_CHECK;
int vg_frame_rename(vg_frame *f, const char *name, vg_err *e) VG_MUST_CHECK;
/* vg_frame_label: move name, time and unknown records from `from`, but no numbers and no channels except f's own
 * anchors. `from` loses its records. */
int vg_frame_label(vg_frame *f, vg_frame *from, vg_err *e) VG_MUST_CHECK;

/* The rate of sequences whose frames have no times, in frames per second; also in page_read.js, and stated in vg(7). */
enum { VG_FPS = 24 };
/* vg_frame_stem: a frame called "Walk.0001" is number 1 of the animation "Walk": the length of "Walk". 0: the name has no
 * such form; number is then of no meaning. */
size_t vg_frame_stem(const char *name, uint64_t *number);
/* vg_frame_begins: whether a name is that of an animation's first frame: number 1, as frames of an animation count from 1. */
bool vg_frame_begins(const char *name);

/* vg_frame_channel: the channel of this name; NULL: there is none. */
vg_channel *vg_frame_channel(const vg_frame *f, const char *name);
/* vg_frame_add: allocate a channel, replacing the one of that name. Its contents are undefined. *c is valid until
 * the next one is added or dropped. Nothing is allocated if the frame once had a channel as large. */
int vg_frame_add(vg_frame *f, const char *name, const char *unit, vg_element element, size_t width, size_t count,
                 vg_channel **c, vg_err *e) VG_MUST_CHECK;
void vg_frame_drop(vg_frame *f, const char *name); /* it may exist or not */
void vg_frame_drop_all(vg_frame *f);

/* The channels with a meaning. The arguments are copied; n = 0: none. */
/* anchors: positions of head.nanchors vertices in frames on corners. NULL: there are none. vg_frame_make_anchors:
 * allocate n of them. */
double *vg_frame_anchors(const vg_frame *f);
int vg_frame_make_anchors(vg_frame *f, size_t n, double **positions, vg_err *e) VG_MUST_CHECK;
/* pins: vertices (ascending) that keep their reference positions in this frame of vectors. */
const uint32_t *vg_frame_pins(const vg_frame *f, size_t *n);
int vg_frame_pin(vg_frame *f, const uint32_t *vertices, size_t n, vg_err *e) VG_MUST_CHECK;
/* turns: a unit quaternion w x y z for each joint of the skeleton whose joints are the vertices: its rotation
 * relative to the skeleton's pose without rotations, because positions do not determine twist. */
const double *vg_frame_turns(const vg_frame *f, size_t *n);
int vg_frame_turn(vg_frame *f, const double *turns, size_t njoints, vg_err *e) VG_MUST_CHECK;
/* scalars: the first channel with one number for each vertex, such as its error, under any name. */
vg_channel *vg_frame_scalars(const vg_frame *f);
int vg_frame_set_scalars(vg_frame *f, const char *name, const char *unit, const double *numbers, size_t nv,
                         vg_err *e) VG_MUST_CHECK;

#ifdef __cplusplus
}
#endif
#endif
