/* vg/frames.h: a sequence: its head, the artefacts that a head can hold, its frames.
 * A part of vg.h, which says what holds for all parts.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef VG_PART_FRAMES_H
#define VG_PART_FRAMES_H

#include "vg/body.h"
#include "vg/signal.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Which faces of a source mesh drive each face of a target mesh (MATH 9). */
typedef struct vg_correspondence {
    size_t source_nv, source_nf, target_nv, target_nf;
    uint64_t source_digest, target_digest; /* vg_mesh_digest of both */
    uint32_t *first;    /* target_nf + 1; NULL: there is no correspondence. first[f] < first[f + 1]: every face is
                           driven */
    uint32_t *source;   /* pairs of target face f: source[first[f]] .. source[first[f + 1] - 1] */
    double *weight;     /* of each pair, > 0; of one target face they sum to 1 */
    double *distance;   /* target_nf: from its centroid to the matched source face's, after fitting, mesh units of the
                           target */
    uint8_t *matched;   /* target_nf: 1: found near by; 0: rides with the nearest matched face */
} vg_correspondence;

void vg_correspondence_clear(vg_correspondence *c);
int vg_correspondence_copy(vg_correspondence *to, const vg_correspondence *from, vg_err *e) VG_MUST_CHECK;

/* What drives a map: the transforms of patches, or of the bones of a rig. */
typedef enum vg_map_kind { VG_MAP_PATCHES = 1, VG_MAP_BONES = 2 } vg_map_kind;

/* Vertices as a linear function of transforms (MATH 7; T 6.3): with transform p taking x to A_p x + t_p, vertex v is
 * at sum over p of A_p e_vp + tau_vp t_p. What the operator was made of is kept,
 * so that it can be made for another body. */
typedef struct vg_map {
    size_t n;            /* transforms; 0: there is no map */
    size_t nv;           /* vertices, those of the mesh */
    vg_map_kind kind;
    double *weights;     /* nv x 4n: e_vp and tau_vp, p after p */
    double *place;       /* n x 3n: where only the A are known, t_p - root = sum over j of A_j times three numbers */
    double *centre;      /* n points: of each patch in the reference pose */
    double *home_centre; /* the same on the body that poses are measured on */
    double *share;       /* n, sum 1: root = sum of share_p (A_p centre_p + t_p) */
    double size;         /* of this body beside the one that poses are measured on */
    bool has_home;       /* the body that poses are measured on is another one: */
    double *home;        /* its reference pose, nv points; NULL: the mesh's own */
    size_t njoints;      /* pairs of patches that hang together; of bones none: their skeleton says how they do */
    uint32_t *joint;     /* two patches each */
    double *joint_at;    /* the point in the reference pose that both move alike, as well as can be */
    double *joint_weight;
    size_t ncorners;     /* of the vector graph; 0: vertices follow the skin of the rig alone */
    size_t per_corner;   /* transforms that drive a corner: 1, or 2 bones */
    double *corner;      /* per_corner quaternions each: the vector of the corner is the sum of A_p Q r Q* over its
                            p */
    uint32_t *corner_bone; /* bones: per_corner p for each corner; patches: NULL, p is that of the face */
    size_t nheld;        /* vertices held where their patch takes them, or the skin of the rig */
    uint32_t *held;      /* ascending */
    uint32_t *held_patch; /* patches only */
    double *held_at;     /* patches only: the point in the reference pose that the patch takes there */
    size_t nnames;       /* 0 or n */
    char **names;
} vg_map;

void vg_map_clear(vg_map *m);

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

/* What the values of a frame are, per element. */
typedef enum vg_kind {
    VG_VERTICES = 1,     /* 3 numbers per vertex: position */
    VG_VECTORS = 2,      /* 3 per corner of the vector graph: from the face's centroid to the vertex */
    VG_DEFORMATIONS = 3, /* 4 per corner of the vector graph: quaternion w x y z, squared length = scale */
    VG_TRANSFORMS = 4    /* 7 per bone or patch: quaternion w x y z as above, then translation */
} vg_kind;

size_t vg_kind_width(vg_kind k);         /* 3, 3, 4, 7 */
const char *vg_kind_name(vg_kind k);     /* "vertices", ... ; "unknown" */

typedef enum vg_precision { VG_F32 = 4, VG_F64 = 8 } vg_precision;

/* All that is known of a sequence before its frames. Frames carry vertices of the body's mesh, or values on its
 * vector graph (see vg_graph), or transforms. */
typedef struct vg_head {
    vg_body body;
    vg_correspondence correspondence; /* a stream of vg-register: mesh and reference are the source's, its frame is
                                         fitted to the target */
    vg_map map;           /* a stream of vg-fitmap */
    vg_signal signal;     /* a stream of vg-fitsignal */
    bool has_selection;   /* only the faces `selected` (ascending) carry vectors; else all do */
    size_t nselected;
    uint32_t *selected;
    bool has_links;       /* links were chosen (perhaps none were needed) */
    size_t nlinks;
    uint32_t *links;      /* nlinks pairs of vertices: virtual 2-vertex faces that join components */
    size_t nanchors;
    uint32_t *anchors;    /* vertices (ascending) whose position each frame of vectors or deformations gives */
    size_t nprovenance;
    vg_provenance *provenance;
    vg_records extra;     /* unknown records, in order */
    vg_kind kind;
    vg_precision precision;
    size_t count;         /* elements of a frame: nv, corners of the graph, or number of transforms */
} vg_head;

void vg_head_clear(vg_head *h);
int vg_head_copy(vg_head *to, const vg_head *from, vg_err *e) VG_MUST_CHECK;

/* vg_head_need: VG_OK when h holds `what`: "mesh", "skeleton", "correspondence", "patches", "rig", "map"; else
 * VG_EINPUT: "<subject> holds no map: make one with vg-fitmap". */
int vg_head_need(const vg_head *h, const char *what, const char *subject, vg_err *e) VG_MUST_CHECK;

/* vg_head_trace: append the record of this process. Its parents are the records that no other names as a parent: the
 * last of the stream's own, and of every one that vg_head_merge_trace has put before it. argv is argc strings; bytes
 * that are no UTF-8 become '?'. */
int vg_head_trace(vg_head *h, const char *program, int argc, char *const *argv, vg_err *e) VG_MUST_CHECK;

/* vg_head_merge_trace: put the provenance of a second input before that of this process (call before
 * vg_head_trace). */
int vg_head_merge_trace(vg_head *h, const vg_head *other, vg_err *e) VG_MUST_CHECK;

/* One pose. The struct is reused from frame to frame; its arrays grow and stay. */
typedef struct vg_frame {
    char *name; /* UTF-8, never NULL in a frame that was read */
    bool has_time;
    double time; /* seconds */
    double root[3];  /* vectors, deformations: mean of the vertices that are in the vector graph */
    double *anchors; /* vectors, deformations: head.nanchors points */
    size_t npins;    /* vectors: vertices (ascending) that stay where the reference has them, in this frame; set by
                        vg_frame_pin */
    uint32_t *pins;
    size_t nturns;   /* vertices of a skeleton: number of joints when it is known how they have turned, else 0; set by
                        vg_frame_turn */
    double *turns;   /* a unit quaternion w x y z each, beside the skeleton's pose without rotations: positions do not
                        say it all */
    bool has_scalars; /* vertices: a number for each vertex comes with the frame, such as its error; set by
                         vg_frame_scalars */
    char *scalars_name, *scalars_unit; /* UTF-8: "error", never ""; "D", or "" */
    double *scalars;  /* mesh.nv */
    double *values;  /* head.count * vg_kind_width(head.kind) */
    vg_records extra; /* unknown records that came before this frame */
    /* private to the reader and to vg_frame_*: */
    vg_bytes raw;
    size_t name_cap, anchors_cap, pins_cap, turns_cap, values_cap, scalars_name_cap, scalars_unit_cap, scalars_cap;
    double *values_own;
} vg_frame;

void vg_frame_clear(vg_frame *f);
/* vg_frame_shape: make room for the values and anchors of a frame of h; contents undefined, no scalars. */
int vg_frame_shape(vg_frame *f, const vg_head *h, vg_err *e) VG_MUST_CHECK;
/* vg_frame_pin, _turn, _rename: the frame has these from now on (copied; n or njoints 0: none). */
int vg_frame_pin(vg_frame *f, const uint32_t *vertices, size_t n, vg_err *e) VG_MUST_CHECK;
int vg_frame_turn(vg_frame *f, const double *turns, size_t njoints, vg_err *e) VG_MUST_CHECK;
int vg_frame_rename(vg_frame *f, const char *name, vg_err *e) VG_MUST_CHECK;
/* vg_frame_scalars: numbers (nv of them, copied) come with the frame from now on,
 * until it is shaped or labelled again. */
int vg_frame_scalars(vg_frame *f, const char *name, const char *unit, const double *numbers, size_t nv,
                     vg_err *e) VG_MUST_CHECK;
/* vg_frame_label: take over name, time and unknown records of `from`, but no numbers, pins, turns or scalars; `from`
 * loses its records. */
int vg_frame_label(vg_frame *f, vg_frame *from, vg_err *e) VG_MUST_CHECK;

#ifdef __cplusplus
}
#endif
#endif
